#include "studies/coupled/grasped_rows.h"

namespace palpate::studies {

GraspedRows::GraspedRows(const GraspedSurface& surface, palpate_bundle& bundle, const SurfacePoint& place,
                         double radius)
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
    find_grasp_patch({surface.position.data(), surface.column_of_node.data(), &index, &measure, &patch}, place, radius,
                     GraspPatch::kMostNodes, &disc_);
  memory.release_all();
  if (disc_.count == 0 || !disc_.has_gradients) throw std::runtime_error("no disc of the surface to be grasped");
}

std::vector<Row> GraspedRows::rows(const Eigen::Vector3d& about, const Eigen::Vector3d& way,
                                   const Eigen::Quaterniond& turn) {
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

GraspedRows::Felt GraspedRows::felt(const Eigen::VectorXd& of_rows, const Eigen::Vector3d& about,
                                    const Eigen::Quaterniond& turn) const {
  Felt felt;
  for (int e = 0; e < disc_.count; ++e) {
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < axes_.size(); ++i)
      force += disc_.weight[i / 3][e] * of_rows[static_cast<Eigen::Index>(i)] * axes_[i];
    felt.force -= force, felt.torque -= (turn * (rest(e) - about)).cross(force);
  }
  return felt;
}

Eigen::Vector3d GraspedRows::rest(int e) const {
  return Eigen::Vector3d(&surface_.position[3 * static_cast<std::size_t>(disc_.node[e])]);
}

}  // namespace palpate::studies
