// Materials at the ends of what is measured: units, nu towards 1/2, contrast.
#include "precompute/elements/element_warnings.h"
#include "tests/stability/solved_columns.h"
#include "tests/stability/stability_case.h"

namespace palpate::tests {
namespace {

TEST(StabilityMaterial, FromOnePascalToATerapascal) {
  StabilityCase attack(
      "A stiffness in pascals compared with a fixed number would refuse jelly, or take steel for singular.");
  for (const Element element : kElements) {
    double worst = 0;
    const auto at = [&](double young) {
      return tensors_of(held_body(box_mesh({4, 3, 3}, {0.06, 0.05, 0.04}, 0.15), {{young, 0.45, 0}}), element, young);
    };
    const std::vector<double> expected = at(5400);
    for (const double young : {1.0, 1e3, 1e6, 1e12}) worst = std::max(worst, off(at(young), expected));
    attack.hold("tensors of 1 Pa to 1 TPa against 5400 Pa, " + std::string(name_of(element)), worst, 1e-9,
                "both solved to 1e-12 and a condition of some hundred");
  }
}

TEST(StabilityMaterial, PoissonsRatioTowardsAHalf) {
  StabilityCase attack(
      "As nu goes to 1/2 plain linear tetrahedra lock: force without end. The two elements that are meant for it must "
      "not.");
  const auto force = [](Element element, double nu) {
    const ElasticBody body = held_body(box_mesh({4, 4, 4}, {0.06, 0.06, 0.06}), {{5400, nu, 0}});
    std::vector<std::int32_t> middle;
    for (const std::int32_t n : body.touchable)
      if (body.nodes[static_cast<std::size_t>(n)] == Point{0.06, 0.03, 0.03}) middle = {n};
    return solve_node_tensors(body, element, middle, 1e-9).at(0).force[0];
  };
  double anp = 0, locks = 0, unflagged = 0;
  const double anp_first = force(Element::p1_anp, 0.3) / force(Element::p2_p0, 0.3);
  for (const double nu : {0.3, 0.4, 0.45, 0.49, 0.495, 0.499, 0.4995, 0.4999}) {
    const double reference = force(Element::p2_p0, nu);
    const double p1 = force(Element::p1, nu) / reference, averaged = force(Element::p1_anp, nu) / reference;
    const ElasticBody warned = held_body(box_mesh({4, 4, 4}, {0.06, 0.06, 0.06}), {{5400, nu, 0}});
    unflagged += element_warnings(warned, Element::p1).empty() != (nu <= 0.4);
    attack.point("force against nu", "p1", 0.5 - nu, p1);
    attack.point("force against nu", "p1-anp", 0.5 - nu, averaged);
    attack.point("force against nu", "p2-p0", 0.5 - nu, 1);
    anp = std::max(anp, std::abs(averaged / anp_first - 1)), locks = std::max(locks, p1);
  }
  attack.hold("force of p1-anp over p2-p0, change from nu 0.3 to 0.4999", anp, 0.25,
              "it does not lock: what a coarse mesh adds to a point's force does not grow with nu");
  attack.hold("p1 above 0.4 without a warning, or with one below", unflagged, 0, "element_warnings.h");
  attack.hold("1 over the locking of p1 at 0.4999", 1 / locks, 0.5,
              "the attack is as sharp as it says: p1 locks twofold and more");
}

TEST(StabilityMaterial, ContrastInBlocksAndInThinLayers) {
  StabilityCase attack(
      "Where soft and stiff meet, multigrid's coarse levels average the two; iterations can grow with the contrast "
      "without "
      "end.");
  // Half as many cells for p2-p0, whose nodes stand twice as densely.
  const int fine = quick_or_long(8, 16);
  struct Pattern {
    const char* name;
    std::function<bool(Point, int)> stiff;  // of a place in [0, 1]^3, and the cells along an edge
  };
  const Pattern patterns[] = {
      {"blocks", [](Point p, int) { return (p[0] < 0.5) != ((p[1] < 0.5) != (p[2] < 0.5)); }},
      {"stiff layers one element thin", [](Point p, int n) { return static_cast<int>(p[2] * n) % 4 == 2; }},
      {"soft layers one element thin", [](Point p, int n) { return static_cast<int>(p[2] * n) % 4 != 2; }},
  };
  for (const Element element : kElements)
    for (const Pattern& pattern : patterns)
      for (const bool cholesky : {true, false}) {
        const int n = element == Element::p2_p0 ? fine / 2 : fine;
        // The whole sweep is drawn for one element; the others take its ends.
        const bool drawn = element == Element::p1_anp && !cholesky;
        int most = 0;
        double residual = 0;
        for (const double contrast : {1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6}) {
          if (!drawn && contrast != 1e3 && contrast != 1e6) continue;
          TetrahedralMesh mesh = box_mesh({n, n, n}, {1, 1, 1});
          mesh.region_names = {"soft", "stiff"};
          for (std::size_t e = 0; e < mesh.tetrahedra.size(); ++e) {
            Point centre{};
            for (const std::int32_t v : mesh.tetrahedra[e])
              for (std::size_t d = 0; d < 3; ++d) centre[d] += 0.25 * mesh.nodes[static_cast<std::size_t>(v)][d];
            mesh.region[e] = pattern.stiff(centre, n);
          }
          const Solved solved =
              solve(held_body(mesh, {{1000, 0.45, 0}, {1000 * contrast, 0.45, 0}}), element, cholesky);
          most = std::max(most, solved.iterations), residual = std::max(residual, solved.residual);
          if (drawn) attack.point("iterations against contrast", pattern.name, contrast, solved.iterations);
        }
        const std::string of =
            std::string(pattern.name) + ", " + name_of(element) + (cholesky ? ", factor" : ", multigrid");
        attack.hold(
            "iterations to 1e-7 up to a contrast of 1e6, " + of, most, cholesky ? 3 : 400,
            cholesky ? "a backward stable factor and its refinement" : "what the solver's defaults give up at is 1000");
        attack.hold("true residual, " + of, residual, 1e-7, "the tolerance asked for");
      }
}

}  // namespace
}  // namespace palpate::tests
