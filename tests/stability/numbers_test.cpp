// NaN, infinities, denormals and huge numbers in every field that a host fills, under every contact model and law; and hosts
// that set another rounding mode or flush denormals to zero.
#include <immintrin.h>

#include <cfloat>
#include <limits>
#include <optional>

#include "tests/stability/known_compliance.h"
#include "tests/stability/stability_case.h"
#include "tests/support/bundle_forms.h"
#include "tests/support/hostile_play.h"
#include "tests/support/program_run.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;
using Limits = std::numeric_limits<double>;

const std::vector<double>& odd_numbers() {
  static const std::vector<double> numbers = {NAN,      -NAN,      Limits::signaling_NaN(),
                                              INFINITY, -INFINITY, DBL_MAX,
                                              -DBL_MAX, DBL_MIN,   5e-324,
                                              -5e-324,  1e-310,    -0.0,
                                              0.0,      1e300,     1e-300,
                                              1e6,      -1e6,      DBL_EPSILON};
  return numbers;
}

const TouchedBox& everything() {
  static const TouchedBox box({}, add_everything);
  return box;
}

// One tool with two points and two grips. numbers() lists every double of it that a host fills.
struct Sent {
  Sent() {
    const std::int32_t far = everything().far_triangle(5);
    const Vector3d out = everything().outward(far);
    for (int p = 0; p < 2; ++p) point[p] = everything().place(far, {.3, .2 + .2 * p, .5 - .2 * p}) - 0.001 * out;
    grip[0] = grip_at_node(everything().touchable[3], {0.001, 0, 0.0005});
    grip[1] = grip_at_place(everything().far_triangle(1), {.2, .3, .5}, {-0.001, 0.0005, 0});
    tool = point_tool(point[0].data(), 2, 0.004, 0.3);
    tool.grips = grip, tool.grip_count = 2;
  }
  std::vector<double*> numbers() {
    std::vector<double*> all = {&dt, &tool.disc_radius, &tool.friction};
    for (auto& p : point)
      for (int i = 0; i < 3; ++i) all.push_back(&p[i]);
    for (auto& g : grip)
      for (int i = 0; i < 3; ++i) all.push_back(&g.displacement[i]), all.push_back(&g.barycentric[i]);
    return all;
  }
  double dt = 1e-3;
  Vector3d point[2];
  palpate_grip grip[2] = {palpate_default_grip(), palpate_default_grip()};
  palpate_tool tool = palpate_default_tool();
};

std::vector<SceneDef> every_model() {
  std::vector<SceneDef> defs;
  for (const auto collision : {PALPATE_COLLISION_REST, PALPATE_COLLISION_DEFORMED})
    for (const auto contact : kEveryContact)
      for (const auto law : kEveryLaw) {
        SceneDef def = with(SceneDef(), collision, contact, law, PALPATE_FORCE_RESPONSE, PALPATE_RADIAL_RESPONSE);
        def.relaxation.terms = 1, def.relaxation.share[0] = 0.5, def.relaxation.time[0] = 0.1;
        defs.push_back(def);
      }
  return defs;
}

TEST(StabilityNumbers, InEveryFieldOfATool) {
  StabilityCase attack(
      "A NaN, an infinity or a number too small to divide by in one field of a tool could reach the factor, the "
      "relaxation's memory or the last shape, and stay there.");
  std::string broken;
  long steps = 0, unanswered = 0;
  double left = 0;
  for (const SceneDef& def : every_model()) {
    const ScenePointer scene = everything().scene(def);
    HeldPlay play(scene.get(), def, static_cast<std::int32_t>(everything().dofs() / 3));
    const std::size_t fields = Sent().numbers().size();
    for (std::size_t f = 0; f < fields && broken.empty(); ++f)
      for (const double odd : odd_numbers()) {
        play.reset();
        Sent good, bad;
        *bad.numbers()[f] = odd;
        Vector3d above[2] = {good.point[0] + Vector3d(0.002, 0, 0), good.point[1] + Vector3d(0.002, 0, 0)};
        palpate_tool outside = good.tool;
        outside.points = above[0].data();
        for (const auto& [tool, dt] :
             {std::pair{outside, 1e-3}, {good.tool, 1e-3}, {bad.tool, bad.dt}, {bad.tool, bad.dt}}) {
          if (broken.empty()) broken = play.touch(&tool, 1, dt);
          if (broken.empty()) broken = play.shape(play.contacts());
          ++steps;
        }
        if (!std::isfinite(odd) && !(play.flags() & PALPATE_STEP_BAD_INPUT)) {
          // The runtime does not read the barycentric numbers of a grip at a node.
          const auto* field = bad.numbers()[f];
          if (field < bad.grip[0].barycentric || field >= bad.grip[0].barycentric + 3) ++unanswered;
        }
        // An input that was refused must leave no trace. An input that was accepted must leave none after a reset.
        const auto later = [&] {
          play.touch(&outside, 1, 1e3);
          play.touch(&good.tool, 1, 1e3);
          play.touch(&good.tool, 1, 1e3);
          return Vector3d(palpate_contacts_tool(play.contacts(), 0)->force_raw);
        };
        const bool refused = (play.flags() & PALPATE_STEP_BAD_INPUT) != 0;
        if (!refused) play.reset();
        const Vector3d after = later();
        play.reset();
        for (const palpate_tool* tool : {&outside, &good.tool, &good.tool, &good.tool})
          if (refused) play.touch(tool, 1, 1e-3);
        const Vector3d never = later();
        left = std::max(left, (after - never).norm() / never.norm());
      }
  }
  EXPECT_EQ(broken, "");
  attack.hold("promises broken in " + std::to_string(steps) + " steps", broken.empty() ? 0 : 1, 0,
              "finite, bounded, slewed, flagged (tests/support/hostile_play.h)");
  attack.hold("NaN and infinities that raised no flag", unanswered, 0, "PALPATE_STEP_BAD_INPUT");
  attack.hold("what is left of it in a later contact, relative", left, 1e-9,
              "a tool keeps its last good input, a reset forgets; rounding of a factor that had other rows");
}

TEST(StabilityNumbers, InEveryFieldOfAScene) {
  StabilityCase attack(
      "If a limit or a time constant is NaN, every comparison with it is false, so that there is no limit at all.");
  std::string broken, place;
  long scenes = 0, accepted = 0;
  for (SceneDef def : every_model())
    for (int field = 0; field < 4; ++field)
      for (const double odd : odd_numbers()) {
        SceneDef with = def;
        double* numbers[4] = {&with.force_limit, &with.force_slew, &with.relaxation.share[0], &with.relaxation.time[0]};
        *numbers[field] = odd;
        palpate_scene* created = nullptr;
        palpate_error error = {};
        const palpate_status status = palpate_scene_create(everything().bundle(), &with, &created, &error);
        const ScenePointer scene(created);
        ++scenes;
        if (!broken.empty()) break;
        place = "field " + std::to_string(field) + ": " + std::to_string(odd);
        broken = broken_by_error(status, error, 1u << 30);
        accepted += (std::isnan(odd) || (field == 2 && odd >= 1)) && created;
        if (!created) continue;
        HeldPlay play(created, with, static_cast<std::int32_t>(everything().dofs() / 3));
        Sent good;
        Vector3d above[2] = {good.point[0] + Vector3d(0.002, 0, 0), good.point[1] + Vector3d(0.002, 0, 0)};
        palpate_tool outside = good.tool;
        outside.points = above[0].data();
        for (int s = 0; s < 4 && broken.empty(); ++s) {
          broken = play.touch(s % 2 ? &good.tool : &outside, 1, s == 3 ? 1e-9 : 10);
          if (broken.empty()) broken = play.shape(play.contacts());
        }
      }
  EXPECT_EQ(broken, "") << place;
  attack.hold("promises broken in " + std::to_string(scenes) + " scenes", broken.empty() ? 0 : 1, 0,
              "refused with a sentence, or played within its limits");
  attack.hold("scenes that took a NaN, or a share of relaxation that leaves nothing", accepted, 0,
              "PALPATE_ERROR_ARGUMENT");
}

TEST(StabilityNumbers, ForcesThatOverflow) {
  StabilityCase attack(
      "A response curve as steep as doubles allow makes forces overflow: infinity times a limit over infinity is NaN, "
      "and a memory that has stored a NaN never loses it.");
  // Q(F) = slope F over a range of 1 N; the stiffness is multiplied by `stiffer`.
  const auto box = [](double slope, double stiffer) {
    return TouchedBox({}, [&](BundleParts& parts) {
      add_everything(parts);
      parts.set(formats::SectionId::response_force, {2}, std::vector<double>{slope / 2, slope / 2});
      std::vector<double> force = parts.get<double>(formats::SectionId::force);
      for (double& x : force) x *= stiffer;
      parts.set(formats::SectionId::force, parts.sections[formats::SectionId::force].shape, force);
    });
  };
  int opened = 0;
  try {
    box(1e307, 1);
    ++opened;
  } catch (const std::runtime_error&) {
  }
  attack.hold("curves whose forces overflow, and that are opened", opened, 0, "y / x is at most 1,000");
  // The largest forces that are left: the steepest curve, the stiffest tissue that is opened, the largest displacement.
  const TouchedBox steep = box(900, 1e90);
  SceneDef def = with(SceneDef(), PALPATE_FORCE_RESPONSE);
  def.relaxation.terms = 1, def.relaxation.share[0] = 0.5, def.relaxation.time[0] = 0.1;
  const ScenePointer scene = steep.scene(def);
  HeldPlay play(scene.get(), def, static_cast<std::int32_t>(steep.dofs() / 3));
  const std::int32_t far = steep.far_triangle(5);
  std::string broken;
  long lost = 0;
  for (const double size : {1e-9, 1.0, 1e-9, 1e5, 1e-9}) {
    const palpate_grip grip = grip_at_place(far, {.3, .3, .4}, {size, 0, 0});
    const palpate_tool tool = grip_tool(&grip);
    for (int s = 0; s < 3 && broken.empty(); ++s) broken = play.touch(&tool, 1, 1e-3);
    lost += !all_finite(palpate_contacts_tool(play.contacts(), 0)->force_raw, 3);
  }
  EXPECT_EQ(broken, "");
  attack.hold("promises broken", broken.empty() ? 0 : 1, 0, "finite, bounded, slewed (tests/support/hostile_play.h)");
  attack.hold("forces that are not finite", lost, 0, "the largest is 1e100 N");
}

// The data that one call hands to the next: the contacts (which may come through a socket), the shape, the render mesh.
class HandedOn {
 public:
  explicit HandedOn(bool corrected) {
    const std::int32_t nodes = palpate_bundle_describe(everything().bundle()).surface_node_count;
    const double* rest = palpate_bundle_nodes(everything().bundle());
    vertices_.assign(rest, rest + 3 * nodes), normals_.assign(vertices_.size(), 1.0f);
    mesh_ = render_mesh(vertices_.data(), normals_.data(), nodes);
    def_.radial = corrected ? PALPATE_RADIAL_RESPONSE : PALPATE_RADIAL_OFF;
    def_.render_mesh = mesh_;
    scene_.emplace(everything(), def_);
    field_.resize(vertices_.size()), drawn_.resize(vertices_.size()), drawn_normals_.resize(vertices_.size());
    Sent good;
    Vector3d above[2] = {good.point[0] + Vector3d(0.002, 0, 0), good.point[1] + Vector3d(0.002, 0, 0)};
    palpate_tool outside = good.tool;
    outside.points = above[0].data();
    scene_->touch({outside});
    scene_->touch({good.tool});
    shape();
  }

  palpate_step_flags shape() {
    shape_ = shape_out(field_.data(), nullptr, static_cast<std::int32_t>(field_.size() / 3));
    return palpate_scene_shape(scene_->get(), scene_->contacts, &shape_);
  }
  palpate_step_flags skin() {
    palpate_skin_out out = skin_out(drawn_.data(), drawn_normals_.data(), mesh_.vertex_count);
    return palpate_scene_skin(scene_->get(), &shape_, &out);
  }
  bool is_finite() const {
    const auto finite = [](const std::vector<float>& all) {
      return std::all_of(all.begin(), all.end(), [](float x) { return std::isfinite(x); });
    };
    return finite(drawn_) && finite(drawn_normals_);
  }
  // All numbers of the contacts. The shape reads those from index read_from_ on.
  std::vector<double*> contact_numbers() {
    Contacts& contacts = scene_->contacts;
    std::vector<double*> all = {&contacts->residual_displacement, &contacts->residual_force};
    auto& tool = const_cast<palpate_tool_state&>(scene_->tool());
    for (int i = 0; i < 3; ++i)
      for (double* x : {tool.force, tool.force_raw}) all.push_back(x + i);
    read_from_ = all.size();
    if (def_.radial != PALPATE_RADIAL_OFF)
      for (int i = 0; i < 3; ++i) all.push_back(&tool.direction[i]);
    for (std::int32_t e = 0; e < contacts->node_count; ++e)
      for (int i = 0; i < 3; ++i) all.push_back(const_cast<double*>(&contacts.nodes()[e].modified_displacement[i]));
    return all;
  }
  std::size_t first_that_is_read() const { return read_from_; }
  std::vector<float>& field() { return field_; }
  const std::vector<float>& drawn() const { return drawn_; }
  std::vector<float>& vertices() { return vertices_; }
  std::vector<float>& normals() { return normals_; }
  const SceneDef& def() const { return def_; }

 private:
  std::vector<float> vertices_, normals_, field_, drawn_, drawn_normals_;
  palpate_render_mesh mesh_ = palpate_default_render_mesh();
  SceneDef def_;
  std::optional<TouchedScene> scene_;
  palpate_shape_out shape_ = palpate_default_shape_out();
  std::size_t read_from_ = 0;
};

TEST(StabilityNumbers, InEveryFieldOfWhatIsHandedOn) {
  StabilityCase attack(
      "Contacts may come through a socket, and the host passes shapes on: a NaN in either would fill the picture; in a "
      "render mesh it binds a vertex to nothing.");
  long calls = 0, unflagged = 0, not_finite = 0, left = 0, taken = 0;
  for (const bool corrected : {false, true}) {
    HandedOn handed(corrected);
    handed.skin();
    const std::vector<float> before = handed.drawn();
    const auto try_number = [&](auto* number, double odd, bool is_read) {
      const auto good = std::exchange(*number, static_cast<std::remove_pointer_t<decltype(number)>>(odd));
      const bool of_contacts = sizeof good == sizeof(double);
      const palpate_step_flags flags = (of_contacts ? handed.shape() : 0u) | handed.skin();
      ++calls;
      unflagged += !std::isfinite(*number) && is_read && !(flags & PALPATE_STEP_BAD_INPUT);
      not_finite += !handed.is_finite();
      *number = good;
      handed.shape(), handed.skin();
      left += handed.drawn() != before;
    };
    for (const double odd : odd_numbers()) {
      const auto numbers = handed.contact_numbers();
      for (std::size_t f = 0; f < numbers.size(); ++f) try_number(numbers[f], odd, f >= handed.first_that_is_read());
      for (std::size_t i = 0; i < handed.field().size(); ++i) try_number(&handed.field()[i], odd, true);
    }
  }
  HandedOn handed(false);
  for (const double odd : odd_numbers())
    for (std::vector<float>* of : {&handed.vertices(), &handed.normals()})
      for (float& number : *of) {
        const float good = std::exchange(number, static_cast<float>(odd));
        palpate_scene* created = nullptr;
        palpate_error error = {};
        const palpate_status status = palpate_scene_create(everything().bundle(), &handed.def(), &created, &error);
        const ScenePointer scene(created);
        ++calls;
        taken += created && !std::isfinite(number);
        EXPECT_EQ(broken_by_error(status, error, 1u << 30), "");
        number = good;
      }
  attack.hold("pictures that are not finite, of " + std::to_string(calls) + " calls", not_finite, 0,
              "what palpate_scene_shape and palpate_scene_skin promise of any input");
  attack.hold("NaN and infinities that raised no flag", unflagged, 0, "PALPATE_STEP_BAD_INPUT");
  attack.hold("pictures that differ after it", left, 0, "the render half keeps no state");
  attack.hold("meshes to draw that were taken with one", taken, 0, "PALPATE_ERROR_ARGUMENT");
}

TEST(StabilityNumbers, MinusZeroIsZero) {
  StabilityCase attack(
      "-0 and 0 have different sign bits: a branch on the sign, or a hash of the bits, would give different answers.");
  long differing = 0;
  for (const SceneDef& def : every_model())
    for (std::size_t f = 0; f < Sent().numbers().size(); ++f) {
      std::vector<double> answer[2];
      for (int minus = 0; minus < 2; ++minus) {
        TouchedScene scene(everything(), def);
        Sent sent;
        *sent.numbers()[f] = minus ? -0.0 : 0.0;
        scene.touch(&sent.tool, 1, sent.dt);
        scene.touch(&sent.tool, 1, sent.dt);
        answer[minus].assign(scene.tool().force_raw, scene.tool().force_raw + 3);
        for (int e = 0; e < scene.contacts->node_count; ++e)
          answer[minus].insert(answer[minus].end(), scene.contacts.nodes()[e].force,
                               scene.contacts.nodes()[e].force + 3);
      }
      differing += answer[0] != answer[1];
    }
  attack.hold("fields where -0 and 0 give different answers", differing, 0, "-0 and 0 are the same number");
}

// A tool comes down, is dragged and leaves, while the motion of a grip fades away. Returns every force and every position of the
// run.
std::vector<double> walk(const TouchedBox& box, double smallest) {
  SceneDef def =
      unlimited_def(PALPATE_COLLISION_DEFORMED, PALPATE_LAW_COULOMB, PALPATE_FORCE_RESPONSE, PALPATE_RADIAL_RESPONSE);
  def.relaxation.terms = 1, def.relaxation.share[0] = 0.5, def.relaxation.time[0] = 0.01;
  TouchedScene scene(box, def);
  std::vector<double> all;
  const Vector3d place = box.place(box.far_triangle(5), {.3, .3, .4});
  for (int s = 0; s < 200; ++s) {
    const Vector3d p = place + Vector3d(0.001 - 4e-5 * (s < 100 ? s : 200 - s), 1e-5 * s, 0);
    const std::vector<palpate_grip> grips = {
        grip_at_node(box.touchable[3], {0, 0, 0.001 * std::pow(smallest, s / 200.0)})};
    const palpate_tool tools[2] = {point_tool(p.data(), 1, 0.004, 0.3), tool_of(grips)};
    scene.touch(tools);
    for (int t = 0; t < 2; ++t) all.insert(all.end(), scene.tool(t).force_raw, scene.tool(t).force_raw + 3);
    for (const float x : scene.shape()) all.push_back(x);
  }
  return all;
}

TEST(StabilityNumbers, FlushedDenormalsChangeNothingButDenormals) {
  StabilityCase attack(
      "Hosts for audio and graphics set FTZ and DAZ: denormals become zero, and a division whose divisor was tested "
      "against zero before becomes a division by zero.");
  const unsigned mode = _mm_getcsr();
  for (const double smallest : {1e-3, 1e-297}) {
    const std::vector<double> kept = walk(everything(), smallest);
    _mm_setcsr(mode | 0x8040u);
    const std::vector<double> flushed = walk(everything(), smallest);
    _mm_setcsr(mode);
    double most = 0;
    for (std::size_t i = 0; i < kept.size(); ++i) {
      const double off = std::abs(kept[i] - flushed[i]);
      most = std::isfinite(off) ? std::max(most, off) : INFINITY;
    }
    // Shapes are single precision, whose denormals end at 1.2e-38.
    attack.hold(smallest < 1e-200 ? "motions down to 1e-300 m: change under FTZ and DAZ, N or m"
                                  : "motions of haptics: change under FTZ and DAZ, N or m",
                most, smallest < 1e-200 ? 1.2e-38 : 0,
                smallest < 1e-200 ? "the largest denormal of single precision" : "no denormal is met: the same bits");
  }
}

TEST(StabilityNumbers, HostBuiltWithFastMath) {
  StabilityCase attack(
      "With -ffast-math a host assumes that there is no NaN and sets FTZ and DAZ at start-up: inline code of the API's "
      "headers, or a check left to the host, could be lost.");
  const auto file = scratch_file("everything.h5");
  BundleParts parts = tiny_bundle();
  add_everything(parts);
  write_bundle(file, parts);
  const auto folder = fresh_folder();
  const auto run = [&](const char* program) {
    return run_in(folder, std::string(program) + " '" + file.string() + "'");
  };
  const ProgramRun plain = run(PALPATE_PLAIN_HOST), fast = run(PALPATE_FAST_HOST);
  EXPECT_EQ(plain.code, 0) << plain.errors;
  EXPECT_EQ(fast.code, 0) << fast.errors;
  EXPECT_GT(std::count(plain.out.begin(), plain.out.end(), '\n'), 300);
  long differing = 0;
  std::istringstream a(plain.out), b(fast.out);
  for (std::string x, y; std::getline(a, x);) differing += !std::getline(b, y) || x != y;
  std::filesystem::remove_all(folder);
  std::filesystem::remove(file);
  attack.hold("lines of the run that differ", differing, 0, "the same calls, the same bits");
}

}  // namespace
}  // namespace palpate::tests
