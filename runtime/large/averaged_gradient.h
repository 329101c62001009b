// The part of p1-ang's shear that follows the gradient averaged at the nodes, several sites side by side. element_lanes.h asks the laws, for sites and
// tetrahedra at one place, so that their loops are there once.
//
// The mean gradient of a site is a sum over the nodes of its tetrahedra: H_nm = sum_a u_a g_a, g_a = sum_e V_e / 4 grad N_a / V_nm.
#pragma once

#include <algorithm>
#include <cstring>

#include "runtime/large/dilatation_sites.h"
#include "runtime/large/tissue_law.h"

namespace palpate {

template <class Real>
class AveragedGradient {
 public:
  using Number = Scalar<Real>;
  static constexpr int kLanes = kLanesOf<Real>;

  // place, rows: as ElementLanes takes them. Memory: about 350 bytes a node in single precision.
  bool create(SceneMemory& memory, const HyperelasticBody& body, const DilatationSites& sites,
              const std::int32_t* place, std::int32_t rows);

  struct Group {  // of kLanes sites with one law
    Real volume, shear, bulk, form[3];
    std::int32_t begin, end;  // terms
    Law law;
  };
  std::int32_t count() const { return group_count_; }
  const Group& group(std::int32_t b) const { return groups_[b]; }
  PALPATE_INLINE void gradient(std::int32_t b, const Number* u, Deformation<Real>& d) const;
  // Of the last evaluation, Pa times the volume: [3][3] of each group. f += their forces.
  Real (*stress(std::int32_t b) const)[3] { return stress_[b].of; }
  PALPATE_INLINE void add_forces(Number* f) const;

 private:
  struct Stress {
    Real of[3][3];
  };
  struct Term {  // a node of each site, whose gradient is zero where the site has no more
    std::int32_t node[kLanes];
    Real gradient[3];
  };
  struct Stars;  // the nodes of each site and their gradients
  void fill(const HyperelasticBody& body, const DilatationSites& sites, const Stars& stars, std::int32_t site,
            const std::int32_t* place, Group& group, int lane);

  Group* groups_ = nullptr;
  Term* terms_ = nullptr;
  Stress* stress_ = nullptr;  // [groups]
  std::int32_t group_count_ = 0, rows_ = 0;
};

template <class Real>
struct AveragedGradient<Real>::Stars {
  std::int32_t* first = nullptr;  // [sites + 1]
  std::int32_t* node = nullptr;
  double* gradient = nullptr;  // [3] 1/m, of each of `node`

  bool find(SceneMemory& scratch, const HyperelasticBody& body, const DilatationSites& sites);
};

template <class Real>
bool AveragedGradient<Real>::Stars::find(SceneMemory& scratch, const HyperelasticBody& body,
                                         const DilatationSites& sites) {
  const auto count = static_cast<std::size_t>(sites.count);
  const auto corners = 4 * static_cast<std::size_t>(body.tetrahedron_count);
  std::int32_t* const begin = scratch.array<std::int32_t>(count + 1);  // tetrahedra of each site
  std::int32_t* const tetrahedron = scratch.array<std::int32_t>(corners);
  std::int32_t* const entry = scratch.array<std::int32_t>(static_cast<std::size_t>(body.node_count));  // plus 1
  first = scratch.array<std::int32_t>(count + 1);
  if (scratch.failed()) return false;
  for (std::size_t c = 0; c < corners; ++c) ++begin[sites.of_corner[c] + 1];
  for (std::size_t s = 0; s < count; ++s) begin[s + 1] += begin[s];
  for (std::size_t c = corners; c-- > 0;)
    tetrahedron[--begin[sites.of_corner[c] + 1]] = static_cast<std::int32_t>(c / 4);
  for (std::size_t s = 0; s < count; ++s) begin[s] = begin[s + 1];
  begin[count] = static_cast<std::int32_t>(corners);
  for (int pass = 0; pass < 2; ++pass) {
    std::int32_t total = 0;
    std::fill(entry, entry + body.node_count, 0);
    for (std::size_t s = 0; s < count; ++s) {
      first[s] = total;
      for (std::int32_t t = begin[s]; t < begin[s + 1]; ++t) {
        double g[3][3];
        const double share = shape_gradients(body, tetrahedron[t], g) / (4 * sites.volume[s]);
        for (int a = 0; a < 4; ++a) {
          const std::int32_t n =
              body.tetrahedra[4 * static_cast<std::size_t>(tetrahedron[t]) + static_cast<std::size_t>(a)];
          if (entry[n] <= first[s]) entry[n] = ++total;
          if (pass == 0) continue;
          const std::int32_t at = entry[n] - 1;
          node[at] = n;
          for (int k = 0; k < 3; ++k)
            gradient[3 * at + k] += share * (a ? g[a - 1][k] : -(g[0][k] + g[1][k] + g[2][k]));
        }
      }
    }
    first[count] = total;
    if (pass == 0) {
      node = scratch.array<std::int32_t>(static_cast<std::size_t>(total));
      gradient = scratch.array<double>(3 * static_cast<std::size_t>(total));
      if (scratch.failed()) return false;
    }
  }
  return true;
}

template <class Real>
void AveragedGradient<Real>::fill(const HyperelasticBody& body, const DilatationSites& sites, const Stars& stars,
                                  std::int32_t site, const std::int32_t* place, Group& group, int lane) {
  const TissueLaw& law = body.laws[sites.region[site]];
  put_lane(group.volume, lane, body.averaged_shear * sites.volume[site]);
  put_lane(group.shear, lane, law.shear);
  put_lane(group.bulk, lane, bulk_of(law, group.law));
  for (int i = 0; i < 3; ++i) put_lane(group.form[i], lane, law.form.constant[i]);
  for (std::int32_t at = stars.first[site]; at < stars.first[site + 1]; ++at) {
    Term& term = terms_[group.begin + at - stars.first[site]];
    term.node[lane] = place[stars.node[at]];
    for (int k = 0; k < 3; ++k) put_lane(term.gradient[k], lane, stars.gradient[3 * at + k]);
  }
}

template <class Real>
bool AveragedGradient<Real>::create(SceneMemory& memory, const HyperelasticBody& body, const DilatationSites& sites,
                                    const std::int32_t* place, std::int32_t rows) {
  rows_ = rows;
  SceneMemory scratch = memory.of_same_host();
  Stars stars;
  std::int32_t* const order = scratch.array<std::int32_t>(static_cast<std::size_t>(sites.count));
  bool made = order && stars.find(scratch, body, sites);
  const auto law_at = [&](std::int32_t site) {
    return static_cast<int>(law_of(body.laws[sites.region[site]], body.nodal_dilatation));
  };
  const auto size = [&](std::int32_t site) { return stars.first[site + 1] - stars.first[site]; };
  if (made) {
    // One law after the other, and sites of about as many nodes side by side.
    std::int32_t most = 0, placed = 0;
    for (std::int32_t s = 0; s < sites.count; ++s) most = std::max(most, size(s));
    for (int law = 0; law < kLaws; ++law)
      for (std::int32_t nodes = most; nodes > 0; --nodes)
        for (std::int32_t s = 0; s < sites.count; ++s)
          if (law_at(s) == law && size(s) == nodes) order[placed++] = s;
    for (int pass = 0; pass < 2 && made; ++pass) {
      std::int32_t terms = 0;
      group_count_ = 0;
      for (std::int32_t at = 0; at < sites.count; ++group_count_) {
        std::int32_t end = at + 1;
        while (end < sites.count && end < at + kLanes && law_at(order[end]) == law_at(order[at])) ++end;
        const std::int32_t begin = terms;
        terms += size(order[at]);
        if (pass == 1) {
          Group& group = groups_[group_count_];
          group.law = static_cast<Law>(law_at(order[at])), group.begin = begin, group.end = terms;
          for (Real& constant : group.form) constant = constant + 1;  // a lane without a site divides by it
          for (int lane = 0; lane < end - at; ++lane) fill(body, sites, stars, order[at + lane], place, group, lane);
        }
        at = end;
      }
      if (pass == 1) break;
      groups_ = memory.array<Group>(static_cast<std::size_t>(group_count_));
      terms_ = memory.array<Term>(static_cast<std::size_t>(terms));
      stress_ = memory.array<Stress>(static_cast<std::size_t>(group_count_));
      made = !memory.failed();
    }
  }
  scratch.release_all();
  return made;
}

template <class Real>
PALPATE_INLINE void AveragedGradient<Real>::gradient(std::int32_t b, const Number* u, Deformation<Real>& d) const {
  for (auto& row : d.h)
    for (Real& h : row) h = Real{};
  for (std::int32_t t = groups_[b].begin; t < groups_[b].end; ++t) {
    const Term& term = terms_[t];
    Number at[3][kLanes];
    for (int k = 0; k < kLanes; ++k)
      for (int i = 0; i < 3; ++i)
        at[i][k] = u[3 * static_cast<std::size_t>(term.node[k]) + static_cast<std::size_t>(i)];
    Real x[3];
    std::memcpy(x, at, sizeof x);
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) d.h[i][k] = d.h[i][k] + x[i] * term.gradient[k];
  }
}

template <class Real>
PALPATE_INLINE void AveragedGradient<Real>::add_forces(Number* f) const {
  for (std::int32_t b = 0; b < group_count_; ++b) {
    const auto& stress = stress_[b].of;
    for (std::int32_t t = groups_[b].begin; t < groups_[b].end; ++t) {
      const Term& term = terms_[t];
      Real force[3];
      for (int i = 0; i < 3; ++i)
        force[i] = stress[i][0] * term.gradient[0] + stress[i][1] * term.gradient[1] + stress[i][2] * term.gradient[2];
      Number on[3][kLanes];
      std::memcpy(on, force, sizeof on);
      for (int k = 0; k < kLanes; ++k)
        for (int i = 0; i < 3 && term.node[k] < rows_; ++i)
          f[3 * static_cast<std::size_t>(term.node[k]) + static_cast<std::size_t>(i)] += on[i][k];
    }
  }
}

}  // namespace palpate
