// removed_bench MESH.msh organ.toml bc.toml [places]: what tetrahedra cost that are removed under a contact.
// A disc of 10 mm radius is pressed in by 20 mm at 100 mm/s; then the tetrahedra nearest to a place 15 mm beside the disc's centre go.
// The body is solved again while the disc stands still, one step of the method a tick, and then follows a drag of 5 mm.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <vector>

#include "precompute/elements/linear_tetrahedra.h"
#include "precompute/solver/elimination.h"
#include "runtime/large/large_solver.h"
#include "studies/hyperelastic/large_body.h"
#include "studies/hyperelastic/large_reference.h"
#include "studies/hyperelastic/remaining_body.h"

namespace palpate {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

double at_share(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}
double median(std::vector<double> values) {
  return at_share(std::move(values), 0.5);
}
double worst(std::vector<double> values) {
  return at_share(std::move(values), 1);
}

struct Place {
  std::vector<std::int32_t> disc;  // its nodes
  Vector3d inward, across, beside;
};
Place place_at(const ElasticBody& body, std::int32_t centre) {
  const auto at = [&](std::int32_t n) { return Vector3d(body.nodes[static_cast<std::size_t>(n)].data()); };
  Place place;
  Vector3d outward = Vector3d::Zero();
  for (const auto& t : body.triangles)
    if (t[0] == centre || t[1] == centre || t[2] == centre) outward += (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0]));
  place.inward = -outward.normalized();
  double nearest = INFINITY;
  for (std::int32_t n = 0; n < body.surface_count; ++n) {
    const double distance = (at(n) - at(centre)).norm();
    if (distance <= 0.010) place.disc.push_back(n);
    if (std::abs(distance - 0.015) < nearest) nearest = std::abs(distance - 0.015), place.beside = at(n);
  }
  const Vector3d way = place.beside - at(centre);
  place.across = (way - way.dot(place.inward) * place.inward).normalized();
  return place;
}

struct Result {
  int steps = 0;  // of the method, until the body is solved again
  double microseconds = 0, evaluations = 0, field = 0, force = 0, change = 0;
};

class Removal {
 public:
  Removal(LargeSolver& solver, const LargeBody& body, const Place& place)
      : solver_(solver), body_(body), place_(place) {}

  Result run(std::size_t count) {
    solver_.forget();
    const double weight = 1.0 / static_cast<double>(place_.disc.size());
    weights_.assign(place_.disc.size(), weight);
    for (int tick = 0; tick <= 200; ++tick) step(1e-4 * tick * place_.inward, LargeSolver::kMostSteps);
    const VectorXd intact = force();
    const auto removed = nearest_tetrahedra(body_.get(), place_.beside, count, place_.disc);
    if (count > 0) solver_.remove(removed.data(), static_cast<std::int32_t>(removed.size()));
    Result result;
    const auto begun = std::chrono::steady_clock::now();
    for (LargeOutcome out; result.steps < 1000; ++result.steps) {
      out = step(0.02 * place_.inward, 1);
      if (out.evaluations == 0 || (count > 0 && out.steps == 0)) break;
    }
    result.microseconds = 1e6 * std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
    for (int tick = 1; tick <= 50; ++tick)
      result.evaluations +=
          step(0.02 * place_.inward + 1e-4 * tick * place_.across, LargeSolver::kMostSteps).evaluations / 50.0;
    compare(removed, &result);
    result.change = (force() - intact).norm() / intact.norm();
    return result;
  }

 private:
  LargeOutcome step(const Vector3d& target, int most) {
    target_ = target;
    for (int i = 0; i < 3; ++i) {
      rows_[i] = LargeRow{};
      rows_[i].count = static_cast<std::int32_t>(place_.disc.size());
      rows_[i].direction[i] = 1, rows_[i].target = target[i];
    }
    return solver_.step({rows_, place_.disc.data(), weights_.data(), 3}, most, force_);
  }
  VectorXd force() const { return Eigen::Map<const Vector3d>(force_); }
  void compare(const std::vector<std::int32_t>& removed, Result* result) const {
    const RemainingBody rest(body_.get(), removed);
    VectorXd u(3 * static_cast<Eigen::Index>(rest.get().node_count));
    for (std::int32_t n = 0; n < rest.get().node_count; ++n) {
      float v[3];
      solver_.displacement(n, v);
      for (int i = 0; i < 3; ++i) u[3 * n + i] = static_cast<double>(v[i]);
    }
    rest.clear_left(&u);
    const VectorXd found = u;
    Eigen::MatrixXd w = Eigen::MatrixXd::Zero(3, u.size());
    for (const auto n : place_.disc)
      for (int i = 0; i < 3; ++i) w(i, 3 * n + i) = weights_[0];
    const VectorXd exact = LargeReference(rest.get()).solve(w, target_, &u);
    result->field = (found - u).norm() / u.norm(), result->force = (force() - exact).norm() / exact.norm();
  }

  LargeSolver& solver_;
  const LargeBody& body_;
  const Place& place_;
  std::vector<double> weights_;
  LargeRow rows_[3];
  double force_[3] = {};
  Vector3d target_ = Vector3d::Zero();
};

int run(int argc, char** argv) {
  if (argc < 4) {
    fmt::print(stderr, "usage: removed_bench MESH.msh organ.toml bc.toml [places]\n");
    return 2;
  }
  const int places = argc > 4 ? std::atoi(argv[4]) : 4;
  const OrganConfig organ = read_organ_config(argv[2]);
  const ElasticBody elastic =
      make_elastic_body(read_mesh(argv[1]), organ, read_boundary_config(argv[3]), {argv[1], argv[2], argv[3]});
  const bool nodal = organ.element == Element::p1_anp;
  const LargeBody body(elastic, nodal);
  const HeldStiffness held =
      remove_held_dofs(nodal ? nodal_dilatation_stiffness(elastic) : linear_stiffness(elastic), elastic.fixed);
  std::vector<std::int32_t> order;
  for (const auto row : analyse_elimination(held.matrix).order) order.push_back(held.node_of_row[row]);
  fmt::print("{} vertices, {} tetrahedra, {} places\n", elastic.nodes.size(), elastic.tetrahedra.size(), places);
  fmt::print("{:>8} {:>14} {:>16} {:>14} {:>18} {:>18} {:>12}\n", "removed", "steps (worst)", "us a step",
             "dragging:", "field, % (worst)", "force, % (worst)", "changes the");
  fmt::print("{:>8} {:>14} {:>16} {:>14} {:>18} {:>18} {:>12}\n", "", "until solved", "median", "evaluations", "", "",
             "force by, %");
  for (const std::size_t count : {0, 1, 10, 100}) {
    std::vector<double> steps, times, evaluations, field, force, change;
    for (int p = 0; p < places; ++p) {
      SceneMemory memory{palpate_allocator{}};
      LargeSolver solver;  // a new one: what was removed does not come back
      if (solver.create(memory, body.get(), order.data(), static_cast<std::int32_t>(order.size()), 3, 3000) !=
          LargeSolver::Created::made)
        throw std::runtime_error("the stiffness has no factor");
      const Place place = place_at(
          elastic,
          elastic.touchable[static_cast<std::size_t>(p) * elastic.touchable.size() / static_cast<std::size_t>(places)]);
      Result result;
      try {
        result = Removal(solver, body, place).run(count);
      } catch (const std::exception& no_reference) {
        fmt::print("{:>8} place {}: {}\n", count, p, no_reference.what());
        memory.release_all();
        continue;
      }
      steps.push_back(result.steps), times.push_back(result.microseconds / std::max(1, result.steps));
      evaluations.push_back(result.evaluations), change.push_back(100 * result.change);
      field.push_back(100 * result.field), force.push_back(100 * result.force);
      memory.release_all();
    }
    if (steps.empty()) continue;
    fmt::print("{:>8} {:>8.0f} ({:.0f}) {:>16.0f} {:>14.2f} {:>12.2f} ({:.2f}) {:>12.2f} ({:.2f}) {:>10.1f}\n", count,
               median(steps), worst(steps), median(times), median(evaluations), median(field), worst(field),
               median(force), worst(force), median(change));
  }
  return 0;
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  try {
    return palpate::run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "removed_bench: {}\n", error.what());
    return 1;
  }
}
