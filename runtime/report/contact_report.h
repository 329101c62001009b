// What a touch step tells about each contact, and what began and ended in it (palpate_scene_report of palpate.h).
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/contact/displacement_field.h"
#include "runtime/contact/event_sink.h"
#include "runtime/surface/bound_surface.h"

namespace palpate {

// Where a contact holds the organ, and what its tool does there.
struct ReportedContact {
  std::int32_t tool = 0, point = 0;  // place of the tool; as in ContactNode
  SurfacePoint surface_point;        // of the mesh; triangle -1: a node
  SurfacePoint fine;                 // the place on the fine surface; triangle -1: it is on the mesh
  std::int32_t node = -1;            // of a grip that holds a node; else -1
  Vec3 holder;                       // m: the tool point; of a grip, where it takes the place that it holds
  Vec3 force;                        // N, on the tool
  palpate_contact_state state = PALPATE_CONTACT_STICKS;
  double disc_radius = 0;  // m; 0: no disc
  Vec3 disc_normal;        // outward, unit, at rest
  double indentation = 0;  // m, of the disc into a half-space
};

class ContactReport final : public EventSink {
 public:
  // position: [nodes][3] m; triangles: [F][3], nullptr where contacts hold nodes alone. Both are borrowed.
  // fine: where contacts are on a fine surface, else nullptr.
  bool create(SceneMemory& memory, const palpate_scene_def& def, const double* position, const std::int32_t* triangles,
              const BoundSurface* fine, const DisplacementField* field);
  // Forgets all contacts, without events.
  void forget();
  void forget_tool(std::int32_t t);

  // A step is reported in this order. begin(): the field has the solved contacts of the step. hold_tool(): which tool has the place t in this
  // step; -1: none. hold(): which contacts there are. Then add() each of them, with its tool's index in the step, and note() where
  // each point and grip is. end().
  void begin(std::uint64_t step, double dt);
  void hold_tool(std::int32_t t, std::int32_t id);
  void hold(std::int32_t t, std::int32_t point);
  void end_missing();
  // Behind the contacts.
  void tell_held(std::int32_t t, const HeldEvent& now) override;
  void tell_event(palpate_contact_event_kind kind, std::int32_t id, const SurfacePoint& place, Vec3 at) override;
  void add(const ReportedContact& contact, std::int32_t index);
  void note(std::int32_t t, std::int32_t point, Vec3 holder);
  // Before begin(): the same of the last step, of a point that it was not told.
  void note_last(std::int32_t t, std::int32_t point, Vec3 last) {
    if (slot(t, point).last_step != step_) note(t, point, last);
  }
  void end();

  // What a step's report takes, about.
  static Operations operations(std::int32_t points, std::int32_t contacts, std::int32_t nodes, bool fine) {
    return 10 + points + Operations{contacts} * (40 + 36 * Operations{nodes}) * (fine ? 5 : 1);
  }

  const palpate_contact_report* report() const { return report_; }

 private:
  // A point or grip of a tool.
  struct Slot {
    std::uint64_t begun;      // step
    std::uint64_t last_step;  // in which the tool sent it
    std::uint64_t held_step;  // in which it held a contact
    Vec3 last;                // m, where it was then
    SurfacePoint surface_point;
    std::int32_t node;
    palpate_contact_state state;
    Vec3 place;  // m, of the contact
  };
  Slot& slot(std::int32_t t, std::int32_t point) {
    return slots_[static_cast<std::size_t>(t) * static_cast<std::size_t>(max_points_) +
                  static_cast<std::size_t>(point)];
  }
  Vec3 at_rest(std::int32_t node) const { return load3(position_ + 3 * static_cast<std::size_t>(node)); }
  // A corner of the triangle, or the node, that a contact holds: at rest (m), and its displacement now and before.
  struct Corner {
    Vec3 rest, now, before;
  };
  Corner corner_of(std::int32_t node) const;
  void find_fine_corners(std::int32_t triangle, Corner corner[3]) const;
  palpate_contact_event& tell(palpate_contact_event_kind kind, std::int32_t t, std::int32_t point);
  palpate_contact_event& tell(palpate_contact_event_kind kind, std::int32_t tool_id, std::int32_t point,
                              const SurfacePoint& surface_point, std::int32_t node, Vec3 place);
  void tell_held(palpate_contact_event_kind kind, std::int32_t t);

  const double* position_ = nullptr;
  const std::int32_t* triangles_ = nullptr;
  const BoundSurface* fine_ = nullptr;
  const DisplacementField* field_ = nullptr;
  std::int32_t max_tools_ = 0, max_points_ = 0;
  std::uint64_t* bytes_ = nullptr;            // of the report
  palpate_contact_report* report_ = nullptr;  // in bytes_; the contacts follow it, and then the events
  palpate_contact* contacts_ = nullptr;       // [max_points], inside *report_
  palpate_contact_event* events_ = nullptr;   // [most_events()], behind the room for all contacts until end()
  Slot* slots_ = nullptr;                     // [max_tools][max_points]
  std::int32_t ids_[PALPATE_MAX_TOOLS];       // of the tool in each place; -1: none
  std::int32_t used_[PALPATE_MAX_TOOLS];      // slots of each place that were ever in use
  HeldEvent grasps_[PALPATE_MAX_TOOLS];       // as the last step has left them
  std::uint64_t step_ = 0;
  double dt_ = 1;
};

}  // namespace palpate
