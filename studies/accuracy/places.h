// The places of an organ at which every mesh of it is pressed and looked at: points of space, found on each mesh as the
// closest place of its surface.
#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <vector>

#include "precompute/elements/elastic_body.h"
#include "runtime/surface/surface_index.h"

namespace palpate::accuracy {

struct TouchPlace {
  Vec3 at, inward, across;  // m; unit vectors, across one of the tangents
};

struct StudyPlaces {
  double radius = 0;                  // of the tool's disc, m
  std::vector<TouchPlace> touch;      // in the middle of equal shares of what can be touched
  std::vector<TouchPlace> neighbour;  // beside the first of them, kNeighbourDistance radii away
  std::vector<Vec3> samples;          // where the field is looked at, spread evenly over the surface
};
inline constexpr double kNeighbourDistance = 2.2;
inline constexpr double kDragDistance = 0.4;  // of the radius: how far an exercise drags

// Of the finest mesh. Places keep off what is held by three radii where the organ has room for that. Errors: InputError
// where nothing can be touched.
StudyPlaces choose_places(const ElasticBody& body, double radius, int touch_count, int sample_count);

// Places for many discs at once, each the farthest from those before it: as many as asked for, or fewer where the next would
// be less than kCrowdDistance radii from another. No neighbours. samples: where the field is looked at. Errors: InputError
// as above.
inline constexpr double kCrowdDistance = 2.2;
StudyPlaces choose_crowd(const ElasticBody& body, double radius, int most, const std::vector<Vec3>& samples);

nlohmann::json json_of(const StudyPlaces& places);
StudyPlaces places_of(const nlohmann::json& json);

// A triangle surface of somebody else's: [nodes][3] m and [triangles][3].
struct SurfaceView {
  const double* nodes;
  std::span<const std::int32_t> triangles;
};
struct FoundPlace {
  SurfacePlace place;
  Vec3 at;
};
// Cost: every triangle is looked at.
FoundPlace closest_place(const SurfaceView& surface, Vec3 p);

}  // namespace palpate::accuracy
