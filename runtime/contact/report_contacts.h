// Tells the contacts of a step to the report (contact_report.h).
#pragma once

namespace palpate {

struct TouchStep;

void report_contacts(TouchStep& step);

}  // namespace palpate
