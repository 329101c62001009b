// The superposition's kernels against a plain sum, and against one another to the bit.
#include "runtime/dense/superposition.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

#include "formats/half.h"
#include "runtime/dense/loaded_runs.h"
#include "runtime/dense/node_sum.h"

namespace palpate {
namespace {

using formats::ElementType;

// Columns of any type at an odd address, as in a bundle, with nothing readable behind them.
struct Columns {
  Columns(ElementType stored, int count, std::size_t length) : type(stored), numbers(count), run(count) {
    std::uint32_t state = 1;
    for (int j = 0; j < count; ++j) {
      const std::size_t bytes = formats::element_bytes(type);
      run[j].resize(length * bytes);
      for (std::size_t i = 0; i < length; ++i) {
        state = state * 1664525u + 1013904223u;
        const double x = (state >> 8) * (1.0 / (1 << 24)) - 0.5;
        const auto f = static_cast<float>(x);
        const auto half = static_cast<std::uint16_t>(state >> 17 & 0xbbff);  // finite, either sign
        if (type == ElementType::f64) std::memcpy(&run[j][i * bytes], &x, bytes);
        if (type == ElementType::f32) std::memcpy(&run[j][i * bytes], &f, bytes);
        if (type == ElementType::f16) std::memcpy(&run[j][i * bytes], &half, bytes);
        numbers[j].push_back(type == ElementType::f16 ? formats::float_of_half(half) : f);
      }
      column.push_back(run[j].data());
      coefficient.push_back(0.01f * static_cast<float>(j - 3));
    }
  }
  ElementType type;
  std::vector<std::vector<float>> numbers;
  std::vector<std::vector<unsigned char>> run;
  std::vector<const void*> column;
  std::vector<float> coefficient;
};

TEST(Superposition, SumsTheColumnsInOrderWithEveryInstructionSet) {
  for (const ElementType type : {ElementType::f32, ElementType::f64, ElementType::f16})
    for (const int columns : {0, 1, 2, 3, 5, 6, 9, 12, 13, 30, 37})
      for (const std::size_t count : {1u, 15u, 16u, 47u, 3072u, 3073u, 7000u}) {
        const std::size_t first = 5;
        const Columns stored(type, columns, first + count);
        std::vector<float> expected(count);
        for (std::size_t i = 0; i < count; ++i)
          for (int j = 0; j < columns; ++j) {
            // Rounded one by one: volatile keeps the compiler from contracting it.
            const volatile float product = stored.coefficient[j] * stored.numbers[j][first + i];
            expected[i] += product;
          }
        for (int set = 0; set <= static_cast<int>(best_instructions()); ++set) {
          std::vector<float> out(count, NAN);
          superpose(static_cast<Instructions>(set), type, stored.column.data(), stored.coefficient.data(), columns,
                    first, count, out.data());
          ASSERT_EQ(out, expected) << "type " << static_cast<int>(type) << ", " << columns << " columns of " << count
                                   << ", instructions " << set;
        }
      }
}

// The runs fill their memory to the last byte: a sanitizer sees a number that is read behind them.
TEST(LoadedRuns, AddTheLoadsOfEachRunWithEveryInstructionSetAlsoAtTheEndOfTheLastRun) {
  constexpr std::int32_t first_slot = 7;
  for (const ElementType type : {ElementType::f32, ElementType::f64, ElementType::f16})
    for (const int runs : {1, 3, 4, 5, 8, 9, 31})
      for (const int slots : {1, 2, 11})
        for (const int loads : {0, 1, 3}) {
          const auto stride = 3 * static_cast<std::size_t>(slots);
          const Columns stored(type, 1, static_cast<std::size_t>(runs) * stride);
          std::vector<std::int32_t> slot;
          std::vector<float> force;
          for (int l = 0; l < loads; ++l) {
            slot.push_back(first_slot + (slots - 1) * (l + 1) / loads);
            for (int d = 0; d < 3; ++d)
              force.push_back(0.25f * static_cast<float>(l + 1) - 0.1f * static_cast<float>(d));
          }
          const RunsOfSlots of = {type, stored.run[0].data(), stride, runs, first_slot, 0.5f};
          std::vector<float> same;
          for (int set = 0; set <= static_cast<int>(best_instructions()); ++set) {
            std::vector<float> found(static_cast<std::size_t>(runs), 2);
            multiply_loads_onto(static_cast<Instructions>(set), of, {slot.data(), force.data(), loads}, found.data());
            for (int r = 0; r < runs; ++r) {
              double expected = 2, size = 2;
              for (int l = 0; l < loads; ++l)
                for (int d = 0; d < 3; ++d) {
                  const double term =
                      0.5 * force[3 * l + d] * stored.numbers[0][r * stride + 3 * (slot[l] - first_slot) + d];
                  expected += term, size += std::abs(term);
                }
              // Ten terms, each rounded with its product and its sum.
              ASSERT_NEAR(found[r], expected, 20 * 0x1p-24 * size)
                  << static_cast<int>(type) << " " << runs << " " << slots;
            }
            if (set == 0) same = found;
            ASSERT_EQ(found, same) << "instructions " << set;
          }
        }
}

TEST(NodeSum, AddsFourSumsSideBySideWithEveryInstructionSetAlsoAtTheEndOfAColumn) {
  for (const ElementType type : {ElementType::f32, ElementType::f64, ElementType::f16})
    for (const int columns : {0, 1, 3, 4, 7, 30, 101})
      for (const std::size_t first : {0u, 5u, 12u}) {
        const std::size_t length = 15;  // the last node is at 12
        const Columns stored(type, columns, length);
        const std::vector<double> coefficient(stored.coefficient.begin(), stored.coefficient.end());
        std::vector<double> expected(3);
        for (std::size_t d = 0; d < 3; ++d) {
          volatile double sum[4] = {};
          for (int j = 0; j < columns; ++j) {
            double number = stored.numbers[j][first + d];
            if (type == ElementType::f64)
              std::memcpy(&number, &stored.run[j][(first + d) * sizeof number], sizeof number);
            const volatile double product = coefficient[j] * number;
            sum[j % 4] = sum[j % 4] + product;
          }
          const volatile double left = sum[0] + sum[1], right = sum[2] + sum[3];
          expected[d] = left + right;
        }
        for (int set = 0; set <= static_cast<int>(best_instructions()); ++set) {
          std::vector<double> out(3, NAN);
          sum_at_node(static_cast<Instructions>(set), type, stored.column.data(), coefficient.data(), columns, first,
                      length, out.data());
          ASSERT_EQ(out, expected) << "type " << static_cast<int>(type) << ", " << columns << " columns, first "
                                   << first << ", instructions " << set;
        }
      }
}

// Runs that are longer than the tile in which the sums stay, or end in its middle.
TEST(NodeSum, OfARunGivesTheBitsThatItsNodesHaveOneByOneWithEveryInstructionSet) {
  for (const ElementType type : {ElementType::f32, ElementType::f64, ElementType::f16})
    for (const int columns : {0, 1, 4, 11, 12, 13, 30, 101})
      for (const int nodes : {1, 5, 64, 65, 200}) {
        const std::size_t first = 6, count = 3 * static_cast<std::size_t>(nodes), length = first + count;
        const Columns stored(type, columns, length);
        const std::vector<double> coefficient(stored.coefficient.begin(), stored.coefficient.end());
        std::vector<double> expected(count);
        for (std::size_t i = 0; i < count; i += 3)
          sum_at_node(type, stored.column.data(), coefficient.data(), columns, first + i, length, expected.data() + i);
        for (int set = 0; set <= static_cast<int>(best_instructions()); ++set) {
          std::vector<double> out(count, NAN);
          sum_at_run(static_cast<Instructions>(set), type, stored.column.data(), coefficient.data(), columns, first,
                     count, out.data());
          ASSERT_EQ(out, expected) << "type " << static_cast<int>(type) << ", " << columns << " columns, " << nodes
                                   << " nodes, instructions " << set;
        }
      }
}

}  // namespace
}  // namespace palpate
