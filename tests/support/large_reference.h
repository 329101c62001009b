// The reference for large deformation: Newton's method with a line search on the whole mesh in double precision, with the tangent of
// the laws and a sparse direct solver. It meets its constraints exactly and stops where the residual force vanishes.
#pragma once

#include <Eigen/Dense>
#include <Eigen/Sparse>
#include <numeric>
#include <stdexcept>
#include <vector>

#include "runtime/base/scene_memory.h"
#include "runtime/large/element_lanes.h"

namespace palpate::tests {

class LargeReference {
 public:
  using Sparse = Eigen::SparseMatrix<double>;

  explicit LargeReference(const HyperelasticBody& body) : body_(body), memory_(palpate_allocator{}) {
    place_.resize(static_cast<std::size_t>(body.node_count));
    std::iota(place_.begin(), place_.end(), 0);
    if (!elements_.create(memory_, body, place_.data(), body.node_count) ||
        !find_dilatation_sites(memory_, body, &sites_))
      throw std::runtime_error("no memory");
    for (Eigen::Index i = 0; i < dofs(); ++i)
      if (!body.fixed[i]) free_.push_back(i);
    column_.assign(static_cast<std::size_t>(dofs()), -1);
    for (std::size_t i = 0; i < free_.size(); ++i) column_[static_cast<std::size_t>(free_[i])] = static_cast<int>(i);
  }
  ~LargeReference() { memory_.release_all(); }
  LargeReference(const LargeReference&) = delete;
  LargeReference& operator=(const LargeReference&) = delete;

  Eigen::Index dofs() const { return 3 * static_cast<Eigen::Index>(body_.node_count); }

  // Infinite where a tetrahedron is nearly flat or inverted.
  double energy(const Eigen::VectorXd& u, Eigen::VectorXd* force, double* least_volume = nullptr) const {
    force->resize(dofs());
    const auto result = elements_.evaluate(u.data(), force->data());
    if (least_volume) *least_volume = result.least_volume;
    return result.least_volume > 1e-3 ? result.energy : INFINITY;
  }

  // d force / du over all dofs, nothing held.
  Sparse tangent(const Eigen::VectorXd& u) const {
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
    for (std::size_t e = 0; e < count; ++e) {
      const TissueLaw& law = body_.laws[body_.region[e]];
      double pressure = 0;
      LawValue<double> value;
      LawSecond second;
      if (law.stiffening > 0) {
        value = exponential_law(d[e], law.shear, law.stiffening);
        second = exponential_law_second(d[e], law.shear, law.stiffening);
        if (!body_.nodal_dilatation) pressure = law.bulk * d[e].j, second.jj += law.bulk;
      } else if (body_.nodal_dilatation) {
        value = isochoric_neo_hookean(d[e], law.shear);
        second = isochoric_neo_hookean_second(d[e], law.shear);
      } else {
        const double lambda = law.bulk - 2 * law.shear / 3;
        value = compressible_neo_hookean(d[e], law.shear, lambda);
        second = compressible_neo_hookean_second(d[e], law.shear, lambda);
      }
      if (body_.nodal_dilatation)
        for (int a = 0; a < 4; ++a) pressure += body_.laws[sites_.region[site(e, a)]].bulk * mean[site(e, a)] / 4;
      for (int b = 0; b < 4; ++b)
        for (int j = 0; j < 3; ++j) {
          double moved[3][3] = {}, stress[3][3];
          for (int k = 0; k < 3; ++k) moved[j][k] = gradient[e](b, k);
          stress_change(d[e], value, second, pressure, moved, stress);
          double volume_change = 0;
          for (int k = 0; k < 3; ++k) volume_change += (d[e].cof[j][k] + (j == k)) * gradient[e](b, k);
          const auto column = static_cast<int>(3 * node(e, b) + j);
          for (int a = 0; a < 4; ++a) {
            for (int i = 0; i < 3; ++i) {
              double sum = 0;
              for (int k = 0; k < 3; ++k) sum += stress[i][k] * gradient[e](a, k);
              terms.emplace_back(static_cast<int>(3 * node(e, a) + i), column, volume[e] * sum);
            }
            if (body_.nodal_dilatation)
              change.emplace_back(static_cast<int>(site(e, a)), column, volume[e] / 4 * volume_change);
          }
        }
    }
    Sparse k(dofs(), dofs());
    k.setFromTriplets(terms.begin(), terms.end());
    if (!body_.nodal_dilatation) return k;
    Sparse b(static_cast<Eigen::Index>(sites), dofs());
    b.setFromTriplets(change.begin(), change.end());
    Eigen::VectorXd weight(static_cast<Eigen::Index>(sites));
    for (std::size_t s = 0; s < sites; ++s)
      weight[static_cast<Eigen::Index>(s)] = body_.laws[sites_.region[s]].bulk / sites_.volume[s];
    const Sparse scaled = weight.asDiagonal() * b;
    return k + Sparse(b.transpose() * scaled);
  }

  // Least energy with rows * u = target, from u on. rows: [rows][dofs]. Returns the force of each row on the body, N.
  // Errors: where it does not converge.
  Eigen::VectorXd solve(const Eigen::MatrixXd& rows, const Eigen::VectorXd& target, Eigen::VectorXd* u,
                        double tolerance = 1e-9) const {
    const auto count = static_cast<Eigen::Index>(free_.size());
    Eigen::MatrixXd w(count, rows.rows());
    for (Eigen::Index i = 0; i < count; ++i) w.row(i) = rows.col(free_[static_cast<std::size_t>(i)]).transpose();
    Eigen::VectorXd force, trial_force, lambda;
    double least_energy = energy(*u, &force);
    for (int step = 0; step < 100; ++step) {
      const Sparse k = free_part(tangent(*u));
      Eigen::SimplicialLDLT<Sparse> factor;
      const Sparse rest =
          step == 0 || shift_.rows() != count ? (shift_ = free_part(tangent(Eigen::VectorXd::Zero(dofs())))) : shift_;
      double shift = 0;
      for (;;) {
        factor.compute(shift > 0 ? Sparse(k + shift * rest) : k);
        if (factor.info() == Eigen::Success && factor.vectorD().minCoeff() > 0) break;
        shift = shift == 0 ? 0.02 : 2 * shift;
        if (shift > 100) throw std::runtime_error("the tangent cannot be made definite");
      }
      Eigen::VectorXd gradient(count);
      for (Eigen::Index i = 0; i < count; ++i) gradient[i] = force[free_[static_cast<std::size_t>(i)]];
      const Eigen::MatrixXd y = factor.solve(w);
      const Eigen::VectorXd z = factor.solve(gradient);
      const Eigen::VectorXd missed = target - rows * *u;
      lambda = (w.transpose() * y).ldlt().solve(missed + w.transpose() * z);
      const Eigen::VectorXd move = y * lambda - z, residual = gradient - w * lambda;
      const bool on_constraint = missed.norm() <= 1e-12 * (1 + target.norm());
      if (on_constraint && residual.norm() <= tolerance * (gradient.norm() + 1e-300)) return lambda;
      double share = 1, found = INFINITY;
      Eigen::VectorXd trial;
      for (; share > 1e-6; share /= 2) {
        trial = *u;
        for (Eigen::Index i = 0; i < count; ++i) trial[free_[static_cast<std::size_t>(i)]] += share * move[i];
        found = energy(trial, &trial_force);
        const double slope = share * gradient.dot(move);
        if (std::isfinite(found) &&
            (!on_constraint || found <= least_energy + 1e-4 * slope + 1e-13 * std::abs(least_energy)))
          break;
      }
      if (!(share > 1e-6)) {
        if (on_constraint && residual.norm() <= 1e-6 * gradient.norm()) return lambda;
        throw std::runtime_error("the line search found no descent");
      }
      *u = trial, force = trial_force, least_energy = found;
    }
    throw std::runtime_error("100 steps did not converge");
  }

 private:
  Eigen::Index node(std::size_t e, int a) const { return body_.tetrahedra[4 * e + static_cast<std::size_t>(a)]; }
  std::size_t site(std::size_t e, int a) const {
    return static_cast<std::size_t>(sites_.of_corner[4 * e + static_cast<std::size_t>(a)]);
  }
  Sparse free_part(const Sparse& all) const {
    std::vector<Eigen::Triplet<double>> terms;
    for (int c = 0; c < all.outerSize(); ++c)
      for (Sparse::InnerIterator at(all, c); at; ++at)
        if (const int row = column_[static_cast<std::size_t>(at.row())], column = column_[static_cast<std::size_t>(c)];
            row >= 0 && column >= 0)
          terms.emplace_back(row, column, at.value());
    Sparse part(static_cast<Eigen::Index>(free_.size()), static_cast<Eigen::Index>(free_.size()));
    part.setFromTriplets(terms.begin(), terms.end());
    return part;
  }

  HyperelasticBody body_;
  mutable SceneMemory memory_;
  ElementLanes<double> elements_;
  DilatationSites sites_;
  std::vector<std::int32_t> place_;
  std::vector<Eigen::Index> free_;
  std::vector<int> column_;
  mutable Sparse shift_;
};

}  // namespace palpate::tests
