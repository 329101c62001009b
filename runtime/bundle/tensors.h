// The stored tensors as the runtime reads them: whole rows for the shape, single 3 x 3 blocks for contacts.
#pragma once

#include <cstddef>
#include <cstdint>

#include "formats/compliance_blocks.h"
#include "formats/half.h"
#include "runtime/base/instructions.h"
#include "runtime/base/vec3.h"
#include "runtime/bundle/compliance.h"

namespace palpate {

// displacement_surface or displacement_interior: [S][3][nodes][3] numbers of one element type.
struct DisplacementRows {
  const void* numbers = nullptr;
  formats::ElementType type = formats::ElementType::f32;
  const float* scale = nullptr;  // [S][3] of f16; nullptr: 1
  std::int32_t nodes = 0;

  // The field of a unit displacement of dof j at the column's node, over its scale: [nodes][3].
  const void* row(std::int32_t column, int j) const {
    return static_cast<const unsigned char*>(numbers) + number(column, j) * formats::element_bytes(type);
  }
  float row_scale(std::int32_t column, int j) const {
    return scale ? scale[static_cast<std::size_t>(column) * 3 + static_cast<std::size_t>(j)] : 1.0f;
  }
  // T^u of node and column: [i][j] is the displacement along i for a unit displacement of dof j.
  Mat3 block(std::int32_t node, std::int32_t column) const {
    if (type == formats::ElementType::f32) return block_of<float>(node, column);
    if (type == formats::ElementType::f64) return block_of<double>(node, column);
    return block_of<std::uint16_t>(node, column);
  }
  // Asks for what block() will read, from each of its three places.
  void prefetch(std::int32_t node, std::int32_t column) const {
    for (int j = 0; j < 3; ++j) {
      const char* at =
          static_cast<const char*>(row(column, j)) + 3 * static_cast<std::size_t>(node) * formats::element_bytes(type);
      PALPATE_PREFETCH(at);
    }
  }
  // sum_r coefficient[r] row[r] at a node, in the order of the rows. Cost: one read per row, all far apart.
  Vec3 sum_at_node(const void* const* row, const double* coefficient, int count, std::int32_t node) const {
    if (type == formats::ElementType::f32) return sum_of<float>(row, coefficient, count, node);
    if (type == formats::ElementType::f64) return sum_of<double>(row, coefficient, count, node);
    return sum_of<std::uint16_t>(row, coefficient, count, node);
  }

 private:
  static double widened(float stored) { return stored; }
  static double widened(double stored) { return stored; }
  static double widened(std::uint16_t half) { return formats::float_of_half(half); }
  template <class Stored>
  Mat3 block_of(std::int32_t node, std::int32_t column) const {
    Mat3 t;
    for (int j = 0; j < 3; ++j) {
      const Stored* at = static_cast<const Stored*>(row(column, j)) + 3 * static_cast<std::size_t>(node);
      const double factor = row_scale(column, j);
      for (int i = 0; i < 3; ++i) t.m[i][j] = factor * widened(at[i]);
    }
    return t;
  }
  template <class Stored>
  static Vec3 sum_of(const void* const* row, const double* coefficient, int count, std::int32_t node) {
    Vec3 sum;
    for (int r = 0; r < count; ++r) {
      const Stored* at = static_cast<const Stored*>(row[r]) + 3 * static_cast<std::size_t>(node);
      sum += coefficient[r] * Vec3{widened(at[0]), widened(at[1]), widened(at[2])};
    }
    return sum;
  }
  std::size_t number(std::int32_t column, int j) const {
    return (static_cast<std::size_t>(column) * 3 + static_cast<std::size_t>(j)) * static_cast<std::size_t>(nodes) * 3;
  }
};

// What contacts and shape read of a bundle. The surface's displacements are rows, or follow from the compliance.
struct Tensors {
  DisplacementRows surface;
  const Compliance* compliance = nullptr;
  const double* force = nullptr;  // [S][3][3] N/m
  std::int32_t surface_nodes = 0, columns = 0;

  // T^u of a surface node and a column, whatever form it is stored in. Cost: three reads far apart; Compliance::block.
  Mat3 displacement(std::int32_t node, std::int32_t column) const {
    return compliance ? compliance->block(node, column) * force_of(column) : surface.block(node, column);
  }
  void prefetch(std::int32_t node, std::int32_t column) const {
    if (!compliance) surface.prefetch(node, column);
  }
  Mat3 force_of(std::int32_t column) const {
    Mat3 f;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) f.m[i][j] = force[9 * static_cast<std::size_t>(column) + 3 * i + j];
    return f;
  }
};

}  // namespace palpate
