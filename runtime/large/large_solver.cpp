#include "runtime/large/large_solver.h"

#include <algorithm>
#include <cmath>

#include "runtime/large/vector_loops.h"

namespace palpate {
namespace {

// Below this share of the largest energy since rest a body without contacts is at rest: its displacements are 1e-5 of the largest.
constexpr double kRestEnergy = 1e-10;
// Added to the diagonal of C, as a share: contacts that conflict keep finite forces, and C in single precision stays definite.
constexpr double kContactShift = 1e-6;
// Rounding of the energy in single precision, as a share.
constexpr double kEnergyRounding = 1e-6;
// Of the method, at targets that stand still, to kStillTolerance; after them the state counts as solved.
constexpr std::int32_t kMostStillSteps = 400;
// A step that is given up leaves the next one a fourth of its reach. After one with this reach or less the next step does not move at all: it
// brings the body nearer to its solution where it is.
constexpr double kLeastReach = 1.0 / 1024;
// The same of the energy of a preload, from which all others are counted.
constexpr double kEnergyNoise = 2e-7;
// Bounds of gamma: of the initial matrix, in tissue that has stiffened; and of what a residual is divided by, because there K^-1 tells too much.
constexpr double kLeastScale = 1e-4, kLeastTold = 0.02;
// A search ends at this share. Without pairs gamma is 1, and a step in K^-1 some 10^4 times too long where tissue has stiffened.
constexpr double kLeastShare = 1e-6;
// The rest state under a preload is solved to this share, where a step is to LargeSolver::kTolerance.
constexpr double kRestTolerance = 1e-4;
// It counts as found from this share on, where rounding in single precision lets it come no nearer: its force is then the load's but for
// about as much.
constexpr double kRestEnough = 2e-3;

// N/m, that assemble_stiffness gave the single held dofs; 0 where there are none.
double held_diagonal(const BlockRows& stiffness, const HyperelasticBody& body, const std::int32_t* place) {
  for (std::int32_t n = 0; n < body.node_count; ++n)
    for (int i = 0; i < 3; ++i)
      if (place[n] < stiffness.rows && body.fixed[3 * static_cast<std::size_t>(n) + static_cast<std::size_t>(i)])
        return stiffness.block[9 * stiffness.index_of(place[n], place[n]) + 4 * i];
  return 0;
}

void evaluate_plainly(const ElementLanes<EightFloats>& elements, const float* u, float* f,
                      ElementLanes<EightFloats>::Energy* energy) {
  *energy = elements.evaluate(u, f);
}
#ifdef PALPATE_DISPATCHES
__attribute__((target(PALPATE_AVX2))) void evaluate_with_avx2(const ElementLanes<EightFloats>& elements, const float* u,
                                                              float* f, ElementLanes<EightFloats>::Energy* energy) {
  *energy = elements.evaluate(u, f);
}
#endif

}  // namespace

LargeSolver::Created LargeSolver::create(SceneMemory& memory, const HyperelasticBody& body, const std::int32_t* order,
                                         std::int32_t order_count, std::int32_t max_rows, std::int32_t max_nodes,
                                         const double* preload, bool renews, std::int64_t fewest_for_rough) {
  nodes_ = body.node_count, rows_ = order_count, max_rows_ = max_rows, max_nodes_ = max_nodes;
  const auto nodes = static_cast<std::size_t>(nodes_), rows = static_cast<std::size_t>(rows_);
  length_ = (3 * rows + kVectorStep - 1) / kVectorStep * kVectorStep;
  place_ = memory.array<std::int32_t>(nodes);
  SceneMemory scratch = memory.of_same_host();
  std::int32_t* const improved = scratch.array<std::int32_t>(rows);
  BlockRows stiffness;
  if (memory.failed() || scratch.failed()) return scratch.release_all(), Created::no_memory;
  std::fill(place_, place_ + nodes, -1);
  for (std::int32_t i = 0; i < order_count; ++i) place_[order[i]] = i;
  std::int32_t held_place = rows_;
  for (std::size_t n = 0; n < nodes; ++n)
    if (place_[n] < 0) place_[n] = held_place++;
  Created created = Created::no_memory;
  if (assemble_stiffness(scratch, body, place_, rows_, &stiffness) && postorder(scratch, stiffness, improved)) {
    for (std::size_t n = 0; n < nodes; ++n)
      if (place_[n] < rows_) place_[n] = improved[place_[n]];
    stiffness = {};
    if (assemble_stiffness(scratch, body, place_, rows_, &stiffness)) {
      const BlockFactor::Outcome outcome = factor_.create(memory, stiffness, fewest_for_rough);
      if (outcome == BlockFactor::Outcome::made) created = Created::made;
      if (preload && !take_load(memory, body, stiffness, preload)) created = Created::no_memory;
      if (outcome == BlockFactor::Outcome::not_definite) created = Created::not_definite;
      if (renews && created == Created::made && !prepare_renewals(memory, body, held_diagonal(stiffness, body, place_)))
        created = Created::no_memory;
    }
  }
  scratch.release_all();
  if (created != Created::made) return created;
  if (!elements_.create(memory, body, place_, rows_) || !take_supports(memory, body)) return Created::no_memory;

  held_ = memory.array<std::int32_t>(3 * rows);
  const std::size_t padded = std::max(3 * nodes, length_);
  u_ = memory.array<float>(padded), trial_ = memory.array<float>(padded);
  if (preload) base_ = memory.array<float>(padded), absolute_ = memory.array<float>(padded);
  u_before_ = memory.array<float>(padded);
  for (float** vector : {&f_, &trial_f_, &g_, &p_, &f_before_}) *vector = memory.array<float>(length_);
  const auto most = static_cast<std::size_t>(max_rows), most_nodes = static_cast<std::size_t>(max_nodes);
  for (int i = 0; i < kPairs; ++i) {
    moves_[i] = memory.array<float>(length_), changes_[i] = memory.array<float>(length_);
    local_moves_[i] = memory.array<double>(most);
  }
  max_spots_ = (max_rows + 2) / 3, stride_ = (most + 7) / 8 * 8;
  const auto most_spots = static_cast<std::size_t>(max_spots_);
  row_ = memory.array<LargeRow>(most), next_row_ = memory.array<LargeRow>(most);
  spots_ = memory.array<Spot>(most_spots), next_spots_ = memory.array<Spot>(most_spots);
  row_place_ = memory.array<std::int32_t>(most_nodes), next_place_ = memory.array<std::int32_t>(most_nodes);
  row_weight_ = memory.array<double>(most_nodes), next_weight_ = memory.array<double>(most_nodes);
  row_spot_ = memory.array<std::int32_t>(most), slot_used_ = memory.array<bool>(most_spots);
  responses_ = memory.array<float>(3 * most_spots * length_);
  if (renews) {
    rest_responses_ = memory.array<float>(3 * most_spots * length_);
    of_metric_ = memory.array<float>(padded), of_next_ = memory.array<float>(padded);
  }
  generation_ = memory.array<std::int32_t>(most_spots), largest_response_ = memory.array<double>(3 * most_spots);
  for (double** matrix : {&between_spots_, &contact_, &beside_}) *matrix = memory.array<double>(most * stride_);
  holds_ = memory.array<std::uint8_t>(most);
  for (double** vector : {&applied_, &local_, &next_local_, &multiplier_, &local_g_, &local_p_, &trial_local_, &work_,
                          &work2_, &local_before_})
    *vector = memory.array<double>(most);
  if (!compliance_.create(memory, max_rows) || memory.failed()) return Created::no_memory;
  for (std::size_t n = 0; n < nodes; ++n)
    for (int i = 0; i < 3; ++i)
      if (place_[n] < rows_ && body.fixed[3 * n + static_cast<std::size_t>(i)])
        held_[held_count_++] = 3 * place_[n] + i;
  forget();
  if (preload && !find_rest()) return Created::no_equilibrium;
  keep(memory);
  return Created::made;
}

bool LargeSolver::take_supports(SceneMemory& memory, const HyperelasticBody& body) {
  const auto count = static_cast<std::size_t>(body.support_count);
  support_place_ = memory.array<std::int32_t>(2 * count);
  support_stiffness_ = memory.array<double>(9 * count);
  if (memory.failed()) return false;
  for (std::size_t i = 0; i < 2 * count; ++i) support_place_[i] = place_[body.support_nodes[i]];
  std::copy(body.support_stiffness, body.support_stiffness + 9 * count, support_stiffness_);
  support_count_ = body.support_count;
  return true;
}

// The energy of the soft supports, J. f += their forces.
double LargeSolver::add_supports(const float* u, float* f) const {
  double twice = 0;
  for (std::int32_t p = 0; p < support_count_; ++p) {
    const double* const k = support_stiffness_ + 9 * static_cast<std::size_t>(p);
    const std::int32_t a = support_place_[2 * p], b = support_place_[2 * p + 1];
    const float *const at_a = u + 3 * static_cast<std::size_t>(a), *const at_b = u + 3 * static_cast<std::size_t>(b);
    double on_a[3], on_b[3];
    for (int i = 0; i < 3; ++i) {
      on_a[i] = k[3 * i] * static_cast<double>(at_b[0]) + k[3 * i + 1] * static_cast<double>(at_b[1]) +
                k[3 * i + 2] * static_cast<double>(at_b[2]);
      on_b[i] = k[i] * static_cast<double>(at_a[0]) + k[3 + i] * static_cast<double>(at_a[1]) +
                k[6 + i] * static_cast<double>(at_a[2]);
    }
    for (int i = 0; i < 3; ++i) {
      twice += static_cast<double>(at_a[i]) * on_a[i] * (a == b ? 1 : 2);
      if (a < rows_) f[3 * static_cast<std::size_t>(a) + static_cast<std::size_t>(i)] += static_cast<float>(on_a[i]);
      if (a != b && b < rows_)
        f[3 * static_cast<std::size_t>(b) + static_cast<std::size_t>(i)] += static_cast<float>(on_b[i]);
    }
  }
  return twice / 2;
}

// load = K preload, N.
bool LargeSolver::take_load(SceneMemory& memory, const HyperelasticBody& body, const BlockRows& stiffness,
                            const double* preload) {
  SceneMemory scratch = memory.of_same_host();
  double* const moved = scratch.array<double>(3 * static_cast<std::size_t>(rows_));
  load_ = memory.array<float>(length_);
  const bool made = moved && load_;
  for (std::int32_t n = 0; made && n < nodes_; ++n)
    for (std::size_t i = 0; i < 3 && place_[n] < rows_; ++i)
      moved[3 * static_cast<std::size_t>(place_[n]) + i] = preload[3 * static_cast<std::size_t>(n) + i];
  for (std::int32_t row = 0; made && row < rows_; ++row)
    for (std::size_t i = 0; i < 3; ++i) {
      double sum = 0;
      for (std::int64_t at = stiffness.first[row]; at < stiffness.first[row + 1]; ++at)
        for (std::size_t k = 0; k < 3; ++k)
          sum += stiffness.block[9 * static_cast<std::size_t>(at) + 3 * i + k] *
                 moved[3 * static_cast<std::size_t>(stiffness.column[at]) + k];
      load_[3 * static_cast<std::size_t>(row) + i] = static_cast<float>(sum);
    }
  for (std::int32_t n = 0; made && n < nodes_; ++n)
    for (std::size_t i = 0; i < 3; ++i)
      if (place_[n] < rows_ && body.fixed[3 * static_cast<std::size_t>(n) + i])
        load_[3 * static_cast<std::size_t>(place_[n]) + i] = 0;
  scratch.release_all();
  return made;
}

// Takes steps under a share of the load until the state is solved to tolerance_. False where it does not come to kRestEnough, or where a
// tetrahedron is flat.
bool LargeSolver::settle(double load_share) {
  constexpr int most_rounds = 60;
  load_share_ = load_share, now_.solved = 0;
  for (int round = 0; round < most_rounds && !now_.solved; ++round) {
    LargeOutcome outcome;
    const Elements::Energy found = evaluate(u_, f_);
    now_.energy = found.energy, now_.least_volume = found.least_volume;
    if (!(found.least_volume > kLeastVolume)) return false;
    stuck_ = false;
    improve(kMostSteps, &outcome);
    if (stuck_) break;
  }
  return now_.solved || now_.residual <= kRestEnough;
}

// The least energy under the load, which grows in steps, shorter ones where the body does not follow; then this state is the rest, and
// what holds it there is the load.
bool LargeSolver::find_rest() {
  constexpr double longest = 1.0 / 8, shortest = 1.0 / 512;
  double reached = 0, way = longest;
  while (reached < 1) {
    const double next = std::min(reached + way, 1.0);
    std::copy(u_, u_ + length_, u_before_);
    tolerance_ = next < 1 ? kTolerance : kRestTolerance;
    if (settle(next)) {
      reached = next, way = std::min(2 * way, longest);
      continue;
    }
    if (way <= shortest) return false;
    way /= 2;
    std::copy(u_before_, u_before_ + length_, u_);
    drop_pairs();
  }
  load_share_ = 0, tolerance_ = kTolerance;
  base_energy_ = evaluate(u_, trial_f_).energy;  // of the body alone, like its forces
  std::copy(u_, u_ + length_, base_);
  std::copy(trial_f_, trial_f_ + length_, load_);
  load_share_ = 1, noise_ = kEnergyNoise * base_energy_;
  forget();
  return true;
}

void LargeSolver::keep(SceneMemory& memory) {
  const auto rows = static_cast<std::size_t>(max_rows_), nodes = static_cast<std::size_t>(max_nodes_);
  memory.keep(now_);
  memory.keep_array(u_, length_), memory.keep_array(f_, length_);
  for (int i = 0; i < kPairs; ++i) {
    memory.keep_array(moves_[i], length_), memory.keep_array(changes_[i], length_);
    memory.keep_array(local_moves_[i], rows);
  }
  memory.keep_array(row_, rows), memory.keep_array(row_place_, nodes), memory.keep_array(row_weight_, nodes);
  memory.keep_array(spots_, static_cast<std::size_t>(max_spots_));
  memory.keep_array(generation_, static_cast<std::size_t>(max_spots_));
  memory.keep_array(holds_, rows), memory.keep_array(applied_, rows);
  memory.keep_array(local_, rows), memory.keep_array(multiplier_, rows);
  memory.keep_array(beside_, rows * stride_, now_.row_count, stride_);
  if (!of_metric_) return;
  memory.keep(renewal_);
  memory.keep_array(of_metric_, 3 * static_cast<std::size_t>(nodes_));
  memory.keep_array(of_next_, 3 * static_cast<std::size_t>(nodes_));
}

void LargeSolver::restored() {
  if (renewal_.active) {
    tangent_.begin(of_metric_);
    for (std::int32_t s = 0; s < renewed_.supernodes(); ++s) renewed_.factorise_supernode(work_on_metric_, s, tangent_);
    renewed_.take_panels(work_on_metric_);
  }
  for (std::int32_t slice = 0; slice < renewal_.slices; ++slice) make_slice(slice);
  for (std::int32_t i = 0; i < now_.spot_count; ++i) {
    const Spot& spot = spots_[i];
    std::fill(row_spot_ + spot.row, row_spot_ + spot.row + spot.rows, i);
  }
  find_all_responses();
  response_solves_ = 0;
}

// ---- the metric ------------------------------------------------------------------------------------------------------

bool LargeSolver::prepare_renewals(SceneMemory& memory, const HyperelasticBody& body, double of_held) {
  return renewed_.create_like(memory, factor_) && work_on_metric_.create(memory, factor_) &&
         tangent_.create(memory, body, place_, rows_, of_held);
}

void LargeSolver::copy_state(float* to) const {
  for (std::size_t i = 0; i < 3 * static_cast<std::size_t>(nodes_); ++i) to[i] = (base_ ? base_[i] : 0.0f) + u_[i];
}

// Goes on to the end of a slice, which is a share of all operations. False where the tangent is not definite.
bool LargeSolver::make_slice(std::int32_t slice) {
  if (slice == 0) {
    tangent_.begin(of_next_);
    next_supernode_ = 0;
  }
  const std::int64_t end = slice + 1 < kSlices ? factor_.operations() / kSlices * (slice + 1) : INT64_MAX;
  for (; next_supernode_ < factor_.supernodes(); ++next_supernode_) {
    if (next_supernode_ > 0 && work_on_metric_.operations() >= end) break;
    if (!factor_.factorise_supernode(work_on_metric_, next_supernode_, tangent_)) return false;
  }
  return true;
}

void LargeSolver::renew() {
  if (!of_next_ || (now_.at_rest && !renewal_.active && renewal_.slices == 0)) return;
  if (renewal_.slices == 0) copy_state(of_next_), renewal_.pairs = 0;
  if (!make_slice(renewal_.slices)) {
    renewal_.slices = 0;
    return;
  }
  if (++renewal_.slices == kSlices) take_metric();
}

void LargeSolver::take_metric() {
  renewed_.take_panels(work_on_metric_);
  std::copy(of_next_, of_next_ + 3 * static_cast<std::size_t>(nodes_), of_metric_);
  renewal_.active = 1, renewal_.slices = 0, ++renewal_.count;
  // Pairs are samples of the tangent, whatever the metric. Pairs from before the new metric's state go: the new metric is the tangent
  // of a later state.
  const std::int32_t old = std::max(0, now_.pair_count - renewal_.pairs);
  now_.pair_first = (now_.pair_first + old) % kPairs, now_.pair_count -= old;
  // Their scale was that of the metric before.
  now_.scale = 1, now_.pairs_since_scale = 0;
  find_all_responses();
}

void LargeSolver::take_rest_metric() {
  if (!of_metric_) return;
  const bool was_active = renewal_.active != 0;
  renewal_ = {};
  if (was_active) find_all_responses();
}

void LargeSolver::find_all_responses() {
  for (std::int32_t i = 0; i < now_.spot_count; ++i) find_responses(spots_[i]);
  measure_spots();
  fill_compliance();
  factor_contacts();
}

// ----------------------------------------------------------------------------------------------------------------------

void LargeSolver::come_to_rest() {
  std::fill(u_, u_ + std::max(3 * static_cast<std::size_t>(nodes_), length_), 0.0f);
  std::fill(f_, f_ + length_, 0.0f);
  for (double* vector : {local_, applied_, multiplier_}) std::fill(vector, vector + max_rows_, 0.0);
  drop_pairs();
  now_.pairs_of_other_contacts = 0;
  now_.solved = now_.at_rest = 1;
  now_.energy = now_.peak_energy = now_.residual = 0, now_.least_volume = now_.reach = 1;
  now_.alone = now_.still = 0;
  take_rest_metric();
}

void LargeSolver::forget() {
  now_.row_count = now_.spot_count = 0;
  come_to_rest();
}

// No row holds or pushes the body.
bool LargeSolver::nothing_acts() const {
  for (std::int32_t r = 0; r < now_.row_count; ++r)
    if (holds_[r] || applied_[r] != 0) return false;
  return true;
}

LargeSolver::Elements::Energy LargeSolver::evaluate(const float* u, float* f) {
  Elements::Energy energy;
  const float* const from_rest = u;
  if (base_) {
    for (std::size_t i = 0; i < 3 * static_cast<std::size_t>(nodes_); ++i) absolute_[i] = base_[i] + u[i];
    u = absolute_;
  }
#ifdef PALPATE_DISPATCHES
  if (best_instructions() != Instructions::baseline)
    evaluate_with_avx2(elements_, u, f, &energy);
  else
#endif
    evaluate_plainly(elements_, u, f, &energy);
  energy.energy += add_supports(u, f);
  if (load_) {
    energy.energy -= base_energy_ + load_share_ * dot_product(load_, from_rest, length_);
    add_multiple(static_cast<float>(-load_share_), load_, length_, f);
  }
  for (std::int32_t h = 0; h < held_count_; ++h) f[held_[h]] = 0;
  if (!std::isfinite(energy.energy)) energy.least_volume = 0;
  return energy;
}

// ---- rows and their responses ------------------------------------------------------------------------------------

void LargeSolver::on_spot(const Spot& spot, const float* field, double sum[3]) const {
  for (int i = 0; i < 3; ++i) sum[i] = 0;
  for (std::int32_t e = spot.first; e < spot.first + spot.count; ++e) {
    if (row_place_[e] >= rows_) continue;  // held
    const float* const at = field + 3 * static_cast<std::size_t>(row_place_[e]);
    for (int i = 0; i < 3; ++i) sum[i] += row_weight_[e] * static_cast<double>(at[i]);
  }
}

double LargeSolver::on_row(std::int32_t r, const float* field) const {
  double sum[3];
  on_spot(spot_of(r), field, sum);
  const double* const d = row_[r].direction;
  return d[0] * sum[0] + d[1] * sum[1] + d[2] * sum[2];
}

// field += W^T force
void LargeSolver::add_rows(const double* force, float* field) const {
  for (std::int32_t i = 0; i < now_.spot_count; ++i) {
    const Spot& spot = spots_[i];
    double sum[3] = {};
    for (std::int32_t r = spot.row; r < spot.row + spot.rows; ++r)
      for (int d = 0; d < 3; ++d) sum[d] += force[r] * row_[r].direction[d];
    for (std::int32_t e = spot.first; e < spot.first + spot.count; ++e) {
      if (row_place_[e] >= rows_) continue;
      float* const at = field + 3 * static_cast<std::size_t>(row_place_[e]);
      for (int d = 0; d < 3; ++d) at[d] += static_cast<float>(row_weight_[e] * sum[d]);
    }
  }
  for (std::int32_t h = 0; h < held_count_; ++h) field[held_[h]] = 0;
}

template <class Column>
void LargeSolver::add_columns_of(const double* force, double factor, float* field, Column column) const {
  for (std::int32_t i = 0; i < now_.spot_count; ++i) {
    const Spot& spot = spots_[i];
    for (int d = 0; d < 3; ++d) {
      double sum = 0;
      for (std::int32_t r = spot.row; r < spot.row + spot.rows; ++r) sum += force[r] * row_[r].direction[d];
      if (sum != 0) add_multiple(static_cast<float>(factor * sum), column(spot, d), length_, field);
    }
  }
}

// field += factor Y force
void LargeSolver::add_responses(const double* force, double factor, float* field) const {
  add_columns_of(force, factor, field, [&](const Spot& spot, int axis) { return response(spot, axis); });
}
// The same with Y at rest.
void LargeSolver::add_rest_responses(const double* force, double factor, float* field) const {
  add_columns_of(force, factor, field, [&](const Spot& spot, int axis) { return rest_response(spot, axis); });
}

void LargeSolver::write_beyond_linear(const double* force, std::int32_t count, float* out) {
  std::copy(u_, u_ + 3 * static_cast<std::size_t>(nodes_), trial_);
  add_rest_responses(force, -1, trial_);
  for (std::int32_t n = 0; n < count; ++n)
    std::copy_n(trial_ + 3 * static_cast<std::size_t>(place_[n]), 3, out + 3 * static_cast<std::size_t>(n));
}

// Y^T force of the rows of one spot after the other.
void LargeSolver::responses_times(const float* force, double* out) const {
  for (std::int32_t i = 0; i < now_.spot_count; ++i) {
    const Spot& spot = spots_[i];
    std::fill(out + spot.row, out + spot.row + spot.rows, 0.0);
    for (int d = 0; d < 3; ++d) {
      bool used = false;
      for (std::int32_t r = spot.row; r < spot.row + spot.rows; ++r) used = used || row_[r].direction[d] != 0;
      if (!used) continue;
      const double product = dot_product(response(spot, d), force, length_);
      for (std::int32_t r = spot.row; r < spot.row + spot.rows; ++r) out[r] += row_[r].direction[d] * product;
    }
  }
}

bool LargeSolver::same_spot(const LargeContacts& contacts, std::int32_t r, const Spot& before) const {
  const LargeRow& now = contacts.rows[r];
  if (now.count != before.count) return false;
  for (std::int32_t e = 0; e < now.count; ++e)
    if (place_[contacts.nodes[now.first + e]] != row_place_[before.first + e] ||
        contacts.weights[now.first + e] != row_weight_[before.first + e])
      return false;
  return true;
}

void LargeSolver::find_responses(const Spot& spot) {
  float* columns[3];
  for (int d = 0; d < 3; ++d) {
    float* const y = columns[d] = rest_response(spot, d);
    std::fill(y, y + length_, 0.0f);
    for (std::int32_t e = spot.first; e < spot.first + spot.count; ++e)
      if (row_place_[e] < rows_)
        y[3 * static_cast<std::size_t>(row_place_[e]) + static_cast<std::size_t>(d)] +=
            static_cast<float>(row_weight_[e]);
    for (std::int32_t h = 0; h < held_count_; ++h) y[held_[h]] = 0;
  }
  if (rest_responses_) {
    float* of_metric[3];
    for (int d = 0; d < 3; ++d)
      of_metric[d] = response(spot, d), std::copy(columns[d], columns[d] + length_, of_metric[d]);
    factor_.solve(columns, 3);
    if (renewal_.active)
      renewed_.solve(of_metric, 3);
    else
      for (int d = 0; d < 3; ++d) std::copy(columns[d], columns[d] + length_, of_metric[d]);
    for (int d = 0; d < 3; ++d) columns[d] = of_metric[d];
  } else {
    factor_.solve(columns, 3);
  }
  for (int d = 0; d < 3; ++d) {
    double& largest = largest_response_[3 * spot.slot + d];
    largest = 0;
    for (std::int32_t n = 0; n < rows_; ++n) {
      const float* const at = columns[d] + 3 * static_cast<std::size_t>(n);
      largest = std::max(largest, static_cast<double>(at[0] * at[0] + at[1] * at[1] + at[2] * at[2]));
    }
    largest = std::sqrt(largest);
  }
  response_solves_ += 3;
}

void LargeSolver::response_at(const double* force, std::int32_t first, std::int32_t end, std::int32_t node,
                              double out[3]) const {
  const std::int32_t place = place_[node];
  for (int c = 0; c < 3; ++c) out[c] = 0;
  for (std::int32_t r = first; r < end && place < rows_; ++r) {
    if (force[r] == 0) continue;
    for (int d = 0; d < 3; ++d) {
      if (row_[r].direction[d] == 0) continue;
      const float* const at = response(spot_of(r), d) + 3 * static_cast<std::size_t>(place);
      for (int c = 0; c < 3; ++c) out[c] += force[r] * row_[r].direction[d] * static_cast<double>(at[c]);
    }
  }
}

double LargeSolver::response_bound(const double* force, std::int32_t first, std::int32_t end) const {
  double sum = 0;
  for (std::int32_t r = first; r < end; ++r)
    for (int d = 0; d < 3; ++d)
      sum += std::abs(force[r] * row_[r].direction[d]) * largest_response_[3 * spot_of(r).slot + d];
  return sum;
}

void LargeSolver::response_on_rows(const double* force, double* out) const {
  for (std::int32_t r = 0; r < now_.row_count; ++r) {
    const double* const c = compliance_.row(r);
    out[r] = 0;
    for (std::int32_t k = 0; k < now_.row_count; ++k) out[r] += c[k] * force[k];
    for (std::int32_t k = 0; k < 3 && row_[r].group + k < now_.row_count; ++k)
      out[r] -= row_[r].compliance[k] * force[row_[r].group + k];
    for (std::int32_t k = 0; now_.has_beside && k < now_.row_count; ++k) out[r] -= beside(r, k) * force[k];
  }
}

// Spots that were there in the last step keep their responses and the local displacements of their rows.
void LargeSolver::take_spots(const LargeContacts& contacts) {
  std::int32_t count = 0, entries = 0;
  spots_changed_ = false;
  std::fill(slot_used_, slot_used_ + max_spots_, false);
  for (std::int32_t r = 0, end = 0; r < contacts.row_count; r = end, ++count) {
    const LargeRow& first = contacts.rows[r];
    while (end < contacts.row_count && contacts.rows[end].group == first.group) ++end;
    Spot& spot = next_spots_[count];
    spot = {entries, first.count, r, end - r, -1};
    for (std::int32_t i = r; i < end; ++i) next_local_[i] = contacts.start ? contacts.start[i] : 0;
    for (std::int32_t i = 0; i < now_.spot_count; ++i) {
      const std::int32_t k = (count + i) % now_.spot_count;  // most stand where they stood
      const Spot& before = spots_[k];
      if (slot_used_[before.slot] || !same_spot(contacts, r, before)) continue;
      spot.slot = before.slot, slot_used_[before.slot] = true;
      if (before.rows == spot.rows) std::copy(local_ + before.row, local_ + before.row + before.rows, next_local_ + r);
      spots_changed_ = spots_changed_ || k != count || before.rows != spot.rows;
      break;
    }
    spots_changed_ = spots_changed_ || spot.slot < 0;
    for (std::int32_t e = 0; e < first.count; ++e, ++entries)
      next_place_[entries] = place_[contacts.nodes[first.first + e]],
      next_weight_[entries] = contacts.weights[first.first + e];
  }
  spots_changed_ = spots_changed_ || count != now_.spot_count;
  now_.spot_count = count;
  std::swap(spots_, next_spots_), std::swap(row_place_, next_place_), std::swap(row_weight_, next_weight_);
  std::swap(local_, next_local_);
}

void LargeSolver::take_rows(const LargeContacts& contacts) {
  rows_changed_ = spots_changed_ || contacts.row_count != now_.row_count;
  for (std::int32_t r = 0; r < contacts.row_count; ++r) {
    const LargeRow &from = contacts.rows[r], &before = row_[r];
    for (int i = 0; i < 3 && !rows_changed_; ++i)
      rows_changed_ = from.direction[i] != before.direction[i] || from.compliance[i] != before.compliance[i];
    next_row_[r] = from;
  }
  take_beside(contacts);
  now_.row_count = contacts.row_count;
  std::swap(row_, next_row_);
}

void LargeSolver::take_beside(const LargeContacts& contacts) {
  const std::int32_t has = contacts.beside ? 1 : 0;
  rows_changed_ = rows_changed_ || now_.has_beside != has;
  now_.has_beside = has;
  for (std::int32_t r = 0; has && r < contacts.row_count; ++r) {
    const double* const from = contacts.beside + static_cast<std::size_t>(r) * contacts.beside_stride;
    double* const to = beside_ + static_cast<std::size_t>(r) * stride_;
    rows_changed_ = rows_changed_ || !std::equal(from, from + contacts.row_count, to);
    std::copy(from, from + contacts.row_count, to);
  }
}

bool LargeSolver::take(const LargeContacts& contacts) {
  take_spots(contacts);
  take_rows(contacts);
  begin_step();
  if (!rows_changed_) return true;
  // The pairs stay samples of the body's tangent, but their moves may move the new rows.
  now_.pairs_of_other_contacts = now_.pair_count > 0;
  if (spots_changed_) {
    std::int32_t free_slot = 0;
    for (std::int32_t i = 0; i < now_.spot_count; ++i) {
      Spot& spot = spots_[i];
      std::fill(row_spot_ + spot.row, row_spot_ + spot.row + spot.rows, i);
      if (spot.slot >= 0) continue;
      while (slot_used_[free_slot]) ++free_slot;
      spot.slot = free_slot, slot_used_[free_slot] = true;
      ++generation_[free_slot];
      find_responses(spot);
    }
    measure_spots();
    forget_local_moves();
  }
  return fill_compliance();
}

// What the pairs say about the rows' own compliance belongs to other rows.
void LargeSolver::forget_local_moves() {
  for (int age = now_.pair_count - 1; age >= 0; --age) {
    const int i = pair(age);
    std::fill(local_moves_[i], local_moves_[i] + max_rows_, 0.0);
    now_.curvature[i] = dot_product(moves_[i], changes_[i], length_);
    if (!(now_.curvature[i] > 0)) return drop_pairs();
  }
}

// W Y between all spots, symmetric.
void LargeSolver::measure_spots() {
  for (std::int32_t i = 0; i < now_.spot_count; ++i)
    for (std::int32_t j = 0; j < now_.spot_count; ++j)
      for (int d = 0; d < 3; ++d) {
        double sum[3];
        on_spot(spots_[i], response(spots_[j], d), sum);
        for (int c = 0; c < 3; ++c)
          between_spots_[static_cast<std::size_t>(3 * i + c) * stride_ + static_cast<std::size_t>(3 * j + d)] = sum[c];
      }
}

// C of all rows. False where a number is not finite.
bool LargeSolver::fill_compliance() {
  bool finite = true;
  for (std::int32_t i = 0; i < now_.row_count; ++i)
    for (std::int32_t j = 0; j <= i; ++j) {
      const double *const a = row_[i].direction, *const b = row_[j].direction;
      double sum = 0;
      for (int c = 0; c < 3; ++c)
        for (int d = 0; d < 3; ++d) {
          const auto at = static_cast<std::size_t>(3 * row_spot_[i] + c),
                     to = static_cast<std::size_t>(3 * row_spot_[j] + d);
          sum += a[c] * b[d] * 0.5 * (between_spots_[at * stride_ + to] + between_spots_[to * stride_ + at]);
        }
      const std::int32_t k = j - row_[i].group;
      if (k >= 0 && k < 3) sum += row_[i].compliance[k];
      if (now_.has_beside) sum += beside(i, j);
      finite = finite && std::isfinite(sum);
      compliance_.entry(i, j) = compliance_.entry(j, i) = sum;
    }
  compliance_.rows_end = now_.row_count;
  for (std::int32_t r = 0; r < now_.row_count; ++r)
    compliance_.scale[r] = compliance_.entry(r, r) > 0 ? 1 / std::sqrt(compliance_.entry(r, r)) : 0;
  return finite;
}

// L a, of the rows that hold and by these alone.
void LargeSolver::compliance_times(const double* a, double* out) const {
  for (std::int32_t r = 0; r < now_.row_count; ++r) {
    const LargeRow& row = row_[r];
    out[r] = 0;
    for (std::int32_t k = 0; holds_[r] && k < 3 && row.group + k < now_.row_count; ++k)
      out[r] += holds_[row.group + k] ? row.compliance[k] * a[row.group + k] : 0;
    for (std::int32_t k = 0; now_.has_beside && holds_[r] && k < now_.row_count; ++k)
      out[r] += holds_[k] ? beside(r, k) * a[k] : 0;
  }
}
double LargeSolver::times_compliance(const double* a, const double* b) const {
  double sum = 0;
  for (std::int32_t r = 0; r < now_.row_count; ++r) {
    const LargeRow& row = row_[r];
    for (std::int32_t k = 0; holds_[r] && k < 3 && row.group + k < now_.row_count; ++k)
      if (holds_[row.group + k]) sum += a[r] * row.compliance[k] * b[row.group + k];
    for (std::int32_t k = 0; now_.has_beside && holds_[r] && k < now_.row_count; ++k)
      if (holds_[k]) sum += a[r] * beside(r, k) * b[k];
  }
  return sum;
}

// Rows that do not hold stand in the factor as those of the identity.
bool LargeSolver::factor_contacts() {
  const auto at = [&](std::int32_t i, std::int32_t j) -> double& {
    return contact_[static_cast<std::size_t>(i) * stride_ + static_cast<std::size_t>(j)];
  };
  for (std::int32_t i = 0; i < now_.row_count; ++i) {
    for (std::int32_t j = 0; j <= i; ++j)
      at(i, j) = holds_[i] && holds_[j] ? compliance_.entry(i, j) : (i == j ? 1 : 0);
    at(i, i) *= 1 + kContactShift;
  }
  for (std::int32_t j = 0; j < now_.row_count; ++j) {
    double pivot = at(j, j);
    for (std::int32_t k = 0; k < j; ++k) pivot -= at(j, k) * at(j, k);
    // A row that others determine, to rounding, or one on held nodes alone.
    const double least = kContactShift * at(j, j);
    at(j, j) = std::sqrt(pivot > least ? pivot : std::max(least, 1e-30));
    for (std::int32_t i = j + 1; i < now_.row_count; ++i) {
      double sum = at(i, j);
      for (std::int32_t k = 0; k < j; ++k) sum -= at(i, k) * at(j, k);
      at(i, j) = sum / at(j, j);
    }
    if (!std::isfinite(at(j, j))) return false;
  }
  return true;
}

// x: zero for rows that do not hold.
void LargeSolver::solve_contacts(double* x) const {
  const auto row = [&](std::int32_t i) { return contact_ + static_cast<std::size_t>(i) * stride_; };
  for (std::int32_t i = 0; i < now_.row_count; ++i) {
    for (std::int32_t k = 0; k < i; ++k) x[i] -= row(i)[k] * x[k];
    x[i] /= row(i)[i];
  }
  for (std::int32_t i = now_.row_count - 1; i >= 0; --i) {
    x[i] /= row(i)[i];
    for (std::int32_t k = 0; k < i; ++k) x[k] -= row(i)[k] * x[i];
  }
}

// p -= Y C^-1 (W p + L local), local -= C^-1 (..)
void LargeSolver::project(float* p, double* local) {
  if (now_.row_count == 0) return;
  compliance_times(local, work_);
  for (std::int32_t r = 0; r < now_.row_count; ++r) work_[r] += holds_[r] ? on_row(r, p) : 0;
  solve_contacts(work_);
  add_responses(work_, -1, p);
  for (std::int32_t r = 0; r < now_.row_count; ++r) local[r] -= work_[r];
}

// ---- a step --------------------------------------------------------------------------------------------------------

void LargeSolver::find_free(double* free) const {
  responses_times(f_, free);
  for (std::int32_t r = 0; r < now_.row_count; ++r) free[r] = on_row(r, u_) - free[r];
}

// Of the energy that the linear response expects of a move: beyond, the move is shortened. kMoreEnergy: of the part that grows with
// the square of the move, by how much the body may be stiffer than at rest; kMoreOfAll: of the energy that the body has.
constexpr double kMoreEnergy = 4, kMoreOfAll = 0.1;

// u <- u + Y x, where x moves the rows that hold to their places; halved until the energy is near what the linear response expects, and no
// tetrahedron nearly flat. False where even no move at all is not finite.
bool LargeSolver::hold(const std::uint8_t* holds, const double* place, const double* start, LargeOutcome* outcome) {
  bool other_rows = false;
  double *const move = work_, *const change = work2_, largest = 0;
  for (std::int32_t r = 0; r < now_.row_count; ++r) {
    const std::uint8_t held = !holds || holds[r] ? 1 : 0;
    other_rows = other_rows || holds_[r] != held;
    holds_[r] = held, applied_[r] = 0;
    change[r] = held ? 0 : -start[r];
    if (!held) local_[r] = 0;
  }
  if (other_rows) {
    now_.pairs_of_other_contacts = now_.pair_count > 0;
    forget_local_moves();
  }
  if ((other_rows || rows_changed_) && !factor_contacts()) return false;
  compliance_times(local_, move);
  for (std::int32_t r = 0; r < now_.row_count; ++r) {
    const double* const c = compliance_.row(r);
    if (!holds_[r]) {
      largest = std::max(largest, std::abs(change[r]) * c[r]);
      continue;
    }
    move[r] = (place ? place[r] : row_[r].target) - on_row(r, u_) - move[r];
    for (std::int32_t k = 0; k < now_.row_count; ++k)
      if (change[k] != 0) move[r] -= c[k] * change[k];
    // L takes the whole of a given force, of which `change` has a part.
    for (std::int32_t k = 0; now_.has_beside && k < now_.row_count; ++k)
      if (!holds_[k]) move[r] -= beside(r, k) * (applied_[k] - change[k]);
    largest = std::max(largest, std::abs(move[r]));
  }
  constexpr double least_move = 1e-9;  // m
  still_ = largest <= least_move && !rows_changed_ && !other_rows;
  if (still_ && now_.solved == 2) return true;
  rows_changed_ = false;
  now_.solved = 0;
  if (!still_) now_.still = 0;
  solve_contacts(move);
  for (std::int32_t r = 0; r < now_.row_count; ++r)
    if (!holds_[r]) move[r] = change[r];
  double squared = 0;  // J, twice what a move of the body alone would take at rest
  for (std::int32_t r = 0; r < now_.row_count; ++r) {
    const double* const c = compliance_.row(r);
    for (std::int32_t k = 0; k < now_.row_count; ++k) squared += move[r] * c[k] * move[k];
  }
  const double of_rows = 0.5 * times_compliance(local_, local_);
  double slope = 0;  // J, of the body's energy along the whole move
  double share = now_.reach;
  for (int i = 0;; ++i, share = i < 10 ? share / 2 : 0) {
    std::copy(u_, u_ + length_, trial_);
    add_responses(move, share, trial_);
    for (std::int32_t r = 0; r < now_.row_count; ++r) trial_local_[r] = local_[r] + (holds_[r] ? share * move[r] : 0);
    if (i == 0) slope = share > 0 ? (dot_product(f_, trial_, length_) - dot_product(f_, u_, length_)) / share : 0;
    const Elements::Energy found = evaluate(trial_, trial_f_);
    ++outcome->evaluations;
    const double of_body = now_.energy - of_rows, most = of_body + share * slope +
                                                         0.5 * kMoreEnergy * share * share * squared +
                                                         kMoreOfAll * std::abs(of_body) + noise_;
    // Where the body was beyond the limits before, any part of the move is as good as none.
    if ((found.least_volume > kLeastVolume && found.energy <= most) || (share == 0 && std::isfinite(found.energy))) {
      now_.energy = found.energy + 0.5 * times_compliance(trial_local_, trial_local_),
      now_.least_volume = found.least_volume;
      break;
    }
    if (share == 0) return false;
  }
  outcome->cut = outcome->cut || share < 1;
  shortened_ = shortened_ || share < now_.reach;
  std::swap(u_, trial_), std::swap(f_, trial_f_);
  std::swap(local_, trial_local_);
  return true;
}

void LargeSolver::find_multipliers() {
  responses_times(f_, work_);
  compliance_times(local_, multiplier_);
  for (std::int32_t r = 0; r < now_.row_count; ++r) {
    const double* const c = compliance_.row(r);
    multiplier_[r] = holds_[r] ? multiplier_[r] + work_[r] : 0;
    for (std::int32_t k = 0; holds_[r] && k < now_.row_count; ++k)
      if (!holds_[k]) multiplier_[r] -= (now_.has_beside ? c[k] - beside(r, k) : c[k]) * applied_[k];
  }
  solve_contacts(multiplier_);
  for (std::int32_t r = 0; r < now_.row_count; ++r) {
    local_g_[r] = holds_[r] ? local_[r] - multiplier_[r] : 0;
    if (!holds_[r]) multiplier_[r] = applied_[r];
    work_[r] = -multiplier_[r];
  }
  std::copy(f_, f_ + length_, g_);
  add_rows(work_, g_);
}

// The direction p from the gradient g. Returns g . p.
double LargeSolver::descend() {
  double factor[kPairs] = {};
  std::copy(g_, g_ + length_, p_);
  std::copy(local_g_, local_g_ + now_.row_count, local_p_);
  for (int age = 0; age < now_.pair_count; ++age) {
    const int i = pair(age);
    factor[age] =
        (dot_product(moves_[i], p_, length_) + times_compliance(local_moves_[i], local_p_)) / now_.curvature[i];
    add_multiple(static_cast<float>(-factor[age]), changes_[i], length_, p_);
    for (std::int32_t r = 0; r < now_.row_count; ++r) local_p_[r] -= factor[age] * local_moves_[i][r];
  }
  metric().solve_roughly(p_);
  project(p_, local_p_);
  if (now_.scale != 1) {
    for (std::size_t i = 0; i < length_; ++i) p_[i] *= static_cast<float>(now_.scale);
    for (std::int32_t r = 0; r < now_.row_count; ++r) local_p_[r] *= now_.scale;
  }
  for (int age = now_.pair_count - 1; age >= 0; --age) {
    const int i = pair(age);
    const double back =
        (dot_product(changes_[i], p_, length_) + times_compliance(local_moves_[i], local_p_)) / now_.curvature[i];
    add_multiple(static_cast<float>(factor[age] - back), moves_[i], length_, p_);
    for (std::int32_t r = 0; r < now_.row_count; ++r) local_p_[r] += (factor[age] - back) * local_moves_[i][r];
  }
  if (now_.pairs_of_other_contacts) project(p_, local_p_);
  return dot_product(g_, p_, length_) + times_compliance(local_g_, local_p_);
}

void LargeSolver::keep_pair(double share) {
  const bool full = now_.pair_count == kPairs;
  const int i = full ? now_.pair_first : (now_.pair_first + now_.pair_count) % kPairs;
  for (std::size_t k = 0; k < length_; ++k) {
    moves_[i][k] = -static_cast<float>(share) * p_[k];
    changes_[i][k] = trial_f_[k] - f_[k];
  }
  std::fill(local_moves_[i], local_moves_[i] + max_rows_, 0.0);
  for (std::int32_t r = 0; r < now_.row_count; ++r) local_moves_[i][r] = -share * local_p_[r];
  now_.curvature[i] = dot_product(moves_[i], changes_[i], length_) + times_compliance(local_moves_[i], local_moves_[i]);
  if (!(now_.curvature[i] > 1e-12 * std::abs(now_.energy))) {
    if (full) now_.pair_first = (now_.pair_first + 1) % kPairs, --now_.pair_count;
    return;
  }
  if (full)
    now_.pair_first = (now_.pair_first + 1) % kPairs;
  else
    ++now_.pair_count;
  renewal_.pairs = std::min(renewal_.pairs + 1, kPairs);
  // The initial matrix is scale K^-1: the tangent of a compressed body is stiffer than K.
  if (now_.pairs_since_scale++ % 10 != 0) return;
  std::copy(changes_[i], changes_[i] + length_, g_);
  std::copy(local_moves_[i], local_moves_[i] + now_.row_count, local_g_);
  metric().solve_roughly(g_);
  project(g_, local_g_);
  const double scaled = dot_product(changes_[i], g_, length_) + times_compliance(local_moves_[i], local_g_);
  const double scale = now_.curvature[i] / scaled;
  now_.scale = scale > kLeastScale ? std::min(scale, 1.0) : kLeastScale;
}

// u <- u - share p with Armijo's rule, share from 1, on the energy less the work of the applied forces. Returns whether a step was
// taken.
bool LargeSolver::search(double slope, LargeOutcome* outcome) {
  double applied = 0;  // W, of the applied forces along -p
  for (std::int32_t r = 0; r < now_.row_count; ++r)
    if (applied_[r] != 0) applied -= applied_[r] * on_row(r, p_);
  for (double share = 1; share > kLeastShare;) {
    std::copy(u_, u_ + length_, trial_);
    add_multiple(static_cast<float>(-share), p_, length_, trial_);
    for (std::int32_t r = 0; r < now_.row_count; ++r) trial_local_[r] = local_[r] - share * local_p_[r];
    const Elements::Energy found = evaluate(trial_, trial_f_);
    ++outcome->evaluations;
    const double energy = found.energy + 0.5 * times_compliance(trial_local_, trial_local_),
                 change = energy - now_.energy - share * applied;
    const bool allowed = found.least_volume > std::min(kLeastVolume, now_.least_volume);
    if (allowed && change <= -1e-4 * share * slope + kEnergyRounding * std::abs(now_.energy) + noise_) {
      now_.energy = energy, now_.least_volume = found.least_volume;
      keep_pair(share);
      std::swap(u_, trial_), std::swap(f_, trial_f_), std::swap(local_, trial_local_);
      return true;
    }
    // The least point of the parabola through both energies and the slope.
    const double least = allowed ? 0.5 * slope * share * share / (change + slope * share) : 0.5 * share;
    share = std::clamp(least, 0.05 * share, 0.5 * share);
  }
  return false;
}

void LargeSolver::improve(std::int32_t most_steps, LargeOutcome* outcome) {
  if (now_.solved) return;
  now_.at_rest = 0;
  const double tolerance = still_ ? std::min(tolerance_, kStillTolerance) : tolerance_;
  const bool moves = !still_ && now_.row_count > 0;
  for (std::int32_t steps = 0;; ++steps, ++outcome->steps) {
    find_multipliers();
    if (steps >= most_steps) break;
    const double slope = descend();
    const double energy = std::max(std::abs(now_.energy), 1e-300);
    const double scale = std::max(now_.scale, kLeastTold);
    now_.residual = std::sqrt(std::max(slope, 0.0) / (scale * std::max(energy, noise_)));
    // Where targets stand still, the pairs get to know the tangent. Where they move, they know what each move disturbs and little else. A tissue
    // that hardly changes its volume and has turned is stiffer than K against some moves, by up to 1 / gamma, and softer by as much against
    // those that K takes for changes of volume: K^-1 / gamma tells too little of an error there. The mean of both counts.
    const double least = tolerance * tolerance * scale * (moves ? std::sqrt(scale) : 1);
    if (slope <= least * energy + 0.01 * noise_) now_.solved = still_ ? 2 : 1;
    if (now_.solved || !std::isfinite(slope)) break;
    if (slope < 0 || !search(slope, outcome)) {
      stuck_ = now_.pair_count == 0;
      if (stuck_) break;
      drop_pairs();
    }
  }
  outcome->unfinished = !now_.solved && !(now_.residual <= kUnfinished);
  // What the numbers' rounding leaves is not worth a search without end.
  now_.still = still_ ? now_.still + most_steps : 0;
  if (now_.still > kMostStillSteps && !outcome->unfinished) now_.solved = 2;
  if (outcome->cut) now_.solved = 0;
}

void LargeSolver::begin_step() {
  before_ = now_;
  shortened_ = stuck_ = false;
  std::copy(u_, u_ + std::max(3 * static_cast<std::size_t>(nodes_), length_), u_before_);
  std::copy(f_, f_ + length_, f_before_);
  std::copy(local_, local_ + max_rows_, local_before_);
}

// Back to where the step began. The pairs stay what they are: samples of the tangent, though from far away; they are dropped.
void LargeSolver::give_up() {
  const double reach = now_.reach > kLeastReach ? now_.reach / 4 : 0;
  const std::int32_t rows = now_.row_count, spots = now_.spot_count;
  now_ = before_;
  now_.row_count = rows, now_.spot_count = spots, now_.reach = reach;
  std::swap(u_, u_before_), std::swap(f_, f_before_), std::swap(local_, local_before_);
  now_.solved = 0;
  drop_pairs();
  find_multipliers();
}

void LargeSolver::forces(bool sound, double* force, LargeOutcome* outcome) {
  bool finite = sound && std::isfinite(now_.energy);
  for (std::int32_t r = 0; r < now_.row_count; ++r) finite = finite && std::isfinite(multiplier_[r]);
  outcome->failed = !finite;
  std::fill(force, force + now_.row_count, 0.0);
  if (!finite) return forget();
  // A body that loses energy is on its way to its solution, however far that is.
  outcome->lost = now_.residual > kLost && !now_.solved;
  // By the metric of the method itself: in a tissue that stiffens, K^-1 tells many times the distance.
  outcome->given_up = outcome->lost && now_.energy > before_.energy &&
                      now_.residual * std::sqrt(std::max(now_.scale, kLeastTold)) > kLost;
  outcome->residual = outcome->given_up ? now_.residual : std::min(now_.residual, kLost);
  if (outcome->given_up) {
    outcome->unfinished = true;
    give_up();
  } else {
    if (!shortened_) now_.reach = std::clamp(2 * now_.reach, kLeastReach, 1.0);
    now_.peak_energy = std::max(now_.peak_energy, std::abs(now_.energy));
  }
  std::copy(multiplier_, multiplier_ + now_.row_count, force);
  const bool acts = !nothing_acts();
  now_.alone = acts ? 0 : now_.alone + 1;
  if (!acts &&
      (std::abs(now_.energy) <= kRestEnergy * now_.peak_energy + noise_ || now_.alone > kStepsToRest || stuck_))
    come_to_rest(), outcome->residual = 0, ++outcome->evaluations;  // so that the state counts as a new one
  outcome->least_volume = now_.least_volume;
}

LargeOutcome LargeSolver::step(const LargeContacts& contacts, std::int32_t most_steps, double* force) {
  LargeOutcome outcome;
  bool sound = take(contacts);
  if (now_.row_count == 0 && now_.at_rest) return outcome;
  sound = sound && hold(nullptr, nullptr, nullptr, &outcome);
  if (sound) improve(most_steps, &outcome);
  forces(sound, force, &outcome);
  return outcome;
}

}  // namespace palpate
