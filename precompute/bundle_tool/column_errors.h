// The errors of stored columns against the columns they approximate.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "precompute/bundle_tool/stored_columns.h"

namespace palpate {

// Over all columns that were added: their relative errors in the 2-norm, over the nodes that both have stored.
struct ColumnErrors {
  double worst = 0, rms = 0, largest_entry = 0;
  std::int64_t worst_node = -1, worst_dof = 0, columns = 0;

  void add(const ColumnRows& stored, const ColumnRows& expected, std::int32_t node) {
    for (int j = 0; j < 3; ++j) {
      double difference = 0, size = 0;
      const auto take = [&](const std::vector<double>& a, const std::vector<double>& b) {
        if (a.size() != b.size()) return;
        const std::size_t run = a.size() / 3, first = static_cast<std::size_t>(j) * run;
        for (std::size_t i = first; i < first + run; ++i) {
          const double d = std::abs(a[i] - b[i]);
          difference += d * d, size += b[i] * b[i];
          if (!(d <= largest_entry)) largest_entry = d;
        }
      };
      take(stored.surface, expected.surface);
      take(stored.interior, expected.interior);
      if (difference == 0 && size == 0) continue;  // of a fixed dof
      const double error = std::sqrt(difference / size);
      if (!(error <= worst)) worst = error, worst_node = node, worst_dof = j;
      squares_ += difference / size;
      ++columns;
    }
  }
  void finish() { rms = columns > 0 ? std::sqrt(squares_ / static_cast<double>(columns)) : 0; }

 private:
  double squares_ = 0;
};

}  // namespace palpate
