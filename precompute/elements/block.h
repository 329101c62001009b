// The former names of column_buffer.h.
#pragma once

#include "precompute/elements/column_buffer.h"

namespace palpate {

using Block = ColumnBuffer;
inline Block make_block(std::int64_t rows, int width) {
  return make_column_buffer(rows, width);
}

}  // namespace palpate
