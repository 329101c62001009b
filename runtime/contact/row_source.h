// What holds tissue and asks for rows: the points and grips of tools, and what modules add. The step goes through the list of sources
// that its scene has (touch.h) and asks none what it is. A load holds nothing and asks for no row: it is one of the offset's (offset.h).
// What holds one organ against another has rows that act on both. It asks for them in the same way, in the step of all organs (RowsFor).
#pragma once

#include <cstdint>

#include "runtime/contact/event_sink.h"
#include "runtime/contact/slide_energy.h"
#include "runtime/contact/step_part.h"

namespace palpate {

// Step: of one organ, or of several together. Told: where the source writes what it tells.
template <class Step, class Told>
class RowsFor {
 public:
  // A step, in this order. How many contacts the source will ask for.
  virtual std::int32_t begin(Step&) { return 0; }
  // Requests its constraints.
  virtual void request(Step&) {}
  // After a solve: whether it has other targets now, so that the step is to be solved again.
  virtual bool asks_again(Step&) { return false; }
  // After the displacement field has been set from these reactions.
  virtual void end(Step&) {}
  // What it tells of the step beside the contacts of tools.
  virtual void tell(Step&, Told&) {}

 protected:
  ~RowsFor() = default;
};

// Its request() comes when those of all tools are requested.
class RowSource : public StepPart, public RowsFor<TouchStep, EventSink> {
 public:
  // Before request(): the constraints of the tool in place t, which the step asks for in ascending order of t.
  virtual void request_of_tool(TouchStep&, std::int32_t) {}

  // For the accounts of energy: fills in what slides, of a constraint of `set` that may be its own. False: it does not slide.
  virtual bool note_sliding(const TouchStep&, const ContactConstraints& /*set*/, const ContactConstraint&,
                            SlideEnergy::Sliding*) {
    return false;
  }

 protected:
  ~RowSource() = default;
};

}  // namespace palpate
