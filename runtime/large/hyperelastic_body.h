// The body that large deformation works on: the bundle's tetrahedra with a law for each region.
#pragma once

#include <cstdint>

#include "formats/tissue_laws.h"

namespace palpate {

// What the law of a tissue has beside its moduli near rest: neo-Hookean, or that of exponential_law.h, yeoh_law.h or ogden_law.h.
struct LawForm {
  enum class Kind { neo_hookean, exponential, yeoh, ogden } kind = Kind::neo_hookean;
  double constant[3] = {};  // b; c2 and c3, Pa; a_1, mu_2 / mu and a_2

  LawForm() = default;
  // b of the exponential law; 0: neo-Hookean.
  LawForm(double stiffening)
      : kind(stiffening > 0 ? Kind::exponential : Kind::neo_hookean), constant{stiffening, 0, 0} {}
  static LawForm yeoh(double c2, double c3) { return {Kind::yeoh, c2, c3, 0}; }
  static LawForm ogden(double exponent, double share = 0, double second = 2) {
    return {Kind::ogden, exponent, share, second};
  }

 private:
  LawForm(Kind of, double a, double b, double c) : kind(of), constant{a, b, c} {}
};

// Of a row of the bundle's section large/law whose first number is a law.
inline LawForm form_of_row(const double* row) {
  return row[0] == static_cast<double>(formats::StoredLaw::yeoh) ? LawForm::yeoh(row[1], row[2])
                                                                 : LawForm::ogden(row[1], row[2], row[3]);
}

// Of a region.
struct TissueLaw {
  double shear = 0, bulk = 0;  // Pa, near rest
  LawForm form = {};
};

// Borrowed arrays; indices are checked, volumes positive.
//
// With nodal_dilatation (element p1-anp) the energy is that of isochoric laws, and the volume changes at the nodes:
//     E = sum_e V_e W_e(F_e) + sum_(n,m) V_nm kappa_m / 2 (J_nm - 1)^2
// J_nm is the mean of J over the tetrahedra of region m at node n, each with a quarter of its volume, and V_nm the sum of these
// quarters. Of p1-ang the share s = averaged_shear of W moves to the nodes as well:
//     E = sum_e (1 - s) V_e W_e(F_e) + sum_(n,m) V_nm (s W_m(F_nm) + kappa_m / 2 (J_nm - 1)^2)
// F_nm is the mean of F, weighted in the same way. Without nodal_dilatation (element p1) a neo-Hookean region is compressible_neo_hookean and any other one adds
// kappa / 2 (J_e - 1)^2 in each tetrahedron. Either way the stiffness at rest is that of docs/method.md, section 1.
//
// Foundations and springs add u^T S u / 2, as in linear elasticity: their directions do not turn.
struct HyperelasticBody {
  const double* nodes = nullptr;             // [node_count][3] m, at rest
  const std::int32_t* tetrahedra = nullptr;  // [tetrahedron_count][4]
  const std::int32_t* region = nullptr;      // [tetrahedron_count]
  const std::uint8_t* fixed = nullptr;       // [node_count][3] 1: held at zero
  const TissueLaw* laws = nullptr;           // [region_count]
  std::int32_t node_count = 0, tetrahedron_count = 0, region_count = 0;
  bool nodal_dilatation = false;
  double averaged_shear = 0;  // 0 for p1-anp
  // S: of pair p the block in the rows of support_nodes[2 p] and the columns of support_nodes[2 p + 1], which is not below it; the
  // mirrored block is its transpose.
  const std::int32_t* support_nodes = nullptr;  // [support_count][2]
  const double* support_stiffness = nullptr;    // [support_count][9] row-major, N/m
  std::int32_t support_count = 0;
};

// Gradients of the shape functions of corners 1, 2 and 3, [3][3] 1/m; that of corner 0 is minus their sum. Returns the volume, m^3.
inline double shape_gradients(const HyperelasticBody& body, std::int32_t e, double gradient[3][3]) {
  const std::int32_t* corner = body.tetrahedra + 4 * static_cast<std::int64_t>(e);
  double edge[3][3];
  for (int a = 0; a < 3; ++a)
    for (int i = 0; i < 3; ++i)
      edge[a][i] = body.nodes[3 * static_cast<std::int64_t>(corner[a + 1]) + i] -
                   body.nodes[3 * static_cast<std::int64_t>(corner[0]) + i];
  double determinant = 0;
  for (int a = 0; a < 3; ++a) {
    const int b = (a + 1) % 3, c = (a + 2) % 3;
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      gradient[a][i] = edge[b][j] * edge[c][k] - edge[b][k] * edge[c][j];
    }
    if (a == 0) determinant = edge[0][0] * gradient[0][0] + edge[0][1] * gradient[0][1] + edge[0][2] * gradient[0][2];
  }
  for (int a = 0; a < 3; ++a)
    for (int i = 0; i < 3; ++i) gradient[a][i] /= determinant;
  return determinant / 6;
}

}  // namespace palpate
