#include "runtime/cut/cut_base.h"

namespace palpate {

bool BasePairs::create(SceneMemory& memory, const PairCompliance& uncut, const CutTissue& tissue, const CutBase& base,
                       const BaseNumbers& numbers, std::int32_t first_reserve, std::int32_t most) {
  uncut_ = &uncut, tissue_ = &tissue, base_ = &base, number_of_node_ = numbers.of_node;
  first_reserve_ = first_reserve, most_ = most;
  origin_ = memory.array<std::int32_t>(static_cast<std::size_t>(most));
  return !memory.failed();
}

std::int32_t BasePairs::number(std::int32_t node) const {
  return number_of_node_[tissue_->is_new(node) ? first_reserve_ + node - tissue_->rest_nodes() : node];
}

bool BasePairs::read(std::int32_t node, const std::int32_t* others, std::int32_t count, double* rows,
                     std::size_t stride) const {
  if (count > most_) return false;
  for (std::int32_t k = 0; k < count; ++k) origin_[k] = tissue_->origin(others[k]);
  if (!uncut_->read(tissue_->origin(node), origin_, count, rows, stride)) return false;
  const std::int32_t own = number(node);
  for (std::int32_t k = 0; k < count; ++k) {
    const std::int32_t other = number(others[k]);
    for (int i = 0; i < 3 && own >= 0 && other >= 0; ++i)
      for (int j = 0; j < 3; ++j)
        rows[static_cast<std::size_t>(i) * stride + static_cast<std::size_t>(3 * k + j)] +=
            base_->row(own, i)[3 * other + j];
  }
  return true;
}

}  // namespace palpate
