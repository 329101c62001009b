// CGAL's mesh for the files of this folder that call CGAL; not for other headers.
#pragma once

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>

#include "meshing/surface/triangle_surface.h"

namespace palpate {

using CgalKernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using CgalMesh = CGAL::Surface_mesh<CgalKernel::Point_3>;

// The surface must be an oriented manifold (throws std::logic_error). Order is kept both ways.
CgalMesh to_cgal(const TriangleSurface& surface);
TriangleSurface from_cgal(const CgalMesh& mesh);

}  // namespace palpate
