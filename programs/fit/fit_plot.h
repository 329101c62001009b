// The plot of a fit, as SVG.
#pragma once

#include <string>

#include "programs/fit/fit_report.h"

namespace palpate::fit {

// Measured against fitted forces; the modulus of each place on its own; with a parameter, the residual against it.
std::string plot_svg(const FitReport& report);

}  // namespace palpate::fit
