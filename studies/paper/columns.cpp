#include "studies/paper/constrained_solve.h"
#include "studies/paper/paper_measurements.h"
#include "studies/peers/measured.h"

namespace palpate::studies {

Json measure_columns(const Push& push, double seconds) {
  const auto& touchable = push.body.touchable;
  // A prime stride spreads any number of nodes over all touchable nodes.
  constexpr std::size_t kStride = 7919;
  Answer answer;
  double spent = 0;
  int nodes = 0;
  std::int64_t iterations = 0;
  const auto begin = Clock::now();
  do {
    const std::int32_t node = touchable[static_cast<std::size_t>(nodes) * kStride % touchable.size()];
    ConstrainedSolve solve(push, node, "jacobi", kTolerance);
    const auto start = Clock::now();
    for (int j = 0; j < 3; ++j) {
      solve.move(Eigen::Vector3d::Unit(j), false, answer);
      iterations += solve.iterations();
    }
    spent += seconds_since(start);
    ++nodes;
  } while (static_cast<std::size_t>(nodes) < touchable.size() && seconds_since(begin) < seconds);
  const double column = spent / (3 * nodes);
  return {{"tolerance", kTolerance},       {"columns", 3 * touchable.size()},
          {"columns_solved", 3 * nodes},   {"iterations", static_cast<double>(iterations) / (3 * nodes)},
          {"ms_per_column", 1e3 * column}, {"seconds", column * 3 * static_cast<double>(touchable.size())}};
}

}  // namespace palpate::studies
