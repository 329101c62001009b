#include "meshing/surface/surface_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "meshing/surface/isosurface.h"

namespace palpate {
namespace {

// Collects the least, mean and largest of the values added.
class Collect {
 public:
  void add(double value) {
    spread_.least = count_ ? std::min(spread_.least, value) : value;
    spread_.most = count_ ? std::max(spread_.most, value) : value;
    sum_ += value;
    ++count_;
  }
  Spread spread() const { return {spread_.least, sum_ / std::max(count_, 1.0), spread_.most}; }

 private:
  Spread spread_;
  double sum_ = 0, count_ = 0;
};

double length(const Point& a) {
  return std::sqrt(dot(a, a));
}

}  // namespace

SurfaceQuality measure_quality(const TriangleSurface& closed) {
  SurfaceQuality quality;
  quality.triangles = closed.triangles.size();
  quality.points = closed.points.size();
  const std::vector<std::int64_t> handles = handles_of_shells(closed);
  quality.shells = handles.size();
  quality.handles = std::accumulate(handles.begin(), handles.end(), std::int64_t{0});
  Collect edges, ratios;
  double least_angle = std::numbers::pi;
  for (const auto& [a, b, c] : closed.triangles) {
    const Point p = closed.points[a], q = closed.points[b], r = closed.points[c];
    const std::array<double, 3> side = {length(r - q), length(p - r), length(q - p)};
    const double twice_area = length(cross(q - p, r - p));
    for (int s = 0; s < 3; ++s) {
      edges.add(side[s]);  // a closed surface counts each edge twice, which leaves the mean unchanged
      const double x = side[(s + 1) % 3], y = side[(s + 2) % 3];
      least_angle = std::min(least_angle, std::asin(std::clamp(twice_area / (x * y), 0.0, 1.0)));
    }
    ratios.add(radius_ratio(p, q, r));
  }
  quality.edge_mm = edges.spread();
  quality.radius_ratio = ratios.spread();
  quality.least_angle_deg = least_angle * 180 / std::numbers::pi;
  quality.area_mm2 = area(closed);
  quality.volume_mm3 = enclosed_volume(closed);
  quality.centroid = centroid_of_volume(closed);
  return quality;
}

WorstTriangle worst_triangle(const TriangleSurface& surface) {
  WorstTriangle worst;
  for (const auto& [a, b, c] : surface.triangles) {
    const Point &p = surface.points[a], &q = surface.points[b], &r = surface.points[c];
    const double ratio = radius_ratio(p, q, r);
    if (ratio < worst.radius_ratio) worst = {ratio, (1.0 / 3) * (p + q + r)};
  }
  return worst;
}

std::string text_of(const WorstTriangle& worst) {
  return fmt::format("its worst triangle, of radius ratio {:.2g}, lies near ({:.6g}, {:.6g}, {:.6g})",
                     worst.radius_ratio, worst.place[0], worst.place[1], worst.place[2]);
}

std::string wrap_advice(const std::string& file) {
  std::string word;  // as a shell reads it
  for (const char c : file) word += c == '\'' ? "'\\''" : std::string(1, c);
  if (file.find_first_of(" '\"\\()&;*?$") != std::string::npos) word = "'" + word + "'";
  return fmt::format("make a cleaner surface: palpate-surface {} --wrap -o NEW.ply", word);
}

nlohmann::ordered_json report_json(const SurfaceQuality& quality, const SurfaceDistance& distance, double reference_mm3,
                                   const std::string& reference_name) {
  const auto spread = [](const Spread& s) {
    return nlohmann::ordered_json{{"least", s.least}, {"mean", s.mean}, {"most", s.most}};
  };
  nlohmann::ordered_json json;
  json["triangles"] = quality.triangles;
  json["points"] = quality.points;
  json["shells"] = quality.shells;
  json["handles"] = quality.handles;
  json["edge_mm"] = spread(quality.edge_mm);
  json["radius_ratio"] = spread(quality.radius_ratio);
  json["least_angle_deg"] = quality.least_angle_deg;
  json["area_mm2"] = quality.area_mm2;
  json["volume_mm3"] = quality.volume_mm3;
  json["centroid_mm"] = quality.centroid;
  json["reference"] = reference_name;
  json["reference_volume_mm3"] = reference_mm3;
  json["volume_error"] = quality.volume_mm3 / reference_mm3 - 1;
  json["distance_to_reference_mm"] = {{"mean", distance.mean_mm}, {"p95", distance.p95_mm}, {"most", distance.most_mm}};
  return json;
}

std::string report_text(const SurfaceQuality& quality, const SurfaceDistance& distance, double reference_mm3,
                        const std::string& reference_name, const std::optional<SurfaceDistance>& back) {
  const auto row = [](const std::string& what, const std::string& value) {
    return fmt::format("{:<28}{}\n", what, value);
  };
  std::string text;
  text += row("triangles, points", fmt::format("{}, {}", quality.triangles, quality.points));
  text += row("shells, handles", fmt::format("{}, {}", quality.shells, quality.handles));
  text += row("edges, mm", fmt::format("{:.3g} .. {:.3g}, mean {:.3g}", quality.edge_mm.least, quality.edge_mm.most,
                                       quality.edge_mm.mean));
  text += row("triangle radius ratio",
              fmt::format("mean {:.3f}, least {:.3f}; least angle {:.1f} degrees", quality.radius_ratio.mean,
                          quality.radius_ratio.least, quality.least_angle_deg));
  text += row("volume, cm3", fmt::format("{:.4f}; {} {:.4f}; error {:.2g} %", quality.volume_mm3 / 1000, reference_name,
                                         reference_mm3 / 1000, 100 * (quality.volume_mm3 / reference_mm3 - 1)));
  const auto distances = [&](const std::string& what, const SurfaceDistance& d) {
    text += row(what, fmt::format("mean {:.2f}, 95 % {:.2f}, most {:.2f}", d.mean_mm, d.p95_mm, d.most_mm));
  };
  distances(fmt::format("distance from {}, mm", reference_name), distance);
  if (back) distances(fmt::format("distance to {}, mm", reference_name), *back);
  text += row("checks", "closed, manifold, free of self-intersections, outward");
  return text;
}

}  // namespace palpate
