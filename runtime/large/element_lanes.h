// Energy and inner forces of all tetrahedra, several side by side. With EightFloats it is the inner loop of a step.
//
// A tetrahedron whose volume and gradients are zero adds nothing and has J = 1: so are the lanes beyond the last one of a
// group.
#pragma once

#include <algorithm>
#include <cstring>
#include <limits>

#include "runtime/large/averaged_gradient.h"
#include "runtime/large/corner_lists.h"
#include "runtime/large/dilatation_sites.h"
#include "runtime/large/tissue_law.h"

namespace palpate {

template <class Real>
class ElementLanes {
 public:
  using Number = Scalar<Real>;
  static constexpr int kLanes = kLanesOf<Real>;

  struct Energy {
    double energy = 0;    // J
    double least_volume;  // smallest J of a tetrahedron
  };

  // place: [node_count] where the displacement of each node stands in u and f. body is read and not kept.
  // rows: nodes at places below it have forces; the others are held and have none.
  // Memory: about 424 bytes a tetrahedron in single precision; as much again where new_nodes is above 0: so many nodes may be split off.
  bool create(SceneMemory& memory, const HyperelasticBody& body, const std::int32_t* place, std::int32_t rows,
              std::int32_t new_nodes = 0);

  // The mesh is cut, where new_nodes of create() allows it; not p1-ang. Some tetrahedra at the node at place `from` have another node at its place.
  // Where the element averages at nodes, both average on their own from now on. Cost: of the tetrahedra at the node.
  void split(std::int32_t from, std::int32_t to, const std::int32_t* tetrahedra, std::int32_t count);
  void remove(std::int32_t tetrahedron);
  void forget_changes();  // all of them

  // u: [places][3] m. f: [rows][3] N, dE/du; overwritten. Cost: about 250 multiply-adds a tetrahedron.
  // The energy is not to be used where least_volume is near zero or below.
  PALPATE_INLINE Energy evaluate(const Number* u, Number* f) const;
  // J, twice the energy of shear that a small move q from the state u has in a body that is as stiff there as at rest, turned with the state.
  // Asked seldom: one tetrahedron after the other, which takes a tenth of the code.
  double turned_shear(const Number* u, const Number* q) const;

 private:
  struct Group {  // of kLanes tetrahedra with one law
    std::int32_t node[4][kLanes];
    std::int32_t site[4][kLanes];
    Real gradient[3][3];  // of corners 1, 2, 3
    Real volume;          // of p1-ang the share that has the tetrahedron's own gradient
    Real shear, bulk;
    Law law;
  };
  struct Form {  // constants of a group whose law has more than the moduli
    Real constant[3];
  };
  static Law law_at(const HyperelasticBody& body, std::int32_t e) {
    return law_of(body.laws[body.region[e]], body.nodal_dilatation);
  }
  static bool has_form(Law law) { return law >= Law::exponential; }
  void fill(const HyperelasticBody& body, const DilatationSites& sites, const std::int32_t* place, std::int32_t e,
            Group& group, Form* form, int lane) const;
  PALPATE_INLINE void displacement_gradient(const Group& group, const Number* u, Deformation<Real>& d) const;
  PALPATE_INLINE void average_dilatations(Energy* sum) const;
  PALPATE_INLINE Real mean_pressure(const Group& group) const;
  PALPATE_INLINE void keep_forces(const Group& group, const Real stress[3][3], Real* out) const;
  PALPATE_INLINE void add_forces(Number* f) const;
  bool create_arrays(SceneMemory& memory, std::size_t tetrahedra);
  void fill_groups(const HyperelasticBody& body, const DilatationSites& sites, const std::int32_t* place,
                   std::int32_t* lane_of);
  bool keep_uncut(SceneMemory& memory, std::size_t tetrahedra, const std::int32_t* lane_of);
  void split_site(std::int32_t site, const std::int32_t* lanes, std::int32_t count);
  void measure_site(std::int32_t site);

  Group* groups_ = nullptr;
  Form* forms_ = nullptr;  // of the groups from first_form_ on
  std::int32_t group_count_ = 0, first_form_ = 0, rows_ = 0, site_count_ = 0;
  bool nodal_ = false, averaged_ = false;
  Number quarter_ = Number(0.25);      // of a tetrahedron's volume, over the share in Group
  Real* forces_ = nullptr;             // [groups][4][3] of each corner
  CornerLists slots_;                  // [rows] where forces_ has a node's parts
  Deformation<Real>* kept_ = nullptr;  // [groups] where the dilatation is averaged
  CornerLists site_lanes_;             // [sites] lanes of the tetrahedra at a site
  Real* changes_ = nullptr;            // [groups] V_e / 4 (J_e - 1)
  Number* site_volume_ = nullptr;      // [sites]
  Number* site_bulk_ = nullptr;        // [sites]
  Number* pressures_ = nullptr;        // [sites]
  std::uint8_t* is_site_ = nullptr;    // [groups, and those of gradients_ behind them]
  AveragedGradient<Real> gradients_;   // where averaged_
  // Where the mesh may be cut: the uncut body.
  struct Uncut {
    Group* groups = nullptr;
    Number* site_volume = nullptr;    // [sites]
    std::int32_t* lane_of = nullptr;  // [tetrahedra]
    std::int32_t* lanes = nullptr;    // [4 tetrahedra] scratch
    std::int32_t sites = 0, most_sites = 0;
  } uncut_;
};

template <class Real>
void ElementLanes<Real>::fill(const HyperelasticBody& body, const DilatationSites& sites, const std::int32_t* place,
                              std::int32_t e, Group& group, Form* form, int lane) const {
  double gradient[3][3];
  const auto put = [&](Real& lanes, double value) { put_lane(lanes, lane, value); };
  put(group.volume, (1 - body.averaged_shear) * shape_gradients(body, e, gradient));
  for (int a = 0; a < 3; ++a)
    for (int i = 0; i < 3; ++i) put(group.gradient[a][i], gradient[a][i]);
  for (int a = 0; a < 4; ++a) {
    const std::size_t corner = 4 * static_cast<std::size_t>(e) + static_cast<std::size_t>(a);
    group.node[a][lane] = place[body.tetrahedra[corner]];
    if (nodal_) group.site[a][lane] = sites.of_corner[corner];
  }
  const TissueLaw& law = body.laws[body.region[e]];
  put(group.shear, law.shear);
  put(group.bulk, bulk_of(law, group.law));
  for (int i = 0; i < 3 && form; ++i) put(form->constant[i], law.form.constant[i]);
}

template <class Real>
bool ElementLanes<Real>::create_arrays(SceneMemory& memory, std::size_t tetrahedra) {
  const auto groups = static_cast<std::size_t>(group_count_), sites = static_cast<std::size_t>(uncut_.most_sites);
  groups_ = memory.array<Group>(groups);
  forms_ = memory.array<Form>(groups - static_cast<std::size_t>(first_form_));
  forces_ = memory.array<Real>(12 * groups);
  bool made = slots_.create(memory, rows_, tetrahedra);
  if (nodal_) {
    kept_ = memory.array<Deformation<Real>>(groups);
    made = made && site_lanes_.create(memory, uncut_.most_sites, tetrahedra);
    changes_ = memory.array<Real>(groups);
    for (Number** of_sites : {&site_volume_, &site_bulk_, &pressures_}) *of_sites = memory.array<Number>(sites);
  }
  return made && !memory.failed();
}

// One law after the other. lane_of: [tetrahedra] group times kLanes, plus lane.
template <class Real>
void ElementLanes<Real>::fill_groups(const HyperelasticBody& body, const DilatationSites& sites,
                                     const std::int32_t* place, std::int32_t* lane_of) {
  std::int32_t next = 0;
  for (int l = 0; l < kLaws; ++l) {
    std::int32_t placed = 0;
    for (std::int32_t e = 0; e < body.tetrahedron_count; ++e) {
      if (static_cast<int>(law_at(body, e)) != l) continue;
      Group& group = groups_[next + placed / kLanes];
      group.law = static_cast<Law>(l);
      Form* const form = has_form(group.law) ? forms_ + (next + placed / kLanes - first_form_) : nullptr;
      for (int i = 0; i < 3 && form && placed % kLanes == 0; ++i)
        form->constant[i] = form->constant[i] + 1;  // a lane without a tetrahedron divides by it
      fill(body, sites, place, e, group, form, placed % kLanes);
      lane_of[e] = kLanes * next + placed++;
    }
    next += (placed + kLanes - 1) / kLanes;
  }
}

template <class Real>
bool ElementLanes<Real>::create(SceneMemory& memory, const HyperelasticBody& body, const std::int32_t* place,
                                std::int32_t rows, std::int32_t new_nodes) {
  nodal_ = body.nodal_dilatation, rows_ = rows, averaged_ = body.averaged_shear > 0;
  quarter_ = static_cast<Number>(0.25 / (1 - body.averaged_shear));
  SceneMemory scratch = memory.of_same_host();
  DilatationSites sites;
  const auto count = static_cast<std::size_t>(body.tetrahedron_count);
  std::int32_t* const lane_of = scratch.array<std::int32_t>(count);
  if (!lane_of || (nodal_ && !find_dilatation_sites(scratch, body, &sites))) {
    scratch.release_all();
    return false;
  }
  site_count_ = uncut_.sites = sites.count;
  // A new node has as many sites as there are regions around it.
  uncut_.most_sites = static_cast<std::int32_t>(std::min<std::int64_t>(
      4 * std::int64_t{body.tetrahedron_count}, sites.count + std::int64_t{new_nodes} * body.region_count));
  std::int32_t of_law[kLaws] = {};
  for (std::int32_t e = 0; e < body.tetrahedron_count; ++e) ++of_law[static_cast<int>(law_at(body, e))];
  for (int l = 0; l < kLaws; ++l) {
    const std::int32_t groups = (of_law[l] + kLanes - 1) / kLanes;
    group_count_ += groups;
    if (!has_form(static_cast<Law>(l))) first_form_ += groups;
  }
  bool made = create_arrays(memory, count) && (!averaged_ || gradients_.create(memory, body, sites, place, rows));
  is_site_ = memory.array<std::uint8_t>(static_cast<std::size_t>(group_count_ + gradients_.count()));
  made = made && is_site_;
  if (made) {
    std::fill_n(is_site_ + group_count_, gradients_.count(), std::uint8_t{1});
    fill_groups(body, sites, place, lane_of);
    slots_.fill(
        count, rows_, [&](std::size_t c) { return place[body.tetrahedra[c]]; },
        [&](std::size_t c) {
          const std::int32_t lane = lane_of[c / 4];
          return (lane / kLanes * 12 + 3 * static_cast<std::int32_t>(c % 4)) * kLanes + lane % kLanes;
        });
  }
  if (made && nodal_) {
    site_lanes_.fill(
        count, site_count_, [&](std::size_t c) { return sites.of_corner[c]; },
        [&](std::size_t c) { return lane_of[c / 4]; });
    for (std::int32_t s = 0; s < site_count_; ++s) {
      site_volume_[s] = static_cast<Number>(sites.volume[s]);
      site_bulk_[s] = static_cast<Number>(body.laws[sites.region[s]].bulk);
    }
  }
  if (made && new_nodes > 0) made = keep_uncut(memory, count, lane_of);
  scratch.release_all();
  return made;
}

// ---- the mesh is cut -----------------------------------------------------------------------------------------------

template <class Real>
bool ElementLanes<Real>::keep_uncut(SceneMemory& memory, std::size_t tetrahedra, const std::int32_t* lane_of) {
  const auto groups = static_cast<std::size_t>(group_count_), sites = static_cast<std::size_t>(site_count_);
  uncut_.groups = memory.array<Group>(groups), uncut_.site_volume = memory.array<Number>(sites);
  uncut_.lane_of = memory.array<std::int32_t>(tetrahedra), uncut_.lanes = memory.array<std::int32_t>(4 * tetrahedra);
  const bool made = slots_.keep_uncut(memory, tetrahedra) && (!nodal_ || site_lanes_.keep_uncut(memory, tetrahedra));
  if (!made || memory.failed()) return false;
  std::copy(groups_, groups_ + groups, uncut_.groups), std::copy(lane_of, lane_of + tetrahedra, uncut_.lane_of);
  if (nodal_) std::copy(site_volume_, site_volume_ + sites, uncut_.site_volume);
  return true;
}

template <class Real>
void ElementLanes<Real>::forget_changes() {
  if (!uncut_.groups) return;
  std::copy(uncut_.groups, uncut_.groups + group_count_, groups_);
  slots_.forget_changes();
  if (!nodal_) return;
  site_count_ = uncut_.sites;
  site_lanes_.forget_changes();
  std::copy(uncut_.site_volume, uncut_.site_volume + site_count_, site_volume_);
}

// The volume of a site that has other tetrahedra now.
template <class Real>
void ElementLanes<Real>::measure_site(std::int32_t site) {
  double volume = 0;
  for (std::int32_t at = site_lanes_.begin(site); at < site_lanes_.end(site); ++at) {
    const std::int32_t lane = site_lanes_[at];
    Number volumes[kLanes];
    std::memcpy(volumes, &groups_[lane / kLanes].volume, sizeof volumes);
    volume += static_cast<double>(quarter_ * volumes[lane % kLanes]);
  }
  site_volume_[site] = volume > 0 ? static_cast<Number>(volume) : Number(1);  // nothing is there that it divides
}

// Tetrahedra of a site go to a new one. lanes: ascending.
template <class Real>
void ElementLanes<Real>::split_site(std::int32_t site, const std::int32_t* lanes, std::int32_t count) {
  const std::int32_t made = site_count_++;
  site_lanes_.split(site, made, [&](std::int32_t lane) { return std::binary_search(lanes, lanes + count, lane); });
  site_bulk_[made] = site_bulk_[site];
  measure_site(site), measure_site(made);
}

template <class Real>
void ElementLanes<Real>::split(std::int32_t from, std::int32_t to, const std::int32_t* tetrahedra, std::int32_t count) {
  std::int32_t* const lanes = uncut_.lanes;
  for (std::int32_t i = 0; i < count; ++i) lanes[i] = uncut_.lane_of[tetrahedra[i]];
  std::sort(lanes, lanes + count);
  const auto goes = [&](std::int32_t lane) { return std::binary_search(lanes, lanes + count, lane); };
  if (from < rows_)
    slots_.split(from, to, [&](std::int32_t slot) { return goes(slot / (12 * kLanes) * kLanes + slot % kLanes); });
  for (std::int32_t i = 0; i < count; ++i) {
    Group& group = groups_[lanes[i] / kLanes];
    const std::int32_t lane = lanes[i] % kLanes;
    for (int a = 0; a < 4; ++a) {
      if (group.node[a][lane] != from) continue;
      group.node[a][lane] = to;
      if (!nodal_) continue;
      const std::int32_t site = group.site[a][lane];
      if (site_lanes_.has(site, lanes[i])) split_site(site, lanes, count);
      std::int32_t made = site_count_ - 1;
      while (!site_lanes_.has(made, lanes[i])) --made;
      group.site[a][lane] = made;
    }
  }
}

template <class Real>
void ElementLanes<Real>::remove(std::int32_t tetrahedron) {
  const std::int32_t at = uncut_.lane_of[tetrahedron], lane = at % kLanes;
  Group& group = groups_[at / kLanes];
  put_lane(group.volume, lane, 0);
  for (int a = 0; a < 3; ++a)
    for (int i = 0; i < 3; ++i) put_lane(group.gradient[a][i], lane, 0);
  for (int a = 0; a < 4 && nodal_; ++a) {
    const std::int32_t site = group.site[a][lane];
    site_lanes_.drop(site, at);
    measure_site(site);
  }
}

template <class Real>
PALPATE_INLINE void ElementLanes<Real>::displacement_gradient(const Group& group, const Number* u,
                                                              Deformation<Real>& d) const {
  Number corner[4][3][kLanes];
  for (int a = 0; a < 4; ++a)
    for (int k = 0; k < kLanes; ++k) {
      const Number* at = u + 3 * static_cast<std::size_t>(group.node[a][k]);
      for (int i = 0; i < 3; ++i) corner[a][i][k] = at[i];
    }
  Real x[4][3];
  std::memcpy(x, corner, sizeof x);
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k)
      d.h[i][k] = (x[1][i] - x[0][i]) * group.gradient[0][k] + (x[2][i] - x[0][i]) * group.gradient[1][k] +
                  (x[3][i] - x[0][i]) * group.gradient[2][k];
}

// 2 mu |dev sym(F^T grad q)|^2: F^T grad q is the change of the strain.
template <class Real>
double ElementLanes<Real>::turned_shear(const Number* u, const Number* q) const {
  double total = 0;
  for (std::int32_t b = 0; b < group_count_; ++b) {
    const Group& group = groups_[b];
    Number gradient[3][3][kLanes], volume[kLanes], shear[kLanes];
    std::memcpy(gradient, group.gradient, sizeof gradient);
    std::memcpy(volume, &group.volume, sizeof volume), std::memcpy(shear, &group.shear, sizeof shear);
    PALPATE_ROLLED for (int lane = 0; lane < kLanes; ++lane) {
      Number at[3][3] = {}, by[3][3] = {};  // the gradients of u and q
      PALPATE_ROLLED for (int a = 0; a < 3; ++a) {
        const std::ptrdiff_t corner = 3 * std::ptrdiff_t{group.node[a + 1][lane]};
        const std::ptrdiff_t origin = 3 * std::ptrdiff_t{group.node[0][lane]};
        PALPATE_ROLLED for (int i = 0; i < 3; ++i) PALPATE_ROLLED for (int k = 0; k < 3; ++k) {
          at[i][k] += (u[corner + i] - u[origin + i]) * gradient[a][k][lane];
          by[i][k] += (q[corner + i] - q[origin + i]) * gradient[a][k][lane];
        }
      }
      Number strain[3][3];
      PALPATE_ROLLED for (int i = 0; i < 3; ++i) PALPATE_ROLLED for (int k = 0; k < 3; ++k) {
        strain[i][k] = by[i][k];
        PALPATE_ROLLED for (int m = 0; m < 3; ++m) strain[i][k] += at[m][i] * by[m][k];
      }
      const Number mean = (strain[0][0] + strain[1][1] + strain[2][2]) / 3;
      Number square = 0;
      PALPATE_ROLLED for (int i = 0; i < 3; ++i) PALPATE_ROLLED for (int k = 0; k < 3; ++k) {
        const Number part = (strain[i][k] + strain[k][i]) / 2 - (i == k ? mean : 0);
        square += 2 * part * part;
      }
      total += static_cast<double>(volume[lane] * shear[lane] * square);
    }
  }
  return total * static_cast<double>(4 * quarter_);
}

// J_nm - 1 of each site, its energy, and its pressure kappa (J_nm - 1).
template <class Real>
PALPATE_INLINE void ElementLanes<Real>::average_dilatations(Energy* sum) const {
  const Number* change = reinterpret_cast<const Number*>(changes_);
  for (std::int32_t s = 0; s < site_count_; ++s) {
    Number total = 0;
    for (std::int32_t at = site_lanes_.begin(s), end = site_lanes_.end(s); at < end; ++at)
      total += change[site_lanes_[at]];
    pressures_[s] = site_bulk_[s] * (total / site_volume_[s]);
    sum->energy += 0.5 * static_cast<double>(pressures_[s] * total);
  }
}

template <class Real>
PALPATE_INLINE Real ElementLanes<Real>::mean_pressure(const Group& group) const {
  Number sum[kLanes];
  for (int k = 0; k < kLanes; ++k)
    sum[k] = quarter_ * ((pressures_[group.site[0][k]] + pressures_[group.site[1][k]]) +
                         (pressures_[group.site[2][k]] + pressures_[group.site[3][k]]));
  Real mean;
  std::memcpy(&mean, sum, sizeof mean);
  return mean;
}

template <class Real>
PALPATE_INLINE void ElementLanes<Real>::add_forces(Number* f) const {
  const Number* part = reinterpret_cast<const Number*>(forces_);
  for (std::int32_t n = 0; n < rows_; ++n) {
    Number sum[3] = {};
    for (std::int32_t at = slots_.begin(n), end = slots_.end(n); at < end; ++at)
      for (int i = 0; i < 3; ++i) sum[i] += part[slots_[at] + i * kLanes];
    for (int i = 0; i < 3; ++i) f[3 * static_cast<std::size_t>(n) + static_cast<std::size_t>(i)] = sum[i];
  }
}

// out: [4][3] N, of each corner.
template <class Real>
PALPATE_INLINE void ElementLanes<Real>::keep_forces(const Group& group, const Real stress[3][3], Real* out) const {
  for (int i = 0; i < 3; ++i) {
    Real others = Real{};
    for (int a = 0; a < 3; ++a) {
      const Real force = group.volume * (stress[i][0] * group.gradient[a][0] + stress[i][1] * group.gradient[a][1] +
                                         stress[i][2] * group.gradient[a][2]);
      out[3 * (a + 1) + i] = force;
      others = others + force;
    }
    out[i] = -others;
  }
}

template <class Real>
PALPATE_INLINE typename ElementLanes<Real>::Energy ElementLanes<Real>::evaluate(const Number* u, Number* f) const {
  Energy sum;
  Real least = Real{} + std::numeric_limits<Number>::max();
  const Real lowest = Real{} + Number(-0.99);  // below, the laws are not asked
  if (nodal_) {
    for (std::int32_t b = 0; b < group_count_; ++b) {
      Deformation<Real>& d = kept_[b];
      displacement_gradient(groups_[b], u, d);
      complete(d);
      changes_[b] = quarter_ * groups_[b].volume * d.j;
    }
    average_dilatations(&sum);
  }
  double energy[kLanes] = {};
  // Groups of tetrahedra, and behind them those of sites whose gradient is averaged.
  for (std::int32_t b = 0; b < group_count_ + gradients_.count(); ++b) {
    const bool is_site = is_site_[b] != 0;  // read, so that compilers do not make a loop of each kind
    const std::int32_t site = b - group_count_;
    Deformation<Real> d;
    if (is_site) {
      gradients_.gradient(site, u, d);
      complete(d);
    } else if (nodal_) {
      d = kept_[b];
    } else {
      displacement_gradient(groups_[b], u, d);
      complete(d);
    }
    least = smaller(least, d.j);
    d.j = larger(d.j, lowest);
    const Law law = is_site ? gradients_.group(site).law : groups_[b].law;
    const Real volume = is_site ? gradients_.group(site).volume : groups_[b].volume;
    const LawConstants<Real> constants =
        is_site
            ? LawConstants<Real>{gradients_.group(site).shear, gradients_.group(site).bulk, gradients_.group(site).form}
            : LawConstants<Real>{groups_[b].shear, groups_[b].bulk,
                                 has_form(law) ? forms_[b - first_form_].constant : nullptr};
    Real stress[3][3];
    const Real joules = volume * evaluate_law<Real>(law, nodal_, d, constants,
                                                    nodal_ && !is_site ? mean_pressure(groups_[b]) : Real{}, stress);
    Number part[kLanes];
    std::memcpy(part, &joules, sizeof part);
    for (int k = 0; k < kLanes; ++k) energy[k] += static_cast<double>(part[k]);
    if (is_site) {
      for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) gradients_.stress(site)[i][k] = volume * stress[i][k];
    } else {
      keep_forces(groups_[b], stress, forces_ + 12 * static_cast<std::size_t>(b));
    }
  }
  for (int k = 0; k < kLanes; ++k) sum.energy += energy[k];
  add_forces(f);
  if (averaged_) gradients_.add_forces(f);
  Number lanes[kLanes];
  std::memcpy(lanes, &least, sizeof lanes);
  for (int k = 1; k < kLanes; ++k) lanes[0] = std::min(lanes[0], lanes[k]);
  sum.least_volume = 1 + static_cast<double>(lanes[0]);
  return sum;
}

}  // namespace palpate
