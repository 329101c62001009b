// Who acts in a touch step, in order. The step goes through these lists and asks none what it is.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "runtime/base/effects.h"
#include "runtime/contact/row_source.h"

namespace palpate {

class StepParts {
 public:
  // Asks for rows, in the order of their constraints, and acts.
  void ask(RowSource* source) { sources_[source_count_++] = source, add(source); }
  void add(StepPart* part) { parts_[part_count_++] = part; }
  void add_first(StepPart* part) {
    add(part);
    std::rotate(parts_, parts_ + part_count_ - 1, parts_ + part_count_);
  }
  std::span<RowSource* const> sources() const { return {sources_, static_cast<std::size_t>(source_count_)}; }
  std::span<StepPart* const> all() const { return {parts_, static_cast<std::size_t>(part_count_)}; }

 private:
  RowSource* sources_[kMostEffects + 1] = {};  // tools, and each effect once
  StepPart* parts_[kMostEffects + 2] = {};     // the sources among them
  std::int32_t source_count_ = 0, part_count_ = 0;
};

}  // namespace palpate
