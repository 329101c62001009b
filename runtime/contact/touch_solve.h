// Solves the constraints of a step: as often as the sources of its rows ask for it, and as its accounts of energy do.
#pragma once

#include "runtime/contact/contact_solver.h"

namespace palpate {

struct TouchStep;

// How often a step is solved at most where a source asks for it: of a grasp that slips each solve leaves a few per cent of the excess.
inline constexpr int kMostSlipSolves = 4;

// After a solve: whether a source has other targets now.
bool sources_ask_again(TouchStep& step);

// The forces at the contact nodes, the state of the field, and what became of the sources' rows. joint: how the solution of several
// organs ended, which the solver has taken over; nullptr: the organ is solved alone.
void solve_contacts(TouchStep& step, const ContactSolver::Outcome* joint);

}  // namespace palpate
