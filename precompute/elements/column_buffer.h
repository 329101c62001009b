// Memory for the columns that are solved together.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>

namespace palpate {

struct FreeColumns {
  void operator()(void* values) const { std::free(values); }
};
template <class Number>
using ColumnBufferOf = std::unique_ptr<Number[], FreeColumns>;
using ColumnBuffer = ColumnBufferOf<double>;

// [rows][width]. Not initialised: the system takes a page when it is first written. Starts at a multiple of 64 bytes,
// so that a row whose width is a multiple of 8 (of 16 for float) fills whole cache lines.
template <class Number = double>
ColumnBufferOf<Number> make_column_buffer(std::int64_t rows, int width) {
  const std::size_t numbers = static_cast<std::size_t>(rows) * static_cast<std::size_t>(width);
  const std::size_t bytes = (numbers * sizeof(Number) + 63) / 64 * 64;
  auto* values = static_cast<Number*>(std::aligned_alloc(64, bytes > 0 ? bytes : 64));
  if (!values) throw std::bad_alloc();
  return ColumnBufferOf<Number>(values);
}

}  // namespace palpate
