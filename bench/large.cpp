// large_bench MESH.msh organ.toml bc.toml [places]: a step under large deformation, against one step of Newton's method with CHOLMOD,
// and a solve with the factor against a plain read of the same bytes. Discs of 10 mm radius move in by 20 mm at 100 mm/s.
// large_bench BUNDLE.h5: touch and shape of a scene, linear and large, on the same path.

#include <fmt/format.h>

#include <Eigen/CholmodSupport>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <numeric>
#include <vector>

#include "precompute/elements/linear_tetrahedra.h"
#include "precompute/solver/elimination.h"
#include "runtime/include/palpate/palpate.h"
#include "runtime/large/large_solver.h"
#include "studies/hyperelastic/large_body.h"
#include "studies/hyperelastic/large_reference.h"

namespace palpate {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}
double processor_seconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}
double at_share(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}
template <class Work>
double median_microseconds(int rounds, Work work) {
  std::vector<double> times;
  for (int i = 0; i < rounds; ++i) {
    const double begun = now();
    work();
    times.push_back(1e6 * (now() - begun));
  }
  return at_share(times, 0.5);
}

// The nodes within 10 mm of a surface node, and the inward direction there.
struct Disc {
  std::vector<std::int32_t> nodes;
  Vector3d inward;
};
Disc disc_at(const ElasticBody& body, std::int32_t node) {
  Disc disc;
  const Vector3d centre(body.nodes[node].data());
  for (std::int32_t n = 0; n < body.surface_count; ++n)
    if ((Vector3d(body.nodes[n].data()) - centre).norm() <= 0.010) disc.nodes.push_back(n);
  Vector3d outward = Vector3d::Zero();
  for (const auto& t : body.triangles) {
    if (t[0] != node && t[1] != node && t[2] != node) continue;
    const Vector3d a(body.nodes[t[0]].data()), b(body.nodes[t[1]].data()), c(body.nodes[t[2]].data());
    outward += (b - a).cross(c - a);
  }
  disc.inward = -outward.normalized();
  return disc;
}

// A disc of 10 mm radius at some triangles of a bundle moves in by 20 mm at 100 mm/s.
struct TouchTimes {
  std::vector<double> touch, shape;  // us
  double force = 0;                  // N, on the last disc in the end
  int behind = 0;                    // steps that raised DEFORMATION_BEHIND
};
TouchTimes time_touches(palpate_bundle* bundle, palpate_deformation_model deformation) {
  palpate_scene_def def = palpate_default_scene_def();
  def.collision = PALPATE_COLLISION_OFF, def.deformation = deformation, def.max_points = 1;
  def.force_slew = def.force_limit = INFINITY;
  palpate_scene* scene = nullptr;
  palpate_error error = {};
  if (palpate_scene_create(bundle, &def, &scene, &error) != PALPATE_OK) throw std::runtime_error(error.text);
  const palpate_bundle_info info = palpate_bundle_describe(bundle);
  const double* const nodes = palpate_bundle_nodes(bundle);
  const std::int32_t* const triangles = palpate_bundle_triangles(bundle);
  std::vector<std::uint64_t> contacts(palpate_contacts_bytes(scene) / 8 + 1);
  auto* const out = reinterpret_cast<palpate_contacts*>(contacts.data());
  std::vector<float> positions(3 * static_cast<std::size_t>(info.surface_node_count));
  palpate_shape_out shape = palpate_default_shape_out();
  shape.positions = positions.data(), shape.node_capacity = info.surface_node_count;
  TouchTimes times;
  for (int place = 0; place < 6; ++place) {
    palpate_grip grip = palpate_default_grip();
    grip.kind = PALPATE_GRIP_SURFACE_POINT, grip.triangle = place * (info.triangle_count / 6);
    Vector3d corner[3];
    for (int v = 0; v < 3; ++v)
      grip.barycentric[v] = 1.0 / 3, corner[v] = Vector3d(nodes + 3 * triangles[3 * grip.triangle + v]);
    const Vector3d inward = (corner[2] - corner[0]).cross(corner[1] - corner[0]).normalized();
    palpate_tool tool = palpate_default_tool();
    tool.grips = &grip, tool.grip_count = 1, tool.disc_radius = 0.010;
    palpate_scene_reset(scene);
    for (int tick = 0; tick <= 200; ++tick) {
      for (int i = 0; i < 3; ++i) grip.displacement[i] = 1e-4 * tick * inward[i];
      const double begun = now();
      const unsigned flags = palpate_scene_touch(scene, &tool, 1, 0.001, out, 8 * contacts.size());
      const double touched = now();
      palpate_scene_shape(scene, out, &shape);
      if (tick == 0) continue;  // the contact's rows
      times.touch.push_back(1e6 * (touched - begun)), times.shape.push_back(1e6 * (now() - touched));
      times.behind += (flags & PALPATE_STEP_DEFORMATION_BEHIND) != 0;
    }
    times.force = Eigen::Map<const Vector3d>(palpate_contacts_tool(out, 0)->force_raw).norm();
  }
  palpate_scene_destroy(scene);
  return times;
}

int compare_touches(const char* file) {
  palpate_bundle* bundle = nullptr;
  palpate_error error = {};
  if (palpate_bundle_open_file(file, nullptr, &bundle, &error) != PALPATE_OK) throw std::runtime_error(error.text);
  const TouchTimes linear = time_touches(bundle, PALPATE_DEFORMATION_LINEAR),
                   large = time_touches(bundle, PALPATE_DEFORMATION_LARGE);
  for (const auto& [name, times] : {std::pair("linear", &linear), std::pair("large", &large)})
    fmt::print(
        "{:6}  touch: median {:.1f} us, 99 % {:.1f}, worst {:.1f}; shape: median {:.1f} us; force {:.3f} N; behind in "
        "{} steps of {}\n",
        name, at_share(times->touch, 0.5), at_share(times->touch, 0.99), at_share(times->touch, 1),
        at_share(times->shape, 0.5), times->force, times->behind, times->touch.size());
  fmt::print("large / linear: touch {:.0f}, shape {:.2f}\n", at_share(large.touch, 0.5) / at_share(linear.touch, 0.5),
             at_share(large.shape, 0.5) / at_share(linear.shape, 0.5));
  palpate_bundle_close(bundle);
  return 0;
}

// A solve reads the factor twice. Turn by turn with plain reads of as many bytes, because both depend on what else the machine does;
// in time of the processor.
template <class Solve>
void compare_with_reading(const char* name, double bytes, const Solve& solve_once) {
  const std::vector<float> copied(static_cast<std::size_t>(bytes / sizeof(float)), 1.0f);
  float sum = 0;
  std::vector<double> solves, reads;
  for (int round = 0; round < 100; ++round) {
    const double begun = processor_seconds();
    solve_once();
    const double solved = processor_seconds();
    for (int twice = 0; twice < 2; ++twice) {
      float part[64] = {};
      for (std::size_t i = 0; i + 64 <= copied.size(); i += 64)
        for (std::size_t k = 0; k < 64; ++k) part[k] += copied[i + k];
      sum += part[0];
    }
    solves.push_back(1e6 * (solved - begun)), reads.push_back(1e6 * (processor_seconds() - solved));
  }
  const double solve = at_share(solves, 0.5), read = at_share(reads, 0.5);
  fmt::print(
      "{} {:.0f} us (least {:.0f}), {:.1f} GB/s; reading its bytes twice {:.0f} us (least {:.0f}), {:.1f} GB/s: {:.2f} "
      "times as long as the reading{}\n",
      name, solve, at_share(solves, 0), 2e-3 * bytes / solve, read, at_share(reads, 0), 2e-3 * bytes / read,
      solve / read, sum > 0 ? "" : "!");
}

int run(int argc, char** argv) {
  if (argc == 2) return compare_touches(argv[1]);
  if (argc < 4) {
    fmt::print(stderr, "usage: large_bench MESH.msh organ.toml bc.toml [places], or: large_bench BUNDLE.h5\n");
    return 2;
  }
  const int places = argc > 4 ? std::atoi(argv[4]) : 6;
  const OrganConfig organ = read_organ_config(argv[2]);
  const ElasticBody elastic =
      make_elastic_body(read_mesh(argv[1]), organ, read_boundary_config(argv[3]), {argv[1], argv[2], argv[3]});
  const bool nodal = organ.element == Element::p1_anp;
  const LargeBody body(elastic, nodal);
  const HeldStiffness held =
      remove_held_dofs(nodal ? nodal_dilatation_stiffness(elastic) : linear_stiffness(elastic), elastic.fixed);
  const Elimination elimination = analyse_elimination(held.matrix);
  std::vector<std::int32_t> order;
  for (const auto row : elimination.order) order.push_back(held.node_of_row[row]);
  SceneMemory memory{palpate_allocator{}};
  LargeSolver solver;
  const double begun = processor_seconds();
  if (solver.create(memory, body.get(), order.data(), static_cast<std::int32_t>(order.size()), 3, 3000) !=
      LargeSolver::Created::made)
    throw std::runtime_error("the stiffness has no factor");
  const double created = processor_seconds() - begun;
  const double factor_megabytes = 4e-6 * static_cast<double>(solver.factor().numbers());
  fmt::print("{} vertices, {} tetrahedra, {}; created in {:.2f} s of processor, factor {:.2f} MB, all {:.1f} MB\n",
             elastic.nodes.size(), elastic.tetrahedra.size(), name_of(organ.element), created, factor_megabytes,
             1e-6 * static_cast<double>(memory.bytes()));

  const double evaluation = median_microseconds(200, [&] { solver.evaluate_once(); });
  const auto numbers = static_cast<double>(solver.factor().numbers());
  fmt::print("evaluation {:.0f} us\n", evaluation);
  compare_with_reading("back-substitution with 32 bits", 4 * numbers, [&] { solver.solve_once(false); });
  if (solver.factor().has_rough_copy())
    compare_with_reading("with 16 bits", 2 * numbers, [&] { solver.solve_once(true); });

  if (places < 1) return memory.release_all(), 0;

  std::vector<double> microseconds, evaluations, field_errors, force_errors;
  double newton = 0;
  const LargeReference reference(body.get());
  for (int place = 0; place < places; ++place) {
    const auto node =
        elastic
            .touchable[static_cast<std::size_t>(place) * elastic.touchable.size() / static_cast<std::size_t>(places)];
    const Disc disc = disc_at(elastic, node);
    solver.forget();
    std::vector<LargeRow> rows(3);
    std::vector<double> weights(disc.nodes.size(), 1.0 / static_cast<double>(disc.nodes.size()));
    double force[3];
    for (int tick = 0; tick <= 200; ++tick) {
      for (int i = 0; i < 3; ++i) {
        rows[i] = LargeRow{};
        rows[i].count = static_cast<std::int32_t>(disc.nodes.size());
        rows[i].direction[i] = 1, rows[i].target = 1e-4 * tick * disc.inward[i];
      }
      const double start = now();
      const LargeOutcome outcome =
          solver.step({rows.data(), disc.nodes.data(), weights.data(), 3}, LargeSolver::kMostSteps, force);
      if (tick == 0) continue;  // the rows' responses
      microseconds.push_back(1e6 * (now() - start));
      evaluations.push_back(outcome.evaluations);
    }
    VectorXd u(3 * static_cast<Eigen::Index>(elastic.nodes.size()));
    for (std::int32_t n = 0; n < body.get().node_count; ++n) {
      float v[3];
      solver.displacement(n, v);
      for (int i = 0; i < 3; ++i) u[3 * n + i] = static_cast<double>(v[i]);
    }
    if (place == 0) {
      // One step of Newton's method: tangent, factor, four back-substitutions.
      std::vector<Eigen::Index> free;
      for (Eigen::Index i = 0; i < u.size(); ++i)
        if (!body.get().fixed[i]) free.push_back(i);
      const double start = now();
      const Eigen::SparseMatrix<double> all = reference.tangent(u);
      Eigen::SparseMatrix<double> pick(static_cast<Eigen::Index>(free.size()), u.size());
      for (std::size_t i = 0; i < free.size(); ++i) pick.insert(static_cast<Eigen::Index>(i), free[i]) = 1;
      Eigen::CholmodSupernodalLLT<Eigen::SparseMatrix<double>> factor;
      factor.compute(Eigen::SparseMatrix<double>(pick * all * pick.transpose()));
      const Eigen::MatrixXd answer = factor.solve(Eigen::MatrixXd::Ones(static_cast<Eigen::Index>(free.size()), 4));
      newton = 1e6 * (now() - start);
    }
    Eigen::MatrixXd w = Eigen::MatrixXd::Zero(3, u.size());
    for (const auto n : disc.nodes)
      for (int i = 0; i < 3; ++i) w(i, 3 * n + i) = weights[0];
    const VectorXd found = u;
    const VectorXd exact = reference.solve(w, 0.02 * disc.inward, &u);
    field_errors.push_back((found - u).norm() / u.norm());
    force_errors.push_back((Eigen::Map<Vector3d>(force) - exact).norm() / exact.norm());
  }
  const double median = at_share(microseconds, 0.5);
  fmt::print("step: median {:.0f} us, 99 % {:.0f} us, worst {:.0f} us; {:.2f} evaluations, at most {:.0f}\n", median,
             at_share(microseconds, 0.99), at_share(microseconds, 1),
             std::accumulate(evaluations.begin(), evaluations.end(), 0.0) / static_cast<double>(evaluations.size()),
             at_share(evaluations, 1));
  fmt::print("one Newton step {:.0f} us: {:.0f} times the step\n", newton, newton / median);
  fmt::print(
      "at 20 mm against Newton's method to the end: field {:.2f} % median, {:.2f} % worst; force {:.2f} %, {:.2f} %\n",
      100 * at_share(field_errors, 0.5), 100 * at_share(field_errors, 1), 100 * at_share(force_errors, 0.5),
      100 * at_share(force_errors, 1));
  memory.release_all();
  return 0;
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  try {
    return palpate::run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "large_bench: {}\n", error.what());
    return 1;
  }
}
