// Tells the contacts of each step to the report (contact_report.h), and lets the sources of rows tell what else became of theirs.
#pragma once

#include "runtime/base/passes.h"
#include "runtime/contact/step_part.h"
#include "runtime/report/contact_report.h"

namespace palpate {

class StepReport final : public StepPart {
 public:
  // fine: where contacts are on a fine surface, else nullptr. All borrowed.
  bool create(SceneMemory& memory, const palpate_scene_def& def, const double* position, const std::int32_t* triangles,
              const BoundSurface* fine, const DisplacementField* field, Pass pass) {
    pass_ = pass;
    return report_.create(memory, def, position, triangles, fine, field);
  }

  void begin_step(TouchStep& step) override;
  void end_step(TouchStep& step) override;
  void forget_rest() override { report_.forget(); }
  void reset_tool(std::int32_t t) override { report_.forget_tool(t); }

  const palpate_contact_report* report() const { return report_.report(); }

 private:
  ContactReport report_;
  Pass pass_ = Pass::output;
};

}  // namespace palpate
