// Memory for a block of columns.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>

namespace palpate {

struct FreeBlock {
  void operator()(double* values) const { std::free(values); }
};
using Block = std::unique_ptr<double[], FreeBlock>;

// [rows][width], not initialised, so that memory is taken when it is first written; at a multiple of 64 bytes: a row of
// a width that is a multiple of 8 fills whole lines of cache.
inline Block make_block(std::int64_t rows, int width) {
  const std::size_t bytes = (static_cast<std::size_t>(rows) * static_cast<std::size_t>(width) * 8 + 63) / 64 * 64;
  auto* values = static_cast<double*>(std::aligned_alloc(64, bytes > 0 ? bytes : 64));
  if (!values) throw std::bad_alloc();
  return Block(values);
}

}  // namespace palpate
