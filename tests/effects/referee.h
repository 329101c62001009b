// Whether a step is the solution of the coupled problem, by a dense solve of the test's own.
//
// With the forces f that a step tells, the dense body is at u = C f + B q. These u and f are the full solution where, in each step,
// - every place that is held stands where its holder has it, or its law says so: tool points, grips, jaws, needles, links, pairs of organs;
// - the forces that tools, links, jaws, needles and pairs tell are those on the nodes; Q, P and relaxation act on them as their equations say;
// - shape, report, queries, skin, inside and crossings tell this u.
// A hyperelastic body is at rest under f by Newton's method (studies/hyperelastic).
#pragma once

#include <map>

#include "runtime/contact/contact_patch.h"
#include "runtime/relaxation/prony_series.h"
#include "runtime/tissue/response_curve.h"
#include "studies/coupled/grasped_rows.h"
#include "tests/effects/cut_truth.h"
#include "tests/effects/stage.h"

namespace palpate::tests {

class Referee {
 public:
  // The scene of the stage has a report, and as many nodes in its shape as `of` asks for.
  Referee(const SceneOfEffects& of, Stage& stage);
  ~Referee();
  void check(int s);

  // The largest error of each kind of check so far, as a share of 3 mm or of the largest force.
  const std::map<std::string, double>& errors() const { return errors_; }
  double worst() const;
  int trusted = 0;  // steps without a flag

 private:
  struct Organ {
    palpate_scene* scene = nullptr;
    const palpate_contacts* contacts = nullptr;
    Eigen::VectorXd f, u, drawn;           // N; m by f and motions; m as it is drawn, after P
    std::vector<Eigen::Vector3d> of_node;  // N, of each contact node, before Q
    std::vector<float> told;               // m, the shape
    std::vector<CutTruth> left;            // one: what is left of the body
  };
  // Weighted nodes under one resultant.
  struct Held {
    Eigen::Vector3d force = Eigen::Vector3d::Zero(), moved = Eigen::Vector3d::Zero(), rest = Eigen::Vector3d::Zero();
    std::vector<std::int32_t> nodes;
  };

  void miss(const char* kind, double error, double scale);
  void read(Organ& organ, int k);
  void measure_surface();
  void read_forces(Organ& organ);
  void check_loads(const Organ& organ, int k);
  void check_plate(const Organ& organ, int k);
  void check_lips(const Organ& organ);
  Eigen::Vector4d amounts_of(const Organ& organ);
  void add_corrected_shape(Organ& organ);
  Held held_by(const Organ& organ, palpate_contact_source source, std::int32_t index, std::int32_t point) const;
  Eigen::Matrix3d stiffness_of(std::int32_t node) const {
    return body_.compliance.block<3, 3>(3 * node, 3 * node).inverse();
  }
  palpate_step_flags of_response_range() const { return PALPATE_STEP_RESPONSE_RANGE; }
  Eigen::Vector3d rest(std::int32_t n) const { return rest_.segment<3>(3 * n); }
  Eigen::Vector3d place(std::int32_t triangle, const double* k, const Eigen::VectorXd& u) const;
  Eigen::Vector3d smooth_normal(const palpate_contact& contact);
  Eigen::Matrix3d local_of_disc(const palpate_contact& contact);

  void check_shape(Organ& organ, int k);
  void check_contacts(const Organ& organ);
  void check_contact(const Organ& organ, const palpate_contact& contact);
  void check_law(const palpate_contact& contact, const Eigen::Vector3d& ahead, const Eigen::Vector3d& force);
  void check_tools(const Organ& organ);
  void close_jaws(const palpate_grasp& grasp);
  void follow_jaws(const std::vector<std::int32_t>& before);
  void check_pusher(const Organ& organ);
  void check_grasp(const Organ& organ);
  void check_needle(const Organ& organ);
  void check_links(const Organ& organ);
  void check_link(const palpate_link_state& state, palpate_link_kind kind, double stiffness,
                  const Eigen::Vector3d ends[2]);
  void check_pairs();
  void check_world_links();
  void check_surface(const Organ& organ);
  void check_skin(Organ& organ);
  void check_inside(Organ& organ);
  void check_crossings(const Organ& organ, std::vector<float>& positions);
  Eigen::VectorXd on_pressed_face(const CutTruth& left, const Eigen::VectorXd& displacement) const;
  void check_large(Organ& organ, int k);

  const SceneOfEffects of_;
  Stage& stage_;
  const EffectBody& body_;
  std::map<std::string, double> errors_;
  Eigen::VectorXd rest_;  // [3N] m
  std::vector<Organ> organs_;
  double largest_force_ = 0.05;  // N, so far
  ResponseCurve p_, q_;
  PronySeries relaxation_;
  std::map<std::int32_t, PronySeries::Memory> memory_, torque_memory_;  // by the tool's id
  SceneMemory memory_of_surface_;
  std::vector<double> position_;
  std::vector<std::int32_t> triangles_;
  SurfaceIndex index_;
  SurfaceMeasure measure_;
  ContactPatch patch_;
  studies::GraspedSurface grasped_;
  struct Jaws {
    std::int32_t id = -1;
    Eigen::Vector3d position;
    Eigen::Quaterniond turn;
    Eigen::Vector3d middle;  // m, of the disc at rest
    double radius;           // m
    std::vector<studies::Row> rows;
    Eigen::VectorXd closed_on;  // m, of all nodes
  } jaws_;
  Eigen::VectorXd last_u_;                     // m, of organ 0 in the last step
  std::map<std::pair<int, int>, bool> stuck_;  // tool, point: it stuck in the last step
  int step_ = 0;
  bool has_changed_ = false;  // the surface, in this step
};

}  // namespace palpate::tests
