// How far the surface that the effects refer to is from the deformed surface. Contact laws take the normals of the surface at rest,
// and collision does not know the correction by P. Presses a disc into places all over an organ and compares.
//
//   bent_surface_bench BUNDLE.h5
#include <palpate/palpate.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "runtime/base/vec3.h"

namespace {

using palpate::Vec3;

constexpr double kRadius = 0.005, kNear = 0.015;  // m: of the disc; within which a second tool may slide
constexpr int kPlaces = 40;

[[noreturn]] void give_up(const char* text) {
  std::fprintf(stderr, "bent_surface_bench: %s\n", text);
  std::exit(2);
}

struct Organ {
  explicit Organ(palpate_bundle* opened) : bundle(opened), info(palpate_bundle_describe(bundle)) {
    touchable.resize(static_cast<std::size_t>(info.surface_node_count));
    for (std::int32_t i = 0; i < info.touchable_count; ++i)
      touchable[static_cast<std::size_t>(palpate_bundle_touchable(bundle)[i])] = true;
  }
  const std::int32_t* triangle(std::int32_t f) const { return palpate_bundle_triangles(bundle) + 3 * f; }
  bool is_touchable(std::int32_t f) const {
    return std::all_of(triangle(f), triangle(f) + 3,
                       [&](std::int32_t n) { return touchable[static_cast<std::size_t>(n)]; });
  }
  // displacements: nullptr for the surface at rest.
  Vec3 corner(std::int32_t f, int k, const float* displacements) const {
    const std::size_t at = 3 * static_cast<std::size_t>(triangle(f)[k]);
    Vec3 p = palpate::load3(palpate_bundle_nodes(bundle) + at);
    if (displacements) p += Vec3{displacements[at], displacements[at + 1], displacements[at + 2]};
    return p;
  }
  Vec3 normal(std::int32_t f, const float* displacements = nullptr) const {
    const Vec3 a = corner(f, 0, displacements);
    return palpate::unit_or_zero(cross(corner(f, 1, displacements) - a, corner(f, 2, displacements) - a));
  }
  Vec3 middle(std::int32_t f) const {
    return (1.0 / 3) * (corner(f, 0, nullptr) + corner(f, 1, nullptr) + corner(f, 2, nullptr));
  }
  palpate_bundle* bundle;
  palpate_bundle_info info;
  std::vector<bool> touchable;
};

// The surface's displacements under a disc that is pressed into a triangle.
class Pressed {
 public:
  Pressed(const Organ& organ, bool corrected) : organ_(organ) {
    palpate_scene_def def = palpate_default_scene_def();
    def.collision = PALPATE_COLLISION_OFF, def.radial = corrected ? PALPATE_RADIAL_RESPONSE : PALPATE_RADIAL_OFF;
    palpate_error error = {};
    if (palpate_scene_create(organ.bundle, &def, &scene_, &error) != PALPATE_OK) give_up(error.text);
    memory_.resize(palpate_contacts_bytes(scene_) / 8 + 1);
    u_.resize(3 * static_cast<std::size_t>(organ.info.surface_node_count));
  }
  Pressed(const Pressed&) = delete;
  ~Pressed() { palpate_scene_destroy(scene_); }
  const float* press(std::int32_t f, double depth) {
    palpate_grip grip = palpate_default_grip();
    grip.kind = PALPATE_GRIP_SURFACE_POINT, grip.triangle = f;
    std::fill(grip.barycentric, grip.barycentric + 3, 1.0 / 3);
    palpate::store3(-depth * organ_.normal(f), grip.displacement);
    palpate_tool tool = palpate_default_tool();
    tool.grips = &grip, tool.grip_count = 1, tool.disc_radius = kRadius;
    auto* contacts = reinterpret_cast<palpate_contacts*>(memory_.data());
    palpate_scene_touch(scene_, &tool, 1, 1e-3, contacts, 8 * memory_.size());
    palpate_shape_out out = palpate_default_shape_out();
    out.displacements = u_.data(), out.node_capacity = organ_.info.surface_node_count;
    palpate_scene_shape(scene_, contacts, &out);
    return u_.data();
  }

 private:
  const Organ& organ_;
  palpate_scene* scene_ = nullptr;
  std::vector<std::uint64_t> memory_;
  std::vector<float> u_;
};

void print(const char* what, std::vector<double> values, const char* unit) {
  std::sort(values.begin(), values.end());
  std::printf("  %-58s %5.2f median, %5.2f worst %s\n", what, values[values.size() / 2], values.back(), unit);
}

void compare(const Organ& organ, double depth) {
  Pressed linear(organ, false), drawn(organ, organ.info.has_radial != 0);
  std::vector<double> below, near, off;
  for (std::int32_t f = 0; f < organ.info.triangle_count && below.size() < kPlaces; f += 7) {
    if (!organ.is_touchable(f)) continue;
    const float *met = linear.press(f, depth), *seen = drawn.press(f, depth);
    const auto turned = [&](std::int32_t at) {
      return std::acos(std::clamp(dot(organ.normal(at), organ.normal(at, met)), -1.0, 1.0)) * 57.29577951308232;
    };
    double most = 0, farthest = 0;
    for (std::int32_t at = 0; at < organ.info.triangle_count; ++at) {
      if (length(organ.middle(at) - organ.middle(f)) < kNear) most = std::max(most, turned(at));
      for (int k = 0; k < 3; ++k)
        farthest = std::max(farthest, length(organ.corner(at, k, met) - organ.corner(at, k, seen)));
    }
    below.push_back(turned(f)), near.push_back(most), off.push_back(1e3 * farthest);
  }
  if (below.empty()) give_up("expected a triangle whose nodes can all be touched, found none");
  std::printf("a disc of %g mm radius, pressed %g mm deep at %zu places\n", 1e3 * kRadius, 1e3 * depth, below.size());
  print("normal below the disc, turned from rest", below, "degrees");
  print("the same, the worst triangle within 15 mm", near, "degrees");
  if (organ.info.has_radial) print("farthest node: surface drawn by P from the one met", off, "mm");
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 2) give_up("usage: bent_surface_bench BUNDLE.h5");
  palpate_bundle* bundle = nullptr;
  palpate_error error = {};
  if (palpate_bundle_open_file(arguments[1], nullptr, &bundle, &error) != PALPATE_OK) give_up(error.text);
  for (const double depth : {0.002, 0.005, 0.01}) compare(Organ(bundle), depth);
  palpate_bundle_close(bundle);
  return 0;
}
