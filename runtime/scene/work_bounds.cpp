// What a step may count in operations (step_work.h), stated in the plan, and how many operations a machine does in a time.
#include <algorithm>
#include <cmath>
#include <ctime>

#include "runtime/base/aligned_memory.h"
#include "runtime/dense/node_sum.h"
#include "runtime/scene/scene.h"

namespace palpate {
namespace {

// Upper bounds, at the limits of the scene's definition, as contact_field.cpp, surface_tree.h and contact_solver.cpp count.
class WorkBounds {
 public:
  // triangles: of the surface that tools meet. fine: operations to move all corners of these triangles, where it is a fine one.
  WorkBounds(const palpate_scene_def& def, bool packed, double surface_nodes, double triangles, double fine)
      : def_(def), packed_(packed), surface_nodes_(surface_nodes), triangles_(triangles), fine_(fine) {}

  // Tests and changes of contacts within their share, one test and one change more, and the displacement at every anchor.
  double collision() const {
    return 0.75 * most() + one_test() + renewals(1) + def_.max_points * (12 * node() + kTriangle);
  }
  // The factor, its rows that come and go, the soft factor of contacts that conflict, the laws, and what measuring the field takes.
  double contact() const {
    const double nodes = def_.max_contact_nodes,
                 limit =
                     rows() * rows() * rows() / 6 + ContactSolver::kSoftSolves * rows() * rows() + 9 * nodes * nodes;
    // The laws, and a second time for grips that contradict one another, take what is left, but a sweep and some looks at least;
    // before that the nodes that contacts share.
    const bool gives_way = def_.law == PALPATE_LAW_UNILATERAL || def_.law == PALPATE_LAW_COULOMB || def_.max_links > 0;
    const double shared = std::min<double>(nodes, SharedNodes::kMostNodes),
                 laws = gives_way ? 2 * (6 * rows() * rows() + 1600 * contacts()) + 60 * (shared * shared + nodes) : 0;
    return (5 * rows() * rows() + limit + laws) / kDense + renewals(contacts()) + 1.25 * most() + 2 * kMeasuring;
  }
  // Of laws under large deformation, which are solved anew in each round: what is left of the step's operations, and one sweep.
  double laws() const {
    if (!contacts_may_give_way(def_)) return 0;
    return most() + DeformingBody::kMostRounds * (8 * rows() * rows() + 1600 * contacts()) / kDense;
  }

 private:
  static constexpr double kTriangle = 300, kMeasuring = 30'000, kRowsOfAContact = 9, kSweeps = 10;
  bool follows() const { return def_.collision == PALPATE_COLLISION_DEFORMED; }
  double most() const { return static_cast<double>(def_.max_operations); }
  double contacts() const {
    return def_.max_points * (def_.contact == PALPATE_CONTACT_TRIANGLE ? 3.0 : 1.0) + def_.max_links +
           (def_.grasps ? 6 * def_.max_tools : 0);
  }
  double rows() const { return 3 * contacts(); }
  double node() const { return follows() ? 10 + 3.0 * def_.max_contact_nodes : 0; }
  // Two queries and the ray of a third, each of which may visit the whole surface; the fields that they ask for, one of which and a
  // share of a second are evaluated at all nodes, and a contact's own part; and the prediction. A packed bundle's are evaluated one by one.
  double one_test() const {
    const double prediction =
                     ((2 * kRowsOfAContact + 2 + kSweeps) * rows() * rows() + kSweeps * 600 * contacts()) / kDense,
                 at_once = 2 * (5.0 + def_.max_contact_nodes),
                 few = 2.0 * static_cast<double>(ContactField::kMostOneByOne) / std::max(1.0, surface_nodes_),
                 fields = follows() ? packed_ ? 3 * node() : at_once + few + node() : 0;
    return 4 * (kTriangle * triangles_ + 3 * fine_) + fields * surface_nodes_ + (follows() ? prediction : 0);
  }
  double renewals(double count) const {
    const double each = 3 * rows() * rows(), whole = rows() * rows() * rows() / 6, nodes = def_.max_contact_nodes;
    return (std::min(each * count, whole) + count * each / 2 + 9 * nodes * std::min(nodes, count * nodes)) / kDense;
  }

  const palpate_scene_def& def_;
  const bool packed_;  // the bundle's compliance is
  const double surface_nodes_, triangles_, fine_;
};

}  // namespace

void state_work_bounds(palpate_scene& scene) {
  const FineSurface& fine = scene.touch.fine;
  double corners = 0;
  for (std::int32_t i = 0; i < 3 * fine.triangle_count(); ++i)
    corners += static_cast<double>(fine.cost(fine.triangles()[i]));
  const WorkBounds bounds(scene.def, scene.tensors.compliance != nullptr, scene.tensors.surface_nodes,
                          scene.touch.tree.triangle_count(), corners);
  const auto state = [&](Pass id, double operations) {
    palpate_plan_pass& pass = scene.plan.pass[scene.watch.index_in_plan[static_cast<std::int32_t>(id)]];
    pass.most_operations = static_cast<std::int64_t>(std::min(operations, 9e18));
  };
  if (scene.def.collision != PALPATE_COLLISION_OFF) state(Pass::collision, bounds.collision());
  state(Pass::contact, scene.def.deformation == PALPATE_DEFORMATION_LARGE
                           ? static_cast<double>(scene.touch.body.most_operations()) + bounds.laws()
                           : bounds.contact());
}

}  // namespace palpate

#ifdef __wasm__
// The browser's module has no clock.
int64_t palpate_operations_in(double) {
  return 0;
}
#else
// Sums at nodes are what a step does most, and operations are counted by them.
int64_t palpate_operations_in(double microseconds) {
  constexpr int kColumns = 300, kNodes = 1000, kNumbers = 3 * kNodes, kRounds = 10, kSums = 200;
  constexpr std::size_t kBytes = sizeof(float) * kColumns * kNumbers;
  auto* const numbers = static_cast<float*>(palpate::take_aligned((kBytes + 63) / 64 * 64));
  if (!numbers || !(microseconds > 0)) {
    palpate::release_aligned(numbers);
    return 0;
  }
  std::fill(numbers, numbers + kColumns * kNumbers, 1.0f);
  const void* column[kColumns];
  double coefficient[kColumns], sum[3], best = INFINITY;
  for (int j = 0; j < kColumns; ++j) column[j] = numbers + j * kNumbers, coefficient[j] = 1;
  // The processor time of the fastest of some rounds; a clock that is too coarse for one round gets more sums.
  int sums = kSums;
  for (int round = 0; round < kRounds; ++round) {
    const std::clock_t start = std::clock();
    for (int n = 0; n < sums; ++n)
      palpate::sum_at_node(palpate::formats::ElementType::f32, column, coefficient, kColumns,
                           3 * static_cast<std::size_t>(n * 7 % kNodes), kNumbers, sum);
    const double ticks = static_cast<double>(std::clock() - start);
    if (ticks < 100) {
      sums *= 4, --round;
      continue;
    }
    best = std::min(best, 1e6 * ticks / CLOCKS_PER_SEC / sums);
  }
  palpate::release_aligned(numbers);
  return static_cast<int64_t>(std::min(microseconds / best * (10 + kColumns), 9e18));
}
#endif
