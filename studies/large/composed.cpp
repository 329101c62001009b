#include "studies/large/composed.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <stdexcept>

#include "formats/errors.h"
#include "formats/program.h"
#include "studies/coupled/grasped_rows.h"
#include "studies/coupled/played_world.h"
#include "studies/hyperelastic/doubled_body.h"
#include "studies/hyperelastic/large_reference.h"
#include "studies/timing/timing.h"

namespace palpate::large {
namespace {

using Eigen::Index;
using Eigen::Map;
using Eigen::MatrixXd;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Eigen::VectorXd;
using studies::PlayedWorld;
using studies::Row;
using Json = nlohmann::ordered_json;

constexpr double kTick = 1e-3;       // s
constexpr int kTicksOfDeform = 10;   // touches between two solutions beside the touch
constexpr int kStands = 100;         // touches until what stands has come to rest
constexpr double kTurnPerWay = 10;   // rad/m, of the jaws
constexpr double kConverged = 1e-7;  // residual force of the converged solution, of the inner force
constexpr double kNone = 1e-9;       // m, by which a row that only pushes may be missed
constexpr int kMostPairs = 500;

struct Model {
  const char* name;
  palpate_deformation_model deformation;
};
constexpr std::array<Model, 4> kModels = {{{"linear", PALPATE_DEFORMATION_LINEAR},
                                           {"large", PALPATE_DEFORMATION_LARGE},
                                           {"beside", PALPATE_DEFORMATION_LARGE_BESIDE},
                                           {"renewed", PALPATE_DEFORMATION_LARGE_RENEWED}}};

Vector3d eigen(Vec3 v) {
  return {v.x, v.y, v.z};
}
// What a state is compared by: the surfaces of all organs, one after the other, and the force.
struct Seen {
  VectorXd u;      // m
  Vector3d force;  // N
};

// A world of one or two copies of the organ that is moved along a way.
class Situation {
 public:
  virtual ~Situation() = default;
  virtual std::unique_ptr<PlayedWorld> world(palpate_deformation_model deformation) const = 0;
  // One touch at `way` metres.
  virtual palpate_step_flags touch(PlayedWorld& world, double way) = 0;
  virtual Vector3d force(const PlayedWorld& world, double way) const = 0;
  // The converged solution at `way`; standing: a large world that stands there. None where nothing presses.
  virtual Seen converged(const PlayedWorld& standing, double way, int* contacts) = 0;
};

Seen seen(const Situation& situation, const PlayedWorld& world, int organs, double way) {
  Seen state{VectorXd(), situation.force(world, way)};
  for (int k = 0; k < organs; ++k) {
    const VectorXd u = world.shape(k);
    const Index before = state.u.size();
    state.u.conservativeResize(before + u.size()), state.u.tail(u.size()) = u;
  }
  return state;
}

// rows u + softness r = target as matrices over all dofs of the bodies, which follow one another.
struct DenseRows {
  DenseRows(const std::vector<Row>& rows, Index dofs_of_body, Index dofs)
      : of(MatrixXd::Zero(static_cast<Index>(rows.size()), dofs)),
        target(static_cast<Index>(rows.size())),
        softness(VectorXd::Zero(static_cast<Index>(rows.size()))) {
    for (Index i = 0; i < of.rows(); ++i) {
      const Row& row = rows[static_cast<std::size_t>(i)];
      target[i] = row.target, softness[i] = row.softness;
      for (const Row::Term& term : row.terms)
        of(i, static_cast<Index>(term.body) * dofs_of_body + term.dof) += term.weight;
    }
  }
  MatrixXd of;
  VectorXd target, softness;
};

// ---- jaws ------------------------------------------------------------------------------------------------------------

class Grasp final : public Situation {
 public:
  Grasp(const Bundle& bundle, const LargeBody& body, const LargeReference& reference, const accuracy::TouchSite& site,
        double radius)
      : bundle_(bundle), reference_(reference), surface_nodes_(body.elastic().surface_count) {
    const ElasticBody& elastic = body.elastic();
    const auto found = accuracy::closest_point(
        {bundle.nodes(), {bundle.triangles(), 3 * static_cast<std::size_t>(bundle.describe().triangle_count)}},
        site.at);
    about_ = eigen(found.at), outward_ = -eigen(site.inward), axis_ = eigen(site.across);
    grasp_.triangle = found.on.triangle, grasp_.radius = radius;
    std::copy(found.on.barycentric, found.on.barycentric + 3, grasp_.barycentric);
    surface_ = studies::grasped_surface(elastic.nodes, elastic.surface_count, elastic.triangles, elastic.touchable);
    disc_ = std::make_unique<studies::GraspedRows>(surface_, *bundle.get(), found.on, radius);
  }

  std::unique_ptr<PlayedWorld> world(palpate_deformation_model deformation) const override {
    SceneDef def = studies::free_scene();
    def.contact = PALPATE_CONTACT_PATCH, def.grasps.grasps = 1, def.max_tools = 1;
    def.large.deformation = deformation;
    return std::make_unique<PlayedWorld>(std::vector<studies::OrganAt>{{bundle_.get(), studies::pose_at({0, 0, 0})}},
                                         def);
  }

  palpate_step_flags touch(PlayedWorld& world, double way) override {
    const Vector3d at = about_ + way * outward_;
    const Quaterniond turn = turned(way);
    Map<Vector3d>(grasp_.position) = at;
    grasp_.orientation[0] = turn.w();
    for (int d = 0; d < 3; ++d) grasp_.orientation[1 + d] = turn.vec()[d];
    palpate_tool tool = palpate_default_tool();
    tool.id = 0, tool.parts = &grasp_.part;
    return world.touch({tool});
  }

  Vector3d force(const PlayedWorld& world, double) const override { return world.on_tool(0); }

  Seen converged(const PlayedWorld&, double way, int* contacts) override {
    const DenseRows rows(disc_->rows(about_, way * outward_, turned(way)), reference_.dofs(), reference_.dofs());
    const VectorXd force = reference_.solve(rows.of, rows.target, &u_, kConverged, rows.softness.asDiagonal());
    *contacts = disc_->nodes();
    return {u_.head(3 * surface_nodes_), disc_->felt(force, about_, turned(way)).force};
  }

 private:
  Quaterniond turned(double way) const { return Quaterniond(Eigen::AngleAxisd(kTurnPerWay * way, axis_)); }

  const Bundle& bundle_;
  const LargeReference& reference_;
  Index surface_nodes_;
  Vector3d about_, outward_, axis_;
  palpate_grasp grasp_ = palpate_default_grasp();
  studies::GraspedSurface surface_;
  std::unique_ptr<studies::GraspedRows> disc_;
  VectorXd u_ = VectorXd::Zero(reference_.dofs());  // the last solution
};

// ---- two organs ------------------------------------------------------------------------------------------------------

class Organs final : public Situation {
 public:
  // reference: of two copies of the body.
  Organs(const Bundle& bundle, const LargeBody& body, const LargeReference& reference, const accuracy::TouchSite& site)
      : bundle_(bundle),
        body_(body.elastic()),
        reference_(reference),
        about_(eigen(site.at)),
        outward_(-eigen(site.inward)),
        turn_(Eigen::AngleAxisd(EIGEN_PI, eigen(site.across))),
        first_touch_(gap_of_first_touch()) {}

  std::unique_ptr<PlayedWorld> world(palpate_deformation_model deformation) const override {
    SceneDef def = studies::touching_scene();
    def.contact = PALPATE_CONTACT_PATCH, def.max_tools = 1, def.large.deformation = deformation;
    return world(def, first_touch_);
  }

  palpate_step_flags touch(PlayedWorld& world, double way) override {
    world.place(1, pose(first_touch_ - way));
    return world.touch();
  }

  // On organ 0.
  Vector3d force(const PlayedWorld& world, double) const override {
    Vector3d sum = Vector3d::Zero();
    for (const palpate_world_pair* pair : world.pairs())
      sum += (pair->organ[0] == 0 ? 1 : -1) * Map<const Vector3d>(pair->force);
    return sum;
  }

  // Which vertex meets which place along which normal, and the distance there, is what the world tells that stands; which of them press, and how
  // much, is solved.
  Seen converged(const PlayedWorld& standing, double way, int* contacts) override {
    const std::vector<Row> rows = rows_of(standing, pose(first_touch_ - way));
    const DenseRows all(rows, reference_.dofs() / 2, reference_.dofs());
    std::vector<char> presses;
    for (const palpate_world_pair* pair : standing.pairs()) presses.push_back(pair->pressure > 0);
    VectorXd force;
    for (int round = 0;; ++round) {
      force = solve(all, presses);
      if (!change(all, force, &presses)) break;
      if (round == 30) throw std::runtime_error("which pairs press was not found in 30 rounds");
    }
    *contacts = static_cast<int>(std::ranges::count(presses, 1));
    const Index surface = 3 * body_.surface_count, dofs = reference_.dofs() / 2;
    Seen state{VectorXd(2 * surface), Vector3d::Zero()};
    state.u << u_.head(surface), u_.segment(dofs, surface);
    Index i = 0;
    for (const palpate_world_pair* pair : standing.pairs())
      state.force += (pair->organ[0] == 0 ? 1 : -1) * force[i++] * Map<const Vector3d>(pair->normal);
    return state;
  }

 private:
  std::unique_ptr<PlayedWorld> world(const SceneDef& def, double gap) const {
    return std::make_unique<PlayedWorld>(
        std::vector<studies::OrganAt>{{bundle_.get(), studies::pose_at({0, 0, 0})}, {bundle_.get(), pose(gap)}}, def,
        kMostPairs);
  }

  // The copy is turned by half a turn about the site's tangent, so that its own site faces this one, `gap` metres away.
  palpate_pose pose(double gap) const {
    palpate_pose pose = studies::pose_at(about_ - turn_ * about_ + gap * outward_);
    pose.orientation[0] = turn_.w();
    for (int d = 0; d < 3; ++d) pose.orientation[1 + d] = turn_.vec()[d];
    return pose;
  }

  double gap_of_first_touch() const {
    Vector3d low = Vector3d::Constant(1e300), high = -low;
    for (const auto& node : body_.nodes)
      low = low.cwiseMin(Map<const Vector3d>(node.data())), high = high.cwiseMax(Map<const Vector3d>(node.data()));
    const double size = (high - low).norm(), step = 2e-3 * size;
    double gap = 2 * size;
    const auto world = this->world(studies::touching_scene(), gap);
    while (world->pressing() == 0 && gap > -size) world->place(1, pose(gap -= step)), world->touch();
    return gap + step;
  }

  std::vector<Row> rows_of(const PlayedWorld& world, const palpate_pose& second) const {
    const std::vector<palpate_pose> poses = {studies::pose_at({0, 0, 0}), second};
    const std::vector<VectorXd> shapes = {world.shape(0), world.shape(1)};
    std::vector<Row> rows;
    for (const palpate_world_pair* pair : world.pairs())
      rows.push_back(
          studies::row_of_pair(*pair, body_.triangles[static_cast<std::size_t>(pair->triangle)], poses, shapes));
    return rows;
  }

  // The forces of all rows where those that press are held.
  VectorXd solve(const DenseRows& all, const std::vector<char>& presses) {
    const auto count = static_cast<Index>(std::ranges::count(presses, 1));
    MatrixXd held(count, all.of.cols());
    VectorXd target(count), force = VectorXd::Zero(all.of.rows());
    Index put = 0;
    for (Index i = 0; i < all.of.rows(); ++i)
      if (presses[static_cast<std::size_t>(i)]) held.row(put) = all.of.row(i), target[put++] = all.target[i];
    const VectorXd found = reference_.solve(held, target, &u_, kConverged, MatrixXd::Zero(count, count));
    put = 0;
    for (Index i = 0; i < all.of.rows(); ++i)
      if (presses[static_cast<std::size_t>(i)]) force[i] = found[put++];
    return force;
  }

  // Rows that pull leave; where none does, the row that is missed by the most joins. False where all hold.
  bool change(const DenseRows& all, const VectorXd& force, std::vector<char>* presses) const {
    bool changed = false;
    for (Index i = 0; i < force.size(); ++i)
      if (force[i] < 0) (*presses)[static_cast<std::size_t>(i)] = 0, changed = true;
    if (changed) return true;
    const VectorXd missed = all.target - all.of * u_;
    Index worst = 0;
    if (missed.size() == 0 || missed.maxCoeff(&worst) <= kNone || (*presses)[static_cast<std::size_t>(worst)])
      return false;
    (*presses)[static_cast<std::size_t>(worst)] = 1;
    return true;
  }

  const Bundle& bundle_;
  const ElasticBody& body_;
  const LargeReference& reference_;
  const Vector3d about_, outward_;
  const Quaterniond turn_;
  const double first_touch_;
  VectorXd u_ = VectorXd::Zero(reference_.dofs());  // the last solution
};

// ---- all situations --------------------------------------------------------------------------------------------------

class Composed {
 public:
  explicit Composed(const Pace& pace) : pace_(pace) {}

  void measure(const char* with, std::size_t place, int organs, Situation& situation) {
    std::vector<std::vector<Seen>> played;
    std::vector<std::vector<unsigned>> flags;
    for (const Model& model : kModels) played.push_back(play(with, model, organs, situation, &flags.emplace_back()));
    const auto standing = situation.world(PALPATE_DEFORMATION_LARGE);
    int tick = 0;
    for (std::size_t i = 0; i < pace_.depths.size(); ++i) {
      const double way = pace_.depths[i];
      for (; tick * step() < way; ++tick) situation.touch(*standing, tick * step());
      for (int s = 0; s < kStands; ++s) situation.touch(*standing, way);
      Json state = {{"with", with}, {"place", place}, {"depth_mm", 1e3 * way}};
      try {
        int contacts = 0;
        const Seen exact = situation.converged(*standing, way, &contacts);
        if (contacts == 0) continue;
        state["force_N"] = exact.force.norm(), state["contacts"] = contacts;
        for (std::size_t m = 0; m < kModels.size(); ++m) {
          const std::string name = kModels[m].name;
          state[name + "_field"] = (played[m][i].u - exact.u).norm() / exact.u.norm();
          state[name + "_force"] = (played[m][i].force - exact.force).norm() / exact.force.norm();
        }
      } catch (const std::runtime_error& error) {
        state["unsolved"] = error.what();
      }
      for (std::size_t m = 0; m < kModels.size(); ++m) state[fmt::format("{}_flags", kModels[m].name)] = flags[m][i];
      states_.push_back(state);
    }
  }

  Json json() const {
    Json all = {{"states", states_}};
    for (const auto& [with, of_models] : touch_)
      for (const auto& [model, us] : of_models)
        all["touch"][with][model] = {{"median_us", studies::percentile(us, 0.5)},
                                     {"most_us", studies::percentile(us, 0.999)}};
    for (const auto& [with, of_models] : deform_)
      for (const auto& [model, us] : of_models)
        all["deform"][with][model] = {{"median_us", studies::percentile(us, 0.5)}};
    return all;
  }

 private:
  double step() const { return pace_.speed * kTick; }

  std::vector<Seen> play(const std::string& with, const Model& model, int organs, Situation& situation,
                         std::vector<unsigned>* flags) {
    const auto world = situation.world(model.deformation);
    std::vector<Seen> all;
    for (int tick = 0; all.size() < pace_.depths.size(); ++tick) {
      const double way = std::min(tick * step(), pace_.depths[all.size()]);
      const double begun = studies::thread_seconds();
      const unsigned raised = situation.touch(*world, way);
      if (tick > 0) touch_[with][model.name].push_back(1e6 * (studies::thread_seconds() - begun));
      if (model.deformation >= PALPATE_DEFORMATION_LARGE_BESIDE && tick % kTicksOfDeform == 0)
        deform(with, model, *world, organs);
      if (way < pace_.depths[all.size()]) continue;
      all.push_back(seen(situation, *world, organs, way)), flags->push_back(raised);
    }
    return all;
  }

  void deform(const std::string& with, const Model& model, PlayedWorld& world, int organs) {
    for (int k = 0; k < organs; ++k) {
      const double begun = studies::thread_seconds();
      if (palpate_scene_deform(world.scene(k)) > 0)
        deform_[with][model.name].push_back(1e6 * (studies::thread_seconds() - begun));
    }
  }

  const Pace& pace_;
  std::vector<Json> states_;
  std::map<std::string, std::map<std::string, std::vector<double>>> touch_, deform_;  // us
};

}  // namespace

Json measure_composed(const std::filesystem::path& file, const LargeBody& body, const accuracy::StudySites& sites,
                      std::size_t places, const Pace& pace) try {
  const Bundle bundle(file.c_str());
  const LargeReference one(body.get());
  const DoubledBody doubled(body.get());
  const LargeReference two(doubled.get());
  Composed composed(pace);
  const std::size_t count = std::min(places, sites.touch.size());
  Progress progress("situations", 2 * count, 0);
  for (std::size_t place = 0; place < count; ++place) {
    Grasp grasp(bundle, body, one, sites.touch[place], sites.radius);
    composed.measure("grasp", place, 1, grasp);
    progress.advance();
    Organs organs(bundle, body, two, sites.touch[place]);
    composed.measure("organs", place, 2, organs);
    progress.advance();
  }
  return composed.json();
} catch (const Error& error) {
  throw OperationError(fmt::format("{}: {}", file.string(), error.what()));
}

}  // namespace palpate::large
