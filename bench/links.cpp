// What links and grasps cost a touch step: medians of processor time of the same steps without them, with slack threads, with taut ones,
// and with the same tissue held by a grasp in place of a grip's disc.
//
//   links_bench BUNDLE.h5 [steps]
#include <palpate/palpate.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <vector>

namespace {

constexpr int kGrips = 4;
constexpr double kRadius = 0.006;

double processor_seconds() {
  timespec now = {};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// Triangles whose three nodes are touchable, far from each other in their list.
std::vector<std::int32_t> touchable_triangles(const palpate_bundle* bundle) {
  const palpate_bundle_info info = palpate_bundle_describe(bundle);
  std::vector<char> touchable(static_cast<std::size_t>(info.surface_node_count));
  for (std::int32_t k = 0; k < info.touchable_count; ++k) touchable[palpate_bundle_touchable(bundle)[k]] = 1;
  std::vector<std::int32_t> found;
  const std::int32_t* t = palpate_bundle_triangles(bundle);
  for (std::int32_t f = 0; f < info.triangle_count; ++f)
    if (touchable[t[3 * f]] && touchable[t[3 * f + 1]] && touchable[t[3 * f + 2]]) found.push_back(f);
  return found;
}

void middle_of(const palpate_bundle* bundle, std::int32_t triangle, double* p) {
  for (int d = 0; d < 3; ++d) {
    p[d] = 0;
    for (int v = 0; v < 3; ++v)
      p[d] += palpate_bundle_nodes(bundle)[3 * palpate_bundle_triangles(bundle)[3 * triangle + v] + d] / 3;
  }
}

struct Setting {
  const char* name;
  int links = 0;
  double rest_share = 0;  // of the distance of the ends at rest
  double radius = 0;      // m, of the links' ends
  int discs = 0;          // of a grasp in place of the first grips
};

struct Result {
  double median = 0;  // us
  int nodes = 0;
};

Result run(palpate_bundle* bundle, const std::vector<std::int32_t>& triangles, const Setting& what, int steps) {
  palpate_scene_def def = palpate_default_scene_def();
  def.collision = PALPATE_COLLISION_OFF, def.shape = PALPATE_SHAPE_OFF;
  def.force_limit = def.force_slew = INFINITY;
  def.max_links = what.links, def.grasps = what.discs > 0;
  palpate_scene* scene = nullptr;
  palpate_error error = {};
  if (palpate_scene_create(bundle, &def, &scene, &error) != PALPATE_OK) {
    std::fprintf(stderr, "links_bench: %s\n", error.text);
    std::exit(2);
  }
  const auto triangle = [&](std::size_t i, std::size_t of) { return triangles[i * (triangles.size() - 1) / of]; };
  std::vector<palpate_link> links;
  for (int i = 0; i < what.links; ++i) {
    palpate_link link = palpate_default_link();
    link.kind = PALPATE_LINK_THREAD, link.radius = what.radius;
    double ends[2][3], apart = 0;
    for (int e = 0; e < 2; ++e) {
      link.ends[e].kind = PALPATE_END_SURFACE_POINT;
      link.ends[e].triangle = triangle(static_cast<std::size_t>(2 * i + e), static_cast<std::size_t>(2 * what.links));
      for (double& k : link.ends[e].barycentric) k = 1.0 / 3;
      middle_of(bundle, link.ends[e].triangle, ends[e]);
    }
    for (int d = 0; d < 3; ++d) apart += (ends[0][d] - ends[1][d]) * (ends[0][d] - ends[1][d]);
    link.rest_length = what.rest_share * std::sqrt(apart);
    links.push_back(link);
  }
  if (what.links > 0 && palpate_scene_set_links(scene, links.data(), what.links, &error) != PALPATE_OK) {
    std::fprintf(stderr, "links_bench: %s\n", error.text);
    std::exit(2);
  }
  palpate_grip grips[kGrips];
  for (int g = 0; g < kGrips; ++g) {
    grips[g] = palpate_default_grip();
    grips[g].kind = PALPATE_GRIP_SURFACE_POINT;
    grips[g].triangle = triangle(static_cast<std::size_t>(2 * g + 1), 2 * kGrips);
    for (double& k : grips[g].barycentric) k = 1.0 / 3;
  }
  palpate_grasp grasp = palpate_default_grasp();
  grasp.triangle = grips[0].triangle, grasp.radius = kRadius;
  std::copy_n(grips[0].barycentric, 3, grasp.barycentric);
  if (what.discs > 1) {
    grasp.opposite_triangle = grips[1].triangle;
    std::copy_n(grips[1].barycentric, 3, grasp.opposite_barycentric);
  }
  palpate_tool tool = palpate_default_tool();
  tool.grips = grips + what.discs, tool.grip_count = kGrips - what.discs, tool.disc_radius = kRadius;
  tool.grasp = what.discs > 0 ? &grasp : nullptr;
  std::vector<std::uint64_t> memory(palpate_contacts_bytes(scene) / 8 + 1);
  auto* contacts = reinterpret_cast<palpate_contacts*>(memory.data());
  std::vector<double> times;
  for (int s = 0; s < steps; ++s) {
    const double way = 2e-3 * std::sin(2e-3 * s);
    for (palpate_grip& grip : grips) grip.displacement[2] = way;
    grasp.position[2] = way;
    const double begin = processor_seconds();
    palpate_scene_touch(scene, &tool, 1, 1e-3, contacts, memory.size() * 8);
    times.push_back(processor_seconds() - begin);
  }
  const Result result = {0, contacts->node_count};
  palpate_scene_destroy(scene);
  std::nth_element(times.begin(), times.begin() + steps / 2, times.end());
  return {1e6 * times[static_cast<std::size_t>(steps / 2)], result.nodes};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: links_bench BUNDLE.h5 [steps]\n");
    return 2;
  }
  palpate_bundle* bundle = nullptr;
  palpate_error error = {};
  if (palpate_bundle_open_file(argv[1], nullptr, &bundle, &error) != PALPATE_OK) {
    std::fprintf(stderr, "links_bench: %s\n", error.text);
    return 2;
  }
  const int steps = argc > 2 ? std::max(100, std::atoi(argv[2])) : 5000;
  const std::vector<std::int32_t> triangles = touchable_triangles(bundle);
  const Setting settings[] = {{"4 discs of grips", 0, 0, 0, 0},
                              {"and 10 slack threads", 10, 1.5, 0.003, 0},
                              {"and 100 slack threads", 100, 1.5, 0.003, 0},
                              {"and 100 threads that the grips stretch", 100, 1 + 1e-4, 0.003, 0},
                              {"and 10 taut threads", 10, 0.95, 0.003, 0},
                              {"and 30 taut threads, points", 30, 0.95, 0, 0},
                              {"3 discs of grips, a grasp of one disc", 0, 0, 0, 1},
                              {"2 discs of grips, a grasp of two discs", 0, 0, 0, 2}};
  std::printf("medians of %d touches of %d triangles, processor time\n%-40s %8s %8s %6s\n", steps,
              palpate_bundle_describe(bundle).triangle_count, "", "us", "nodes", "ratio");
  // The reference is measured before and after, because the machine's speed drifts.
  const double before = run(bundle, triangles, settings[0], steps).median;
  std::vector<Result> results;
  for (const Setting& what : settings) results.push_back(run(bundle, triangles, what, steps));
  const double reference = std::min({before, results[0].median, run(bundle, triangles, settings[0], steps).median});
  for (std::size_t i = 0; i < results.size(); ++i)
    std::printf("%-40s %8.2f %8d %6.2f\n", settings[i].name, results[i].median, results[i].nodes,
                results[i].median / reference);
  palpate_bundle_close(bundle);
}
