// The paper's equations for forces and contacts, evaluated from the tensors in double precision with dense matrices.
#pragma once

#include <Eigen/Dense>
#include <span>
#include <vector>

#include "precompute/tensors/probe_columns.h"

namespace palpate::validation {

using Eigen::Vector3d;

// Displacement of node n under force f at the tensor's node: T^u_nk (T^f_k)^-1 f.
Vector3d displacement_under(const NodeTensor& tensor, const Vector3d& force, std::int32_t n);

// Displacement of all vertices when contact nodes, none of them partly held, move by displacement: solves W f = u*, then
// sums over the contacts. Solves the tensors to 1e-12. Errors: those of solve_node_tensors.
std::vector<Vector3d> superpose(const ElasticBody& body, Element element, std::span<const std::int32_t> contacts,
                                std::span<const Vector3d> displacement);

}  // namespace palpate::validation
