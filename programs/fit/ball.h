// The force of a rigid ball on an organ, from the stiffness that the organ has against a flat disc.
#pragma once

namespace palpate::fit {

// A place of an organ near which the tissue is a half-space, in series with the rest of the organ.
struct BallPlace {
  double plane_modulus = 0;  // Pa: E / (1 - nu^2) of the tissue there
  double disc_stiffness =
      0;  // N/m: force over depth of a flat disc without friction, of the ball's radius, as the bundle has it
};

// The force over the depth of a rigid ball of that radius without friction, N/m; depth, radius: m, above 0. NaN where the ball is
// pressed so deep that its contact would reach its equator.
//
// On a half-space a ball whose contact has the radius a meets F = E* ((a^2 + R^2) / 2 ln((R + a) / (R - a)) - a R) at the depth
// a / 2 ln((R + a) / (R - a)), with E* the plane modulus (Sneddon 1965, Int. J. Eng. Sci. 3, 47); for small depths d this is Hertz's
// 4/3 E* sqrt(R d^3). The rest of the organ moves by F c, where c is what the disc's compliance has more than the half-space's:
// 1 / disc_stiffness - 1 / (2 E* R). This takes the rest for the same under a ball and under a disc, which holds where the contact is
// small against the organ.
double ball_stiffness(const BallPlace& place, double radius, double depth);

}  // namespace palpate::fit
