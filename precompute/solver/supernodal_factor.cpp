#include "precompute/solver/supernodal_factor.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <new>

#include "formats/errors.h"
#include "precompute/solver/machine_memory.h"
#include "precompute/solver/supernodal_factorisation.h"

namespace palpate {
namespace {

std::string name_of(std::int32_t row, const RowNames& names) {
  const auto r = static_cast<std::size_t>(row);
  std::string name = r < names.node.size() ? fmt::format("node {}", names.node[r]) : fmt::format("block row {}", row);
  if (r < names.position.size()) {
    const auto& p = names.position[r];
    name += fmt::format(" at ({:.6g}, {:.6g}, {:.6g}) m", p[0], p[1], p[2]);
  }
  return name;
}

}  // namespace

template <class Number, int kBlock>
SupernodalFactorOf<Number, kBlock>::SupernodalFactorOf(const BlockMatrixOf<kBlock>& matrix,
                                                       std::shared_ptr<const Elimination> elimination, int width,
                                                       const RowNames& names, std::shared_ptr<MachineMemory> machine)
    : elimination_(std::move(elimination)), width_(width), stride_(width), machine_(std::move(machine)) {
  const auto prepare = [&] {
    const auto& e = *elimination_;
    const std::size_t supernodes = e.first.size() - 1;
    supernode_of_.resize(e.order.size());
    begin_.assign(1, 0);
    for (std::size_t s = 0; s < supernodes; ++s) {
      std::fill(supernode_of_.begin() + e.first[s], supernode_of_.begin() + e.first[s + 1],
                static_cast<std::int32_t>(s));
      begin_.push_back(begin_.back() +
                       supernode_numbers(e.first[s + 1] - e.first[s], e.row_begin[s + 1] - e.row_begin[s], kBlock));
    }
    for (std::size_t s = 0; s < supernodes; ++s)
      parent_.push_back(e.row_begin[s] < e.row_begin[s + 1] ? supernode_of_[e.rows[e.row_begin[s]]] : -1);
    touched_.resize(supernodes);
    in_place_ = kSameRows && std::is_sorted(e.order.begin(), e.order.end());
    constexpr int kCacheLine = 64 / static_cast<int>(sizeof(Number));
    if (!in_place_) {
      stride_ = (width + kCacheLine - 1) / kCacheLine * kCacheLine;
      work_ = make_column_buffer<Number>(kBlock * static_cast<std::int64_t>(e.order.size()), stride_);
    }
  };
  if (machine_)  // whatever may fail on one rank alone comes before the ranks depend on one another
    machine_->allocate_together(prepare);
  else
    prepare();
  compute(matrix, names);
}

template <class Number, int kBlock>
void SupernodalFactorOf<Number, kBlock>::allocate(std::int64_t numbers) {
  if (machine_) {
    machine_->allocate(numbers * static_cast<std::int64_t>(sizeof(Number)));
    values_ = static_cast<Number*>(machine_->data());
  } else {
    own_values_ = make_column_buffer<Number>(numbers, 1);
    values_ = own_values_.get();
  }
}

template <class Number, int kBlock>
void SupernodalFactorOf<Number, kBlock>::compute(const BlockMatrixOf<kBlock>& matrix, const RowNames& names) {
  try {
    allocate(factoring_numbers(*elimination_).rectangles);
    factorise(matrix, *elimination_, values_, machine_.get());
    if (!machine_) {
      pack();
    } else {
      machine_->allocate_together([&] {
        if (machine_->rank() == 0) pack();
      });
      reciprocal_condition_ = machine_->first(reciprocal_condition_);
    }
  } catch (const WrongPivot& wrong) {
    throw OperationError(
        fmt::format("the stiffness matrix is not positive definite to working precision: the factorisation fails at {}",
                    name_of(wrong.row, names)));
  } catch (const std::bad_alloc&) {
    throw OperationError(fmt::format(
        "the factor of {} degrees of freedom ({:.3g} GB) cannot be computed: memory ran out; try \"-- -column_pc_type "
        "multigrid\" or a coarser mesh",
        3 * static_cast<std::int64_t>(matrix.rows), 1e-9 * sizeof(Number) * static_cast<double>(begin_.back())));
  }
  shrink();
}

// Converts the rectangles into the panels of the kernels. Works in place, panel by panel, because the panels up to any column take
// no more numbers than the rectangle's columns up to there.
template <class Number, int kBlock>
void SupernodalFactorOf<Number, kBlock>::pack() {
  constexpr std::int64_t kPanel = kBlock * panel_blocks(kBlock);
  const auto& e = *elimination_;
  double least = INFINITY, largest = 0;
  std::vector<Number> columns_of_panel;
  const Number* from = values_;
  for (std::size_t s = 0; s + 1 < e.first.size(); ++s) {
    const std::int64_t columns = kBlock * static_cast<std::int64_t>(e.first[s + 1] - e.first[s]);
    const std::int64_t height = columns + kBlock * (e.row_begin[s + 1] - e.row_begin[s]);
    Number* to = values_ + begin_[s];
    for (std::int64_t panel = 0; panel < columns; panel += kPanel) {
      const std::int64_t wide = std::min(kPanel, columns - panel);
      columns_of_panel.assign(from, from + wide * height);
      from += wide * height;
      for (std::int64_t row = panel; row < height; ++row)
        for (std::int64_t c = 0; c < wide; ++c)
          *to++ = panel + c <= row ? columns_of_panel[c * height + row] : Number(0);
      Number* diagonal = to - (height - panel) * wide;
      for (std::int64_t c = 0; c < wide; ++c, diagonal += wide + 1) {
        const double value = *diagonal;
        if (kBlock == 3 || c % 4 != 3) least = std::min(least, value), largest = std::max(largest, value);
        *diagonal = 1 / *diagonal;
      }
    }
  }
  reciprocal_condition_ = largest > 0 ? (least / largest) * (least / largest) : 1;
}

// Gives back what the rectangles took beyond the panels.
template <class Number, int kBlock>
void SupernodalFactorOf<Number, kBlock>::shrink() {
  const auto numbers = std::max<std::int64_t>(begin_.back(), 1);
  if (machine_) return machine_->shrink(numbers * static_cast<std::int64_t>(sizeof(Number)));
  Number* values = own_values_.release();
  void* shrunk = std::realloc(values, static_cast<std::size_t>(numbers) * sizeof(Number));
  own_values_.reset(static_cast<Number*>(shrunk ? shrunk : values));
  values_ = own_values_.get();
}

template <class Number, int kBlock>
std::string SupernodalFactorOf<Number, kBlock>::description() const {
  return fmt::format("supernodal ({} factor{})", kBlock == 3 ? "Cholesky" : "quasi-definite",
                     sizeof(Number) == sizeof(float) ? " in single precision" : "");
}

// The batch in elimination order, where it is solved.
template <class Number, int kBlock>
Number* SupernodalFactorOf<Number, kBlock>::batch(double* of_caller) const {
  if constexpr (kSameRows)
    if (in_place_) return of_caller;
  return work_.get();
}

template <class Number, int kBlock>
void SupernodalFactorOf<Number, kBlock>::apply(const double* r, double* z) {
  const auto places = static_cast<std::int32_t>(elimination_->order.size());
  Number* y = batch(z);
  std::fill(touched_.begin(), touched_.end(), 0);
  for (std::int32_t place = 0; place < places; ++place) {
    const double* from = r + elimination_->order[place] * (3 * static_cast<std::int64_t>(width_));
    Number* to = y + place * (kBlock * static_cast<std::int64_t>(stride_));
    for (int i = 0; i < 3; ++i) {
      std::copy_n(from + i * width_, width_, to + i * stride_);
      std::fill(to + i * stride_ + width_, to + (i + 1) * stride_, Number(0));
    }
    if (kBlock == 4) std::fill_n(to + 3 * stride_, stride_, Number(0));
    if (!touched_[supernode_of_[place]])
      touched_[supernode_of_[place]] = std::any_of(from, from + 3 * width_, [](double value) { return value != 0; });
  }
  touch_ancestors();
  solve_triangles(y);
  to_caller(y, z);
}

template <class Number, int kBlock>
bool SupernodalFactorOf<Number, kBlock>::apply_to_loads(std::span<const Load> loads, double* x) {
  const auto& e = *elimination_;
  const auto run = kBlock * static_cast<std::int64_t>(stride_);
  Number* y = batch(x);
  std::fill(touched_.begin(), touched_.end(), 0);
  for (const auto& load : loads) touched_[supernode_of_[e.place[load.dof / 3]]] = 1;
  touch_ancestors();
  for (std::size_t s = 0; s < touched_.size(); ++s)
    if (touched_[s]) std::fill(y + e.first[s] * run, y + e.first[s + 1] * run, Number(0));
  for (const auto& load : loads)
    y[e.place[load.dof / 3] * run + load.dof % 3 * stride_ + load.column] += static_cast<Number>(load.value);
  solve_triangles(y);
  to_caller(y, x);
  return true;
}

template <class Number, int kBlock>
void SupernodalFactorOf<Number, kBlock>::touch_ancestors() {
  for (std::size_t s = 0; s < touched_.size(); ++s)
    if (touched_[s] && parent_[s] >= 0) touched_[parent_[s]] = 1;
}

// y: in elimination order. Forward, then backward substitution; the rows of supernodes that are not touched count as zero and
// are not read before they are written.
template <class Number, int kBlock>
void SupernodalFactorOf<Number, kBlock>::solve_triangles(Number* y) const {
  const auto& e = *elimination_;
  const SupernodalKernels<Number> kernels = supernodal_kernels<Number>(kBlock);
  const auto part = [&](std::size_t s) {
    return Supernode<Number>{e.first[s], e.first[s + 1] - e.first[s],
                             static_cast<std::int32_t>(e.row_begin[s + 1] - e.row_begin[s]),
                             e.rows.data() + e.row_begin[s], values_ + begin_[s]};
  };
  for (std::size_t s = 0; s < touched_.size(); ++s)
    if (touched_[s]) kernels.forward(part(s), y, stride_);
  for (std::size_t s = touched_.size(); s-- > 0;) kernels.backward(part(s), !touched_[s], y, stride_);
}

template <class Number, int kBlock>
void SupernodalFactorOf<Number, kBlock>::to_caller(const Number* y, double* x) const {
  if (in_place_) return;
  for (std::size_t place = 0; place < elimination_->order.size(); ++place)
    for (int i = 0; i < 3; ++i)
      std::copy_n(y + (kBlock * static_cast<std::int64_t>(place) + i) * stride_, width_,
                  x + (3 * static_cast<std::int64_t>(elimination_->order[place]) + i) * width_);
}

template class SupernodalFactorOf<double, 3>;
template class SupernodalFactorOf<double, 4>;
template class SupernodalFactorOf<float, 3>;
template class SupernodalFactorOf<float, 4>;

}  // namespace palpate
