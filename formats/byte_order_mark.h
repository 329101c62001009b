// The byte order mark of UTF-8, which editors and spreadsheets put in front of a text.
#pragma once

#include <string_view>

namespace palpate {

// Returns how many bytes at the start of the text are the mark: 3, or 0 where there is none.
inline std::size_t byte_order_mark(std::string_view text) {
  return text.starts_with("\xEF\xBB\xBF") ? 3 : 0;
}

}  // namespace palpate
