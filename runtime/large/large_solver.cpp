#include "runtime/large/large_solver.h"

#include <algorithm>
#include <cmath>

#include "runtime/large/vector_loops.h"

namespace palpate {
namespace {

// Below this share of the largest energy since rest a body on which nothing acts from outside is at rest: its displacements are 1e-5 of the largest.
constexpr double kRestEnergy = 1e-10;
// J: moves a node with a stiffness of 0.01 N/m by 1e-14 m. Smaller energies end below what single precision can hold.
constexpr double kNoEnergy = 1e-30;
// Rounding of the energy in single precision, as a share.
constexpr double kEnergyRounding = 1e-6;
// Of the method, at targets that stand still, to kStillTolerance; after them the state counts as solved.
constexpr std::int32_t kMostStillSteps = 400;
// A step that is given up leaves the next one a fourth of its reach. After one with this reach or less the next step does not move at all: it
// brings the body nearer to its solution where it is.
constexpr double kLeastReach = 1.0 / 1024;
// A residual is divided by no smaller gamma: in tissue that has stiffened K^-1 tells too much.
constexpr double kLeastTold = 0.02;
// A search ends at this share. Without pairs gamma is 1, and a step in K^-1 some 10^4 times too long where tissue has stiffened.
constexpr double kLeastShare = 1e-6;
// The rest state under a preload is solved to this share, where a step is to LargeSolver::kTolerance.
constexpr double kRestTolerance = 1e-4;
// It counts as found from this share on, where rounding in single precision lets it come no nearer: its force is then the load's but for
// about as much.
constexpr double kRestEnough = 2e-3;
// Of the stiffness k of a volume that is held, times the body's compliance to it: each correction of its multiplier leaves 1 / kHeldStiffness of what
// the volume was off.
constexpr double kHeldStiffness = 30;
// The metric takes the gradient of a held volume anew where its direction has turned by this cosine.
constexpr double kTurnedCosine = 0.98;

// The tangent K(u) knows no contact. Where jaws press a slender part flat, it is hardly definite without them, and moves along its softest mode
// cancel in single precision. A metric in which the place of a contact is softer than at rest by more than this factor is replaced by that of rest.
constexpr double kMostSoftening = 4;

}  // namespace

LargeSolver::Created LargeSolver::create(SceneMemory& memory, const HyperelasticBody& body, const std::int32_t* order,
                                         std::int32_t order_count, std::int32_t max_rows, std::int32_t max_nodes,
                                         const double* preload, bool renews, std::int64_t fewest_for_rough,
                                         const NewNodes& new_nodes) {
  if (!energy_.place_nodes(memory, body, order, order_count, new_nodes)) return Created::no_memory;
  switch (metric_.create(memory, body, &energy_, preload, renews, fewest_for_rough)) {
    case BodyMetric::Made::no_memory:
      return Created::no_memory;
    case BodyMetric::Made::not_definite:
      return Created::not_definite;
    case BodyMetric::Made::yes:
      break;
  }
  if (!energy_.create(memory, body, preload != nullptr, new_nodes) ||
      !rows_.create(memory, &energy_, &metric_, max_rows, max_nodes) ||
      !pairs_.create(memory, energy_.length(), &rows_) || !soft_.create(memory, &energy_, &metric_, &rows_) ||
      !create_vectors(memory))
    return Created::no_memory;
  forget();
  if (preload && !find_rest()) return Created::no_equilibrium;
  keep(memory);
  return Created::made;
}

bool LargeSolver::create_vectors(SceneMemory& memory) {
  for (float** vector : {&u_, &trial_, &u_before_}) *vector = memory.array<float>(energy_.padded());
  for (float** vector : {&f_, &trial_f_, &g_, &p_, &image_, &f_before_})
    *vector = memory.array<float>(energy_.length());
  RowVectors& of = of_rows_;
  for (double** vector : {&of.local, &of.other_local, &of.trial_local, &of.local_before, &of.multiplier, &of.g, &of.p,
                          &of.work, &of.work2})
    *vector = memory.array<double>(static_cast<std::size_t>(rows_.most()));
  return !memory.failed();
}

// Takes steps under a share of the load until the state is solved to tolerance_. False where it does not come to kRestEnough, or where a
// tetrahedron is flat.
bool LargeSolver::settle(double load_share) {
  constexpr int most_rounds = 60;
  energy_.set_load_share(load_share);
  now_.solved = 0;
  for (int round = 0; round < most_rounds && !now_.solved; ++round) {
    LargeOutcome outcome;
    const HyperelasticEnergy::Energy found = energy_.evaluate(u_, f_);
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
    std::copy(u_, u_ + energy_.length(), u_before_);
    tolerance_ = next < 1 ? kTolerance : kRestTolerance;
    if (settle(next)) {
      reached = next, way = std::min(2 * way, longest);
      continue;
    }
    if (way <= shortest) return false;
    way /= 2;
    std::copy(u_before_, u_before_ + energy_.length(), u_);
    pairs_.drop();
  }
  tolerance_ = kTolerance;
  energy_.rest_at(u_, trial_f_);
  forget();
  return true;
}

void LargeSolver::keep(SceneMemory& memory) {
  const auto rows = static_cast<std::size_t>(rows_.most());
  memory.keep(now_);
  memory.keep_array(u_, energy_.length()), memory.keep_array(f_, energy_.length());
  memory.keep_array(of_rows_.local, rows), memory.keep_array(of_rows_.multiplier, rows);
  pairs_.keep_state(memory);
  soft_.keep(memory);
  rows_.keep(memory);
  metric_.keep(memory);
}

bool LargeSolver::take_offset(SceneMemory& memory, const HyperelasticBody& body, const OffsetRows& rows) {
  memory.keep(moved_.given);
  if (!energy_.take_offset(memory, body, rows)) return false;
  const std::int32_t pressures = energy_.pressures().count();
  if (pressures == 0) return true;
  energy_.pressures().keep(memory);
  if (!metric_.held().create(memory, pressures, energy_.length())) return false;
  metric_.held().keep(memory);
  return true;
}

void LargeSolver::restored() {
  energy_.restored(u_);
  metric_.restored();
  take_volumes(false);
  rows_.restored();
}

void LargeSolver::renew() {
  if (!metric_.renews() || energy_.is_changed() || (now_.at_rest && !metric_.is_renewed() && !metric_.has_begun()))
    return;
  if (!metric_.has_begun()) pairs_.mark();
  if (!metric_.renew(u_)) return;
  // Pairs are samples of the tangent, whatever the metric. Those from before the new metric's state go: the new metric is the tangent of a
  // later state. Their scale was that of the metric before.
  pairs_.take_metric();
  soft_.forget();
  take_volumes(false);
  rows_.find_all_responses();
  if (rows_.most_softening() > kMostSoftening) leave_metric();
}

void LargeSolver::leave_metric() {
  metric_.forget();
  pairs_.drop();
  soft_.forget();
  take_volumes(false);
  rows_.find_all_responses();
}

void LargeSolver::come_to_rest() {
  std::fill(u_, u_ + std::max(3 * static_cast<std::size_t>(energy_.nodes()), energy_.length()), 0.0f);
  std::fill(f_, f_ + energy_.length(), 0.0f);
  for (double* vector : {of_rows_.local, rows_.applied(), of_rows_.multiplier})
    std::fill(vector, vector + rows_.most(), 0.0);
  pairs_.drop();
  now_.pairs_of_other_contacts = 0;
  now_.solved = now_.at_rest = 1;
  now_.energy = now_.peak_energy = now_.residual = 0, now_.least_volume = now_.reach = 1;
  now_.alone = now_.still = 0;
  const double unmoved[kMostOffsetRows] = {};
  energy_.move(unmoved, unmoved, 1);
  energy_.rest_pressures();
  moved_ = {};
  soft_.forget();
  const bool held = metric_.held().count() > 0;
  metric_.held().clear();
  if (metric_.forget() || held) rows_.find_all_responses();
}

void LargeSolver::forget() {
  rows_.forget();
  come_to_rest();
}

bool LargeSolver::is_moved_from_outside() const {
  return energy_.is_moved() || energy_.pressures().act() || (energy_.has_load() && energy_.is_changed());
}

// No row holds or pushes the body, and nothing moves it from outside.
bool LargeSolver::nothing_acts() const {
  if (is_moved_from_outside()) return false;
  for (std::int32_t r = 0; r < rows_.count(); ++r)
    if (rows_.holds(r) || rows_.applied()[r] != 0) return false;
  return true;
}

double LargeSolver::little_energy() const {
  return kRestEnergy * now_.peak_energy + kNoEnergy;
}

// The state of rest meets all rows but for what gives no energy: so lips, jaws and links that nothing pulls may press on for ever, with forces that each
// step makes smaller, until they are too small for numbers.
bool LargeSolver::rest_is_balance() const {
  if (is_moved_from_outside()) return false;
  for (std::int32_t r = 0; r < rows_.count(); ++r) {
    const double applied = rows_.applied()[r];
    if (rows_.holds(r) ? rows_.row(r).target != 0
                       : 0.5 * applied * applied * rows_.compliance().entry(r, r) > little_energy())
      return false;
  }
  return true;
}

void LargeSolver::write_beyond_linear(const double* force, std::int32_t count, float* out) {
  std::copy(u_, u_ + 3 * static_cast<std::size_t>(energy_.nodes()), trial_);
  rows_.add_rest_responses(force, -1, trial_);
  for (std::int32_t n = 0; n < count; ++n)
    std::copy_n(trial_ + 3 * static_cast<std::size_t>(energy_.place(n)), 3, out + 3 * static_cast<std::size_t>(n));
}

// ---- a step --------------------------------------------------------------------------------------------------------

// The displacement from the offset stays: the linear body's would.
void LargeSolver::move_by(const double* amounts, const RowVolume* volumes) {
  const std::int32_t count = energy_.offset_rows();
  SurfacePressures& pressures = energy_.pressures();
  moved_.now = moved_.cut = false;
  const bool begun = volumes && begin_volumes(volumes);
  if (!begun && std::equal(amounts, amounts + count, energy_.amounts()) && has_volumes(volumes)) return;
  double from[kMostOffsetRows], volume[kMostOffsetRows];
  std::copy_n(energy_.amounts(), count, from);
  for (std::int32_t i = 0; i < pressures.count(); ++i) volume[i] = pressures.held(i).volume;
  const auto try_share = [&](double share) {
    energy_.move(from, amounts, share);
    for (std::int32_t i = 0; i < pressures.count(); ++i)
      pressures.held(i).volume = volume[i] + share * (volumes[pressures.row(i)].target - volume[i]);
    ++moved_.evaluations;
    return energy_.evaluate(u_, trial_f_);
  };
  const double least = std::min(kLeastVolume, now_.least_volume);
  double share = now_.reach;
  HyperelasticEnergy::Energy found;
  const auto may_stay = [&] { return found.least_volume > least && std::isfinite(found.energy); };
  for (int i = 0; i < 10 && share > 0; ++i, share /= 2)
    if (found = try_share(share); may_stay()) break;
  if (!may_stay()) found = try_share(share = 0);
  const double energy = found.energy + 0.5 * rows_.times_compliance(of_rows_.local, of_rows_.local);
  moved_.cut = share < 1;
  if (share == 0 && !begun) return;
  moved_.given += energy - now_.energy;
  now_.energy = energy, now_.least_volume = found.least_volume;
  std::swap(f_, trial_f_);
  energy_.accept();
  now_.solved = now_.at_rest = 0;
  moved_.now = true;
}

// ---- the mesh is cut -----------------------------------------------------------------------------------------------

MeshFollower::Layout LargeSolver::follow_mesh(AddedCompliance* added) {
  metric_.add(added);
  return {energy_.places(), energy_.rows_at_rest(), energy_.length()};
}

void LargeSolver::split(const MeshFollower::Split& split, bool replayed) {
  energy_.split(split);
  if (!replayed) std::copy_n(u_ + at(split.from), 3, u_ + at(split.node));
}

// The state stays where it is. What it has more or less of energy, nobody's force has done: a site that averages over fewer tetrahedra has more.
void LargeSolver::changed(bool replayed) {
  metric_.forget();
  if (replayed) return;
  pairs_.drop();
  soft_.forget();
  const bool rested = now_.at_rest != 0 && !energy_.has_load();
  const HyperelasticEnergy::Energy found = energy_.evaluate(u_, f_);
  const double energy = found.energy + 0.5 * rows_.times_compliance(of_rows_.local, of_rows_.local);
  moved_.given += energy - now_.energy;
  ++moved_.evaluations;
  now_.energy = energy, now_.least_volume = found.least_volume;
  energy_.accept();
  if (!rested) now_.solved = now_.at_rest = 0, now_.alone = 0;
  take_volumes(false);
  rows_.find_other_responses();
}

// ---- volumes that are held -----------------------------------------------------------------------------------------

bool LargeSolver::has_volumes(const RowVolume* volumes) const {
  const SurfacePressures& pressures = energy_.pressures();
  for (std::int32_t i = 0; i < pressures.count(); ++i)
    if (pressures.held(i).volume != volumes[pressures.row(i)].target) return false;
  return true;
}

// Pressures begin to hold their volumes, and others go on as they are. True where the energy of the state has changed.
bool LargeSolver::begin_volumes(const RowVolume* volumes) {
  SurfacePressures& pressures = energy_.pressures();
  bool others = false, turned = false;
  for (std::int32_t i = 0, k = 0; i < pressures.count(); ++i)
    if (pressures.held(i).stiffness > 0) turned = has_turned(i, k++) || turned;
  for (std::int32_t i = 0; i < pressures.count(); ++i) {
    SurfacePressures::Held& held = pressures.held(i);
    const bool holds = volumes[pressures.row(i)].holds != 0;
    if (holds == (held.stiffness > 0)) continue;
    others = true;
    if (holds)
      held.volume = held.swept, held.stiffness = 1;  // which take_volumes() replaces
    else
      held.multiplier += held.stiffness * pressures.left(i), held.stiffness = 0;
  }
  if (!others && !turned) return false;
  pairs_.drop();
  soft_.forget();
  take_volumes(true);
  rows_.find_all_responses();
  return true;
}

// The gradient of pressure i, from that which the metric has as number k.
bool LargeSolver::has_turned(std::int32_t i, std::int32_t k) {
  const float* const a = metric_.held().gradient(k);
  const std::size_t length = energy_.length();
  std::fill(g_, g_ + length, 0.0f);
  energy_.add_volume_gradient(i, 1, g_);
  const double along = dot_product(a, g_, length);
  return !(along > 0 &&
           along * along > kTurnedCosine * kTurnedCosine * dot_product(a, a, length) * dot_product(g_, g_, length));
}

// What the metric has of them: of the state as it is, or of gradients and stiffnesses that are kept.
void LargeSolver::take_volumes(bool anew) {
  SurfacePressures& pressures = energy_.pressures();
  HeldVolumes& of = metric_.held();
  if (anew) of.clear();
  double stiffness[kMostOffsetRows];
  const std::size_t length = energy_.length();
  for (std::int32_t i = 0, k = 0; i < pressures.count(); ++i) {
    SurfacePressures::Held& held = pressures.held(i);
    if (!(held.stiffness > 0)) continue;
    if (anew) {
      of.add();
      std::fill(of.gradient(k), of.gradient(k) + length, 0.0f);
      energy_.add_volume_gradient(i, 1, of.gradient(k));
    }
    std::copy(of.gradient(k), of.gradient(k) + length, of.response(k));
    float* response = of.response(k);
    metric_.solve_unheld(&response, 1);
    if (const double compliance = of.compliance(k, k); anew && compliance > 0)
      held.stiffness = kHeldStiffness / compliance;
    stiffness[k++] = held.stiffness;
  }
  of.factor(stiffness);
}

// The multipliers take what their stiffness bears.
void LargeSolver::correct_volumes() {
  SurfacePressures& pressures = energy_.pressures();
  for (std::int32_t i = 0; i < pressures.count(); ++i) {
    SurfacePressures::Held& held = pressures.held(i);
    const double left = pressures.left(i), change = held.stiffness * left;
    if (change == 0) continue;
    held.multiplier += change;
    now_.energy += change * left, moved_.given += change * left;
    energy_.add_volume_gradient(i, -change, f_);
  }
}

// As a share of what the triangles have swept.
double LargeSolver::worst_volume() const {
  const SurfacePressures& pressures = energy_.pressures();
  double worst = 0;
  for (std::int32_t i = 0; i < pressures.count(); ++i) {
    if (!(pressures.held(i).stiffness > 0)) continue;
    if (const double gross = pressures.gross(i); gross > 0)
      worst = std::max(worst, std::fabs(pressures.left(i)) / gross);
  }
  return worst;
}

void LargeSolver::tell_volumes(RowVolume* volumes) const {
  const SurfacePressures& pressures = energy_.pressures();
  for (std::int32_t i = 0; i < pressures.count(); ++i) {
    RowVolume& told = volumes[pressures.row(i)];
    told.pressure = pressures.pressure(i, energy_.amounts());
    told.beyond = told.pressure - energy_.amounts()[pressures.row(i)];
    told.swept = pressures.held(i).swept;
  }
}

bool LargeSolver::take(const LargeContacts& contacts) {
  const LargeRows::Changed changed = rows_.take(contacts, &of_rows_.local, &of_rows_.other_local);
  rows_changed_ = changed.rows;
  begin_step();
  if (!changed.rows) return true;
  // The pairs stay samples of the body's tangent, but their moves may move the new rows.
  now_.pairs_of_other_contacts = pairs_.count() > 0;
  if (changed.spots) {
    rows_.find_new_responses();
    pairs_.forget_local_moves();
    soft_.forget_local_moves();
    if (metric_.is_renewed() && rows_.most_softening() > kMostSoftening) leave_metric();
  }
  return rows_.fill_compliance();
}

void LargeSolver::find_free(double* free) const {
  rows_.responses_times(f_, free);
  for (std::int32_t r = 0; r < rows_.count(); ++r) free[r] = rows_.on_row(r, u_) - free[r];
}

// Of the energy that the linear response expects of a move: beyond, the move is shortened. kMoreEnergy: of the part that grows with
// the square of the move, by how much the body may be stiffer than at rest; kMoreOfAll: of the energy that the body has.
constexpr double kMoreEnergy = 4, kMoreOfAll = 0.1;

// Which rows hold, and what the others' forces change by, in of_rows_.work2. True where the rows that hold are others than before.
bool LargeSolver::set_held(const std::uint8_t* holds, const double* start) {
  bool others = false;
  for (std::int32_t r = 0; r < rows_.count(); ++r) {
    const std::uint8_t held = !holds || holds[r] ? 1 : 0;
    others = others || rows_.holds()[r] != held;
    rows_.holds()[r] = held, rows_.applied()[r] = 0;
    of_rows_.work2[r] = held ? 0 : -start[r];
    if (!held) of_rows_.local[r] = 0;
  }
  if (others) {
    now_.pairs_of_other_contacts = pairs_.count() > 0;
    pairs_.forget_local_moves();
    soft_.forget_local_moves();
  }
  return others;
}

// How far the rows that hold are to move, in of_rows_.work, m. Returns the longest way, that of the others by their forces included.
double LargeSolver::find_move(const double* place) {
  double *const move = of_rows_.work, *const change = of_rows_.work2, largest = 0;
  rows_.compliance_times(of_rows_.local, move);
  for (std::int32_t r = 0; r < rows_.count(); ++r) {
    const double* const c = rows_.compliance().row(r);
    if (!rows_.holds(r)) {
      largest = std::max(largest, std::abs(change[r]) * c[r]);
      continue;
    }
    move[r] = (place ? place[r] : rows_.row(r).target) - on_row(r) - move[r];
    for (std::int32_t k = 0; k < rows_.count(); ++k)
      if (change[k] != 0) move[r] -= c[k] * change[k];
    // L takes the whole of a given force, of which `change` has a part.
    for (std::int32_t k = 0; rows_.has_beside() && k < rows_.count(); ++k)
      if (!rows_.holds(k)) move[r] -= rows_.beside(r, k) * (rows_.applied()[k] - change[k]);
    largest = std::max(largest, std::abs(move[r]));
  }
  return largest;
}

bool LargeSolver::hold(const std::uint8_t* holds, const double* place, const double* start, LargeOutcome* outcome) {
  const bool other_rows = set_held(holds, start);
  if ((other_rows || rows_changed_) && !rows_.factor()) return false;
  constexpr double least_move = 1e-9;  // m
  still_ = find_move(place) <= least_move && !rows_changed_ && !other_rows && !moved_.now;
  if (still_ && now_.solved == 2) return true;
  rows_changed_ = false;
  now_.solved = 0;
  if (!still_) now_.still = 0;
  rows_.solve(of_rows_.work);
  for (std::int32_t r = 0; r < rows_.count(); ++r)
    if (!rows_.holds(r)) of_rows_.work[r] = of_rows_.work2[r];
  return move(outcome);
}

// u <- u + Y x, where the forces x of all rows move those that hold to their places; halved until the energy is near what the linear
// response expects, and no tetrahedron nearly flat. False where even no move at all is not finite.
bool LargeSolver::move(LargeOutcome* outcome) {
  const double* const move = of_rows_.work;
  const std::size_t length = energy_.length();
  double squared = 0;  // J, twice what a move of the body alone would take at rest
  for (std::int32_t r = 0; r < rows_.count(); ++r) {
    const double* const c = rows_.compliance().row(r);
    for (std::int32_t k = 0; k < rows_.count(); ++k) squared += move[r] * c[k] * move[k];
  }
  const double of_body = now_.energy - 0.5 * rows_.times_compliance(of_rows_.local, of_rows_.local);
  double slope = 0;  // J, of the body's energy along the whole move
  double share = now_.reach;
  for (int i = 0;; ++i, share = i < 10 ? share / 2 : 0) {
    std::copy(u_, u_ + length, trial_);
    rows_.add_responses(move, share, trial_);
    for (std::int32_t r = 0; r < rows_.count(); ++r)
      of_rows_.trial_local[r] = of_rows_.local[r] + (rows_.holds(r) ? share * move[r] : 0);
    if (i == 0) slope = share > 0 ? (dot_product(f_, trial_, length) - dot_product(f_, u_, length)) / share : 0;
    const HyperelasticEnergy::Energy found = energy_.evaluate(trial_, trial_f_);
    ++outcome->evaluations;
    const double most = of_body + share * slope + 0.5 * kMoreEnergy * share * share * squared +
                        kMoreOfAll * std::abs(of_body) + energy_.noise();
    // Where the body was beyond the limits before, any part of the move is as good as none.
    if ((found.least_volume > kLeastVolume && found.energy <= most) || (share == 0 && std::isfinite(found.energy))) {
      now_.energy = found.energy + 0.5 * rows_.times_compliance(of_rows_.trial_local, of_rows_.trial_local),
      now_.least_volume = found.least_volume;
      break;
    }
    if (share == 0) return false;
  }
  outcome->cut = outcome->cut || share < 1;
  shortened_ = shortened_ || share < now_.reach;
  std::swap(u_, trial_), std::swap(f_, trial_f_);
  std::swap(of_rows_.local, of_rows_.trial_local);
  energy_.accept();
  return true;
}

void LargeSolver::find_multipliers() {
  rows_.responses_times(f_, of_rows_.work);
  rows_.compliance_times(of_rows_.local, of_rows_.multiplier);
  for (std::int32_t r = 0; r < rows_.count(); ++r) {
    const double* const c = rows_.compliance().row(r);
    of_rows_.multiplier[r] = rows_.holds(r) ? of_rows_.multiplier[r] + of_rows_.work[r] : 0;
    for (std::int32_t k = 0; rows_.holds(r) && k < rows_.count(); ++k)
      if (!rows_.holds(k))
        of_rows_.multiplier[r] -= (rows_.has_beside() ? c[k] - rows_.beside(r, k) : c[k]) * rows_.applied()[k];
  }
  rows_.solve(of_rows_.multiplier);
  for (std::int32_t r = 0; r < rows_.count(); ++r) {
    of_rows_.g[r] = rows_.holds(r) ? of_rows_.local[r] - of_rows_.multiplier[r] : 0;
    if (!rows_.holds(r)) of_rows_.multiplier[r] = rows_.applied()[r];
    of_rows_.work[r] = -of_rows_.multiplier[r];
  }
  std::copy(f_, f_ + energy_.length(), g_);
  rows_.add_rows(of_rows_.work, g_);
}

// The direction p from the gradient g. Returns g . p.
double LargeSolver::descend() {
  double factor[SecantPairs::kMost] = {};
  const BodyMove p = direction();
  const std::size_t length = energy_.length();
  std::copy(g_, g_ + length, p_);
  std::copy(of_rows_.g, of_rows_.g + rows_.count(), p.local);
  pairs_.before_metric(p, factor);
  std::copy(p_, p_ + length, image_);
  metric_.solve_roughly(p_);
  rows_.project(p_, p.local, image_);
  if (const double scale = pairs_.scale(); scale != 1) {
    for (float* const vector : {p_, image_})
      for (std::size_t i = 0; i < length; ++i) vector[i] *= static_cast<float>(scale);
    for (std::int32_t r = 0; r < rows_.count(); ++r) p.local[r] *= scale;
  }
  pairs_.after_metric(p, factor);
  if (now_.pairs_of_other_contacts) rows_.project(p_, p.local, image_);
  return dot_product(g_, p_, length) + rows_.times_compliance(of_rows_.g, p.local);
}

void LargeSolver::measure_scale(int pair) {
  const BodyMove& s = pairs_.at(pair);
  std::copy(s.of_tangent, s.of_tangent + energy_.length(), g_);
  std::copy(s.local, s.local + rows_.count(), of_rows_.g);
  metric_.solve_roughly(g_);
  rows_.project(g_, of_rows_.g, image_);
  pairs_.set_scale(pair, dot_product(s.of_tangent, g_, energy_.length()) + rows_.times_compliance(s.local, of_rows_.g));
}

// u <- u - share p with Armijo's rule, share from 1, on the energy less the work of the applied forces. Returns whether a step was
// taken.
bool LargeSolver::search(double slope, LargeOutcome* outcome) {
  const double applied = -rows_.work_of_applied(p_);
  for (double share = 1; share > kLeastShare;) {
    std::copy(u_, u_ + energy_.length(), trial_);
    add_multiple(static_cast<float>(-share), p_, energy_.length(), trial_);
    for (std::int32_t r = 0; r < rows_.count(); ++r)
      of_rows_.trial_local[r] = of_rows_.local[r] - share * of_rows_.p[r];
    const HyperelasticEnergy::Energy found = energy_.evaluate(trial_, trial_f_);
    ++outcome->evaluations;
    const double energy = found.energy + 0.5 * rows_.times_compliance(of_rows_.trial_local, of_rows_.trial_local),
                 change = energy - now_.energy - share * applied;
    const bool allowed = found.least_volume > std::min(kLeastVolume, now_.least_volume);
    if (allowed && change <= -1e-4 * share * slope + kEnergyRounding * std::abs(now_.energy) + energy_.noise()) {
      now_.energy = energy, now_.least_volume = found.least_volume;
      const int scaled_by = pairs_.add(share, direction(), f_, trial_f_, now_.energy);
      soft_.take_if_softer(pairs_.newest(), pairs_.newest_curvature());
      if (scaled_by >= 0) measure_scale(scaled_by);
      std::swap(u_, trial_), std::swap(f_, trial_f_), std::swap(of_rows_.local, of_rows_.trial_local);
      energy_.accept();
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
  const bool moves = !still_ && rows_.count() > 0;
  bool corrected = false;
  for (std::int32_t steps = 0;; ++steps, ++outcome->steps) {
    find_multipliers();
    if (steps >= most_steps) break;
    const double slope = descend();
    const double energy = std::max(std::abs(now_.energy), 1e-300);
    const double scale = std::max(pairs_.scale(), kLeastTold);
    now_.residual = std::sqrt(std::max(slope, 0.0) / (scale * std::max(energy, energy_.noise())));
    // Where targets stand still, the pairs get to know the tangent. Where they move, they know what each move disturbs and little else. A tissue
    // that hardly changes its volume and has turned is stiffer than K against some moves, by up to 1 / gamma, and softer by as much against
    // those that K takes for changes of volume: K^-1 / gamma tells too little of an error there. The mean of both counts.
    const double least = tolerance * tolerance * scale * (moves ? std::sqrt(scale) : 1);
    if (slope <= least * energy + 0.01 * energy_.noise()) {
      // A multiplier that has been corrected is followed by a step, before it is corrected again.
      if (worst_volume() <= kVolumeMet) {
        now_.solved = still_ ? 2 : 1;
      } else if (!corrected && steps + 1 < most_steps) {
        correct_volumes();
        corrected = true;
        continue;
      }
    }
    if (now_.solved || !std::isfinite(slope)) break;
    if (slope < 0 || !search(slope, outcome)) {
      stuck_ = pairs_.count() == 0;
      if (stuck_) break;
      pairs_.drop();
    }
    corrected = false;
  }
  outcome->unfinished = !now_.solved && !(now_.residual <= kUnfinished && worst_volume() <= kVolumeFar);
  // What the numbers' rounding leaves is not worth a search without end.
  now_.still = still_ ? now_.still + most_steps : 0;
  if (now_.still > kMostStillSteps && !outcome->unfinished) now_.solved = 2;
  if (outcome->cut) now_.solved = 0;
}

void LargeSolver::begin_step() {
  before_ = now_;
  energy_.pressures().begin_step();
  shortened_ = stuck_ = false;
  std::copy(u_, u_ + std::max(3 * static_cast<std::size_t>(energy_.nodes()), energy_.length()), u_before_);
  std::copy(f_, f_ + energy_.length(), f_before_);
  std::copy(of_rows_.local, of_rows_.local + rows_.most(), of_rows_.local_before);
}

// Back to where the step began. The pairs stay what they are: samples of the tangent, though from far away; they are dropped.
void LargeSolver::give_up() {
  const double reach = now_.reach > kLeastReach ? now_.reach / 4 : 0;
  now_ = before_;
  now_.reach = reach;
  std::swap(u_, u_before_), std::swap(f_, f_before_), std::swap(of_rows_.local, of_rows_.local_before);
  now_.solved = 0;
  energy_.pressures().give_up();
  energy_.take_state(u_);
  pairs_.drop();
  find_multipliers();
}

void LargeSolver::forces(bool sound, double* force, LargeOutcome* outcome) {
  outcome->evaluations += std::exchange(moved_.evaluations, 0);
  if (moved_.cut) outcome->cut = true, now_.solved = 0;
  bool finite = sound && std::isfinite(now_.energy);
  for (std::int32_t r = 0; r < rows_.count(); ++r) finite = finite && std::isfinite(of_rows_.multiplier[r]);
  outcome->failed = !finite;
  std::fill(force, force + rows_.count(), 0.0);
  if (!finite) {
    forget();
    if (energy_.has_load() && energy_.is_changed()) changed(false);
    return;
  }
  // A body that loses energy is on its way to its solution, however far that is.
  outcome->lost = now_.residual > kLost && !now_.solved;
  // By the metric of the method itself: in a tissue that stiffens, K^-1 tells many times the distance.
  outcome->given_up = outcome->lost && now_.energy > before_.energy &&
                      now_.residual * std::sqrt(std::max(pairs_.scale(), kLeastTold)) > kLost;
  outcome->residual = outcome->given_up ? now_.residual : std::min(now_.residual, kLost);
  if (outcome->given_up) {
    outcome->unfinished = true;
    give_up();
  } else {
    if (!shortened_) now_.reach = std::clamp(2 * now_.reach, kLeastReach, 1.0);
    now_.peak_energy = std::max(now_.peak_energy, std::abs(now_.energy));
  }
  std::copy(of_rows_.multiplier, of_rows_.multiplier + rows_.count(), force);
  const bool acts = !nothing_acts();
  if (acts && outcome->evaluations > 0 && !outcome->lags())
    outcome->evaluations += soft_.follow({u_, f_, of_rows_.local, now_.energy}, {p_, g_, trial_f_, of_rows_.p}, trial_);
  outcome->unheld = acts && soft_.is_unheld();
  now_.alone = acts ? 0 : now_.alone + 1;
  const bool has_little = std::abs(now_.energy) <= little_energy() + energy_.noise();
  if ((has_little && rest_is_balance()) || (!acts && (now_.alone > kStepsToRest || stuck_)))
    come_to_rest(), outcome->residual = 0, ++outcome->evaluations;  // so that the state counts as a new one
  outcome->least_volume = now_.least_volume;
}

LargeOutcome LargeSolver::step(const LargeContacts& contacts, std::int32_t most_steps, double* force) {
  LargeOutcome outcome;
  bool sound = take(contacts);
  if (rows_.count() == 0 && now_.at_rest) return outcome;
  sound = sound && hold(nullptr, nullptr, nullptr, &outcome);
  if (sound) improve(most_steps, &outcome);
  forces(sound, force, &outcome);
  return outcome;
}

}  // namespace palpate
