// A block with a region that may be cut, its files, and its bundle by palpate-precompute.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <string>

#include "precompute/elements/elastic_body.h"
#include "studies/bodies/box_mesh.h"
#include "tests/support/program_run.h"

namespace palpate::tests {

// A block of soft, nearly incompressible tissue that is held at x = 0 and stands on a foundation; the half away from there may be cut. Its motions are
// its weight along x, y and z, a pressure on its top, and its foundation but for the edge that is held, which moves along (3, 2, 10).
struct Inputs {
  static constexpr char kBesideTheCut[] =
      "{ and = [{ patch = \"z0\" }, { half_space = { point = [26, 0, 0], normal = [1, 0, 0] } }] }";
  static constexpr char kBelowAll[] = "{ patch = \"z0\" }";

  explicit Inputs(Element of, std::array<int, 3> cells = {16, 10, 8},
                  const std::string& region = "{ half_space = { point = [34, 0, 0], normal = [-1, 0, 0] } }",
                  const std::string& foundation = kBesideTheCut, double stiffening = 0)
      : element(of),
        form('.' + std::to_string(cells[0]) + (foundation == kBelowAll ? ".below." : ".") +
             (stiffening > 0 ? "stiff." : "")) {
    write_mesh(file("msh"), box_mesh(cells, {80, 50, 40}, 0.1));
    std::ofstream(file("organ.toml")) << "name = \"block\"\nmesh_unit = \"mm\"\nframe = \"none\"\nelement = \""
                                      << name_of(of) << R"("
[[region]]
name = "box"
young = { value = 5.4, unit = "kPa", source = "test" }
poisson = { value = 0.45, source = "test" }
density = { value = 1000, unit = "kg/m^3", source = "test" }
)" << (stiffening > 0 ? "stiffening = { value = " + std::to_string(stiffening) + ", source = \"test\" }\n" : "");
    std::ofstream(file("bc.toml")) << R"(name = "back"
[store]
large_deformation = true
[[fixed]]
dofs = "xyz"
select = { patch = "x0" }
[[foundation]]
name = "below"
normal = { value = 1e4, unit = "N/m^3", source = "test" }
tangential = { value = 1e4, unit = "N/m^3", source = "test" }
select = )" << foundation << R"(
[[motion]]
name = "weight"
kind = "gravity"
[[motion]]
name = "on top"
kind = "pressure"
select = { patch = "z1" }
[[motion]]
name = "below"
kind = "piston"
axis = [0.3, 0.2, 1]
select = { and = [{ patch = "z0" }, { half_space = { point = [2, 0, 0], normal = [-1, 0, 0] } }] })"
                                   << "\n[cut]\nregion = " << region << '\n';
  }
  std::filesystem::path file(const std::string& name) const { return scratch(name_of(element) + form + name); }
  std::string precompute(const std::string& options) const {
    const std::string bundle = file("h5").string();
    const ProgramRun ended = run_in(fresh_folder(), PALPATE_PRECOMPUTE_PROGRAM " " + file("msh").string() +
                                                        " --organ " + file("organ.toml").string() + " --boundary " +
                                                        file("bc.toml").string() + " -o " + bundle + " " + options);
    EXPECT_EQ(ended.code, 0) << ended.errors;
    return bundle;
  }
  // The same body, in the bundle's order of nodes.
  ElasticBody body() const {
    return make_elastic_body(read_mesh(file("msh")), read_organ_config(file("organ.toml")),
                             read_boundary_config(file("bc.toml")), {file("msh"), file("organ.toml"), file("bc.toml")});
  }
  Element element;
  std::string form;  // of the file names
};

}  // namespace palpate::tests
