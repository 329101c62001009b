// The rows of the points and grips of tools: collision decides which points hold the organ, grips always do; the contact model makes
// their rows, and anchors follow what slides.
#pragma once

#include "runtime/contact/contact_rows.h"
#include "runtime/contact/row_source.h"

namespace palpate {

struct TouchState;

class ToolContacts final : public RowSource {
 public:
  std::int32_t begin(TouchStep& step) override;
  void request_of_tool(TouchStep& step, std::int32_t t) override;
  // Where the step leaves discs that slide, and the anchors of what slipped. Not while the body lags behind its contacts: what it
  // misses is then not what a tool has slipped by.
  void end(TouchStep& step) override;
  bool note_sliding(const TouchStep& step, const ContactConstraints& set, const ContactConstraint& constraint,
                    SlideEnergy::Sliding* sliding) override;
};

// Forgets the points of the tool in place t from number `first` on. The points that earlier steps have seen come first in the list.
void forget_points(const palpate_scene_def& def, TouchState& state, std::int32_t t, std::int32_t first);

}  // namespace palpate
