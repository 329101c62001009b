// What a needle costs a touch step: medians and worst of processor time while it goes in, is held, and is drawn back, by the places
// that it holds; beside the same step of a grip alone. The entry and the direction must lie in a corridor of the bundle.
//
//   needle_bench BUNDLE.h5 X Y Z DX DY DZ [places]      X Y Z: a point outside, m; DX DY DZ: the direction inwards
#include <palpate/palpate.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <vector>

namespace {

constexpr double kStep = 2e-4;  // m: 0.2 m/s at 1 kHz

double processor_seconds() {
  timespec now = {};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

void say(const char* what, std::vector<double>& times, const palpate_needle_state* state) {
  if (times.empty()) return;
  std::sort(times.begin(), times.end());
  const auto at = [&](double share) {
    return 1e6 * times[static_cast<std::size_t>(share * static_cast<double>(times.size() - 1))];
  };
  std::printf("%-28s %7.1f %7.1f %7.1f us of %zu steps; %d places, %d slide, depth %.1f mm, %.3f N\n", what, at(0.5),
              at(0.99), at(1), times.size(), state ? state->places : 0, state ? state->slipping : 0,
              state ? 1e3 * state->depth : 0,
              state ? std::sqrt(state->force[0] * state->force[0] + state->force[1] * state->force[1] +
                                state->force[2] * state->force[2])
                    : 0);
  times.clear();
}

int fail(const char* text) {
  std::fprintf(stderr, "needle_bench: %s\n", text);
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 8) return fail("expected BUNDLE.h5 X Y Z DX DY DZ [places]");
  double from[3], way[3], size = 0;
  for (int d = 0; d < 3; ++d)
    from[d] = std::atof(argv[2 + d]), way[d] = std::atof(argv[5 + d]), size += way[d] * way[d];
  for (double& x : way) x /= std::sqrt(size);
  const int places = argc > 8 ? std::atoi(argv[8]) : 30;

  palpate_bundle* bundle = nullptr;
  palpate_scene* scene = nullptr;
  palpate_error error = {};
  if (palpate_bundle_open_file(argv[1], nullptr, &bundle, &error) != PALPATE_OK) return fail(error.text);
  palpate_scene_def def = palpate_default_scene_def();
  def.collision = PALPATE_COLLISION_OFF, def.shape = PALPATE_SHAPE_OFF, def.queries = PALPATE_QUERIES_ON;
  def.max_tools = 1, def.max_points = 4, def.needles = 1, def.needle_places = places;
  def.force_limit = def.force_slew = INFINITY;
  def.max_operations = 3'000'000;
  if (palpate_scene_create(bundle, &def, &scene, &error) != PALPATE_OK) return fail(error.text);
  palpate_surface_hit hit = palpate_default_surface_hit();
  palpate_scene_cast_ray(scene, nullptr, from, way, 1.0, &hit);
  if (!hit.hit) return fail("expected a surface in front of the point, found none");

  palpate_needle needle = palpate_default_needle();
  needle.triangle = hit.triangle, needle.radius = 0.5e-3;
  std::memcpy(needle.barycentric, hit.barycentric, sizeof hit.barycentric);
  needle.friction = 2, needle.cutting_force = 0.02, needle.puncture_force = 0.05, needle.spacing = 2.5e-3;
  std::memcpy(needle.direction, way, sizeof way);
  palpate_tool tool = palpate_default_tool();
  tool.id = 0, tool.needle = &needle, tool.has_torque = 1;
  std::vector<std::uint64_t> memory(palpate_contacts_bytes(scene) / 8 + 1);
  auto* contacts = reinterpret_cast<palpate_contacts*>(memory.data());
  std::vector<double> times;
  palpate_step_flags flags = 0;
  const auto step = [&](double depth, double aside) {
    for (int d = 0; d < 3; ++d) needle.tip[d] = hit.point[d] + depth * way[d] + aside * way[(d + 1) % 3];
    const double begin = processor_seconds();
    flags |= palpate_scene_touch(scene, &tool, 1, 1e-3, contacts, memory.size() * 8);
    times.push_back(processor_seconds() - begin);
    return palpate_scene_needle_state(scene, 0);
  };
  std::printf("%-28s  median    99 %%   worst\n", "");
  double depth = -2e-3;
  const palpate_needle_state* state = nullptr;
  for (const int upto : {10, 20, places - 1}) {
    do state = step(depth += kStep, 0);
    while (state->places < upto && state->condition != PALPATE_NEEDLE_STUCK && depth < 0.3);
    say("goes in and cuts", times, state);
    if (state->condition == PALPATE_NEEDLE_STUCK) std::printf("its tip came to the end of the corridor\n");
  }
  for (int s = 0; s < 1000; ++s) state = step(depth, 1e-3 * std::sin(6e-3 * s));
  say("held, moved 1 mm aside", times, state);
  for (int s = 0; s < 1000; ++s) state = step(depth + 2e-4 * std::sin(6e-3 * s), 0);
  say("to and fro by 0.2 mm", times, state);
  while (state->places > 0) state = step(depth -= kStep, 0);
  say("drawn back", times, state);
  std::printf("flags raised: 0x%x\n", flags);
  palpate_scene_destroy(scene);
  palpate_bundle_close(bundle);
}
