#include "meshing/tetrahedra/mesh_bytes.h"

#include <cstring>
#include <stdexcept>

namespace palpate {
namespace {

template <class T>
void put(std::string& bytes, const std::vector<T>& values) {
  const std::uint64_t count = values.size();
  bytes.append(reinterpret_cast<const char*>(&count), sizeof count);
  bytes.append(reinterpret_cast<const char*>(values.data()), count * sizeof(T));
}

void put(std::string& bytes, const std::string& text) {
  put(bytes, std::vector<char>(text.begin(), text.end()));
}

struct Cursor {
  const std::string& bytes;
  std::size_t at = 0;

  const char* take(std::uint64_t count) {
    if (count > bytes.size() - at) throw std::logic_error("mesh bytes end early");
    const char* here = bytes.data() + at;
    at += count;
    return here;
  }
  std::uint64_t count() {
    std::uint64_t n = 0;
    std::memcpy(&n, take(sizeof n), sizeof n);
    return n;
  }
  template <class T>
  std::vector<T> get() {
    std::vector<T> values(count());
    std::memcpy(static_cast<void*>(values.data()), take(values.size() * sizeof(T)), values.size() * sizeof(T));
    return values;
  }
  std::string text() {
    const auto characters = get<char>();
    return {characters.begin(), characters.end()};
  }
};

}  // namespace

std::string to_bytes(const TetrahedralMesh& mesh) {
  std::string bytes;
  put(bytes, mesh.nodes);
  put(bytes, mesh.tetrahedra);
  put(bytes, mesh.region);
  const std::uint64_t regions = mesh.region_names.size(), patches = mesh.patches.size();
  bytes.append(reinterpret_cast<const char*>(&regions), sizeof regions);
  for (const std::string& name : mesh.region_names) put(bytes, name);
  bytes.append(reinterpret_cast<const char*>(&patches), sizeof patches);
  for (const auto& patch : mesh.patches) {
    put(bytes, patch.name);
    put(bytes, patch.triangles);
  }
  return bytes;
}

TetrahedralMesh from_bytes(const std::string& bytes) {
  Cursor cursor{bytes};
  TetrahedralMesh mesh;
  mesh.nodes = cursor.get<std::array<double, 3>>();
  mesh.tetrahedra = cursor.get<std::array<std::int32_t, 4>>();
  mesh.region = cursor.get<std::int32_t>();
  for (std::uint64_t n = cursor.count(); n > 0; --n) mesh.region_names.push_back(cursor.text());
  for (std::uint64_t n = cursor.count(); n > 0; --n) {
    TetrahedralMesh::Patch patch;
    patch.name = cursor.text();
    patch.triangles = cursor.get<std::array<std::int32_t, 3>>();
    mesh.patches.push_back(std::move(patch));
  }
  return mesh;
}

std::string to_bytes(const TriangleSurface& surface) {
  std::string bytes;
  put(bytes, surface.points);
  put(bytes, surface.triangles);
  return bytes;
}

TriangleSurface surface_from_bytes(const std::string& bytes) {
  Cursor cursor{bytes};
  TriangleSurface surface;
  surface.points = cursor.get<Point>();
  surface.triangles = cursor.get<Triangle>();
  return surface;
}

}  // namespace palpate
