// Memory for the columns that are solved together.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>

namespace palpate {

struct FreeColumns {
  void operator()(double* values) const { std::free(values); }
};
using ColumnBuffer = std::unique_ptr<double[], FreeColumns>;

// [rows][width]. Not initialised: the system takes a page when it is first written. Starts at a multiple of 64 bytes,
// so that a row whose width is a multiple of 8 fills whole cache lines.
inline ColumnBuffer make_column_buffer(std::int64_t rows, int width) {
  const std::size_t bytes = (static_cast<std::size_t>(rows) * static_cast<std::size_t>(width) * 8 + 63) / 64 * 64;
  auto* values = static_cast<double*>(std::aligned_alloc(64, bytes > 0 ? bytes : 64));
  if (!values) throw std::bad_alloc();
  return ColumnBuffer(values);
}

}  // namespace palpate
