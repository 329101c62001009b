// Label image -> tetrahedra of several regions that share their triangles: all steps from voxels to a checked mesh.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "meshing/tetrahedra/fill_with_tetrahedra.h"
#include "meshing/tetrahedra/mesh_report.h"
#include "meshing/tetrahedra/tissue_map.h"

namespace palpate {

struct LabelImageOptions {
  std::vector<Tissue> tissues;
  std::optional<double>
      smooth_mm;       // Gaussian width; default: 1.5 times the mean voxel side, less where a tissue shrinks
  double edge_mm = 0;  // largest edge of triangles; 0: a twelfth of the tissues' size; a small tissue's are shorter
  double facet_distance = 0;  // mm; 0: an eighth of the edge
  std::string components = "1%";
  bool keep_cavities = false;
};

// Reads "255=liver,127=kidney", or "255,127", which gives the names "label 255" and "label 127". Errors: InputError
// for any other text and for a label or a name that is given twice.
std::vector<Tissue> parse_tissues(const std::vector<std::string>& texts);

// Reads, smooths, meshes, fills and verifies. The outer surface is a manifold. Neighbouring tissues share their
// triangles. Each tissue has the volume of its voxels, or a warning says by how much it misses it: the surfaces are moved to that
// volume (move_to_volumes), with shorter edges where this move would be too long. Errors: those of read_label_image, tetrahedra_from_tissues and fill_with_tetrahedra; InputError for a
// tissue that vanishes or loses more than half its volume; VerificationError when no attempt gives a manifold outer
// surface.
MeshReport tetrahedra_from_image(const std::string& name, const LabelImageOptions& options, const FillOptions& fill);

}  // namespace palpate
