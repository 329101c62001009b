// Many contacts at once: compares the paper's superposition with a solve in which all contact nodes are held.
#include <cmath>

#include "studies/accuracy/held_nodes.h"
#include "studies/bodies/bodies.h"
#include "studies/timing/timing.h"
#include "studies/validation/baked_body.h"
#include "studies/validation/cases.h"
#include "studies/validation/solved_body.h"
#include "studies/validation/tensor_answer.h"

namespace palpate::validation {
namespace {

constexpr const char *kDouble = "displacement, tensors in double", *kShipped = "displacement, bundle (f32) and runtime";
constexpr double kYoung = 5400, kSide = 0.16;

// level x level contact nodes spread over 12 x 12 cells in the middle of the top face.
struct HeldTop {
  ElasticBody body;
  std::vector<std::int32_t> nodes;
  std::vector<Vector3d> displacement;
};

TetrahedralMesh box() {
  return box_mesh({16, 16, 8}, {kSide, kSide, kSide / 2});
}

HeldTop held_top(const Variant& variant, int level) {
  HeldTop top = {body_of(box(), {{kYoung, variant.poisson, 0}}), {}, {}};
  hold(top.body, [](const Point& p) { return p[2] == 0 ? 7 : 0; });
  const double cell = kSide / 16;
  const int step = 12 / (level - 1);
  for (const auto n : top.body.touchable) {
    const Point& p = top.body.nodes[static_cast<std::size_t>(n)];
    const int i = static_cast<int>(std::lround(p[0] / cell)) - 2, j = static_cast<int>(std::lround(p[1] / cell)) - 2;
    if (p[2] < kSide / 2 || i < 0 || j < 0 || i > 12 || j > 12 || i % step != 0 || j % step != 0) continue;
    top.nodes.push_back(n);  // neighbouring contacts move in different directions
    top.displacement.push_back(1e-3 *
                               Vector3d(std::sin(12.9898 * n), std::sin(78.233 * n), -1 + 0.5 * std::sin(37.719 * n)));
  }
  return top;
}

std::filesystem::path bake_box(const Workshop& workshop, const Variant& variant) {
  return bake(workshop, {"superposition", box(), kYoung, variant.poisson, variant.element,
                         "[[fixed]]\ndofs = \"xyz\"\nselect = { patch = \"z0\" }\n"});
}

Measured measure_superposition(const Workshop& workshop, const Variant& variant, int level) {
  const HeldTop top = held_top(variant, level);
  const double begun = studies::processor_seconds();
  const auto superposed = superpose(top.body, variant.element, top.nodes, top.displacement);
  const double tensors_seconds = studies::processor_seconds() - begun;

  ElasticBody held = top.body;
  for (const auto n : top.nodes) held.fixed[static_cast<std::size_t>(n)] = {1, 1, 1};
  const DiscreteBody discrete = discretise_body(std::move(held), variant.element);
  std::vector<Vector3d> imposed(discrete.node_count(), Vector3d::Zero());
  for (std::size_t c = 0; c < top.nodes.size(); ++c)
    imposed[static_cast<std::size_t>(top.nodes[c])] = top.displacement[c];
  const auto at = [&](const Vector3d& x) {
    return imposed[static_cast<std::size_t>(node_at(discrete, {x[0], x[1], x[2]}))];
  };
  const Answer full = solve(discrete, at);

  std::vector<Vec3> targets;
  for (const auto& d : top.displacement) targets.push_back({d[0], d[1], d[2]});
  const auto shipped = accuracy::hold_nodes(bake_box(workshop, variant), top.nodes, targets).u;
  double largest = 0, off = 0, off_shipped = 0;
  for (std::size_t n = 0; n < discrete.node_count(); ++n) {
    largest = std::max(largest, full.at(n).norm());
    off = std::max(off, (superposed[n] - full.at(n)).norm());
    if (n < shipped.size())
      off_shipped = std::max(off_shipped, (Vector3d(shipped[n].x, shipped[n].y, shipped[n].z) - full.at(n)).norm());
  }
  Measured measured =
      measured_on(discrete, full, {error_alone(kDouble, off / largest), error_alone(kShipped, off_shipped / largest)});
  measured.solve_seconds += tensors_seconds;
  return measured;
}

}  // namespace

Case superposition(const Workshop& workshop) {
  return {"superposition",
          "49 and 169 contacts at once",
          "W f = u*, u = sum of T^u (T^f)^-1 f, against a solve with all contacts held",
          "Cotin, Delingette and Ayache 1999, eq. 8 and 9; exact by elimination",
          "exact on every mesh: no order",
          {{Element::p1, 0.45, {7, 13}}, {Element::p1_anp, 0.45, {7, 13}}},
          [workshop](const Variant& variant, int level) { return measure_superposition(workshop, variant, level); },
          [](const std::string& quantity, const Variant&) { return Expectation{quantity == kDouble ? 1e-12 : 1e-5}; }};
}

}  // namespace palpate::validation
