// Random scenes of large deformation in all its forms, with all laws and contact models: tools that press, drag, jump, part and come back.
// Each is held against Newton's method at the same targets, against the work of its contacts, and against rest after its tools have left.
// fuzz_test plays some, large_fuzz as many as it is asked for.
#pragma once

#include <palpate/palpate_scene_def.hpp>

#include <fmt/format.h>

#include <memory>
#include <random>
#include <string>

#include "runtime/large/deforming_body.h"
#include "runtime/large/effect.h"
#include "runtime/scene/scene.h"
#include "tests/runtime/large/energy_account.h"
#include "tests/runtime/large/large_scene.h"

namespace palpate::tests {

// What the random scenes have shown so far.
struct LargeFinds {
  long steps = 0, flagged = 0, pressed = 0, compared = 0, trusted = 0, without_reference = 0, letting_go = 0,
       scenes = 0, found = 0;
  double worst_force = 0, worst_field = 0, worst_trusted_force = 0, worst_gain = 0;
};

class RandomLargeScenes {
 public:
  // No raw force may exceed this many times Newton's, but a solution beside the touch that is flagged and lets go of a larger force, as where the
  // body snaps through: the force falls from solve to solve, and after kLetsGo solves in a row it is within the bound.
  static constexpr double kMostForce = 3;
  static constexpr int kLetsGo = 8;
  // A step without a flag is within these shares of Newton's field and force: three times what kUnfinished leaves of the energy's norm, which
  // is the field's; a force misses more where the tool lies at the edge of its friction.
  static constexpr double kTrustedField = 0.1, kTrustedForce = 0.25;
  // Energy that no work explains. The work of a step is that of the mean of two forces: a tool that jumps, and a contact that goes on to
  // the next node, have others between.
  static constexpr double kMostGain = 0.5;

  // told(sentence): of each find.
  template <class Told>
  void play(std::uint64_t seed, int steps, LargeFinds* finds, const Told& told) const {
    std::mt19937_64 random(seed * 7919 + 13);
    const auto part = [&](double low, double high) {
      return low + (high - low) * std::uniform_real_distribution<double>(0, 1)(random);
    };
    const auto one_of = [&](int count) { return static_cast<int>(random() % static_cast<std::uint64_t>(count)); };
    const Body& body =
        seed % 4 == 2 ? body_of(kFirstBodies + random() % (kBodies - kFirstBodies)) : body_of(random() % kFirstBodies);
    SceneDef def;
    def.large.deformation = static_cast<palpate_deformation_model>(PALPATE_DEFORMATION_LARGE + one_of(3));
    def.law = static_cast<palpate_contact_law>(one_of(4)), def.contact = static_cast<palpate_contact_model>(one_of(4));
    def.collision = one_of(2) ? PALPATE_COLLISION_REST : PALPATE_COLLISION_DEFORMED;
    def.shape = PALPATE_SHAPE_VOLUME;
    const std::int64_t operations[] = {60'000, 300'000, 3'000'000, 1'000'000'000};
    def.max_operations = operations[one_of(4)];
    const int tools = 1 + one_of(3), solve_every = 1 + one_of(10);
    const std::string scene_name = fmt::format(
        "seed {} ({} steps): deformation {}, law {}, contact {}, collision {}, {} operations, {} tools, a solve every "
        "{}: {}",
        seed, steps, static_cast<int>(def.large.deformation), static_cast<int>(def.law), static_cast<int>(def.contact),
        static_cast<int>(def.collision), def.max_operations, tools, solve_every, body.name);
    std::vector<Path> paths;
    for (int t = 0; t < tools; ++t) {
      Path path;
      path.friction = one_of(4) == 0 ? 0 : part(0, 1), path.radius = part(0.002, 0.01);
      const auto& triangles = body.touched.body.triangles;
      int triangle = one_of(static_cast<int>(triangles.size()));
      while (body.touched.place(triangle, Eigen::Vector3d::Constant(1.0 / 3))[0] < 0.015)
        triangle = one_of(static_cast<int>(triangles.size()));
      path.from = body.touched.place(triangle, {0.4, 0.3, 0.3}), path.outward = body.touched.outward(triangle);
      path.points.push_back(path.from + 0.003 * path.outward);
      int step = one_of(30);
      path.at.push_back(step);
      while (step < steps) {
        const double depth = one_of(5) == 0 ? -0.005 : part(0.001, 0.6) * body.thickness;
        const Eigen::Vector3d side(part(-1, 1), part(-1, 1), part(-1, 1));
        const Eigen::Vector3d to =
            path.from - depth * path.outward + part(0, 0.012) * (side - side.dot(path.outward) * path.outward);
        const double speed = one_of(12) == 0 ? 5 : part(0.01, 0.25);  // m/s; a jump
        const int took = std::max(1, static_cast<int>((to - path.points.back()).norm() / speed / 1e-3));
        path.points.push_back(to), path.at.push_back(step += took);
        if (one_of(3) == 0) path.points.push_back(to), path.at.push_back(step += 20 + one_of(40));  // stands still
      }
      paths.push_back(path);
    }
    const std::uint64_t leaves = random() % static_cast<std::uint64_t>(steps + 1);  // the first tool, for some steps
    ++finds->scenes;
    Watched watched(body, def, solve_every, scene_name);
    for (int k = 0; k < steps; ++k) {
      std::vector<palpate_tool> sent;
      std::vector<Eigen::Vector3d> points;
      points.reserve(paths.size());
      for (int t = 0; t < tools; ++t) {
        if (t == 0 && k >= static_cast<int>(leaves) && k < static_cast<int>(leaves) + 40) continue;
        const Path& path = paths[static_cast<std::size_t>(t)];
        points.push_back(path.place(k));
        palpate_tool tool = palpate_default_tool();
        tool.id = t, tool.points = points.back().data(), tool.point_count = 1;
        tool.disc_radius = path.radius, tool.friction = path.friction;
        sent.push_back(tool);
      }
      watched.step(sent, k, finds, told);
      ++finds->steps;
    }
    watched.end(finds, told);
  }

 private:
  struct Path {
    double friction = 0, radius = 0;
    Eigen::Vector3d from, outward;
    std::vector<Eigen::Vector3d> points;
    std::vector<int> at;  // the step of each
    Eigen::Vector3d place(int step) const {
      std::size_t i = 0;
      while (i + 1 < at.size() && at[i + 1] <= step) ++i;
      if (i + 1 >= at.size() || step <= at[i]) return points[i];
      return points[i] + (points[i + 1] - points[i]) * (step - at[i]) / (at[i + 1] - at[i]);
    }
  };

  struct Body {
    Body(const TinyBox& box, bool nodal, double poisson, const LawForm& form)
        : touched(with_tensors(box, nodal, poisson, form)),
          seen(touched, nodal, form, poisson),
          reference(seen.body),
          name(fmt::format("{}, nu {}, {}, {} nodes", nodal ? "p1-anp" : "p1", poisson, words_of(form),
                           touched.body.mesh.nodes.size())),
          thickness(box.size[2]) {}
    static TouchedBody with_tensors(const TinyBox& box, bool nodal, double poisson, const LawForm& form) {
      DenseBody dense = dense_box(box);
      dense.poisson = poisson;
      const TouchedBody plain(dense);
      const Seen seen(plain, nodal, 0, poisson);
      const LargeReference reference(seen.body);
      dense.stiffness = Eigen::MatrixXd(reference.tangent(Eigen::VectorXd::Zero(reference.dofs())));
      return TouchedBody(dense, with_large(nodal, form));
    }
    TouchedBody touched;
    Seen seen;
    LargeReference reference;
    std::string name;
    double thickness;
  };

  // A scene and what it is held against.
  class Watched {
   public:
    Watched(const Body& body, const SceneDef& def, int solve_every, const std::string& name)
        : body_(body),
          name_(name),
          scene_(body.touched.scene(def)),
          contacts_(scene_.get()),
          solve_every_(solve_every) {
      beside_ = def.large.deformation != PALPATE_DEFORMATION_LARGE;
      count_ = static_cast<std::int32_t>(body.touched.body.mesh.nodes.size());
      const Eigen::VectorXd rest = Eigen::VectorXd::Zero(3 * count_);
      account_.add(0, rest, rest);
    }

    template <class Told>
    void step(const std::vector<palpate_tool>& tools, int k, LargeFinds* finds, const Told& told) {
      const palpate_step_flags flags =
          palpate_scene_touch(scene_.get(), tools.data(), static_cast<std::int32_t>(tools.size()), 1e-3,
                              contacts_.get(), contacts_.bytes());
      const bool solved = !beside_ || (k % solve_every_ == 0 && palpate_scene_deform(scene_.get()) > 0);
      const bool behind = flags & (PALPATE_STEP_DEFORMATION_BEHIND | PALPATE_STEP_UNSOLVED);
      finds->flagged += behind;
      double raw = 0;
      for (std::size_t t = 0; t < tools.size(); ++t)
        raw = std::max(
            raw, Eigen::Vector3d(palpate_contacts_tool(contacts_, static_cast<std::int32_t>(t))->force_raw).norm());
      finds->pressed += raw > 0;
      if (!std::isfinite(raw)) return find(k, "a force that is not finite", finds, told);
      if (!solved) return;
      const DeformingBody& body = deforming_body_of(*scene_.get());
      Eigen::VectorXd u(3 * count_), f = Eigen::VectorXd::Zero(3 * count_), of_energy;
      for (std::int32_t n = 0; n < count_; ++n) {
        const Vec3 at = body.displacement(n);
        u.segment<3>(3 * n) = Eigen::Vector3d(at.x, at.y, at.z);
      }
      const LargeContacts rows = body.last_rows();
      // Those that the state has: a tool that jumps feels none where the state is far from its solution.
      for (std::int32_t r = 0; r < rows.row_count; ++r)
        for (std::int32_t e = 0; e < rows.rows[r].count; ++e)
          for (int i = 0; i < 3; ++i)
            f[3 * rows.nodes[rows.rows[r].first + e] + i] +=
                body.solver().carried()[r] * rows.weights[rows.rows[r].first + e] * rows.rows[r].direction[i];
      const double energy = body_.reference.energy(u, &of_energy);
      account_.add(energy, f, u);
      // Between two solutions beside the touch are several steps, of which their forces do not tell the work.
      if (!beside_) finds->worst_gain = std::max(finds->worst_gain, account_.gained());
      if (!beside_ && account_.gained() > kMostGain && !told_gain_) {
        told_gain_ = true;
        find(k, fmt::format("{:.1f} % of the energy came without work", 100 * account_.gained()), finds, told);
      }
      // Newton's method takes longer than a step: at some steps, and where a force is larger than all before.
      double total = 0;
      for (std::int32_t r = 0; r < rows.row_count; ++r) total = std::max(total, std::abs(body.row_forces()[r]));
      if (total <= 1e-6) return;
      const bool peak = total > 1.5 * peak_;
      if (peak) peak_ = total;
      if (peak || k % 23 == 0 || exceeds_ > 0) compare(k, behind, u, finds, told);
      last_ = forces_of(rows.row_count);
    }

    // Without tools the body is at rest after kStepsToRest steps.
    template <class Told>
    void end(LargeFinds* finds, const Told& told) {
      for (int k = 0; k <= LargeSolver::kStepsToRest + 1; ++k) {
        palpate_scene_touch(scene_.get(), nullptr, 0, 1e-3, contacts_.get(), contacts_.bytes());
        if (beside_) palpate_scene_deform(scene_.get());
      }
      const palpate_step_flags flags =
          palpate_scene_touch(scene_.get(), nullptr, 0, 1e-3, contacts_.get(), contacts_.bytes());
      const auto u = displacements(scene_.get(), contacts_, count_);
      const bool rests = std::all_of(u.begin(), u.end(), [](float v) { return v == 0; });
      if (!rests || flags != 0)
        find(-1, fmt::format("not at rest after its tools have left, flags {:x}", flags), finds, told);
    }

   private:
    // N, of all rows of the last solve.
    double forces_of(std::int32_t rows) const {
      return Eigen::Map<const Eigen::VectorXd>(deforming_body_of(*scene_.get()).row_forces(), rows).norm();
    }

    template <class Told>
    void find(int k, const std::string& what, LargeFinds* finds, const Told& told) {
      ++finds->found;
      told(fmt::format("{}; step {}: {}", name_, k, what));
    }

    // At the places of the rows that hold, with no force on the others.
    template <class Told>
    void compare(int k, bool behind, const Eigen::VectorXd& u, LargeFinds* finds, const Told& told) {
      const auto [w, c, target, carried, load] = held_rows(deforming_body_of(*scene_.get()), count_);
      if (target.size() == 0) return;
      Eigen::VectorXd exact, force;
      bool known = false;
      // From the state itself, where it is sound; else from rest in steps.
      for (const int moves : {1, 8}) {
        exact = moves == 1 ? u : Eigen::VectorXd(Eigen::VectorXd::Zero(3 * count_));
        try {
          for (int i = 1; i <= moves; ++i) force = body_.reference.solve(w, target * i / moves, &exact, 1e-7, c);
          known = true;
        } catch (const std::runtime_error&) {
        }
        if (known) break;
      }
      if (!known) return void(++finds->without_reference);
      ++finds->compared;
      // Beside the touch the forces of a solution, which says that it is behind while it lets go of a larger one.
      const double ratio = carried.norm() / std::max(force.norm(), beside_ ? 0.1 * peak_ : 0.001 * peak_);
      finds->worst_force = std::max(finds->worst_force, ratio);
      exceeds_ = ratio > kMostForce ? exceeds_ + 1 : 0;
      const bool lets_go = beside_ && behind &&
                           forces_of(deforming_body_of(*scene_.get()).last_rows().row_count) < last_ &&
                           exceeds_ <= kLetsGo;
      finds->letting_go += exceeds_ > 0 && lets_go;
      if (exceeds_ > 0 && !lets_go)
        find(k,
             fmt::format("{:.3g} N, where Newton's method has {:.3g} N{}", carried.norm(), force.norm(),
                         behind ? " (flagged)" : ""),
             finds, told);
      if (behind || beside_) return;
      ++finds->trusted;
      const double field = (u - exact).norm() / std::max(exact.norm(), 1e-6),
                   missed = (carried - force).norm() / force.norm();
      finds->worst_field = std::max(finds->worst_field, field);
      finds->worst_trusted_force = std::max(finds->worst_trusted_force, missed);
      if (field > kTrustedField || missed > kTrustedForce)
        find(k,
             fmt::format("without a flag {:.1f} % off in the field, {:.1f} % in the force of {:.3g} N", 100 * field,
                         100 * missed, force.norm()),
             finds, told);
    }

    const Body& body_;
    const std::string name_;
    ScenePointer scene_;
    Contacts contacts_;
    EnergyAccount account_;
    std::int32_t count_ = 0;
    int solve_every_ = 1;
    double peak_ = 0, last_ = 0;  // N
    int exceeds_ = 0;             // solves in a row, now, with more than kMostForce
    bool beside_ = false, told_gain_ = false;
  };

  // Seeds of the form 4 n + 2 play Yeoh's and Ogden's laws, the others the first two laws.
  static constexpr std::size_t kFirstBodies = 20, kBodies = 44;
  const Body& body_of(std::size_t which) const {
    std::unique_ptr<Body>& body = bodies_[which];
    const struct {
      double poisson;
      LawForm form;
    } tissues[] = {{0.3, 0},
                   {0.45, 0},
                   {0.49, 0},
                   {0.45, 3},
                   {0.45, 32},
                   {0.45, LawForm::yeoh(-300, 400)},
                   {0.49, LawForm::yeoh(2000, 0)},
                   {0.45, LawForm::yeoh(-5000, 1e6)},
                   {0.49, LawForm::ogden(4.5)},
                   {0.45, LawForm::ogden(-5, 0.3, 20)},
                   {0.45, LawForm::ogden(50)}};
    const auto& [poisson, form] = tissues[which / 4];
    const TinyBox box = which & 1 ? TinyBox{{8, 2, 2}, {0.1, 0.02, 0.02}} : TinyBox{};
    if (!body) body = std::make_unique<Body>(box, (which & 2) != 0, poisson, form);
    return *body;
  }
  mutable std::unique_ptr<Body> bodies_[kBodies];  // made when a scene asks for one
};

}  // namespace palpate::tests
