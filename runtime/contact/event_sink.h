// What sources of rows tell of a step beside their contacts, to whoever listens.
#pragma once

#include <cstdint>

#include "runtime/include/palpate/palpate_report.h"
#include "runtime/surface/surface_index.h"

namespace palpate {

// let_go: it holds nothing until it closes anew.
enum class Hold : std::int32_t { open, holds, slips, let_go };

// What a part of a tool (tool_input.h) holds, as a step has left it. Without padding: a saved state has it.
struct HeldEvent {
  Hold hold = Hold::open;
  std::int32_t closing = 0;  // another number: it has closed anew
  SurfacePoint surface_point;
  Vec3 place;  // m
};

class EventSink {
 public:
  // What became of what a part of the tool in place t holds.
  virtual void tell_held(std::int32_t /*t*/, const HeldEvent& /*now*/) {}
  // Of something that belongs to no tool. at: m, of the place.
  virtual void tell_event(palpate_contact_event_kind, std::int32_t /*id*/, const SurfacePoint& /*place*/, Vec3 /*at*/) {
  }

 protected:
  ~EventSink() = default;
};

}  // namespace palpate
