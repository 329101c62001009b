// A saved state, restored: the next steps have the same bits, whatever the scene played before. A state that is not the scene's is
// refused and changes nothing.
#include <cstring>
#include <random>

#include "tests/runtime/touched_box.h"
#include "tests/support/bundle_forms.h"
#include "tests/support/fine_body.h"
#include "tests/support/relaxation.h"

namespace palpate::tests {
namespace {

constexpr TinyBox kForm = {{4, 3, 3}, {0.06, 0.05, 0.04}};

const TouchedBox& box() {
  static const TouchedBox shared(kForm, add_everything);
  return shared;
}

// The box's surface with finer triangles and bumps of 0.3 mm.
const palpate_fine_surface& fine_surface() {
  static const FineHost host = fine_of(box().body, 1, 0.0003);
  static const palpate_fine_surface view = host.view();
  return view;
}

struct Combination {
  palpate_collision collision;
  palpate_contact_model contact;
  palpate_contact_law law;
  bool fine = false;
};

std::vector<Combination> combinations() {
  std::vector<Combination> all;
  for (const auto collision : {PALPATE_COLLISION_REST, PALPATE_COLLISION_DEFORMED})
    for (const auto contact : kEveryContact)
      for (const auto law : kEveryLaw) all.push_back({collision, contact, law});
  all.push_back({PALPATE_COLLISION_REST, PALPATE_CONTACT_PATCH, PALPATE_LAW_STICKING, true});
  all.push_back({PALPATE_COLLISION_DEFORMED, PALPATE_CONTACT_PATCH, PALPATE_LAW_COULOMB, true});
  all.push_back({PALPATE_COLLISION_DEFORMED, PALPATE_CONTACT_PATCH, PALPATE_LAW_UNILATERAL, true});
  all.push_back({PALPATE_COLLISION_DEFORMED, PALPATE_CONTACT_NODE, PALPATE_LAW_SLIDING, true});
  return all;
}

std::string name_of(const Combination& c) {
  return "collision " + std::to_string(c.collision) + " contact " + std::to_string(c.contact) + " law " +
         std::to_string(c.law) + (c.fine ? " fine" : "");
}

// radial: P corrects the shape, the force is linear; else Q corrects the force.
SceneDef def_of(const Combination& c, bool radial = false) {
  SceneDef def = with(SceneDef(), c.collision, c.contact, c.law);
  def.force = radial ? PALPATE_FORCE_LINEAR : PALPATE_FORCE_RESPONSE;
  if (radial) def.radial = PALPATE_RADIAL_RESPONSE;
  def.relaxation = relaxation_of({{0.4, 0.005}, {0.3, 0.5}});
  def.force_limit = 20, def.force_slew = 200;
  def.report.report = PALPATE_REPORT_CONTACTS;
  def.max_points = 16, def.max_contact_nodes = 120;
  if (c.fine) def.fine_surface = fine_surface();
  return def;
}

// The memory that one scene takes, in the order in which it takes it.
class Arena {
 public:
  using Bytes = std::vector<unsigned char>;
  palpate_allocator allocator() {
    return {[](void* user, std::size_t bytes, std::size_t alignment) -> void* {
              auto& arrays = static_cast<Arena*>(user)->arrays_;
              arrays.emplace_back(static_cast<unsigned char*>(std::aligned_alloc(alignment, bytes)), bytes);
              return arrays.back().first;
            },
            [](void* user, void* memory) {
              std::erase_if(static_cast<Arena*>(user)->arrays_,
                            [&](const auto& array) { return array.first == memory; });
              std::free(memory);
            },
            this};
  }
  std::size_t size() const {
    std::size_t sum = 0;
    for (const auto& [memory, bytes] : arrays_) sum += bytes;
    return sum;
  }
  Bytes copy() const {
    Bytes all;
    all.reserve(size());
    for (const auto& [memory, bytes] : arrays_) all.insert(all.end(), memory, memory + bytes);
    return all;
  }
  // Marks each byte that differs from an earlier copy. In place: a copy in each step is most of the time where new memory is slow.
  void mark_changes(const Bytes& before, std::vector<bool>* changed) const {
    constexpr std::size_t kBlock = 256;  // most are as they were
    std::size_t at = 0;
    for (const auto& [memory, bytes] : arrays_) {
      for (std::size_t first = 0; first < bytes; first += kBlock) {
        const std::size_t end = std::min(first + kBlock, bytes);
        if (std::memcmp(memory + first, &before[at + first], end - first) == 0) continue;
        for (std::size_t b = first; b < end; ++b)
          if (memory[b] != before[at + b]) (*changed)[at + b] = true;
      }
      at += bytes;
    }
  }
  // Overwrites the bytes that `changed` marks. Words that hold an address of this memory stay: where an array stands is not state.
  void scribble(const std::vector<bool>& changed) {
    std::size_t at = 0;
    for (const auto& [memory, bytes] : arrays_)
      for (std::size_t word = 0; word < bytes; word += 8, at += 8) {
        std::uintptr_t value = 0;
        std::memcpy(&value, memory + word, sizeof value);
        if (holds(value)) continue;
        for (std::size_t b = 0; b < 8; ++b)
          if (changed[at + b]) memory[word + b] = 0xa5;
      }
  }

 private:
  bool holds(std::uintptr_t address) const {
    return std::any_of(arrays_.begin(), arrays_.end(), [&](const auto& array) {
      const auto begin = reinterpret_cast<std::uintptr_t>(array.first);
      return address >= begin && address < begin + array.second;
    });
  }
  std::vector<std::pair<unsigned char*, std::size_t>> arrays_;
};

using State = std::vector<std::uint64_t>;

// A scene that plays a run whose input depends on the number of the step alone. Discs press, slide and rub; one tool holds the
// organ with grips that draw it apart; tools come, go, jump and send bad input; the organ moves; the scene and single tools are reset.
class Player {
 public:
  explicit Player(SceneDef def, const TouchedBox& on = box())
      : on_(on),
        scene_(on.scene(with_arena(def))),
        contacts_(scene_.get()),
        u_(3 * static_cast<std::size_t>(on.body.surface_nodes)) {}

  // Plays steps first .. last - 1. bytes: gets all output; nullptr: not wanted. each: called after each step.
  void play(int first, int last, std::string* bytes, const std::function<void()>& each = {}) {
    for (int s = first; s < last; ++s) {
      step(s);
      if (each) each();
      if (!bytes) continue;
      bytes->append(reinterpret_cast<const char*>(contacts_.get()), contacts_->used_bytes);
      *bytes += report();
      palpate_shape_out out = shape_out(u_.data(), nullptr, on_.body.surface_nodes);
      const palpate_step_flags flags = palpate_scene_shape(scene_.get(), contacts_, &out);
      bytes->append(reinterpret_cast<const char*>(&flags), sizeof flags);
      bytes->append(reinterpret_cast<const char*>(u_.data()), u_.size() * sizeof u_[0]);
    }
  }
  std::string played(int first, int last) {
    std::string bytes;
    play(first, last, &bytes);
    return bytes;
  }
  State save() {
    State state(palpate_scene_state_bytes(scene_.get()) / 8, 0xa5a5a5a5a5a5a5a5);
    palpate_error error = {};
    EXPECT_EQ(palpate_scene_save(scene_.get(), state.data(), 8 * state.size(), &error), PALPATE_OK) << error.text;
    return state;
  }
  palpate_status restore(const State& state, palpate_error* error = nullptr) {
    return palpate_scene_restore(scene_.get(), state.data(), 8 * state.size(), error);
  }
  std::string report() const {
    const palpate_contact_report* report = palpate_scene_report(scene_.get());
    return {reinterpret_cast<const char*>(report), report->used_bytes};
  }
  palpate_scene* scene() { return scene_.get(); }
  Contacts& contacts() { return contacts_; }
  Arena& arena() { return arena_; }
  palpate_step_flags raised = 0;  // so far
  int slips = 0, releases = 0;

 private:
  const SceneDef& with_arena(SceneDef& def) {
    def.allocator = arena_.allocator();
    return def;
  }
  void step(int s) {
    if (s % 67 == 50) palpate_scene_reset_tool(scene_.get(), 11);
    if (s % 97 == 80) palpate_scene_reset(scene_.get());
    if (s % 44 == 13) {  // the organ moves and turns from here on
      palpate_pose pose = palpate_default_pose();
      pose.position[0] = 1e-4 * (s % 7), pose.velocity[1] = 0.02, pose.velocity[2] = -0.01,
      pose.angular_velocity[0] = 0.4;
      EXPECT_EQ(palpate_scene_set_pose(scene_.get(), &pose, nullptr), PALPATE_OK);
    }
    Eigen::Vector3d points[4];
    for (int p = 0; p < 4; ++p) {
      const std::int32_t triangle = on_.far_triangle(p < 2 ? 3 * p : 8);
      points[p] = on_.place(triangle, {.3, .3, .4}) + 0.002 * std::cos(0.11 * s + 0.4 * p) * on_.outward(triangle) +
                  Eigen::Vector3d(0, 6e-4 * std::sin(0.07 * s + p), 4e-4 * std::cos(0.05 * s));
    }
    if (s % 23 == 7) points[1][0] = NAN;                       // the tool keeps its last good input
    if (s % 41 > 37) points[3][0] -= 0.05;                     // through the organ within one step: tracking is lost
    if (s % 29 > 26) points[0] += Eigen::Vector3d(0.3, 0, 0);  // faster than max_tool_speed
    palpate_grip grips[2];
    for (int g = 0; g < 2; ++g)
      grips[g] = grip_at_node(on_.touchable[(s / 9 + 5 * g) % 12],
                              {0, 5e-4 * std::sin(0.13 * s) + (g == 0 ? 1 : -1) * 2e-3, 1e-3 * std::cos(0.09 * s + g)},
                              g == 0 ? 7 : 5);
    std::vector<palpate_tool> tools = {point_tool(points[0].data(), 1, s % 35 < 20 ? 0.004 : 0.003, 0.3),
                                       point_tool(points[1].data(), 1, 0.003, 0.1), grip_tool(grips, 2)};
    for (int t = 0; t < 3; ++t) tools[t].id = 10 + t;
    if (s % 40 >= 15) tools.push_back(point_tool(points[2].data(), 2, 0.002, 0.5, s % 20 < 10)), tools.back().id = 99;
    if (s % 5 == 4) std::swap(tools[0], tools.back());
    const double dt = s % 31 == 30 ? NAN : 1e-3;  // keeps the last good one
    raised |= palpate_scene_touch(scene_.get(), tools.data(), static_cast<std::int32_t>(tools.size()), dt,
                                  contacts_.get(), contacts_.bytes());
    for (int t = 0; t < contacts_->tool_count; ++t)
      slips += palpate_contacts_tool(contacts_, t)->slip_count,
          releases += palpate_contacts_tool(contacts_, t)->release_count;
  }

  const TouchedBox& on_;
  Arena arena_;
  ScenePointer scene_;
  Contacts contacts_;
  std::vector<float> u_;
};

TEST(State, RestoredAnywhereGivesTheNextStepsTheSameBits) {
  const TouchedBox opened_again(kForm, add_everything);
  int contacts_at_saving = 0, slips = 0, releases = 0;
  palpate_step_flags flags = 0;
  for (const Combination& c : combinations())
    for (const bool radial : {false, true}) {
      const SceneDef def = def_of(c, radial);
      Player original(def), other(def), again(def, opened_again);
      other.play(0, 37, nullptr), again.play(60, 61, nullptr);
      int begin = 0;
      for (const int end : {0, 1, 16, 29, 47, 71, 101}) {
        original.play(begin, end, nullptr);
        begin = end + 20;
        contacts_at_saving += end > 0 && original.contacts()->node_count > 0;
        const State state = original.save();
        const std::string expected = original.played(end, begin);
        Player fresh(def);
        for (Player* player : {&original, &other, &fresh, &again}) {
          ASSERT_EQ(player->restore(state), PALPATE_OK);
          ASSERT_TRUE(player->played(end, begin) == expected)
              << name_of(c) << (radial ? " radial" : "") << ", saved after " << end << " steps, restored into scene "
              << (player == &original ? "itself"
                  : player == &fresh  ? "fresh"
                                      : "another");
        }
      }
      flags |= original.raised, slips += original.slips, releases += original.releases;
    }
  // The runs hold what they are meant to hold.
  EXPECT_GT(contacts_at_saving, 300);
  EXPECT_GT(slips, 100);
  EXPECT_GT(releases, 100);
  EXPECT_TRUE(flags & PALPATE_STEP_TRACKING_LOST);
  EXPECT_TRUE(flags & PALPATE_STEP_BAD_INPUT);
  EXPECT_TRUE(flags & PALPATE_STEP_FORCE_LIMITED);
}

// Saving, restoring and playing in any order, in three scenes: each step gives what an undisturbed run gives.
TEST(State, InterleavedAtRandomGivesAnUndisturbedRun) {
  constexpr int kSteps = 130;
  std::mt19937 random(7);
  const auto below = [&](int count) { return static_cast<int>(random() % static_cast<unsigned>(count)); };
  for (const Combination& c : combinations()) {
    if (c.collision == PALPATE_COLLISION_REST && c.contact != PALPATE_CONTACT_PATCH) continue;  // in the test above
    const SceneDef def = def_of(c);
    Player undisturbed(def);
    std::vector<std::string> expected;
    for (int s = 0; s < kSteps; ++s) expected.push_back(undisturbed.played(s, s + 1));
    std::vector<std::pair<int, State>> saved = {{0, Player(def).save()}};
    Player players[3] = {Player(def), Player(def), Player(def)};
    for (int round = 0; round < 40; ++round) {
      Player& player = players[below(3)];
      const std::size_t from = static_cast<std::size_t>(below(static_cast<int>(saved.size())));
      ASSERT_EQ(player.restore(saved[from].second), PALPATE_OK);
      const int begin = saved[from].first, end = std::min(kSteps, begin + below(25));
      for (int s = begin; s < end; ++s)
        ASSERT_TRUE(player.played(s, s + 1) == expected[s])
            << name_of(c) << ", round " << round << ", restored at " << begin << ", step " << s;
      saved.emplace_back(end, player.save());
    }
  }
}

// The next step after every step, in a scene whose own last step had no tool.
TEST(State, RestoredBeforeEachStepGivesItTheSameBits) {
  for (const Combination& c : combinations()) {
    if (c.collision == PALPATE_COLLISION_REST) continue;  // fewer members than the deformed surface
    const SceneDef def = def_of(c);
    Player original(def), idle(def);
    for (int s = 0; s < 130; ++s) {
      palpate_scene_touch(idle.scene(), nullptr, 0, 1e-3, idle.contacts().get(), idle.contacts().bytes());
      ASSERT_EQ(idle.restore(original.save()), PALPATE_OK);
      ASSERT_TRUE(original.played(s, s + 1) == idle.played(s, s + 1)) << name_of(c) << ", step " << s;
    }
  }
}

// Every byte of a scene that some step has changed is overwritten before the state is restored. What the state forgets is then
// garbage: so this test fails when something that a step leaves for the next one is not marked in SceneMemory.
TEST(State, HoldsAllThatAStepLeavesForTheNext) {
  constexpr int kSaved = 60, kEnd = 90;
  for (const Combination& c : combinations())
    for (const bool radial : {false, true}) {
      const SceneDef def = def_of(c, radial);
      Player original(def);
      const Arena::Bytes created = original.arena().copy();
      std::vector<bool> changed(created.size());
      const auto look = [&] { original.arena().mark_changes(created, &changed); };
      original.play(0, kSaved, nullptr, look);
      const State state = original.save();
      const std::string report = original.report();
      std::string expected;
      original.play(kSaved, kEnd, &expected, look);
      ASSERT_GT(std::count(changed.begin(), changed.end(), true), 1000);
      for (const int before : {0, 1, 50}) {
        Player other(def);
        other.play(0, before, nullptr);
        ASSERT_EQ(other.arena().size(), created.size());
        other.arena().scribble(changed);
        ASSERT_EQ(other.restore(state), PALPATE_OK) << name_of(c);
        ASSERT_TRUE(other.report() == report) << name_of(c);
        ASSERT_TRUE(other.played(kSaved, kEnd) == expected)
            << name_of(c) << (radial ? " radial" : "")
            << ": a step leaves something that the state does not hold; mark it "
            << "with SceneMemory::keep";
      }
    }
}

// More contacts than a step tests: which ones come first in the next step is part of the state.
TEST(State, HoldsWhichTestsAreDeferred) {
  SceneDef def = def_of({PALPATE_COLLISION_DEFORMED, PALPATE_CONTACT_POINT, PALPATE_LAW_STICKING});
  def.max_points = 64, def.max_contact_nodes = 192, def.max_tools = 1;
  std::vector<double> points;
  const auto touch = [&](palpate_scene* scene, Contacts& contacts, int s) {
    points.clear();
    for (int p = 0; p < 64; ++p) {
      const std::int32_t triangle = box().far_triangle(p % 18);
      const double k = 0.2 + 0.05 * (p / 18) + 0.05 * std::sin(0.2 * s + p);
      const Eigen::Vector3d at = box().place(triangle, {k, .5 - k / 2, .5 - k / 2}) -
                                 (0.001 + 0.002 * std::sin(0.3 * s + p)) * box().outward(triangle);
      points.insert(points.end(), at.data(), at.data() + 3);
    }
    const palpate_tool tool = point_tool(points.data(), 64);
    return palpate_scene_touch(scene, &tool, 1, 1e-3, contacts.get(), contacts.bytes());
  };
  TouchedScene original(box(), def);
  int restored = 0;
  for (int s = 0; s < 200 && restored < 5; ++s) {
    if (!(touch(original.get(), original.contacts, s) & PALPATE_STEP_WORK_DEFERRED)) continue;
    State state(palpate_scene_state_bytes(original.get()) / 8);
    ASSERT_EQ(palpate_scene_save(original.get(), state.data(), 8 * state.size(), nullptr), PALPATE_OK);
    TouchedScene copy(box(), def);
    ASSERT_EQ(palpate_scene_restore(copy.get(), state.data(), 8 * state.size(), nullptr), PALPATE_OK);
    for (const int end = s + 10; ++s < end;) {
      touch(original.get(), original.contacts, s), touch(copy.get(), copy.contacts, s);
      ASSERT_EQ(original.contacts->used_bytes, copy.contacts->used_bytes) << s;
      ASSERT_EQ(std::memcmp(original.contacts.get(), copy.contacts.get(), original.contacts->used_bytes), 0) << s;
    }
    ++restored;
  }
  EXPECT_EQ(restored, 5);
}

TEST(State, SavedChangesNothingAndHasTheSameBytesAgain) {
  const SceneDef def = def_of({PALPATE_COLLISION_DEFORMED, PALPATE_CONTACT_PATCH, PALPATE_LAW_COULOMB});
  Player saved(def), plain(def);
  std::string with, without;
  for (int s = 0; s < 40; ++s) {
    EXPECT_EQ(saved.save(), saved.save());
    saved.play(s, s + 1, &with), plain.play(s, s + 1, &without);
  }
  EXPECT_TRUE(with == without);
  EXPECT_EQ(saved.save(), plain.save());
}

TEST(State, TakesBytesForTheContactsThatThereAre) {
  SceneDef def = def_of({PALPATE_COLLISION_REST, PALPATE_CONTACT_PATCH, PALPATE_LAW_STICKING});
  def.max_points = 500, def.max_contact_nodes = 500;
  Player player(def);
  const std::size_t without = palpate_scene_state_bytes(player.scene());
  player.play(0, 20, nullptr);
  EXPECT_GT(palpate_scene_state_bytes(player.scene()), without);
  EXPECT_LT(palpate_scene_state_bytes(player.scene()), 2000000u);  // the solver has room for 500 contacts: 36 MB
}

// ---- what is refused ----------------------------------------------------------------------------------------------------

// Restores a state that is refused: the scene stays as it was.
void expect_refused(Player& player, const std::vector<std::uint64_t>& state, palpate_status status, const char* word) {
  const auto before = player.save();
  palpate_error error = {};
  EXPECT_EQ(player.restore(state, &error), status) << word;
  EXPECT_EQ(error.status, status);
  EXPECT_THAT(error.text, testing::HasSubstr(word));
  EXPECT_EQ(player.save(), before) << word;
}

TEST(State, DamagedAnywhereIsRefusedAndTheSceneStaysAsItWas) {
  const SceneDef def = def_of({PALPATE_COLLISION_DEFORMED, PALPATE_CONTACT_PATCH, PALPATE_LAW_COULOMB});
  Player player(def);
  player.play(0, 20, nullptr);
  const auto good = player.save();
  player.play(20, 25, nullptr);
  const auto before = player.save();
  for (std::size_t w = 0; w < good.size(); w += w < 64 ? 1 : 97)
    for (const std::uint64_t bits : {std::uint64_t{1}, std::uint64_t{1} << 63, ~std::uint64_t{0}}) {
      auto damaged = good;
      damaged[w] ^= bits;
      palpate_error error = {};
      ASSERT_NE(player.restore(damaged, &error), PALPATE_OK) << w;
      ASSERT_STRNE(error.text, "");
    }
  for (std::size_t words = 0; words < good.size(); words += words < 8 ? 1 : 101)
    ASSERT_NE(player.restore({good.begin(), good.begin() + static_cast<std::ptrdiff_t>(words)}), PALPATE_OK) << words;
  EXPECT_EQ(player.save(), before);
  auto longer = good;
  longer.push_back(7);  // what follows the state does not matter
  EXPECT_EQ(player.restore(longer), PALPATE_OK);
  EXPECT_EQ(player.save(), good);
}

TEST(State, OfAnotherSceneIsRefusedWithASentence) {
  const SceneDef def = def_of({PALPATE_COLLISION_REST, PALPATE_CONTACT_PATCH, PALPATE_LAW_STICKING});
  Player player(def);
  player.play(0, 20, nullptr);
  TinyBox stiffer = kForm;
  stiffer.young *= 2;
  const TouchedBox other_box(stiffer, add_everything);
  Player foreign(def, other_box);
  foreign.play(0, 20, nullptr);
  expect_refused(player, foreign.save(), PALPATE_ERROR_ARGUMENT, "state is of bundle");

  const auto with = [&](auto change) {
    SceneDef changed = def;
    change(changed);
    Player differs(changed);
    expect_refused(player, differs.save(), PALPATE_ERROR_ARGUMENT, "another palpate_scene_def");
  };
  with([](SceneDef& d) { d.collision = PALPATE_COLLISION_DEFORMED; });
  with([](SceneDef& d) { d.contact = PALPATE_CONTACT_POINT; });
  with([](SceneDef& d) { d.law = PALPATE_LAW_SLIDING; });
  with([](SceneDef& d) { d.force = PALPATE_FORCE_LINEAR; });
  with([](SceneDef& d) { d.radial = PALPATE_RADIAL_RESPONSE; });
  with([](SceneDef& d) { d.preload = PALPATE_PRELOAD_ON; });
  with([](SceneDef& d) { d.shape = PALPATE_SHAPE_VOLUME; });
  with([](SceneDef& d) { d.relaxation.share[0] = 0.1; });
  with([](SceneDef& d) { d.max_tools = 5; });
  with([](SceneDef& d) { d.max_points = 17; });
  with([](SceneDef& d) { d.max_contact_nodes = 121; });
  with([](SceneDef& d) { d.force_limit = 21; });
  with([](SceneDef& d) { d.force_slew = 201; });
  with([](SceneDef& d) { d.max_tool_speed = 11; });
  with([](SceneDef& d) { d.release_distance = 0.1; });
  with([](SceneDef& d) { d.queries.queries = PALPATE_QUERIES_ON; });
  with([](SceneDef& d) { d.report.report = PALPATE_REPORT_OFF; });
  expect_refused(player, std::vector<std::uint64_t>(100, 42), PALPATE_ERROR_MAGIC, "not a state");

  // A render mesh and an allocator belong to the host.
  SceneDef drawn = def;
  const float vertex[3] = {0.06f, 0.02f, 0.02f};
  const palpate_render_mesh mesh = render_mesh(vertex, nullptr, 1);
  drawn.render_mesh = mesh;
  EXPECT_EQ(Player(drawn).restore(player.save()), PALPATE_OK);
}

TEST(State, NeedsRoomAndAlignment) {
  Player player(def_of({PALPATE_COLLISION_REST, PALPATE_CONTACT_POINT, PALPATE_LAW_STICKING}));
  std::vector<std::uint64_t> memory(palpate_scene_state_bytes(player.scene()) / 8 + 2, 7);
  const auto untouched = memory;
  palpate_error error = {};
  auto* bytes = reinterpret_cast<unsigned char*>(memory.data());
  const std::size_t enough = palpate_scene_state_bytes(player.scene());
  for (const std::size_t count : {std::size_t{0}, std::size_t{8}, enough - 1}) {
    EXPECT_EQ(palpate_scene_save(player.scene(), bytes, count, &error), PALPATE_ERROR_ARGUMENT);
    EXPECT_THAT(error.text, testing::HasSubstr("palpate_scene_state_bytes"));
  }
  EXPECT_EQ(palpate_scene_save(player.scene(), bytes + 4, enough + 4, &error), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(palpate_scene_save(player.scene(), nullptr, enough, &error), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(palpate_scene_save(nullptr, bytes, enough, &error), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(palpate_scene_state_bytes(nullptr), 0u);
  EXPECT_EQ(memory, untouched);
  EXPECT_EQ(palpate_scene_save(player.scene(), bytes, enough, nullptr), PALPATE_OK);
  EXPECT_EQ(palpate_scene_restore(player.scene(), bytes, enough, nullptr), PALPATE_OK);
  EXPECT_EQ(palpate_scene_restore(player.scene(), bytes + 4, enough, &error), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(palpate_scene_restore(player.scene(), nullptr, enough, &error), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(palpate_scene_restore(nullptr, bytes, enough, &error), PALPATE_ERROR_ARGUMENT);
}

}  // namespace
}  // namespace palpate::tests
