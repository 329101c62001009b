// Orders of convergence of the elements for manufactured displacements on the unit box. These are the cases of
// palpate-validation, on meshes that take seconds.
#include "studies/validation/cases.h"
#include "studies/validation/judge.h"
#include "tests/precompute/support.h"

namespace palpate::validation {
namespace {

// The order must be within 0.15 of theory, for the displacement and for its gradient.
void expect_orders(const Case& c, Element element, double poisson, const std::vector<int>& levels) {
  const Variant variant = {element, poisson, levels};
  const Measured coarse = c.measure(variant, levels[0]), fine = c.measure(variant, levels[1]);
  ASSERT_EQ(fine.quantities.size(), 2u);
  for (std::size_t q = 0; q < 2; ++q) {
    const auto& name = fine.quantities[q].name;
    const Verdict verdict =
        judge(c.expect(name, variant), levels, {coarse.quantities[q].error, fine.quantities[q].error}, true);
    EXPECT_TRUE(verdict.judged && verdict.holds)
        << c.id << ' ' << name_of(element) << ' ' << poisson << ' ' << name << ": " << verdict.sentence;
  }
}

TEST(Convergence, LinearElementsReachTheirOrders) {
  expect_orders(manufactured(4), Element::p1, 0.3, {12, 18});
  for (const double poisson : {0.3, 0.4999}) expect_orders(manufactured(4), Element::p1_anp, poisson, {12, 18});
}

TEST(Convergence, QuadraticTetrahedraLoseAnOrderToTheirConstantPressureAndHaveItWithoutOne) {
  expect_orders(manufactured(4), Element::p2_p0, 0.3, {8, 12});
  for (const double poisson : {0.3, 0.49, 0.4999}) expect_orders(manufactured(0), Element::p2_p0, poisson, {6, 10});
}

TEST(Convergence, LinearTetrahedraDoNotConvergeNearIncompressibilityOnMeshesOneCanAfford) {
  const auto error = [](int cells) {
    return manufactured(4).measure({Element::p1, 0.4999, {}}, cells).quantities[0].error;
  };
  EXPECT_GT(error(12), 0.9 * error(6));
}

}  // namespace
}  // namespace palpate::validation
