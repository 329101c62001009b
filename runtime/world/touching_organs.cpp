#include "runtime/world/touching_organs.h"

#include <algorithm>
#include <cmath>

#include "runtime/contact/touch_solve.h"
#include "runtime/include/palpate/palpate_world_pairs.h"

namespace palpate {
namespace {

// The pair of a fixed vertex gives way by this share of the compliance that the other organ has there. Without it the system would be
// singular where more fixed vertices lie on the other organ than it has nodes there. So a fixed vertex sinks in by this share of what its
// force presses.
constexpr double kGive = 0.05;
// In mean edges of the other organ: a pair that gives way by more is told.
constexpr double kTold = 0.1;

// Steps for which a pair that has ceased to press keeps its friction. So a pair that presses in every second step holds as firmly as a pair
// that presses in every step.
constexpr std::int16_t kRubs = 10;

}  // namespace

bool TouchingOrgans::create(SceneMemory& memory, palpate_scene* const* organs, std::int32_t count,
                            std::int32_t most_pairs, double friction, std::int32_t most_links) {
  organs_ = organs, friction_ = friction;
  const std::int32_t shared = most_pairs + most_links;
  std::int32_t rows = 3 * shared, constraints = shared, rows_of_organ = 0;
  for (std::int32_t k = 0; k < count; ++k) {
    const std::int32_t of_organ = organs[k]->touch.rows.set().constraint_capacity;
    rows += 3 * (of_organ - shared), constraints += of_organ - shared;
    rows_of_organ = std::max(rows_of_organ, 3 * of_organ);
  }
  const std::uint64_t before = memory.bytes();
  if (most_pairs > 0 && !search_.create(memory, organs, count, most_pairs, friction)) return false;
  search_bytes_ = memory.bytes() - before;
  if (most_links > 0 && !links_.create(memory, organs, count, most_links)) return false;
  link_bytes_ = memory.bytes() - before - search_bytes_;
  for (JointPair** array : {&pairs_, &together_}) *array = memory.array<JointPair>(static_cast<std::size_t>(shared));
  number_ = memory.array<std::int32_t>(static_cast<std::size_t>(shared));
  link_of_ = memory.array<std::int32_t>(static_cast<std::size_t>(most_links));
  if (!joint_.create(memory, count, rows_of_organ, rows, constraints)) return false;
  solver_bytes_ = memory.bytes() - before - search_bytes_ - link_bytes_;
  organ_count_ = count;
  return !memory.failed();
}

void TouchingOrgans::say_overlaps() const {
  for (std::int32_t g = 0; g < search_.group_count(); ++g) {
    const OrganGroup& group = search_.group_at(g);
    std::int32_t vertices = 0;
    const double largest = search_.largest_overlap(g, &vertices);
    if (vertices > 0)
      organs_[group.a]->context.bundle.log.say(
          PALPATE_LOG_NOTE,
          "world: organs %d and %d overlap by up to %.3g mm at %d vertices as they stand; this counts as touching",
          static_cast<int>(group.a), static_cast<int>(group.b), 1e3 * largest, static_cast<int>(vertices));
  }
}

void TouchingOrgans::forget() {
  if (has_pairs()) search_.forget();
  links_.forget();
}

void TouchingOrgans::begin(std::int32_t organ, const palpate_tool* tools, std::int32_t tool_count, double dt,
                           palpate_contacts& out) {
  begin_touch(step_[organ], organs_[organ]->context, touch(organ), tools, tool_count, dt, out);
}

// ---- the rows of pairs -----------------------------------------------------------------------------------------------

ContactLaw TouchingOrgans::law_of(const OrganPair& pair) const {
  return search_.rubs(pair) ? ContactLaw::coulomb : ContactLaw::unilateral;
}

// The constraint of one side; -1: it does not move.
std::int32_t TouchingOrgans::request_side(const OrganPair& pair, int side) {
  const OrganGroup& group = search_.group(pair);
  const std::int32_t organ = side == 0 ? group.a : group.b, other = side == 0 ? group.b : group.a;
  TouchState &own = touch(organ), &second = touch(group.b);
  std::int32_t node[3] = {pair.vertex}, count = side == 0 && own.column_of_node[pair.vertex] >= 0;
  double weight[3] = {1};
  if (side == 1) {
    // A vertex without a column stands still: its weight is the support's.
    const std::int32_t* const corner = second.tree.corners(pair.triangle);
    for (int v = 0; v < 3; ++v)
      if (second.column_of_node[corner[v]] >= 0 && pair.barycentric[v] > 0)
        node[count] = corner[v], weight[count++] = pair.barycentric[v];
  }
  if (count == 0) return -1;
  // The first row is along the force that the other organ exerts.
  Vec3 row[3] = {pair.normal, pair.tangent, cross(pair.normal, pair.tangent)};
  for (Vec3& axis : row)
    axis = side == 1 ? -1 * axis : own.organ.pose().turned_to_body(second.organ.pose().turned_to_world(axis));
  RowWish wish({{kPairSource, other, (group.second ? 1 << 25 : 0) + pair.vertex}, 0});
  wish.node = node, wish.weight = weight, wish.count = count;
  wish.rows.law = law_of(pair), wish.rows.friction = friction_;
  wish.rows.axes = wish.rows.law == ContactLaw::coulomb ? 7 : 1;
  wish.set_frame(row);
  return own.rows.add_reserved(wish);
}

// Each organ gets its pairs in ascending order: the groups ascend, and so do the other organ's number and the vertices in them.
void TouchingOrgans::request_pairs() {
  for (std::int32_t i = 0; i < search_.count(); ++i) {
    const OrganPair& pair = search_.pair(i);
    JointPair& joint = pairs_[i] = JointPair{};
    const OrganGroup& group = search_.group(pair);
    joint.organ[0] = group.a, joint.organ[1] = group.b;
    for (int side = 0; side < 2; ++side) joint.constraint[side] = request_side(pair, side);
    joint.law = law_of(pair), joint.friction = friction_;
    if (joint.constraint[0] < 0 && joint.constraint[1] >= 0) {
      // A place that is partly fixed gives way like one that is not: its own compliance is smaller by the square of what moves.
      const double moves = moving_share(touch(group.b), pair);
      joint.give = kGive / (moves * moves);
    }
    joint.reaction = pair.reaction;
  }
}

// The constraints of an organ, with what its offset leaves for the contacts.
const ContactConstraints& TouchingOrgans::acting(std::int32_t organ) {
  TouchState& own = touch(organ);
  return own.offset.acting(own.rows.set());
}

// Two held places: there is nothing to solve.
bool TouchingOrgans::is_held_pair(std::int32_t i) const {
  return i < search_.count() && pairs_[i].constraint[0] < 0 && pairs_[i].constraint[1] < 0;
}

// ---- the solve -------------------------------------------------------------------------------------------------------

std::uint32_t TouchingOrgans::solve_slipping(const std::int32_t* members, std::int32_t count, std::int32_t pair_count,
                                             Operations operations) {
  bool met = true;
  for (int solve = 0; solve < kMostSlipSolves; ++solve) {
    // A grasp that slips has moved its targets.
    for (std::int32_t m = 0; m < count && solve > 0; ++m) acting(members[m]);
    met = joint_.solve(member_, count, together_, pair_count, operations);
    sweeps_ += joint_.effort().sweeps + joint_.effort().newton_steps;
    bool slips = false;
    for (std::int32_t m = 0; m < count && solve + 1 < kMostSlipSolves; ++m)
      slips = sources_ask_again(step_[members[m]]) || slips;
    if (!slips) break;
  }
  return met ? 0u : static_cast<std::uint32_t>(PALPATE_STEP_SOLVE_INEXACT);
}

// m, for the contacts: without what offsets do.
Vec3 TouchingOrgans::target_of(std::int32_t i) {
  if (i >= search_.count()) return pairs_[i].target;
  const OrganPair& pair = search_.pair(i);
  return search_.target(pair) - search_.moved_apart(pair);
}

// members: organs that touch one another or that links join, directly or through others.
std::uint32_t TouchingOrgans::solve_together(const std::int32_t* members, std::int32_t count) {
  std::int32_t place[PALPATE_MAX_ORGANS];
  std::fill(place, place + PALPATE_MAX_ORGANS, -1);
  Operations operations = 0;
  bool prepared = true;
  for (std::int32_t m = 0; m < count; ++m) {
    TouchState& own = touch(members[m]);
    place[members[m]] = m;
    member_[m] = {&own.solver, &acting(members[m]), own.force};
    is_joint_[members[m]] = true;
    prepared = own.solver.prepare(organs_[members[m]]->context.tensors, *member_[m].set, &own.work) && prepared;
    operations += own.work.left();
  }
  if (!prepared) {
    for (std::int32_t m = 0; m < count; ++m) {
      TouchState& own = touch(members[m]);
      own.solver.forget();
      std::fill(own.force, own.force + own.rows.set().node_count, Vec3{});
      std::fill(own.modified, own.modified + own.rows.set().node_count, Vec3{});
      outcome_[members[m]] = ContactSolver::Outcome::unsolved;
    }
    return PALPATE_STEP_UNSOLVED;
  }
  std::int32_t pair_count = 0;
  for (std::int32_t i = 0; i < search_.count() + acting_links_; ++i) {
    if (place[pairs_[i].organ[0]] < 0 || is_held_pair(i)) continue;
    together_[pair_count] = pairs_[i], number_[pair_count] = i;
    for (std::int32_t& organ : together_[pair_count].organ) organ = place[organ];
    ++pair_count;
  }
  for (std::int32_t q = 0; q < pair_count; ++q) together_[q].target = pairs_[number_[q]].target = target_of(number_[q]);
  const std::uint32_t flags = solve_slipping(members, count, pair_count, operations);
  take_reactions(members, count);
  for (std::int32_t q = 0; q < pair_count; ++q) {
    JointPair& pair = pairs_[number_[q]];
    pair.reaction = together_[q].reaction, pair.gap = -pair.target.x;
    for (int side = 0; side < 2; ++side)
      if (const std::int32_t p = pair.constraint[side]; p >= 0) pair.gap += touch(pair.organ[side]).solver.reached(p).x;
  }
  return flags;
}

// To the organ alone, a pair is what the solution has made of it.
void TouchingOrgans::take_reactions(const std::int32_t* members, std::int32_t count) {
  for (std::int32_t m = 0; m < count; ++m) {
    TouchState& own = touch(members[m]);
    const ContactConstraints& set = own.rows.set();
    const auto is_pair = [&](std::int32_t p) { return is_between_organs(set.constraints[p].id.contact); };
    for (std::int32_t p = 0; p < set.constraint_count; ++p)
      if (is_pair(p)) own.rows.set_target(p, {});
    const ContactConstraints& unmoved = acting(members[m]);
    for (std::int32_t p = 0; p < set.constraint_count; ++p)
      if (is_pair(p)) own.rows.set_target(p, own.solver.reached(p) - unmoved.target[p]);
    outcome_[members[m]] = own.solver.take_reactions(acting(members[m]), joint_.effort(), own.force, own.modified);
  }
}

std::uint32_t TouchingOrgans::find_pairs() {
  if (!has_pairs()) return 0;
  const std::uint32_t flags = search_.search();
  request_pairs();
  return flags;
}

std::uint32_t TouchingOrgans::request_links() {
  const std::uint32_t flags = links_.request();
  acting_links_ = 0;
  for (std::int32_t l = 0; l < links_.count(); ++l)
    if (links_.joint(l, &pairs_[search_.count() + acting_links_])) link_of_[acting_links_++] = l;
  return flags;
}

std::uint32_t TouchingOrgans::solve() {
  std::uint32_t flags = 0;
  sweeps_ = 0;
  // Organs that touch or that a link joins get the number of the first one of them.
  std::int32_t label[PALPATE_MAX_ORGANS];
  bool touches[PALPATE_MAX_ORGANS] = {};
  for (std::int32_t k = 0; k < organ_count_; ++k) label[k] = k, is_joint_[k] = false;
  const auto join = [&](std::int32_t a, std::int32_t b) {
    const std::int32_t one = label[a], other = label[b];
    for (std::int32_t k = 0; k < organ_count_ && one != other; ++k)
      if (label[k] == std::max(one, other)) label[k] = std::min(one, other);
  };
  for (std::int32_t i = 0; i < search_.count() + acting_links_; ++i) {
    if (is_held_pair(i)) {
      pairs_[i].gap = search_.moved_apart(search_.pair(i)).x - search_.target(search_.pair(i)).x;
      flags |= PALPATE_STEP_NOT_TOUCHABLE;
      continue;
    }
    const std::int32_t* const organ = pairs_[i].organ;
    touches[organ[0]] = touches[organ[1]] = true;
    join(organ[0], organ[1]);
    if (pairs_[i].joined) join(organ[0], pairs_[i - 1].organ[0]);
  }
  for (std::int32_t first = 0; first < organ_count_; ++first) {
    std::int32_t members[PALPATE_MAX_ORGANS], count = 0;
    for (std::int32_t k = 0; k < organ_count_; ++k)
      if (touches[k] && label[k] == first) members[count++] = k;
    if (count > 0) flags |= solve_together(members, count);
  }
  for (std::int32_t i = 0; i < search_.count(); ++i) {
    OrganPair& pair = search_.pair(i);
    const Vec3 r = pair.reaction = is_finite(pairs_[i].reaction) ? pairs_[i].reaction : Vec3{};
    const GivesWay gone = gives_way(pairs_[i].law, friction_, 0, r);
    if (pairs_[i].gap < -kTold * touch(search_.group(pair).b).tree.mean_edge()) flags |= PALPATE_STEP_NOT_TOUCHABLE;
    const bool presses = !gone.released, sticks = search_.rubs(pair) && presses && !gone.slips;
    if (presses && search_.rubs(pair) && search_.is_steep(pair)) flags |= PALPATE_STEP_FRICTION_JAMS;
    pair.slips = 0, pair.rubs = presses ? kRubs : std::max<std::int16_t>(1, pair.rubs) - 1;
    if (!sticks) search_.let_slip(i);
  }
  return flags;
}

// By how much a link with a force misses its target in the solution. The organs' own solvers take what it has been given for its target.
bool TouchingOrgans::is_missed(std::int32_t l) const {
  const JointPair* const links = pairs_ + search_.count();
  const JointPair& link = links[l];
  const bool one_row = link.law != ContactLaw::sticking;
  if (link.law == ContactLaw::unilateral && !(link.reaction.x > 0)) return false;
  Vec3 missed, target;
  do {  // the parts of a thread have one row
    target += links[l].target;
    for (int side = 0; side < 2; ++side)
      if (const std::int32_t p = links[l].constraint[side]; p >= 0)
        missed += touch(links[l].organ[side]).solver.reached(p);
  } while (++l < acting_links_ && links[l].joined);
  missed = missed - target;
  const double most = SystemSolver::kMet * length(target) + SystemSolver::kLeastMiss;
  return !((one_row ? std::fabs(missed.x) : length(missed)) <= most);
}

std::uint32_t TouchingOrgans::end_links(std::uint64_t step) {
  bool solved[PALPATE_MAX_ORGANS] = {};
  for (std::int32_t k = 0; k < organ_count_; ++k)
    solved[k] = !is_joint_[k] || outcome_[k] != ContactSolver::Outcome::unsolved;
  std::uint32_t flags = 0;
  for (std::int32_t l = 0; l < acting_links_; ++l) {
    const JointPair& link = pairs_[search_.count() + l];
    links_.take_reaction(link_of_[l], link.reaction);
    if (solved[link.organ[0]] && solved[link.organ[1]] && !link.joined && is_missed(l))
      flags |= PALPATE_STEP_REGULARISED;
  }
  return flags | links_.end(solved, step);
}

std::uint32_t TouchingOrgans::finish(std::int32_t organ) {
  return finish_touch(step_[organ], is_joint_[organ] ? outcome_ + organ : nullptr);
}

void TouchingOrgans::write_pair(std::int32_t i, palpate_world_pair* out) {
  const OrganPair& pair = search_.pair(i);
  const OrganGroup& group = search_.group(pair);
  const Pose& pose = touch(group.b).organ.pose();
  *out = palpate_world_pair{};
  out->organ[0] = group.a, out->organ[1] = group.b;
  out->node = pair.vertex, out->triangle = pair.triangle;
  std::copy(pair.barycentric, pair.barycentric + 3, out->barycentric);
  store3(pose.to_world(search_.place_at_rest(pair)), out->place);
  store3(pose.turned_to_world(pair.normal), out->normal);
  const Vec3 force = pair.reaction.x * pair.normal + pair.reaction.y * pair.tangent +
                     pair.reaction.z * cross(pair.normal, pair.tangent);
  store3(pose.turned_to_world(force), out->force);
  const double area = search_.area(pair);
  out->pressure = area > 0 ? pair.reaction.x / area : 0;
  out->gap = pairs_[i].gap;
  out->overlap = pair.overlap;
}

}  // namespace palpate
