#include "runtime/contact/collision.h"

#include <algorithm>

namespace palpate {
namespace {

// Whether a place, in the frame of the surface at rest, is on the outer side of the anchor's plane.
bool is_over_anchor(const PointState& state, Vec3 at) {
  return dot(at - state.anchor_at_rest, state.outward) >= 0;
}

// Two faces whose outward normals differ by more than 120 degrees are the two sides of a thin part (cosine).
constexpr double kOppositeFaces = -0.5;
// Mean edges within which the nearest point is looked for.
constexpr double kReach = 4;
// m: a disc that is nearer to its tool stays, so that a tool at rest comes to rest. A push changes by less than a millionth over it.
constexpr double kStill = 1e-8;
// An anchor slides by at most this many buckets in one step.
constexpr int kMostSlides = 8;

// Whether the point, or the surface, may have moved by the point's whole distance to the surface since it was tested.
// sunk: m, how far the place where a disc meets the surface may have moved against the surface since the clearance was measured.
bool may_have_reached(const Clearance& clear, Vec3 p, double path, double sunk) {
  return !(length(p - clear.at) + clear.per_path * (path - clear.path) + sunk < clear.distance);
}

}  // namespace

void Collision::create(SceneMemory& memory, DeformedSurface* surface, SurfaceIndex* rest, SurfaceField* field,
                       StepWork* work) {
  memory.keep(turns_);
  surface_ = surface, rest_ = rest, field_ = field, work_ = work;
  overshoot_ = surface->overshoot();
}

// m, within which the nearest surface point is looked for. Where none is found, nothing of the surface has passed the point.
double Collision::reach(double moved) const {
  return std::max(kReach * surface_->tree().mean_edge(), 2 * moved);
}

// m, an estimate of how far other contacts may have moved the place where this point's disc meets the surface: while the disc moves by its
// radius, that place moves by no more than the longest way on which another contact holds the surface.
double Collision::may_have_sunk(const PointState& state, Vec3 p, const ContactId& contact) const {
  if (state.disc.radius == 0 || (!surface_->may_sink(contact) && is_zero(state.disc.sunk))) return 0;
  const double deepest = surface_->deepest_but(contact);
  return std::min(deepest + length(state.disc.sunk), surface_->sum_of_changes() - state.clear.changes +
                                                         length(p - state.clear.at) / state.disc.radius * deepest);
}

void Collision::begin() {
  surface_->take_work();
  turns_.begin();
}

// For queries about a contact that may change, if it changes then. The first contact that changes in a step may take what tests have left
// of their share and of the others'.
Operations Collision::room_to_change(Operations least) const {
  return (work_->paid_changes() == 0 ? work_->first_change_left(least) : work_->changes_left(least)) - next_.change;
}

// Runs a test where the step's work allows it. A test that comes first has all that tests have: where that does not suffice, the
// others have their turn before it comes again.
template <class Run>
Collision::Test Collision::take_turn(const ContactId& contact, Operations room, Run run) {
  work_->add(surface_->take_work());
  const bool first = turns_.is_first();
  Test test = Test::unfinished;
  room = std::min(work_->tests_left(), room) - overshoot_;
  if (turns_.take(contact.index, contact.point, room > 0)) {
    surface_->limit_work(room);
    test = run();
    work_->add(surface_->take_work());
    if (test == Test::unfinished && !first) turns_.put_off(contact.index, contact.point);
  }
  if (test == Test::unfinished) work_->defer();
  return test;
}

bool Collision::move(PointState& state, Vec3 p, const ContactId& contact, bool hold, const TrackingLimits& limits) {
  bool followed = true;
  if (state.known && length(p - state.last) > (1 + state.waited) * limits.farthest) {
    if (state.contact && field_) field_->end(contact);
    state = PointState{};
    followed = false;
  }
  if (!state.known) {
    if (take_turn(contact, work_->tests_left(), [&] { return see_first(state, p); }) == Test::unfinished)
      return followed;
  } else if (state.contact) {
    followed = move_in_contact(state, p, contact, hold, limits.release);
  } else {
    if (may_have_reached(state.clear, p, surface_->path(), may_have_sunk(state, p, {}))) {
      const Operations room = state.inside ? work_->tests_left() : room_to_change(next_.least);
      const Test test = take_turn(contact, room, [&] { return test_free(state, p); });
      if (test == Test::unfinished) {
        state.unseen += surface_->largest_move(), ++state.waited;
        return followed;
      }
      followed = test == Test::done;
    }
    state.unseen = 0, state.waited = 0;
  }
  state.last = p;
  work_->add(surface_->take_work());
  return followed;
}

// A point that is inside when it is first seen touches nothing until it has been outside.
Collision::Test Collision::see_first(PointState& state, Vec3 p) {
  const bool inside = surface_->is_inside({}, p);
  if (!surface_->finished()) return Test::unfinished;
  state.known = true;
  state.inside = inside;
  state.clear = {};
  return Test::done;
}

// Where the test was put off, how the surface moved before the last step is known by its bound alone: the crossings are those of
// its last way, and the side at the end decides whether there is a contact.
Collision::Test Collision::test_free(PointState& state, Vec3 p) {
  double moved = length(p - state.last) + surface_->largest_move() + state.unseen;
  // How far other contacts have sunk the disc counts as a way of the surface: both ends of the point's way are taken less the `sunk` of
  // this step. `sunk` is computed twice, at the place nearest to the point and then at the place nearest to the disc. It does not begin with
  // the `sunk` of an earlier step, so that forces do not depend on whether the last step tested the point.
  // Not beyond the box around the surface: such a tool may be far (TouchStep::far), and its points are not looked at.
  NearestPoint nearest = surface_->nearest({}, p, reach(moved + length(state.disc.sunk)));
  Vec3 sunk;
  bool lacks_nodes = false;
  const bool sinks = state.disc.radius > 0 && surface_->may_sink({}) && surface_->may_hold(p, p);
  for (int turn = 0; sinks && turn < 2 && nearest.surface_point.triangle >= 0; ++turn) {
    sunk = surface_->below_disc({}, nearest.surface_point, state.disc.radius, &lacks_nodes);
    nearest = surface_->nearest({}, p - sunk, reach(moved + length(sunk - state.disc.sunk)));
  }
  moved += length(sunk - state.disc.sunk);
  const Vec3 at = p - sunk, from = state.last - sunk;
  const bool over_held = lacks_nodes && length(sunk) > 0, in_surface = over_held && surface_->is_inside({}, p);
  if (!surface_->finished()) return Test::unfinished;
  Clearance clear = {p, nearest.distance, nearest.per_path, surface_->path(), surface_->sum_of_changes()};
  if (over_held) clear.distance = 0;  // whether the point is in the surface is asked in each step
  // The nearest surface is farther away than it and the point together have moved: the side is as before. A contact that has ended
  // tells the side of the surface that was predicted without it.
  if (nearest.distance > moved && !state.has_ended) {
    state.clear = clear, state.disc.sunk = sunk, state.disc.over_held = over_held,
    state.disc.in_surface = in_surface && !state.inside;
    return Test::done;
  }
  SurfaceCrossing crossing[DeformedSurface::kMaxCrossings];
  const int found = surface_->crossings(from, at, crossing);
  bool now_inside = !nearest.outside;
  // Where the crossings and the nearest triangle disagree, as where the surface overlaps itself, or the crossings are not all known, the
  // winding number decides.
  const bool knows_all = !state.has_ended && state.waited == 0;
  if (surface_->finished() && !(knows_all && now_inside == (state.inside != (found % 2 == 1))))
    now_inside = surface_->is_inside({}, at);
  if (!surface_->finished()) return Test::unfinished;
  state.clear = clear, state.disc.sunk = sunk, state.disc.over_held = over_held,
  state.disc.in_surface = in_surface && !now_inside;
  state.has_ended = false;
  bool followed = true;
  if (!state.inside)
    followed = look_for_contact(state, crossing, std::min(found, DeformedSurface::kMaxCrossings), at - from, now_inside,
                                nearest);
  state.inside = now_inside;
  return followed ? Test::done : Test::lost;
}

// A contact begins at the last crossing into the organ without a crossing out again. A way out through an opposite face does not
// count, because the surface has then passed the point by the whole thickness of a part: the contact holds it. Where the point
// itself has moved that far, it has jumped through the organ and is not followed: false.
bool Collision::look_for_contact(PointState& state, const SurfaceCrossing* crossing, int count, Vec3 way,
                                 bool now_inside, const NearestPoint& nearest) {
  int entry = -1;
  bool through = false;
  for (int c = 0; c < count && !through; ++c) {
    if (crossing[c].entering) {
      if (entry < 0) entry = c;
    } else if (entry >= 0) {
      const Vec3 in = surface_->tree().outward_at_rest(crossing[entry].surface_point.triangle),
                 out = surface_->tree().outward_at_rest(crossing[c].surface_point.triangle);
      through = dot(in, out) < kOppositeFaces;
      if (through && (crossing[c].time - crossing[entry].time) * length(way) > surface_->largest_move()) return false;
      if (!through) entry = -1;
    }
  }
  if (entry >= 0 && (through || now_inside))
    begin_contact(state, crossing[entry].surface_point, through);
  else if (now_inside && nearest.surface_point.triangle >= 0)
    begin_contact(state, nearest.surface_point, false);
  return true;
}

void Collision::begin_contact(PointState& state, const SurfacePoint& surface_point, bool through) {
  state.contact = true;
  state.through = through, state.doubted = state.has_no_rows = state.predicted = state.disc.in_surface = false;
  state.anchor = surface_point;
  state.anchor_at_rest = surface_->tree().at_rest(surface_point);
  state.outward = surface_->tree().outward_at_rest(surface_point.triangle);
  state.tangent = Vec3{};
  state.clear = {};
  state.drift = state.unseen = 0;
  state.rides = false, state.begins = true;
  state.slide = {};
  state.slide.at = state.last;
}

void Collision::end_contact(PointState& state, const ContactId& contact) {
  state.contact = state.through = state.doubted = false;
  state.has_ended = true;
  state.clear = {};
  // If two contacts could each end because of the other, only the first one ends in this step.
  if (field_) field_->end(contact);
}

bool Collision::move_in_contact(PointState& state, Vec3 p, const ContactId& contact, bool hold, double release) {
  if (field_) state.drift += field_->last_change_without(contact);
  const double moved = length(p - state.last) + surface_->largest_move_without(contact);
  const bool pulls = field_ && !hold && field_->pulls_among_others(contact, state.outward);
  if (pulls || may_have_reached(state.clear, p, state.drift, may_have_sunk(state, p, contact))) {
    const Test test = take_turn(contact, room_to_change(0),
                                [&] { return test_contact(state, p, contact, hold, moved + state.unseen, pulls); });
    state.unseen = test == Test::unfinished ? state.unseen + moved : 0;
  }

  const bool is_far = length(p - state.anchor_at_rest) > release, is_out = !state.inside && !hold;
  if (!is_far && !is_out) return true;
  Vec3 at;
  if (is_far || state.through)
    if (!ask_pulled(state, p, contact, &at)) return true;
  // From where the others take the place, or from rest: contacts that conflict take it anywhere.
  const bool left = is_far && length(at - state.anchor_at_rest) > release,
             stays = state.through && !state.has_no_rows && !is_over_anchor(state, at);
  if (!left && (!is_out || stays)) return true;
  if (may_change())
    end_contact(state, contact);
  else
    work_->defer();
  return !left || state.contact;
}

// *at: the tool point p, in contact, less what all other contacts do at its anchor. False where the step's work does not allow that.
bool Collision::ask_pulled(const PointState& state, Vec3 p, const ContactId& contact, Vec3* at) {
  work_->add(surface_->take_work());
  surface_->limit_work(room_to_change(0) - overshoot_);
  *at = p - state.disc.sunk - surface_->displacement({AskedSurface::kWithout, contact}, state.anchor);
  const bool finished = surface_->finished();
  work_->add(surface_->take_work());
  if (!finished) work_->defer();
  return finished;
}

// Decides on which side of the surface without this contact's own part the point is.
//
// The others' forces also overcome this contact's resistance, so the surface without this contact's part is not the one that would be
// there without this contact. Where that matters, because the point has come out or the contact pulls, the surface with the other
// contacts at their own targets decides; a contact that pulls asks for no other one.
Collision::Test Collision::test_contact(PointState& state, Vec3 p, const ContactId& contact, bool hold, double moved,
                                        bool pulls) {
  const bool sinks = state.disc.radius > 0 && surface_->may_sink(contact);
  Vec3 at, sunk;
  bool lacks_nodes = false;
  // The anchor's place is a surface point, so the nearest one is not farther away. The margin is for rounding.
  const auto nearest_of = [&](const AskedSurface& asked) {
    sunk = sinks ? surface_->below_disc(asked, state.anchor, state.disc.radius, &lacks_nodes) : Vec3{};
    at = p - sunk;
    const Vec3 to_anchor = at - surface_->displacement(asked, state.anchor) - state.anchor_at_rest;
    return surface_->nearest(asked, at, std::min(reach(moved), 1.000001 * length(to_anchor) + 1e-12));
  };
  // A prediction that does not fit is left to the next step, unless it leaves too little in every step.
  const auto predict = [&] {
    if (hold || !field_) return false;
    Operations work = 0;
    const Operations least = field_->operations_to_predict(contact);
    if (least > surface_->work_left()) {
      if (least <= work_->tests_have() / 2) surface_->end_work();
      return false;
    }
    const bool predicts = field_->predict_without(contact, surface_->work_left(), &work);
    surface_->add_work(work);
    return predicts;
  };
  const AskedSurface without{AskedSurface::kWithout, contact}, predicted{AskedSurface::kPredicted, contact};
  // Where the surface overlaps itself or has turned inside out, the nearest triangle may be that of another part.
  const auto agrees = [&](const AskedSurface& asked, bool is_in) {
    return (is_in || state.inside) && surface_->finished() && surface_->is_inside(asked, at);
  };
  const bool asks_at_once = pulls || state.doubted;
  bool predicts = asks_at_once && predict(), now_inside = false, doubted = false;
  NearestPoint nearest;
  if (!predicts) {
    nearest = nearest_of(without);
    // Where the surface is farther away than it and the point have moved, the side is as before, if that was the side of this surface.
    const bool stays = nearest.distance > moved + length(sunk - state.disc.sunk) && !state.predicted;
    now_inside = stays ? state.inside : agrees(without, !nearest.outside);
    doubted = !now_inside && !asks_at_once && surface_->finished();
    predicts = doubted && predict();
  }
  Clearance clear = {p, nearest.distance, nearest.per_path, state.drift, surface_->sum_of_changes()};
  if (predicts) {
    nearest = nearest_of(predicted);
    now_inside = agrees(predicted, nearest.surface_point.triangle >= 0 && !nearest.outside);
    clear.distance = 0;  // of a prediction nothing is known in the next step
  }
  if (!surface_->finished()) {
    state.doubted = state.doubted || doubted;
    return Test::unfinished;
  }
  state.doubted = false;
  state.clear = clear, state.disc.sunk = sunk, state.disc.over_held = lacks_nodes && length(sunk) > 0;
  if (now_inside)
    state.through = false;
  else if (state.inside)  // the point has come out in this step: note on which side
    state.through = dot(nearest.outward, state.outward) < kOppositeFaces;
  else if (predicts)
    state.through = state.through && !is_over_anchor(state, at - surface_->displacement(predicted, state.anchor));
  state.inside = now_inside, state.predicted = predicts;
  return Test::done;
}

// The point is pulled back with the whole field, this contact's part included: so it stays beside its anchor even if contacts
// conflict. Without this contact's part it could lie beyond the far side of a thin part, where the nearest surface point is
// somewhere along the rim.
void Collision::follow(PointState& state, Vec3 p, const ContactId& contact) {
  if (!field_ || field_->empty()) return slide(state, p);
  work_->add(surface_->take_work());
  surface_->limit_work(room_to_change(0) - overshoot_);
  const Vec3 moved = surface_->displacement({}, state.anchor),
             others = surface_->displacement({AskedSurface::kWithout, contact}, state.anchor);
  const bool finished = surface_->finished();
  work_->add(surface_->take_work());
  if (!finished) return work_->defer();
  // Moving the anchor changes this contact's own part of the field, by about own / asked of the way. The anchor therefore goes
  // that much less far; a full step would overshoot and swing.
  const double asked = length(p - state.anchor_at_rest - surface_->moved(state.anchor)), own = length(moved - others);
  const double share = own > 0 ? asked / (asked + own) : 1;
  const Vec3 at = state.begins ? p - state.disc.sunk : p;
  slide(state, state.anchor_at_rest + share * (at - moved - state.anchor_at_rest));
}

void Collision::ride(PointState& state, Vec3 p) {
  const Vec3 off = p - state.slide.at,
             along = state.slide.way.take(off - dot(off, state.slide.axis) * state.slide.axis);
  if (length(along) > kStill) slide(state, state.anchor_at_rest + along);
}

void Collision::slide_pulled(PointState& state, Vec3 p, const ContactId& contact) {
  Vec3 at;
  if (ask_pulled(state, p, contact, &at)) slide(state, at);
}

void Collision::slide(PointState& state, Vec3 p) {
  const auto squared = [](Vec3 v) { return dot(v, v); };
  double best = squared(p - state.anchor_at_rest);
  // Each round searches one bucket around the anchor. Where the anchor moves less than half a bucket, it is the nearest point.
  for (int round = 0; round < kMostSlides; ++round) {
    SurfacePoint surface_point;
    rest_->near(state.anchor_at_rest, 1, [&](std::int32_t t) {
      if (dot(rest_->outward(t), state.outward) < 0) return;
      double k[3];
      const double distance = closest_on_triangle(p, rest_->corner(t, 0), rest_->corner(t, 1), rest_->corner(t, 2), k);
      if (distance >= best) return;
      best = distance;
      surface_point.triangle = t;
      std::copy(k, k + 3, surface_point.barycentric);
    });
    if (surface_point.triangle < 0) return;
    const Vec3 from = state.anchor_at_rest;
    state.anchor = surface_point;
    state.anchor_at_rest = rest_->position(surface_point);
    state.outward = rest_->outward(surface_point.triangle);
    if (length(state.anchor_at_rest - from) < 0.5 * rest_->bucket_size()) return;
  }
}

}  // namespace palpate
