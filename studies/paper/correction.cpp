#include "studies/paper/correction.h"

#include "formats/errors.h"

namespace palpate::studies {
namespace {

ResponseCurve curve_of(const ResponsePolynomial& fit) {
  ResponseCurve curve;
  if (!curve.set(fit.coefficient.data(), static_cast<int>(fit.coefficient.size()), fit.range))
    throw InputError("expected a measured curve with force and radial displacement, found one that cannot be used");
  return curve;
}

}  // namespace

Correction::Correction(const OrganConfig& organ) {
  if (!organ.response) throw InputError("expected an organ with a [response], found none; add its measured curve");
  const ResponseFit fit = fit_responses(*organ.response);
  radial_ = curve_of(fit.radial), force_ = curve_of(fit.force);
}

void Correction::apply(const Eigen::Vector3d& displacement, Answer& answer) const {
  const Eigen::Vector3d d = displacement.normalized();
  for (Eigen::Index n = 0; n < answer.surface.size(); n += 3) {
    auto u = answer.surface.segment<3>(n);
    const Eigen::Vector3d along = u.dot(d) * d, across = u - along;
    u = along + radial_.ratio(across.norm()) * across;
  }
  const double along = answer.force.dot(d);
  answer.force += (force_.value(along) - along) * d;
}

}  // namespace palpate::studies
