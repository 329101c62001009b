// The stored tensors: whole rows for the shape, single 3 x 3 entries for contacts.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "formats/compliance_blocks.h"
#include "formats/half.h"
#include "runtime/base/instructions.h"
#include "runtime/base/vec3.h"
#include "runtime/bundle/compliance.h"
#include "runtime/dense/node_sum.h"

namespace palpate {

// The section displacement_surface or displacement_interior: [S][3][nodes][3] numbers of one type. Row [k][j] is the field of a
// unit displacement of column k's node along axis j.
struct DisplacementRows {
  const void* numbers = nullptr;
  formats::ElementType type = formats::ElementType::f32;
  const float* scale = nullptr;  // [S][3] factors of f16 rows; nullptr: 1
  std::int32_t nodes = 0;

  // [nodes][3]: the field divided by row_scale.
  const void* row(std::int32_t column, int j) const {
    return static_cast<const unsigned char*>(numbers) + number(column, j) * formats::element_bytes(type);
  }
  float row_scale(std::int32_t column, int j) const {
    return scale ? scale[static_cast<std::size_t>(column) * 3 + static_cast<std::size_t>(j)] : 1.0f;
  }
  // T^u_nk of a node and a column: [i][j] is the displacement along i per unit displacement along j.
  Mat3 entry(std::int32_t node, std::int32_t column) const {
    if (type == formats::ElementType::f32) return entry_of<float>(node, column);
    if (type == formats::ElementType::f64) return entry_of<double>(node, column);
    return entry_of<std::uint16_t>(node, column);
  }
  // Prefetches the three addresses that entry() reads.
  void prefetch(std::int32_t node, std::int32_t column) const {
    for (int j = 0; j < 3; ++j) {
      const char* at =
          static_cast<const char*>(row(column, j)) + 3 * static_cast<std::size_t>(node) * formats::element_bytes(type);
      palpate::prefetch(at);
    }
  }
  // sum_r coefficient[r] row[r] at a node. Cost: one read per row, at distant addresses.
  Vec3 sum_at_node(const void* const* row, const double* coefficient, int count, std::int32_t node) const {
    double sum[3];
    palpate::sum_at_node(type, row, coefficient, count, 3 * static_cast<std::size_t>(node),
                         3 * static_cast<std::size_t>(nodes), sum);
    return load3(sum);
  }
  // The same at `count` nodes from `node` on, [count][3].
  void sum_at_run(const void* const* row, const double* coefficient, int count_of_rows, std::int32_t node,
                  std::int32_t count, double* out) const {
    palpate::sum_at_run(type, row, coefficient, count_of_rows, 3 * static_cast<std::size_t>(node),
                        3 * static_cast<std::size_t>(count), out);
  }

 private:
  static double widened(float stored) { return stored; }
  static double widened(double stored) { return stored; }
  static double widened(std::uint16_t half) { return formats::float_of_half(half); }
  template <class Stored>
  Mat3 entry_of(std::int32_t node, std::int32_t column) const {
    Mat3 t;
    for (int j = 0; j < 3; ++j) {
      const Stored* at = static_cast<const Stored*>(row(column, j)) + 3 * static_cast<std::size_t>(node);
      const double factor = row_scale(column, j);
      for (int i = 0; i < 3; ++i) t.m[i][j] = factor * widened(at[i]);
    }
    return t;
  }
  std::size_t number(std::int32_t column, int j) const {
    return (static_cast<std::size_t>(column) * 3 + static_cast<std::size_t>(j)) * static_cast<std::size_t>(nodes) * 3;
  }
};

// The columns of interior nodes that may be held (section corridor/*). Unlike those of the surface they are fields of a unit force.
struct Corridor {
  std::int32_t count = 0;                        // K
  const std::int32_t* nodes = nullptr;           // [K] mesh node of each column, ascending, none on the surface
  const float* compliance = nullptr;             // [K][3][K][3] m/N: C between these nodes, symmetric
  DisplacementRows surface;                      // [K] m/N, f32
  const std::int32_t* node_of_column = nullptr;  // [S] surface node of each column of the tensors

  // -1: the corridor does not have the node.
  std::int32_t index_of(std::int32_t node) const {
    const std::int32_t* const at = std::lower_bound(nodes, nodes + count, node);
    return at != nodes + count && *at == node ? static_cast<std::int32_t>(at - nodes) : -1;
  }
  // C of corridor nodes l and k, m/N.
  Mat3 between(std::int32_t l, std::int32_t k) const {
    Mat3 c;
    for (int j = 0; j < 3; ++j) {
      const float* const row = compliance + ((3 * static_cast<std::size_t>(k) + static_cast<std::size_t>(j)) *
                                                 static_cast<std::size_t>(count) +
                                             static_cast<std::size_t>(l)) *
                                                3;
      for (int i = 0; i < 3; ++i) c.m[i][j] = row[i];
    }
    return c;
  }
};

// The tensors of a bundle. The surface's displacements are stored rows, or follow from a stored compliance. In a scene with a corridor the
// columns from `columns` on are those of the corridor: their T^u is the field of a unit force, and their T^f is one.
struct Tensors {
  DisplacementRows surface;
  const Compliance* compliance = nullptr;
  const double* stiffness = nullptr;  // [S][3][3] N/m, T^f_k (section tensors/force)
  std::int32_t surface_nodes = 0, columns = 0;
  const Corridor* corridor = nullptr;  // where the scene has one

  std::int32_t all_columns() const { return columns + (corridor ? corridor->count : 0); }
  bool is_of_surface(std::int32_t column) const { return column < columns; }
  // touchable: [S] surface node of each column.
  std::int32_t node_of(std::int32_t column, const std::int32_t* touchable) const {
    return column < columns ? touchable[column] : corridor->nodes[column - columns];
  }
  // T^u_nk of a surface node, or a node of the corridor, and a column in any stored form. Cost: three reads at distant addresses, or
  // Compliance::entry.
  Mat3 displacement(std::int32_t node, std::int32_t column) const {
    if (corridor && (column >= columns || node >= surface_nodes)) return displacement_in_corridor(node, column);
    return compliance ? compliance->entry(node, column) * stiffness_of(column) : surface.entry(node, column);
  }
  void prefetch(std::int32_t node, std::int32_t column) const {
    if (column >= columns) {
      if (node < surface_nodes) corridor->surface.prefetch(node, column - columns);
    } else if (!compliance && node < surface_nodes) {
      surface.prefetch(node, column);
    }
  }
  // Row [k][j] of T^u on the surface, where it is stored as rows; and its factor.
  const void* surface_row(std::int32_t column, int j) const {
    return column < columns ? surface.row(column, j) : corridor->surface.row(column - columns, j);
  }
  formats::ElementType row_type(std::int32_t column) const {
    return column < columns ? surface.type : corridor->surface.type;
  }
  bool has_rows_of_two_types() const { return corridor && !compliance && corridor->surface.type != surface.type; }
  float row_scale(std::int32_t column, int j) const { return column < columns ? surface.row_scale(column, j) : 1.0f; }
  Mat3 stiffness_of(std::int32_t column) const {
    Mat3 f;
    if (column >= columns) {
      f.m[0][0] = f.m[1][1] = f.m[2][2] = 1;
      return f;
    }
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) f.m[i][j] = stiffness[9 * static_cast<std::size_t>(column) + 3 * i + j];
    return f;
  }

 private:
  // In a function of its own, because few scenes have a corridor and many places call displacement().
  Mat3 displacement_in_corridor(std::int32_t node, std::int32_t column) const;
};

}  // namespace palpate
