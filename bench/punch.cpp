// The force on a disc that is pushed and dragged by 1 mm at the same points of several meshes. Prints the force, N, for each
// point and mesh, and the spread between the meshes. --half-space adds the closed form of a flat punch. For dragged discs,
// prints the curvature of the first mesh along the drag.
//
//   punch_bench RADIUS_MM [--half-space YOUNG POISSON] [--point X_MM Y_MM Z_MM]... BUNDLE.h5...
//
// Without --point, uses twelve touchable nodes of the first bundle, far from one another and from held nodes.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "bench/places.h"
#include "runtime/include/palpate/palpate.hpp"
#include "runtime/surface/surface_index.h"

namespace {

using palpate::Vec3;

struct Arguments {
  double radius = 0, young = 0, poisson = 0;
  std::vector<Vec3> points;
  std::vector<std::string> bundles;
};

bool parse(int argc, char** argv, Arguments* out) {
  std::vector<double> numbers;
  if (argc < 3) return false;
  out->radius = 1e-3 * std::atof(argv[1]);
  for (int i = 2; i < argc; ++i) {
    if (std::strcmp(argv[i], "--half-space") == 0 && i + 2 < argc) {
      out->young = std::atof(argv[i + 1]), out->poisson = std::atof(argv[i + 2]);
      i += 2;
    } else if (std::strcmp(argv[i], "--point") == 0 && i + 3 < argc) {
      out->points.push_back(
          {1e-3 * std::atof(argv[i + 1]), 1e-3 * std::atof(argv[i + 2]), 1e-3 * std::atof(argv[i + 3])});
      i += 3;
    } else {
      out->bundles.push_back(argv[i]);
    }
  }
  return out->radius > 0 && !out->bundles.empty();
}

struct Organ {
  explicit Organ(const std::string& file) : bundle(file.c_str()), info(bundle.describe()) {
    palpate_scene_def def = palpate_default_scene_def();
    def.collision = PALPATE_COLLISION_OFF, def.shape = PALPATE_SHAPE_OFF;
    def.max_points = 4, def.max_contact_nodes = 1500;
    def.force_limit = def.force_slew = INFINITY;
    scene = std::make_unique<palpate::Scene>(bundle, def);
  }
  Vec3 corner(std::int32_t t, int v) const {
    return palpate::load3(bundle.nodes() + 3 * bundle.triangles()[3 * t + v]);
  }

  palpate::Bundle bundle;
  palpate_bundle_info info;
  std::unique_ptr<palpate::Scene> scene;
};

struct Place {
  palpate_grip grip = palpate_default_grip();
  Vec3 normal;
};

Place nearest_place(const Organ& organ, Vec3 p) {
  Place best;
  double least = INFINITY;
  for (int t = 0; t < organ.info.triangle_count; ++t) {
    double k[3];
    const Vec3 a = organ.corner(t, 0), b = organ.corner(t, 1), c = organ.corner(t, 2);
    const double distance = palpate::closest_on_triangle(p, a, b, c, k);
    if (distance >= least) continue;
    least = distance;
    best.grip.kind = PALPATE_GRIP_SURFACE_POINT, best.grip.triangle = t;
    std::copy(k, k + 3, best.grip.barycentric);
  }
  // Normal weighted by the areas of the triangles around, so that it is nearly the same on every mesh.
  for (int t = 0; t < organ.info.triangle_count; ++t) {
    double k[3];
    const Vec3 a = organ.corner(t, 0), b = organ.corner(t, 1), c = organ.corner(t, 2);
    if (palpate::closest_on_triangle(p, a, b, c, k) < 1e-4) best.normal += cross(b - a, c - a);
  }
  best.normal = unit_or_zero(best.normal);
  return best;
}

// The force along the direction in which the point is moved by 1 mm; it may not move in other directions.
double force_along(Organ& organ, Place place, Vec3 direction, double radius) {
  store3(1e-3 * direction, place.grip.displacement);
  place.grip.axes = 7;
  palpate_tool tool = palpate_default_tool();
  tool.grips = &place.grip, tool.grip_count = 1, tool.disc_radius = radius;
  palpate::Contacts contacts = organ.scene->make_contacts();
  const palpate_step_flags flags = organ.scene->touch(&tool, 1, 1e-3, contacts);
  if (flags) std::fprintf(stderr, "flags %u\n", flags);
  return -dot(palpate::load3(contacts.tool(0).force_raw), direction);
}

// Curvature, 1/m, positive if the surface bulges: from a paraboloid fitted to the nodes within 14 mm on this side.
double curvature_along(const Organ& organ, Vec3 centre, Vec3 normal, Vec3 direction) {
  constexpr double kReach = 0.014;
  const Vec3 other = cross(normal, direction);
  std::vector<Vec3> near;
  for (int t = 0; t < organ.info.triangle_count; ++t) {
    if (dot(cross(organ.corner(t, 1) - organ.corner(t, 0), organ.corner(t, 2) - organ.corner(t, 0)), normal) <= 0)
      continue;
    for (int v = 0; v < 3; ++v)
      if (const Vec3 p = organ.corner(t, v) - centre; length(p) < kReach) near.push_back(p);
  }
  Eigen::MatrixXd terms(near.size(), 5);
  Eigen::VectorXd height(near.size());
  for (std::size_t i = 0; i < near.size(); ++i) {
    const double x = dot(near[i], direction), y = dot(near[i], other);
    const auto row = static_cast<Eigen::Index>(i);
    terms.row(row) << x * x, x * y, y * y, x, y;
    height[row] = dot(near[i], normal);
  }
  const Eigen::VectorXd fit = terms.colPivHouseholderQr().solve(height);
  return -2 * fit[0];
}

void print_table(const char* title, const std::vector<std::vector<double>>& force, double closed) {
  std::printf("%s, mN per mm: places across, meshes down\n", title);
  for (const auto& row : force) {
    for (const double f : row) std::printf(" %8.3f", 1e3 * f);
    double mean = 0, low = INFINITY, high = 0;
    for (const double f : row) mean += f / row.size(), low = std::min(low, f), high = std::max(high, f);
    if (closed > 0)
      std::printf("   over the closed form: mean %.3f, %.3f to %.3f", mean / closed, low / closed, high / closed);
    std::printf("\n");
  }
  if (force.size() < 2) return;
  double worst = 0, sum = 0;
  std::printf("spread, %%\n");
  for (std::size_t p = 0; p < force[0].size(); ++p) {
    double mean = 0, low = INFINITY, high = 0;
    for (const auto& row : force)
      mean += row[p] / force.size(), low = std::min(low, row[p]), high = std::max(high, row[p]);
    std::printf(" %8.1f", 100 * (high - low) / mean);
    worst = std::max(worst, (high - low) / mean), sum += (high - low) / mean;
  }
  std::printf("   mean %.1f, worst %.1f\n", 100 * sum / force[0].size(), 100 * worst);
}

}  // namespace

int main(int argc, char** argv) try {
  Arguments arguments;
  if (!parse(argc, argv, &arguments)) {
    std::fprintf(stderr, "usage: punch_bench RADIUS_MM [--half-space YOUNG POISSON] [--point X Y Z]... BUNDLE.h5...\n");
    return 2;
  }
  std::vector<std::vector<double>> push, drag;
  std::vector<double> curvature;
  for (const std::string& file : arguments.bundles) {
    Organ organ(file);
    std::printf("%s: %d nodes, %d on the surface\n", file.c_str(), organ.info.node_count,
                organ.info.surface_node_count);
    if (arguments.points.empty()) arguments.points = palpate::bench::spread_places(organ.bundle, 12);
    push.emplace_back(), drag.emplace_back();
    for (const Vec3 p : arguments.points) {
      const Place place = nearest_place(organ, p);
      const Vec3 across =
          unit_or_zero(cross(place.normal, std::fabs(place.normal.x) < 0.7 ? Vec3{1, 0, 0} : Vec3{0, 1, 0}));
      if (push.size() == 1) curvature.push_back(curvature_along(organ, p, place.normal, across));
      push.back().push_back(force_along(organ, place, -1 * place.normal, arguments.radius));
      drag.back().push_back(force_along(organ, place, across, arguments.radius));
    }
  }
  const double e = arguments.young, nu = arguments.poisson, a = arguments.radius;
  print_table("pushed in", push, e > 0 ? 1e-3 * 2 * e * a / (1 - nu * nu) : 0);
  print_table("dragged", drag, e > 0 ? 1e-3 * 4 * e * a / ((2 - nu) * (1 + nu)) : 0);
  std::printf("curvature along the drag, 1/m\n");
  for (const double k : curvature) std::printf(" %8.0f", k);
  std::printf("\n");
  return 0;
} catch (const palpate::Error& error) {
  std::fprintf(stderr, "punch_bench: %s\n", error.what());
  return 2;
}
