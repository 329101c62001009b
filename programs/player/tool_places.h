// Finds where on the organ a tool presses whose scene says so in words, and makes the tool's path.
#pragma once

#include <palpate/palpate.h>

#include <memory>
#include <string>

#include "formats/scene_config.h"

namespace palpate {

// A point of the surface at rest and the outward normal there, m; the normal has length 1.
struct SurfacePlace {
  SceneConfig::Vector point, normal;
  std::int32_t triangle = -1;       // that has the point, of those that were searched
  SceneConfig::Vector barycentric;  // weights of its vertices
};

// Finds places on a bundle's surface.
class PlaceFinder {
 public:
  enum class Where { touchable, surface };  // triangles of three touchable nodes; all triangles
  PlaceFinder(const palpate_bundle* bundle, Where where);
  ~PlaceFinder();
  // The nearest point to `near`, m. Errors: InputError that begins with `who`, where there are no such triangles, or where the point is
  // farther from the organ than the organ's box is large; and, of touchable triangles, where the point of the surface that is nearest to it is
  // farther from them than the longest edge there.
  SurfacePlace nearest(const SceneConfig::Vector& near, const std::string& who) const;

 private:
  struct Searched;
  std::unique_ptr<Searched> searched_;
};

// Of a load: where its patch is, as find_place() of a tool.
SurfacePlace find_place(const SceneConfig::Load& load, const palpate_bundle* bundle,
                        const std::filesystem::path& scene);

// at: of the touchable nodes the one that lies farthest in that direction of the patient. Nodes with an untouchable node
// beside them come last, since a disc there acts on a part of its area only. near: the nearest point of the triangles whose
// three nodes are touchable. The normal is that of the triangles around, weighted by area. Errors: InputError, which names
// the line of the tool, for a bundle whose frame does not say where the front is, a bundle without touchable triangles,
// and a point that is farther from the organ than the organ's box is large.
SurfacePlace find_place(const SceneConfig::Tool& tool, const palpate_bundle* bundle,
                        const std::filesystem::path& scene);

// The direction in which a tool goes in at a place, of length 1: that of its needle, or against the normal.
SceneConfig::Vector direction_at(const SceneConfig::Tool& tool, const SurfacePlace& place);

// Gives every tool that has a place its positions: point + depth * direction.
void resolve_places(SceneConfig& scene, const palpate_bundle* bundle);

}  // namespace palpate
