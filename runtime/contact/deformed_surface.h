// The organ's surface as the contacts of the last solve have deformed it, or at rest where a scene does not follow them.
#pragma once

#include <cstdint>

#include "runtime/contact/contact_field.h"
#include "runtime/surface/surface_tree.h"

namespace palpate {

// Where and when a moving point passes through the surface.
struct SurfaceCrossing {
  SurfacePoint surface_point;
  double time = 0;  // 0 at the start of the motion, 1 at its end
  bool entering = false;
};

class DeformedSurface {
 public:
  static constexpr int kMaxCrossings = 32;

  // field: nullptr for the surface at rest. Both are borrowed.
  void create(SurfaceTree* tree, ContactField* field) { tree_ = tree, field_ = field; }

  const SurfaceTree& tree() const { return *tree_; }
  bool follows() const { return field_ != nullptr; }

  // The nearest point of the surface, within `within` metres. Cost: some ten triangles where the surface is near or does not move;
  // each node that is not yet evaluated in this step reads 3 numbers per contact node.
  NearestPoint nearest(Vec3 p, double within);
  // The same of the surface without what the contact (tool, point) itself does.
  NearestPoint nearest_without(Vec3 p, double within, std::int32_t tool, std::int32_t point);
  // The same of the surface that ContactField::predict_without() has predicted.
  NearestPoint nearest_predicted(Vec3 p, double within);

  // Whether p is inside: its winding number is above zero, so that a place where the surface overlaps itself is inside. By the
  // triangles along a ray; exact signs decide. Cost: as nearest(), of all nodes near the ray.
  bool is_inside(Vec3 p);
  bool is_inside_without(Vec3 p, std::int32_t tool, std::int32_t point);
  bool is_inside_predicted(Vec3 p);

  // The crossings of a point that moves from `from` to `to` while the surface moves from where it was before the last solve to
  // where it is now, in order of time. Returns their number; the first kMaxCrossings are stored. A crossing through an edge may
  // count for both of its triangles.
  int crossings(Vec3 from, Vec3 to, SurfaceCrossing* found);

  // m: how far any point of the surface may have moved since the last solve but one; of the surface without a contact.
  double largest_move() const;
  double largest_move_without(std::int32_t tool, std::int32_t point) const;
  // sqrt(J): grows with every change of the surface (NearestPoint::per_path).
  double path() const { return field_ ? field_->path() : 0; }

  // m, the displacement of a surface point; without the part of the contact (tool, point); as predicted.
  Vec3 displacement(const SurfacePoint& surface_point);
  Vec3 displacement_without(const SurfacePoint& surface_point, std::int32_t tool, std::int32_t point);

  // What the queries have cost since the last call.
  Operations take_work();

 private:
  bool moves() const { return field_ && !field_->empty(); }
  FieldBound bound() const;
  FieldBound bound_without(std::int32_t tool, std::int32_t point) const;
  FieldBound bound_predicted() const;
  template <class Place>
  bool is_inside(Vec3 p, const FieldBound& bound, bool sees, Place place);
  template <class AtNode>
  Vec3 interpolate(const SurfacePoint& surface_point, AtNode at_node) const;

  SurfaceTree* tree_ = nullptr;
  ContactField* field_ = nullptr;
  Operations work_ = 0;
};

}  // namespace palpate
