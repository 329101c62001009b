// libFuzzer driver: reads any bytes as a mesh file. The result is an InputError, or a mesh whose indices are in range.
#include <cstdint>
#include <cstdlib>

#include "formats/errors.h"
#include "formats/msh_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace palpate;
  try {
    const TetrahedralMesh mesh = parse_mesh({reinterpret_cast<const char*>(data), size}, "fuzz.msh");
    const auto inside = [&](const auto& elements) {
      for (const auto& element : elements)
        for (const auto node : element)
          if (node < 0 || static_cast<std::size_t>(node) >= mesh.nodes.size()) std::abort();
    };
    inside(mesh.tetrahedra);
    for (const auto& patch : mesh.patches) inside(patch.triangles);
    boundary_triangles(mesh);
  } catch (const InputError&) {
  }
  return 0;
}
