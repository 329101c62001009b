// What a touch of two organs that press on one another costs, by the number of places where they do, against a scene of one organ on which
// as many tool points press. The second organ stands on the same bundle, turned over, so that the two tops meet.
//
// Behind it what links between the two organs cost while these do not touch.
//
//   touching_bench BUNDLE.h5
#include <palpate/palpate_world.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <vector>

namespace {

constexpr int kSteps = 2000;
// m, of the organ's motion to and fro while the steps are measured: pairs that keep their places, and pairs that move on.
constexpr double kStrokes[] = {2e-5, 1e-3};

[[noreturn]] void give_up(const char* text) {
  std::fprintf(stderr, "touching_bench: %s\n", text);
  std::exit(2);
}

double now() {
  return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double median(std::vector<double>& times) {
  std::nth_element(times.begin(), times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2), times.end());
  return times[times.size() / 2];
}

struct Box {
  double low[3], high[3];
};

Box box_of(palpate_bundle* bundle) {
  Box box = {{1e9, 1e9, 1e9}, {-1e9, -1e9, -1e9}};
  const double* const nodes = palpate_bundle_nodes(bundle);
  for (std::int32_t i = 0; i < 3 * palpate_bundle_describe(bundle).surface_node_count; ++i)
    box.low[i % 3] = std::min(box.low[i % 3], nodes[i]), box.high[i % 3] = std::max(box.high[i % 3], nodes[i]);
  return box;
}

palpate_scene_def scene_def() {
  palpate_scene_def def = palpate_default_scene_def();
  def.collision = PALPATE_COLLISION_DEFORMED, def.law = PALPATE_LAW_UNILATERAL;
  def.max_points = 256, def.max_operations = 100'000'000;
  return def;
}

// Two organs; `gap` metres between the highest points of their rest shapes.
class Pressed {
 public:
  explicit Pressed(palpate_bundle* bundle) : box_(box_of(bundle)) {
    const palpate_scene_def def = scene_def();
    const palpate_pose pose = pose_at(box_.high[2] - box_.low[2]);
    palpate_world_organ organs[2] = {palpate_default_world_organ(), palpate_default_world_organ()};
    for (palpate_world_organ& organ : organs) organ.bundle = bundle, organ.def = &def;
    organs[1].pose = &pose;
    palpate_world_def wanted = palpate_default_world_def();
    wanted.organs = organs, wanted.organ_count = 2, wanted.max_pairs = 1000;
    palpate_error error = {};
    if (palpate_world_create(&wanted, &world_, &error) != PALPATE_OK) give_up(error.text);
    memory_.resize(palpate_world_contacts_bytes(world_) / 8 + 1);
  }
  Pressed(const Pressed&) = delete;
  ~Pressed() { palpate_world_destroy(world_); }

  void move(double gap) {
    const palpate_pose pose = pose_at(gap);
    palpate_scene_set_pose(palpate_world_scene(world_, 1), &pose, nullptr);
  }
  void touch() { palpate_world_touch(world_, nullptr, 0, 1e-3, contacts(), 8 * memory_.size()); }
  palpate_world_contacts* contacts() { return reinterpret_cast<palpate_world_contacts*>(memory_.data()); }
  int pressing() {
    int count = 0;
    for (std::int32_t i = 0; i < contacts()->pair_count; ++i)
      count += palpate_world_contacts_pair(contacts(), i)->pressure > 0;
    return count;
  }

 private:
  // Turned over about x, so that its top looks down on that of the first one.
  palpate_pose pose_at(double gap) const {
    palpate_pose pose = palpate_default_pose();
    pose.orientation[0] = 0, pose.orientation[1] = 1;
    pose.position[1] = box_.low[1] + box_.high[1];
    pose.position[2] = 2 * box_.high[2] + gap;
    return pose;
  }
  Box box_;
  palpate_world* world_ = nullptr;
  std::vector<std::uint64_t> memory_;
};

// A scene of one organ with as many tool points that press on its highest vertices.
double time_of_points(palpate_bundle* bundle, int count) {
  const palpate_scene_def def = scene_def();
  palpate_scene* scene = nullptr;
  palpate_error error = {};
  if (palpate_scene_create(bundle, &def, &scene, &error) != PALPATE_OK) give_up(error.text);
  std::vector<std::uint64_t> memory(palpate_contacts_bytes(scene) / 8 + 1);
  auto* const contacts = reinterpret_cast<palpate_contacts*>(memory.data());
  std::vector<std::int32_t> order(palpate_bundle_touchable(bundle),
                                  palpate_bundle_touchable(bundle) + palpate_bundle_describe(bundle).touchable_count);
  const double* const nodes = palpate_bundle_nodes(bundle);
  std::sort(order.begin(), order.end(),
            [&](std::int32_t a, std::int32_t b) { return nodes[3 * a + 2] > nodes[3 * b + 2]; });
  std::vector<double> points(3 * static_cast<std::size_t>(count)), times;
  for (int s = 0; s < kSteps; ++s) {
    const double depth = s < 20 ? 1e-4 * (s - 10) : 1e-3 + kStrokes[0] * std::sin(0.05 * s);
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
      for (std::size_t d = 0; d < 3; ++d)
        points[3 * i + d] = nodes[3 * order[i % order.size()] + static_cast<std::int32_t>(d)] - (d == 2 ? depth : 0);
    palpate_tool tool = palpate_default_tool();
    tool.points = points.data(), tool.point_count = count;
    const double begin = now();
    palpate_scene_touch(scene, &tool, 1, 1e-3, contacts, 8 * memory.size());
    if (s >= 100) times.push_back(now() - begin);
  }
  palpate_scene_destroy(scene);
  return median(times);
}

// Two organs 5 mm apart with threads between their highest vertices; the second one moves to and fro, so that all rows turn.
double time_of_links(palpate_bundle* bundle, int count, double stroke) {
  const Box box = box_of(bundle);
  palpate_scene_def def = scene_def();
  palpate_pose pose = palpate_default_pose();
  pose.position[0] = box.high[0] - box.low[0] + 0.005;
  palpate_world_organ organs[2] = {palpate_default_world_organ(), palpate_default_world_organ()};
  for (palpate_world_organ& organ : organs) organ.bundle = bundle, organ.def = &def;
  organs[1].pose = &pose;
  palpate_world_def wanted = palpate_default_world_def();
  wanted.organs = organs, wanted.organ_count = 2, wanted.max_links = std::max(1, count);
  palpate_world* world = nullptr;
  palpate_error error = {};
  if (palpate_world_create(&wanted, &world, &error) != PALPATE_OK) give_up(error.text);
  std::vector<palpate_world_link> links(static_cast<std::size_t>(count), palpate_default_world_link());
  std::int32_t triangle = 0;
  for (palpate_world_link& link : links) {
    link.kind = PALPATE_LINK_SPRING, link.rest_length = 0.001, link.stiffness = 20;
    for (int e = 0; e < 2; ++e) {
      link.organ[e] = e, link.ends[e].kind = PALPATE_END_SURFACE_POINT, link.ends[e].triangle = triangle;
      link.ends[e].barycentric[0] = link.ends[e].barycentric[1] = 0.25, link.ends[e].barycentric[2] = 0.5;
    }
    triangle += palpate_bundle_describe(bundle).triangle_count / std::max(1, count);
  }
  if (palpate_world_set_links(world, links.data(), count, &error) != PALPATE_OK) give_up(error.text);
  std::vector<std::uint64_t> memory(palpate_world_contacts_bytes(world) / 8 + 1);
  auto* const contacts = reinterpret_cast<palpate_world_contacts*>(memory.data());
  std::vector<double> times;
  for (int s = 0; s < kSteps; ++s) {
    pose.position[0] += stroke * std::cos(0.05 * s) * 0.05;
    palpate_scene_set_pose(palpate_world_scene(world, 1), &pose, nullptr);
    const double begin = now();
    palpate_world_touch(world, nullptr, 0, 1e-3, contacts, 8 * memory.size());
    if (s >= 100) times.push_back(now() - begin);
  }
  palpate_world_destroy(world);
  return median(times);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) give_up("usage: touching_bench BUNDLE.h5");
  palpate_bundle* bundle = nullptr;
  palpate_error error = {};
  if (palpate_bundle_open_file(argv[1], nullptr, &bundle, &error) != PALPATE_OK) give_up(error.text);
  std::printf("two organs of %d vertices each\n\nstroke mm  pressing  pairs   touch us  worst us   points us  ratio\n",
              palpate_bundle_describe(bundle).surface_node_count);
  const Box box = box_of(bundle);
  const double deepest = -0.25 * (box.high[2] - box.low[2]), pace = 2e-5;
  for (const int wanted : {10, 30, 60, 100}) {
    Pressed pressed(bundle);
    double gap = 1e-3;
    while (gap > deepest && (gap > 0 || pressed.pressing() < wanted)) pressed.move(gap -= pace), pressed.touch();
    if (pressed.pressing() < wanted) break;
    const double points = time_of_points(bundle, wanted);
    for (const double stroke : kStrokes) {
      std::vector<double> times;
      for (int s = 0; s < kSteps; ++s) {
        pressed.move(gap + stroke * std::sin(0.05 * s));
        const double begin = now();
        pressed.touch();
        times.push_back(now() - begin);
      }
      const double typical = median(times);
      std::printf("%9.2f %9d %6d %10.1f %9.1f %11.1f %6.2f\n", 1e3 * stroke, pressed.pressing(),
                  pressed.contacts()->pair_count, typical, *std::max_element(times.begin(), times.end()), points,
                  typical / points);
    }
  }
  std::printf("\nlinks  stroke mm   touch us\n");
  for (const int count : {0, 1, 10, 30})
    for (const double stroke : {0.0, 1e-3})
      std::printf("%5d %10.2f %10.1f\n", count, 1e3 * stroke, time_of_links(bundle, count, stroke));
  palpate_bundle_close(bundle);
}
