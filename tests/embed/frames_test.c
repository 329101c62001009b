/* Each conversion of frames.h comes back to where it began, keeps lengths to its unit, and mirrors exactly where the target is
 * left-handed. */
#include "frames.h"

#include <math.h>
#include <stdio.h>

static double determinant(double a[3][3]) {
  return a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) - a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0]) +
         a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]);
}

static int check(const char* what, int holds) {
  if (!holds) fprintf(stderr, "%s does not hold\n", what);
  return !holds;
}

int main(void) {
  /* Multiples of powers of two: exact in float as well. */
  const double point[3] = {0.125, -0.5, 2};
  double back[3], unity[3][3], unreal[3][3], ras[3][3];
  float as_unity[3];
  int failures = 0;
  unity_from_lps(point, as_unity), lps_from_unity(as_unity, back);
  failures += check("LPS -> Unity -> LPS", back[0] == point[0] && back[1] == point[1] && back[2] == point[2]);
  failures += check("up is y in Unity", as_unity[1] == 2);
  unreal_from_lps(point, unreal[0]), lps_from_unreal(unreal[0], back);
  failures += check("LPS -> Unreal -> LPS", back[0] == point[0] && back[1] == point[1] && back[2] == point[2]);
  failures += check("up is z in Unreal, in centimetres", unreal[0][2] == 200);
  for (int axis = 0; axis < 3; ++axis) {
    const double unit[3] = {axis == 0, axis == 1, axis == 2};
    unity_from_lps(unit, as_unity), unreal_from_lps(unit, unreal[axis]), ras_from_lps(unit, ras[axis]);
    for (int d = 0; d < 3; ++d) unity[axis][d] = as_unity[d];
  }
  failures += check("Unity mirrors, in metres", determinant(unity) == -1);
  failures += check("Unreal mirrors, in centimetres", determinant(unreal) == -1e6);
  failures += check("RAS turns, in millimetres", determinant(ras) == 1e9);
  return failures != 0;
}
