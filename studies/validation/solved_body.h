// A body discretised with one element, its solution under a load, and the quantities that the cases compute from it.
#pragma once

#include <functional>
#include <vector>

#include "precompute/elements/discretisation.h"
#include "studies/validation/cases.h"
#include "studies/validation/closed_forms.h"

namespace palpate::validation {

using Point = std::array<double, 3>;
using Where = std::function<bool(const Point&)>;
using VectorField = std::function<Vector3d(const Vector3d&)>;
using GradientField = std::function<Matrix3d(const Vector3d&)>;

// The discretised body, its cells and its surface triangles (outward). Each lists its corners, then the middles of a
// quadratic element's edges, in the order of quadratic_tetrahedra.h.
struct DiscreteBody {
  ElasticBody body;
  Discretisation discretisation;
  std::vector<std::vector<std::int32_t>> cells, triangles;
  double seconds = 0;  // processor time to assemble

  std::size_t node_count() const { return discretisation.coordinates.size(); }
};
DiscreteBody discretise_body(ElasticBody body, Element element);

struct Answer {
  std::vector<double> u;      // [3 nodes] m
  double seconds = 0;         // processor time: remove held dofs, factor, solve
  std::vector<double> force;  // K u on every node, [3 nodes] N

  Vector3d at(std::size_t node) const { return Vector3d(&u[3 * node]); }
};

// Held dofs take their value from imposed; load acts on the others ([3 nodes] N; empty: none). True relative residual:
// 1e-10. Errors: OperationError.
Answer solve(const DiscreteBody& discrete, const VectorField& imposed, std::vector<double> load = {});
// The same with held dofs that stay where they are.
inline Answer solve(const DiscreteBody& discrete, std::vector<double> load) {
  return solve(
      discrete, [](const Vector3d&) { return Vector3d(Vector3d::Zero()); }, std::move(load));
}

// The record of one solved mesh.
Measured measured_on(const DiscreteBody& discrete, const Answer& answer, std::vector<Quantity> quantities);

// int N_j f dV, f in N / m^3.
std::vector<double> body_load(const DiscreteBody& discrete, const VectorField& density);

// int N_j t dA over the triangles of which every corner satisfies `on`; t(point, outward unit normal) in Pa.
using Traction = std::function<Vector3d(const Vector3d& point, const Vector3d& outward)>;
std::vector<double> traction_load(const DiscreteBody& discrete, const Where& on, const Traction& traction);
double surface_area(const DiscreteBody& discrete, const Where& on);

// The stress at a vertex, Pa: a quadratic polynomial through the stresses at the middles of the cells around it and around their
// vertices, by least squares (patch recovery, Zienkiewicz and Zhu 1992). The dilatation is averaged over each cell, as
// p2-p0 does.
Matrix3d recovered_stress(const DiscreteBody& discrete, const Answer& answer, std::int32_t vertex);

// Relative errors of u and its gradient in the 2-norm, over the cells whose middle satisfies `within`.
struct FieldError {
  double displacement, gradient;
};
FieldError field_error(
    const DiscreteBody& discrete, const Answer& answer, const VectorField& displacement, const GradientField& gradient,
    const Where& within = [](const Point&) { return true; });

// The sum of the forces on the nodes that satisfy `on`, N.
Vector3d total_force(const DiscreteBody& discrete, const Answer& answer, const Where& on);

// The first node at a point, to 1e-9 of the point's distance from the origin. Errors: OperationError if there is none.
std::int32_t node_at(const DiscreteBody& discrete, const Point& point);

// Cook's membrane in plane strain, clamped at its left edge, under a shear traction (Pa) at the right one; structure_cases.cpp.
struct CookMembrane {
  DiscreteBody discrete;
  std::vector<double> load;

  double rise(const Answer& answer, double height) const;  // of the loaded edge's node at y = height, m
};
CookMembrane cook_membrane_under(double traction, const Material& material, Element element, int level);

}  // namespace palpate::validation
