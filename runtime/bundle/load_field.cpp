#include "runtime/bundle/load_field.h"

namespace palpate {

bool LoadField::create(SceneMemory& memory, std::int32_t capacity) {
  const auto loads = static_cast<std::size_t>(capacity);
  loads_ = memory.array<Load>(loads);
  row_ = memory.array<const void*>(3 * loads);
  coefficient_ = memory.array<double>(3 * loads);
  rows_before_ = memory.array<std::int32_t>(loads + 1);
  capacity_ = capacity;
  return !memory.failed();
}

void LoadField::keep(SceneMemory& memory) {
  memory.keep(count_);
  memory.keep_array(loads_, static_cast<std::size_t>(capacity_), count_);
}

void LoadField::restored(const Tensors& tensors) {
  tensors_ = &tensors;
  for (std::int32_t e = 0; e < count_; ++e) find_rows(e);
}

void LoadField::begin(const Tensors& tensors) {
  tensors_ = &tensors, count_ = 0;
}

void LoadField::add(std::int32_t column, Vec3 modified) {
  loads_[count_] = {column, 0, modified};
  find_rows(count_++);
}

void LoadField::find_rows(std::int32_t e) {
  const Load& load = loads_[e];
  std::int32_t row = e == 0 ? 0 : rows_before_[e];
  rows_before_[e] = row;
  for (int j = 0; j < 3 && !is_zero(load.modified); ++j, ++row) {
    if (tensors_->compliance) continue;
    row_[row] = tensors_->surface_row(load.column, j);
    coefficient_[row] = load.modified[j] * static_cast<double>(tensors_->row_scale(load.column, j));
  }
  rows_before_[e + 1] = row;
}

Vec3 LoadField::at_node(std::int32_t node, std::int32_t first, std::int32_t last) const {
  if (first == last) return {};
  if (!tensors_->compliance && node < tensors_->surface_nodes) {
    if (tensors_->has_rows_of_two_types()) return sum_of_types(node, first, last);
    return sum_at_node(tensors_->surface, node, first, last);
  }
  Vec3 sum;
  for (std::int32_t e = first; e < last; ++e)
    if (!is_zero(loads_[e].modified)) sum += tensors_->displacement(node, loads_[e].column) * loads_[e].modified;
  return sum;
}

Vec3 LoadField::sum_at_node(const DisplacementRows& rows, std::int32_t node, std::int32_t first,
                            std::int32_t last) const {
  const std::int32_t from = rows_before_[first];
  return rows.sum_at_node(row_ + from, coefficient_ + from, rows_before_[last] - from, node);
}

// Neighbours of one stored type at a time.
Vec3 LoadField::sum_of_types(std::int32_t node, std::int32_t first, std::int32_t last) const {
  Vec3 sum;
  for (std::int32_t e = first, next = first; e < last; e = next) {
    const bool of_surface = tensors_->is_of_surface(loads_[e].column);
    while (next < last && tensors_->is_of_surface(loads_[next].column) == of_surface) ++next;
    sum += sum_at_node(of_surface ? tensors_->surface : tensors_->corridor->surface, node, e, next);
  }
  return sum;
}

void LoadField::at_run(std::int32_t first, std::int32_t count, double* out) const {
  if (tensors_->has_rows_of_two_types()) {
    for (std::int32_t n = 0; n < count; ++n) store3(sum_of_types(first + n, 0, count_), out + 3 * n);
    return;
  }
  tensors_->surface.sum_at_run(row_, coefficient_, 3 * acting(), first, count, out);
}

}  // namespace palpate
