// The tangent K(u) of the body's energy at a displaced state, one block column after the other: what a renewed metric is made from
// (large_solver.h). At rest it is the stiffness of block_rows.h.
#pragma once

#include <algorithm>
#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/large/deformation.h"
#include "runtime/large/hyperelastic_body.h"

namespace palpate {

class Tangent {
 public:
  // place, rows: as assemble_stiffness (block_rows.h) takes them. What the tangent needs of the body is copied. of_held: N/m, the
  // diagonal of single held dofs. Memory: about 500 bytes a tetrahedron with nodal dilatation, 100 without.
  bool create(SceneMemory& memory, const HyperelasticBody& body, const std::int32_t* place, std::int32_t rows,
              double of_held);

  // u: [nodes][3] m, the displacement of each place; borrowed until the last column is added. Cost: an evaluation of the energy.
  void begin(const float* u);

  // Calls add(row, r, c, N/m) for parts of column c of block column `column`, component r of row `row`, from the diagonal on down.
  template <class Add>
  void add_column(std::int32_t column, Add add) const {
    const auto free = [&](std::int32_t row, int r) {
      return !held_[3 * static_cast<std::size_t>(row) + static_cast<std::size_t>(r)];
    };
    const auto add_free = [&](std::int32_t row, int r, int c, double value) {
      if (row >= column && free(row, r) && free(column, c)) add(row, r, c, value);
    };
    for (std::int64_t at = first_[column]; at < first_[column + 1]; ++at) {
      double block[4][3][3];  // [corner][r][c]
      const std::int32_t corner = corners_[at], e = corner / 4;
      tetrahedron(e, corner % 4, block);
      for (int a = 0; a < 4; ++a)
        if (const std::int32_t row = corner_place_[4 * static_cast<std::size_t>(e) + static_cast<std::size_t>(a)];
            row < rows_)
          for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 3; ++c) add_free(row, r, c, block[a][r][c]);
    }
    const std::int64_t first_site = nodal_ ? site_first_of_row_[column] : 0,
                       end_site = nodal_ ? site_first_of_row_[column + 1] : 0;
    for (std::int64_t at = first_site; at < end_site; ++at) {
      const std::int64_t own = site_entries_[at];
      const std::int32_t site = site_of_entry_[own];
      const double factor = site_bulk_[site] / site_volume_[site];
      double change[3][3][3];  // [c] of the averaged stress
      if (averaged_.share > 0) site_stress_change(site, averaged_.gradient + 3 * own, change);
      for (std::int64_t other = site_first_[site]; other < site_first_[site + 1]; ++other)
        if (const std::int32_t row = entry_row_[other]; row >= column)
          for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 3; ++c)
              add_free(row, r, c,
                       factor * volume_change_[3 * other + r] * volume_change_[3 * own + c] +
                           (averaged_.share > 0 ? along(change[c][r], averaged_.gradient + 3 * other) : 0));
    }
    for (std::int64_t at = supports_.first[column]; at < supports_.first[column + 1]; ++at)
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) add_free(supports_.row[at], r, c, supports_.stiffness[9 * at + 3 * r + c]);
    for (int c = 0; c < 3; ++c)
      if (!free(column, c)) add(column, c, c, of_held_);
  }

 private:
  bool list_corners(SceneMemory& memory, const HyperelasticBody& body, const std::int32_t* place);
  bool list_sites(SceneMemory& memory, const HyperelasticBody& body);
  bool list_supports(SceneMemory& memory, const HyperelasticBody& body, const std::int32_t* place);
  double gradients(std::int32_t e, double g[4][3]) const;
  void deform(std::int32_t e, const double g[4][3], Deformation<double>* d) const;
  void tetrahedron(std::int32_t e, int corner, double block[4][3][3]) const;
  void add_to_site(std::int32_t site, double quarter, const double g[4][3], const Deformation<double>& d,
                   const std::int32_t* entry);
  void site_stress_change(std::int32_t site, const double* gradient, double change[3][3][3]) const;
  static double along(const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

  std::int32_t rows_ = 0, tetrahedra_ = 0, sites_ = 0;
  bool nodal_ = false;
  double of_held_ = 0;
  const float* u_ = nullptr;
  double* position_ = nullptr;            // [nodes][3] m, of each place
  std::uint8_t* held_ = nullptr;          // [rows][3]
  std::int32_t* corner_place_ = nullptr;  // [tetrahedra][4]
  std::int32_t* region_ = nullptr;        // [tetrahedra]
  TissueLaw* laws_ = nullptr;             // [regions]
  std::int64_t* first_ = nullptr;         // [rows + 1] into corners_
  std::int32_t* corners_ = nullptr;       // 4 tetrahedron + corner
  // Of sites where the dilatation is averaged. An entry is a node of a site's tetrahedra.
  std::int32_t* site_of_corner_ = nullptr;                                           // [tetrahedra][4]
  double *site_volume_ = nullptr, *site_bulk_ = nullptr, *site_pressure_ = nullptr;  // [sites]
  std::int64_t* site_first_ = nullptr;                                               // [sites + 1] entries
  std::int32_t *entry_row_ = nullptr, *site_of_entry_ = nullptr;                     // [entries]
  double* volume_change_ = nullptr;            // [entries][3] m^2, of V_nm J_nm by the node's displacement
  std::int32_t* entry_of_corner_ = nullptr;    // [tetrahedra][4 sites][4 nodes], -1: the node is held
  std::int64_t* site_first_of_row_ = nullptr;  // [rows + 1] into site_entries_
  std::int64_t* site_entries_ = nullptr;
  // Where the shear is averaged too:
  struct Averaged {
    double share = 0;                         // of the shear
    double* gradient = nullptr;               // [entries][3] 1/m, of the mean gradient by the node's displacement
    std::int32_t* region = nullptr;           // [sites]
    Deformation<double>* deformed = nullptr;  // [sites]
    bool create(SceneMemory& memory, std::int32_t sites, std::size_t entries);
  } averaged_;
  struct Supports {
    std::int64_t* first = nullptr;  // [rows + 1]
    std::int32_t* row = nullptr;
    double* stiffness = nullptr;  // [9] N/m, component r of `row` by component c of the column
  } supports_;
};

}  // namespace palpate
