#include "studies/scenes/errors.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "formats/program.h"
#include "studies/coupled/grasped_rows.h"
#include "studies/scenes/costs.h"

namespace palpate::scenes {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using Eigen::VectorXd;
using studies::CoupledAnswer;
using studies::CoupledBody;
using studies::Row;
using Json = nlohmann::ordered_json;

class Errors {
 public:
  Errors(const BakedOrgan& baked, const ScenesOptions& options)
      : baked_(baked),
        options_(options),
        full_(baked.full()),
        box_(box_of(baked.body())),
        bundle_(open_bundle(baked.bundle(options.modes))),
        places_(touchable_places(baked.body(), 7)),
        first_touch_(gap_of_first_touch(bundle_.get(), box_, 1e-3 * box_.size())) {}

  std::vector<Json> run() {
    say("comparing with full solves");
    a_grip();
    a_grasp();
    motions();
    held_volume();
    clips();
    spring();
    pressed();
    needle();
    return rows_;
  }

 private:
  OrganAt alone() const { return {bundle_.get(), pose_at({0, 0, 0})}; }
  double way() const { return 0.01 * box_.size(); }

  void add(const std::string& effect, const Vector3d& force, const Vector3d& expected, const PlayedWorld& world,
           const std::vector<VectorXd>& u, int contacts) {
    double off = 0, size = 0, largest = 0;
    for (std::size_t k = 0; k < u.size(); ++k) {
      const VectorXd found = world.shape(static_cast<int>(k)), of = u[k].head(found.size());
      off += (found - of).squaredNorm(), size += of.squaredNorm();
      largest = std::max(largest, of.cwiseAbs().maxCoeff());
    }
    Json row = {{"effect", effect}, {"force_N", expected.norm()}, {"force_error", Json()}};
    if (expected.norm() > 0) row["force_error"] = (force - expected).norm() / expected.norm();
    row["field_mm"] = 1e3 * largest, row["field_error"] = std::sqrt(off / size), row["contacts"] = contacts;
    rows_.push_back(row);
  }

  // Weights of a place of an organ, along an axis of the world.
  void put(Row& row, std::size_t body, std::int32_t triangle, const double* barycentric, const Vector3d& along) const {
    for (std::size_t v = 0; v < 3; ++v)
      row.add(body, baked_.body().triangles[static_cast<std::size_t>(triangle)][v], barycentric[v] * along);
  }

  // A tool that holds a point of the surface; and what the tissue resists in the full solve.
  struct Held {
    palpate_grip grip = palpate_default_grip();
    std::vector<palpate_tool> tools() {
      palpate_tool tool = palpate_default_tool();
      tool.grips = &grip, tool.grip_count = 1;
      return {tool};
    }
  };
  Held held_place() const {
    Held held;
    held.grip.kind = PALPATE_GRIP_SURFACE_POINT, held.grip.triangle = places_[0].triangle;
    std::ranges::copy(kMiddle, held.grip.barycentric);
    Eigen::Map<Vector3d>(held.grip.displacement) = -way() * places_[0].outward;
    return held;
  }
  std::vector<Row> rows_of(const palpate_grip& grip) const {
    std::vector<Row> rows;
    for (int d = 0; d < 3; ++d) {
      Row& row = rows.emplace_back();
      put(row, 0, grip.triangle, grip.barycentric, Vector3d::Unit(d)), row.target = grip.displacement[d];
    }
    return rows;
  }

  void a_grip() {
    PlayedWorld world({alone()}, free_scene());
    Held held = held_place();
    world.touch(held.tools());
    const CoupledAnswer full = studies::solve_coupled(rows_of(held.grip), {full_.coupled()});
    add("one tool", world.on_tool(0), -full.force.head<3>(), world, full.u, 1);
  }

  // Jaws that pull and turn. Their rows are those of the runtime (grasped_rows.h), their solution is not.
  void a_grasp() {
    SceneDef def = free_scene();
    def.contact = PALPATE_CONTACT_PATCH, def.grasps.grasps = 1, def.max_tools = 1;
    def.torque_limit = def.torque_slew = INFINITY;
    PlayedWorld world({alone()}, def);
    palpate_grasp grasp = palpate_default_grasp();
    grasp.triangle = places_[0].triangle, grasp.radius = 0.05 * box_.size();
    std::ranges::copy(kMiddle, grasp.barycentric);
    Eigen::Map<Vector3d>(grasp.position) = places_[0].point;
    palpate_tool tool = palpate_default_tool();
    tool.id = 0, tool.parts = &grasp.part, tool.has_torque = 1;
    world.touch({tool});
    const Vector3d moved = way() * places_[0].outward;
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.2, places_[0].outward.unitOrthogonal()));
    Eigen::Map<Vector3d>(grasp.position) += moved;
    Eigen::Map<Vector3d>(tool.reference) = places_[0].point + moved;
    grasp.orientation[0] = turn.w();
    for (int d = 0; d < 3; ++d) grasp.orientation[1 + d] = turn.vec()[d];
    world.touch({tool});
    const ElasticBody& body = baked_.body();
    const studies::GraspedSurface surface =
        studies::grasped_surface(body.nodes, body.surface_count, body.triangles, body.touchable);
    studies::GraspedRows disc(surface, *bundle_.get(), surface_point_of(grasp.triangle, grasp.barycentric),
                              grasp.radius);
    const CoupledAnswer full = studies::solve_coupled(disc.rows(places_[0].point, moved, turn), {full_.coupled()});
    const studies::GraspedRows::Felt felt = disc.felt(full.force, places_[0].point, turn);
    add("a grasp that pulls and turns", world.on_tool(0), felt.force, world, full.u, disc.nodes());
    rows_.back()["torque_error"] = (world.torque_on_tool(0) - felt.torque).norm() / felt.torque.norm();
  }

  // Amounts that move the organ by about a hundredth of its size.
  std::vector<double> amounts() const {
    std::vector<double> amounts(baked_.body().motions.size());
    for (std::size_t m = 0; m < amounts.size(); ++m) {
      std::vector<double> unit(amounts.size());
      unit[m] = 1;
      const double most = full_.moved_by(unit).cwiseAbs().maxCoeff();
      if (most > 0) amounts[m] = way() / (most * static_cast<double>(amounts.size()));
    }
    return amounts;
  }
  SceneDef moved_scene() const {
    SceneDef def = free_scene();
    def.motions.motions = 1;
    return def;
  }

  void motions() {
    const std::vector<double> q = amounts();
    if (q.empty()) return;
    PlayedWorld world({alone()}, moved_scene());
    palpate_scene_set_motions(world.scene(0), q.data(), static_cast<int>(q.size()), nullptr);
    Held held = held_place();
    world.touch(held.tools());
    const CoupledAnswer full = studies::solve_coupled(rows_of(held.grip), {full_.coupled(full_.moved_by(q))});
    add(fmt::format("{} motions and a tool", q.size()), world.on_tool(0), -full.force.head<3>(), world, full.u, 1);
  }

  // A pressure is what holds a volume: the full solve finds its own, from the volume under no and under unit pressure.
  void held_volume() {
    const std::size_t last = baked_.body().motions.size() - 1;
    if (options_.modes == 0 || !full_.is_linear()) return;
    std::vector<double> q(last + 1);
    const double volume = 0.02 * full_.swept(last, full_.moved_by(amounts()));
    PlayedWorld world({alone()}, moved_scene());
    palpate_scene_set_motions(world.scene(0), q.data(), static_cast<int>(q.size()), nullptr);
    palpate_scene_hold_volume(world.scene(0), static_cast<int>(last), 1, volume, nullptr);
    Held held = held_place();
    world.touch(held.tools());
    const auto solved = [&](double pressure) {
      q[last] = pressure;
      return studies::solve_coupled(rows_of(held.grip), {full_.coupled(full_.moved_by(q))});
    };
    const double none = full_.swept(last, solved(0).u[0]), one = full_.swept(last, solved(1).u[0]);
    const CoupledAnswer full = solved((volume - none) / (one - none));
    add("held volume and a tool", world.on_tool(0), -full.force.head<3>(), world, full.u, 1);
  }

  std::vector<OrganAt> linked_organs() const {
    return stack_of(bundle_.get(), box_, 2, 0.03 * box_.size(), first_touch_);
  }
  std::vector<CoupledBody> two_bodies() const { return {full_.coupled(), full_.coupled()}; }
  // From the place on organ 0 to that on organ 1, in the world.
  static Vector3d line(const SurfacePlace& place, const std::vector<OrganAt>& organs) {
    return turn_of(organs[1].pose) * place.point + Vector3d(organs[1].pose.position) - place.point;
  }
  Row between(const SurfacePlace& place, const std::vector<OrganAt>& organs, const Vector3d& along) const {
    Row row;
    put(row, 1, place.triangle, kMiddle, turn_of(organs[1].pose).transpose() * along);
    put(row, 0, place.triangle, kMiddle, -along);
    return row;
  }

  void clips() {
    const auto organs = linked_organs();
    PlayedWorld world(organs, free_scene(), 0, 8);
    auto links = springs_between(places_, organs, 0, 200);
    for (palpate_world_link& link : links) link.kind = PALPATE_LINK_CLIP;
    world.set_links(links);
    world.touch();
    std::vector<Row> rows;
    for (const SurfacePlace& place : places_)
      for (int d = 0; d < 3; ++d) {
        Row& row = rows.emplace_back(between(place, organs, Vector3d::Unit(d)));
        row.target = -line(place, organs)[d], row.softness = 1.0 / 200;
      }
    const CoupledAnswer full = studies::solve_coupled(rows, two_bodies());
    add(fmt::format("{} clips between two organs", links.size()),
        Vector3d(palpate_world_link_state(world.get(), 0)->force), -full.force.head<3>(), world, full.u,
        static_cast<int>(links.size()));
  }

  // The line between the ends turns with the tissue: the full solve is repeated along the line that it gives until the line stands.
  void spring() {
    const auto organs = linked_organs();
    PlayedWorld world(organs, free_scene(), 0, 1);
    const auto links = springs_between({places_[0]}, organs, 0.8, 50);
    world.set_links(links);
    for (int s = 0; s < 60; ++s) world.touch();
    const Vector3d at_rest = line(places_[0], organs);
    Vector3d along = at_rest.normalized(), x = at_rest;
    CoupledAnswer full;
    for (int turn = 0; turn < 100; ++turn) {
      Row row = between(places_[0], organs, along);
      row.target = links[0].rest_length - along.dot(at_rest), row.softness = 1 / links[0].stiffness;
      full = studies::solve_coupled({row}, two_bodies());
      for (int d = 0; d < 3; ++d) {
        const Row axis = between(places_[0], organs, Vector3d::Unit(d));
        x[d] = at_rest[d];
        for (const Row::Term& term : axis.terms) x[d] += term.weight * full.u[term.body][term.dof];
      }
      along = x.normalized();
    }
    add("a spring between two organs", Vector3d(palpate_world_link_state(world.get(), 0)->force),
        -full.force[0] * along, world, full.u, 1);
  }

  // Organs that press: the vertices, places and normals are those that the step tells; whether each presses and how much, is solved.
  void pressed() {
    PlayedWorld world({alone(), {bundle_.get(), over(box_, first_touch_ + 0.005 * box_.size())}}, touching_scene(),
                      500);
    double gap = first_touch_ + 0.005 * box_.size();
    palpate_pose pose{};
    while (gap > first_touch_ - way()) world.place(1, pose = over(box_, gap -= 2e-4 * box_.size())), world.touch();
    for (int s = 0; s < 50; ++s) world.touch();
    if (world.pressing() == 0) return;
    const std::vector<palpate_pose> poses = {pose_at({0, 0, 0}), pose};
    const std::vector<VectorXd> shapes = {world.shape(0), world.shape(1)};
    std::vector<Row> smooth, flat;
    Vector3d force = Vector3d::Zero();
    for (const palpate_world_pair* pair : world.pairs()) {
      const Vector3d normal(pair->normal);
      const palpate_pose& own = poses[static_cast<std::size_t>(pair->organ[0])];
      const Vector3d vertex = turn_of(own) * full_.vertex(pair->node) + Vector3d(own.position);
      smooth.push_back(studies::row_of_pair(*pair, baked_.body().triangles[static_cast<std::size_t>(pair->triangle)],
                                            poses, shapes));
      Row& row = flat.emplace_back(smooth.back());
      row.target = -normal.dot(vertex - Vector3d(pair->place)) - pair->overlap;
      force += (pair->organ[0] == 0 ? 1 : -1) * Vector3d(pair->force);
    }
    for (const auto& [rows, name] : {std::pair(&smooth, ""), std::pair(&flat, ", against flat triangles")}) {
      const CoupledAnswer full = studies::solve_coupled(*rows, two_bodies());
      Vector3d expected = Vector3d::Zero();
      Index i = 0;
      for (const palpate_world_pair* pair : world.pairs())
        expected += (pair->organ[0] == 0 ? 1 : -1) * full.force[i++] * Vector3d(pair->normal);
      add(fmt::format("two organs that press at {} places{}", world.pressing(), name), force, expected, world, full.u,
          world.pressing());
    }
  }

  // A needle that went in without resistance and is then moved aside: the tissue at rest at its places is held across its new axis.
  void needle() {
    if (!full_.is_linear()) return;
    SceneDef def = free_scene();
    def.needles.needles = 1;
    PlayedWorld world({alone()}, def);
    const Way& way = baked_.way();
    const double deep = 0.6 * way.length, spacing = deep / 6.5, pace = spacing / 10;
    palpate_needle needle{};
    const auto step = [&](double depth, double aside) {
      needle = needle_on(way, depth, spacing, aside);
      palpate_tool tool = palpate_default_tool();
      tool.id = 0, tool.parts = &needle.part;
      world.touch({tool});
      return palpate_scene_needle_state(world.scene(0), 0);
    };
    std::vector<double> depths;
    double tip = 0, before = 0;
    for (double depth = -2 * pace; depth < deep; depth += pace) {
      const palpate_needle_state* const state = step(depth, 0);
      // It takes hold where its tip was before the step.
      if (state && static_cast<std::size_t>(state->places) > depths.size()) depths.push_back(tip);
      if (state) tip = state->depth;
    }
    if (depths.empty()) return;
    const double aside = 0.2 * this->way();
    const palpate_needle_state* const state = step(tip, aside);
    const Vector3d across[] = {way.inwards.unitOrthogonal(), way.inwards.cross(way.inwards.unitOrthogonal())};
    std::vector<Row> rows;
    const ElasticBody& body = baked_.body();
    const auto hold = [&](double depth, double length) {
      const studies::PlaceInside place =
          studies::place_inside(body.nodes, body.tetrahedra, way.entry.point + depth * way.inwards);
      const Material& material = body.materials[static_cast<std::size_t>(body.region[place.tetrahedron])];
      for (const Vector3d& direction : across) {
        Row& row = rows.emplace_back();
        for (int c = 0; c < 4; ++c) row.add(0, place.node[static_cast<std::size_t>(c)], place.weight[c] * direction);
        row.target = aside * across[0].dot(direction);
        row.softness =
            studies::softness_across_shaft(material.young, material.poisson, place.edge, needle.radius, length);
      }
    };
    hold(tip, spacing / 2);
    for (const double depth : depths) hold(depth, depth - before), before = depth;
    const CoupledAnswer full = studies::solve_coupled(rows, {full_.coupled()});
    Vector3d expected = Vector3d::Zero();
    for (std::size_t i = 0; i < rows.size(); ++i) expected -= full.force[static_cast<Index>(i)] * across[i % 2];
    add(fmt::format("a needle that holds {} places", depths.size()), Vector3d(state->force), expected, world, full.u,
        static_cast<int>(depths.size()));
  }

  const BakedOrgan& baked_;
  const ScenesOptions& options_;
  const FullBody& full_;
  const Box box_;
  const Bundle bundle_;
  const std::vector<SurfacePlace> places_;
  const double first_touch_;
  std::vector<Json> rows_;
};

}  // namespace

std::vector<Json> measure_errors(const BakedOrgan& baked, const ScenesOptions& options) {
  return Errors(baked, options).run();
}

}  // namespace palpate::scenes
