#include "studies/validation/baked_body.h"

#include <fmt/format.h>

#include <fstream>

#include "studies/accuracy/command.h"

namespace palpate::validation {

std::filesystem::path bake(const Workshop& workshop, const BodyToBake& body) {
  const auto folder = workshop.scratch / body.name;
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  write_mesh(folder / "body.msh", body.mesh);
  std::ofstream(folder / "organ.toml") << fmt::format(
      "name = \"body\"\nmesh_unit = \"m\"\nframe = \"none\"\nelement = \"{}\"\n[[region]]\nname = \"{}\"\nyoung = {{ "
      "value = {}, unit = \"Pa\", source = \"a validation\" }}\npoisson = {{ value = {}, source = \"a validation\" "
      "}}\n{}",
      name_of(body.element), body.mesh.region_names.at(0), body.young, body.poisson,
      body.large ? "stiffening = { value = 1e-6, source = \"near zero: the split law\" }\n" : "");
  std::ofstream boundary(folder / "boundary.toml");
  boundary << "name = \"held\"\n" << body.boundary;
  if (!body.motion.empty()) {
    std::ofstream(folder / "motion.csv") << "x,y,z,ux,uy,uz\n" << body.motion;
    boundary << "[[motion]]\nname = \"far field\"\nkind = \"field\"\nfile = \"motion.csv\"\nselect = " << body.moving
             << "\n";
  }
  boundary.close();
  const auto bundle = folder / "bundle.h5";
  std::vector<std::string> options = {"-o", bundle.string(), "--quiet"};
  if (body.large) options.emplace_back("--large-deformation");
  accuracy::run_command(accuracy::precompute_command(workshop.bin, folder / "body.msh", folder / "organ.toml",
                                                     folder / "boundary.toml", options),
                        folder / "log.txt");
  return bundle;
}

}  // namespace palpate::validation
