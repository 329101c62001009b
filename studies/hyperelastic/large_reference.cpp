#include "studies/hyperelastic/large_reference.h"

#include <Eigen/CholmodSupport>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "studies/timing/timing.h"

namespace palpate {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {
constexpr double kFast = 0.2;  // a step with a factor of another solution leaves so much of the residual force at most
constexpr int kMostRefused = 2;  // in a solution; then each step factors its own tangent
}  // namespace

struct LargeReference::Factor {
  Eigen::CholmodSupernodalLLT<Sparse> of;
  Sparse analysed;
  bool ready = false;  // for another solution
};

std::shared_ptr<LargeReference::Factor> LargeReference::shared_factor() {
  return std::make_shared<Factor>();
}

namespace {
bool same_pattern(const LargeReference::Sparse& a, const LargeReference::Sparse& b) {
  return a.rows() == b.rows() && a.nonZeros() == b.nonZeros() &&
         std::equal(a.outerIndexPtr(), a.outerIndexPtr() + a.outerSize() + 1, b.outerIndexPtr()) &&
         std::equal(a.innerIndexPtr(), a.innerIndexPtr() + a.nonZeros(), b.innerIndexPtr());
}
}  // namespace

// The rows and columns of the dofs that are not held. Of a pattern that it knows it copies numbers alone.
const LargeReference::Sparse& LargeReference::of_free_dofs(const Sparse& k) const {
  if (!same_pattern(taken_.pattern, k)) {
    taken_.pattern = k;
    Sparse numbered = k;
    std::iota(numbered.valuePtr(), numbered.valuePtr() + numbered.nonZeros(), 0.0);
    taken_.result = free_ * numbered * free_.transpose();
    taken_.from.assign(taken_.result.valuePtr(), taken_.result.valuePtr() + taken_.result.nonZeros());
  }
  for (std::size_t i = 0; i < taken_.from.size(); ++i) taken_.result.valuePtr()[i] = k.valuePtr()[taken_.from[i]];
  return taken_.result;
}

// rows u + compliance s = target; load on the dofs.
struct LargeReference::Problem {
  const MatrixXd& rows;
  const VectorXd& target;
  MatrixXd compliance;  // [rows][rows]
  VectorXd load;        // [free dofs]
  double tolerance;
};

LargeReference::LargeReference(const HyperelasticBody& body, const std::shared_ptr<Factor>& shared)
    : body_(body),
      memory_(palpate_allocator{}),
      factor_(shared ? shared : shared_factor()),
      shares_(shared != nullptr) {
  place_.resize(static_cast<std::size_t>(body.node_count));
  std::iota(place_.begin(), place_.end(), 0);
  if (!elements_.create(memory_, body, place_.data(), body.node_count) ||
      !find_dilatation_sites(memory_, body, &sites_))
    throw std::runtime_error("no memory");
  std::vector<Eigen::Triplet<double>> chosen;
  for (int i = 0; i < dofs(); ++i)
    if (!body.fixed[i]) chosen.emplace_back(static_cast<int>(chosen.size()), i, 1.0);
  free_.resize(static_cast<Index>(chosen.size()), dofs());
  free_.setFromTriplets(chosen.begin(), chosen.end());
  supports_ = support_matrix();
  rest_ = of_free_dofs(tangent(VectorXd::Zero(dofs())));
  factor_->of.cholmod().print = 0;  // an indefinite tangent is expected
}

LargeReference::~LargeReference() {
  memory_.release_all();
}

double LargeReference::energy(const VectorXd& u, VectorXd* force, double* least_volume) const {
  force->resize(dofs());
  const auto result = elements_.evaluate(u.data(), force->data());
  const VectorXd of_supports = supports_ * u;
  *force += of_supports;
  if (least_volume) *least_volume = result.least_volume;
  return result.least_volume > 1e-3 ? result.energy + u.dot(of_supports) / 2 : std::numeric_limits<double>::infinity();
}

LargeReference::Sparse LargeReference::support_matrix() const {
  std::vector<Eigen::Triplet<double>> terms;
  for (std::int32_t p = 0; p < body_.support_count; ++p)
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        const int row = 3 * body_.support_nodes[2 * p] + i, column = 3 * body_.support_nodes[2 * p + 1] + j;
        const double value = body_.support_stiffness[9 * p + 3 * i + j];
        terms.emplace_back(row, column, value);
        if (body_.support_nodes[2 * p] != body_.support_nodes[2 * p + 1]) terms.emplace_back(column, row, value);
      }
  Sparse k(dofs(), dofs());
  k.setFromTriplets(terms.begin(), terms.end());
  return k;
}

LargeReference::Sparse LargeReference::tangent(const VectorXd& u) const {
  std::vector<Eigen::Triplet<double>> terms, change;
  const auto sites = static_cast<std::size_t>(sites_.count);
  std::vector<double> mean(sites, 0.0);
  const auto count = static_cast<std::size_t>(body_.tetrahedron_count);
  std::vector<Deformation<double>> d(count);
  std::vector<double> volume(count);
  std::vector<Eigen::Matrix<double, 4, 3>> gradient(count);
  for (std::size_t e = 0; e < count; ++e) {
    double g[3][3];
    volume[e] = shape_gradients(body_, static_cast<std::int32_t>(e), g);
    gradient[e].bottomRows<3>() = Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(&g[0][0]);
    gradient[e].row(0) = -gradient[e].bottomRows<3>().colwise().sum();
    Eigen::Matrix3d h = Eigen::Matrix3d::Zero();
    for (int a = 0; a < 4; ++a) h += u.segment<3>(3 * node(e, a)) * gradient[e].row(a);
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) d[e].h[i][k] = h(i, k);
    complete(d[e]);
    for (int a = 0; a < 4; ++a) mean[site(e, a)] += volume[e] / 4 * d[e].j / sites_.volume[site(e, a)];
  }
  const double own = 1 - body_.averaged_shear;
  terms.reserve(144 * count);
  for (std::size_t e = 0; e < count; ++e) {
    double pressure = 0;
    if (body_.nodal_dilatation)
      for (int a = 0; a < 4; ++a) pressure += body_.laws[sites_.region[site(e, a)]].bulk * mean[site(e, a)] / 4;
    const LawTangent law(body_.laws[body_.region[e]], body_.nodal_dilatation, d[e], pressure / own);
    for (int b = 0; b < 4; ++b)
      for (int j = 0; j < 3; ++j) {
        double moved[3][3] = {}, stress[3][3];
        for (int k = 0; k < 3; ++k) moved[j][k] = gradient[e](b, k);
        law.change(moved, stress);
        double volume_change = 0;
        for (int k = 0; k < 3; ++k) volume_change += (d[e].cof[j][k] + (j == k)) * gradient[e](b, k);
        const auto column = static_cast<int>(3 * node(e, b) + j);
        for (int a = 0; a < 4; ++a) {
          for (int i = 0; i < 3; ++i) {
            double sum = 0;
            for (int k = 0; k < 3; ++k) sum += stress[i][k] * gradient[e](a, k);
            terms.emplace_back(static_cast<int>(3 * node(e, a) + i), column, own * volume[e] * sum);
          }
          if (body_.nodal_dilatation)
            change.emplace_back(static_cast<int>(site(e, a)), column, volume[e] / 4 * volume_change);
        }
      }
  }
  Sparse k(dofs(), dofs());
  k.setFromTriplets(terms.begin(), terms.end());
  if (supports_.nonZeros() > 0) k += supports_;
  if (!body_.nodal_dilatation) return k;
  Sparse b(static_cast<Index>(sites), dofs());
  b.setFromTriplets(change.begin(), change.end());
  VectorXd weight(static_cast<Index>(sites));
  for (std::size_t s = 0; s < sites; ++s)
    weight[static_cast<Index>(s)] = body_.laws[sites_.region[s]].bulk / sites_.volume[s];
  const Sparse scaled = weight.asDiagonal() * b;
  k += Sparse(b.transpose() * scaled);
  return body_.averaged_shear > 0 ? Sparse(k + averaged_tangent(d, volume, gradient)) : k;
}

// Of the shear that follows the mean gradients of the sites: G^T T G, where T has a block of 9 x 9 for each site.
LargeReference::Sparse LargeReference::averaged_tangent(
    const std::vector<Deformation<double>>& d, const std::vector<double>& volume,
    const std::vector<Eigen::Matrix<double, 4, 3>>& gradient) const {
  const auto sites = static_cast<std::size_t>(sites_.count);
  std::vector<Deformation<double>> mean(sites);
  std::vector<Eigen::Triplet<double>> by_node, of_law;
  for (std::size_t e = 0; e < d.size(); ++e)
    for (int at = 0; at < 4; ++at) {
      const std::size_t s = site(e, at);
      const double share = volume[e] / 4 / sites_.volume[s];
      for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) {
          mean[s].h[i][k] += share * d[e].h[i][k];
          for (int a = 0; a < 4; ++a)
            by_node.emplace_back(static_cast<int>(9 * s) + 3 * i + k, static_cast<int>(3 * node(e, a) + i),
                                 share * gradient[e](a, k));
        }
    }
  for (std::size_t s = 0; s < sites; ++s) {
    complete(mean[s]);
    const LawTangent law(body_.laws[sites_.region[s]], true, mean[s], 0);
    for (int column = 0; column < 9; ++column) {
      double moved[3][3] = {}, stress[3][3];
      moved[column / 3][column % 3] = body_.averaged_shear * sites_.volume[s];
      law.change(moved, stress);
      for (int row = 0; row < 9; ++row)
        of_law.emplace_back(static_cast<int>(9 * s) + row, static_cast<int>(9 * s) + column, stress[row / 3][row % 3]);
    }
  }
  Sparse g(static_cast<Index>(9 * sites), dofs()), t(g.rows(), g.rows());
  g.setFromTriplets(by_node.begin(), by_node.end());
  t.setFromTriplets(of_law.begin(), of_law.end());
  const Sparse changed = t * g;
  return Sparse(g.transpose() * changed);
}

// Adds a multiple of the tangent at rest until the sum is positive definite.
void LargeReference::factor_definite(const Sparse& k, NewtonWork* work) const {
  for (double shift = 0; shift < 100; shift = shift == 0 ? 0.02 : 2 * shift) {
    const Sparse shifted = shift > 0 ? Sparse(k + shift * rest_) : k;
    const double begun = studies::processor_seconds();
    factor_->of.factorize(shifted);
    work->factor_seconds += studies::processor_seconds() - begun;
    factor_->ready = shares_ && factor_->of.info() == Eigen::Success;
    if (factor_->of.info() == Eigen::Success) return;
  }
  throw std::runtime_error("the tangent cannot be made definite");
}

// Before a factor: of the same pattern it is not repeated.
void LargeReference::analyse(const Sparse& pattern) const {
  if (same_pattern(factor_->analysed, pattern)) return;
  factor_->of.analyzePattern(pattern);
  factor_->analysed = pattern, factor_->ready = false;
}

// (L + c)^-1, where each c is below what the body gives way along the row: W^T (L + c)^-1 W makes a tangent definite that is so along all
// moves that the contacts leave free.
MatrixXd LargeReference::stiffness_of_rows(const MatrixXd& w, const MatrixXd& compliance) const {
  const VectorXd own = w.cwiseAbs2().transpose() * rest_.diagonal().cwiseInverse();
  return (compliance + MatrixXd(own.asDiagonal())).inverse();
}

VectorXd LargeReference::newton(const Problem& p, VectorXd* u, NewtonWork* work) const {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  const MatrixXd w = free_ * p.rows.transpose();
  const bool has_rows = w.cols() > 0;
  // The stiffness of the rows joins the tangent, and what it adds to the force joins the other side: the solution stays, and a body that only its
  // contacts keep from buckling has a definite tangent.
  const MatrixXd r = has_rows ? stiffness_of_rows(w, p.compliance) : MatrixXd(0, 0);
  const MatrixXd left = MatrixXd::Identity(w.cols(), w.cols()) - r * p.compliance;
  const Sparse sparse_w = w.sparseView();
  const Sparse of_rows =
      has_rows ? Sparse(sparse_w * Sparse(r.sparseView()) * sparse_w.transpose()) : Sparse(w.rows(), w.rows());
  analyse(rest_ + of_rows);
  VectorXd force, trial_force, s = VectorXd::Zero(p.rows.rows());  // s: the rows' forces so far
  const auto potential = [&](double of_body, const VectorXd& at, const VectorXd& forces) {
    return of_body + 0.5 * forces.dot(p.compliance * forces) - p.load.dot(free_ * at);
  };
  double least = potential(energy(*u, &force), *u, s), last_residual = infinite;
  bool own = !factor_->ready;  // the factor is that of the tangent at u
  int refused = 0;             // steps with another factor that were too slow
  for (int step = 0; step < 100; ++step) {
    if (own) {
      const double begun = studies::processor_seconds();
      const Sparse& of_body = of_free_dofs(tangent(*u));
      const Sparse k = has_rows ? Sparse(of_body + of_rows) : of_body;
      work->assembly_seconds += studies::processor_seconds() - begun;
      factor_definite(k, work);
    }
    const double factored = studies::processor_seconds();
    const VectorXd gradient = free_ * force - p.load;
    const MatrixXd y = factor_->of.solve(w);
    const VectorXd z = factor_->of.solve(gradient);
    work->solve_seconds += studies::processor_seconds() - factored;
    ++work->steps;
    const VectorXd way = p.target - p.rows * *u, missed = way - p.compliance * s;
    // rows (u + move) + compliance lambda = target, where move = y (left lambda + r way) - z
    const MatrixXd rows_on_rows = w.transpose() * y;
    VectorXd lambda(w.cols());
    if (has_rows)
      lambda = MatrixXd(rows_on_rows * left + p.compliance)
                   .partialPivLu()
                   .solve(way + w.transpose() * z - rows_on_rows * (r * way));
    const VectorXd move = y * (left * lambda + r * way) - z, residual = gradient - w * lambda;
    const bool on_constraint = missed.norm() <= 1e-12 * (1 + p.target.norm());
    if (on_constraint && residual.norm() <= p.tolerance * (force.norm() + 1e-300)) return lambda;
    if (!own && residual.norm() > kFast * last_residual) {
      own = true, ++refused;
      continue;
    }
    if (on_constraint) last_residual = residual.norm();
    // What the rows' forces do on the last bits that their targets are missed by.
    const double of_last_bits = lambda.size() > 0 ? std::abs(lambda.dot(missed)) : 0;
    double share = 1, found = infinite;
    VectorXd trial, trial_s;
    for (; share > 1e-6; share /= 2) {
      trial = *u + share * (free_.transpose() * move), trial_s = s + share * (lambda - s);
      found = potential(energy(trial, &trial_force), trial, trial_s);
      const double slope = share * (gradient.dot(move) + s.dot(p.compliance * (lambda - s)));
      if (std::isfinite(found) &&
          (!on_constraint || found <= least + 1e-4 * slope + share * of_last_bits + 1e-13 * std::abs(least)))
        break;
    }
    if (!(share > 1e-6)) {
      if (std::exchange(own, true) == false) continue;
      if (on_constraint && residual.norm() <= 1e-6 * force.norm()) return lambda;
      throw std::runtime_error("the line search found no descent");
    }
    *u = trial, s = trial_s, force = trial_force, least = found;
    own = !shares_ || refused >= kMostRefused;
  }
  throw std::runtime_error("100 steps did not converge");
}

VectorXd LargeReference::solve(const MatrixXd& rows, const VectorXd& target, VectorXd* u, double tolerance,
                               const MatrixXd& compliance, NewtonWork* work, const VectorXd& load) const {
  NewtonWork own;
  const Problem problem = {rows, target, compliance.size() > 0 ? compliance : MatrixXd::Zero(rows.rows(), rows.rows()),
                           load.size() > 0 ? VectorXd(free_ * load) : VectorXd::Zero(free_.rows()), tolerance};
  return newton(problem, u, work ? work : &own);
}

void LargeReference::balance(const VectorXd& load, VectorXd* u, double tolerance) const {
  solve(MatrixXd(0, dofs()), VectorXd(0), u, tolerance, {}, nullptr, load);
}

}  // namespace palpate
