#include "tests/effects/pairs.h"

#include <fmt/format.h>

#include <cstring>

#include "tests/effects/referee.h"

namespace palpate::tests {
namespace {

// ---- refusals ----------------------------------------------------------------------------------------------------------

// Why two effects exclude one another. These are all: the test fails where a scene is refused and stands in none of them, and where one of
// them is not refused.
struct Refusal {
  const char* key;
  std::vector<const char*> some, others;
  const char* reason;
};
const std::vector<Refusal>& refusals() {
  static const std::vector<const char*> large = {"large", "large beside", "large renewed"},
                                        points = {"contact node", "contact triangle", "contact point"};
  static const std::vector<Refusal> list = {
      {"a",
       {"force response (Q)", "radial response (P)"},
       large,
       "Q and P correct a linear answer by curves that were measured under large strains; a hyperelastic body has "
       "these in its law."},
      {"b",
       {"grasps"},
       points,
       "Jaws turn the tissue that they hold. A disc takes up a torque; a point, and a node, take none."},
      {"c", {"dent"}, points, "A dent is that of a disc, and a point presses no disc."},
      {"d",
       {"cut"},
       {"force response (Q)", "radial response (P)"},
       "Response curves were measured on the whole organ."},
      {"e",
       {"cut"},
       {"shape volume", "inside", "needles", "interior f16"},
       "What lies below the surface is known for the whole mesh alone and does not follow a cut."},
      {"f",
       {"cut"},
       {"queries", "crossings", "fine surface", "skin", "dent"},
       "What is bound to the triangles of the whole organ does not follow a cut."},
      {"g",
       {"cut"},
       {"volumes held"},
       "A volume that is held does not follow a cut: it is found from the whole organ."},
  };
  return list;
}

bool has(const std::vector<const char*>& names, const char* name) {
  return std::any_of(names.begin(), names.end(), [&](const char* n) { return std::strcmp(n, name) == 0; });
}

const Refusal* refusal_of(const Effect& a, const Effect& b) {
  for (const Refusal& refusal : refusals())
    if ((has(refusal.some, a.name) && has(refusal.others, b.name)) ||
        (has(refusal.some, b.name) && has(refusal.others, a.name)))
      return &refusal;
  return nullptr;
}

// ---- a pair ------------------------------------------------------------------------------------------------------------

// What the referee asks of a scene beside its effects: a report, and under large deformation the displacement of every node.
SceneOfEffects watched(SceneOfEffects of) {
  of.def.report.report = PALPATE_REPORT_CONTACTS;
  // The box that can be cut has all of its nodes among those of the surface.
  if (of.def.large.deformation != PALPATE_DEFORMATION_LINEAR && !of.cut) of.def.shape = PALPATE_SHAPE_VOLUME;
  return of;
}

// The tools and the contact nodes, to the bit.
bool same_touch(Stage& one, Stage& other) {
  bool same = one.flags == other.flags;
  for (int k = 0; k < one.organs(); ++k) {
    const palpate_contacts &a = one.contacts(k), &b = other.contacts(k);
    same = same && a.tool_count == b.tool_count && a.node_count == b.node_count &&
           std::memcmp(palpate_contacts_tool(&a, 0), palpate_contacts_tool(&b, 0),
                       static_cast<std::size_t>(a.tool_count) * a.tool_state_bytes) == 0 &&
           std::memcmp(palpate_contacts_node(&a, 0), palpate_contacts_node(&b, 0),
                       static_cast<std::size_t>(a.node_count) * a.node_bytes) == 0;
  }
  return same;
}

constexpr int kRestoredAt = 100;
// Steps at the end that stand still, in which nothing may be flagged, and how many of all may be.
constexpr int kMustTrust = 20, kMayFlag = 60;

// Three scenes: the pair; the same with what the referee asks for, which must feel the same bits; and from the middle on one that begins
// with the state of the first.
class Played {
 public:
  explicit Played(const SceneOfEffects& of)
      : plain_(of),
        seen_(watched(of)),
        restored_(of),
        referee_(watched(of), seen_),
        may_flag_(of.touching ? PALPATE_STEP_NOT_TOUCHABLE : 0) {}

  void step(int s) {
    plain_.step(s), seen_.step(s);
    referee_.check(s);
    if (differs_ < 0 && !same_touch(plain_, seen_)) differs_ = s;
    if (s == kRestoredAt) restored_.restore(plain_);
    if (s > kRestoredAt) {
      restored_.step(s);
      if (goes_on_ < 0 && !same_touch(plain_, restored_)) goes_on_ = s;
    }
    if ((seen_.flags & ~may_flag_) != 0 && s >= kSteps - kMustTrust) flagged_ = s, last_flags_ = seen_.flags;
  }
  double worst() const { return referee_.worst(); }
  std::string faults() const {
    std::string faults;
    if (differs_ >= 0) faults += fmt::format("A report changes the bits of step {}. ", differs_);
    if (goes_on_ >= 0) faults += fmt::format("A restored scene has other bits in step {}. ", goes_on_);
    if (flagged_ >= 0) faults += fmt::format("Step {} stands still and is flagged {:#x}. ", flagged_, last_flags_);
    if (referee_.trusted < kSteps - kMayFlag) faults += fmt::format("Only {} steps are trusted. ", referee_.trusted);
    for (const auto& [kind, error] : referee_.errors())
      if (!(error <= kWorst)) faults += fmt::format("{}: {:.2g}. ", kind, error);
    return faults;
  }

 private:
  Stage plain_, seen_, restored_;
  Referee referee_;
  // Where organs touch: nothing holds a vertex that comes in past a side of the other organ, and steps say so (docs/method.md, section 17).
  palpate_step_flags may_flag_;
  int differs_ = -1, goes_on_ = -1, flagged_ = -1;  // the first, and for flagged the last, step
  palpate_step_flags last_flags_ = 0;               // of that one
};

void play(const SceneOfEffects& of, PairFound* found) {
  try {
    Played played(of);
    for (int s = 0; s < kSteps; ++s) played.step(s);
    found->error = played.worst(), found->faults = played.faults();
  } catch (const std::exception& broke) {  // Newton's method that does not converge, a state that is refused
    found->error = INFINITY, found->faults = broke.what();
  }
}

// Whether the scene is refused exactly where the page gives a reason.
bool is_made(const Effect& a, const Effect& b, PairFound* found) {
  const Refusal* const refusal = refusal_of(a, b);
  const Stage stage(scene_with({&a, &b}));
  if (stage.made() && !refusal) return true;
  found->refusal = refusal ? refusal->key : "?";
  if (stage.made())
    found->faults = "The scene is made, though the page gives a reason against it. ";
  else if (!refusal)
    found->faults = fmt::format("Refused: {}. ", stage.refusal().text);
  else if (stage.refusal().text[0] == '\0')
    found->faults = "Refused without a sentence. ";
  return false;
}

PairFound play(const Effect& a, const Effect& b) {
  PairFound found;
  found.effects[0] = a.name, found.effects[1] = b.name;
  found.alternatives = &a != &b && a.slot == b.slot && a.slot != Slot::own;
  if (found.alternatives || !is_made(a, b, &found)) return found;
  play(scene_with({&a, &b}), &found);
  return found;
}

// ---- the page ----------------------------------------------------------------------------------------------------------

// A pair's cell: the smallest class that holds its error.
std::string cell_of(const PairFound& found) {
  if (found.alternatives) return "·";
  if (!found.refusal.empty()) return found.refusal;
  for (std::size_t c = 0; c < std::size(kClasses); ++c)
    if (found.error <= kClasses[c]) return std::to_string(c + 1);
  return "!";
}

}  // namespace

std::vector<PairFound> play_pairs_of(std::size_t first) {
  std::vector<PairFound> found;
  for (std::size_t second = 0; second <= first; ++second) found.push_back(play(effects()[first], effects()[second]));
  return found;
}

std::string faults_of_crowd(const std::vector<const char*>& names) {
  std::vector<const Effect*> all;
  for (const Effect& effect : effects())
    if (has(names, effect.name)) all.push_back(&effect);
  PairFound found;
  play(scene_with(all), &found);
  return all.size() == names.size() ? found.faults : "a name is not that of an effect";
}

std::string page_of(const std::vector<std::vector<PairFound>>& found) {
  std::string page =
      "# Every pair of effects\n\n"
      "Any two effects act together, or a scene with both is refused for a reason. `make -f Makefile.data "
      "effects-page` plays every pair and "
      "writes\nthis page; a test ([tests/effects](../tests/effects/README.md)) plays them again and compares.\n\n"
      "Each scene has both effects on a box of 64 nodes, 200 steps long: a finger that presses, drags, leaves and "
      "comes again, a grip, and what "
      "the\ntwo effects add. In each step the forces that it tells are put on the dense body, and what follows is "
      "compared with the step: "
      "places that are\nheld, laws, sums, torques, corrections, shapes. The error is the largest of all these, in "
      "parts of 3 mm or of the largest "
      "force. A scene that\ngoes on from a saved state, and one with a report, must have the same bits.\n\n"
      "Crowds are compared in the same way: all that one organ may have at once, 14 effects and more, under each law, "
      "on a linear organ and\nunder the three forms of large deformation; and two such organs that touch and are sewn "
      "together (`ctest -R EffectCrowds`).\n\n"
      "| cell | meaning |\n|---|---|\n"
      "| 1 | they act together; the error is at most 1e-5, that of single precision |\n"
      "| 2 | at most 1e-3: half precision; the end of iterations where lines or normals turn with the surface; the "
      "compliance of lips that press |\n"
      "| 3 | at most 3e-2: normals that lag behind the surface; the end of the steps of a hyperelastic body; discs "
      "that slide beside a cut |\n"
      "| · | two values of one effect: a scene has one of them |\n";
  for (const Refusal& refusal : refusals()) page += fmt::format("| {} | {} |\n", refusal.key, refusal.reason);
  page += "\nRows and columns are the same effects, in the same order.\n\n| |";
  for (std::size_t i = 0; i < found.size(); ++i) page += fmt::format(" {} |", i + 1);
  page += "\n|---|";
  for (std::size_t i = 0; i < found.size(); ++i) page += "---|";
  page += "\n";
  for (std::size_t i = 0; i < found.size(); ++i) {
    page += fmt::format("| {} {} |", i + 1, found[i][i].effects[0]);
    for (std::size_t j = 0; j < found.size(); ++j) page += fmt::format(" {} |", j <= i ? cell_of(found[i][j]) : "");
    page += "\n";
  }
  return page;
}

}  // namespace palpate::tests
