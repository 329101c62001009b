// How much too stiff the element itself makes a body on its mesh: an estimate from three loads, in the time of two batches of columns.
#pragma once

#include <vector>

#include "precompute/elements/discretisation.h"
#include "precompute/solver/column_solver.h"

namespace palpate {

// Forces are too large by about this share, for a prescribed displacement: the largest and the median of the probes.
struct ElementExcess {
  int probes = 0;  // 0: not measured
  double largest = 0, median = 0;
};

// The probes: a force on all of the volume along each axis. Each is 3 N numbers, N, of the vertices.
std::vector<std::vector<double>> element_probes(const ElasticBody& body);

// Compares p1 or p1-anp with p1-ang, which has the same unknowns and bends (precompute/ELEMENTS.md). The solver of K is the preconditioner of its
// matrix: a step of conjugate gradients. K on one rank. Cost: kBatchesOfElementExcess batches.
ElementExcess measure_element_excess(const ElasticBody& body, Element element, const Discretisation& discretisation,
                                     const HeldStiffness& held, ColumnSolver& solver);
inline constexpr int kBatchesOfElementExcess = 2;

}  // namespace palpate
