// Supports that leave a rigid motion free, supports that just prevent all of them, and supports that hold some dofs of a node. A
// support must be refused exactly where K is singular, and the refusal names the part and the motion.
#include "precompute/elements/support_check.h"
#include "tests/stability/extended_precision.h"
#include "tests/stability/stability_case.h"
#include "tests/support/joined_meshes.h"
#include "tests/support/texts.h"

namespace palpate::tests {
namespace {

// The box [0, 2]^3 and a shifted copy of it for each shift; nodes that coincide become one.
TetrahedralMesh boxes(const std::vector<Point>& shifts) {
  const TetrahedralMesh one = box_mesh({2, 2, 2}, {2, 2, 2});
  TetrahedralMesh mesh = one;
  for (const Point& shift : shifts) add_shifted(mesh, one, shift);
  return mesh;
}

struct Support {
  const char* name;
  std::vector<Point> shifts;               // one for each further box
  std::function<int(const Point&)> holds;  // bits 1, 2, 4: x, y, z
  int motions;                             // rigid motions that the support leaves, counted by hand
  std::vector<const char*> named = {};     // what the refusal also names: the part of the body, the motion
};
bool is(const Point& p, double x, double y, double z) {
  return p == Point{x, y, z};
}
const std::vector<Support>& supports() {
  static const std::vector<Support> all = {
      {"floating", {}, [](const Point&) { return 0; }, 6, {"bc.toml"}},
      {"a face", {}, [](const Point& p) { return p[0] == 0 ? 7 : 0; }, 0},
      {"one node", {}, [](const Point& p) { return is(p, 0, 0, 0) ? 7 : 0; }, 3},
      {"two nodes", {}, [](const Point& p) { return is(p, 0, 0, 0) || is(p, 2, 1, 2) ? 7 : 0; }, 1},
      {"the ends of an edge",
       {},
       [](const Point& p) { return is(p, 0, 2, 0) || is(p, 2, 2, 0) ? 7 : 0; },
       1,
       {"through (1, 2, 0) m along (1, 0, 0)"}},
      {"three nodes on a line",
       {},
       [](const Point& p) { return p[1] == 0 && p[2] == 0 ? 7 : 0; },
       1,
       {"along (1, 0, 0)"}},
      {"three nodes", {}, [](const Point& p) { return is(p, 0, 0, 0) || is(p, 2, 0, 0) || is(p, 0, 2, 0) ? 7 : 0; }, 0},
      {"3-2-1", {}, [](const Point& p) { return is(p, 0, 0, 0)   ? 7
                                                : is(p, 2, 0, 0) ? 6
                                                : is(p, 0, 2, 0) ? 4
                                                                 : 0; }, 0},
      {"3-2-1 with the last one beside its place",
       {},
       [](const Point& p) {
         return is(p, 0, 0, 0) ? 7 : is(p, 2, 0, 0) ? 6 : is(p, 1, 0, 0) ? 4 : 0;
       },
       1},
      {"a plane in z",
       {},
       [](const Point& p) { return p[2] == 0 ? 4 : 0; },
       3,
       {"slide along", "rotate about", "along (0, 0, 1)"}},
      {"planes in y and z",
       {},
       [](const Point& p) { return (p[1] == 0 ? 2 : 0) | (p[2] == 0 ? 4 : 0); },
       1,
       {"slide along (1, 0, 0)"}},
      {"planes in x, y and z",
       {},
       [](const Point& p) { return (p[0] == 0 ? 1 : 0) | (p[1] == 0 ? 2 : 0) | (p[2] == 0 ? 4 : 0); },
       0},
      {"six dofs that meet one axis",
       {},
       [](const Point& p) {
         return (p[2] == 0 && p[0] != 1 && p[1] != 1 ? 4 : 0) | (is(p, 1, 1, 0) || is(p, 1, 1, 2) ? 3 : 0);
       },
       1,
       {"through (1, 1, 1) m along (0, 0, 1)"}},
      {"all x of one line", {}, [](const Point& p) { return p[1] == 0 && p[2] == 0 ? 1 : 0; }, 5},
      {"two boxes apart, one held",
       {{5, 0, 0}},
       [](const Point& p) { return p[0] == 0 ? 7 : 0; },
       6,
       {"part 2 of 2", "around (6, 1, 1) m", "nothing holds it at all"}},
      {"two boxes apart, both held", {{5, 0, 0}}, [](const Point& p) { return p[0] == 0 || p[0] == 7 ? 7 : 0; }, 0},
      {"two boxes with one vertex in common",
       {{2, 2, 2}},
       [](const Point& p) { return p[0] == 0 ? 7 : 0; },
       3,
       {"part 2 of 2", "at 1 nodes"}},
      {"two boxes with one edge in common",
       {{2, 2, 0}},
       [](const Point& p) { return p[0] == 0 ? 7 : 0; },
       1,
       {"at 3 nodes", "through (2, 2, 1) m along (0, 0, 1)"}},
      {"two boxes with half a face in common", {{2, 1, 1}}, [](const Point& p) { return p[0] == 0 ? 7 : 0; }, 0},
      {"an arch of three hinges",
       {{2, 2, 0}},
       [](const Point& p) { return (p[0] == 0 && p[1] == 0) || (p[0] == 4 && p[1] == 2) ? 7 : 0; },
       0},
      {"an arch whose three hinges stand in line",
       {{2, 2, 0}},
       [](const Point& p) { return (p[0] == 0 && p[1] == 0) || (p[0] == 4 && p[1] == 4) ? 7 : 0; },
       1},
      {"a chain of three boxes by edges, its ends held",
       {{2, 2, 0}, {4, 0, 0}},
       [](const Point& p) { return (p[0] == 0 && p[1] <= 2) || p[0] == 6 ? 7 : 0; },
       0},
  };
  return all;
}

// The box's edge is twice the size; away: m along x.
ElasticBody held(const Support& support, double size, double away = 0) {
  TetrahedralMesh mesh = boxes(support.shifts);
  ElasticBody body = body_of(mesh, {{5400, 0.45, 0}});
  hold(body, support.holds);
  for (Point& p : body.nodes) {
    for (double& x : p) x *= size;
    p[0] += away;
  }
  return body;
}

// The number of motions without energy that the support leaves: eigenvalues of K that are zero.
int nullity(const ElasticBody& body) {
  const auto free = free_dofs(body);
  const Eigen::VectorXd values = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(
                                     dense(assemble_stiffness(body))(free, free), Eigen::EigenvaluesOnly)
                                     .eigenvalues();
  return static_cast<int>((values.array() < 1e-10 * values.maxCoeff()).count());
}

TEST(StabilitySupport, IsRefusedExactlyWhereKIsSingular) {
  StabilityCase attack(
      "A motion that no support prevents makes K singular: the factorisation fails, or succeeds with columns of "
      "rounding. Two parts that share only a vertex or an edge count as connected, but the hinge transfers no moment.");
  double singular = 0, refused = 0, motions = 0, cases = 0;
  for (const Support& support : supports())
    for (const auto& [size, away] : {std::pair(1e-6, 0.0), {0.01, 0.0}, {1.0, 0.0}, {1.0, 1e4}, {1e3, 0.0}}) {
      const ElasticBody body = held(support, size, away);
      const std::string said = refusal(body);
      const std::string counted = std::to_string(support.motions) + " of its 6 rigid motions left";
      ++cases;
      singular += nullity(body) != support.motions;
      refused += said.empty() != (support.motions == 0);
      motions += support.motions > 0 && said.find(counted) == std::string::npos;
      if (size != 1 || away != 0) continue;
      for (const char* noun : support.named)
        EXPECT_TRUE(said.find(noun) != std::string::npos) << support.name << ": " << said;
    }
  const std::string of = " of " + std::to_string(static_cast<int>(cases));
  attack.hold("supports where K has another nullity than statics," + of, singular, 0, "the test builds what it claims");
  attack.hold("supports refused that hold, or taken that do not," + of, refused, 0, "support_check.h");
  attack.hold("refusals that count other motions than K," + of, motions, 0, "each is named in the sentence");
}

TEST(StabilitySupport, ThatHoldsIsSolvedHoweverFewItsDofs) {
  StabilityCase attack(
      "Three nodes, or six dofs, that barely support a body: support forces are large compared with the touch, and the "
      "held dofs of a partly held node must couple to nothing.");
  for (const Element element : kElements) {
    double worst = 0;
    for (const Support& support : supports()) {
      if (support.motions > 0 || !support.shifts.empty()) continue;
      const ElasticBody body = held(support, 0.01);
      // One free node, and each node of which some dofs are held.
      std::vector<std::int32_t> nodes = {body.touchable[body.touchable.size() / 2]};
      for (const std::int32_t n : body.touchable)
        if (const auto& f = body.fixed[n]; (f[0] || f[1] || f[2]) && nodes.size() < 8) nodes.push_back(n);
      for (const NodeTensor& tensor : solve_node_tensors(body, element, nodes, 1e-9))
        worst = std::max(worst, off(tensor.displacement, in_extended_precision(body, element, tensor.node)));
    }
    attack.hold(std::string("error of a tensor against extended precision, ") + name_of(element), worst, 1e-6,
                "the tolerance of 1e-9 times the condition of a body on its points, some hundred");
  }
}

TEST(StabilitySupport, WithEverythingFixedIsRefused) {
  StabilityCase attack("With every node held there is no dof to solve for: the system is empty, and so is the bundle.");
  const TetrahedralMesh mesh = box_mesh({2, 2, 2}, {2, 2, 2});
  OrganConfig organ;
  organ.regions.push_back({"box", {5400, "test"}, {0.45, "test"}, {}});
  BoundaryConfig everything;
  everything.fixed.emplace_back();
  everything.fixed[0].dofs = {true, true, true};
  everything.fixed[0].select.emplace_back();
  everything.fixed[0].select[0].kind = Selector::Kind::everything;
  const std::string said = input_error([&] {
    make_elastic_body(mesh, organ, everything, {"box.msh", "organ.toml", "bc.toml"});
  });
  attack.hold("taken, or refused without naming file and cause",
              said.find("bc.toml: no node can be touched") == std::string::npos, 0, "elastic_body.h");
}

}  // namespace
}  // namespace palpate::tests
