#include "runtime/large/hyperelastic_energy.h"

#include <algorithm>
#include <cmath>

#include "runtime/large/vector_loops.h"

namespace palpate {
namespace {

// Rounding of a preload's energy, from which all others are counted, as a share.
constexpr double kEnergyNoise = 2e-7;
// Of a displacement by the offset, so that what rounding leaves of the gradient counts as none: 40 times its rounding in single precision.
constexpr double kPlaceNoise = 2.5e-6;

void evaluate_plainly(const HyperelasticEnergy::Elements& elements, const float* u, float* f,
                      HyperelasticEnergy::Energy* energy) {
  *energy = elements.evaluate(u, f);
}
#ifdef PALPATE_DISPATCHES
__attribute__((target(PALPATE_AVX2))) void evaluate_with_avx2(const HyperelasticEnergy::Elements& elements,
                                                              const float* u, float* f,
                                                              HyperelasticEnergy::Energy* energy) {
  *energy = elements.evaluate(u, f);
}
#endif

}  // namespace

bool HyperelasticEnergy::place_nodes(SceneMemory& memory, const HyperelasticBody& body, const std::int32_t* order,
                                     std::int32_t order_count, const NewNodes& new_nodes) {
  nodes_ = body.node_count, at_rest_ = order_count, rows_ = order_count + new_nodes.count;
  const auto nodes = static_cast<std::size_t>(nodes_), rows = static_cast<std::size_t>(rows_);
  length_ = (3 * rows + kVectorStep - 1) / kVectorStep * kVectorStep;
  padded_ = std::max(3 * nodes, length_);
  place_ = memory.array<std::int32_t>(nodes);
  if (memory.failed()) return false;
  std::fill(place_, place_ + nodes, -1);
  for (std::int32_t i = 0; i < order_count; ++i) place_[order[i]] = i;
  for (std::int32_t i = 0; i < new_nodes.count; ++i) place_[new_nodes.first + i] = order_count + i;
  std::int32_t held_place = rows_;
  for (std::size_t n = 0; n < nodes; ++n)
    if (place_[n] < 0) place_[n] = held_place++;
  return true;
}

void HyperelasticEnergy::reorder(const std::int32_t* improved) {
  for (std::int32_t n = 0; n < nodes_; ++n)
    if (place_[n] < at_rest_) place_[n] = improved[place_[n]];
}

bool HyperelasticEnergy::create(SceneMemory& memory, const HyperelasticBody& body, bool has_preload,
                                const NewNodes& new_nodes) {
  if (!elements_.create(memory, body, place_, rows_, new_nodes.count) || !take_supports(memory, body)) return false;
  if (new_nodes.count > 0) {
    new_.origin = memory.array<std::int32_t>(static_cast<std::size_t>(nodes_));
    for (std::int32_t n = 0; n < nodes_ && new_.origin; ++n) new_.origin[n] = n;
    if (has_preload) new_.load = memory.array<float>(length_);
  }
  held_ = memory.array<std::int32_t>(3 * static_cast<std::size_t>(rows_));
  if (has_preload) base_ = memory.array<float>(padded_), absolute_ = memory.array<float>(padded_);
  if (memory.failed()) return false;
  for (std::int32_t n = 0; n < nodes_; ++n)
    for (int i = 0; i < 3; ++i)
      if (place_[n] < at_rest_ && body.fixed[3 * static_cast<std::size_t>(n) + static_cast<std::size_t>(i)])
        held_[held_count_++] = 3 * place_[n] + i;
  new_.held = held_count_;
  return true;
}

// A new node has what the node that it comes from has, but for its tetrahedra, supports and loads.
void HyperelasticEnergy::split(const MeshFollower::Split& split) {
  const std::int32_t from = place_[split.from], to = place_[split.node];
  new_.origin[split.node] = new_.origin[split.from], ++new_.made;
  for (int i = 0; i < 3; ++i) {
    const bool is_held = from >= rows_ || std::find(held_, held_ + held_count_, 3 * from + i) != held_ + held_count_;
    if (is_held) held_[held_count_++] = 3 * to + i;
  }
  for (float* const by : {base_, offset_.by})
    if (by) std::copy_n(by + 3 * static_cast<std::size_t>(from), 3, by + 3 * static_cast<std::size_t>(to));
  elements_.split(from, to, split.tetrahedra, split.count);
  pressures_.split(from, to, split.tetrahedra, split.count);
}

void HyperelasticEnergy::take_loads(const MeshFollower::DividedLoad* loads, std::int32_t count) {
  new_.loads = loads, new_.load_count = count;
  if (load_) {
    std::copy_n(new_.load, length_, load_);
    divide(&LoadShare::in_volume, load_);
  }
  if (offset_.acts) sum_loads();
}

// load: [length] N, as the uncut mesh has it.
void HyperelasticEnergy::divide(double LoadShare::*share, float* load) const {
  for (std::int32_t k = 0; k < new_.load_count; ++k) {
    const MeshFollower::DividedLoad& of = new_.loads[k];
    const std::int32_t from = place_[of.at_rest], to = place_[of.node];
    for (int i = 0; i < 3 && from < rows_ && to < rows_; ++i)
      load[3 * to + i] = static_cast<float>(of.share.*share * static_cast<double>(load[3 * from + i]));
  }
}

void HyperelasticEnergy::forget_changes() {
  if (!new_.origin) return;
  for (std::int32_t n = 0; n < nodes_; ++n) new_.origin[n] = n;
  new_.made = new_.load_count = 0, new_.removed = false, new_.supports = nullptr;
  if (load_) std::copy_n(new_.load, length_, load_);
  pressures_.forget_changes();
  held_count_ = new_.held;
  elements_.forget_changes();
  if (offset_.acts) sum_loads();
}

bool HyperelasticEnergy::take_supports(SceneMemory& memory, const HyperelasticBody& body) {
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
double HyperelasticEnergy::add_supports(const float* u, float* f) const {
  double twice = 0;
  if (new_.supports) {
    for (std::int32_t p = 0; p < new_.support_count; ++p) {
      const MeshFollower::Support& support = new_.supports[p];
      twice += add_support(place_[support.node], place_[support.other], support.block.m[0], u, f);
    }
    return twice / 2;
  }
  for (std::int32_t p = 0; p < support_count_; ++p)
    twice += add_support(support_place_[2 * p], support_place_[2 * p + 1],
                         support_stiffness_ + 9 * static_cast<std::size_t>(p), u, f);
  return twice / 2;
}

// J, twice the energy of a pair of places; k: [3][3] N/m, in the rows of a.
double HyperelasticEnergy::add_support(std::int32_t a, std::int32_t b, const double* k, const float* u,
                                       float* f) const {
  float at_a[3], at_b[3];  // from where they are slack
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t of_a = 3 * static_cast<std::size_t>(a) + i, of_b = 3 * static_cast<std::size_t>(b) + i;
    at_a[i] = base_ ? base_[of_a] + u[of_a] : u[of_a], at_b[i] = base_ ? base_[of_b] + u[of_b] : u[of_b];
  }
  double on_a[3], on_b[3], twice = 0;
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
  return twice;
}

bool HyperelasticEnergy::take_load(SceneMemory& memory, const HyperelasticBody& body, const BlockRows& stiffness,
                                   const double* preload) {
  SceneMemory scratch = memory.of_same_host();
  double* const moved = scratch.array<double>(3 * static_cast<std::size_t>(at_rest_));
  load_ = memory.array<float>(length_);
  const bool made = moved && load_;
  for (std::int32_t n = 0; made && n < nodes_; ++n)
    for (std::size_t i = 0; i < 3 && place_[n] < at_rest_; ++i)
      moved[3 * static_cast<std::size_t>(place_[n]) + i] = preload[3 * static_cast<std::size_t>(n) + i];
  if (made) multiply(stiffness, moved, at_rest_, load_), clear_held_dofs(body, load_);
  scratch.release_all();
  return made;
}

// load: [length] N, becomes what the elements bear at rest of a force whose displacement is `row`, [3 nodes] m by places: all that soft supports do
// not bear. It does not have the rounding of that displacement, as the stiffness times the row has.
void HyperelasticEnergy::take_force(const RowForce& force, const double* row, float* load) const {
  std::fill(load, load + length_, 0.0f);
  for (std::int32_t k = 0; k < force.count; ++k)
    if (const std::int32_t at = place_[force.node[k]]; at < rows_)
      load[3 * at + force.axis] = static_cast<float>(force.weight[k]);
  const auto subtract = [&](std::int32_t from, std::int32_t of, const double* k, int along, int across) {
    for (int i = 0; i < 3 && from < rows_; ++i)
      for (int j = 0; j < 3; ++j)
        load[3 * from + i] -= static_cast<float>(k[along * i + across * j] * row[3 * static_cast<std::size_t>(of) + j]);
  };
  for (std::int32_t p = 0; p < support_count_; ++p) {
    const std::int32_t a = support_place_[2 * p], b = support_place_[2 * p + 1];
    const double* const k = support_stiffness_ + 9 * static_cast<std::size_t>(p);
    subtract(a, b, k, 3, 1);
    if (a != b) subtract(b, a, k, 1, 3);
  }
}

void HyperelasticEnergy::clear_held_dofs(const HyperelasticBody& body, float* f) const {
  for (std::int32_t n = 0; n < nodes_; ++n)
    for (std::size_t i = 0; i < 3; ++i)
      if (place_[n] < at_rest_ && body.fixed[3 * static_cast<std::size_t>(n) + i])
        f[3 * static_cast<std::size_t>(place_[n]) + i] = 0;
}

bool HyperelasticEnergy::take_offset(SceneMemory& memory, const HyperelasticBody& body, const OffsetRows& rows) {
  Offset& of = offset_;
  const auto count = static_cast<std::size_t>(rows.count), nodes = static_cast<std::size_t>(nodes_);
  of.loads = memory.array<float>(count * length_), of.load = memory.array<float>(length_);
  of.roughness = memory.array<double>(count), of.amounts = memory.array<double>(count);
  of.by = memory.array<float>(padded_);
  if (new_.origin) of.supports = memory.array<float>(count * length_);
  memory.keep_array(of.amounts, count);
  if (!absolute_) absolute_ = memory.array<float>(padded_);
  SceneMemory scratch = memory.of_same_host();
  // The elements alone, with nothing held: the columns of held nodes count.
  HyperelasticBody bare = body;
  bare.fixed = scratch.array<std::uint8_t>(3 * nodes), bare.support_count = 0;
  double* const row = scratch.array<double>(3 * nodes);
  BlockRows stiffness;
  const bool made = pressures_.create(memory, rows, body, new_.origin ? rows_ - at_rest_ : 0, place_) &&
                    !memory.failed() && !scratch.failed() &&
                    assemble_stiffness(scratch, bare, place_, nodes_, &stiffness);
  if (made) rest_pressures();
  for (std::int32_t m = 0; made && m < rows.count; ++m) {
    for (std::int32_t n = 0; n < nodes_; ++n) store3(rows.at(m, n), row + 3 * static_cast<std::size_t>(place_[n]));
    float* const load = of.loads + static_cast<std::size_t>(m) * length_;
    multiply(stiffness, row, at_rest_, load);
    if (rows.is_of_force(m)) take_force(rows.force[m], row, load);
    if (rows.is_of_pressure(m)) take_force({}, row, load);  // what acts on its surface is added in each state
    clear_held_dofs(body, load);
    if (of.supports) {
      float* const by_supports = of.supports + static_cast<std::size_t>(m) * length_;
      take_force({}, row, by_supports), clear_held_dofs(body, by_supports);
    }
    double sum = 0;
    for (std::int32_t r = 0; r < at_rest_; ++r)
      for (std::size_t i = 0; i < 3; ++i) {
        const double u = row[3 * static_cast<std::size_t>(r) + i];
        sum += 0.5 * stiffness.block[9 * static_cast<std::size_t>(stiffness.index_of(r, r)) + 4 * i] * u * u;
      }
    of.roughness[m] = std::sqrt(sum);
  }
  scratch.release_all();
  if (made) of.rows = rows;
  return made;
}

void HyperelasticEnergy::move(const double* from, const double* to, double share) {
  Offset& of = offset_;
  of.acts = false;
  double rough = 0;
  for (std::int32_t m = 0; m < of.rows.count; ++m) {
    of.amounts[m] = share == 1 ? to[m] : from[m] + share * (to[m] - from[m]);
    of.acts = of.acts || of.amounts[m] != 0;
    rough += std::fabs(of.amounts[m]) * of.roughness[m];
  }
  of.noise = kPlaceNoise * kPlaceNoise * rough * rough;
  if (!of.acts) return pressures_.count_from([&](std::int32_t place) { return displaced(place, nullptr, false); });
  for (std::int32_t n = 0; n < nodes_; ++n) {
    const Vec3 at = of.rows.sum_at(of.amounts, new_.origin ? new_.origin[n] : n);
    for (int i = 0; i < 3; ++i)
      of.by[3 * static_cast<std::size_t>(place_[n]) + static_cast<std::size_t>(i)] = static_cast<float>(at[i]);
  }
  sum_loads();
  pressures_.count_from([&](std::int32_t place) { return displaced(place, nullptr, true); });
}

void HyperelasticEnergy::sum_loads() {
  Offset& of = offset_;
  std::fill(of.load, of.load + length_, 0.0f);
  if (new_.supports) return sum_divided_loads();
  for (std::int32_t m = 0; m < of.rows.count; ++m)
    if (of.amounts[m] != 0) add_row(of.amounts[m], of.loads, m, of.load);
}

void HyperelasticEnergy::add_row(double amount, const float* rows, std::int32_t m, float* sum) const {
  add_multiple(static_cast<float>(amount), rows + static_cast<std::size_t>(m) * length_, length_, sum);
}

// Divides the forces from outside; absolute_ sums those in the volume. Then it takes off what the soft supports that the cut has left bear of o.
void HyperelasticEnergy::sum_divided_loads() {
  Offset& of = offset_;
  std::fill(absolute_, absolute_ + length_, 0.0f);
  for (std::int32_t m = 0; m < of.rows.count; ++m) {
    if (of.amounts[m] == 0) continue;
    float* const sum = of.rows.is_in_volume(m) ? absolute_ : of.load;
    add_row(of.amounts[m], of.loads, m, sum), add_row(-of.amounts[m], of.supports, m, sum);
  }
  divide(&LoadShare::on_surface, of.load), divide(&LoadShare::in_volume, absolute_);
  add_multiple(1, absolute_, length_, of.load);
  const auto at = [&](std::int32_t place) {
    const float* const u = of.by + 3 * static_cast<std::size_t>(place);
    return Vec3{static_cast<double>(u[0]), static_cast<double>(u[1]), static_cast<double>(u[2])};
  };
  const auto subtract = [&](std::int32_t place, Vec3 force) {
    for (int i = 0; i < 3 && place < rows_; ++i) of.load[3 * place + i] -= static_cast<float>(force[i]);
  };
  for (std::int32_t p = 0; p < new_.support_count; ++p) {
    const MeshFollower::Support& support = new_.supports[p];
    const std::int32_t a = place_[support.node], b = place_[support.other];
    subtract(a, support.block * at(b));
    if (a != b) subtract(b, transposed_times(support.block, at(a)));
  }
  clear_held(of.load);
}

// m, from the mesh: of where the body rests, with the offset, and with a displacement u by places; nullptr: zero. In the order and the precision
// of evaluate(), so that a restored state has the same bits.
Vec3 HyperelasticEnergy::displaced(std::int32_t place, const float* u, bool with_offset) const {
  Vec3 sum;
  for (int i = 0; i < 3; ++i) {
    const std::size_t at = 3 * static_cast<std::size_t>(place) + static_cast<std::size_t>(i);
    float displaced = u ? u[at] : 0.0f;
    if (base_) displaced = base_[at] + displaced;
    if (with_offset && offset_.acts) displaced = offset_.by[at] + displaced;
    sum[i] = static_cast<double>(displaced);
  }
  return sum;
}

void HyperelasticEnergy::rest_pressures() {
  pressures_.rest_at([&](std::int32_t place) { return displaced(place, nullptr, false); });
}

void HyperelasticEnergy::take_state(const float* u) {
  pressures_.take([&](std::int32_t place) { return displaced(place, u, true); });
}

void HyperelasticEnergy::rest_at(const float* u, float* force) {
  load_share_ = 0;
  base_energy_ = evaluate(u, force).energy;  // of the body alone, like its forces
  std::copy(u, u + length_, base_);
  std::copy(force, force + length_, load_);
  if (new_.load) std::copy(force, force + length_, new_.load);
  load_share_ = 1, noise_ = kEnergyNoise * base_energy_;
}

// [padded] m, u from where the mesh is at rest.
const float* HyperelasticEnergy::from_mesh(const float* u) const {
  for (const float* const by : {base_, offset_.acts ? offset_.by : nullptr}) {
    if (!by) continue;
    for (std::size_t i = 0; i < 3 * static_cast<std::size_t>(nodes_); ++i) absolute_[i] = by[i] + u[i];
    u = absolute_;
  }
  return u;
}

double HyperelasticEnergy::turned_shear(const float* u, const float* move) {
  return elements_.turned_shear(from_mesh(u), move);
}

HyperelasticEnergy::Energy HyperelasticEnergy::evaluate(const float* u, float* f) {
  Energy energy;
  const float* const from_rest = u;
  u = from_mesh(u);
#ifdef PALPATE_DISPATCHES
  if (best_instructions() != Instructions::baseline)
    evaluate_with_avx2(elements_, u, f, &energy);
  else
#endif
    evaluate_plainly(elements_, u, f, &energy);
  energy.energy += add_supports(from_rest, f);
  if (load_) {
    energy.energy -= base_energy_ + load_share_ * dot_product(load_, from_rest, length_);
    add_multiple(static_cast<float>(-load_share_), load_, length_, f);
  }
  if (offset_.acts) {
    energy.energy -= dot_product(offset_.load, from_rest, length_);
    add_multiple(-1, offset_.load, length_, f);
  }
  if (pressures_.count() > 0) energy.energy += pressures_.evaluate(u, offset_.amounts, rows_, f);
  clear_held(f);
  if (!std::isfinite(energy.energy)) energy.least_volume = 0;
  return energy;
}

}  // namespace palpate
