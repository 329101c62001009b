// A support that leaves a rigid motion free is refused; the message names the part and the motion.
#include "precompute/elements/support_check.h"

#include <gmock/gmock.h>

#include "tests/precompute/support.h"
#include "tests/support/joined_meshes.h"

namespace palpate::tests {
namespace {

using Point = std::array<double, 3>;
using ::testing::HasSubstr;

ElasticBody box() {
  return body_of(box_mesh({2, 2, 2}, {2, 2, 2}), {{1000, 0.3, 0}});
}

std::string refusal_of_box(const std::function<int(const Point&)>& which) {
  ElasticBody body = box();
  hold(body, which);
  return refusal(body);
}

bool is(const Point& p, double x, double y, double z) {
  return p[0] == x && p[1] == y && p[2] == z;
}

TEST(Support, HoldsOnAFaceOrOnThreeNodesOrOnSixWellPlacedDofs) {
  EXPECT_EQ(refusal_of_box([](const Point& p) { return p[0] == 0 ? 7 : 0; }), "");
  EXPECT_EQ(refusal_of_box([](const Point& p) { return is(p, 0, 0, 0) || is(p, 2, 0, 0) || is(p, 0, 2, 0) ? 7 : 0; }),
            "");
  EXPECT_EQ(refusal_of_box([](const Point& p) {
              return is(p, 0, 0, 0) ? 7 : is(p, 2, 0, 0) ? 6 : is(p, 0, 2, 0) ? 4 : 0;  // 3-2-1
            }),
            "");
}

TEST(Support, RefusesNothingHeld) {
  const auto text = refusal_of_box([](const Point&) { return 0; });
  EXPECT_THAT(text, HasSubstr("bc.toml"));
  EXPECT_THAT(text, HasSubstr("6 of its 6"));
}

TEST(Support, RefusesOneNodeByItsThreeRotations) {
  const auto text = refusal_of_box([](const Point& p) { return is(p, 0, 0, 0) ? 7 : 0; });
  EXPECT_THAT(text, HasSubstr("3 of its 6"));
}

TEST(Support, RefusesTwoNodesByTheAxisThroughThem) {
  const auto text = refusal_of_box([](const Point& p) { return is(p, 0, 2, 0) || is(p, 2, 2, 0) ? 7 : 0; });
  EXPECT_THAT(text, HasSubstr("through (1, 2, 0) m along (1, 0, 0)"));
}

TEST(Support, RefusesAnyNumberOfNodesOnOneLine) {
  const auto text = refusal_of_box([](const Point& p) { return p[1] == 0 && p[2] == 0 ? 7 : 0; });
  EXPECT_THAT(text, HasSubstr("1 of its 6"));
  EXPECT_THAT(text, HasSubstr("along (1, 0, 0)"));
}

TEST(Support, RefusesASlidingFaceByItsTwoSlidesAndItsTurn) {
  const auto text = refusal_of_box([](const Point& p) { return p[2] == 0 ? 4 : 0; });
  EXPECT_THAT(text, HasSubstr("3 of its 6"));
  EXPECT_THAT(text, HasSubstr("slide along"));
  EXPECT_THAT(text, HasSubstr("rotate about"));
  EXPECT_THAT(text, HasSubstr("along (0, 0, 1)"));
}

TEST(Support, RefusesRollersThatLeaveOneSlide) {
  const auto text = refusal_of_box([](const Point& p) { return (p[2] == 0 ? 4 : 0) | (p[1] == 0 ? 2 : 0); });
  EXPECT_THAT(text, HasSubstr("slide along (1, 0, 0)"));
}

TEST(Support, RefusesSixDofsThatAllMeetOneAxis) {
  // Six dofs are held, as many as there are rigid motions, but none of them prevents the rotation about the z axis
  // through (1, 1).
  const auto text = refusal_of_box([](const Point& p) {
    return (p[2] == 0 && p[0] != 1 && p[1] != 1 ? 4 : 0) | (is(p, 1, 1, 0) || is(p, 1, 1, 2) ? 3 : 0);
  });
  EXPECT_THAT(text, HasSubstr("through (1, 1, 1) m along (0, 0, 1)"));
}

// The body with a second, shifted copy of the box; nodes of both that coincide become one.
TetrahedralMesh two_boxes(const Point& shift) {
  TetrahedralMesh mesh = box_mesh({2, 2, 2}, {2, 2, 2});
  add_shifted(mesh, TetrahedralMesh(mesh), shift);
  return mesh;
}

std::string refusal_of_two(const Point& shift, const std::function<int(const Point&)>& which) {
  ElasticBody body = body_of(two_boxes(shift), {{1000, 0.3, 0}});
  hold(body, which);
  return refusal(body);
}

TEST(Support, RefusesASecondPartThatNothingHolds) {
  const auto first = [](const Point& p) { return p[0] == 0 ? 7 : 0; };
  const auto text = refusal_of_two({5, 0, 0}, first);
  EXPECT_THAT(text, HasSubstr("part 2 of 2"));
  EXPECT_THAT(text, HasSubstr("around (6, 1, 1) m"));
  EXPECT_THAT(text, HasSubstr("nothing holds it at all"));
  EXPECT_EQ(refusal_of_two({5, 0, 0}, [](const Point& p) { return p[0] == 0 || p[0] == 7 ? 7 : 0; }), "");
}

TEST(Support, HoldsASecondPartThroughASharedFace) {
  EXPECT_EQ(refusal_of_two({2, 0, 0}, [](const Point& p) { return p[0] == 0 ? 7 : 0; }), "");
}

TEST(Support, RefusesAPartThatHangsOnOneVertex) {
  const auto text = refusal_of_two({2, 2, 2}, [](const Point& p) { return p[0] == 0 ? 7 : 0; });
  EXPECT_THAT(text, HasSubstr("part 2 of 2"));
  EXPECT_THAT(text, HasSubstr("at 1 nodes"));
  EXPECT_THAT(text, HasSubstr("3 of its 6"));
}

TEST(Support, RefusesAPartThatHangsOnOneEdge) {
  const auto text = refusal_of_two({2, 2, 0}, [](const Point& p) { return p[0] == 0 ? 7 : 0; });
  EXPECT_THAT(text, HasSubstr("at 3 nodes"));
  EXPECT_THAT(text, HasSubstr("through (2, 2, 1) m along (0, 0, 1)"));
}

TEST(Support, HoldsTwoHingedPartsThatOnlyHoldTogether) {
  // A three-hinged arch: each part alone has one or two motions left, and the hinge along z at (2, 2) prevents them.
  const auto arch = [](const Point& p) { return (p[0] == 0 && p[1] == 0) || (p[0] == 4 && p[1] == 2) ? 7 : 0; };
  EXPECT_EQ(refusal_of_two({2, 2, 0}, arch), "");
  // Where all three hinges lie on one line, small motions of the middle hinge across that line cost no energy.
  const auto straight = [](const Point& p) { return (p[0] == 0 && p[1] == 0) || (p[0] == 4 && p[1] == 4) ? 7 : 0; };
  EXPECT_THAT(refusal_of_two({2, 2, 0}, straight), HasSubstr("rigid motions left"));
}

TEST(Support, IsJudgedFarFromTheOriginAsNearIt) {
  ElasticBody body = box();
  for (auto& p : body.nodes) p[0] += 1e4;  // metres: four orders beyond the body's size
  hold(body, [](const Point& p) { return p[1] == 0 && p[2] == 0 ? 7 : 0; });
  EXPECT_THAT(refusal(body), HasSubstr("1 of its 6"));
  hold(body, [](const Point& p) { return p[2] == 0 ? 7 : 0; });
  EXPECT_EQ(refusal(body), "");
}

}  // namespace
}  // namespace palpate::tests
