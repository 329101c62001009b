// The estimate of an element's own stiffness, on bodies that no constant was chosen with.
#include <gtest/gtest.h>

#include "studies/bodies/bodies.h"
#include "studies/bodies/element_truth.h"
#include "studies/validation/shapes.h"
#include "tests/precompute/support.h"

namespace palpate::tests {
namespace {

ElasticBody cantilever(int cells) {
  return held_body(box_mesh({10 * cells / 3, cells, cells}, {0.1, 0.03, 0.03}, 0.1), {{250e3, 0.49, 0}},
                   [](const auto& p) { return p[0] == 0 ? 7 : 0; });
}
ElasticBody between_plates() {
  return held_body(validation::cylinder_mesh(0.025, 0.03, 4, 5), {{6e3, 0.49, 0}},
                   [](const auto& p) { return p[2] < 1e-9 || p[2] > 0.03 - 1e-9 ? 7 : 0; });
}

TEST(ElementExcess, HasAMedianWithinAQuarterOfTheTrueOne) {
  for (const ElasticBody& body : {cantilever(3), cantilever(6), between_plates()}) {
    const ElementExcess estimate = estimated_excess(body, Element::p1_anp),
                        truth = element_truth(body, Element::p1_anp);
    EXPECT_EQ(estimate.probes, 3);
    EXPECT_GT(truth.largest, 0.03) << "nothing to estimate";
    EXPECT_NEAR(estimate.median / truth.median, 1, 0.25) << truth.median;
    EXPECT_GE(estimate.largest, estimate.median);
  }
}

TEST(ElementExcess, TheAveragedGradientHasAFifthOfTheStiffnessOfItsOwn) {
  for (const ElasticBody& body : {cantilever(3), cantilever(6)})
    EXPECT_LT(std::abs(element_truth(body, Element::p1_ang).largest),
              0.2 * element_truth(body, Element::p1_anp).largest);
}

}  // namespace
}  // namespace palpate::tests
