// The rows of jaws that hold a disc of tissue and move it. Nodes, weights and what the mesh does not resolve are those that the runtime finds
// from the surface (runtime/contact/grasp_patch.h); targets, force and torque are written down anew, from the motion of each node.
#pragma once

#include <Eigen/Geometry>

#include "runtime/contact/grasp_patch.h"
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
  GraspedRows(const GraspedSurface& surface, palpate_bundle& bundle, const SurfacePoint& place, double radius)
      : surface_(surface) {
    SceneMemory memory{palpate_allocator{}};
    const auto nodes = static_cast<std::int32_t>(surface.column_of_node.size()),
               triangles = static_cast<std::int32_t>(surface.triangles.size() / 3);
    SurfaceIndex index;
    SurfaceMeasure measure;
    ContactPatch patch;
    palpate_error error = {};
    const bool made = index.build(memory, surface.position.data(), surface.triangles.data(), triangles) &&
                      measure.build(memory, surface.position.data(), nodes, surface.triangles.data(), triangles) &&
                      patch.create(memory, &index, &measure, surface.triangles.data(), nodes) &&
                      read_tissue(bundle, memory, measure, &error) == PALPATE_OK;
    if (made)
      find_grasp_patch({surface.position.data(), surface.column_of_node.data(), &index, &measure, &patch}, place,
                       radius, GraspPatch::kMostNodes, &disc_);
    memory.release_all();
    if (disc_.count == 0 || !disc_.has_gradients) throw std::runtime_error("no disc of the surface to be grasped");
  }

  int nodes() const { return disc_.count; }

  // The jaws have turned about `about` (m) and gone by `way` since they closed on the tissue at rest.
  std::vector<Row> rows(const Eigen::Vector3d& about, const Eigen::Vector3d& way, const Eigen::Quaterniond& turn) {
    std::vector<Row> rows;
    axes_.clear();
    for (int part = 0; part < 3; ++part) {
      Eigen::Matrix3d local;
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) local(i, j) = disc_.local[part].m[i][j];
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> along(local);
      for (int d = 0; d < 3; ++d) {
        const Eigen::Vector3d axis = along.eigenvectors().col(d);
        Row& row = rows.emplace_back();
        row.softness = along.eigenvalues()[d];
        for (int e = 0; e < disc_.count; ++e) {
          const Eigen::Vector3d y = rest(e);
          row.add(0, disc_.node[e], disc_.weight[part][e] * axis);
          row.target += disc_.weight[part][e] * axis.dot(turn * (y - about) + about + way - y);
        }
        axes_.push_back(axis);
      }
    }
    return rows;
  }

  // On the tool, N, and N m about the place where `about` has gone: of forces on the nodes where the jaws have moved them.
  struct Felt {
    Eigen::Vector3d force = Eigen::Vector3d::Zero(), torque = Eigen::Vector3d::Zero();
  };
  Felt felt(const Eigen::VectorXd& of_rows, const Eigen::Vector3d& about, const Eigen::Quaterniond& turn) const {
    Felt felt;
    for (int e = 0; e < disc_.count; ++e) {
      Eigen::Vector3d force = Eigen::Vector3d::Zero();
      for (std::size_t i = 0; i < axes_.size(); ++i)
        force += disc_.weight[i / 3][e] * of_rows[static_cast<Eigen::Index>(i)] * axes_[i];
      felt.force -= force, felt.torque -= (turn * (rest(e) - about)).cross(force);
    }
    return felt;
  }

 private:
  Eigen::Vector3d rest(int e) const {
    return Eigen::Vector3d(&surface_.position[3 * static_cast<std::size_t>(disc_.node[e])]);
  }

  const GraspedSurface& surface_;
  GraspPatch disc_;
  std::vector<Eigen::Vector3d> axes_;
};

}  // namespace palpate::studies
