// Triangles that need not close, fit together or stay apart -> one closed surface around them.
#pragma once

#include <string>
#include <vector>

#include "meshing/image/voxel_mask.h"
#include "meshing/surface/triangle_surface.h"

namespace palpate {

struct WrappedSurface {
  TriangleSurface surface;  // closed, outward, without self-intersections; farther out than the input by offset_mm
  TriangleSurface input;    // what was wrapped, without the caps
  double input_mm3 = 0;     // volume of the input with its holes capped; where parts overlap they count twice
  double ball_mm = 0, offset_mm = 0;  // gaps narrower than the ball's diameter are bridged
  std::vector<std::string> changes;   // one sentence for each change of the input, in order
};

// Closes each open loop by a cap, a fan of triangles from the loop's centre; rolls a ball of radius ball_mm over all
// triangles from outside, and takes what the ball cannot enter, with offset_share of the ball's radius around it
// (Portaneri and others 2022, Alpha wrapping with an offset; CGAL's implementation). Fills cavities. ball_mm = 0 takes a
// sixtieth of the diagonal of the surface's box. Drops shells that the filter refuses. Cost: grows with the area over
// the square of the ball's radius; a second for an organ and the default ball, at most 20 s of processor time. Errors:
// InputError when nothing is left, when the triangles enclose no volume (a sheet, which the ball touches from both
// sides), and when the wrap takes more than 20 s or 400,000 points.
WrappedSurface wrap_surface(TriangleSurface soup, const PieceFilter& filter, double ball_mm, double offset_share,
                            const std::string& name);

}  // namespace palpate
