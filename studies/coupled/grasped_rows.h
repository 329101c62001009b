// The rows of jaws that hold a disc of tissue and move it. Nodes, weights and what the mesh does not resolve are those that the runtime finds
// from the surface (runtime/grasps/grasp_patch.h); targets, force and torque are written down anew, from the motion of each node.
#pragma once

#include <Eigen/Geometry>

#include "runtime/grasps/grasp_patch.h"
#include "runtime/surface/surface_tissue.h"
#include "studies/coupled/coupled_rows.h"

namespace palpate::studies {

// The surface of a body, its nodes first.
struct GraspedSurface {
  std::vector<double> position;              // [surface nodes][3] m
  std::vector<std::int32_t> triangles;       // [][3]
  std::vector<std::int32_t> column_of_node;  // [surface nodes] -1: not touchable
};
template <class Nodes, class Triangles>
GraspedSurface grasped_surface(const Nodes& nodes, std::int32_t count, const Triangles& triangles,
                               const std::vector<std::int32_t>& touchable) {
  GraspedSurface surface;
  for (std::int32_t n = 0; n < count; ++n)
    surface.position.insert(surface.position.end(), nodes[static_cast<std::size_t>(n)].begin(),
                            nodes[static_cast<std::size_t>(n)].end());
  for (const auto& t : triangles) surface.triangles.insert(surface.triangles.end(), t.begin(), t.end());
  surface.column_of_node.assign(static_cast<std::size_t>(count), -1);
  for (const std::int32_t n : touchable) surface.column_of_node[static_cast<std::size_t>(n)] = n;
  return surface;
}

class GraspedRows {
 public:
  // bundle: of the same body; read for its tissue.
  GraspedRows(const GraspedSurface& surface, palpate_bundle& bundle, const SurfacePoint& place, double radius);

  int nodes() const { return disc_.count; }

  // The jaws have turned about `about` (m) and gone by `way` since they closed on the tissue at rest.
  std::vector<Row> rows(const Eigen::Vector3d& about, const Eigen::Vector3d& way, const Eigen::Quaterniond& turn);

  // On the tool, N, and N m about the place where `about` has gone: of forces on the nodes where the jaws have moved them.
  struct Felt {
    Eigen::Vector3d force = Eigen::Vector3d::Zero(), torque = Eigen::Vector3d::Zero();
  };
  Felt felt(const Eigen::VectorXd& of_rows, const Eigen::Vector3d& about, const Eigen::Quaterniond& turn) const;

 private:
  Eigen::Vector3d rest(int e) const;

  const GraspedSurface& surface_;
  GraspPatch disc_;
  std::vector<Eigen::Vector3d> axes_;
};

}  // namespace palpate::studies
