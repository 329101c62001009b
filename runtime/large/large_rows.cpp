#include "runtime/large/large_rows.h"

#include <algorithm>
#include <cmath>

#include "runtime/large/vector_loops.h"

namespace palpate {
namespace {

// Added to the diagonal of C, as a share: contacts that conflict keep finite forces, and C in single precision stays definite.
constexpr double kContactShift = 1e-6;

}  // namespace

bool BodyMove::create(SceneMemory& memory, std::size_t length, std::int32_t rows) {
  for (float** vector : {&move, &of_metric, &of_tangent}) *vector = memory.array<float>(length);
  local = memory.array<double>(static_cast<std::size_t>(rows));
  return !memory.failed();
}

void BodyMove::keep(SceneMemory& memory, std::size_t length, std::int32_t rows) {
  for (float** vector : {&move, &of_metric, &of_tangent}) memory.keep_array(*vector, length);
  memory.keep_array(local, static_cast<std::size_t>(rows));
}

bool LargeRows::create(SceneMemory& memory, const HyperelasticEnergy* energy, const BodyMetric* metric,
                       std::int32_t most_rows, std::int32_t most_nodes) {
  energy_ = energy, metric_ = metric;
  most_rows_ = most_rows, most_nodes_ = most_nodes, most_spots_ = (most_rows + 2) / 3;
  const auto most = static_cast<std::size_t>(most_rows), nodes = static_cast<std::size_t>(most_nodes),
             spots = static_cast<std::size_t>(most_spots_);
  stride_ = (most + 7) / 8 * 8;
  for (Taken* taken : {&now_, &next_}) {
    taken->row = memory.array<LargeRow>(most), taken->spots = memory.array<Spot>(spots);
    taken->place = memory.array<std::int32_t>(nodes), taken->weight = memory.array<double>(nodes);
  }
  row_spot_ = memory.array<std::int32_t>(most), slot_used_ = memory.array<bool>(spots);
  responses_ = memory.array<float>(3 * spots * energy->length());
  if (metric->renews()) rest_responses_ = memory.array<float>(3 * spots * energy->length());
  if (!columns_.create(memory, energy, metric, metric->renews() ? 0 : most_nodes)) return false;
  generation_ = memory.array<std::int32_t>(spots), largest_response_ = memory.array<double>(3 * spots);
  for (double** matrix : {&between_spots_, &contact_, &beside_}) *matrix = memory.array<double>(most * stride_);
  holds_ = memory.array<std::uint8_t>(most), applied_ = memory.array<double>(most);
  work_ = memory.array<double>(most);
  return compliance_.create(memory, most_rows) && !memory.failed();
}

void LargeRows::keep(SceneMemory& memory) {
  const auto rows = static_cast<std::size_t>(most_rows_), nodes = static_cast<std::size_t>(most_nodes_);
  memory.keep(state_);
  memory.keep_array(now_.row, rows), memory.keep_array(now_.place, nodes), memory.keep_array(now_.weight, nodes);
  memory.keep_array(now_.spots, static_cast<std::size_t>(most_spots_));
  memory.keep_array(generation_, static_cast<std::size_t>(most_spots_));
  memory.keep_array(holds_, rows), memory.keep_array(applied_, rows);
  memory.keep_array(beside_, rows * stride_, state_.count, stride_);
  columns_.keep(memory);
}

void LargeRows::restored() {
  for (std::int32_t i = 0; i < state_.spot_count; ++i) {
    const Spot& spot = now_.spots[i];
    if (!spot.joined) std::fill(row_spot_ + spot.row, row_spot_ + spot.row + spot.rows, i);
  }
  const NodeColumns::Known known = columns_.known();
  find_all_responses();
  columns_.know(known);
  solves_ = 0;
}

void LargeRows::forget() {
  state_.count = state_.spot_count = 0;
  columns_.forget();
}

void LargeRows::find_all_responses() {
  columns_.forget();
  WaitingSpots waiting;
  for (std::int32_t i = 0; i < state_.spot_count; ++i) wait_for_responses(now_.spots[i], waiting);
  find_waiting_responses(waiting);
  measure_spots();
  fill_compliance();
  factor();
}

void LargeRows::find_other_responses() {
  for (std::int32_t i = 0; i < state_.spot_count; ++i) ++generation_[now_.spots[i].slot];
  find_all_responses();
}

// ---- what rows do to the body and feel of it -----------------------------------------------------------------------

void LargeRows::on_spot(const Spot& spot, const float* field, double sum[3]) const {
  for (int i = 0; i < 3; ++i) sum[i] = 0;
  for (std::int32_t e = spot.first; e < spot.first + spot.count; ++e) {
    if (now_.place[e] >= energy_->rows()) continue;  // held
    const float* const at = field + 3 * static_cast<std::size_t>(now_.place[e]);
    for (int i = 0; i < 3; ++i) sum[i] += now_.weight[e] * static_cast<double>(at[i]);
  }
}

double LargeRows::on_row(std::int32_t r, const float* field) const {
  double on = 0;
  for_spots(r, [&](std::int32_t i, const double* d) {
    double sum[3];
    on_spot(now_.spots[i], field, sum);
    on += d[0] * sum[0] + d[1] * sum[1] + d[2] * sum[2];
  });
  return on;
}

// field += W^T force
void LargeRows::add_rows(const double* force, float* field) const {
  for (std::int32_t i = 0; i < state_.spot_count; ++i) {
    const Spot& spot = now_.spots[i];
    double sum[3] = {};
    for (std::int32_t r = spot.row; r < spot.row + spot.rows; ++r)
      for (int d = 0; d < 3; ++d) sum[d] += force[r] * along(spot, r)[d];
    for (std::int32_t e = spot.first; e < spot.first + spot.count; ++e) {
      if (now_.place[e] >= energy_->rows()) continue;
      float* const at = field + 3 * static_cast<std::size_t>(now_.place[e]);
      for (int d = 0; d < 3; ++d) at[d] += static_cast<float>(now_.weight[e] * sum[d]);
    }
  }
  energy_->clear_held(field);
}

template <class Column>
void LargeRows::add_columns_of(const double* force, double factor, float* field, Column column) const {
  for (std::int32_t i = 0; i < state_.spot_count; ++i) {
    const Spot& spot = now_.spots[i];
    for (int d = 0; d < 3; ++d) {
      double sum = 0;
      for (std::int32_t r = spot.row; r < spot.row + spot.rows; ++r) sum += force[r] * along(spot, r)[d];
      if (sum != 0) add_multiple(static_cast<float>(factor * sum), column(spot, d), energy_->length(), field);
    }
  }
}

// field += factor Y force
void LargeRows::add_responses(const double* force, double factor, float* field) const {
  add_columns_of(force, factor, field, [&](const Spot& spot, int axis) { return response(spot, axis); });
}
// The same with Y at rest, where no volume is held.
void LargeRows::add_rest_responses(const double* force, double factor, float* field) const {
  add_columns_of(force, factor, field, [&](const Spot& spot, int axis) { return rest_response(spot, axis); });
  const HeldVolumes& held = metric_->held();
  if (rest_responses_ || held.count() == 0) return;
  double amounts[kMostOffsetRows] = {};
  for (std::int32_t i = 0; i < held.count(); ++i)
    for (std::int32_t r = 0; r < state_.count; ++r) amounts[i] -= factor * force[r] * on_row(r, held.response(i));
  held.solve(amounts);
  held.after(amounts, field);
}

// Y^T force of the rows of one spot after the other.
void LargeRows::responses_times(const float* force, double* out) const {
  for (std::int32_t i = 0; i < state_.spot_count; ++i) {
    const Spot& spot = now_.spots[i];
    if (!spot.joined) std::fill(out + spot.row, out + spot.row + spot.rows, 0.0);
    for (int d = 0; d < 3; ++d) {
      bool used = false;
      for (std::int32_t r = spot.row; r < spot.row + spot.rows; ++r) used = used || along(spot, r)[d] != 0;
      if (!used) continue;
      const double product = dot_product(response(spot, d), force, energy_->length());
      for (std::int32_t r = spot.row; r < spot.row + spot.rows; ++r) out[r] += along(spot, r)[d] * product;
    }
  }
}

double LargeRows::work_of_applied(const float* move) const {
  double work = 0;
  for (std::int32_t r = 0; r < state_.count; ++r)
    if (applied_[r] != 0) work += applied_[r] * on_row(r, move);
  return work;
}

void LargeRows::project(float* p, double* local, float* of_metric) {
  if (state_.count == 0) return;
  compliance_times(local, work_);
  for (std::int32_t r = 0; r < state_.count; ++r) work_[r] += holds_[r] ? on_row(r, p) : 0;
  solve(work_);
  add_responses(work_, -1, p);
  for (std::int32_t r = 0; r < state_.count; ++r) local[r] -= work_[r], work_[r] = -work_[r];
  add_rows(work_, of_metric);
}

void LargeRows::response_at(const double* force, std::int32_t first, std::int32_t end, std::int32_t node,
                            double out[3]) const {
  const std::int32_t place = energy_->places()[node];
  for (int c = 0; c < 3; ++c) out[c] = 0;
  for (std::int32_t r = first; r < end && place < energy_->rows(); ++r) {
    if (force[r] == 0) continue;
    for_spots(r, [&](std::int32_t i, const double* direction) {
      for (int d = 0; d < 3; ++d) {
        if (direction[d] == 0) continue;
        const float* const at = response(now_.spots[i], d) + 3 * static_cast<std::size_t>(place);
        for (int c = 0; c < 3; ++c) out[c] += force[r] * direction[d] * static_cast<double>(at[c]);
      }
    });
  }
}

double LargeRows::response_bound(const double* force, std::int32_t first, std::int32_t end) const {
  double sum = 0;
  for (std::int32_t r = first; r < end; ++r)
    for_spots(r, [&](std::int32_t i, const double* direction) {
      for (int d = 0; d < 3; ++d)
        sum += std::abs(force[r] * direction[d]) * largest_response_[3 * now_.spots[i].slot + d];
    });
  return sum;
}

void LargeRows::response_on_rows(const double* force, double* out) const {
  for (std::int32_t r = 0; r < state_.count; ++r) {
    const double* const c = compliance_.row(r);
    out[r] = 0;
    for (std::int32_t k = 0; k < state_.count; ++k) out[r] += c[k] * force[k];
    for (std::int32_t k = 0; k < 3 && now_.row[r].group + k < state_.count; ++k)
      out[r] -= now_.row[r].compliance[k] * force[now_.row[r].group + k];
    for (std::int32_t k = 0; state_.has_beside && k < state_.count; ++k) out[r] -= beside(r, k) * force[k];
  }
}

double LargeRows::spot_response_bound(std::int32_t r, const double* force) const {
  const double* const largest = largest_response_ + 3 * static_cast<std::size_t>(spot_of(r).slot);
  return std::abs(force[0]) * largest[0] + std::abs(force[1]) * largest[1] + std::abs(force[2]) * largest[2];
}

// ---- the rows of a step --------------------------------------------------------------------------------------------

LargeRows::Changed LargeRows::take(const LargeContacts& contacts, double** local, double** other_local) {
  const bool spots = take_spots(contacts, *local, *other_local);
  std::swap(*local, *other_local);
  const bool rows = take_rows(contacts, spots);
  std::swap(now_, next_);
  return {spots, rows};
}

bool LargeRows::same_spot(const LargeContacts& contacts, const Spot& now, const Spot& before) const {
  if (now.count != before.count) return false;
  for (std::int32_t e = 0; e < now.count; ++e)
    if (energy_->places()[contacts.nodes[now.first + e]] != now_.place[before.first + e] ||
        contacts.weights[now.first + e] != now_.weight[before.first + e])
      return false;
  return true;
}

// One spot, whose nodes and weights are those of `contacts` from of.first on. *entries: of next_, so far.
void LargeRows::take_spot(const LargeContacts& contacts, const Spot& of, std::int32_t* entries, const double* local,
                          double* other_local, bool* changed) {
  Spot& spot = next_.spots[next_count_];
  spot = of, spot.first = *entries;
  for (std::int32_t i = 0; i < state_.spot_count; ++i) {
    const std::int32_t k = (next_count_ + i) % state_.spot_count;  // most stand where they stood
    const Spot& before = now_.spots[k];
    if (slot_used_[before.slot] || !same_spot(contacts, of, before)) continue;
    spot.slot = before.slot, slot_used_[before.slot] = true;
    const bool alike = before.rows == spot.rows && before.joined == spot.joined;
    if (alike && !spot.joined) std::copy(local + before.row, local + before.row + before.rows, other_local + spot.row);
    *changed = *changed || k != next_count_ || !alike || !std::equal(of.direction, of.direction + 3, before.direction);
    break;
  }
  *changed = *changed || spot.slot < 0;
  for (std::int32_t e = of.first; e < of.first + of.count; ++e, ++*entries)
    next_.place[*entries] = energy_->place(contacts.nodes[e]), next_.weight[*entries] = contacts.weights[e];
  ++next_count_;
}

// Spots that were there in the last step keep their responses and the local displacements of their rows. True where spots have changed.
bool LargeRows::take_spots(const LargeContacts& contacts, const double* local, double* other_local) {
  std::int32_t entries = 0;
  bool changed = false;
  const LargeJoin *join = contacts.joins, *const last = contacts.joins + contacts.join_count;
  next_count_ = 0;
  std::fill(slot_used_, slot_used_ + most_spots_, false);
  for (std::int32_t r = 0, end = 0; r < contacts.row_count; r = end) {
    const LargeRow& first = contacts.rows[r];
    while (end < contacts.row_count && contacts.rows[end].group == first.group) ++end;
    for (std::int32_t i = r; i < end; ++i) other_local[i] = contacts.start ? contacts.start[i] : 0;
    take_spot(contacts, {first.first, first.count, r, end - r, -1, 0, {}}, &entries, local, other_local, &changed);
    for (; join != last && join->row == r; ++join) {
      const double* const d = join->direction;
      take_spot(contacts, {join->first, join->count, r, 1, -1, 1, {d[0], d[1], d[2]}}, &entries, local, other_local,
                &changed);
    }
  }
  changed = changed || next_count_ != state_.spot_count;
  state_.spot_count = next_count_;
  return changed;
}

// True where rows have changed, or spots had.
bool LargeRows::take_rows(const LargeContacts& contacts, bool changed) {
  changed = changed || contacts.row_count != state_.count;
  for (std::int32_t r = 0; r < contacts.row_count; ++r) {
    const LargeRow &from = contacts.rows[r], &before = now_.row[r];
    for (int i = 0; i < 3 && !changed; ++i)
      changed = from.direction[i] != before.direction[i] || from.compliance[i] != before.compliance[i];
    next_.row[r] = from;
  }
  changed = take_beside(contacts) || changed;
  state_.count = contacts.row_count;
  return changed;
}

bool LargeRows::take_beside(const LargeContacts& contacts) {
  const std::int32_t has = contacts.beside ? 1 : 0;
  bool changed = state_.has_beside != has;
  state_.has_beside = has;
  for (std::int32_t r = 0; has && r < contacts.row_count; ++r) {
    const double* const from = contacts.beside + static_cast<std::size_t>(r) * contacts.beside_stride;
    double* const to = beside_ + static_cast<std::size_t>(r) * stride_;
    changed = changed || !std::equal(from, from + contacts.row_count, to);
    std::copy(from, from + contacts.row_count, to);
  }
  return changed;
}

void LargeRows::find_new_responses() {
  std::int32_t free_slot = 0;
  WaitingSpots waiting;
  for (std::int32_t i = 0; i < state_.spot_count; ++i) {
    Spot& spot = now_.spots[i];
    if (!spot.joined) std::fill(row_spot_ + spot.row, row_spot_ + spot.row + spot.rows, i);
    if (spot.slot >= 0) continue;
    while (slot_used_[free_slot]) ++free_slot;
    spot.slot = free_slot, slot_used_[free_slot] = true;
    ++generation_[free_slot];
    wait_for_responses(spot, waiting);
  }
  find_waiting_responses(waiting);
  measure_spots();
}

// y: a unit force on a spot along an axis.
void LargeRows::load(const Spot& spot, int axis, float* y) const {
  std::fill(y, y + energy_->length(), 0.0f);
  for (std::int32_t e = spot.first; e < spot.first + spot.count; ++e)
    if (now_.place[e] < energy_->rows())
      y[3 * static_cast<std::size_t>(now_.place[e]) + static_cast<std::size_t>(axis)] +=
          static_cast<float>(now_.weight[e]);
  energy_->clear_held(y);
}

// Spots are solved kSpotsAtOnce together.
// Those of a place in a triangle or a tetrahedron are sums of those of its nodes, which it shares with where it was and will be.
void LargeRows::wait_for_responses(const Spot& spot, WaitingSpots& waiting) {
  Waiting& list = !rest_responses_ && (spot.count == 3 || spot.count == 4) ? waiting.sliding : waiting.standing;
  list.spots[list.count++] = &spot;
  if (list.count == kSpotsAtOnce) find_waiting_responses(waiting);
}

void LargeRows::find_waiting_responses(WaitingSpots& waiting) {
  if (waiting.standing.count > 0) find_responses(waiting.standing.spots, waiting.standing.count);
  if (waiting.sliding.count > 0) sum_responses(waiting.sliding.spots, waiting.sliding.count);
  waiting.standing.count = waiting.sliding.count = 0;
}

void LargeRows::sum_responses(const Spot* const* spots, int count) {
  std::int32_t places[NodeColumns::kMostNodes] = {}, nodes = 0;
  static_assert(4 * kSpotsAtOnce <= NodeColumns::kMostNodes);
  for (int k = 0; k < count; ++k)
    for (std::int32_t e = spots[k]->first; e < spots[k]->first + spots[k]->count; ++e) places[nodes++] = now_.place[e];
  solves_ += columns_.find(places, nodes);
  for (int v = 0; v < 3 * count; ++v) {
    const Spot& spot = *spots[v / 3];
    float* const y = response(spot, v % 3);
    std::fill(y, y + energy_->length(), 0.0f);
    for (std::int32_t e = spot.first; e < spot.first + spot.count; ++e)
      if (now_.place[e] < energy_->rows())
        add_multiple(static_cast<float>(now_.weight[e]), columns_.column(now_.place[e], v % 3), energy_->length(), y);
  }
  for (int k = 0; k < count; ++k) measure_longest(*spots[k]);
}

// Of kSpotsAtOnce spots at most: one solve reads the factor from memory for all of them.
void LargeRows::find_responses(const Spot* const* spots, int count) {
  float *at_rest[BodyMetric::kMostVectors], *of_metric[BodyMetric::kMostVectors];
  const int vectors = 3 * count;
  const std::size_t length = energy_->length();
  for (int v = 0; v < vectors; ++v) {
    at_rest[v] = rest_response(*spots[v / 3], v % 3), of_metric[v] = response(*spots[v / 3], v % 3);
    load(*spots[v / 3], v % 3, at_rest[v]);
  }
  if (rest_responses_) {
    const bool differ = metric_->is_renewed() || metric_->held().count() > 0;
    for (int v = 0; v < vectors && differ; ++v) std::copy(at_rest[v], at_rest[v] + length, of_metric[v]);
    metric_->solve_at_rest(at_rest, vectors);
    if (differ) metric_->solve(of_metric, vectors);
    for (int v = 0; v < vectors && !differ; ++v) std::copy(at_rest[v], at_rest[v] + length, of_metric[v]);
  } else {
    metric_->solve(of_metric, vectors);
  }
  for (int k = 0; k < count; ++k) measure_longest(*spots[k]);
  solves_ += vectors;
}

void LargeRows::measure_longest(const Spot& spot) {
  for (int d = 0; d < 3; ++d) {
    double& largest = largest_response_[3 * spot.slot + d];
    largest = 0;
    for (std::int32_t n = 0; n < energy_->rows(); ++n) {
      const float* const at = response(spot, d) + 3 * static_cast<std::size_t>(n);
      largest = std::max(largest, static_cast<double>(at[0] * at[0] + at[1] * at[1] + at[2] * at[2]));
    }
    largest = std::sqrt(largest);
  }
}

double LargeRows::most_softening() const {
  double most = 1;
  for (std::int32_t i = 0; rest_responses_ && i < state_.spot_count; ++i) {
    double now = 0, at_rest = 0;
    for (int d = 0; d < 3; ++d) {
      double sum[3];
      on_spot(now_.spots[i], response(now_.spots[i], d), sum), now += sum[d];
      on_spot(now_.spots[i], rest_response(now_.spots[i], d), sum), at_rest += sum[d];
    }
    if (!(now <= most * at_rest)) most = at_rest > 0 ? now / at_rest : most;
  }
  return most;
}

// W Y between all spots, symmetric.
void LargeRows::measure_spots() {
  for (std::int32_t i = 0; i < state_.spot_count; ++i)
    for (std::int32_t j = 0; j < state_.spot_count; ++j)
      for (int d = 0; d < 3; ++d) {
        double sum[3];
        on_spot(now_.spots[i], response(now_.spots[j], d), sum);
        for (int c = 0; c < 3; ++c)
          between_spots_[static_cast<std::size_t>(3 * i + c) * stride_ + static_cast<std::size_t>(3 * j + d)] = sum[c];
      }
}

// C of all rows. False where a number is not finite.
bool LargeRows::fill_compliance() {
  bool finite = true;
  for (std::int32_t i = 0; i < state_.count; ++i)
    for (std::int32_t j = 0; j <= i; ++j) {
      double sum = 0;
      for_spots(i, [&](std::int32_t of_i, const double* a) {
        for_spots(j, [&](std::int32_t of_j, const double* b) {
          for (int c = 0; c < 3; ++c)
            for (int d = 0; d < 3; ++d) sum += a[c] * b[d] * between_spots(3 * of_i + c, 3 * of_j + d);
        });
      });
      const std::int32_t k = j - now_.row[i].group;
      if (k >= 0 && k < 3) sum += now_.row[i].compliance[k];
      if (state_.has_beside) sum += beside(i, j);
      finite = finite && std::isfinite(sum);
      compliance_.entry(i, j) = compliance_.entry(j, i) = sum;
    }
  compliance_.rows_end = state_.count;
  for (std::int32_t r = 0; r < state_.count; ++r)
    compliance_.scale[r] = compliance_.entry(r, r) > 0 ? 1 / std::sqrt(compliance_.entry(r, r)) : 0;
  return finite;
}

void LargeRows::between(std::int32_t r, std::int32_t part, std::int32_t k, std::int32_t other_part, double* out) const {
  for (int c = 0; c < 3; ++c)
    for (int d = 0; d < 3; ++d)
      out[3 * c + d] = between_spots(3 * (row_spot_[r] + part) + c, 3 * (row_spot_[k] + other_part) + d);
}

// L a, of the rows that hold and by these alone.
void LargeRows::compliance_times(const double* a, double* out) const {
  for (std::int32_t r = 0; r < state_.count; ++r) {
    const LargeRow& row = now_.row[r];
    out[r] = 0;
    for (std::int32_t k = 0; holds_[r] && k < 3 && row.group + k < state_.count; ++k)
      out[r] += holds_[row.group + k] ? row.compliance[k] * a[row.group + k] : 0;
    for (std::int32_t k = 0; state_.has_beside && holds_[r] && k < state_.count; ++k)
      out[r] += holds_[k] ? beside(r, k) * a[k] : 0;
  }
}
double LargeRows::times_compliance(const double* a, const double* b) const {
  double sum = 0;
  for (std::int32_t r = 0; r < state_.count; ++r) {
    const LargeRow& row = now_.row[r];
    for (std::int32_t k = 0; holds_[r] && k < 3 && row.group + k < state_.count; ++k)
      if (holds_[row.group + k]) sum += a[r] * row.compliance[k] * b[row.group + k];
    for (std::int32_t k = 0; state_.has_beside && holds_[r] && k < state_.count; ++k)
      if (holds_[k]) sum += a[r] * beside(r, k) * b[k];
  }
  return sum;
}

// Rows that do not hold stand in the factor as those of the identity.
bool LargeRows::factor() {
  const auto at = [&](std::int32_t i, std::int32_t j) -> double& {
    return contact_[static_cast<std::size_t>(i) * stride_ + static_cast<std::size_t>(j)];
  };
  for (std::int32_t i = 0; i < state_.count; ++i) {
    for (std::int32_t j = 0; j <= i; ++j)
      at(i, j) = holds_[i] && holds_[j] ? compliance_.entry(i, j) : (i == j ? 1 : 0);
    at(i, i) *= 1 + kContactShift;
  }
  for (std::int32_t j = 0; j < state_.count; ++j) {
    double pivot = at(j, j);
    for (std::int32_t k = 0; k < j; ++k) pivot -= at(j, k) * at(j, k);
    // A row that others determine, to rounding, or one on held nodes alone.
    const double least = kContactShift * at(j, j);
    at(j, j) = std::sqrt(pivot > least ? pivot : std::max(least, 1e-30));
    for (std::int32_t i = j + 1; i < state_.count; ++i) {
      double sum = at(i, j);
      for (std::int32_t k = 0; k < j; ++k) sum -= at(i, k) * at(j, k);
      at(i, j) = sum / at(j, j);
    }
    if (!std::isfinite(at(j, j))) return false;
  }
  return true;
}

// x: zero for rows that do not hold.
void LargeRows::solve(double* x) const {
  const auto row = [&](std::int32_t i) { return contact_ + static_cast<std::size_t>(i) * stride_; };
  for (std::int32_t i = 0; i < state_.count; ++i) {
    for (std::int32_t k = 0; k < i; ++k) x[i] -= row(i)[k] * x[k];
    x[i] /= row(i)[i];
  }
  for (std::int32_t i = state_.count - 1; i >= 0; --i) {
    x[i] /= row(i)[i];
    for (std::int32_t k = 0; k < i; ++k) x[k] -= row(i)[k] * x[i];
  }
}

}  // namespace palpate
