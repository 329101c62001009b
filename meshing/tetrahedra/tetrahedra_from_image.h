// Label image -> conforming multi-region tetrahedra: the steps from voxels to a mesh that was checked.
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
  std::optional<std::array<double, 3>> spacing;  // of PNG slices
  std::optional<double> smooth_mm;               // Gaussian width; default 1.5 mean voxel sides
  double edge_mm = 0;                            // triangles' edges at most; 0: a twelfth of the tissues' size
  double facet_distance = 0;                     // mm; 0: an eighth of the edge
  std::string components = "1%";
  bool keep_cavities = false;
  enum class Fill { hxt, mesh_3 } fill = Fill::hxt;  // who fills the surfaces that Mesh_3 makes
};

// "255=liver,127=kidney" or "255,127" (named "label 255"). Errors: InputError for anything else, a label or name twice.
std::vector<Tissue> parse_tissues(const std::vector<std::string>& texts);

// Reads, smooths, meshes, fills, verifies. The outer surface is a manifold, neighbours share their triangles.
// Errors: as read_label_image, tetrahedra_from_tissues and fill_with_tetrahedra; InputError for a tissue that vanished or lost
// more than half its volume; VerificationError when no attempt gives a manifold outer surface.
MeshReport tetrahedra_from_image(const std::vector<std::string>& inputs, const LabelImageOptions& options,
                                 const FillOptions& fill);

}  // namespace palpate
