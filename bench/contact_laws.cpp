// Plays indenters of 1 to 64 points under the contact laws, records the contact problems that the factor alone does not solve,
// and solves each with LawSolver and with Gauss-Seidel alone, from the same start and with the same limit of operations. Tells, too, in
// how many of the steps that laws decided they were missed under the default max_operations.
//
//   contact_laws_bench BUNDLE.h5
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <random>
#include <vector>

#include "runtime/scene/scene.h"

namespace {

constexpr std::int64_t kMostOperations = 4'000'000;  // multiply-adds of a solution, about a millisecond

using palpate::Vec3;

// A contact problem, in memory of its own.
struct Problem {
  explicit Problem(const palpate::ContactSolver& solver) {
    const palpate::ContactSystem from = solver.last_system();
    const std::size_t rows = static_cast<std::size_t>(from.rows_end);
    matrix.resize(rows * rows), soft.resize(rows), target.resize(rows), start.resize(rows);
    constraints.assign(from.constraints, from.constraints + from.constraint_count);
    rows_of.assign(from.rows, from.rows + from.constraint_count);
    std::vector<std::int32_t> used;
    for (const auto& of_one : rows_of)
      for (const std::int32_t row : of_one.at)
        if (row >= 0) used.push_back(row);
    for (const std::int32_t row : used) {
      const std::size_t i = static_cast<std::size_t>(row);
      for (const std::int32_t column : used)
        matrix[i * rows + static_cast<std::size_t>(column)] =
            from.matrix[i * from.stride + static_cast<std::size_t>(column)];
      soft[i] = from.soft[row], target[i] = from.target[row], start[i] = solver.last_start()[row];
      largest = std::max(largest, std::fabs(target[i]));
    }
    if (!from.shared) return;
    shared = std::make_unique<palpate::SharedNodes>();
    if (!shared->create(memory, from.shared->contact_nodes())) std::exit(1);
    shared->copy(*from.shared);
  }
  Problem(const Problem&) = delete;
  ~Problem() { memory.release_all(); }
  palpate::ContactSystem system() const {
    palpate::ContactSystem system;
    system.matrix = matrix.data(), system.stride = soft.size(),
    system.rows_end = static_cast<std::int32_t>(soft.size());
    system.soft = soft.data(), system.target = target.data(), system.constraints = constraints.data();
    system.rows = rows_of.data(), system.constraint_count = static_cast<std::int32_t>(constraints.size());
    system.shared = shared.get();
    return system;
  }
  std::vector<double> matrix, soft, target, start;
  std::vector<palpate::ContactConstraint> constraints;
  std::vector<palpate::RowsOfConstraint> rows_of;
  double largest = 0;
  palpate::SceneMemory memory{palpate_allocator{}};
  std::unique_ptr<palpate::SharedNodes> shared;  // where the nodes of the contacts are few
};

struct Case {
  const char* name;
  palpate_contact_model contact;
  palpate_contact_law law;
  double friction, disc_radius;
};
constexpr Case kCases[] = {
    {"patch, friction 0.3", PALPATE_CONTACT_PATCH, PALPATE_LAW_COULOMB, 0.3, 0.003},
    {"patch, friction 20", PALPATE_CONTACT_PATCH, PALPATE_LAW_COULOMB, 20, 0.003},
    {"patch, unilateral", PALPATE_CONTACT_PATCH, PALPATE_LAW_UNILATERAL, 0, 0.003},
    {"point, friction 0.3", PALPATE_CONTACT_POINT, PALPATE_LAW_COULOMB, 0.3, 0},
    {"triangle, friction 0.3", PALPATE_CONTACT_TRIANGLE, PALPATE_LAW_COULOMB, 0.3, 0},
    {"triangle, friction 20", PALPATE_CONTACT_TRIANGLE, PALPATE_LAW_COULOMB, 20, 0},
};

struct Place {
  Vec3 at, out;
};
Place touchable_place(const palpate_bundle* bundle, std::mt19937& random) {
  const palpate_bundle_info info = palpate_bundle_describe(bundle);
  const double* nodes = palpate_bundle_nodes(bundle);
  const std::int32_t* triangles = palpate_bundle_triangles(bundle);
  const std::int32_t node = palpate_bundle_touchable(bundle)[random() % static_cast<unsigned>(info.touchable_count)];
  Vec3 out;
  for (std::int32_t f = 0; f < info.triangle_count; ++f) {
    const std::int32_t* t = triangles + 3 * f;
    if (t[0] != node && t[1] != node && t[2] != node) continue;
    const auto corner = [&](int k) { return palpate::load3(nodes + 3 * static_cast<std::size_t>(t[k])); };
    out += palpate::cross(corner(1) - corner(0), corner(2) - corner(0));
  }
  return {palpate::load3(nodes + 3 * static_cast<std::size_t>(node)), palpate::unit_or_zero(out)};
}

struct Steps {
  int decided = 0, inexact = 0, deferred = 0;
};

// A flat indenter of `points` points, rough by 0.2 mm, is pressed 5 mm deep, dragged over 8 mm while it turns, and lifted.
void play(palpate_bundle* bundle, const Case& what, int points, std::mt19937& random,
          std::vector<std::unique_ptr<Problem>>& problems, Steps& steps) {
  constexpr int kIn = 150, kDrag = 200, kEvery = 7;
  constexpr double kDepth = 0.005, kAbove = 0.003, kAlong = 0.008, kRough = 1e-4;
  const auto any = [&] { return std::uniform_real_distribution<double>(-1, 1)(random); };
  palpate_scene_def def = palpate_default_scene_def();
  def.contact = what.contact, def.law = what.law, def.shape = PALPATE_SHAPE_OFF;
  def.force_limit = def.force_slew = INFINITY;
  palpate_scene* scene = nullptr;
  palpate_error error = {};
  if (palpate_scene_create(bundle, &def, &scene, &error) != PALPATE_OK) {
    std::fprintf(stderr, "contact_laws_bench: %s\n", error.text);
    std::exit(2);
  }
  const Place place = touchable_place(bundle, random);
  const Vec3 u = palpate::across(place.out, {1, 0.3, 0.2}), v = palpate::cross(place.out, u);
  const double reach = 0.001 + 0.002 * std::sqrt(points), heading = 3 * any();
  std::vector<Vec3> local(static_cast<std::size_t>(points)), at(local.size());
  for (int i = 0; i < points; ++i) {
    const double r = reach * std::sqrt((i + 0.5) / points), angle = 2.4 * i;
    local[i] = {r * std::cos(angle), r * std::sin(angle), kRough * any()};
  }
  std::vector<std::uint64_t> memory(palpate_contacts_bytes(scene) / 8 + 1);
  palpate_tool tool = palpate_default_tool();
  tool.points = &at[0].x, tool.point_count = points, tool.disc_radius = what.disc_radius, tool.friction = what.friction;
  for (int step = 0; step < 2 * kIn + kDrag; ++step) {
    const double in = std::min(1.0, step / double{kIn}), drag = std::clamp((step - kIn) / double{kDrag}, 0.0, 1.0),
                 up = std::max(0.0, (step - kIn - kDrag) / double{kIn});
    const double height = kAbove - (kDepth + kAbove) * (in - up), turn = 0.3 * drag;
    for (std::size_t i = 0; i < at.size(); ++i) {
      const double x = local[i].x * std::cos(turn) - local[i].y * std::sin(turn) + kAlong * drag * std::cos(heading),
                   y = local[i].x * std::sin(turn) + local[i].y * std::cos(turn) + kAlong * drag * std::sin(heading);
      at[i] = place.at + x * u + y * v + (height + local[i].z) * place.out;
    }
    auto* contacts = reinterpret_cast<palpate_contacts*>(memory.data());
    const palpate_step_flags flags = palpate_scene_touch(scene, &tool, 1, 1e-3, contacts, 8 * memory.size());
    if (contacts->sweeps == 0) continue;
    ++steps.decided;
    steps.inexact += (flags & PALPATE_STEP_SOLVE_INEXACT) != 0,
        steps.deferred += (flags & PALPATE_STEP_WORK_DEFERRED) != 0;
    if (step % kEvery == 0) problems.push_back(std::make_unique<Problem>(scene->touch.solver));
  }
  palpate_scene_destroy(scene);
}

// Of all problems of one size, by one of the two ways.
struct Figures {
  std::vector<double> us, sweeps, newton, operations, residual;
  int missed = 0;
  double median(std::vector<double>& x) {
    std::sort(x.begin(), x.end());
    return x[x.size() / 2];
  }
  double worst(const std::vector<double>& x) { return *std::max_element(x.begin(), x.end()); }
  void print(const char* way) {
    std::printf(
        "  %-12s %5.1f %% missed | us %7.1f median %7.1f worst | million operations %6.3f %6.3f | sweeps %4.0f %4.0f"
        " | newton %3.0f %3.0f | residual %.0e %.0e\n",
        way, 100.0 * missed / static_cast<double>(us.size()), median(us), worst(us), median(operations) / 1e6,
        worst(operations) / 1e6, median(sweeps), worst(sweeps), median(newton), worst(newton), median(residual),
        worst(residual));
  }
};

void solve(palpate::LawSolver& solver, const Problem& problem, bool newton, Figures& figures) {
  using Solver = palpate::ContactSolver;
  constexpr int kRepeats = 3;  // of which the fastest counts
  const palpate::ContactSystem system = problem.system();
  double us = INFINITY, missed = 0;
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    std::vector<double> reaction = problem.start;
    const auto begin = std::chrono::steady_clock::now();
    missed = newton ? solver.solve(system, 1e-10 * problem.largest, kMostOperations, reaction.data())
                    : solver.sweep(system, 1e-10 * problem.largest, kMostOperations, reaction.data());
    us = std::min(us, std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count());
  }
  figures.us.push_back(us), figures.residual.push_back(missed / problem.largest);
  figures.sweeps.push_back(solver.effort().sweeps), figures.newton.push_back(solver.effort().newton_steps);
  figures.operations.push_back(static_cast<double>(solver.effort().operations));
  figures.missed += !(missed <= Solver::kMet * problem.largest + Solver::kLeastMiss);
}

void compare(palpate_bundle* bundle, const Case& what, int points) {
  constexpr int kScenes = 4;
  std::mt19937 random(static_cast<unsigned>(points));
  std::vector<std::unique_ptr<Problem>> problems;
  Steps steps;
  for (int scene = 0; scene < kScenes; ++scene) play(bundle, what, points, random, problems, steps);
  if (problems.empty()) return;
  std::size_t most = 0, most_nodes = 0;
  for (const auto& problem : problems) {
    most = std::max(most, problem->soft.size());
    if (problem->shared) most_nodes = std::max(most_nodes, static_cast<std::size_t>(problem->shared->contact_nodes()));
  }
  palpate::SceneMemory memory{palpate_allocator{}};
  palpate::LawSolver solver;
  if (!solver.create(memory, static_cast<std::int32_t>(most), static_cast<std::int32_t>(most_nodes))) std::exit(1);
  Figures sweeps, both;
  for (const auto& problem : problems) solve(solver, *problem, false, sweeps), solve(solver, *problem, true, both);
  memory.release_all();
  std::printf("%s, %d points: of %d steps that laws decided %.2f %% missed them and %.1f %% deferred work\n", what.name,
              points, steps.decided, 100.0 * steps.inexact / steps.decided, 100.0 * steps.deferred / steps.decided);
  std::printf(
      "%s, %d points: %zu problems of up to %zu rows; time of LawSolver over Gauss-Seidel's: median %.2f, worst %.2f\n",
      what.name, points, problems.size(), most, both.median(both.us) / sweeps.median(sweeps.us),
      both.worst(both.us) / sweeps.worst(sweeps.us));
  sweeps.print("Gauss-Seidel");
  both.print("LawSolver");
}

}  // namespace

int main(int count, char** arguments) {
  palpate_bundle* bundle = nullptr;
  palpate_error error = {};
  if (count != 2) {
    std::fprintf(stderr, "usage: contact_laws_bench BUNDLE.h5\n");
    return 2;
  }
  if (palpate_bundle_open_file(arguments[1], nullptr, &bundle, &error) != PALPATE_OK) {
    std::fprintf(stderr, "contact_laws_bench: %s\n", error.text);
    return 2;
  }
  for (const Case& what : kCases)
    for (const int points : {1, 2, 4, 8, 16, 24, 32, 64}) compare(bundle, what, points);
  palpate_bundle_close(bundle);
  return 0;
}
