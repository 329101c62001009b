// The rows of the offset of the displacement field (contact/offset.h): row m is the displacement of each node per unit of amount m.
#pragma once

#include <cstddef>
#include <cstdint>

#include "formats/bundle_layout.h"
#include "runtime/base/vec3.h"

namespace palpate {

inline constexpr std::int32_t kMostOffsetRows = 44;

// Of a row that is the displacement by a load: its force, 1 N along an axis, spread over nodes of the surface. Of each row: where its forces act.
struct RowForce {
  const std::int32_t* node = nullptr;  // [count]
  const double* weight = nullptr;      // [count]
  std::int32_t count = 0, axis = 0;
  // 1: the forces of the row are in the whole volume, as gravity; 0: at the surface, as of supports that move.
  std::int32_t in_volume = 0;
  std::int32_t unused = 0;
};

// The piece of the surface on which a row's pressure acts, for a body that is not linear: corners of triangles, counter-clockwise from outside.
struct RowPressure {
  const std::int32_t* triangle = nullptr;  // [count][3] nodes
  std::int32_t count = 0, unused = 0;
};

// What is asked of such a row's pressure beside its amount, and what the body tells of it.
struct RowVolume {
  double target = 0;                           // m^3, at which the volume that the piece sweeps is held
  double pressure = 0, beyond = 0, swept = 0;  // Pa; Pa, of that beyond the row's amount; m^3
  std::int32_t holds = 0, unused = 0;
};

struct OffsetRows {
  const float* numbers = nullptr;  // [count][nodes][3] m per unit
  const float* inside = nullptr;   // [count][nodes_inside][3] of the interior nodes; nullptr: nobody asks there
  std::int32_t count = 0, nodes = 0, nodes_inside = 0;
  const RowForce* force = nullptr;        // [count], without nodes where a row is no load's; nullptr: of none
  const RowPressure* pressure = nullptr;  // [count], without triangles where a row is no pressure; nullptr: of none
  const double* longest = nullptr;        // [count] m per unit, an upper bound over the nodes

  const float* row(std::int32_t m) const {
    return numbers + 3 * static_cast<std::size_t>(m) * static_cast<std::size_t>(nodes);
  }
  Vec3 at(std::int32_t m, std::int32_t node) const {
    const float* const u = node < nodes
                               ? row(m) + 3 * static_cast<std::size_t>(node)
                               : inside + 3 * (static_cast<std::size_t>(m) * static_cast<std::size_t>(nodes_inside) +
                                               static_cast<std::size_t>(node - nodes));
    return {static_cast<double>(u[0]), static_cast<double>(u[1]), static_cast<double>(u[2])};
  }
  bool is_of_force(std::int32_t m) const { return force && force[m].count > 0; }
  bool is_of_pressure(std::int32_t m) const { return pressure && pressure[m].count > 0; }
  bool is_in_volume(std::int32_t m) const { return force && force[m].in_volume != 0; }
  // J per units: the work of the force of row `load` along row m.
  double work(std::int32_t m, std::int32_t load) const {
    double sum = 0;
    for (std::int32_t k = 0; k < force[load].count; ++k)
      sum += force[load].weight[k] * at(m, force[load].node[k])[force[load].axis];
    return sum;
  }
  // m, under the amounts [count]. A row of amount zero is not read.
  Vec3 sum_at(const double* amount, std::int32_t node) const {
    Vec3 sum;
    for (std::int32_t m = 0; m < count; ++m)
      if (amount[m] != 0) sum += amount[m] * at(m, node);
    return sum;
  }
};

}  // namespace palpate
