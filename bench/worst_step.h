// The worst step of a hostile scene: what a loop with deadlines has to allow for, and what medians do not tell.
#pragma once

#include "runtime/include/palpate/palpate.h"

// Plays `steps` touches twice and prints median, percentiles and worst step of each kind of scene, with the worst step's load, and how
// many operations the steps counted at most.
void report_worst_steps(palpate_bundle* bundle, long steps);
