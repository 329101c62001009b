#include "studies/large/measure.h"

#include <fmt/format.h>

#include <map>
#include <stdexcept>

#include "formats/errors.h"
#include "studies/hyperelastic/large_reference.h"
#include "studies/timing/timing.h"

namespace palpate::large {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Json = nlohmann::ordered_json;

// Far below the errors that are measured.
constexpr double kConverged = 1e-7;
// Newton's method follows a push to this share of the inner force, which is about what the runtime leaves.
constexpr double kFollowed = 1e-3;
constexpr std::size_t kMovesOfNewton = 3;

// The rows of all discs of a move.
struct Rows {
  MatrixXd rows;  // [3 discs][dofs]
  MatrixXd compliance;
  VectorXd way;  // [3 discs] target for a unit of depth
};

class Measurement {
 public:
  Measurement(const Bundle& bundle, const LargeBody& body, double radius, const Pace& pace)
      : pace_(pace),
        linear_(bundle, PALPATE_DEFORMATION_LINEAR, radius),
        large_(bundle, PALPATE_DEFORMATION_LARGE, radius),
        reference_(body.get()) {}

  Json all(const std::vector<Move>& moves) {
    Json records = Json::array();
    for (const Move& move : moves) add(move, &records);
    return {{"moves", records},
            {"touch", {{"linear", touch_json(linear_times_)}, {"large", touch_json(large_times_)}}},
            {"shape", {{"linear", shape_json(linear_times_)}, {"large", shape_json(large_times_)}}},
            {"create_ms", {{"linear", linear_.create_ms()}, {"large", large_.create_ms()}}},
            {"newton", newton_json()}};
  }

 private:
  static Json touch_json(const StepTimes& times) {
    const auto at = [](const std::vector<double>& values, double share) { return studies::percentile(values, share); };
    return {{"median_us", at(times.touch, 0.5)},
            {"most_us", at(times.touch, 0.999)},
            {"worst_us", at(times.touch, 1)},
            {"thread_median_us", at(times.touch_thread, 0.5)},
            {"thread_most_us", at(times.touch_thread, 0.999)},
            {"touches", times.touch.size()}};
  }
  static Json shape_json(const StepTimes& times) { return {{"median_us", studies::percentile(times.shape, 0.5)}}; }

  Json newton_json() const {
    if (newton_ticks_ == 0) return nullptr;
    const double steps = newton_.steps;
    return {{"steps_a_tick", steps / newton_ticks_},
            {"assembly_ms", 1e3 * newton_.assembly_seconds / steps},
            {"factor_ms", 1e3 * newton_.factor_seconds / steps},
            {"solve_ms", 1e3 * newton_.solve_seconds / steps}};
  }

  Rows rows_of(const Move& move) {
    const auto count = static_cast<Index>(3 * move.discs.size());
    Rows rows = {MatrixXd::Zero(count, reference_.dofs()), MatrixXd::Zero(count, count), VectorXd(count)};
    for (std::size_t d = 0; d < move.discs.size(); ++d) {
      const HeldDisc disc = linear_.hold(move.discs[d].at);
      const auto first = static_cast<Index>(3 * d);
      for (int i = 0; i < 3; ++i) {
        rows.way[first + i] = move.discs[d].way[i];
        for (std::size_t n = 0; n < disc.nodes.size(); ++n)
          rows.rows(first + i, 3 * disc.nodes[n] + i) += disc.weights[n];
      }
      rows.compliance.block<3, 3>(first, first) = disc.compliance;
    }
    return rows;
  }

  void add(const Move& move, Json* records) {
    const Rows rows = rows_of(move);
    const auto linear = linear_.play(move, pace_, &linear_times_);
    const auto large = large_.play(move, pace_, &large_times_);
    for (std::size_t i = 0; i < pace_.depths.size(); ++i) {
      Json record = {{"place", move.place}, {"move", move.name}, {"depth_mm", 1e3 * pace_.depths[i]}};
      try {
        compare(rows, pace_.depths[i], linear[i], large[i], &record);
      } catch (const std::runtime_error& error) {
        record["unsolved"] = error.what();
      }
      record["flags"] = large[i].flags, record["residual"] = large[i].residual;
      record["least_volume"] = large[i].least_volume;
      records->push_back(record);
    }
  }

  void compare(const Rows& rows, double depth, const Reached& linear, const Reached& large, Json* record) {
    VectorXd u = large.u;
    const VectorXd force = reference_.solve(rows.rows, depth * rows.way, &u, kConverged, rows.compliance);
    const Index surface = linear.u.size();
    const VectorXd field = u.head(surface);
    (*record)["force_N"] = force.norm();
    (*record)["linear_field"] = (linear.u - field).norm() / field.norm();
    (*record)["linear_force"] = (linear.force - force).norm() / force.norm();
    (*record)["large_field"] = (large.u.head(surface) - field).norm() / field.norm();
    (*record)["large_force"] = (large.force - force).norm() / force.norm();
    if ((*record)["move"] == "push" && (*record)["place"] < kMovesOfNewton) {
      // The next tick of the push, from the converged state of this one.
      const double next = depth + 1e-3 * pace_.speed;
      reference_.solve(rows.rows, next * rows.way, &u, kFollowed, rows.compliance, &newton_);
      ++newton_ticks_;
    }
  }

  const Pace& pace_;
  Player linear_, large_;
  const LargeReference reference_;
  StepTimes linear_times_, large_times_;
  NewtonWork newton_;
  int newton_ticks_ = 0;
};

}  // namespace

Json measure(const std::filesystem::path& file, const LargeBody& body, const std::vector<Move>& moves, double radius,
             const Pace& pace) try {
  const Bundle bundle(file.c_str());
  palpate_error ignored;
  palpate_bundle_prefault(bundle.get(), 0, &ignored);
  return Measurement(bundle, body, radius, pace).all(moves);
} catch (const Error& error) {
  throw OperationError(fmt::format("{}: {}", file.string(), error.what()));
}

}  // namespace palpate::large
