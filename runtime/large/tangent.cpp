#include "runtime/large/tangent.h"

#include "runtime/large/dilatation_sites.h"
#include "runtime/large/tissue_law.h"

namespace palpate {
namespace {

// first[i + 1]: how many entries of list i; becomes where each list begins.
void begin_lists(std::int64_t* first, std::int32_t count) {
  for (std::int32_t i = 0; i < count; ++i) first[i + 1] += first[i];
}
// After entries were put at first[i]++: first[i] is where list i ends.
void end_lists(std::int64_t* first, std::int32_t count) {
  for (std::int32_t i = count; i > 0; --i) first[i] = first[i - 1];
  first[0] = 0;
}

}  // namespace

bool Tangent::create(SceneMemory& memory, const HyperelasticBody& body, const std::int32_t* place, std::int32_t rows,
                     double of_held) {
  rows_ = rows, tetrahedra_ = body.tetrahedron_count, nodal_ = body.nodal_dilatation, of_held_ = of_held;
  averaged_.share = body.averaged_shear;
  const auto nodes = static_cast<std::size_t>(body.node_count), count = static_cast<std::size_t>(tetrahedra_);
  position_ = memory.array<double>(3 * nodes), held_ = memory.array<std::uint8_t>(3 * static_cast<std::size_t>(rows));
  region_ = memory.array<std::int32_t>(count),
  laws_ = memory.array<TissueLaw>(static_cast<std::size_t>(body.region_count));
  if (memory.failed()) return false;
  for (std::size_t n = 0; n < nodes; ++n)
    for (std::size_t i = 0; i < 3; ++i) {
      const auto at = 3 * static_cast<std::size_t>(place[n]) + i;
      position_[at] = body.nodes[3 * n + i];
      if (place[n] < rows) held_[at] = body.fixed[3 * n + i];
    }
  std::copy(body.region, body.region + count, region_);
  std::copy(body.laws, body.laws + body.region_count, laws_);
  return list_corners(memory, body, place) && (!nodal_ || list_sites(memory, body)) &&
         list_supports(memory, body, place);
}

bool Tangent::list_corners(SceneMemory& memory, const HyperelasticBody& body, const std::int32_t* place) {
  const auto corners = 4 * static_cast<std::size_t>(tetrahedra_);
  corner_place_ = memory.array<std::int32_t>(corners), corners_ = memory.array<std::int32_t>(corners);
  first_ = memory.array<std::int64_t>(static_cast<std::size_t>(rows_) + 1);
  if (memory.failed()) return false;
  for (std::size_t c = 0; c < corners; ++c)
    if ((corner_place_[c] = place[body.tetrahedra[c]]) < rows_) ++first_[corner_place_[c] + 1];
  begin_lists(first_, rows_);
  for (std::size_t c = 0; c < corners; ++c)
    if (corner_place_[c] < rows_) corners_[first_[corner_place_[c]]++] = static_cast<std::int32_t>(c);
  end_lists(first_, rows_);
  return true;
}

bool Tangent::Averaged::create(SceneMemory& memory, std::int32_t sites, std::size_t entries) {
  gradient = memory.array<double>(3 * entries);
  region = memory.array<std::int32_t>(static_cast<std::size_t>(sites));
  deformed = memory.array<Deformation<double>>(static_cast<std::size_t>(sites));
  return !memory.failed();
}

bool Tangent::list_sites(SceneMemory& memory, const HyperelasticBody& body) {
  SceneMemory scratch = memory.of_same_host();
  DilatationSites sites;
  const auto corners = 4 * static_cast<std::size_t>(tetrahedra_);
  bool made = find_dilatation_sites(scratch, body, &sites);
  sites_ = sites.count;
  const auto count = static_cast<std::size_t>(sites_);
  std::int64_t* const star =
      scratch.array<std::int64_t>(count + 1);  // tetrahedra of each site, once for each corner there
  std::int32_t* const members = scratch.array<std::int32_t>(corners);
  std::int32_t* const entry =
      scratch.array<std::int32_t>(static_cast<std::size_t>(rows_));  // 1 + of the row in this site
  site_of_corner_ = memory.array<std::int32_t>(corners), entry_of_corner_ = memory.array<std::int32_t>(4 * corners);
  site_volume_ = memory.array<double>(count), site_bulk_ = memory.array<double>(count);
  site_pressure_ = memory.array<double>(count), site_first_ = memory.array<std::int64_t>(count + 1);
  site_first_of_row_ = memory.array<std::int64_t>(static_cast<std::size_t>(rows_) + 1);
  made = made && !scratch.failed() && !memory.failed();
  if (made) {
    for (std::size_t c = 0; c < corners; ++c) ++star[(site_of_corner_[c] = sites.of_corner[c]) + 1];
    begin_lists(star, sites_);
    for (std::size_t c = 0; c < corners; ++c) members[star[site_of_corner_[c]]++] = static_cast<std::int32_t>(c);
    end_lists(star, sites_);
    // Entries are counted first and listed then.
    for (int pass = 0; pass < 2 && made; ++pass) {
      std::int64_t entries = 0;
      for (std::int32_t s = 0; s < sites_; ++s) {
        site_first_[s] = entries;
        for (std::int64_t at = star[s]; at < star[s + 1]; ++at)
          for (int b = 0; b < 4; ++b) {
            const std::int32_t corner = members[at], row = corner_place_[corner / 4 * 4 + b];
            const bool is_new = row < rows_ && entry[row] <= site_first_[s];
            if (is_new) entry[row] = static_cast<std::int32_t>(++entries);
            if (pass == 0) continue;
            entry_of_corner_[4 * static_cast<std::size_t>(corner) + static_cast<std::size_t>(b)] =
                row < rows_ ? entry[row] - 1 : -1;
            if (is_new) entry_row_[entries - 1] = row, site_of_entry_[entries - 1] = s;
          }
      }
      site_first_[sites_] = entries;
      if (pass == 1) break;
      std::fill(entry, entry + rows_, 0);
      const auto length = static_cast<std::size_t>(entries);
      entry_row_ = memory.array<std::int32_t>(length), site_of_entry_ = memory.array<std::int32_t>(length);
      volume_change_ = memory.array<double>(3 * length), site_entries_ = memory.array<std::int64_t>(length);
      made = !memory.failed();
      made = made && (averaged_.share == 0 || averaged_.create(memory, sites_, length));
    }
  }
  if (made) {
    for (std::int32_t s = 0; s < sites_; ++s)
      site_volume_[s] = sites.volume[s], site_bulk_[s] = laws_[sites.region[s]].bulk;
    if (averaged_.share > 0) std::copy(sites.region, sites.region + sites_, averaged_.region);
    for (std::int64_t e = 0; e < site_first_[sites_]; ++e) ++site_first_of_row_[entry_row_[e] + 1];
    begin_lists(site_first_of_row_, rows_);
    for (std::int64_t e = 0; e < site_first_[sites_]; ++e) site_entries_[site_first_of_row_[entry_row_[e]]++] = e;
    end_lists(site_first_of_row_, rows_);
  }
  scratch.release_all();
  return made;
}

bool Tangent::list_supports(SceneMemory& memory, const HyperelasticBody& body, const std::int32_t* place) {
  const auto ends = 2 * static_cast<std::size_t>(body.support_count);
  supports_.first = memory.array<std::int64_t>(static_cast<std::size_t>(rows_) + 1);
  supports_.row = memory.array<std::int32_t>(ends), supports_.stiffness = memory.array<double>(9 * ends);
  if (memory.failed()) return false;
  // Each pair of different nodes stands in both columns; that of one node once.
  for (int pass = 0; pass < 2; ++pass) {
    for (std::int32_t p = 0; p < body.support_count; ++p) {
      const std::int32_t a = place[body.support_nodes[2 * p]], b = place[body.support_nodes[2 * p + 1]];
      if (a >= rows_ || b >= rows_) continue;
      for (int turned = 0; turned < (a == b ? 1 : 2); ++turned) {
        const std::int32_t column = turned ? a : b, row = turned ? b : a;
        if (pass == 0) {
          ++supports_.first[column + 1];
          continue;
        }
        const std::int64_t at = supports_.first[column]++;
        supports_.row[at] = row;
        const double* const k = body.support_stiffness + 9 * static_cast<std::int64_t>(p);
        for (int r = 0; r < 3; ++r)
          for (int c = 0; c < 3; ++c) supports_.stiffness[9 * at + 3 * r + c] = turned ? k[3 * c + r] : k[3 * r + c];
      }
    }
    if (pass == 0) begin_lists(supports_.first, rows_);
  }
  end_lists(supports_.first, rows_);
  return true;
}

// Of the four shape functions at rest, 1/m. Returns the volume, m^3.
double Tangent::gradients(std::int32_t e, double g[4][3]) const {
  const std::int32_t* const place = corner_place_ + 4 * static_cast<std::size_t>(e);
  const double* const x = position_ + 3 * static_cast<std::size_t>(place[0]);
  double edge[3][3];
  for (int a = 0; a < 3; ++a)
    for (int i = 0; i < 3; ++i)
      edge[a][i] = position_[3 * static_cast<std::size_t>(place[a + 1]) + static_cast<std::size_t>(i)] - x[i];
  double determinant = 0;
  for (int a = 0; a < 3; ++a) {
    const double *const b = edge[(a + 1) % 3], *const c = edge[(a + 2) % 3];
    for (int i = 0; i < 3; ++i) g[a + 1][i] = b[(i + 1) % 3] * c[(i + 2) % 3] - b[(i + 2) % 3] * c[(i + 1) % 3];
    if (a == 0) determinant = edge[0][0] * g[1][0] + edge[0][1] * g[1][1] + edge[0][2] * g[1][2];
  }
  for (int i = 0; i < 3; ++i) {
    for (int a = 1; a < 4; ++a) g[a][i] /= determinant;
    g[0][i] = -(g[1][i] + g[2][i] + g[3][i]);
  }
  return determinant / 6;
}

void Tangent::deform(std::int32_t e, const double g[4][3], Deformation<double>* d) const {
  for (auto& row : d->h)
    for (double& h : row) h = 0;
  for (int a = 0; a < 4; ++a) {
    const float* const u =
        u_ + 3 * static_cast<std::size_t>(corner_place_[4 * static_cast<std::size_t>(e) + static_cast<std::size_t>(a)]);
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) d->h[i][k] += static_cast<double>(u[i]) * g[a][k];
  }
  complete(*d);
}

void Tangent::begin(const float* u) {
  u_ = u;
  if (!nodal_) return;
  std::fill(site_pressure_, site_pressure_ + sites_, 0.0);
  std::fill(volume_change_, volume_change_ + 3 * site_first_[sites_], 0.0);
  if (averaged_.share > 0) {
    std::fill(averaged_.gradient, averaged_.gradient + 3 * site_first_[sites_], 0.0);
    std::fill(averaged_.deformed, averaged_.deformed + sites_, Deformation<double>{});
  }
  for (std::int32_t e = 0; e < tetrahedra_; ++e) {
    double g[4][3];
    Deformation<double> d;
    const double quarter = gradients(e, g) / 4;
    deform(e, g, &d);
    for (int a = 0; a < 4; ++a) {
      const std::size_t corner = 4 * static_cast<std::size_t>(e) + static_cast<std::size_t>(a);
      site_pressure_[site_of_corner_[corner]] += quarter * d.j;
      if (averaged_.share > 0) add_to_site(site_of_corner_[corner], quarter, g, d, entry_of_corner_ + 4 * corner);
      for (int b = 0; b < 4; ++b) {
        const std::int32_t entry = entry_of_corner_[4 * corner + static_cast<std::size_t>(b)];
        for (int i = 0; i < 3 && entry >= 0; ++i)
          for (int k = 0; k < 3; ++k)
            volume_change_[3 * static_cast<std::size_t>(entry) + static_cast<std::size_t>(i)] +=
                quarter * (d.cof[i][k] + (i == k)) * g[b][k];
      }
    }
  }
  for (std::int32_t s = 0; s < sites_; ++s) site_pressure_[s] *= site_bulk_[s] / site_volume_[s];
  for (std::int32_t s = 0; s < sites_ && averaged_.share > 0; ++s) complete(averaged_.deformed[s]);
}

// To the mean gradient of a site, and to its derivative by the displacement of each of the tetrahedron's nodes.
void Tangent::add_to_site(std::int32_t site, double quarter, const double g[4][3], const Deformation<double>& d,
                          const std::int32_t* entry) {
  const double share = quarter / site_volume_[site];
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) averaged_.deformed[site].h[i][k] += share * d.h[i][k];
  for (int b = 0; b < 4; ++b)
    for (int k = 0; k < 3 && entry[b] >= 0; ++k)
      averaged_.gradient[3 * static_cast<std::size_t>(entry[b]) + static_cast<std::size_t>(k)] += share * g[b][k];
}

// Of the site's averaged stress times its volume, as the node with this gradient moves along c.
void Tangent::site_stress_change(std::int32_t site, const double* gradient, double change[3][3][3]) const {
  const LawTangent tangent(laws_[averaged_.region[site]], true, averaged_.deformed[site], 0);
  for (int c = 0; c < 3; ++c) {
    double moved[3][3] = {};
    for (int k = 0; k < 3; ++k) moved[c][k] = averaged_.share * site_volume_[site] * gradient[k];
    tangent.change(moved, change[c]);
  }
}

// dforce of each corner / d displacement of `corner`, without what is averaged at nodes.
void Tangent::tetrahedron(std::int32_t e, int corner, double block[4][3][3]) const {
  double g[4][3], pressure = 0;
  const double own = 1 - averaged_.share, volume = own * gradients(e, g);
  Deformation<double> d;
  deform(e, g, &d);
  for (int a = 0; a < 4 && nodal_; ++a)
    pressure += site_pressure_[site_of_corner_[4 * static_cast<std::size_t>(e) + static_cast<std::size_t>(a)]] / 4;
  const LawTangent tangent(laws_[region_[e]], nodal_, d, pressure / own);
  for (int c = 0; c < 3; ++c) {
    double moved[3][3] = {}, stress[3][3];
    for (int k = 0; k < 3; ++k) moved[c][k] = g[corner][k];
    tangent.change(moved, stress);
    for (int a = 0; a < 4; ++a)
      for (int r = 0; r < 3; ++r)
        block[a][r][c] = volume * (stress[r][0] * g[a][0] + stress[r][1] * g[a][1] + stress[r][2] * g[a][2]);
  }
}

}  // namespace palpate
