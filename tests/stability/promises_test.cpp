// What the header promises about the work of a step and about what is refused: sweeps over sizes, bodies, bundles, curves and buffers.
#include <limits>

#include "tests/runtime/sliding_crowd.h"
#include "tests/stability/stability_case.h"
#include "tests/support/bundle_forms.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;

// ---- the work of a step --------------------------------------------------------------------------------------------------

const std::vector<const TouchedBox*>& bodies() {
  static const TouchedBox cube({.cells = {2, 2, 2}, .interior = false}),
      bar({.cells = {14, 2, 2}, .size = {0.28, 0.03, 0.03}, .interior = false}),
      plate({.cells = {2, 10, 12}, .size = {0.012, 0.1, 0.12}, .interior = false});
  static const std::vector<const TouchedBox*> all = {&cube, &bar, &plate};
  return all;
}

// The fewest operations with which that scene can be made: the refusal of fewer names them.
std::int64_t fewest_operations(const TouchedBox& body, palpate_scene_def def) {
  def.max_operations = 1;
  palpate_scene* scene = nullptr;
  palpate_error error = {};
  EXPECT_EQ(palpate_scene_create(body.bundle(), &def, &scene, &error), PALPATE_ERROR_ARGUMENT);
  palpate_scene_destroy(scene);
  const char* const number = std::strstr(error.text, "expected ");
  if (!number) throw std::logic_error(error.text);
  return std::strtoll(number + std::strlen("expected "), nullptr, 10);
}

// What the steps of a scene count, over what they may count.
struct Counted {
  double worst = 0;
  long not_finite = 0, untold = 0, deferred = 0;
  // wanted: contacts that the input asks for, or -1.
  void note(const palpate_scene* scene, palpate_contacts* contacts, palpate_step_flags flags, int wanted = -1) {
    worst = std::max(
        worst, static_cast<double>(contacts->operations) / static_cast<double>(palpate_scene_most_operations(scene)));
    int made = 0;
    for (int t = 0; t < contacts->tool_count; ++t) {
      const palpate_tool_state& tool = *palpate_contacts_tool(contacts, t);
      made += tool.contact_count;
      not_finite += !Vector3d(tool.force).allFinite() || !Vector3d(tool.force_raw).allFinite();
    }
    deferred += (flags & PALPATE_STEP_WORK_DEFERRED) != 0;
    untold += made < wanted && !(flags & (PALPATE_STEP_WORK_DEFERRED | PALPATE_STEP_CONTACTS_DROPPED));
  }
};

void hold_all(StabilityCase& attack, const Counted& counted, const std::string& of) {
  attack.hold("operations of a step over palpate_scene_most_operations" + of, counted.worst, 1,
              "the header: never exceeded");
  attack.hold("steps with fewer contacts than asked for, without a flag" + of, static_cast<double>(counted.untold), 0,
              "WORK_DEFERRED or CONTACTS_DROPPED");
  attack.hold("forces that are not finite" + of, static_cast<double>(counted.not_finite), 0,
              "a step always yields an answer");
}

TEST(StabilityPromises, GripsInOneTriangleThatAreAllNewAtOnce) {
  StabilityCase attack(
      "Hundreds of grips in one triangle come, move and go together: their rows, and the squares and cubes of them, "
      "have no bound but the one that the step counts.");
  for (const int grips : {1, 64, 350, 700}) {
    Counted counted;
    for (const TouchedBox* body : bodies())
      for (const auto contact : {PALPATE_CONTACT_POINT, PALPATE_CONTACT_TRIANGLE, PALPATE_CONTACT_PATCH}) {
        // Memory grows with the square of the constraints.
        if (grips > 64 && body != bodies()[0] && (grips > 350 || contact == PALPATE_CONTACT_TRIANGLE)) continue;
        if (grips > 350 && contact == PALPATE_CONTACT_TRIANGLE) continue;
        palpate_scene_def def = palpate_default_scene_def();
        def.collision = PALPATE_COLLISION_OFF, def.contact = contact, def.max_points = grips;
        def.max_contact_nodes = 3 * grips;
        for (const std::int64_t most :
             {fewest_operations(*body, def), std::int64_t{300'000}, std::int64_t{2'000'000}}) {
          def.max_operations = most;
          const ScenePointer scene = body->scene(def);
          EXPECT_EQ(palpate_scene_most_operations(scene.get()), most);
          Contacts contacts(scene.get());
          WanderingRandom random;
          std::vector<palpate_grip> held;
          for (int s = 0; s < quick_or_long(24, 200); ++s) {
            // All new in steps 0, 8 and 16; some new in step 4; none in the steps before.
            if (s % 8 == 0 || s % 8 == 4) {
              held.resize(s % 8 == 0 ? 0 : held.size() / 2);
              while (static_cast<int>(held.size()) < grips) {
                const double a = random(0, 1), b = random(0, 1 - a);
                held.push_back(grip_at_place(body->far_triangle(), {a, b, 1 - a - b},
                                             {random(-1e-3, 1e-3), random(-1e-3, 1e-3), random(-1e-3, 1e-3)}));
              }
            }
            palpate_tool tool = tool_of(held);
            tool.disc_radius = contact == PALPATE_CONTACT_PATCH ? 0.004 : 0;
            if (s % 8 == 7) tool.grip_count = 0;
            const palpate_step_flags flags =
                palpate_scene_touch(scene.get(), &tool, 1, 1e-3, contacts.get(), contacts.bytes());
            counted.note(scene.get(), contacts.get(), flags, tool.grip_count);
          }
        }
      }
    if (grips >= 350) {
      EXPECT_GT(counted.worst, 0.5);
      EXPECT_GT(counted.deferred, 0);
    }
    hold_all(attack, counted, ", " + std::to_string(grips) + " grips");
  }
}

TEST(StabilityPromises, CoulombPointsThatHoverPressSlideAndJump) {
  StabilityCase attack(
      "64 points with friction, most of them in contacts that contradict one another: neither tests nor sweeps of the "
      "laws end by themselves in time.");
  for (const double friction : {0.3, 20.0}) {
    Counted counted;
    for (const auto contact : {PALPATE_CONTACT_POINT, PALPATE_CONTACT_TRIANGLE, PALPATE_CONTACT_PATCH})
      for (const std::int64_t most : {std::int64_t{60'000}, std::int64_t{300'000}, std::int64_t{2'000'000}}) {
        SlidingCrowd crowd(contact, PALPATE_LAW_COULOMB, most);
        EXPECT_EQ(palpate_scene_most_operations(crowd.scene.get()), most);
        for (palpate_tool& tool : crowd.tools)
          tool.friction = friction, tool.disc_radius = contact == PALPATE_CONTACT_PATCH ? 0.005 : 0;
        for (int s = 0; s < quick_or_long(200, 10000); ++s) {
          crowd.step();
          counted.note(crowd.scene.get(), crowd.contacts->get(), crowd.flags);
        }
      }
    EXPECT_GT(counted.worst, 0.5);
    EXPECT_GT(counted.deferred, 0);
    hold_all(attack, counted, friction < 1 ? ", friction 0.3" : ", friction 20");
  }
}

TEST(StabilityPromises, PointsThatAllComeInAndGoOutInOneStep) {
  StabilityCase attack("A brush of points goes into the body and out again, every point in the same step.");
  for (const int points : {1, 64, 400}) {
    Counted counted;
    for (const TouchedBox* body : bodies())
      for (const auto law : {PALPATE_LAW_STICKING, PALPATE_LAW_COULOMB}) {
        palpate_scene_def def = palpate_default_scene_def();
        def.collision = PALPATE_COLLISION_DEFORMED, def.contact = PALPATE_CONTACT_POINT, def.law = law;
        def.max_points = points, def.max_contact_nodes = std::min(3000, 3 * points);
        const auto& t = body->body.triangles[static_cast<std::size_t>(body->far_triangle())];
        const double face = body->node(t[0])[0];
        Vector3d high = body->node(0);
        for (std::int32_t n = 0; n < body->body.surface_nodes; ++n) high = high.cwiseMax(body->node(n));
        for (const std::int64_t most : {fewest_operations(*body, def), std::int64_t{300'000}}) {
          def.max_operations = most;
          const ScenePointer scene = body->scene(def);
          Contacts contacts(scene.get());
          WanderingRandom random;
          std::vector<Vector3d> at(static_cast<std::size_t>(points));
          for (int s = 0; s < quick_or_long(24, 200); ++s) {
            for (Vector3d& p : at)
              p = {face + (s % 6 < 3 ? 1e-3 : -2e-3), random(0.05, 0.95) * high[1], random(0.05, 0.95) * high[2]};
            const palpate_tool tool = point_tool(at[0].data(), points, 0, 0.3);
            // In longer steps, so that the points do not count as jumping.
            const palpate_step_flags flags =
                palpate_scene_touch(scene.get(), &tool, 1, 0.1, contacts.get(), contacts.bytes());
            counted.note(scene.get(), contacts.get(), flags);
          }
        }
      }
    if (points >= 64) {
      EXPECT_GT(counted.worst, 0.5);
      EXPECT_GT(counted.deferred, 0);
    }
    hold_all(attack, counted, ", " + std::to_string(points) + " points");
  }
}

// ---- contacts of another bundle ------------------------------------------------------------------------------------------

TEST(StabilityPromises, ContactsOfEveryOtherBundleAreRefused) {
  StabilityCase attack(
      "Contacts go through a socket or a mailbox to the scene of another organ, or of the same organ made anew with "
      "another number: the wrong nodes would move, without a flag.");
  TinyBox other_cells, other_modulus, other_ratio, no_interior;
  other_cells.cells = {4, 3, 3}, other_modulus.young = std::nextafter(5400, 6000);
  other_ratio.poisson = 0.44, no_interior.interior = false;
  const TouchedBox bundles[] = {TouchedBox(),
                                TouchedBox(other_cells),
                                TouchedBox(other_modulus),
                                TouchedBox(other_ratio),
                                TouchedBox(no_interior),
                                TouchedBox({}, add_everything)};
  palpate_scene_def def = unlimited_def();
  def.queries = PALPATE_QUERIES_ON, def.collision = PALPATE_COLLISION_DEFORMED;
  const auto size_of = [](const std::vector<float>& u) {
    double most = 0;
    for (const float x : u) most = std::max(most, x == x ? std::abs(double{x}) : INFINITY);
    return most;
  };
  int pairs = 0, taken = 0, refused = 0;
  double moved = 0, queried = 0;
  // flags and motion of the shape, and what a query answers, with those contacts.
  const auto show = [&](const TouchedBox& body, const palpate_contacts* contacts, bool own) {
    const ScenePointer scene = body.scene(def);
    palpate_step_flags flags = 0;
    const double size = size_of(displacements(scene.get(), contacts, body.body.surface_nodes, &flags));
    const Vector3d p = body.place(body.far_triangle(), {.3, .3, .4}) + Vector3d(5e-4, 0, 0);
    double at_rest = 0, distance = 0;
    palpate_scene_signed_distance(scene.get(), nullptr, p.data(), &at_rest);
    const palpate_step_flags asked = palpate_scene_signed_distance(scene.get(), contacts, p.data(), &distance);
    if (own) {
      refused += flags != 0 || asked != 0 || !(size > 1e-4) || distance == at_rest;
    } else {
      ++pairs, taken += flags != PALPATE_STEP_OTHER_BUNDLE || asked != PALPATE_STEP_OTHER_BUNDLE;
      moved = std::max(moved, size), queried = std::max(queried, std::abs(distance - at_rest));
    }
  };
  for (const TouchedBox& from : bundles) {
    const ScenePointer scene = from.scene(def);
    Contacts contacts(scene.get());
    std::vector<palpate_grip> grips;
    for (const std::int32_t n : from.body.triangles[static_cast<std::size_t>(from.far_triangle())])
      grips.push_back(grip_at_node(n, {0.002, 0, 0.001}));
    const palpate_tool tool = tool_of(grips);
    palpate_scene_touch(scene.get(), &tool, 1, 1e-3, contacts.get(), contacts.bytes());
    for (const TouchedBox& to : bundles) show(to, contacts, &to == &from);
    // An identity that differs in one bit.
    for (int bit = 0; bit < 64; ++bit) {
      contacts->bundle ^= std::uint64_t{1} << bit;
      show(from, contacts, false);
      contacts->bundle ^= std::uint64_t{1} << bit;
    }
  }
  EXPECT_EQ(pairs, 6 * 5 + 6 * 64);
  attack.hold("foreign contacts without the flag, of " + std::to_string(pairs), taken, 0, "OTHER_BUNDLE");
  attack.hold("motion of a shape by foreign contacts, m", moved, 0, "the shape is at rest");
  attack.hold("change of a distance by foreign contacts, m", queried, 0, "the surface is at rest");
  attack.hold("own contacts refused, of 6", refused, 0, "the same bytes have the same identity");
}

// ---- grips without a kind ------------------------------------------------------------------------------------------------

TEST(StabilityPromises, GripsWhoseKindIsNotSaidAreRefused) {
  StabilityCase attack(
      "A grip whose kind is not set, or is no kind, stands anywhere among sound grips, with any node and triangle: it "
      "would hold node 0.");
  int sent = 0, taken = 0, sound_refused = 0;
  double gripped = 0, forgotten = 0;
  for (const TouchedBox* body : bodies()) {
    const ScenePointer scene = body->scene(unlimited_def()), fresh = body->scene(unlimited_def());
    Contacts contacts(scene.get()), none(fresh.get());
    const auto triangles = static_cast<std::int32_t>(body->body.triangles.size());
    for (const int count : {1, 2, 17}) {
      std::vector<palpate_grip> sound;
      for (int g = 0; g < count; ++g)
        sound.push_back(grip_at_node(body->touchable[static_cast<std::size_t>(g)], {0, 0, 1e-3 + 1e-5 * g}));
      for (const int place : {0, count / 2, count - 1})
        for (const std::int32_t kind : {0, 3, 4, 7, 255, 256, -1, -2, std::numeric_limits<std::int32_t>::max(),
                                        std::numeric_limits<std::int32_t>::min()})
          for (const std::int32_t node : {0, body->touchable[3], -1})
            for (const std::int32_t triangle : {0, triangles - 1, -1}) {
              palpate_tool tool = tool_of(sound);
              sound_refused += palpate_scene_touch(scene.get(), &tool, 1, 1e-3, contacts.get(), contacts.bytes()) != 0;
              const auto before = displacements(scene.get(), contacts, body->body.surface_nodes);
              std::vector<palpate_grip> odd = sound;
              palpate_grip& grip = odd[static_cast<std::size_t>(place)];
              std::memcpy(&grip.kind, &kind, sizeof kind);
              grip.node = node, grip.triangle = triangle;
              grip.barycentric[0] = 0.25, grip.barycentric[1] = 0.25, grip.barycentric[2] = 0.5;
              for (double& x : grip.displacement) x = 0.02;
              tool = tool_of(odd);
              ++sent;
              taken += !(palpate_scene_touch(scene.get(), &tool, 1, 1e-3, contacts.get(), contacts.bytes()) &
                         PALPATE_STEP_BAD_INPUT);
              const auto after = displacements(scene.get(), contacts, body->body.surface_nodes);
              for (std::size_t i = 0; i < after.size(); ++i)
                forgotten = std::max(forgotten, std::abs(double{after[i]} - double{before[i]}));
              palpate_scene_reset(fresh.get());
              taken += !(palpate_scene_touch(fresh.get(), &tool, 1, 1e-3, none.get(), none.bytes()) &
                         PALPATE_STEP_BAD_INPUT);
              gripped += none->node_count + palpate_contacts_tool(none, 0)->contact_count +
                         Vector3d(palpate_contacts_tool(none, 0)->force_raw).norm();
            }
    }
  }
  attack.hold("steps with such a grip without the flag, of " + std::to_string(2 * sent), taken, 0, "BAD_INPUT");
  attack.hold("nodes, contacts and newtons by such a tool in a new scene", gripped, 0, "there is no last good input");
  attack.hold("motion of the shape by such a tool after a sound one, m", forgotten, 0,
              "the tool keeps its last good input");
  attack.hold("sound tools refused", sound_refused, 0, "every grip says what it holds");
}

// ---- response curves -----------------------------------------------------------------------------------------------------

// Chebyshev coefficients over 0 .. range of y(x) = range f(x / range), by interpolation.
std::vector<double> curve_of(int count, double range, const std::function<double(double)>& f) {
  std::vector<double> c(static_cast<std::size_t>(count), 0.0);
  for (int p = 0; p < count; ++p) {
    const double angle = M_PI * (p + 0.5) / count;
    for (int k = 0; k < count; ++k)
      c[static_cast<std::size_t>(k)] +=
          range * (k == 0 ? 1.0 : 2.0) / count * f((std::cos(angle) + 1) / 2) * std::cos(k * angle);
  }
  return c;
}

// A bundle with curve P or Q; nullptr where it is refused.
std::unique_ptr<TouchedBox> with_curve(bool force, const std::vector<double>& curve, double range) {
  using formats::SectionId;
  try {
    return std::make_unique<TouchedBox>(TinyBox{.cells = {2, 1, 1}}, [&](BundleParts& parts) {
      for (const bool is_force : {false, true}) {
        const std::vector<double> c = is_force == force ? curve : std::vector<double>{0.5, 0.5};
        parts.set(is_force ? SectionId::response_force : SectionId::response_radial, {c.size()}, c);
      }
      parts.set(SectionId::response_range, {2}, force ? std::vector<double>{1, range} : std::vector<double>{range, 1});
    });
  } catch (const std::runtime_error&) {
    return nullptr;
  }
}

TEST(StabilityPromises, ResponseCurvesThatCannotBeOneAreRefused) {
  StabilityCase attack(
      "A fit, or a hand, gives a curve P or Q that falls, is zero, does not begin at zero or is of another unit: the "
      "device would be pulled in, or pushed without a contact.");
  using Curve = std::function<double(double)>;
  const std::vector<Curve> bad = {
      [](double t) { return -t; },
      [](double t) { return -1e-3 * t; },
      [](double t) { return t - 0.6 * t * t; },                   // falls at the end
      [](double t) { return t * t - 0.01 * t; },                  // falls at the begin
      [](double t) { return t - 1.05 * std::sin(12 * t) / 12; },  // falls in three narrow places
      [](double) { return 0.0; },
      [](double) { return 1.0; },
      [](double t) { return 5 + t; },
      [](double t) { return -5 + t; },
      [](double t) { return 1e-6 + t; },
      [](double t) { return 1e6 * t; },
      [](double t) { return 1e-6 * t; },
      [](double t) { return 1001 * t; },
      [](double t) { return t < 0.5 ? NAN : t; },
      [](double t) { return t > 0.5 ? INFINITY : t; },
  };
  const std::vector<Curve> good = {
      [](double t) { return t; },
      [](double t) { return 999 * t; },
      [](double t) { return t * t; },
      [](double t) { return 2 * t - t * t; },
      [](double t) { return std::expm1(6 * t) / 6; },
      [](double t) { return t - 0.95 * std::sin(12 * t) / 12; },
  };
  int tried = 0, taken = 0, sound = 0, refused = 0;
  double pulls = 0, falls = 0;
  for (const bool force : {false, true})
    for (const double range : {1e-6, 1e-3, 1.0, 1e3})
      for (const int count : {17, 33}) {
        for (std::size_t i = 0; i < bad.size(); ++i, ++tried)
          if (with_curve(force, curve_of(count, range, bad[i]), range)) {
            ++taken;
            ADD_FAILURE() << "bad curve " << i << " of range " << range << " with " << count << " coefficients";
          }
        for (std::size_t i = 0; i < good.size(); ++i, ++sound) {
          std::vector<double> c = curve_of(count, range, good[i]);
          // Rounding of 33 terms, such that y(0) = sum (-1)^k c_k is zero.
          double begin = 0;
          for (std::size_t k = 0; k < c.size(); ++k) begin += (k % 2 ? -1 : 1) * c[k];
          c[0] -= begin;
          const auto body = with_curve(force, c, range);
          if (!body) {
            ++refused;
            ADD_FAILURE() << "sound curve " << i << " of range " << range << " with " << count << " coefficients";
            continue;
          }
          // A node is pushed further and further, within the range and far beyond.
          palpate_scene_def def = unlimited_def();
          def.force = PALPATE_FORCE_RESPONSE;
          const ScenePointer scene = body->scene(def);
          Contacts contacts(scene.get());
          const std::int32_t node = body->body.triangles[static_cast<std::size_t>(body->far_triangle())][0];
          double before = 0;
          for (double push = 1e-9; push < 0.1; push *= 1.3) {
            const palpate_grip grip = grip_at_node(node, {-push, 0, 0});
            const palpate_tool tool = grip_tool(&grip);
            palpate_scene_touch(scene.get(), &tool, 1, 1e-3, contacts.get(), contacts.bytes());
            const double resists = palpate_contacts_tool(contacts, 0)->force_raw[0];
            pulls = std::max(pulls, -resists), falls = std::max(falls, (before - resists) / std::max(before, 1e-300));
            before = resists;
          }
        }
      }
  // A range of zero says that there is no curve: the bundle opens, and the effect that needs the curve is refused.
  for (const bool force : {false, true})
    for (const double range : {0.0, -0.0, -1.0, std::nan(""), double{INFINITY}}) {
      ++tried;
      const auto body = with_curve(force, {0.5, 0.5}, range);
      if (!body) continue;
      palpate_scene_def def = unlimited_def();
      if (force)
        def.force = PALPATE_FORCE_RESPONSE;
      else
        def.radial = PALPATE_RADIAL_RESPONSE;
      palpate_scene* scene = nullptr;
      taken += range != 0 || palpate_scene_create(body->bundle(), &def, &scene, nullptr) != PALPATE_ERROR_EFFECT;
      palpate_scene_destroy(scene);
    }
  attack.hold("curves taken that cannot be one, of " + std::to_string(tried), taken, 0,
              "refused at opening, or with the effect that needs it");
  attack.hold("sound curves refused, of " + std::to_string(sound), refused, 0, "they rise from zero");
  attack.hold("force that pulls a tool which pushes, N", pulls, 0, "the curves that are taken rise from zero");
  attack.hold("fall of the force while the push grows, relative", falls, 1e-9,
              "the check lets a curve fall by so much: rounding");
}

// ---- the buffer of a touch -------------------------------------------------------------------------------------------------

TEST(StabilityPromises, TouchBuffersOfEverySizeBelowTheNeededAreNotWritten) {
  StabilityCase attack(
      "The host allocates too little, by a byte, by a node or by all of it. The step would write behind the buffer.");
  static constexpr std::size_t kBehind = 4096;
  static constexpr unsigned char kPattern = 0x5a;
  const TouchedBox large({}, [](BundleParts&parts) { add_large_deformation(parts); }), linear;
  struct Case {
    std::int32_t tools, nodes;
    palpate_deformation_model deformation;
  };
  int sizes = 0, other = 0, stepped = 0;
  double written = 0, behind = 0;
  for (const Case& c :
       {Case{1, 1, PALPATE_DEFORMATION_LINEAR}, Case{4, 0, PALPATE_DEFORMATION_LINEAR},
        Case{PALPATE_MAX_TOOLS, 16, PALPATE_DEFORMATION_LINEAR},
        Case{PALPATE_MAX_TOOLS, 3000, PALPATE_DEFORMATION_LINEAR}, Case{4, 64, PALPATE_DEFORMATION_LARGE}}) {
    const TouchedBox& body = c.deformation == PALPATE_DEFORMATION_LARGE ? large : linear;
    palpate_scene_def def = unlimited_def();
    def.contact = PALPATE_CONTACT_NODE;
    def.max_tools = c.tools, def.max_contact_nodes = c.nodes,
    def.max_points = c.nodes > 0 && c.nodes < 64 ? c.nodes : 64;
    def.collision = PALPATE_COLLISION_OFF, def.deformation = c.deformation;
    const ScenePointer scene = body.scene(def);
    std::vector<palpate_grip> grips;
    for (int t = 0; t < c.tools; ++t)
      grips.push_back(grip_at_node(body.touchable[static_cast<std::size_t>(t)], {0, 0, 1e-3}));
    std::vector<palpate_tool> tools;
    for (const palpate_grip& grip : grips) tools.push_back(grip_tool(&grip));
    const auto touch = [&](void* memory, std::size_t bytes) {
      return palpate_scene_touch(scene.get(), tools.data(), c.tools, 1e-3, static_cast<palpate_contacts*>(memory),
                                 bytes);
    };
    const std::size_t enough = palpate_contacts_bytes(scene.get());
    std::vector<std::uint64_t> memory((enough + kBehind) / 8 + 1);
    auto* const bytes = reinterpret_cast<unsigned char*>(memory.data());
    const std::vector<unsigned char> pattern(memory.size() * 8, kPattern);
    std::memcpy(bytes, pattern.data(), pattern.size());
    for (std::size_t size = 0; size < enough; size += size < 4096 || size + 200 > enough ? 1 : 97) {
      ++sizes, other += touch(bytes, size) != PALPATE_STEP_BAD_INPUT;
      if (std::memcmp(bytes, pattern.data(), pattern.size()) == 0) continue;
      ++written;
      std::memcpy(bytes, pattern.data(), pattern.size());
    }
    other += touch(nullptr, enough) != PALPATE_STEP_BAD_INPUT;
    for (std::size_t off = 1; off < 8; ++off) other += touch(bytes + off, enough) != PALPATE_STEP_BAD_INPUT;
    written += std::memcmp(bytes, pattern.data(), pattern.size()) != 0;
    // The first step. It writes what it needs, and nothing behind.
    touch(bytes, enough);
    stepped += reinterpret_cast<palpate_contacts*>(bytes)->step != 1;
    for (std::size_t i = enough; i < pattern.size(); ++i) behind += bytes[i] != kPattern;
  }
  attack.hold("buffers that were written, of " + std::to_string(sizes) + " that are too small", written, 0,
              "the header: nothing is written");
  attack.hold("other answers than BAD_INPUT", other, 0, "BAD_INPUT alone");
  attack.hold("scenes that had stepped meanwhile, of 5", stepped, 0, "such a call is no step");
  attack.hold("bytes written behind a buffer of palpate_contacts_bytes", behind, 0, "the stated size suffices");
}

}  // namespace
}  // namespace palpate::tests
