// Signs of determinants against integers, where doubles round.
#include "runtime/surface/exact_signs.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <random>

namespace palpate::tests {
namespace {

__extension__ using Integer = __int128;
using IntegerPoint = std::array<std::int64_t, 3>;

Vec3 rounded(const IntegerPoint& p, double unit) {
  return {unit * static_cast<double>(p[0]), unit * static_cast<double>(p[1]), unit * static_cast<double>(p[2])};
}
Integer minus(const IntegerPoint& a, const IntegerPoint& b, int d) {
  return static_cast<Integer>(a[d]) - b[d];
}
int sign(Integer x) {
  return (x > 0) - (x < 0);
}

Integer determinant(const IntegerPoint& a, const IntegerPoint& b, const IntegerPoint& c, const IntegerPoint& p) {
  Integer sum = 0;
  for (int x = 0; x < 3; ++x)
    sum += minus(a, p, x) *
           (minus(b, p, (x + 1) % 3) * minus(c, p, (x + 2) % 3) - minus(b, p, (x + 2) % 3) * minus(c, p, (x + 1) % 3));
  return sum;
}

TEST(ExactSigns, AreThoseOfIntegersAlsoWhereRoundingSaysZeroOrTurnsThem) {
  std::mt19937_64 random(3);
  // Coordinates of up to 2^39, so that a determinant of differences stays below 2^127; the units are powers of two.
  std::uniform_int_distribution<std::int64_t> at(-(1LL << 39), 1LL << 39), step(-3, 3);
  const auto any = [&] { return IntegerPoint{at(random), at(random), at(random)}; };
  long ties = 0, turned = 0;
  for (int i = 0; i < 200000; ++i) {
    const IntegerPoint a = any(), b = any(), p = any();
    IntegerPoint c = any();
    for (std::size_t d = 0; d < 3 && i % 2; ++d)  // half of the points lie in one plane with the others or next to it
      c[d] = (a[d] + b[d]) / 2 + (p[d] - a[d]) / 4 + (i % 4 == 1 ? step(random) : 0);
    const double unit = i % 3 ? 0x1p-50 : 0x1p-10;
    const Vec3 da = rounded(a, unit), db = rounded(b, unit), dc = rounded(c, unit), dp = rounded(p, unit);
    // As a plane and a point, and as two lines: det(a - p, b - p, c - p) in other orders.
    const int expected = sign(determinant(a, b, c, p));
    ASSERT_EQ(exact_sign_of_determinant({da, dp}, {db, dp}, {dc, dp}), expected);
    if (expected) {
      ASSERT_EQ(side_of_plane(da, db, dc, dp), -expected);
      ASSERT_EQ(side_of_plane(db, da, dc, dp), expected);
      ASSERT_EQ(side_of_edge(da, db, dp, dc), expected);
    } else {
      ASSERT_EQ(side_of_plane(da, db, dc, dp), -side_of_plane(db, da, dc, dp));
      ASSERT_NE(side_of_plane(da, db, dc, dp), 0);
      ASSERT_EQ(side_of_edge(da, db, dp, dc), -side_of_edge(db, da, dp, dc));
    }
    ties += expected == 0, turned += sign_of(dot(cross(da - dp, db - dp), dc - dp)) != expected;
  }
  EXPECT_GT(turned, 100);  // the attack is as sharp as it says
  EXPECT_GT(ties, 0);
}

TEST(ExactSigns, AreExactWhereADifferenceOfCoordinatesRounds) {
  // 1e6 - 2^-60 is not a double: the difference rounds to 1e6, and only the part lost in rounding decides the side.
  const Vec3 p{0x1p-60, 0, 0}, a{1e6, 1e6, 0}, b{2e6, 2e6, 0}, q{0x1p-60, 0, 1};
  EXPECT_EQ(side_of_edge(a, b, p, q), -1);
  EXPECT_EQ(side_of_edge(b, a, p, q), 1);
}

TEST(ExactSigns, GiveAPointOnAPlaneTheSideOfAPointALittleFurtherAlongX) {
  const Vec3 a{0, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
  EXPECT_EQ(side_of_plane(a, y, z, {0, .3, .3}), side_of_plane(a, y, z, {1e-9, .3, .3}));
  EXPECT_EQ(side_of_plane(a, z, y, {0, .3, .3}), side_of_plane(a, z, y, {1e-9, .3, .3}));
  // A shift along x does not break the tie, so the shift along y does.
  EXPECT_EQ(side_of_plane(a, z, {1, 0, 0}, {.3, 0, .3}), side_of_plane(a, z, {1, 0, 0}, {.3, 1e-9, .3}));
  EXPECT_EQ(side_of_edge(a, y, {0, .3, -1}, {0, .3, 1}), side_of_edge(a, y, {1e-9, .3, -1}, {1e-9, .3, 1}));
  // A triangle without area has no sides, so the answer is 0.
  EXPECT_EQ(side_of_plane(a, y, {0, 2, 0}, {1, 2, 3}), 0);
}

}  // namespace
}  // namespace palpate::tests
