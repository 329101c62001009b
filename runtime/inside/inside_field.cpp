#include "runtime/inside/inside_field.h"

#include <algorithm>
#include <cmath>

#include "runtime/include/palpate/palpate_inside.h"
#include "runtime/large/dilatation_sites.h"
#include "runtime/large/tissue_law.h"

namespace palpate {
namespace {

constexpr double kLeastVolume = 0.01;  // relative; below, a law is not asked: large/element_lanes.h has the same
constexpr double kMostWeight = 1e6;    // of a place

double mean_of(const double* tensor) {
  return (tensor[0] + tensor[1] + tensor[2]) / 3;
}
void set_mean(double* tensor, double mean) {
  const double change = mean - mean_of(tensor);
  for (int d = 0; d < 3; ++d) tensor[d] += change;
}
void add_scaled(StrainAndStress& sum, double factor, const StrainAndStress& value) {
  for (int i = 0; i < kTensorNumbers; ++i) {
    sum.strain[i] += factor * value.strain[i];
    sum.stress[i] += factor * value.stress[i];
  }
}

// As shape_gradients of hyperelastic_body.h, in vectors: gcc 12 fuses products and sums of that one (vfmaddsub) although
// -ffp-contract=off forbids it, and builds for other processors would have other bits.
double gradients_of(const std::int32_t* corner, const double* positions, double gradient[3][3]) {
  const auto at = [&](int c) { return load3(positions + 3 * static_cast<std::size_t>(corner[c])); };
  const Vec3 a = at(1) - at(0), b = at(2) - at(0), c = at(3) - at(0);
  const Vec3 of[3] = {cross(b, c), cross(c, a), cross(a, b)};
  const double determinant = dot(a, of[0]);
  for (int i = 0; i < 3; ++i) store3((1 / determinant) * of[i], gradient[i]);
  return determinant / 6;
}

constexpr int kRow[kTensorNumbers] = {0, 1, 2, 0, 1, 0}, kColumn[kTensorNumbers] = {0, 1, 2, 1, 2, 2};

// Of small displacements. h: displacement gradient.
void evaluate_linearly(const TissueLaw& law, const double h[3][3], StrainAndStress* out) {
  for (int i = 0; i < kTensorNumbers; ++i) {
    out->strain[i] = 0.5 * (h[kRow[i]][kColumn[i]] + h[kColumn[i]][kRow[i]]);
    out->stress[i] = 2 * law.shear * out->strain[i];
  }
  set_mean(out->stress, law.bulk * (h[0][0] + h[1][1] + h[2][2]));
}

}  // namespace

bool InsideField::create(SceneMemory& memory, const HyperelasticBody& body, bool large, const double* preload) {
  large_ = large, nodal_ = body.nodal_dilatation, averaged_ = body.averaged_shear;
  node_count_ = body.node_count, tetrahedron_count_ = body.tetrahedron_count;
  const auto nodes = static_cast<std::size_t>(node_count_), count = static_cast<std::size_t>(tetrahedron_count_);
  positions_ = memory.array<double>(3 * nodes);
  tetrahedra_ = memory.array<std::int32_t>(4 * count);
  elements_ = memory.array<Element>(count);
  laws_ = memory.array<TissueLaw>(static_cast<std::size_t>(body.region_count));
  site_of_ = memory.array<std::int32_t>(4 * count);
  first_site_ = memory.array<std::int32_t>(nodes);
  if (preload) preload_ = memory.array<float>(3 * nodes);
  displacements_ = memory.array<float>(3 * nodes);
  SceneMemory scratch = memory.of_same_host();
  DilatationSites sites;
  bool made = !memory.failed() && find_dilatation_sites(scratch, body, &sites);
  if (made) {
    site_count_ = sites.count;
    const auto site_count = static_cast<std::size_t>(site_count_);
    site_volume_ = memory.array<double>(site_count);
    next_site_ = memory.array<std::int32_t>(site_count);
    mean_stress_ = memory.array<double>(site_count);
    at_site_ = memory.array<StrainAndStress>(site_count);
    made = !memory.failed();
  }
  if (made) {
    std::copy_n(body.nodes, 3 * nodes, positions_);
    std::copy_n(body.tetrahedra, 4 * count, tetrahedra_);
    std::copy_n(body.laws, body.region_count, laws_);
    std::copy_n(sites.of_corner, 4 * count, site_of_);
    std::copy_n(sites.volume, site_count_, site_volume_);
    for (std::size_t i = 0; preload && i < 3 * nodes; ++i) preload_[i] = static_cast<float>(preload[i]);
    std::fill(first_site_, first_site_ + nodes, -1);
    std::fill(next_site_, next_site_ + site_count_, -2);  // -2: not in a list yet
    for (std::size_t c = 0; c < 4 * count; ++c) {
      const std::int32_t site = site_of_[c];
      if (next_site_[site] != -2) continue;
      next_site_[site] = first_site_[tetrahedra_[c]];
      first_site_[tetrahedra_[c]] = site;
    }
    for (std::int32_t e = 0; e < tetrahedron_count_; ++e) {
      elements_[e].volume = gradients_of(corners(e), positions_, elements_[e].gradient);
      elements_[e].region = body.region[e];
    }
  }
  scratch.release_all();
  return made && tree_.create(memory, {positions_, tetrahedra_, tetrahedron_count_});
}

palpate_step_flags InsideField::take(const float* displacements) {
  palpate_step_flags flags = 0;
  for (std::size_t i = 0; i < 3 * static_cast<std::size_t>(node_count_); ++i) {
    const bool finite = std::isfinite(displacements[i]);
    displacements_[i] = finite ? displacements[i] : 0;
    if (!finite) flags |= PALPATE_STEP_BAD_INPUT;
  }
  return flags;
}

void InsideField::displacement_gradient(std::int32_t e, double h[3][3]) const {
  const std::int32_t* const corner = corners(e);
  double u[4][3];
  for (int a = 0; a < 4; ++a)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t at = 3 * static_cast<std::size_t>(corner[a]) + i;
      u[a][i] = static_cast<double>(displacements_[at]) + (preload_ ? static_cast<double>(preload_[at]) : 0.0);
    }
  const auto& gradient = elements_[e].gradient;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k)
      h[i][k] = (u[1][i] - u[0][i]) * gradient[0][k] + (u[2][i] - u[0][i]) * gradient[1][k] +
                (u[3][i] - u[0][i]) * gradient[2][k];
}

void InsideField::evaluate_largely(const TissueLaw& law, const double h[3][3], StrainAndStress* out,
                                   bool* turned) const {
  Deformation<double> d;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) d.h[i][k] = h[i][k];
  complete(d);
  if (!(d.j >= kLeastVolume - 1)) *turned = true, d.j = kLeastVolume - 1;
  const Law kind = law_of(law, nodal_);
  const double bulk = bulk_of(law, kind);
  double nominal[3][3], f[3][3];
  evaluate_law<double>(kind, nodal_, d, {law.shear, bulk, law.form.constant}, nodal_ ? bulk * d.j : 0, nominal);
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) f[i][k] = h[i][k] + (i == k ? 1 : 0);
  for (int n = 0; n < kTensorNumbers; ++n) {
    const int i = kRow[n], k = kColumn[n];
    double green = h[i][k] + h[k][i], cauchy = 0;
    for (int m = 0; m < 3; ++m) green += h[m][i] * h[m][k], cauchy += nominal[i][m] * f[k][m];
    out->strain[n] = 0.5 * green;
    out->stress[n] = cauchy / (1 + d.j);
  }
}

void InsideField::evaluate(std::int32_t e, StrainAndStress* out, bool* turned) const {
  double h[3][3];
  displacement_gradient(e, h);
  const TissueLaw& law = laws_[elements_[e].region];
  if (large_)
    evaluate_largely(law, h, out, turned);
  else
    evaluate_linearly(law, h, out);
}

double InsideField::mean_of_sites(std::int32_t e) const {
  const std::int32_t* const site = site_of_ + 4 * static_cast<std::size_t>(e);
  return 0.25 * ((mean_stress_[site[0]] + mean_stress_[site[1]]) + (mean_stress_[site[2]] + mean_stress_[site[3]]));
}

palpate_step_flags InsideField::compute(const float* displacements) {
  palpate_step_flags flags = take(displacements);
  bool turned = false;
  std::fill(mean_stress_, mean_stress_ + site_count_, 0.0);
  std::fill(at_site_, at_site_ + site_count_, StrainAndStress{});
  for (std::int32_t e = 0; e < tetrahedron_count_; ++e) {
    StrainAndStress own;
    evaluate(e, &own, &turned);
    const double quarter = 0.25 * elements_[e].volume, mean = quarter * mean_of(own.stress);
    set_mean(own.stress, 0);  // the sites' means are added below
    for (int a = 0; a < 4; ++a) {
      const std::int32_t site = site_of_[4 * static_cast<std::size_t>(e) + static_cast<std::size_t>(a)];
      mean_stress_[site] += mean;
      add_scaled(at_site_[site], quarter, own);
    }
  }
  for (std::int32_t s = 0; s < site_count_; ++s) mean_stress_[s] /= site_volume_[s];
  for (std::int32_t e = 0; e < tetrahedron_count_; ++e) {
    const double share = 0.25 * elements_[e].volume * mean_of_sites(e);
    for (int a = 0; a < 4; ++a)
      for (int d = 0; d < 3; ++d)
        at_site_[site_of_[4 * static_cast<std::size_t>(e) + static_cast<std::size_t>(a)]].stress[d] += share;
  }
  for (std::int32_t s = 0; s < site_count_; ++s) {
    StrainAndStress mean = {};
    add_scaled(mean, 1 / site_volume_[s], at_site_[s]);
    at_site_[s] = mean;
  }
  computed_ = true;
  return flags | (turned ? static_cast<palpate_step_flags>(PALPATE_STEP_UNSOLVED) : 0);
}

StrainAndStress InsideField::at_node(std::int32_t node) const {
  StrainAndStress sum = {};
  double volume = 0;
  for (std::int32_t s = first_site_[node]; s >= 0; s = next_site_[s]) volume += site_volume_[s];
  for (std::int32_t s = first_site_[node]; s >= 0; s = next_site_[s])
    add_scaled(sum, site_volume_[s] / volume, at_site_[s]);
  return sum;
}

StrainAndStress InsideField::at_place(const palpate_inside_place& place) const {
  double weight[4], total = 0;
  for (int a = 0; a < 4; ++a) total += weight[a] = std::max(0.0, place.weight[a]);
  StrainAndStress sum = {};
  const std::int32_t* const site = site_of_ + 4 * static_cast<std::size_t>(place.tetrahedron);
  for (int a = 0; a < 4; ++a) add_scaled(sum, weight[a] / total, at_site_[site[a]]);
  return sum;
}

StrainAndStress InsideField::in_tetrahedron(std::int32_t e) const {
  StrainAndStress own = {};
  bool turned = false;
  evaluate(e, &own, &turned);
  if (averaged_ > 0) {
    const std::int32_t* const site = site_of_ + 4 * static_cast<std::size_t>(e);
    for (int i = 0; i < kTensorNumbers; ++i) {
      double of_sites = 0;
      for (int a = 0; a < 4; ++a) of_sites += 0.25 * at_site_[site[a]].stress[i];
      own.stress[i] += averaged_ * (of_sites - own.stress[i]);
    }
  }
  if (nodal_) set_mean(own.stress, mean_of_sites(e));
  return own;
}

Vec3 InsideField::displacement(std::int32_t node) const {
  const float* const u = displacements_ + 3 * static_cast<std::size_t>(node);
  return {static_cast<double>(u[0]), static_cast<double>(u[1]), static_cast<double>(u[2])};
}

Vec3 InsideField::displacement(const palpate_inside_place& place) const {
  Vec3 sum;
  for (int a = 0; a < 4; ++a) sum += place.weight[a] * displacement(corners(place.tetrahedron)[a]);
  return sum;
}

bool InsideField::is_place(const palpate_inside_place& place) const {
  if (place.tetrahedron < 0 || place.tetrahedron >= tetrahedron_count_) return false;
  double sum = 0;
  for (const double weight : place.weight) {
    if (!(std::fabs(weight) <= kMostWeight)) return false;
    sum += weight;
  }
  return std::fabs(sum - 1) <= 1e-6;
}

}  // namespace palpate
