// The sites where the study presses, and the points where it compares the displacement. Both are points of space; on each
// mesh, the closest point of its surface is used.
#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <vector>

#include "precompute/elements/elastic_body.h"
#include "runtime/surface/surface_index.h"

namespace palpate::accuracy {

struct TouchSite {
  Vec3 at, inward, across;  // m; unit vectors, across one of the tangents
};

struct StudySites {
  double radius = 0;                 // of the tool's disc, m
  std::vector<TouchSite> touch;      // in the middle of equal shares of the touchable surface
  std::vector<TouchSite> neighbour;  // beside the first two sites, kNeighbourDistance radii away
  std::vector<Vec3> samples;         // where the displacement is compared, spread evenly over the surface
};
inline constexpr double kNeighbourDistance = 2.2;
inline constexpr double kDragDistance = 0.4;  // of the radius: the distance of the exercise drag

// body: the finest mesh. Sites are at least three radii from held nodes if the organ has room. Errors: InputError if no
// node is touchable.
StudySites choose_sites(const ElasticBody& body, double radius, int touch_count, int sample_count);

// Sites for many discs at once. Each is the farthest point from those before it, until `most` are found or the next would
// be closer than kCrowdDistance radii to another. The list of neighbours stays empty. Errors: InputError as above.
inline constexpr double kCrowdDistance = 2.2;
StudySites choose_crowd(const ElasticBody& body, double radius, int most, const std::vector<Vec3>& samples);

// The site about a point of the surface. Its normal is the mean over the disc, so that it is nearly the same on every mesh.
TouchSite site_at(const ElasticBody& body, Vec3 p, double radius);

nlohmann::json json_of(const StudySites& sites);
StudySites sites_of(const nlohmann::json& json);

// The surface of the study's finest mesh, which tools meet under surface "fine".
struct StudySurface {
  std::vector<double> nodes;            // [n][3] m
  std::vector<std::int32_t> triangles;  // [m][3]
};
StudySurface surface_of(const ElasticBody& body);

// A triangle surface that the caller owns: nodes [n][3], m, and triangles [m][3].
struct SurfaceView {
  const double* nodes;
  std::span<const std::int32_t> triangles;
};
struct FoundPoint {
  SurfacePoint on;
  Vec3 at;
};
// Cost: visits every triangle.
FoundPoint closest_point(const SurfaceView& surface, Vec3 p);

}  // namespace palpate::accuracy
