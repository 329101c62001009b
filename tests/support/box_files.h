// Input files for tests that run palpate-precompute: a soft, heavy box of 210 nodes, held at two faces.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "studies/bodies/box_mesh.h"

namespace palpate::tests {

inline const std::string kOrgan = R"(name = "box"
mesh_unit = "mm"
frame = "none"
element = "p1"
[[region]]
name = "box"
young = { value = 5.4, unit = "kPa", source = "test" }
poisson = { value = 0.45, source = "test" }
density = { value = 1060, unit = "kg/m^3", source = "test" }
)";
inline const std::string kBoundary = R"(name = "back"
[[fixed]]
dofs = "xyz"
select = { patch = "x0" }
[[fixed]]
dofs = "z"
select = { patch = "z0" }
)";

// Writes box.msh, organ.toml and bc.toml.
inline void write_box_files(const std::filesystem::path& folder) {
  write_mesh(folder / "box.msh", box_mesh({6, 5, 4}, {60, 50, 40}, 0.15));
  std::ofstream(folder / "organ.toml") << kOrgan;
  std::ofstream(folder / "bc.toml") << kBoundary;
}

}  // namespace palpate::tests
