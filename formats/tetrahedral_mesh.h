// A tetrahedral mesh with named regions and named surface patches, and its .msh file.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace palpate {

struct TetrahedralMesh {
  std::vector<std::array<double, 3>> nodes;             // in the file's unit; organ.toml says which (mesh_unit)
  std::vector<std::array<std::int32_t, 4>> tetrahedra;  // node indices from 0, positive volume
  std::vector<std::int32_t> region;                     // per tetrahedron, index into region_names
  std::vector<std::string> region_names;                // physical volumes; "region 1", ... where the file names none

  // Named surface patches (physical surfaces): triangles by node index; they need not cover the surface.
  struct Patch {
    std::string name;
    std::vector<std::array<std::int32_t, 3>> triangles;
  };
  std::vector<Patch> patches;
};

// Reads MSH 2.2 or 4.1, ASCII or binary, of linear tetrahedra. Points, lines and other surface elements are ignored and
// counted in a warning; volume elements that are no linear tetrahedra are refused: without them the body has holes. Nodes
// that no tetrahedron uses are dropped and reported. Regions and patches come in ascending order of their numbers in the
// file. Errors: InputError for anything malformed, with the line or byte; nothing is allocated from a count that the file's
// size cannot hold; inverted elements are an error that names the first one.
TetrahedralMesh read_mesh(const std::filesystem::path& file);

// Writes MSH 4.1 ASCII, coordinates to 17 digits, physical names for regions and patches, atomically; the same mesh
// gives the same bytes. One entity per region and per patch.
void write_mesh(const std::filesystem::path& file, const TetrahedralMesh& mesh);

// The outer surface: the faces that belong to one tetrahedron only, oriented outward (counter-clockwise from outside), in order
// of first appearance. Errors: InputError where a face belongs to more than two tetrahedra.
std::vector<std::array<std::int32_t, 3>> boundary_triangles(const TetrahedralMesh& mesh);

}  // namespace palpate
