#include "runtime/cut/cut_compliance.h"

#include <algorithm>

#include "runtime/cut/dense_loops.h"

namespace palpate {
namespace {

// Nodes that the columns of one change act on, and the forces of a pattern; a split node of p1-anp has about 60.
constexpr std::int32_t kMostPatch = 1024;
constexpr std::int32_t kEntriesOfPattern = 64;

CutOutcome outcome_of_slot(std::int32_t slot) {
  return slot >= 0 ? CutOutcome::made : slot == -1 ? CutOutcome::full : CutOutcome::no_column;
}

}  // namespace

bool CutCompliance::create(SceneMemory& memory, const HyperelasticBody& body, const PairCompliance& source,
                           const CutCapacity& capacity, const SupportedSurface& surface) {
  capacity_ = capacity, uncut_ = &source;
  stride_ = static_cast<std::size_t>(padded_row(capacity.patterns));
  const std::int32_t nodes = body.node_count + capacity.new_nodes;
  const auto slots = static_cast<std::size_t>(capacity.nodes), jumps = static_cast<std::size_t>(capacity.new_nodes);
  if (!tissue_.create(memory, body, capacity.new_nodes) || !supports_.create(memory, body, surface, tissue_))
    return false;
  const bool made = slots_.create(memory, source, nodes, capacity.nodes) &&
                    basis_.create(memory, capacity.patterns, capacity.nodes, kEntriesOfPattern * capacity.patterns) &&
                    sites_.create(memory, nodes, capacity.patterns) && columns_.create(memory, nodes, kMostPatch) &&
                    site_.create(memory, tissue_.largest_star()) && part_.create(memory, tissue_.largest_star());
  if (!made) return false;
  matrix_ = memory.array<double>(static_cast<std::size_t>(capacity.patterns) * stride_);
  pseudo_force_ = memory.array<Vec3>(slots), jump_ = memory.array<Vec3>(jumps);
  weight_ = memory.array<double>(stride_);
  scratch_.field = memory.array<double>(kMostColumns * slots_.stride());
  scratch_.x = memory.array<double>(kMostColumns * stride_), scratch_.y = memory.array<double>(kMostColumns * stride_);
  scratch_.weighed = memory.array<double>(CutBasis::scratch_of_weigh(capacity.nodes, capacity.patterns));
  scratch_.product = memory.array<double>(kMostColumns * stride_);
  scratch_.coefficient = memory.array<double>(kMostColumns * std::max<std::size_t>(3 * kMostPatch, stride_));
  scratch_.source = memory.array<const double*>(3 * kMostPatch);
  scratch_.jump_weight = memory.array<Vec3>(jumps * kMostColumns);
  scratch_.slot_gradient = memory.array<Vec3>(slots);
  scratch_.moved = memory.array<std::uint8_t>(static_cast<std::size_t>(body.tetrahedron_count));
  scratch_.slot = memory.array<std::int32_t>(kMostPatch);
  return !memory.failed();
}

void CutCompliance::forget() {
  tissue_.forget(), supports_.forget();
  forget_patterns(*uncut_);
}

void CutCompliance::forget_patterns(const PairCompliance& source) {
  slots_.forget(source), basis_.forget(), sites_.forget();
  std::fill_n(matrix_, static_cast<std::size_t>(capacity_.patterns) * stride_, 0.0);
  ++version_;
}

void CutCompliance::begin_from(const CutCompliance& now, const PairCompliance& source) {
  tissue_.begin_from(now.tissue_), supports_.begin_from(now.supports_);
  forget_patterns(source);
}

CutResult CutCompliance::apply(const CutChange& change) {
  CutResult result;
  const auto note = [&](const Unit& unit) {
    result.outcome = unit.outcome, result.least_share = std::min(result.least_share, unit.least_share);
    if (unit) ++version_;
    return unit.outcome == CutOutcome::made;
  };
  for (; result.new_nodes < change.new_node_count; ++result.new_nodes)
    if (!note(split(change, change.new_nodes[result.new_nodes]))) return result;
  for (; result.removed < change.removed_count; ++result.removed)
    if (!note(remove(change.removed[result.removed]))) return result;
  return result;
}

CutOutcome CutCompliance::ground(std::int32_t node, double stiffness) {
  const Unit unit = ground_node(node, stiffness);
  if (unit) ++version_;
  return unit.outcome;
}

// Visits a node that is new since the base, and those that it came from: each of their jumps moves it.
template <class Visit>
void CutCompliance::for_each_jump(std::int32_t node, Visit visit) const {
  for (; node >= tissue_.base_nodes(); node = tissue_.parent(node)) visit(node - tissue_.rest_nodes());
}

// Slots for all nodes of the columns.
CutCompliance::Unit CutCompliance::take_slots() {
  if (columns_.is_full()) return {CutOutcome::full};
  for (std::int32_t a = 0; a < columns_.count(); ++a) {
    const std::int32_t slot = slots_.take(tissue_.base(columns_.node(a)));
    if (slot < 0) return {outcome_of_slot(slot)};
    scratch_.slot[a] = slot;
  }
  return {};
}

void CutCompliance::begin_coordinates(int columns) {
  for (int j = 0; j < columns; ++j) std::fill_n(row(scratch_.y, j), stride_, 0.0);
}

// Adds a force on a node to the coordinates of a column.
CutCompliance::Unit CutCompliance::coordinates_of_node(std::int32_t node, Vec3 force, int column) {
  const std::int32_t slot = slots_.take(tissue_.base(node));
  if (slot < 0) return {outcome_of_slot(slot)};
  const std::int32_t pattern = basis_.nodal(slot);
  if (pattern < 0) return {CutOutcome::full};
  for (int i = 0; i < 3; ++i) row(scratch_.y, column)[pattern + i] += force[i];
  return {};
}

CutCompliance::Unit CutCompliance::new_site_patterns(const NodeGradients& site, std::int32_t* first) {
  const int modes = tissue_.site_modes();
  if (!basis_.has_room(modes)) return {CutOutcome::full};
  *first = basis_.count();
  for (int m = 0; m < modes; ++m) {
    basis_.begin();
    for (std::int32_t a = 0; a < site.count; ++a) {
      const std::int32_t slot = slots_.take(tissue_.base(site.node[a]));
      const bool added = slot >= 0 && basis_.add(slot, strain_mode(m, site.gradient[a]));
      if (added) continue;
      basis_.drop_last(m + 1);
      return {slot < 0 ? outcome_of_slot(slot) : CutOutcome::full};
    }
  }
  return {};
}

// Of site_'s modes, in columns from `column` on: the patterns that it began as, and what it has lost since, at single nodes.
CutCompliance::Unit CutCompliance::coordinates_of_site(std::int32_t node, std::int32_t region, int column) {
  CutSites::Site* const site = sites_.find_or_add(node, region);
  if (!site) return {CutOutcome::full};
  const bool is_new = site->pattern < 0;
  if (is_new)
    if (const Unit unit = new_site_patterns(site_, &site->pattern); !unit) return unit;
  for (int m = 0; m < tissue_.site_modes(); ++m) row(scratch_.y, column + m)[site->pattern + m] += 1;
  if (is_new) return {};
  double largest = 0;
  const auto subtract = [&](std::int32_t slot, Vec3 force) {
    scratch_.slot_gradient[slot] = scratch_.slot_gradient[slot] - force;
    largest = std::max(largest, dot(force, force));
  };
  basis_.for_each_force(site->pattern, subtract);  // mode 0 is the gradient itself
  for (std::int32_t a = 0; a < site_.count; ++a)
    scratch_.slot_gradient[slots_.find(tissue_.base(site_.node[a]))] += site_.gradient[a];
  Unit unit;
  const auto take = [&](std::int32_t slot, Vec3) {
    const Vec3 rest = scratch_.slot_gradient[slot];
    scratch_.slot_gradient[slot] = {};
    if (dot(rest, rest) <= 1e-24 * largest || !unit) return;
    for (int m = 0; m < tissue_.site_modes() && unit; ++m)
      unit = coordinates_of_node(slots_.nodes()[slot], strain_mode(m, rest), column + m);
  };
  basis_.for_each_force(site->pattern, take);
  return unit;
}

// t = G^T C' G of columns_; adds M Z^T G to scratch_.y. Their nodes have slots.
void CutCompliance::measure(SmallMatrix* t) {
  const int columns = columns_.columns();
  const std::int32_t sources = 3 * columns_.count(), fields = padded_row(3 * slots_.count());
  for (std::int32_t a = 0; a < columns_.count(); ++a)
    for (int i = 0; i < 3; ++i) {
      scratch_.source[3 * a + i] = slots_.row(scratch_.slot[a], i);
      for (int j = 0; j < columns; ++j) scratch_.coefficient[j * sources + 3 * a + i] = columns_.force(a, j)[i];
    }
  std::fill_n(scratch_.field, static_cast<std::size_t>(columns) * slots_.stride(), 0.0);
  add_row_sums(scratch_.field, columns, slots_.stride(), fields, scratch_.source, sources, scratch_.coefficient);

  for (std::int32_t a = 0; a < columns_.count(); ++a)
    for_each_jump(columns_.node(a), [&](std::int32_t n) {
      for (int j = 0; j < columns; ++j) scratch_.jump_weight[n * kMostColumns + j] += columns_.force(a, j);
    });
  const std::int32_t rank = basis_.count(), padded = padded_row(rank);
  basis_.weigh(scratch_.field, slots_.stride(), columns, slots_.count(), scratch_.x, stride_, scratch_.weighed);
  for (int j = 0; j < columns; ++j) {
    double* const x = row(scratch_.x, j);
    for (std::int32_t i = 0; i < rank; ++i)
      if (const std::int32_t jump = basis_.jump(i); jump >= 0)
        x[i] += scratch_.jump_weight[jump / 3 * kMostColumns + j][jump % 3];
    std::fill(x + rank, x + padded, 0.0);
  }
  for (std::int32_t a = 0; a < columns_.count(); ++a)
    for_each_jump(columns_.node(a),
                  [&](std::int32_t n) { std::fill_n(scratch_.jump_weight + n * kMostColumns, columns, Vec3{}); });

  row_products(matrix_, rank, scratch_.x, columns, stride_, padded, scratch_.product, kMostColumns);
  for (int j = 0; j < columns; ++j)
    for (int l = 0; l < columns; ++l) {
      double sum = 0;
      const double* const field = scratch_.field + static_cast<std::size_t>(l) * slots_.stride();
      for (std::int32_t a = 0; a < columns_.count(); ++a)
        sum += dot(columns_.force(a, j), load3(field + 3 * static_cast<std::size_t>(scratch_.slot[a])));
      for (std::int32_t i = 0; i < rank; ++i) sum += row(scratch_.x, j)[i] * scratch_.product[i * kMostColumns + l];
      t->m[j][l] = sum;
    }
  for (int j = 0; j < columns; ++j)
    for (std::int32_t i = 0; i < rank; ++i) row(scratch_.y, j)[i] += scratch_.product[i * kMostColumns + j];
}

// M += sign y x y^T, y in scratch_.y.
void CutCompliance::add_to_matrix(const SmallMatrix& x, int columns, double sign) {
  const std::int32_t rank = basis_.count();
  for (std::int32_t i = 0; i < rank; ++i)
    for (int j = 0; j < columns; ++j) {
      double sum = 0;
      for (int l = 0; l < columns; ++l) sum += row(scratch_.y, l)[i] * x.m[l][j];
      scratch_.coefficient[i * columns + j] = sign * sum;
    }
  for (int j = 0; j < columns; ++j) scratch_.source[j] = row(scratch_.y, j);
  add_row_sums(matrix_, rank, stride_, padded_row(rank), scratch_.source, columns, scratch_.coefficient);
}

// K + G S G^T, with columns_ and their coordinates in scratch_.y.
CutCompliance::Unit CutCompliance::add_stiffness(const SmallMatrix& s) {
  SmallMatrix t, x;
  Unit unit;
  measure(&t);
  const bool solved = solve_small(columns_.columns(), t, s, &x, &unit.least_share);
  if (!solved || unit.least_share < capacity_.least_share)
    unit.outcome = CutOutcome::loose;
  else
    add_to_matrix(x, columns_.columns(), -1);
  return unit;
}

CutCompliance::Unit CutCompliance::ground_node(std::int32_t node, double stiffness) {
  SmallMatrix s;
  columns_.begin(3);
  begin_coordinates(3);
  for (int i = 0; i < 3; ++i) {
    Vec3 unit;
    unit[i] = 1, s.m[i][i] = stiffness;
    columns_.add(node, i, unit);
    if (const Unit done = coordinates_of_node(node, unit, i); !done) return done;
  }
  if (const Unit done = take_slots(); !done) return done;
  return add_stiffness(s);
}

CutCompliance::Unit CutCompliance::remove(std::int32_t e) {
  if (e < 0 || e >= tissue_.tetrahedra() || !tissue_.is_left(e)) return {CutOutcome::wrong};
  Vec3 g[4];
  const double volume = tissue_.gradients(e, g);
  // A node that nothing is left at would be loose.
  double grounded[4] = {};
  Unit unit;
  for (int a = 0; a < 4 && unit; ++a) {
    if (tissue_.tetrahedra_at(tissue_.corners(e)[a]) > 1) continue;
    const double stiffness = volume * dot(g[a], g[a]) * tissue_.site_stiffness(tissue_.region(e), 0);
    unit = ground_node(tissue_.corners(e)[a], stiffness);
    if (unit) grounded[a] = stiffness;
  }
  int freed = 0;
  while (unit && freed < 4) {
    unit = change_foundation(e, freed, -1);
    freed += unit ? 1 : 0;
  }
  if (unit) unit = take_away(e);
  if (unit) {
    lose_loads(e);
    tissue_.remove(e);
    return unit;
  }
  while (freed-- > 0) change_foundation(e, freed, 1);
  for (int a = 0; a < 4; ++a)
    if (grounded[a] > 0) ground_node(tissue_.corners(e)[a], -grounded[a]);
  return unit;
}

// A tetrahedron that is removed takes its part of the loads at its corners along. Springs stay, and the loads of springs that move stay with them.
void CutCompliance::lose_loads(std::int32_t e) {
  for (int a = 0; a < 4; ++a) {
    const std::int32_t node = tissue_.corners(e)[a];
    scratch_.moved[e] = static_cast<std::uint8_t>(a + 1);
    LoadShare share = share_of_loads(node);
    const double on_surface = supports_.share_of_triangles(tissue_, node, scratch_.moved);
    share.on_surface = on_surface < 0 ? share.in_volume : on_surface;
    tissue_.lose_loads(node, share);
  }
  scratch_.moved[e] = 0;
}

// The foundation below a face of a tetrahedron, times factor.
CutCompliance::Unit CutCompliance::change_foundation(std::int32_t e, int opposite, double factor) {
  const CutSupports::Face* const face = supports_.face(e, opposite);
  if (!face || !face->founded) return {};
  SmallMatrix s;
  columns_.begin(9);
  begin_coordinates(9);
  for (int a = 0; a < 3; ++a)
    for (int i = 0; i < 3; ++i) {
      const std::int32_t node = tissue_.corners(e)[(opposite + 1 + a) % 4];
      Vec3 unit;
      unit[i] = 1;
      for (int b = 0; b < 3; ++b)
        for (int j = 0; j < 3; ++j) s.m[3 * a + i][3 * b + j] = factor * (a == b ? 2 : 1) * face->block.m[i][j];
      columns_.add(node, 3 * a + i, unit);
      if (const Unit done = coordinates_of_node(node, unit, 3 * a + i); !done) return done;
    }
  if (const Unit done = take_slots(); !done) return done;
  return add_stiffness(s);
}

// The columns of a removed tetrahedron: its own strain modes, then those of the sites at its corners.
CutCompliance::Unit CutCompliance::take_away(std::int32_t e) {
  Vec3 g[4];
  const double volume = tissue_.gradients(e, g);
  const std::int32_t region = tissue_.region(e), *const corner = tissue_.corners(e);
  const int modes = tissue_.site_modes();
  SmallMatrix s;
  columns_.begin(kStrainModes + 4 * modes);
  begin_coordinates(kStrainModes + 4 * modes);
  for (int m = 0; m < kStrainModes; ++m) {
    s.m[m][m] = -volume * tissue_.own_stiffness(region, m);
    for (int a = 0; a < 4; ++a) {
      const Vec3 force = strain_mode(m, g[a]);
      columns_.add(corner[a], m, force);
      if (const Unit unit = coordinates_of_node(corner[a], force, m); !unit) return unit;
    }
  }
  for (int c = 0; c < 4 && modes > 0; ++c) {
    tissue_.find_site(corner[c], region, site_, [](std::int32_t) { return true; });
    const int first = kStrainModes + c * modes;
    for (int m = 0; m < modes; ++m)
      for (std::int32_t a = 0; a < site_.count; ++a)
        columns_.add(site_.node[a], first + m, strain_mode(m, site_.gradient[a]));
    if (const Unit unit = take_slots(); !unit) return unit;
    if (const Unit unit = coordinates_of_site(corner[c], region, first); !unit) return unit;
    const double quarter = volume / 4, left = site_.volume - quarter;
    const bool remains = left > 1e-9 * site_.volume;
    for (int m = 0; m < modes; ++m) {
      const double stiffness = tissue_.site_stiffness(region, m), now = remains ? stiffness / left : 0;
      s.m[m][m] += now * quarter * quarter;
      s.m[m][first + m] -= now * quarter, s.m[first + m][m] -= now * quarter;
      s.m[first + m][first + m] += now - stiffness / site_.volume;
    }
  }
  if (const Unit unit = take_slots(); !unit) return unit;
  return add_stiffness(s);
}

// columns_: B, forces on all nodes per unit jump of the tetrahedra that go with the new node; own: N, the stiffness of that jump. springs: share
// of the node's springs that goes with it.
void CutCompliance::collect_jumps(const CutChange& change, std::int32_t from, double springs, SmallMatrix* own) {
  const auto add = [&](double stiffness, int m, Vec3 jump_gradient, std::int32_t node, Vec3 gradient) {
    const Vec3 force = strain_mode(m, gradient), jump = strain_mode(m, jump_gradient);
    for (int i = 0; i < 3; ++i) columns_.add(node, i, stiffness * jump[i] * force);
  };
  for (std::int32_t k = 0; k < change.moved_count; ++k) {
    const std::int32_t e = change.moved[k].tetrahedron;
    if (!scratch_.moved[e]) continue;
    Vec3 g[4];
    const double volume = tissue_.gradients(e, g);
    const Vec3 at = g[scratch_.moved[e] - 1];
    for (int m = 0; m < kStrainModes; ++m) {
      const double stiffness = volume * tissue_.own_stiffness(tissue_.region(e), m);
      if (stiffness == 0) continue;
      const Vec3 jump = strain_mode(m, at);
      for (int a = 0; a < 4; ++a) add(stiffness, m, at, tissue_.corners(e)[a], g[a]);
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) own->m[i][j] += stiffness * jump[i] * jump[j];
    }
    for (int c = 0; c < 4 && tissue_.site_modes() > 0; ++c) {
      // Each site once: at the first of the tetrahedra that have it.
      const std::int32_t node = tissue_.corners(e)[c], region = tissue_.region(e);
      bool first = true;
      for (std::int32_t l = 0; l < k && first; ++l) {
        const std::int32_t other = change.moved[l].tetrahedron;
        first = !(scratch_.moved[other] && tissue_.region(other) == region && tissue_.corner_of(other, node) >= 0);
      }
      if (first) add_site_jumps(node, region, own);
    }
  }
  add_support_jumps(change, from, springs, own);
  // A new node is held as the one that it comes from.
  for (int i = 0; i < 3; ++i) {
    if (!tissue_.is_held(from, i)) continue;
    for (int j = 0; j < 3; ++j) own->m[i][j] = own->m[j][i] = 0;
    own->m[i][i] = 1;
    columns_.clear(i);
  }
}

// Of the foundations below the tetrahedra that go, and of the springs.
void CutCompliance::add_support_jumps(const CutChange& change, std::int32_t from, double springs, SmallMatrix* own) {
  const auto add = [&](std::int32_t node, double factor, const Mat3& block) {
    for (int i = 0; i < 3; ++i) columns_.add(node, i, factor * load3(block.m[i]));
  };
  const auto add_own = [&](double factor, const Mat3& block) {
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) own->m[i][j] += factor * block.m[i][j];
  };
  for (std::int32_t k = 0; k < change.moved_count && supports_.exist(); ++k) {
    const std::int32_t e = change.moved[k].tetrahedron;
    const int at = scratch_.moved[e] - 1;
    for (int opposite = 0; opposite < 4 && at >= 0; ++opposite) {
      const CutSupports::Face* const face = opposite == at ? nullptr : supports_.face(e, opposite);
      if (!face || !face->founded) continue;
      for (int c = 0; c < 4; ++c)
        if (c != opposite) add(tissue_.corners(e)[c], c == at ? 2 : 1, face->block);
      add_own(2, face->block);
    }
  }
  if (!(springs > 0)) return;
  const std::int32_t origin = tissue_.origin(from);
  const double goes = springs * supports_.held(from);
  supports_.for_each_spring(origin, [&](std::int32_t other, const Mat3& block) {
    if (other == origin) {
      add(from, goes, block), add_own(goes, block);
      return;
    }
    for (std::int32_t n = other; n < tissue_.nodes(); n = std::max(n + 1, tissue_.rest_nodes()))
      if (tissue_.origin(n) == other) add(n, goes * supports_.held(n), block);
  });
}

// Of the site of a node and a region, which averages over tetrahedra that go and over others.
void CutCompliance::add_site_jumps(std::int32_t node, std::int32_t region, SmallMatrix* own) {
  tissue_.find_site(node, region, site_, [](std::int32_t) { return true; });
  Vec3 jump_gradient;  // of the site's mean by the jump
  tissue_.for_each_at(node, [&](std::int32_t e, int) {
    if (!scratch_.moved[e] || tissue_.region(e) != region) return;
    Vec3 g[4];
    const double quarter = tissue_.gradients(e, g) / 4;
    jump_gradient += quarter * g[scratch_.moved[e] - 1];
  });
  for (int m = 0; m < tissue_.site_modes(); ++m) {
    const double stiffness = tissue_.site_stiffness(region, m) / site_.volume;
    const Vec3 jump = strain_mode(m, jump_gradient);
    for (std::int32_t a = 0; a < site_.count; ++a) {
      const Vec3 force = strain_mode(m, site_.gradient[a]);
      for (int i = 0; i < 3; ++i) columns_.add(site_.node[a], i, stiffness * jump[i] * force);
    }
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) own->m[i][j] += stiffness * jump[i] * jump[j];
  }
}

// The share of the loads at a node that goes to a new node with the tetrahedra of scratch_.moved.
LoadShare CutCompliance::share_of_loads(std::int32_t node) const {
  double all = 0, part = 0;
  tissue_.for_each_at(node, [&](std::int32_t e, int) {
    const double volume = tissue_.volume(e);
    all += volume;
    if (scratch_.moved[e]) part += volume;
  });
  LoadShare share;
  share.in_volume = part / all;
  const double on_surface = supports_.share_of_forces(tissue_, node, scratch_.moved);
  share.on_surface = on_surface < 0 ? share.in_volume : on_surface;
  return share;
}

// The node is there twice, and the tetrahedra that go have its copy; sites still average over both sides.
CutCompliance::Unit CutCompliance::free_jump(const CutChange& change, const CutChange::NewNode& made) {
  SmallMatrix own, t, x;
  columns_.begin(3);
  const double springs = supports_.share_of(tissue_, made.from, scratch_.moved);
  const LoadShare loads = share_of_loads(made.from);
  collect_jumps(change, made.from, springs, &own);
  if (const Unit unit = take_slots(); !unit) return unit;
  if (!basis_.has_room(3)) return {CutOutcome::full};
  const std::int32_t pattern = basis_.count(), jump = 3 * (made.node - tissue_.rest_nodes());
  for (int i = 0; i < 3; ++i) {
    bool fits = true;
    const bool held = tissue_.is_held(made.from, i);
    basis_.begin(held ? -1 : jump + i);
    for (std::int32_t a = 0; a < columns_.count() && fits && !held; ++a)
      fits = basis_.add(scratch_.slot[a], -1.0 * columns_.force(a, i));
    if (fits) continue;
    basis_.drop_last(i + 1);
    return {CutOutcome::full};
  }
  begin_coordinates(3);
  measure(&t);
  Unit unit;
  const bool solved = solve_jump(own, t, &x, &unit.least_share);
  if (!solved || unit.least_share < capacity_.least_share) {
    basis_.drop_last(3);
    unit.outcome = CutOutcome::loose;
    return unit;
  }
  for (int i = 0; i < 3; ++i) {
    double* const y = row(scratch_.y, i);
    for (std::int32_t k = 0; k < basis_.count(); ++k) y[k] = -y[k];
    if (!tissue_.is_held(made.from, i)) y[pattern + i] += 1;
  }
  // The copy has what its origin has of the cut so far, by for_each_jump().
  add_to_matrix(x, 3, 1);
  tissue_.add_node(made.from, loads);
  supports_.split(made.from, made.node, springs);
  for (std::int32_t k = 0; k < change.moved_count; ++k)
    if (scratch_.moved[change.moved[k].tetrahedron])
      tissue_.move_corner(change.moved[k].tetrahedron, made.from, made.node);
  return unit;
}

// Where both sides have tetrahedra of the region, each side averages on its own: of D and the part that stays, with their volumes,
//     -1 / V (D u)^2 becomes 1 / V_stays (D_stays u)^2 + 1 / V_goes ((D - D_stays) u)^2.
CutCompliance::Unit CutCompliance::split_site(std::int32_t node, std::int32_t from, std::int32_t region) {
  const auto all = [](std::int32_t) { return true; };
  tissue_.find_site(from, region, part_, all);
  if (part_.count == 0) {
    sites_.move(from, region, node);
    return {};
  }
  const double stays = part_.volume;
  tissue_.find_site(node, region, site_, all);
  const double goes = site_.volume;
  for (std::int32_t a = 0; a < part_.count; ++a) site_.add(part_.node[a], part_.gradient[a]);
  const int modes = tissue_.site_modes();
  SmallMatrix s;
  columns_.begin(2 * modes);
  for (int m = 0; m < modes; ++m) {
    for (std::int32_t a = 0; a < site_.count; ++a) columns_.add(site_.node[a], m, strain_mode(m, site_.gradient[a]));
    for (std::int32_t a = 0; a < part_.count; ++a)
      columns_.add(part_.node[a], modes + m, strain_mode(m, part_.gradient[a]));
    const double stiffness = tissue_.site_stiffness(region, m);
    s.m[m][m] = stiffness * (1 / goes - 1 / (stays + goes));
    s.m[m][modes + m] = s.m[modes + m][m] = -stiffness / goes;
    s.m[modes + m][modes + m] = stiffness * (1 / stays + 1 / goes);
  }
  if (const Unit unit = take_slots(); !unit) return unit;
  begin_coordinates(2 * modes);
  std::int32_t pattern = -1;
  if (const Unit unit = coordinates_of_site(from, region, 0); !unit) return unit;
  if (const Unit unit = new_site_patterns(part_, &pattern); !unit) return unit;
  for (int m = 0; m < modes; ++m) row(scratch_.y, modes + m)[pattern + m] += 1;
  const Unit unit = add_stiffness(s);
  if (unit) sites_.find_or_add(from, region)->pattern = pattern;
  return unit;
}

CutCompliance::Unit CutCompliance::split(const CutChange& change, const CutChange::NewNode& made) {
  if (made.node != tissue_.nodes() || made.from < 0 || made.from >= made.node) return {CutOutcome::wrong};
  // Room for all that a split node asks for, so that none is split by half.
  constexpr std::int32_t kMostRegionsOfNode = 4;
  const std::int32_t patterns = 3 + 2 * kMostRegionsOfNode * tissue_.site_modes();
  if (made.node == tissue_.most_nodes() || !basis_.has_room(patterns)) return {CutOutcome::full};
  for (std::int32_t k = 0; k < change.moved_count; ++k)
    if (change.moved[k].tetrahedron < 0 || change.moved[k].tetrahedron >= tissue_.tetrahedra())
      return {CutOutcome::wrong};
  // moved: 1 + the corner that goes to the new node.
  bool fits = true;
  for (std::int32_t k = 0; k < change.moved_count; ++k) {
    const CutChange::Moved& moved = change.moved[k];
    for (int a = 0; a < 4; ++a) {
      if (moved.corners[a] != made.node) continue;
      fits = fits && tissue_.is_left(moved.tetrahedron) && tissue_.corners(moved.tetrahedron)[a] == made.from;
      scratch_.moved[moved.tetrahedron] = static_cast<std::uint8_t>(a + 1);
    }
  }
  const auto forget = [&] {
    for (std::int32_t k = 0; k < change.moved_count; ++k) scratch_.moved[change.moved[k].tetrahedron] = 0;
  };
  Unit unit{fits ? CutOutcome::made : CutOutcome::wrong};
  if (unit) unit = free_jump(change, made);
  if (unit) {
    // The sites of the old node are split as well, one for each region that both sides have.
    for (std::int32_t k = 0; k < change.moved_count && unit; ++k) {
      const std::int32_t e = change.moved[k].tetrahedron, region = tissue_.region(e);
      bool first = scratch_.moved[e] != 0 && tissue_.site_modes() > 0;
      for (std::int32_t l = 0; l < k && first; ++l) {
        const std::int32_t other = change.moved[l].tetrahedron;
        first = !(scratch_.moved[other] && tissue_.region(other) == region);
      }
      if (!first) continue;
      const Unit of_site = split_site(made.node, made.from, region);
      unit = {of_site.outcome, std::min(unit.least_share, of_site.least_share)};
    }
  }
  forget();
  return unit;
}

// Z of a node, three rows. field: [3][slots' stride], scratch, and that of CutBasis::weigh().
bool CutCompliance::find_patterns(std::int32_t node, double* field, double* weighed, double* z) const {
  const std::int32_t count = slots_.count(), rank = basis_.count();
  const std::size_t stride = slots_.stride();
  if (!slots_.source().read(tissue_.base(node), slots_.nodes(), count, field, stride)) return false;
  std::fill_n(z, 3 * stride_, 0.0);
  basis_.weigh(field, stride, 3, count, z, stride_, weighed);
  const auto came_from = [&](std::int32_t new_node) {
    bool found = false;
    for_each_jump(node, [&](std::int32_t n) { found = found || n == new_node; });
    return found;
  };
  for (std::int32_t p = 0; p < rank && node >= tissue_.base_nodes(); ++p)
    if (const std::int32_t jump = basis_.jump(p); jump >= 0 && came_from(jump / 3)) row(z, jump % 3)[p] += 1;
  return true;
}

bool CutCompliance::find_response(std::int32_t node, double* response) {
  if (!find_patterns(node, scratch_.field, scratch_.weighed, response)) return false;
  std::fill_n(row(response, 3), 3 * stride_, 0.0);
  multiply(response, 3, row(response, 3));
  return true;
}

void CutCompliance::multiply(const double* x, int columns, double* product) const {
  const std::int32_t rank = basis_.count(), padded = padded_row(rank);
  row_products(matrix_, rank, x, columns, stride_, padded, scratch_.product, kMostColumns);
  for (int i = 0; i < columns; ++i) {
    for (std::int32_t p = 0; p < rank; ++p) row(product, i)[p] = scratch_.product[p * kMostColumns + i];
    std::fill(row(product, i) + rank, row(product, i) + padded, 0.0);
  }
}

Mat3 CutCompliance::added(const double* response_a, const double* response_b) const {
  Mat3 c;
  double out[9];
  row_products(response_a, 3, response_b + 3 * stride_, 3, stride_, padded_row(basis_.count()), out, 3);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) c.m[i][j] = out[3 * i + j];
  return c;
}

bool CutCompliance::between(std::int32_t a, const double* response_a, std::int32_t b, const double* response_b,
                            Mat3* c) const {
  double rows[9];
  const std::int32_t other = tissue_.base(b);
  if (!slots_.source().read(tissue_.base(a), &other, 1, rows, 3)) return false;
  *c = added(response_a, response_b);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) c->m[i][j] += rows[3 * i + j];
  return true;
}

void CutCompliance::begin_forces() {
  std::fill_n(weight_, stride_, 0.0);
}

void CutCompliance::add_force(const double* response, Vec3 force) {
  for (int i = 0; i < 3; ++i) {
    const double* const column = response + (3 + static_cast<std::size_t>(i)) * stride_;
    for (std::int32_t p = 0; p < basis_.count(); ++p) weight_[p] += force[i] * column[p];
  }
}

void CutCompliance::end_forces() {
  std::fill_n(pseudo_force_, slots_.count(), Vec3{});
  std::fill_n(jump_, tissue_.nodes() - tissue_.rest_nodes(), Vec3{});
  for (std::int32_t p = 0; p < basis_.count(); ++p) {
    const double weight = weight_[p];
    basis_.for_each_force(p, [&](std::int32_t slot, Vec3 force) { pseudo_force_[slot] += weight * force; });
    if (const std::int32_t jump = basis_.jump(p); jump >= 0) jump_[jump / 3][jump % 3] += weight;
  }
}

Vec3 CutCompliance::jump(std::int32_t node) const {
  Vec3 sum;
  for_each_jump(node, [&](std::int32_t n) { sum += jump_[n]; });
  return sum;
}

}  // namespace palpate
