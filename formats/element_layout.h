// The layout version of a bundle, by its element. A reader of layout 2 takes an element that it does not know for p1-anp, so a bundle of a newer
// element has a layout that this reader refuses.
#pragma once

#include <cstdint>
#include <string_view>

#include "formats/bundle_layout.h"

namespace palpate::formats {

inline constexpr std::uint32_t kNewestLayout = 3;  // of p1-ang

inline std::uint32_t layout_of_element(std::string_view element) {
  return element == "p1-ang" ? kNewestLayout : kLayoutVersion;
}

inline bool reader_knows_layout(std::uint32_t version) {
  return version >= kLayoutVersion && version <= kNewestLayout;
}

}  // namespace palpate::formats
