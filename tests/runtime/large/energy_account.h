// The energy of a body against the work that is done on it: a state that follows its contacts gains no more than their forces do.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace palpate::tests {

class EnergyAccount {
 public:
  // A state of the body: its energy (J), the forces of all contacts on its nodes (N) and the displacements of the nodes (m), both [dofs].
  // Between two states the work is that of the mean force.
  void add(double energy, const Eigen::VectorXd& force, const Eigen::VectorXd& u) {
    // Where a contact ends at once, the forces at both ends of the step do not tell what was between.
    const bool falls = energy < energy_ - 0.1 * peak_;
    if (u_.size() > 0) work_ += falls ? energy - energy_ : 0.5 * (force + force_).dot(u - u_);
    force_ = force, u_ = u, energy_ = energy;
    peak_ = std::max(peak_, energy);
    const double beyond = energy - work_;
    least_ = std::min(least_, beyond);  // a body may lose energy: to friction, or as it relaxes
    gained_ = std::max(gained_, beyond - least_);
    finite_ = finite_ && std::isfinite(energy) && std::isfinite(work_);
  }
  // The most that the body has gained without work done on it, as a share of its largest energy.
  double gained() const { return finite_ ? gained_ / std::max(peak_, 1e-12) : INFINITY; }
  double work() const { return work_; }  // J
  double peak() const { return peak_; }  // J

 private:
  Eigen::VectorXd force_, u_;
  double energy_ = 0, work_ = 0, peak_ = 0, least_ = 0, gained_ = 0;
  bool finite_ = true;
};

}  // namespace palpate::tests
