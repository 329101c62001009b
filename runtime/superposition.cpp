#include "runtime/superposition.h"

namespace palpate {
namespace {

// A block of the output that stays in the first-level cache while every group of columns adds to it.
constexpr std::size_t kBlock = 3072;
constexpr int kGroup = 12;

// Width columns at a time: one load of each, one load and store of the output.
template <int Width, bool First>
void add_group(const float* const* column, const float* coefficient, std::size_t begin, std::size_t count,
               float* __restrict out) {
  const float* p[Width];
  float c[Width];
  for (int j = 0; j < Width; ++j) p[j] = column[j] + begin, c[j] = coefficient[j];
  for (std::size_t i = 0; i < count; ++i) {
    float sum = First ? 0.0f : out[i];
    for (int j = 0; j < Width; ++j) sum += c[j] * p[j][i];
    out[i] = sum;
  }
}

template <bool First>
void add_up_to_group(int width, const float* const* column, const float* coefficient, std::size_t begin,
                     std::size_t count, float* out) {
  switch (width) {
    case 12:
      return add_group<12, First>(column, coefficient, begin, count, out);
    case 11:
      return add_group<11, First>(column, coefficient, begin, count, out);
    case 10:
      return add_group<10, First>(column, coefficient, begin, count, out);
    case 9:
      return add_group<9, First>(column, coefficient, begin, count, out);
    case 8:
      return add_group<8, First>(column, coefficient, begin, count, out);
    case 7:
      return add_group<7, First>(column, coefficient, begin, count, out);
    case 6:
      return add_group<6, First>(column, coefficient, begin, count, out);
    case 5:
      return add_group<5, First>(column, coefficient, begin, count, out);
    case 4:
      return add_group<4, First>(column, coefficient, begin, count, out);
    case 3:
      return add_group<3, First>(column, coefficient, begin, count, out);
    case 2:
      return add_group<2, First>(column, coefficient, begin, count, out);
    case 1:
      return add_group<1, First>(column, coefficient, begin, count, out);
    default:
      return;
  }
}

}  // namespace

void superpose(const float* const* column, const float* coefficient, int column_count, std::size_t first,
               std::size_t count, float* out) {
  for (std::size_t begin = 0; begin < count; begin += kBlock) {
    const std::size_t size = count - begin < kBlock ? count - begin : kBlock;
    if (column_count == 0)
      for (std::size_t i = 0; i < size; ++i) out[begin + i] = 0;
    for (int j = 0; j < column_count; j += kGroup) {
      const int width = column_count - j < kGroup ? column_count - j : kGroup;
      if (j == 0)
        add_up_to_group<true>(width, column, coefficient, first + begin, size, out + begin);
      else
        add_up_to_group<false>(width, column + j, coefficient + j, first + begin, size, out + begin);
    }
  }
}

}  // namespace palpate
