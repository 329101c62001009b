// What obstacles cost that are far from the organ: steps of a scene with them over steps of the same scene without, in turns in one process.
//
//   obstacles_bench BUNDLE.h5 [rounds]
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <vector>

#include <palpate/palpate_scene_def.hpp>
#include "studies/timing/timing.h"

namespace {

constexpr int kSteps = 200;    // of a round
constexpr double kAway = 1.0;  // m

// A disc goes in and out along the normal of a triangle in the middle of the list.
class Played {
 public:
  Played(palpate_bundle* bundle, int obstacles, bool move) : obstacles_(move ? obstacles : 0) {
    std::vector<palpate_obstacle> list(static_cast<std::size_t>(obstacles), palpate_default_obstacle());
    for (palpate_obstacle& plate : list) {
      plate.kind = PALPATE_OBSTACLE_RECTANGLE;
      plate.size[0] = plate.size[1] = 0.3, plate.friction = 0.3, plate.position[2] = -kAway;
    }
    palpate::SceneDef def;
    def.collision = PALPATE_COLLISION_DEFORMED, def.contact = PALPATE_CONTACT_PATCH, def.law = PALPATE_LAW_UNILATERAL;
    def.max_contact_nodes = 600;
    def.obstacles.count = obstacles, def.obstacles.list = list.data();
    palpate_error error = {};
    if (palpate_scene_create(bundle, &def, &scene_, &error) != PALPATE_OK) {
      std::fprintf(stderr, "obstacles_bench: %s\n", error.text);
      std::exit(2);
    }
    memory_.resize(palpate_contacts_bytes(scene_) / 8 + 1);
    const std::int32_t* t = palpate_bundle_triangles(bundle) + 3 * (palpate_bundle_describe(bundle).triangle_count / 2);
    const double* n = palpate_bundle_nodes(bundle);
    double a[3], b[3], length = 0;
    for (int d = 0; d < 3; ++d) {
      place_[d] = (n[3 * t[0] + d] + n[3 * t[1] + d] + n[3 * t[2] + d]) / 3;
      a[d] = n[3 * t[1] + d] - n[3 * t[0] + d], b[d] = n[3 * t[2] + d] - n[3 * t[0] + d];
    }
    for (int d = 0; d < 3; ++d) out_[d] = a[(d + 1) % 3] * b[(d + 2) % 3] - a[(d + 2) % 3] * b[(d + 1) % 3];
    for (const double x : out_) length += x * x;
    for (double& x : out_) x /= __builtin_sqrt(length);
  }
  Played(const Played&) = delete;
  Played& operator=(const Played&) = delete;
  ~Played() { palpate_scene_destroy(scene_); }

  void touch() {
    const double height = 1e-3 - 1e-5 * std::abs(step_++ % 800 - 400);
    double point[3];
    for (int d = 0; d < 3; ++d) point[d] = place_[d] + height * out_[d];
    palpate_tool tool = palpate_default_tool();
    tool.points = point, tool.point_count = 1, tool.disc_radius = 0.006;
    palpate_pose pose = palpate_default_pose();
    pose.position[2] = -kAway + 1e-5 * (step_ % 100);
    for (int i = 0; i < obstacles_; ++i) palpate_scene_set_obstacle_pose(scene_, i, &pose, nullptr);
    palpate_scene_touch(scene_, &tool, 1, 1e-3, reinterpret_cast<palpate_contacts*>(memory_.data()),
                        memory_.size() * sizeof memory_[0]);
  }

 private:
  int obstacles_;  // that are moved
  palpate_scene* scene_ = nullptr;
  std::vector<std::uint64_t> memory_;
  double place_[3], out_[3];
  int step_ = 0;
};

double seconds(Played& played) {
  const auto start = palpate::studies::Clock::now();
  for (int s = 0; s < kSteps; ++s) played.touch();
  return palpate::studies::seconds_since(start);
}

// Median over the rounds of the ratio of both times. The address of a scene's memory changes its time by some per cent, so there are many pairs,
// of which either is created first, and both take turns in going first.
void compare(palpate_bundle* bundle, int obstacles, bool move, int rounds) {
  std::vector<std::unique_ptr<Played>> with, without;
  for (int p = 0; p < 20; ++p) {
    const auto make_with = [&] { with.push_back(std::make_unique<Played>(bundle, obstacles, move)); };
    if (p % 2) make_with();
    without.push_back(std::make_unique<Played>(bundle, 0, false));
    if (p % 2 == 0) make_with();
  }
  std::vector<double> ratio, time;
  for (int r = 0; r < rounds; ++r) {
    const auto p = static_cast<std::size_t>(r) % with.size();
    double a = 0, b = 0;
    if (r / 20 % 2)
      a = seconds(*with[p]), b = seconds(*without[p]);
    else
      b = seconds(*without[p]), a = seconds(*with[p]);
    ratio.push_back(a / b), time.push_back(b / kSteps);
  }
  std::printf("%2d far obstacles%s: touch %.3f us without, with them over that %.4f\n", obstacles,
              move ? " that move" : "", 1e6 * palpate::studies::percentile(time, 0.5),
              palpate::studies::percentile(ratio, 0.5));
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: obstacles_bench BUNDLE.h5 [rounds]\n");
    return 2;
  }
  palpate_error error = {};
  palpate_bundle* bundle = nullptr;
  if (palpate_bundle_open_file(argv[1], nullptr, &bundle, &error) != PALPATE_OK) {
    std::fprintf(stderr, "obstacles_bench: %s\n", error.text);
    return 2;
  }
  const int rounds = argc > 2 ? std::atoi(argv[2]) : 2001;
  for (const bool move : {false, true})
    for (const int obstacles : {1, 4, 16}) compare(bundle, obstacles, move, rounds);
  palpate_bundle_close(bundle);
}
