#include "runtime/loads/loads.h"

#include <cmath>

#include "runtime/base/error_text.h"
#include "runtime/base/host_struct.h"
#include "runtime/contact/touch_step.h"

namespace palpate {
namespace {

// Farther no node may be moved.
constexpr double kFarthest = 1e6;  // m

bool is_in_world(std::int32_t kind) {
  return kind == PALPATE_LOAD_FORCE_IN_WORLD || kind == PALPATE_LOAD_TRACTION_IN_WORLD;
}
bool is_traction(std::int32_t kind) {
  return kind == PALPATE_LOAD_TRACTION || kind == PALPATE_LOAD_TRACTION_IN_WORLD;
}

}  // namespace

bool SurfaceLoads::create(SceneMemory& memory, const Source& source) {
  source_ = source;
  const auto loads = static_cast<std::size_t>(count());
  given_ = memory.array<Given>(loads), state_ = memory.array<palpate_load_state>(loads);
  memory.keep_array(given_, loads), memory.keep_array(state_, loads);
  memory.keep(first_);
  if (memory.failed()) return false;
  for (std::int32_t i = 0; i < count(); ++i) state_[i].area = source.patch[i].area;
  return true;
}

void SurfaceLoads::forget_rest() {
  for (std::int32_t i = 0; i < count(); ++i) state_[i] = {{}, {}, {}, source_.patch[i].area};
  first_ = 1;
}

// m, an upper bound of how far the load moves a node of the linear organ.
double SurfaceLoads::longest_of(std::int32_t load, Vec3 force) const {
  double sum = 0;
  for (int i = 0; i < 3; ++i)
    sum += std::fabs(force[i]) * source_.touch->offset.rows().longest[source_.first + 3 * load + i];
  return sum;
}

palpate_status SurfaceLoads::set(std::int32_t load, palpate_load_kind kind, const double vector[3],
                                 palpate_error* error) {
  const auto bad = [&](const char* expected) {
    return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                "palpate_scene_set_load: expected %s, found load %d; the scene keeps its loads", expected,
                static_cast<int>(load));
  };
  if (load < 0 || load >= count()) return bad("one of the scene's loads");
  const int number = enum_number(kind);
  if (number < PALPATE_LOAD_FORCE || number > PALPATE_LOAD_TRACTION_IN_WORLD)
    return bad("a kind of palpate_load_kind for each load");
  if (!vector) return bad("three numbers for each load");
  const Given given = {load3(vector), number, 0};
  const Vec3 force = is_traction(number) ? source_.patch[load].area * given.vector : given.vector;
  // However the pose turns it.
  const double most = length(force), farthest = longest_of(load, {most, most, most});
  if (!(farthest <= kFarthest)) return bad("finite numbers that move no node by more than 1e6 m for each load");
  given_[load] = given;
  return succeed(error);
}

// N, in the organ's frame.
Vec3 SurfaceLoads::force_of(const Given& given, std::int32_t load) const {
  const Vec3 vector = is_in_world(given.kind) ? source_.touch->organ.vector_to_organ(given.vector) : given.vector;
  return is_traction(given.kind) ? source_.patch[load].area * vector : vector;
}

void SurfaceLoads::begin_step(TouchStep& step) {
  double* const amounts = source_.touch->offset.amounts() + source_.first;
  double moved = 0;
  Vec3 to[PALPATE_MAX_LOADS];
  for (std::int32_t i = 0; i < count(); ++i) {
    to[i] = force_of(given_[i], i);
    moved += longest_of(i, to[i] - load3(amounts + 3 * i));
  }
  const double most = step.context->def.max_tool_speed * source_.touch->input.dt();
  const double share = moved > most && !first_ ? most / moved : 1;
  for (std::int32_t i = 0; i < count(); ++i) {
    const Vec3 from = load3(amounts + 3 * i);
    store3(share == 1 ? to[i] : from + share * (to[i] - from), amounts + 3 * i);
  }
  first_ = 0;
  if (share < 1) step.flags |= PALPATE_STEP_MOTION_LIMITED;
  step.context->watch.ended(source_.pass);
}

void SurfaceLoads::end_step(TouchStep& step) {
  const TouchState& touch = *step.state;
  for (std::int32_t i = 0; i < count(); ++i) {
    const LoadPatch& patch = source_.patch[i];
    Vec3 moved, place;
    for (std::int32_t k = 0; k < patch.count; ++k) {
      moved += patch.weight[k] * touch.displacement.at_node(patch.node[k]);
      place += patch.weight[k] * touch.surface.place(patch.node[k]);
    }
    store3(touch.organ.vector_to_world(load3(touch.offset.amounts() + source_.first + 3 * i)), state_[i].force);
    store3(touch.organ.vector_to_world(moved), state_[i].displacement);
    store3(touch.organ.point_to_world(place + moved), state_[i].place);
  }
  step.context->watch.ended(source_.pass);
}

}  // namespace palpate
