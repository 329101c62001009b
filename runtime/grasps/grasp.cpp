#include "runtime/grasps/grasp.h"

#include <algorithm>
#include <cmath>

#include "runtime/contact/contact_laws.h"
#include "runtime/contact/divided_nodes.h"
#include "runtime/contact/touch_step.h"
#include "runtime/include/palpate/palpate_grasps.h"

namespace palpate {
namespace {

// A grasp slips until its force is within this share of its friction, in the step in which it came beyond it.
constexpr double kSlipsTo = 1e-3;

int patches_of(const palpate_grasp& grasp) {
  return grasp.opposite_triangle >= 0 ? 2 : 1;
}

// x = A^-1 x, A symmetric and positive definite, overwritten. Where A has nothing to tell, x is 0.
void solve_positive(int size, double* a, double* x) {
  for (int i = 0; i < size; ++i) {
    const double pivot = a[i * size + i];
    for (int r = i + 1; r < size; ++r) {
      const double factor = pivot > 0 ? a[r * size + i] / pivot : 0;
      for (int c = i; c < size; ++c) a[r * size + c] -= factor * a[i * size + c];
      x[r] -= factor * x[i];
    }
  }
  for (int i = size - 1; i >= 0; --i) {
    for (int c = i + 1; c < size; ++c) x[i] -= a[i * size + c] * x[c];
    x[i] = a[i * size + i] > 0 ? x[i] / a[i * size + i] : 0;
  }
}

Hold hold_of(palpate_grasp_condition condition) {
  static_assert(Hold{PALPATE_GRASP_OPEN} == Hold::open && Hold{PALPATE_GRASP_HOLDS} == Hold::holds &&
                Hold{PALPATE_GRASP_SLIPS} == Hold::slips && Hold{PALPATE_GRASP_LET_GO} == Hold::let_go);
  return static_cast<Hold>(condition);
}

Mat3 without_one(Mat3 turn) {
  for (int i = 0; i < 3; ++i) turn.m[i][i] -= 1;
  return turn;
}

}  // namespace

bool Grasps::create(SceneMemory& memory, const DiscSource& source, std::int32_t max_tools, std::int32_t most_nodes,
                    const DisplacementField* field, Pass pass) {
  source_ = source, field_ = field, pass_ = pass, most_nodes_ = most_nodes, most_tools_ = max_tools;
  memory.keep(seen_);
  grasps_ = memory.array<Grasp>(static_cast<std::size_t>(max_tools));
  memory.keep_array(grasps_, static_cast<std::size_t>(max_tools));
  for (std::int32_t t = 0; !memory.failed() && t < max_tools; ++t) forget_tool(t);
  return !memory.failed();
}

void Grasps::forget_tool(std::int32_t t) {
  grasps_[t] = Grasp{};
}

// ---- closing ---------------------------------------------------------------------------------------------------------

void Grasps::find_patch(const SurfacePoint& place, double radius, GraspPatch* to) {
  find_grasp_patch(source_, place, radius, most_nodes_, to);
  to->middle = place, to->radius = radius;
  for (int e = 0; e < to->count; ++e) {
    const Vec3 rest = load3(source_.rest + 3 * static_cast<std::size_t>(to->node[e]));
    const Vec3 u = field_->at_node(to->node[e]);
    for (int part = 0; part < 3; ++part) {
      to->before[part] += to->weight[part][e] * u;
      to->place[part] += to->weight[part][e] * (rest + u);
    }
  }
}

void Grasps::close(Grasp& grasp, const Tool& tool) {
  const palpate_grasp& from = grasp_of(tool);
  grasp.closed = 1, grasp.id = from.id, grasp.slipped = {};
  grasp.state = {};
  grasp.patches[0] = grasp.patches[1] = GraspPatch{};
  find_patch(surface_point_of(from.triangle, from.barycentric), from.radius, &grasp.patches[0]);
  if (patches_of(from) < 2) return;
  find_patch(surface_point_of(from.opposite_triangle, from.opposite_barycentric), from.radius, &grasp.patches[1]);
  grasp.axis = unit_or_zero(grasp.patches[1].place[0] - grasp.patches[0].place[0]);
}

// ---- a step ----------------------------------------------------------------------------------------------------------

std::int32_t Grasps::begin_tool(std::int32_t t, const Tool& tool, const OrganPose& organ, Operations* work) {
  Grasp& grasp = grasps_[t];
  const bool has_held = grasp.patches[0].rows_of >= 0 || grasp.patches[1].rows_of >= 0;
  for (GraspPatch& patch : grasp.patches) patch.rows_of = -1;
  slips_[t] = {};
  if (!has_grasp(tool)) {
    if (grasp.closed) forget_tool(t);
    return 0;
  }
  Pose pose;
  read_pose(grasp_of(tool).position, grasp_of(tool).orientation, &pose);  // checked with the tool's input
  grasp.position = organ.point_to_organ(pose.position);
  Mat3 axes = pose.axes;
  for (int j = 0; j < 3; ++j) {
    const Vec3 column = organ.vector_to_organ({axes.m[0][j], axes.m[1][j], axes.m[2][j]});
    for (int i = 0; i < 3; ++i) axes.m[i][j] = column[i];
  }
  const bool is_anew = grasp.closed && grasp.id != grasp_of(tool).id;
  if (grasp.closed != 1 || is_anew) {
    grasp.closed_position = grasp.position, grasp.closed_axes = axes;
    close(grasp, tool);
    *work += operations_to_close(field_->loads().count());
    if (is_anew && has_held) grasp.closed = Grasp::kClosesAnew;
  }
  grasp.turn = times_transposed(axes, grasp.closed_axes);
  if (grasp.state.condition == PALPATE_GRASP_LET_GO) return 0;
  grasp.state.condition = PALPATE_GRASP_HOLDS;
  if (grasp.closed == Grasp::kClosesAnew) return 0;
  return (grasp.patches[0].count > 0) + (grasp.patches[1].count > 0);
}

// Of the mean (part 0) or a gradient. The jaws close along the axis, which turns with the tool.
Vec3 Grasps::target(const Grasp& grasp, const Tool& tool, int p, int part) const {
  const GraspPatch& patch = grasp.patches[p];
  const Mat3 turn = without_one(grasp.turn);
  if (part > 0) return patch.before[part] + turn * patch.place[part];
  Vec3 to = patch.before[0] + turn * (patch.place[0] - grasp.closed_position) + grasp.position - grasp.closed_position;
  to += (p == 0 ? 0.5 : -0.5) * grasp_of(tool).closing * (grasp.turn * grasp.axis);
  return to - grasp.slipped;
}

std::uint32_t Grasps::add_rows(std::int32_t t, const Tool& tool, std::int32_t first, ContactRows& rows,
                               std::int32_t* made) {
  Grasp& grasp = grasps_[t];
  std::uint32_t flags = 0;
  *made = 0;
  if (!has_grasp(tool) || grasp.state.condition == PALPATE_GRASP_LET_GO) return flags;
  for (int p = 0; p < patches_of(grasp_of(tool)); ++p) {
    GraspPatch& patch = grasp.patches[p];
    if (patch.count == 0) {
      flags |= PALPATE_STEP_NOT_TOUCHABLE;
      continue;
    }
    if (grasp.closed == Grasp::kClosesAnew) continue;
    const ContactId contact = {ContactSource::tool, t, first + p};
    RowWish wishes[3] = {RowWish({contact, 0}), RowWish({contact, 1}), RowWish({contact, 2})};
    const std::int32_t parts = patch.has_gradients ? 3 : 1;
    for (int part = 0; part < parts; ++part) {
      RowWish& wish = wishes[part];
      wish.node = patch.node, wish.weight = patch.weight[part], wish.count = patch.count;
      wish.rows.local = patch.local[part], wish.rows.discs[0] = patch.discs[part];
      wish.target = target(grasp, tool, p, part);
    }
    patch.rows_of = rows.add(wishes, parts);
    *made += patch.rows_of >= 0;
    if (patch.rows_of < 0) flags |= PALPATE_STEP_CONTACTS_DROPPED;
  }
  return flags;
}

Vec3 Grasps::force_of(const Grasp& grasp, const TouchState& state) {
  Vec3 sum;
  for (const GraspPatch& patch : grasp.patches)
    if (patch.rows_of >= 0) sum += state.body->reaction(state, patch.rows_of);
  return sum;
}

// N: friction times what presses the jaws on the tissue: the stated clamp, or with two patches their own pressure, twice.
double Grasps::limit_of(const Grasp& grasp, const Tool& tool, const TouchState& state) {
  double clamp = grasp_of(tool).clamp_force;
  if (patches_of(grasp_of(tool)) == 2 && grasp.patches[0].rows_of >= 0 && grasp.patches[1].rows_of >= 0) {
    const Vec3 axis = grasp.turn * grasp.axis;
    clamp = std::max(0.0, dot(axis, state.body->reaction(state, grasp.patches[0].rows_of)) -
                              dot(axis, state.body->reaction(state, grasp.patches[1].rows_of)));
  }
  return std::isfinite(grasp_of(tool).friction) ? grasp_of(tool).friction * clamp : INFINITY;
}

// N: by how much the force exceeds the friction; zero where it does not.
Vec3 Grasps::excess_of(const Grasp& grasp, const Tool& tool, const TouchState& state) {
  if (!has_grasp(tool) || !std::isfinite(grasp_of(tool).friction)) return {};
  const Vec3 force = force_of(grasp, state);
  const double size = length(force), most = limit_of(grasp, tool, state);
  return size > most * (1 + kSlipsTo) ? (1 - most / size) * force : Vec3{};
}

bool Grasps::slip(TouchState& state) {
  const ToolInput& input = state.input;
  constexpr int most = 3 * SystemSolver::kMostMovedAlike;
  std::int32_t slipping[SystemSolver::kMostMovedAlike];
  SystemSolver::MovedAlike patches[SystemSolver::kMostMovedAlike];
  std::int32_t rows_of[SystemSolver::kMostMovedAlike][2];
  double stiffness[most * most], back[most];
  int count = 0;
  bool any_exceeds = false;
  for (std::int32_t t = 0; t < input.count(); ++t) {
    const Vec3 excess = excess_of(grasps_[t], input.tool(t), state);
    const bool exceeds = length(excess) > 0;
    // What has slipped in this step keeps its force while others slip. Held fast it would exceed its friction next, and they in turn.
    if (!is_finite(excess) || !(exceeds || slips_[t].has_slipped)) continue;
    any_exceeds = any_exceeds || exceeds;
    slips_[t].learn(force_of(grasps_[t], state), excess);
    for (int p = 0; p < 2; ++p) rows_of[count][p] = grasps_[t].patches[p].rows_of;
    patches[count].constraint = rows_of[count], patches[count].count = 2;
    store3(excess, back + 3 * count), slipping[count++] = t;
  }
  if (!any_exceeds) return false;
  state.body->measure_stiffness(state, patches, count, stiffness);
  solve_positive(3 * count, stiffness, back);
  for (int i = 0; i < count; ++i) {
    Grasp& grasp = grasps_[slipping[i]];
    const Vec3 way = slips_[slipping[i]].share * load3(back + 3 * i);
    if (!is_finite(way)) continue;
    grasp.slipped += way, slips_[slipping[i]].has_slipped = true;
    grasp.state.condition = PALPATE_GRASP_SLIPS;
    for (int p = 0; p < 2; ++p)
      if (grasp.patches[p].rows_of >= 0)
        state.rows.set_target(grasp.patches[p].rows_of, target(grasp, input.tool(slipping[i]), p, 0));
  }
  return true;
}

// Contacts that give way beside the grasp, or that conflict with it, are not as stiff as they were held to be, or stiffer. The bound: where a
// contact beside sticks in one solve and slips in the next, the share would else throw the grasp to many times its friction.
void Grasps::Slip::learn(Vec3 now, Vec3 excess) {
  constexpr double most = 1.5;
  if (const double expected = dot(wanted, wanted); expected > 0) {
    const double taken = dot(force - now, wanted) / expected;
    if (taken > 0) share = std::clamp(share / taken, 1 / most, most);
  }
  force = now, wanted = excess;
}

std::uint32_t Grasps::tell_forces(std::int32_t t, const Tool& tool, const TouchState& touch, Vec3 unit, Vec3* torque,
                                  Vec3* torque_along) {
  Grasp& grasp = grasps_[t];
  const OrganPose& organ = touch.organ;
  *torque = *torque_along = {};
  palpate_grasp_state& state = grasp.state;
  if (!has_grasp(tool)) return 0;
  const Vec3 reference = organ.point_to_organ(tool.reference);
  Vec3 force, moment, moment_along, centre = grasp.patches[0].place[0];
  const auto add = [&](Vec3 arm, Vec3 r) {
    moment += cross(arm, r);
    moment_along += cross(arm, dot(r, unit) * unit);
  };
  for (int p = 0; p < 2; ++p) {
    const GraspPatch& patch = grasp.patches[p];
    if (patch.rows_of < 0) continue;
    const Vec3 held = patch.place[0] - patch.before[0] + target(grasp, tool, p, 0),
               r = touch.body->reaction(touch, patch.rows_of);
    force += r, add(held - reference, r);
    if (p == 0) centre = held;
    for (int part = 1; part < 3 && patch.has_gradients; ++part)
      add(grasp.turn * patch.place[part], touch.body->reaction(touch, patch.rows_of + part));
  }
  *torque = moment, *torque_along = moment_along;
  store3(organ.vector_to_world(-1 * force), state.force);
  store3(organ.vector_to_world(-1 * moment), state.torque);
  store3(organ.point_to_world(centre), state.place);
  state.slipped = length(grasp.slipped);
  if (state.condition == PALPATE_GRASP_LET_GO) return 0;
  if (!is_finite(force)) return 0;
  state.friction_limit = limit_of(grasp, tool, touch);
  if (state.slipped > grasp_of(tool).radius) state.condition = PALPATE_GRASP_LET_GO;
  return length(excess_of(grasp, tool, touch)) > 0 ? std::uint32_t{PALPATE_STEP_SOLVE_INEXACT} : 0;
}

// ---- as a source of rows ---------------------------------------------------------------------------------------------

// Jaws hold the tissue that they have taken: where a cut divides it, the side that they touch.
void Grasps::follow_surface(const TouchedSurface& surface) {
  if (!surface.divided || surface.divided->made() == seen_) return;
  for (std::int32_t t = 0; t < most_tools_; ++t)
    for (GraspPatch& patch : grasps_[t].patches)
      follow_divided(*surface.divided, seen_, patch.middle, patch.radius, patch.node, patch.count);
  seen_ = surface.divided->made();
}

std::int32_t Grasps::begin(TouchStep& step) {
  follow_surface(step.state->surface);
  std::int32_t count = 0;
  for (std::int32_t t = 0; t < step.state->input.count(); ++t)
    count += begin_tool(t, step.state->input.tool(t), step.state->organ, &step.unasked);
  return count;
}

void Grasps::request_of_tool(TouchStep& step, std::int32_t t) {
  TouchState& state = *step.state;
  const Tool& tool = state.input.tool(t);
  std::int32_t made = 0;
  if (const std::uint32_t flags = add_rows(t, tool, tool.point_count + tool.grip_count, state.rows, &made))
    step.raise(t, flags);
  const ContactConstraints& set = state.rows.set();
  for (std::int32_t p = 0; made > 0 && p < set.constraint_count; ++p) {
    const ContactConstraint& constraint = set.constraints[p];
    const ContactId& contact = constraint.id.contact;
    if (!is_of_tool(contact) || contact.index != t || constraint.id.part != 0 || is_of_point(step, contact)) continue;
    if (!state.solver.matrix().holds(set, p)) state.admission.pay();
    step.count_contact(t, set.target[p] - step.moved(set, constraint));
  }
}

bool Grasps::asks_again(TouchStep& step) {
  return slip(*step.state);
}

void Grasps::take_reactions(TouchStep& step, bool) {
  TouchState& state = *step.state;
  for (std::int32_t t = 0; t < state.input.count(); ++t) {
    Vec3 torque, torque_along;
    const Tool& tool = state.input.tool(t);
    ToolResult& result = step.result[t];
    if (const std::uint32_t flags = tell_forces(t, tool, state, result.direction.unit, &torque, &torque_along))
      step.raise(t, flags);
    if (!tool.has_torque || !is_finite(torque)) continue;
    result.sum.moment += torque;
    result.sum.moment_along += torque_along;
  }
}

void Grasps::tell(TouchStep& step, EventSink& to) {
  const TouchState& state = *step.state;
  for (std::int32_t t = 0; t < step.context->def.max_tools; ++t) {
    const Tool& tool = state.input.tool(t);
    if (tool.index < 0) continue;  // its end has been told
    HeldEvent held;
    held.hold = hold_of(grasps_[t].state.condition), held.closing = has_grasp(tool) ? grasp_of(tool).id : 0;
    if (has_grasp(tool)) {
      held.surface_point = surface_point_of(grasp_of(tool).triangle, grasp_of(tool).barycentric);
      held.place = state.organ.point_to_organ(load3(grasps_[t].state.place));
    }
    to.tell_held(t, held);
  }
}

}  // namespace palpate
