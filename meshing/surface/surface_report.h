// Measures the quality of a surface and reports it as text and as JSON.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "meshing/surface/triangle_surface.h"

namespace palpate {

struct Spread {
  double least = 0, mean = 0, most = 0;
};

struct SurfaceQuality {
  std::size_t triangles = 0, points = 0, shells = 0;
  std::int64_t handles = 0;
  Spread edge_mm;
  Spread radius_ratio;  // of the triangles; see radius_ratio in triangle_surface.h
  double least_angle_deg = 0;
  double area_mm2 = 0, volume_mm3 = 0;
  Point centroid{};  // of the enclosed volume
};
SurfaceQuality measure_quality(const TriangleSurface& closed);

// The triangle of the least radius ratio (0: flat, 1: equilateral), where mesh generators fail first.
struct WorstTriangle {
  double radius_ratio = 2;  // above 1: there is no triangle
  Point place{};            // its centre
};
WorstTriangle worst_triangle(const TriangleSurface& surface);
// "its worst triangle, of radius ratio 0.0001, lies near (1, 2, 3)"
std::string text_of(const WorstTriangle& worst);
// What to do with a surface that fails: "make a cleaner surface: palpate-surface 'a b.stl' --wrap -o NEW.ply".
std::string wrap_advice(const std::string& file);

// Distance from points of the reference to the nearest point of the surface. Uses at most 100,000 points, picked
// evenly.
struct SurfaceDistance {
  double mean_mm = 0, p95_mm = 0, most_mm = 0;
  // The largest distance of a point of the reference that lies outside of the surface, and that point. A point counts as
  // outside unless the surface lies beyond it along the reference's normal.
  double outside_mm = 0;
  Point outside_place{};
};
SurfaceDistance measure_distance(const TriangleSurface& reference, const TriangleSurface& surface);

// The warning of a thin tip that a surface of voxels has lost: their border lies a twentieth of the organ's size outside of it.
// distance: from that border; cure: "more --triangles keep it". Empty where no tip is lost.
std::string lost_tip_warning(const SurfaceDistance& distance, double voxels_mm3, double voxel_mm,
                             const std::string& cure);

// reference_name names what the volume and the distance are compared with: "voxels" or "input".
nlohmann::ordered_json report_json(const SurfaceQuality& quality, const SurfaceDistance& distance, double reference_mm3,
                                   const std::string& reference_name);
// back: the distance from the surface to the reference, for a reference that is no closed surface of voxels.
std::string report_text(const SurfaceQuality& quality, const SurfaceDistance& distance, double reference_mm3,
                        const std::string& reference_name, const std::optional<SurfaceDistance>& back = {});

}  // namespace palpate
