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
                                         std::int32_t order_count, std::int32_t max_rows, std::int32_t max_nodes) {
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
      const BlockFactor::Outcome outcome = factor_.create(memory, stiffness);
      if (outcome == BlockFactor::Outcome::made) created = Created::made;
      if (outcome == BlockFactor::Outcome::not_definite) created = Created::not_definite;
    }
  }
  scratch.release_all();
  if (created != Created::made) return created;
  if (!elements_.create(memory, body, place_, rows_)) return Created::no_memory;

  held_ = memory.array<std::int32_t>(3 * rows);
  const std::size_t padded = std::max(3 * nodes, length_);
  u_ = memory.array<float>(padded), trial_ = memory.array<float>(padded);
  for (float** vector : {&f_, &trial_f_, &g_, &p_}) *vector = memory.array<float>(length_);
  const auto most = static_cast<std::size_t>(max_rows), most_nodes = static_cast<std::size_t>(max_nodes);
  for (int i = 0; i < kPairs; ++i) {
    moves_[i] = memory.array<float>(length_), changes_[i] = memory.array<float>(length_);
    local_moves_[i] = memory.array<double>(most);
  }
  row_ = memory.array<LargeRow>(most), next_row_ = memory.array<LargeRow>(most);
  row_place_ = memory.array<std::int32_t>(most_nodes), next_place_ = memory.array<std::int32_t>(most_nodes);
  row_weight_ = memory.array<double>(most_nodes), next_weight_ = memory.array<double>(most_nodes);
  slot_ = memory.array<std::int32_t>(most), next_slot_ = memory.array<std::int32_t>(most);
  slot_used_ = memory.array<bool>(most);
  responses_ = memory.array<float*>(most);
  float* const responses = memory.array<float>(most * length_);
  contact_ = memory.array<double>(most * most);
  for (double** vector : {&local_, &next_local_, &multiplier_, &local_g_, &local_p_, &trial_local_, &work_, &work2_})
    *vector = memory.array<double>(most);
  if (memory.failed()) return Created::no_memory;
  for (std::size_t r = 0; r < most; ++r) responses_[r] = responses + r * length_;
  for (std::size_t n = 0; n < nodes; ++n)
    for (int i = 0; i < 3; ++i)
      if (place_[n] < rows_ && body.fixed[3 * n + static_cast<std::size_t>(i)])
        held_[held_count_++] = 3 * place_[n] + i;
  forget();
  keep(memory);
  return Created::made;
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
  memory.keep_array(slot_, rows);
  memory.keep_array(local_, rows), memory.keep_array(multiplier_, rows);
}

void LargeSolver::restored() {
  for (std::int32_t r = 0; r < now_.row_count; ++r) find_response(r);
  factor_contacts();
}

void LargeSolver::forget() {
  std::fill(u_, u_ + std::max(3 * static_cast<std::size_t>(nodes_), length_), 0.0f);
  std::fill(f_, f_ + length_, 0.0f);
  std::fill(local_, local_ + max_rows_, 0.0);
  drop_pairs();
  now_.row_count = 0;
  std::fill(slot_used_, slot_used_ + max_rows_, false);
  now_.pairs_of_other_contacts = 0;
  now_.solved = now_.at_rest = 1;
  now_.energy = now_.peak_energy = now_.residual = 0, now_.least_volume = 1;
}

LargeSolver::Elements::Energy LargeSolver::evaluate(const float* u, float* f) {
  Elements::Energy energy;
#ifdef PALPATE_DISPATCHES
  if (best_instructions() != Instructions::baseline)
    evaluate_with_avx2(elements_, u, f, &energy);
  else
#endif
    evaluate_plainly(elements_, u, f, &energy);
  for (std::int32_t h = 0; h < held_count_; ++h) f[held_[h]] = 0;
  if (!std::isfinite(energy.energy)) energy.least_volume = 0;
  return energy;
}

double LargeSolver::on_row(std::int32_t r, const float* field) const {
  const LargeRow& row = row_[r];
  double sum = 0;
  for (std::int32_t e = row.first; e < row.first + row.count; ++e) {
    const float* at = field + 3 * static_cast<std::size_t>(row_place_[e]);
    sum += row_weight_[e] *
           (row.direction[0] * static_cast<double>(at[0]) + row.direction[1] * static_cast<double>(at[1]) +
            row.direction[2] * static_cast<double>(at[2]));
  }
  return sum;
}

void LargeSolver::add_row(std::int32_t r, double factor, float* field) const {
  const LargeRow& row = row_[r];
  for (std::int32_t e = row.first; e < row.first + row.count; ++e) {
    if (row_place_[e] >= rows_) continue;
    float* at = field + 3 * static_cast<std::size_t>(row_place_[e]);
    for (int i = 0; i < 3; ++i) at[i] += static_cast<float>(factor * row_weight_[e] * row.direction[i]);
  }
  for (std::int32_t h = 0; h < held_count_; ++h) field[held_[h]] = 0;
}

bool LargeSolver::same_row(const LargeContacts& contacts, std::int32_t r, std::int32_t kept) const {
  const LargeRow &now = contacts.rows[r], &before = row_[kept];
  if (now.count != before.count) return false;
  for (int i = 0; i < 3; ++i)
    if (now.direction[i] != before.direction[i]) return false;
  for (std::int32_t e = 0; e < now.count; ++e)
    if (place_[contacts.nodes[now.first + e]] != row_place_[before.first + e] ||
        contacts.weights[now.first + e] != row_weight_[before.first + e])
      return false;
  return true;
}

void LargeSolver::find_response(std::int32_t r) {
  float* const response = responses_[slot_[r]];
  std::fill(response, response + length_, 0.0f);
  add_row(r, 1, response);
  factor_.solve(response);
}

// Rows that were there in the last step keep their responses and their local displacement.
void LargeSolver::take_rows(const LargeContacts& contacts) {
  bool changed = contacts.row_count != now_.row_count;
  std::int32_t entries = 0;
  std::fill(slot_used_, slot_used_ + max_rows_, false);
  for (std::int32_t r = 0; r < contacts.row_count; ++r) {
    next_slot_[r] = -1, next_local_[r] = 0;
    for (std::int32_t i = 0; i < now_.row_count; ++i) {
      const std::int32_t k = (r + i) % now_.row_count;  // most rows stand where they stood
      if (slot_used_[slot_[k]] || !same_row(contacts, r, k)) continue;
      next_slot_[r] = slot_[k], next_local_[r] = local_[k];
      slot_used_[slot_[k]] = true;
      changed = changed || k != r;
      break;
    }
    changed = changed || next_slot_[r] < 0;
    const LargeRow& from = contacts.rows[r];
    LargeRow& row = next_row_[r];
    row = from, row.first = entries;
    for (int i = 0; i < 3 && r < now_.row_count; ++i) changed = changed || from.compliance[i] != row_[r].compliance[i];
    for (std::int32_t e = 0; e < from.count; ++e, ++entries)
      next_place_[entries] = place_[contacts.nodes[from.first + e]],
      next_weight_[entries] = contacts.weights[from.first + e];
  }
  now_.row_count = contacts.row_count, rows_changed_ = changed;
  std::swap(row_, next_row_), std::swap(row_place_, next_place_), std::swap(row_weight_, next_weight_);
  std::swap(slot_, next_slot_), std::swap(local_, next_local_);
  if (!changed) return;
  std::int32_t free_slot = 0;
  for (std::int32_t r = 0; r < now_.row_count; ++r) {
    if (slot_[r] >= 0) continue;
    while (slot_used_[free_slot]) ++free_slot;
    slot_[r] = free_slot, slot_used_[free_slot] = true;
    find_response(r);
  }
  // The pairs stay samples of the body's tangent; what they say about the rows' own compliance belongs to the old rows.
  now_.pairs_of_other_contacts = now_.pair_count > 0;
  for (int age = now_.pair_count - 1; age >= 0; --age) {
    const int i = pair(age);
    std::fill(local_moves_[i], local_moves_[i] + max_rows_, 0.0);
    now_.curvature[i] = dot_product(moves_[i], changes_[i], length_);
    if (!(now_.curvature[i] > 0)) return drop_pairs();
  }
}

void LargeSolver::compliance_times(const double* a, double* out) const {
  for (std::int32_t r = 0; r < now_.row_count; ++r) {
    const LargeRow& row = row_[r];
    out[r] = 0;
    for (std::int32_t k = 0; k < 3 && row.group + k < now_.row_count; ++k)
      out[r] += row.compliance[k] * a[row.group + k];
  }
}
double LargeSolver::times_compliance(const double* a, const double* b) const {
  double sum = 0;
  for (std::int32_t r = 0; r < now_.row_count; ++r) {
    const LargeRow& row = row_[r];
    for (std::int32_t k = 0; k < 3 && row.group + k < now_.row_count; ++k)
      sum += a[r] * row.compliance[k] * b[row.group + k];
  }
  return sum;
}

bool LargeSolver::factor_contacts() {
  const auto at = [&](std::int32_t i, std::int32_t j) -> double& {
    return contact_[static_cast<std::size_t>(i) * static_cast<std::size_t>(max_rows_) + static_cast<std::size_t>(j)];
  };
  for (std::int32_t i = 0; i < now_.row_count; ++i) {
    for (std::int32_t j = 0; j <= i; ++j) {
      at(i, j) = 0.5 * (on_row(i, responses_[slot_[j]]) + on_row(j, responses_[slot_[i]]));
      const std::int32_t k = j - row_[i].group;
      if (k >= 0 && k < 3) at(i, j) += row_[i].compliance[k];
    }
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

void LargeSolver::solve_contacts(double* x) const {
  const auto row = [&](std::int32_t i) {
    return contact_ + static_cast<std::size_t>(i) * static_cast<std::size_t>(max_rows_);
  };
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
  for (std::int32_t r = 0; r < now_.row_count; ++r) work_[r] += on_row(r, p);
  solve_contacts(work_);
  for (std::int32_t r = 0; r < now_.row_count; ++r) {
    add_multiple(static_cast<float>(-work_[r]), responses_[slot_[r]], length_, p);
    local[r] -= work_[r];
  }
}

// u <- u + Y C^-1 (d - W u - L s), halved until no tetrahedron is nearly flat. False where even no move at all is not finite.
bool LargeSolver::move_to_targets(LargeOutcome* outcome) {
  compliance_times(local_, work_);
  double largest = 0;
  for (std::int32_t r = 0; r < now_.row_count; ++r) {
    work_[r] = row_[r].target - on_row(r, u_) - work_[r];
    largest = std::max(largest, std::abs(work_[r]));
  }
  constexpr double least_move = 1e-9;  // m
  if (largest <= least_move && !rows_changed_ && now_.solved && !std::isnan(largest)) return true;
  now_.solved = 0;
  solve_contacts(work_);
  double share = 1;
  for (int i = 0;; ++i, share = i < 10 ? share / 2 : 0) {
    std::copy(u_, u_ + length_, trial_);
    for (std::int32_t r = 0; r < now_.row_count; ++r) {
      add_multiple(static_cast<float>(share * work_[r]), responses_[slot_[r]], length_, trial_);
      trial_local_[r] = local_[r] + share * work_[r];
    }
    const Elements::Energy found = evaluate(trial_, trial_f_);
    ++outcome->evaluations;
    // Where the body was beyond the limit before, any part of the move is as good as none.
    if (found.least_volume > kLeastVolume || (share == 0 && std::isfinite(found.energy))) {
      now_.energy = found.energy + 0.5 * times_compliance(trial_local_, trial_local_),
      now_.least_volume = found.least_volume;
      break;
    }
    if (share == 0) return false;
  }
  outcome->cut = share < 1;
  std::swap(u_, trial_), std::swap(f_, trial_f_);
  std::swap(local_, trial_local_);
  return true;
}

void LargeSolver::find_multipliers() {
  compliance_times(local_, multiplier_);
  for (std::int32_t r = 0; r < now_.row_count; ++r) multiplier_[r] += dot_product(responses_[slot_[r]], f_, length_);
  solve_contacts(multiplier_);
  std::copy(f_, f_ + length_, g_);
  for (std::int32_t r = 0; r < now_.row_count; ++r) {
    add_row(r, -multiplier_[r], g_);
    local_g_[r] = local_[r] - multiplier_[r];
  }
}

// The direction p from the gradient g. Returns g . p.
double LargeSolver::descend(LargeOutcome*) {
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
  factor_.solve(p_);
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
  if (!(now_.curvature[i] > 1e-12 * now_.energy)) {
    if (full) now_.pair_first = (now_.pair_first + 1) % kPairs, --now_.pair_count;
    return;
  }
  if (full)
    now_.pair_first = (now_.pair_first + 1) % kPairs;
  else
    ++now_.pair_count;
  // The initial matrix is scale K^-1: the tangent of a compressed body is stiffer than K.
  if (now_.pairs_since_scale++ % 10 != 0) return;
  std::copy(changes_[i], changes_[i] + length_, g_);
  std::copy(local_moves_[i], local_moves_[i] + now_.row_count, local_g_);
  factor_.solve(g_);
  project(g_, local_g_);
  const double scaled = dot_product(changes_[i], g_, length_) + times_compliance(local_moves_[i], local_g_);
  const double scale = now_.curvature[i] / scaled;
  now_.scale = scale > 0.02 ? std::min(scale, 1.0) : 0.02;
}

// u <- u - share p with Armijo's rule, share from 1. Returns whether a step was taken.
bool LargeSolver::search(double slope, LargeOutcome* outcome) {
  for (double share = 1; share > 1e-3;) {
    std::copy(u_, u_ + length_, trial_);
    add_multiple(static_cast<float>(-share), p_, length_, trial_);
    for (std::int32_t r = 0; r < now_.row_count; ++r) trial_local_[r] = local_[r] - share * local_p_[r];
    const Elements::Energy found = evaluate(trial_, trial_f_);
    ++outcome->evaluations;
    const double energy = found.energy + 0.5 * times_compliance(trial_local_, trial_local_);
    const bool allowed = found.least_volume > kLeastVolume;
    if (allowed && energy <= now_.energy - 1e-4 * share * slope + kEnergyRounding * std::abs(now_.energy)) {
      now_.energy = energy, now_.least_volume = found.least_volume;
      keep_pair(share);
      std::swap(u_, trial_), std::swap(f_, trial_f_), std::swap(local_, trial_local_);
      return true;
    }
    // The least point of the parabola through both energies and the slope.
    const double least = allowed ? 0.5 * slope * share * share / (energy - now_.energy + slope * share) : 0.5 * share;
    share = std::clamp(least, 0.05 * share, 0.5 * share);
  }
  return false;
}

LargeOutcome LargeSolver::step(const LargeContacts& contacts, std::int32_t most_steps, double* force) {
  LargeOutcome outcome;
  take_rows(contacts);
  if (now_.row_count == 0 && now_.at_rest) return outcome;
  const bool sound = (!rows_changed_ || factor_contacts()) && move_to_targets(&outcome);
  if (sound && !now_.solved) {
    now_.at_rest = 0;
    for (;; ++outcome.steps) {
      find_multipliers();
      if (outcome.steps >= most_steps) break;
      const double slope = descend(&outcome);
      now_.residual = std::sqrt(std::max(slope, 0.0) / std::max(now_.energy, 1e-300));
      now_.solved = slope <= kTolerance * kTolerance * now_.scale * now_.energy;
      if (now_.solved || !std::isfinite(slope)) break;
      if (slope < 0 || !search(slope, &outcome)) {
        if (now_.pair_count == 0) break;
        drop_pairs();
      }
    }
    outcome.unfinished = !now_.solved && !(now_.residual <= kUnfinished);
    if (outcome.cut) now_.solved = 0;
    now_.peak_energy = std::max(now_.peak_energy, now_.energy);
    if (now_.row_count == 0 && now_.energy <= kRestEnergy * now_.peak_energy) forget();
  }
  bool finite = sound && std::isfinite(now_.energy);
  for (std::int32_t r = 0; r < now_.row_count; ++r) finite = finite && std::isfinite(multiplier_[r]);
  if (!finite) {
    forget();
    std::fill(force, force + contacts.row_count, 0.0);
    outcome.failed = true;
    return outcome;
  }
  std::copy(multiplier_, multiplier_ + now_.row_count, force);
  outcome.residual = now_.residual, outcome.least_volume = now_.least_volume;
  return outcome;
}

}  // namespace palpate
