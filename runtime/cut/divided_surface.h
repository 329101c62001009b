// Which nodes of a cut organ's surface were divided (contact/divided_nodes.h), as its compliance has them.
#pragma once

#include <cstdint>

#include "runtime/contact/divided_nodes.h"
#include "runtime/cut/cut_mesh.h"
#include "runtime/cut/cut_target.h"
#include "runtime/cut/scene_surface.h"

namespace palpate {

class DividedSurface final : public DividedNodes {
 public:
  // All borrowed. rest: [surface nodes][3] m.
  void create(const CutMesh* mesh, const CutTarget* target, const SceneSurface* surface, const double* rest) {
    mesh_ = mesh, target_ = target, surface_ = surface, rest_ = rest;
  }

  std::int32_t made() const override { return target_->new_nodes(); }
  std::int32_t now(std::int32_t node, std::int32_t seen, const SurfacePoint& place, double radius) const override;
  Pair pair(std::int32_t k) const override;
  std::int32_t at_rest(std::int32_t node) const override { return tissue().origin(target_->node_of_mesh(node)); }

 private:
  // A part that the node has become: how much of the disc's area it has, m^2, and how near its triangles are to the disc's middle, m.
  struct Part {
    std::int32_t node;
    double area, distance;
  };
  static constexpr int kMostParts = 16;
  const CutTissue& tissue() const { return target_->compliance().tissue(); }
  Vec3 rest_of(std::int32_t tissue_node) const {
    return load3(rest_ + 3 * static_cast<std::size_t>(tissue().origin(tissue_node)));
  }
  template <class Visit>
  void for_each_face(std::int32_t node, std::int32_t seen, bool of_lips, Visit visit) const;
  void measure(std::int32_t face, Vec3 middle, double radius, Part* part) const;

  const CutMesh* mesh_ = nullptr;
  const CutTarget* target_ = nullptr;
  const SceneSurface* surface_ = nullptr;
  const double* rest_ = nullptr;
};

}  // namespace palpate
