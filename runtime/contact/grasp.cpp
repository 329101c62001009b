#include "runtime/contact/grasp.h"

#include <algorithm>
#include <cmath>

#include "runtime/contact/contact_laws.h"

#include "runtime/contact/touch_step.h"

namespace palpate {
namespace {

// A grasp slips until its force is within this share of its friction, in the step in which it came beyond it.
constexpr double kSlipsTo = 1e-3;

int patches_of(const palpate_grasp& grasp) {
  return grasp.opposite_triangle >= 0 ? 2 : 1;
}

Mat3 without_one(Mat3 turn) {
  for (int i = 0; i < 3; ++i) turn.m[i][i] -= 1;
  return turn;
}

}  // namespace

bool Grasps::create(SceneMemory& memory, const DiscSource& source, std::int32_t max_tools, std::int32_t most_nodes,
                    const DisplacementField* field) {
  source_ = source, field_ = field, most_nodes_ = most_nodes;
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
  const palpate_grasp& from = tool.grasp;
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
  if (!tool.has_grasp) {
    if (grasp.closed) forget_tool(t);
    return 0;
  }
  Pose pose;
  read_pose(tool.grasp.position, tool.grasp.orientation, &pose);  // checked with the tool's input
  grasp.position = organ.point_to_organ(pose.position);
  Mat3 axes = pose.axes;
  for (int j = 0; j < 3; ++j) {
    const Vec3 column = organ.vector_to_organ({axes.m[0][j], axes.m[1][j], axes.m[2][j]});
    for (int i = 0; i < 3; ++i) axes.m[i][j] = column[i];
  }
  const bool is_anew = grasp.closed && grasp.id != tool.grasp.id;
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
  to += (p == 0 ? 0.5 : -0.5) * tool.grasp.closing * (grasp.turn * grasp.axis);
  return to - grasp.slipped;
}

std::uint32_t Grasps::add_rows(std::int32_t t, const Tool& tool, std::int32_t first, ContactRows& rows,
                               std::int32_t* made) {
  Grasp& grasp = grasps_[t];
  std::uint32_t flags = 0;
  *made = 0;
  if (!tool.has_grasp || grasp.state.condition == PALPATE_GRASP_LET_GO) return flags;
  for (int p = 0; p < patches_of(tool.grasp); ++p) {
    GraspPatch& patch = grasp.patches[p];
    if (patch.count == 0) {
      flags |= PALPATE_STEP_NOT_TOUCHABLE;
      continue;
    }
    if (grasp.closed == Grasp::kClosesAnew) continue;
    GraspWish wish;
    wish.tool = t, wish.point = first + p, wish.node = patch.node, wish.count = patch.count;
    wish.parts = patch.has_gradients ? 3 : 1, wish.discs = patch.discs;
    for (int part = 0; part < wish.parts; ++part) {
      wish.weight[part] = patch.weight[part], wish.local[part] = patch.local[part];
      wish.target[part] = target(grasp, tool, p, part);
    }
    patch.rows_of = rows.add_grasp(wish);
    *made += patch.rows_of >= 0;
    if (patch.rows_of < 0) flags |= PALPATE_STEP_CONTACTS_DROPPED;
  }
  return flags;
}

Vec3 Grasps::force_of(const Grasp& grasp, const ContactSolver& solver) {
  Vec3 sum;
  for (const GraspPatch& patch : grasp.patches)
    if (patch.rows_of >= 0) sum += solver.reaction(patch.rows_of);
  return sum;
}

// N: friction times what presses the jaws on the tissue: the stated clamp, or with two patches their own pressure, twice.
double Grasps::limit_of(const Grasp& grasp, const Tool& tool, const ContactSolver& solver) {
  double clamp = tool.grasp.clamp_force;
  if (patches_of(tool.grasp) == 2 && grasp.patches[0].rows_of >= 0 && grasp.patches[1].rows_of >= 0) {
    const Vec3 axis = grasp.turn * grasp.axis;
    clamp = std::max(0.0, dot(axis, solver.reaction(grasp.patches[0].rows_of)) -
                              dot(axis, solver.reaction(grasp.patches[1].rows_of)));
  }
  return std::isfinite(tool.grasp.friction) ? tool.grasp.friction * clamp : INFINITY;
}

bool Grasps::slips(std::int32_t t, const Tool& tool, const ContactSolver& solver, ContactRows& rows) {
  Grasp& grasp = grasps_[t];
  if (!tool.has_grasp || !std::isfinite(tool.grasp.friction)) return false;
  const Vec3 force = force_of(grasp, solver);
  const double size = length(force), most = limit_of(grasp, tool, solver);
  if (!(size > most * (1 + kSlipsTo))) return false;
  // Back by what the mean of the patches gives way under the excess, if nothing else holds it.
  Mat3 stiffness, own;
  for (const GraspPatch& patch : grasp.patches) {
    if (patch.rows_of < 0) continue;
    own = solver.compliance_between_nodes(rows.set(), patch.rows_of, patch.rows_of);
    add_scaled(own, 1, patch.local[0]);
    for (int j = 0; j < 3; ++j) {
      const Vec3 column = solve3(own, {j == 0 ? 1.0 : 0.0, j == 1 ? 1.0 : 0.0, j == 2 ? 1.0 : 0.0});
      for (int i = 0; i < 3; ++i) stiffness.m[i][j] += column[i];
    }
  }
  const Vec3 back = (1 - most / size) * solve3(stiffness, force);
  if (!is_finite(back)) return false;
  grasp.slipped += back;
  grasp.state.condition = PALPATE_GRASP_SLIPS;
  for (int p = 0; p < 2; ++p)
    if (grasp.patches[p].rows_of >= 0) rows.set_target(grasp.patches[p].rows_of, target(grasp, tool, p, 0));
  return true;
}

void Grasps::tell_forces(std::int32_t t, const Tool& tool, const ContactSolver& solver, const OrganPose& organ,
                         Vec3 unit, Vec3* torque, Vec3* torque_along) {
  Grasp& grasp = grasps_[t];
  *torque = *torque_along = {};
  palpate_grasp_state& state = grasp.state;
  if (!tool.has_grasp) return;
  const Vec3 reference = organ.point_to_organ(tool.reference);
  Vec3 force, moment, moment_along, centre = grasp.patches[0].place[0];
  const auto add = [&](Vec3 arm, Vec3 r) {
    moment += cross(arm, r);
    moment_along += cross(arm, dot(r, unit) * unit);
  };
  for (int p = 0; p < 2; ++p) {
    const GraspPatch& patch = grasp.patches[p];
    if (patch.rows_of < 0) continue;
    const Vec3 held = patch.place[0] - patch.before[0] + target(grasp, tool, p, 0), r = solver.reaction(patch.rows_of);
    force += r, add(held - reference, r);
    if (p == 0) centre = held;
    for (int part = 1; part < 3 && patch.has_gradients; ++part)
      add(grasp.turn * patch.place[part], solver.reaction(patch.rows_of + part));
  }
  *torque = moment, *torque_along = moment_along;
  store3(organ.vector_to_world(-1 * force), state.force);
  store3(organ.vector_to_world(-1 * moment), state.torque);
  store3(organ.point_to_world(centre), state.place);
  state.slipped = length(grasp.slipped);
  if (state.condition == PALPATE_GRASP_LET_GO) return;
  if (!is_finite(force)) return;
  state.friction_limit = limit_of(grasp, tool, solver);
  if (state.slipped > tool.grasp.radius) state.condition = PALPATE_GRASP_LET_GO;
}

// ---- as a source of rows ---------------------------------------------------------------------------------------------

std::int32_t Grasps::begin(TouchStep& step) {
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
    if (constraint.tool != t || constraint.part != 0 || !is_of_grasp(step, t, constraint.point)) continue;
    if (!state.solver.holds(set, p)) state.admission.pay();
    step.count_contact(t, set.target[p] - step.moved(set, constraint));
  }
}

bool Grasps::asks_again(TouchStep& step) {
  bool again = false;
  for (std::int32_t t = 0; t < step.state->input.count(); ++t)
    again = slips(t, step.state->input.tool(t), step.state->solver, step.state->rows) || again;
  return again;
}

void Grasps::take_reactions(TouchStep& step, bool) {
  TouchState& state = *step.state;
  for (std::int32_t t = 0; t < state.input.count(); ++t) {
    Vec3 torque, torque_along;
    const Tool& tool = state.input.tool(t);
    ToolResult& result = step.result[t];
    tell_forces(t, tool, state.solver, state.organ, result.direction.unit, &torque, &torque_along);
    if (!tool.has_torque || !is_finite(torque)) continue;
    result.sum.moment += torque;
    result.sum.moment_along += torque_along;
  }
}

void Grasps::report(TouchStep& step) {
  TouchState& state = *step.state;
  for (std::int32_t t = 0; t < step.context->def.max_tools; ++t) {
    const Tool& tool = state.input.tool(t);
    if (tool.index < 0) continue;  // hold_tool() has told its end
    HeldEvent held;
    held.condition = grasps_[t].state.condition, held.closing = tool.has_grasp ? tool.grasp.id : 0;
    if (tool.has_grasp) {
      held.surface_point = surface_point_of(tool.grasp.triangle, tool.grasp.barycentric);
      held.place = state.organ.point_to_organ(load3(grasps_[t].state.place));
    }
    state.report.tell_grasp(t, held);
  }
}

}  // namespace palpate
