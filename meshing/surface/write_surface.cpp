#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <string>

#include "formats/atomic_file.h"
#include "formats/errors.h"
#include "meshing/surface/surface_file.h"

namespace palpate {
namespace {

static_assert(std::endian::native == std::endian::little, "binary surfaces are written in this machine's order");

template <class T>
void append(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

std::string as_off(const TriangleSurface& surface) {
  std::string text = fmt::format("OFF\n# LPS mm\n{} {} 0\n", surface.points.size(), surface.triangles.size());
  for (const auto& [x, y, z] : surface.points) text += fmt::format("{:.17g} {:.17g} {:.17g}\n", x, y, z);
  for (const auto& [a, b, c] : surface.triangles) text += fmt::format("3 {} {} {}\n", a, b, c);
  return text;
}

std::string as_obj(const TriangleSurface& surface) {
  std::string text = "# LPS mm\n";
  for (const auto& [x, y, z] : surface.points) text += fmt::format("v {:.17g} {:.17g} {:.17g}\n", x, y, z);
  for (const auto& [a, b, c] : surface.triangles) text += fmt::format("f {} {} {}\n", a + 1, b + 1, c + 1);
  return text;
}

std::string as_ply(const TriangleSurface& surface) {
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment LPS mm\nelement vertex {}\nproperty double x\nproperty double y\n"
      "property double z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
      surface.points.size(), surface.triangles.size());
  for (const Point& point : surface.points) {
    for (const double c : point) append(bytes, c);
  }
  for (const Triangle& triangle : surface.triangles) {
    append(bytes, std::uint8_t{3});
    for (const std::int32_t p : triangle) append(bytes, p);
  }
  return bytes;
}

std::string as_stl(const TriangleSurface& surface) {
  std::string bytes = "palpate-surface; SPACE=LPS; mm";
  bytes.resize(80, ' ');
  append(bytes, static_cast<std::uint32_t>(surface.triangles.size()));
  for (const auto& [a, b, c] : surface.triangles) {
    const Point p = surface.points[a], q = surface.points[b], r = surface.points[c];
    Point normal = cross(q - p, r - p);
    const double length = std::sqrt(dot(normal, normal));
    normal = (length > 0 ? 1 / length : 0) * normal;
    for (const Point& row : {normal, p, q, r}) {
      for (const double v : row) append(bytes, static_cast<float>(v));
    }
    append(bytes, std::uint16_t{0});
  }
  return bytes;
}

}  // namespace

void check_output_name(const std::filesystem::path& file) {
  const std::string ending = file.extension().string();
  if (ending != ".off" && ending != ".ply" && ending != ".stl" && ending != ".obj") {
    throw InputError(fmt::format("{}: expected an output name that ends in .off, .ply, .stl or .obj, found '{}'",
                                 file.string(), ending));
  }
}

void write_surface(const std::filesystem::path& file, const TriangleSurface& surface) {
  check_output_name(file);
  const std::string ending = file.extension().string();
  write_text_atomically(file, ending == ".off"   ? as_off(surface)
                              : ending == ".ply" ? as_ply(surface)
                              : ending == ".stl" ? as_stl(surface)
                                                 : as_obj(surface));
}

}  // namespace palpate
