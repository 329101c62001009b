// A force-feedback device and the hand on it, simulated: a mass with friction, held by a spring and a damper to where the hand
// wants to be. The force of the computer is held over a tick and comes some ticks late.
#pragma once

#include <Eigen/Dense>
#include <deque>

#include "runtime/include/palpate/palpate_passivity.h"
#include "runtime/include/palpate/palpate_watchdog.h"

namespace palpate::tests {

struct Hand {
  double stiffness = 200, damping = 0;  // N/m, N s/m
};

class SimulatedDevice {
 public:
  SimulatedDevice(const palpate_device& device, const Hand& hand)
      : hand_(hand), damping_(device.damping), tick_(device.tick), late_(device.delay_ticks, Eigen::Vector3d::Zero()) {
    // x'' = (force - (b + b_h) x' - k_h x) / m with a constant force: the exact exponential of one tick, by squaring a series.
    Eigen::Matrix3d rates = Eigen::Matrix3d::Zero();
    rates(0, 1) = 1;
    rates(1, 0) = -hand.stiffness / device.mass;
    rates(1, 1) = -(device.damping + hand.damping) / device.mass;
    rates(1, 2) = 1 / device.mass;
    constexpr int kSquarings = 10;
    const Eigen::Matrix3d small = rates * device.tick / (1 << kSquarings);
    Eigen::Matrix3d term = Eigen::Matrix3d::Identity(), sum = term;
    for (int i = 1; i < 12; ++i) sum += term = (term * small / i).eval();
    for (int i = 0; i < kSquarings; ++i) sum = (sum * sum).eval();
    tick_map_ = sum;
  }

  const Eigen::Vector3d& position() const { return position_; }
  // J: what the forces have given the device so far, less the most that its friction may have left of it. Motion x takes at
  // least b x^2 / tick from it, whatever its course within the tick.
  double generated() const { return generated_; }
  double most_generated() const { return most_generated_; }

  void step(const Eigen::Vector3d& force, const Eigen::Vector3d& hand_target) {
    late_.push_back(force);
    const Eigen::Vector3d held = late_.front(), before = position_;
    late_.pop_front();
    for (int d = 0; d < 3; ++d) {
      const Eigen::Vector3d state(position_[d], velocity_[d], held[d] + hand_.stiffness * hand_target[d]);
      const Eigen::Vector3d next = tick_map_ * state;
      position_[d] = next[0], velocity_[d] = next[1];
    }
    const Eigen::Vector3d move = position_ - before;
    generated_ += held.dot(move) - damping_ * move.squaredNorm() / tick_;
    most_generated_ = std::max(most_generated_, generated_);
  }

 private:
  Hand hand_;
  double damping_, tick_;
  std::deque<Eigen::Vector3d> late_;
  Eigen::Matrix3d tick_map_;
  Eigen::Vector3d position_ = Eigen::Vector3d::Zero(), velocity_ = Eigen::Vector3d::Zero();
  double generated_ = 0, most_generated_ = 0;
};

}  // namespace palpate::tests
