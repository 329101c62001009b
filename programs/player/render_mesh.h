// A finer surface for renderers, which follows the organ (palpate_scene_skin).
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace palpate {

struct RenderMesh {
  std::vector<float> positions;        // [vertex][3] m
  std::vector<float> normals;          // [vertex][3] unit
  std::vector<std::uint32_t> indices;  // [triangle][3]
};

// A PLY file, as palpate-surface writes it. Errors: InputError with the file and what is wrong in it.
RenderMesh read_render_mesh(const std::filesystem::path& file, double metres_per_unit);

// Normals of the vertices: the mean of the triangles' normals, weighted by area. A vertex of no triangle gets the z axis.
std::vector<float> smooth_normals(const std::vector<float>& positions, const std::vector<std::uint32_t>& indices);

}  // namespace palpate
