// The law of a region: which one it is, and its energy, stress and tangent. What works on tetrahedra asks here, and knows no law.
#pragma once

#include "runtime/large/exponential_law.h"
#include "runtime/large/hyperelastic_body.h"
#include "runtime/large/neo_hookean.h"
#include "runtime/large/ogden_law.h"
#include "runtime/large/yeoh_law.h"

namespace palpate {

// In the order in which the element loop goes through them.
enum class Law { compressible, neo_hookean, exponential, yeoh, ogden };
inline constexpr int kLaws = 5;

// nodal: the change of volume is averaged at the nodes. Without, all laws but the compressible one add kappa / 2 (J - 1)^2.
inline Law law_of(const TissueLaw& tissue, bool nodal) {
  switch (tissue.form.kind) {
    case LawForm::Kind::neo_hookean:
      return nodal ? Law::neo_hookean : Law::compressible;
    case LawForm::Kind::exponential:
      return Law::exponential;
    case LawForm::Kind::yeoh:
      return Law::yeoh;
    case LawForm::Kind::ogden:
      break;
  }
  return Law::ogden;
}
inline bool adds_pressure(Law law, bool nodal) {
  return !nodal && law != Law::compressible;
}
// compressible_neo_hookean takes Lame's lambda in place of the bulk modulus.
inline double bulk_of(const TissueLaw& tissue, Law law) {
  return law == Law::compressible ? tissue.bulk - 2 * tissue.shear / 3 : tissue.bulk;
}

template <class Real>
struct LawConstants {
  const Real &shear, &bulk;  // bulk: as bulk_of gives it
  const Real* form;          // [3] of LawForm
};

// Laws of I and J.
template <class Real>
PALPATE_INLINE LawValue<Real> value_of(Law law, const Deformation<Real>& d, const LawConstants<Real>& of) {
  if (law == Law::compressible) return compressible_neo_hookean(d, of.shear, of.bulk);
  if (law == Law::neo_hookean) return isochoric_neo_hookean(d, of.shear);
  if (law == Law::exponential) return exponential_law(d, of.shear, of.form[0]);
  return yeoh_law(d, of.shear, of.form[0], of.form[1]);
}

// The energy of a unit volume, Pa. stress: Pa. of_sites: the pressure dW/dJ of what is averaged at nodes; unused where the law adds its own.
template <class Real>
PALPATE_INLINE Real evaluate_law(Law law, bool nodal, const Deformation<Real>& d, const LawConstants<Real>& of,
                                 const Real& of_sites, Real stress[3][3]) {
  const bool adds = adds_pressure(law, nodal);
  const Real pressure = adds ? of.bulk * d.j : of_sites;
  Real energy;
  if (law == Law::ogden) {
    energy = ogden_law<Real>(d, {of.shear, of.form[0], of.form[1], of.form[2]}, pressure, stress);
  } else {
    const LawValue<Real> value = value_of(law, d, of);
    energy = value.energy;
    stress_of(d, value, pressure, stress);
  }
  return adds ? energy + Scalar<Real>(0.5) * pressure * d.j : energy;
}

// The tangent of a law at one deformation.
class LawTangent {
 public:
  // pressure: of what is averaged at nodes.
  LawTangent(const TissueLaw& tissue, bool nodal, const Deformation<double>& d, double pressure)
      : d_(d), law_(law_of(tissue, nodal)), pressure_(pressure) {
    const double *const c = tissue.form.constant, shear = tissue.shear, bulk = bulk_of(tissue, law_);
    if (law_ == Law::ogden)
      ogden_ = OgdenTangent(d, {shear, c[0], c[1], c[2]});
    else
      value_ = value_of<double>(law_, d, {shear, bulk, c});
    if (law_ == Law::compressible) second_ = compressible_neo_hookean_second(d, shear, bulk);
    if (law_ == Law::neo_hookean) second_ = isochoric_neo_hookean_second(d, shear);
    if (law_ == Law::exponential) second_ = exponential_law_second(d, shear, c[0]);
    if (law_ == Law::yeoh) second_ = yeoh_law_second(d, shear, c[0], c[1]);
    if (adds_pressure(law_, nodal)) pressure_ = bulk * d.j, second_.jj += bulk;
  }

  // d stress / dF : change.
  void change(const double change[3][3], double result[3][3]) const {
    stress_change(d_, value_, second_, pressure_, change, result);
    if (law_ == Law::ogden) ogden_.add_change(change, result);
  }

 private:
  const Deformation<double>& d_;
  Law law_;
  double pressure_;
  LawValue<double> value_ = {};
  LawSecond second_ = {};
  OgdenTangent ogden_;
};

}  // namespace palpate
