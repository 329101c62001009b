// beside_bench BUNDLE.h5 [places]: what it costs and what it misses to solve large deformation beside the touch, with the metric of
// rest and with a renewed one.
// Discs of 10 mm radius are held at places over the organ, pushed in by 20 mm at 0.1 m/s, dragged by 10 mm and drawn back by 10 mm. The
// reference is the same path with the body solved to its end in every step. A solution
// of a step is there in the next step, is solved as far as the time between two solutions allows, and serves until the next one.

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <stdexcept>
#include <utility>
#include <vector>

#include "runtime/include/palpate/palpate.hpp"

namespace palpate {
namespace {

using Eigen::Vector3d;

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}
double at_share(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 0 : values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

constexpr int kPush = 200, kDrag = 100, kBack = 100;

// m, at a step of the path.
Vector3d displacement(int step, const Vector3d& inward, const Vector3d& across) {
  const int in = std::min(step, kPush) - std::max(0, step - kPush - kDrag), along = std::clamp(step - kPush, 0, kDrag);
  return 1e-4 * (in * inward + along * across);
}

struct Played {
  std::vector<Vector3d> force;         // N, [places][steps]
  std::vector<Eigen::VectorXf> field;  // m, of every 25th step
  std::vector<double> touch, deform;   // us
  std::vector<bool> behind;
};

// every: steps of a millisecond from one solution to the next, which may take that long; 0: none.
Played play(const Bundle& bundle, palpate_deformation_model model, int places, int every) {
  palpate_scene_def def = palpate_default_scene_def();
  def.collision = PALPATE_COLLISION_OFF, def.deformation = model, def.max_points = 1;
  def.force_slew = def.force_limit = INFINITY, def.max_operations = INT64_MAX;
  palpate_error error = {};
  Scene scene = Scene::create(bundle, def, &error);
  if (!scene) throw std::runtime_error(error.text);
  Contacts contacts = scene.make_contacts();
  const palpate_bundle_info info = bundle.describe();
  const double* const nodes = palpate_bundle_nodes(bundle.get());
  const std::int32_t* const triangles = palpate_bundle_triangles(bundle.get());
  Eigen::VectorXf field(3 * info.surface_node_count);
  palpate_shape_out shape = palpate_default_shape_out();
  shape.displacements = field.data(), shape.node_capacity = info.surface_node_count;
  Played played;
  for (int place = 0, triangle = 0; place < places; ++place, triangle += info.triangle_count / places) {
    palpate_grip grip = palpate_default_grip();
    grip.kind = PALPATE_GRIP_SURFACE_POINT, grip.triangle = triangle;
    Vector3d corner[3];
    for (int v = 0; v < 3; ++v)
      grip.barycentric[v] = 1.0 / 3, corner[v] = Vector3d(nodes + 3 * triangles[3 * triangle + v]);
    const Vector3d inward = (corner[2] - corner[0]).cross(corner[1] - corner[0]).normalized(),
                   across = (corner[1] - corner[0]).normalized();
    palpate_tool tool = palpate_default_tool();
    tool.grips = &grip, tool.grip_count = 1, tool.disc_radius = 0.010;
    scene.reset();
    for (int step = 0; step <= kPush + kDrag + kBack; ++step) {
      const Vector3d to = displacement(step, inward, across);
      std::copy(to.data(), to.data() + 3, grip.displacement);
      const double begun = now();
      const unsigned flags = scene.touch(&tool, 1, 0.001, contacts);
      const double touched = now();
      if (step > 0) played.touch.push_back(1e6 * (touched - begun));
      for (double taken = 0; every > 0 && step % every == 0 && taken < 1e3 * every;) {
        const double start = now();
        if (scene.deform() <= 0) break;
        played.deform.push_back(1e6 * (now() - start)), taken += played.deform.back();
      }
      played.behind.push_back((flags & PALPATE_STEP_DEFORMATION_BEHIND) != 0);
      played.force.push_back(Vector3d(palpate_contacts_tool(contacts.get(), 0)->force_raw));
      if (step % 25 != 0) continue;
      scene.shape(contacts, shape);
      played.field.push_back(field);
    }
  }
  return played;
}

// Shares of errors of the steps with at least a fifth of the place's largest force.
void print(const char* name, const Played& played, const Played& exact, int places) {
  const std::size_t steps = exact.force.size() / static_cast<std::size_t>(places);
  std::vector<double> force, trusted, field;
  for (std::size_t i = 0; i < exact.force.size(); ++i) {
    double most = 0;
    for (std::size_t k = i / steps * steps; k < i / steps * steps + steps; ++k)
      most = std::max(most, exact.force[k].norm());
    if (exact.force[i].norm() < 0.2 * most) continue;
    force.push_back(100 * (played.force[i] - exact.force[i]).norm() / exact.force[i].norm());
    if (!played.behind[i]) trusted.push_back(force.back());
  }
  for (std::size_t i = 0; i < exact.field.size(); ++i)
    if (exact.field[i].norm() > 0)
      field.push_back(100 * static_cast<double>((played.field[i] - exact.field[i]).norm() / exact.field[i].norm()));
  fmt::print(
      "{:<18} {:>6.1f} {:>7.1f} {:>7.1f} | {:>7.0f} {:>7.0f} | {:>6.2f} {:>6.2f} {:>6.2f} | {:>5.1f} {:>6.2f} | "
      "{:>6.2f} {:>6.2f}\n",
      name, at_share(played.touch, 0.5), at_share(played.touch, 0.999), at_share(played.touch, 1),
      at_share(played.deform, 0.5), at_share(played.deform, 1), at_share(force, 0.5), at_share(force, 0.99),
      at_share(force, 1), 100.0 * static_cast<double>(trusted.size()) / static_cast<double>(force.size()),
      at_share(trusted, 1), at_share(field, 0.5), at_share(field, 1));
}

int run(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "usage: beside_bench BUNDLE.h5 [places]\n");
    return 2;
  }
  const int places = argc > 2 ? std::max(1, std::atoi(argv[2])) : 20;
  palpate_error error = {};
  const Bundle bundle = Bundle::open_file(argv[1], &error);
  if (!bundle) throw std::runtime_error(error.text);
  fmt::print("{} vertices, {} places\n", bundle.describe().node_count, places);
  fmt::print("{:<18} {:>22} | {:>15} | {:>20} | {:>12} | {:>13}\n", "",
             "touch, us:", "solve, us:", "force error, %:", "trusted:", "field, %:");
  fmt::print("{:<18} {:>6} {:>7} {:>7} | {:>7} {:>7} | {:>6} {:>6} {:>6} | {:>5} {:>6} | {:>6} {:>6}\n", "", "median",
             "99.9 %", "worst", "median", "worst", "median", "99 %", "worst", "share", "worst", "median", "worst");
  const Played exact = play(bundle, PALPATE_DEFORMATION_LARGE, places, 0);
  print("large", exact, exact, places);
  print("linear", play(bundle, PALPATE_DEFORMATION_LINEAR, places, 0), exact, places);
  for (const auto& [name, model] :
       {std::pair("beside", PALPATE_DEFORMATION_LARGE_BESIDE), std::pair("renewed", PALPATE_DEFORMATION_LARGE_RENEWED)})
    for (const int every : {2, 5, 10, 20, 40})
      print(fmt::format("{}, {} ms", name, every).c_str(), play(bundle, model, places, every), exact, places);
  return 0;
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  try {
    return palpate::run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "beside_bench: {}\n", error.what());
    return 1;
  }
}
