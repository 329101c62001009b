// Solves the constraints of a step: as often as the sources of its rows ask for it, and as its accounts of energy do.
#pragma once

#include "runtime/contact/contact_solver.h"
#include "runtime/contact/slide_energy.h"

namespace palpate {

struct TouchStep;

// How often a step is solved at most where a source asks for it: where a hold slips, each solve leaves a few per cent of the excess.
inline constexpr int kMostSlipSolves = 4;

// The forces at the contact nodes, the state of the field, and what became of the sources' rows. joint: how the solution of several
// organs ended, which the solver has taken over; nullptr: the organ is solved alone.
void solve_contacts(TouchStep& step, const ContactSolver::Outcome* joint);

// ---- for those that solve and judge: bodies, and several organs together

// After a solve: whether a source has other targets now.
bool sources_ask_again(TouchStep& step);
// of: [constraint_count], what the accounts of energy are to know about the constraints. False where none slides.
bool note_sliding(TouchStep& step, const ContactConstraints& set, SlideEnergy::Sliding* of);
// Of each tool whose contact slides.
void raise_where_slides(TouchStep& step, const ContactConstraints& set, const SlideEnergy::Sliding* of,
                        std::uint32_t flag);
// Whether all constraints meet their targets and laws.
bool is_trusted(const TouchStep& step, ContactSolver::Outcome outcome);

}  // namespace palpate
