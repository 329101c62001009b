#include "studies/accuracy/errors_of_points.h"

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
// The error of 0 relative to 0 is 0.
double ratio(double a, double b) {
  return a == 0 ? 0 : a / b;
}

bool can_be_reference(const PlannedMeasurement& p) {
  const Setting& s = p.point->setting;
  const BundleSetting plain;
  return p.axes.contains("reference") && s.bundle.storage == plain.storage && s.bundle.solver == plain.solver &&
         s.bundle.tolerance == plain.tolerance && text_of(s.scene) == text_of(best_scene(s.scene));
}

double vertices(const MeasuredPoint& p) {
  return p.cost.at("vertices");
}
// Above 1.
double spacing_ratio(const MeasuredPoint& fine, const MeasuredPoint& coarse) {
  return std::cbrt(vertices(fine) / vertices(coarse));
}

struct Truth {
  const MeasuredPoint* point = nullptr;
  TruthError error;
};

// Estimated error of the finest mesh, from the distances of all other meshes to it. fine_to_coarse: one point for each mesh.
std::array<Extrapolated, 2> extrapolate_finest(std::span<const MeasuredPoint* const> fine_to_coarse) {
  std::vector<DistanceToFinest> force, field;
  for (const auto* coarse : fine_to_coarse.subspan(1)) {
    const Difference d = difference(coarse->seen, fine_to_coarse[0]->seen);
    const double ratio = spacing_ratio(*fine_to_coarse[0], *coarse);
    force.push_back({ratio, d.force}), field.push_back({ratio, d.field});
  }
  return {extrapolate(force), extrapolate(field)};
}

EstimateRange range_without_one(std::span<const MeasuredPoint* const> fine_to_coarse) {
  EstimateRange range;
  for (std::size_t left_out = 1; left_out < fine_to_coarse.size(); ++left_out) {
    std::vector<const MeasuredPoint*> others(fine_to_coarse.begin(), fine_to_coarse.end());
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(left_out));
    const auto [force, field] = extrapolate_finest(others);
    range.least_force = std::fmin(range.least_force, force.error);
    range.most_force = std::fmax(range.most_force, force.error);
    range.least_field = std::fmin(range.least_field, field.error);
    range.most_field = std::fmax(range.most_field, field.error);
  }
  return range;
}

// The finest mesh of one element, and the error that its coarser meshes tell.
Truth finest_of(const std::string& element, std::vector<const MeasuredPoint*> candidates) {
  std::erase_if(candidates, [&](auto* p) { return p->setting.bundle.element != element; });
  std::sort(candidates.begin(), candidates.end(), [](auto* a, auto* b) { return vertices(*a) > vertices(*b); });
  // Columns everywhere and columns near the sites give the same answer: one point for each mesh is enough.
  candidates.erase(
      std::unique(candidates.begin(), candidates.end(), [](auto* a, auto* b) { return vertices(*a) == vertices(*b); }),
      candidates.end());
  Truth truth;
  if (candidates.empty()) return truth;
  truth.point = candidates[0];
  const auto estimate = extrapolate_finest(candidates);
  truth.error.force = estimate[0], truth.error.field = estimate[1];
  if (candidates.size() < 3) return truth;
  const auto before = extrapolate_finest(std::span(candidates).subspan(1));
  const Difference found = difference(candidates[1]->seen, candidates[0]->seen);
  truth.error.check = {static_cast<int>(vertices(*candidates[1])), before[0].error, found.force, before[1].error,
                       found.field};
  truth.error.range = range_without_one(candidates);
  return truth;
}

// A known estimate is smaller than an unknown one.
bool is_smaller(const Extrapolated& a, const Extrapolated& b) {
  return std::isfinite(a.error) && !(a.error >= b.error);
}

Truth truth_of(const std::vector<const MeasuredPoint*>& candidates) {
  Truth truth = finest_of("p2-p0", candidates), other = finest_of("p1-anp", candidates);
  // On one mesh quadratic elements are nearer to the truth, whatever the estimates say.
  if (!truth.point ||
      (other.point && vertices(*other.point) > vertices(*truth.point) &&
       is_smaller(other.error.force, truth.error.force) && is_smaller(other.error.field, truth.error.field)))
    std::swap(truth, other);
  if (truth.point && other.point)
    truth.error.other = {other.point, other.error.force, other.error.field,
                         difference(other.point->seen, truth.point->seen)};
  return truth;
}

// Same mesh, element and scene, so the same answer but for solving and storing.
bool have_same_answer(const Setting& a, const Setting& b) {
  return a.bundle.resolution == b.bundle.resolution && a.bundle.element == b.bundle.element &&
         a.bundle.poisson == b.bundle.poisson && text_of(a.scene) == text_of(b.scene);
}

// The point to compare with for errors of solving and storing: same mesh, element and scene, solved and stored most exactly.
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

namespace {

// distance = c (ratio^order - 1), by least squares; scatter: root mean square of the residuals, for each degree of freedom.
struct PowerFit {
  double order, c, scatter;
};

PowerFit fit_power(std::span<const DistanceToFinest> distances, double order) {
  double products = 0, squares = 0, left = 0;
  for (const auto& [ratio, distance] : distances) {
    const double x = std::pow(ratio, order) - 1;
    products += x * distance, squares += x * x;
  }
  const double c = products / squares;
  for (const auto& [ratio, distance] : distances) {
    const double off = distance - c * (std::pow(ratio, order) - 1);
    left += off * off;
  }
  const double freedom = std::max<double>(1, static_cast<double>(distances.size()) - 2);
  return {order, c, std::sqrt(left / freedom)};
}

}  // namespace

Extrapolated extrapolate(std::span<const DistanceToFinest> distances) {
  if (distances.empty()) return {};
  constexpr double kLeastOrder = 0.5, kMostOrder = 2, kStep = 0.01;
  PowerFit best = fit_power(distances, kLeastOrder);
  for (double order = kLeastOrder; order <= kMostOrder + kStep / 2; order += kStep)
    if (const PowerFit fit = fit_power(distances, order); fit.scatter < best.scatter) best = fit;
  const bool observed =
      distances.size() >= 2 && best.order > kLeastOrder + kStep / 2 && best.order < kMostOrder - kStep / 2;
  if (!observed) best = fit_power(distances, 1);
  return {(observed ? 1.25 : 3) * best.c + best.scatter, best.order, best.scatter, observed};
}

std::vector<JudgedPoint> judge(const std::vector<PlannedMeasurement>& points) {
  std::map<std::string, std::vector<const MeasuredPoint*>> references, same;
  for (const auto& planned : points) {
    const MeasuredPoint* point = planned.point;
    if (can_be_reference(planned)) references[situation_of(point->setting)].push_back(point);
    same[same_but_for_solving_and_storing(*point)].push_back(point);
  }
  std::map<std::string, Truth> truths;
  for (const auto& [situation, candidates] : references) truths[situation] = truth_of(candidates);

  std::vector<JudgedPoint> judged;
  for (const auto& [point, axes] : points) {
    const auto truth = truths.find(situation_of(point->setting));
    if (truth == truths.end()) continue;
    JudgedPoint j;
    j.point = point, j.axes = axes;
    j.is_reference = truth->second.point == point;
    j.shares_reference = have_same_answer(point->setting, truth->second.point->setting);
    j.error = difference(point->seen, truth->second.point->seen);
    j.reference_error = truth->second.error;
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
