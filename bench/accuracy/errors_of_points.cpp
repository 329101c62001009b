#include "bench/accuracy/errors_of_points.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace palpate::accuracy {
namespace {

using Vector = std::array<double, 3>;

double square(const Vector& v) {
  return v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
}
Vector minus(const Vector& a, const Vector& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
// 0 over 0 is no error.
double ratio(double a, double b) {
  return a == 0 ? 0 : a / b;
}

bool is_reference(const Setting& s) {
  const BundleSetting plain;
  return s.bundle.element == "p2-p0" && s.bundle.storage == plain.storage && s.bundle.solver == plain.solver &&
         s.bundle.tolerance == plain.tolerance && text_of(s.scene) == text_of(best_scene(s.scene));
}

double vertices(const MeasuredPoint& p) {
  return p.cost.at("vertices");
}
// Above 1.
double spacing_ratio(const MeasuredPoint& fine, const MeasuredPoint& coarse) {
  return std::cbrt(vertices(fine) / vertices(coarse));
}

// Extrapolation over meshes that are nearly alike shows their scatter and no order (Celik et al. 2008 ask for 1.3).
constexpr double kLeastSpacingRatio = 1.3;

// From fine to coarse, each at least that much coarser than the one before; where none is, the coarsest.
std::vector<const MeasuredPoint*> spaced_out(const std::vector<const MeasuredPoint*>& fine_to_coarse) {
  std::vector<const MeasuredPoint*> kept;
  for (const auto* point : fine_to_coarse)
    if (kept.empty() || spacing_ratio(*kept.back(), *point) >= kLeastSpacingRatio) kept.push_back(point);
  if (kept.size() == 1 && fine_to_coarse.size() > 1) kept.push_back(fine_to_coarse.back());
  return kept;
}

struct Truth {
  const MeasuredPoint* point = nullptr;
  Extrapolated force = {NAN, NAN}, field = {NAN, NAN};
};

Truth truth_of(std::vector<const MeasuredPoint*> candidates) {
  std::sort(candidates.begin(), candidates.end(), [](auto* a, auto* b) { return vertices(*a) > vertices(*b); });
  // Columns everywhere or near the places give the same answer: one of each mesh.
  candidates.erase(
      std::unique(candidates.begin(), candidates.end(), [](auto* a, auto* b) { return vertices(*a) == vertices(*b); }),
      candidates.end());
  candidates = spaced_out(candidates);
  Truth truth;
  if (candidates.empty()) return truth;
  truth.point = candidates[0];
  if (candidates.size() < 2) return truth;
  const Difference d21 = difference(candidates[1]->seen, candidates[0]->seen);
  const double r21 = spacing_ratio(*candidates[0], *candidates[1]);
  truth.force = richardson(d21.force, r21), truth.field = richardson(d21.field, r21);
  if (candidates.size() < 3) return truth;
  const Difference d32 = difference(candidates[2]->seen, candidates[1]->seen);
  const double r32 = spacing_ratio(*candidates[1], *candidates[2]);
  truth.force = richardson(d21.force, r21, d32.force, r32), truth.field = richardson(d21.field, r21, d32.field, r32);
  return truth;
}

// What a point would be with nothing saved: the more exactly solved and stored one of the same mesh, element and scene.
std::string same_but_for_solving_and_storing(const MeasuredPoint& p) {
  Setting s = p.setting;
  const BundleSetting plain;
  s.bundle.storage = plain.storage, s.bundle.solver = plain.solver, s.bundle.tolerance = plain.tolerance;
  s.bundle.everywhere = true;
  return text_of(s);
}
bool is_exact(const Setting& s) {
  return s.bundle.solver == "auto" && s.bundle.storage == "f64" && s.bundle.tolerance < 1e-11;
}
bool is_plain(const Setting& s) {
  return s.bundle.solver == "auto" && s.bundle.storage == "f32" && s.bundle.tolerance <= 1e-9;
}

}  // namespace

Difference difference(const Observation& seen, const Observation& truth) {
  Difference d;
  std::size_t tools = 0;
  for (std::size_t p = 0; p < truth.presses.size(); ++p) {
    const Press &a = seen.presses.at(p), &b = truth.presses[p];
    double largest = 0;
    for (const auto& force : b.forces) largest = std::max(largest, std::sqrt(square(force)));
    for (std::size_t t = 0; t < b.forces.size(); ++t, ++tools) {
      const double off = std::sqrt(square(minus(a.forces.at(t), b.forces[t])));
      const double relative = ratio(off, largest);
      d.force += relative * relative;
      d.force_worst = std::max(d.force_worst, relative);
      d.force_newtons = std::max(d.force_newtons, off);
    }
    double off = 0, all = 0;
    for (std::size_t i = 0; i < b.field.size(); ++i) {
      const double here = square(minus(a.field.at(i), b.field[i]));
      off += here, all += square(b.field[i]);
      d.field_mm = std::max(d.field_mm, 1e3 * std::sqrt(here));
    }
    d.field += ratio(off, all);
    d.field_worst = std::max(d.field_worst, std::sqrt(ratio(off, all)));
  }
  d.force = std::sqrt(d.force / static_cast<double>(std::max<std::size_t>(tools, 1)));
  d.field = std::sqrt(d.field / static_cast<double>(std::max<std::size_t>(truth.presses.size(), 1)));
  return d;
}

Extrapolated richardson(double e21, double r21, double e32, double r32) {
  double order = 1;
  for (int round = 0; round < 50; ++round)
    order =
        std::clamp(std::fabs(std::log(e32 / e21) + std::log((std::pow(r21, order) - 1) / (std::pow(r32, order) - 1))) /
                       std::log(r21),
                   0.5, 2.0);
  return {1.25 * e21 / (std::pow(r21, order) - 1), order};
}

Extrapolated richardson(double e21, double r21) {
  return {3 * e21 / (r21 - 1), 1};
}

std::vector<JudgedPoint> judge(const std::vector<PlannedMeasurement>& points) {
  std::map<std::string, std::vector<const MeasuredPoint*>> references, same;
  for (const auto& [point, axes] : points) {
    if (is_reference(point->setting)) references[situation_of(point->setting)].push_back(point);
    same[same_but_for_solving_and_storing(*point)].push_back(point);
  }
  std::map<std::string, Truth> truths;
  for (const auto& [situation, candidates] : references) truths[situation] = truth_of(candidates);

  std::vector<JudgedPoint> judged;
  for (const auto& [point, axes] : points) {
    const auto truth = truths.find(situation_of(point->setting));
    if (truth == truths.end()) continue;
    JudgedPoint j = {point, axes, {}, {}, {}, 0, 0};
    j.is_reference = truth->second.point == point;
    j.error = difference(point->seen, truth->second.point->seen);
    j.reference_force_error = truth->second.force.error;
    j.reference_field_error = truth->second.field.error;
    const auto& twins = same.at(same_but_for_solving_and_storing(*point));
    auto exact = std::find_if(twins.begin(), twins.end(), [](auto* p) { return is_exact(p->setting); });
    if (exact == twins.end())
      exact = std::find_if(twins.begin(), twins.end(), [](auto* p) { return is_plain(p->setting); });
    if (exact != twins.end()) j.added = difference(point->seen, (*exact)->seen);
    int tools = 0;
    for (const auto& press : point->seen.presses)
      for (const auto& force : press.forces) j.force_newtons += std::sqrt(square(force)), ++tools;
    j.force_newtons /= std::max(tools, 1);
    judged.push_back(std::move(j));
  }
  return judged;
}

}  // namespace palpate::accuracy
