#include "runtime/surface/exact_signs.h"

namespace palpate {
namespace {

// x + y = high + low exactly; returns high.
double two_sum(double x, double y, double* low) {
  const double high = x + y, x_part = high - y, y_part = high - x_part;
  *low = (x - x_part) + (y - y_part);
  return high;
}

// x = high + low exactly, each of half the digits, so that a product of two halves is exact; returns high.
double split(double x, double* low) {
  const double shifted = 134217729 * x, high = shifted - (shifted - x);  // 2^27 + 1
  *low = x - high;
  return high;
}

// x * y = high + low exactly; returns high. Not by fma, which some C libraries round wrongly (that of mingw-w64 one time in ten).
double two_product(double x, double y, double* low) {
  double x_low, y_low;
  const double high = x * y, x_high = split(x, &x_low), y_high = split(y, &y_low);
  *low = x_low * y_low - (((high - x_high * y_high) - x_low * y_high) - x_high * y_low);
  return high;
}

// An exact sum: doubles whose digits do not overlap, in order of size. The last one has the sign of the sum.
struct ExactSum {
  // A determinant has 6 products of three entries; each entry has two parts, so 8 products each; each of them is 4 doubles.
  double part[6 * 8 * 4];
  int parts = 0;

  void add(double x) {
    int kept = 0;
    for (int i = 0; i < parts; ++i) {
      double low;
      x = two_sum(x, part[i], &low);
      if (low != 0) part[kept++] = low;
    }
    if (x != 0) part[kept++] = x;
    parts = kept;
  }
  void add_product(double x, double y, double z) {
    double factors[2], low;
    factors[1] = two_product(x, y, &factors[0]);
    for (const double factor : factors) {
      const double product = two_product(factor, z, &low);
      add(low);
      add(product);
    }
  }
  int sign() const { return parts > 0 ? sign_of(part[parts - 1]) : 0; }
};

Difference axis_direction(int axis) {
  Difference unit;
  unit.to[axis] = 1;
  return unit;
}

}  // namespace

int exact_sign_of_determinant(const Difference& a, const Difference& b, const Difference& c) {
  const Difference* row[3] = {&a, &b, &c};
  double entry[3][3][2];
  for (int i = 0; i < 3; ++i)
    for (int d = 0; d < 3; ++d) entry[i][d][0] = two_sum(row[i]->to[d], -row[i]->from[d], &entry[i][d][1]);
  ExactSum sum;
  for (int first = 0; first < 3; ++first)
    for (int step = 1; step < 3; ++step) {
      const double *x = entry[0][first], *y = entry[1][(first + step) % 3], *z = entry[2][(first + 2 * step) % 3];
      for (int which = 0; which < 8; ++which) {
        const double factor = step == 1 ? x[which & 1] : -x[which & 1];
        if (factor != 0 && y[which >> 1 & 1] != 0 && z[which >> 2] != 0)
          sum.add_product(factor, y[which >> 1 & 1], z[which >> 2]);
      }
    }
  return sum.sign();
}

int exact_side_of_plane(Vec3 a, Vec3 b, Vec3 c, Vec3 p) {
  const Difference ab{b, a}, ac{c, a};
  int side = exact_sign_of_determinant(ab, ac, {p, a});
  for (int axis = 0; axis < 3 && side == 0; ++axis)  // powers of e in order
    side = exact_sign_of_determinant(ab, ac, axis_direction(axis));
  return side;
}

int exact_side_of_edge(Vec3 a, Vec3 b, Vec3 p, Vec3 q) {
  const Difference edge{b, a}, line{q, p};
  int side = exact_sign_of_determinant({a, p}, edge, line);
  for (int axis = 0; axis < 3 && side == 0; ++axis) side = -exact_sign_of_determinant(axis_direction(axis), edge, line);
  return side;
}

}  // namespace palpate
