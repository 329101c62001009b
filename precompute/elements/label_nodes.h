// The `label` selector of a boundary file: the nodes of a mesh in or near the voxels of a label image.
#pragma once

#include <filesystem>

#include "formats/organ_config.h"
#include "formats/tetrahedral_mesh.h"
#include "meshing/image/label_image.h"

namespace palpate {

// For each point (LPS, mm) 1 where it is within a distance (mm) of a voxel that has one of the values; 0 mm: inside of it.
// Distances are measured along the axes of the voxels. Errors: InputError, without the name of the image, where a label is in no
// voxel; lists the values that the image has. Cost: one pass over the image, and for each point one step for each row of voxels
// within the distance.
std::vector<char> near_labels(const LabelImage& image, const std::vector<double>& labels, double distance,
                              const std::vector<std::array<double, 3>>& points);

// What select_nodes() asks. Keeps references to mesh, organ and the two paths; reads each image once, when it is asked for.
// image: where a selector names none; may be empty. Errors of the call: InputError where the image cannot be read, is not given or
// has not the label; names file and line of the selector.
LabelledNodes labelled_nodes(const TetrahedralMesh& mesh, const OrganConfig& organ, const std::filesystem::path& image,
                             const std::filesystem::path& boundary_file);

}  // namespace palpate
