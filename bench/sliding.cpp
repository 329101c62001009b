// A disc that is pressed in by half its radius and then moved along the surface by its radius, at the same twelve places of several
// meshes of an organ: on each mesh's own surface, and on one fine surface that all of them meet. Prints the force of each place and
// mesh, how far each mesh is from the last one, and how much the force ripples on the way.
//
//   sliding_bench RADIUS_MM FINE.ply BUNDLE.h5...
//
// FINE.ply in millimetres. The places are touchable nodes of the first bundle, far from one another and from held nodes; the last
// bundle is the finest.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "bench/places.h"
#include "formats/errors.h"
#include "formats/ply_reader.h"
#include "runtime/include/palpate/palpate.hpp"
#include "runtime/surface/surface_index.h"

namespace {

using palpate::Vec3;

constexpr int kPressTicks = 80, kDragTicks = 80, kPlaces = 12;

struct Fine {
  std::vector<float> positions;
  std::vector<std::int32_t> triangles;
  Vec3 vertex(std::int32_t v) const {
    const float* p = &positions[3 * static_cast<std::size_t>(v)];
    return {p[0], p[1], p[2]};
  }
};

Fine read_fine(const char* file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw palpate::InputError(std::string(file) + ": expected a surface (.ply), found no file");
  const palpate::PlyTriangles ply = palpate::read_ply(file, {std::istreambuf_iterator<char>(stream), {}});
  Fine fine;
  for (const auto& point : ply.points)
    for (const double x : point) fine.positions.push_back(static_cast<float>(1e-3 * x));
  for (const auto& t : ply.triangles) fine.triangles.insert(fine.triangles.end(), t.begin(), t.end());
  return fine;
}

struct Found {
  Vec3 at, normal;
};

// The nearest point of a surface, and its normal: the mean over the triangles within `reach` that face the same way.
template <class Corner>
Found nearest(Vec3 p, double reach, std::size_t triangles, Corner corner) {
  Found found;
  double least = INFINITY;
  Vec3 face;
  for (std::size_t t = 0; t < triangles; ++t) {
    double k[3];
    const Vec3 a = corner(t, 0), b = corner(t, 1), c = corner(t, 2);
    const double distance = palpate::closest_on_triangle(p, a, b, c, k);
    if (distance >= least) continue;
    least = distance, found.at = k[0] * a + k[1] * b + k[2] * c, face = cross(b - a, c - a);
  }
  for (std::size_t t = 0; t < triangles; ++t) {
    const Vec3 a = corner(t, 0), area = cross(corner(t, 1) - a, corner(t, 2) - a);
    if (length(a - found.at) < reach && dot(area, face) > 0) found.normal += area;
  }
  found.normal = unit_or_zero(found.normal);
  return found;
}

struct Slid {
  Vec3 force;                                  // N, at the end
  double ripple_along = 0, ripple_across = 0;  // departures of the force from its mean over 2 mm of the way, relative
};

// Largest departure of the force from its mean over the ticks around, along that mean and across it, over the mean size.
void measure_ripple(const std::vector<Vec3>& way, int around, Slid* slid) {
  double size = 0;
  for (const Vec3 f : way) size += length(f) / static_cast<double>(way.size());
  const int n = static_cast<int>(way.size());
  for (int i = around; i + around < n && size > 0; ++i) {
    Vec3 mean;
    for (int k = i - around; k <= i + around; ++k) mean += (1.0 / (2 * around + 1)) * way[static_cast<std::size_t>(k)];
    const Vec3 off = way[static_cast<std::size_t>(i)] - mean, along = unit_or_zero(mean);
    slid->ripple_along = std::max(slid->ripple_along, std::fabs(dot(off, along)) / size);
    slid->ripple_across = std::max(slid->ripple_across, length(off - dot(off, along) * along) / size);
  }
}

Slid slide(palpate::Scene& scene, palpate::Contacts& contacts, const Found& place, Vec3 across, double radius,
           palpate_step_flags* flags) {
  scene.reset();
  Slid slid;
  std::vector<Vec3> way;
  for (int tick = 0; tick <= kPressTicks + kDragTicks; ++tick) {
    const double down = std::min(1.0, 1.0 * tick / kPressTicks),
                 along = std::max(0.0, 1.0 * (tick - kPressTicks) / kDragTicks);
    const Vec3 p = place.at + radius * ((0.1 * (1 - down) - 0.5 * down) * place.normal) + (along * radius) * across;
    double point[3];
    store3(p, point);
    palpate_tool tool = palpate_default_tool();
    tool.points = point, tool.point_count = 1, tool.disc_radius = radius, tool.friction = 0.3;
    *flags |= scene.touch(&tool, 1, 1e-3, contacts);
    slid.force = palpate::load3(contacts.tool(0).force_raw);
    if (tick > kPressTicks) way.push_back(slid.force);
  }
  measure_ripple(way, std::max(1, static_cast<int>(1e-3 * kDragTicks / radius)), &slid);
  return slid;
}

void print_row(const char* name, const std::vector<double>& numbers, const char* format) {
  std::printf("  %-28s", name);
  for (const double x : numbers) std::printf(format, x);
  std::printf("\n");
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 4 || !(std::atof(argv[1]) > 0)) {
    std::fprintf(stderr, "usage: sliding_bench RADIUS_MM FINE.ply BUNDLE.h5...\n");
    return 2;
  }
  const double radius = 1e-3 * std::atof(argv[1]);
  const Fine fine = read_fine(argv[2]);
  palpate_fine_surface surface = palpate_default_fine_surface();
  surface.positions = fine.positions.data(), surface.triangles = fine.triangles.data();
  surface.vertex_count = static_cast<std::int32_t>(fine.positions.size() / 3);
  surface.triangle_count = static_cast<std::int32_t>(fine.triangles.size() / 3);

  struct Law {
    const char* name;
    palpate_contact_law law;
  };
  std::vector<Vec3> places;
  for (const Law law : {Law{"sticking", PALPATE_LAW_STICKING}, Law{"sliding", PALPATE_LAW_SLIDING},
                        Law{"coulomb 0.3", PALPATE_LAW_COULOMB}})
    for (const bool on_fine : {false, true}) {
      std::printf("law %s, on %s\n", law.name, on_fine ? "the fine surface" : "each mesh's own surface");
      std::vector<std::vector<Slid>> all;
      for (int b = 3; b < argc; ++b) {
        const palpate::Bundle bundle(argv[b]);
        if (places.empty()) places = palpate::bench::spread_places(bundle, kPlaces);
        palpate_scene_def def = palpate_default_scene_def();
        def.shape = PALPATE_SHAPE_OFF, def.law = law.law, def.collision = PALPATE_COLLISION_DEFORMED;
        def.max_points = 4, def.max_contact_nodes = 1500, def.max_tool_speed = INFINITY;
        def.force_limit = def.force_slew = INFINITY;
        if (on_fine) def.fine_surface = &surface;
        palpate::Scene scene(bundle, def);
        palpate::Contacts contacts = scene.make_contacts();
        palpate_step_flags flags = 0;
        all.emplace_back();
        std::vector<double> force, along, across_it;
        const auto fine_corner = [&](std::size_t t, int v) { return fine.vertex(fine.triangles[3 * t + v]); };
        const auto mesh_corner = [&](std::size_t t, int v) {
          return palpate::load3(bundle.nodes() + 3 * bundle.triangles()[3 * t + v]);
        };
        for (const Vec3 p : places) {
          Found place = nearest(p, radius, fine.triangles.size() / 3, fine_corner);
          if (!on_fine)
            place.at = nearest(place.at, 0, static_cast<std::size_t>(bundle.describe().triangle_count), mesh_corner).at;
          const Vec3 across =
              unit_or_zero(cross(place.normal, std::fabs(place.normal.x) < 0.7 ? Vec3{1, 0, 0} : Vec3{0, 1, 0}));
          all.back().push_back(slide(scene, contacts, place, across, radius, &flags));
          force.push_back(1e3 * length(all.back().back().force));
          along.push_back(100 * all.back().back().ripple_along);
          across_it.push_back(100 * all.back().back().ripple_across);
        }
        std::printf(" %s: %d nodes, flags %u\n", argv[b], bundle.describe().node_count, flags);
        print_row("force, mN", force, " %6.1f");
        print_row("ripple of its length, %", along, " %6.1f");
        print_row("ripple of its direction, %", across_it, " %6.1f");
      }
      for (std::size_t b = 0; b + 1 < all.size(); ++b) {
        std::vector<double> apart;
        double squares = 0;
        int within = 0;
        for (std::size_t p = 0; p < places.size(); ++p) {
          const Vec3 last = all.back()[p].force;
          // Where the disc has slid off the organ on both meshes, they agree.
          const double off = length(all[b][p].force - last), relative = off > 0 ? off / length(last) : 0;
          apart.push_back(100 * relative), squares += relative * relative, within += relative <= 0.1;
        }
        std::printf(" %s against the last\n", argv[3 + b]);
        print_row("force apart, %", apart, " %6.1f");
        std::printf("  root mean square %.1f %%; within 10 %% at %d of %d\n",
                    100 * std::sqrt(squares / static_cast<double>(places.size())), within,
                    static_cast<int>(places.size()));
      }
    }
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "sliding_bench: %s\n", error.what());
  return 2;
}
