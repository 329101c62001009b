// The constants that the laws of large deformation take, for the reader of organ files and for that of bundles. The formulas:
// runtime/large/yeoh_law.h, ogden_law.h.
#pragma once

namespace palpate::formats {

// The first number of each row of the section large/law.
enum class StoredLaw { by_stiffening = 0, yeoh = 1, ogden = 2 };
constexpr int kStoredLaws = 3, kLawNumbers = 4;  // numbers of a row
// Of a region whose law is in large/law: its number in large/stiffening, which a reader without that section refuses.
constexpr double kNoStiffening = -1;

// Beyond, numbers in single precision overflow at strains of 1 %.
constexpr double kMostOfShear = 1e4;  // c2 and c3 of Yeoh's law, as shares of the shear modulus
constexpr double kMostExponent = 50;  // of Ogden's law

// In simple shear by g the tangent modulus is 2 (c1 + 6 c2 g^2 + 15 c3 g^4). Where it is above 0 at every g, the law resists each
// isochoric change of shape (Zee and Sternberg 1983). c1 = shear / 2.
inline bool yeoh_law_takes(double shear, double c2, double c3) {
  const double most = kMostOfShear * shear;
  return c3 >= 0 && c3 <= most && c2 >= -most && c2 <= most && (c2 >= 0 || 3 * c2 * c2 < 5 * (shear / 2) * c3);
}

// Of one term. J^(-a/3) |F|^a is polyconvex from a = 3/2 on, and J^(-2a/3) |cof F|^a, which is the term of -a, from a = 3 on (Hartmann
// and Neff 2003): x^p / y^q is convex where p >= q + 1.
inline bool ogden_law_takes(double exponent) {
  return (exponent >= 1.5 && exponent <= kMostExponent) || (exponent <= -3 && exponent >= -kMostExponent);
}
// share: of the second term in the shear modulus.
inline bool ogden_law_takes(double exponent, double share, double second) {
  return ogden_law_takes(exponent) && share >= 0 && share < 1 && (share == 0 || ogden_law_takes(second));
}

}  // namespace palpate::formats
