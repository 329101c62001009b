#include "studies/large/measure.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <fstream>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <thread>

#include "formats/atomic_file.h"
#include "formats/errors.h"
#include "formats/program.h"
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
constexpr double kShortest = 1.0 / 64;

// The rows of all discs of a move.
struct Rows {
  MatrixXd rows;  // [3 discs][dofs]
  MatrixXd compliance;
  VectorXd way;  // [3 discs] target for a unit of depth
};

// What one thread measures with: two scenes and a reference of its own. A move begins and ends at rest, so the thread that measures the move
// does not matter to its errors.
class Measurement {
 public:
  Measurement(const Bundle& bundle, const LargeBody& body, double radius, const Pace& pace)
      : pace_(pace),
        linear_(bundle, PALPATE_DEFORMATION_LINEAR, radius),
        large_(bundle, PALPATE_DEFORMATION_LARGE, radius),
        reference_(body.get()) {}

  // What is kept of a move: {records: [one for each depth], linear, large: {touch, touch_thread, shape: us of each},
  // newton: {steps, ticks, assembly_s, factor_s, solve_s}, create_ms: {linear, large}}.
  Json measured(const Move& move) {
    const Rows rows = rows_of(move);
    StepTimes linear_times, large_times;
    const auto linear = linear_.play(move, pace_, &linear_times);
    const auto large = large_.play(move, pace_, &large_times);
    newton_ = {}, newton_ticks_ = 0;
    converged_ = VectorXd::Zero(reference_.dofs()), converged_depth_ = 0;
    Json records = Json::array();
    for (std::size_t i = 0; i < pace_.depths.size(); ++i) {
      Json record = {{"place", move.place}, {"move", move.name}, {"depth_mm", 1e3 * pace_.depths[i]}};
      try {
        compare(rows, pace_.depths[i], linear[i], large[i], &record);
      } catch (const std::runtime_error& error) {
        record["unsolved"] = error.what();
      }
      record["flags"] = large[i].flags, record["residual"] = large[i].residual;
      record["least_volume"] = large[i].least_volume;
      records.push_back(record);
    }
    return {{"records", records},
            {"linear", times_json(linear_times)},
            {"large", times_json(large_times)},
            {"newton",
             {{"steps", newton_.steps},
              {"ticks", newton_ticks_},
              {"assembly_s", newton_.assembly_seconds},
              {"factor_s", newton_.factor_seconds},
              {"solve_s", newton_.solve_seconds}}},
            {"create_ms", {{"linear", linear_.create_ms()}, {"large", large_.create_ms()}}}};
  }

 private:
  static Json times_json(const StepTimes& times) {
    return {{"touch", times.touch}, {"touch_thread", times.touch_thread}, {"shape", times.shape}};
  }

  Rows rows_of(const Move& move) {
    const auto count = static_cast<Index>(3 * move.discs.size());
    const HeldDiscs held = linear_.hold(move.discs);
    Rows rows = {MatrixXd::Zero(count, reference_.dofs()), held.compliance, VectorXd(count)};
    for (std::size_t d = 0; d < move.discs.size(); ++d) {
      const auto first = static_cast<Index>(3 * d);
      for (int i = 0; i < 3; ++i) {
        rows.way[first + i] = move.discs[d].way[i];
        for (std::size_t n = 0; n < held.discs[d].nodes.size(); ++n)
          rows.rows(first + i, 3 * held.discs[d].nodes[n] + i) += held.discs[d].weights[n];
      }
    }
    return rows;
  }

  // The converged solution at a depth, from the runtime's state; where Newton's method does not converge from there, from the last depth on in
  // steps, shorter ones down to kShortest of the way where it does not converge either.
  VectorXd solve(const Rows& rows, double depth, VectorXd* u) {
    VectorXd force;
    try {
      force = reference_.solve(rows.rows, depth * rows.way, u, kConverged, rows.compliance);
    } catch (const std::runtime_error&) {
      const double whole = depth - converged_depth_;
      VectorXd at = converged_;
      for (double way = whole / 4, reached = converged_depth_; reached < depth;) {
        const double next = std::min(reached + way, depth);
        VectorXd trial = at;
        try {
          force = reference_.solve(rows.rows, next * rows.way, &trial, kConverged, rows.compliance);
          at = trial, reached = next, way *= 2;
        } catch (const std::runtime_error&) {
          way /= 2;
          if (way < kShortest * whole) throw;
        }
      }
      *u = at;
    }
    converged_ = *u, converged_depth_ = depth;
    return force;
  }

  void compare(const Rows& rows, double depth, const Reached& linear, const Reached& large, Json* record) {
    VectorXd u = large.u;
    const VectorXd force = solve(rows, depth, &u);
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
  NewtonWork newton_;  // of the move that is measured
  int newton_ticks_ = 0;
  VectorXd converged_;  // the last solution of the move, or rest
  double converged_depth_ = 0;
};

// Of all moves together.
class Summary {
 public:
  explicit Summary(const std::vector<Json>& moves) : moves_(moves) {}

  Json json() const {
    Json records = Json::array();
    for (const Json& move : moves_)
      for (const Json& record : move.at("records")) records.push_back(record);
    return {{"moves", records},
            {"touch", {{"linear", touch("linear")}, {"large", touch("large")}}},
            {"shape", {{"linear", shape("linear")}, {"large", shape("large")}}},
            {"create_ms", moves_.front().at("create_ms")},
            {"newton", newton()}};
  }

 private:
  std::vector<double> times(const char* model, const char* which) const {
    std::vector<double> all;
    for (const Json& move : moves_)
      for (const Json& time : move.at(model).at(which)) all.push_back(time);
    return all;
  }
  Json touch(const char* model) const {
    const auto clock = times(model, "touch"), thread = times(model, "touch_thread");
    return {{"median_us", studies::percentile(clock, 0.5)},
            {"most_us", studies::percentile(clock, 0.999)},
            {"worst_us", studies::percentile(clock, 1)},
            {"thread_median_us", studies::percentile(thread, 0.5)},
            {"thread_most_us", studies::percentile(thread, 0.999)},
            {"touches", clock.size()}};
  }
  Json shape(const char* model) const { return {{"median_us", studies::percentile(times(model, "shape"), 0.5)}}; }
  double newton_sum(const char* what) const {
    double sum = 0;
    for (const Json& move : moves_) sum += move.at("newton").at(what).get<double>();
    return sum;
  }
  Json newton() const {
    const double steps = newton_sum("steps");
    if (steps == 0) return nullptr;
    return {{"steps_a_tick", steps / newton_sum("ticks")},
            {"assembly_ms", 1e3 * newton_sum("assembly_s") / steps},
            {"factor_ms", 1e3 * newton_sum("factor_s") / steps},
            {"solve_ms", 1e3 * newton_sum("solve_s") / steps}};
  }

  const std::vector<Json>& moves_;
};

// The moves that no earlier run has kept, each taken by the next thread that is free.
class Moves {
 public:
  Moves(const Bundle& bundle, const LargeBody& body, const std::vector<Move>& moves, const MeasureOptions& options)
      : bundle_(bundle), body_(body), moves_(moves), options_(options), measured_(moves.size()) {
    for (std::size_t m = 0; m < moves.size(); ++m)
      if (std::ifstream in(kept(m)); in) measured_[m] = Json::parse(in, nullptr, false);
  }

  Json measure() {
    const auto done = std::count_if(measured_.begin(), measured_.end(), [](const Json& m) { return m.is_object(); });
    Progress progress("moves", moves_.size(), static_cast<std::uint64_t>(done));
    if (done > 0) progress.advance(static_cast<std::uint64_t>(done));
    std::vector<std::thread> others;
    for (int t = 1; t < options_.threads; ++t) others.emplace_back([&] { take(&progress); });
    take(&progress);
    for (std::thread& other : others) other.join();
    if (failure_) std::rethrow_exception(failure_);
    return Summary(measured_).json();
  }

 private:
  std::filesystem::path kept(std::size_t m) const { return options_.kept / fmt::format("{}.json", m); }

  void take(Progress* progress) try {
    std::optional<Measurement> measurement;
    for (std::size_t m = next_++; m < moves_.size(); m = next_++) {
      if (measured_[m].is_object()) continue;
      if (!measurement) measurement.emplace(bundle_, body_, options_.radius, options_.pace);
      measured_[m] = measurement->measured(moves_[m]);
      write_text_atomically(kept(m), measured_[m].dump());
      const std::lock_guard lock(mutex_);
      progress->advance();
    }
  } catch (...) {
    next_ = moves_.size();
    const std::lock_guard lock(mutex_);
    failure_ = std::current_exception();
  }

  const Bundle& bundle_;
  const LargeBody& body_;
  const std::vector<Move>& moves_;
  const MeasureOptions& options_;
  std::vector<Json> measured_;  // of each move
  std::atomic<std::size_t> next_ = 0;
  std::mutex mutex_;  // of the progress and the failure
  std::exception_ptr failure_;
};

}  // namespace

Json measure(const std::filesystem::path& file, const LargeBody& body, const std::vector<Move>& moves,
             const MeasureOptions& options) try {
  const Bundle bundle(file.c_str());
  palpate_error ignored;
  palpate_bundle_prefault(bundle.get(), 0, &ignored);
  return Moves(bundle, body, moves, options).measure();
} catch (const Error& error) {
  throw OperationError(fmt::format("{}: {}", file.string(), error.what()));
}

}  // namespace palpate::large
