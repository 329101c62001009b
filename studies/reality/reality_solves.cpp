// Plays a measured test by the converged solution of large deformation and prints JSON. study.py runs it.
//
//   reality_solves cylinder --cells 8 --press sliding --strains 0.1,0.2 ...
//   reality_solves beam --cells 3 --element p1-anp --sag 0.0064 --loads 0.5,1 ...
#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "formats/command_line.h"
#include "formats/program.h"
#include "precompute/solver/petsc_session.h"
#include "studies/reality/loaded_beam.h"
#include "studies/reality/pressed_cylinder.h"
#include "studies/timing/timing.h"

namespace palpate::reality {
namespace {

using Json = nlohmann::ordered_json;

const std::map<std::string, Press> kPresses = {
    {"sliding", Press::sliding}, {"sticking", Press::sticking}, {"disc", Press::disc}};
const std::map<std::string, Element> kElements = {
    {"p1", Element::p1}, {"p1-anp", Element::p1_anp}, {"p1-ang", Element::p1_ang}, {"p2-p0", Element::p2_p0}};

struct Options {
  CylinderTest cylinder = {};
  std::vector<double> strains, yeoh;
  std::optional<double> exponent;
  BeamTest beam = {};
  Element element = Element::p1_anp;
  bool linear = false;
};

Json cylinder(const Options& o) {
  CylinderTest test = o.cylinder;
  if (!o.yeoh.empty()) test.law = LawForm::yeoh(o.yeoh[0], o.yeoh[1]);
  if (o.exponent) test.law = LawForm::ogden(*o.exponent);
  const PressedCylinder found = press_cylinder(test, o.strains);
  return {{"nodes", found.nodes}, {"force_over_shear_m2", found.force}, {"slope_over_shear_m2", found.slope}};
}

Json beam(const Options& o) {
  const LoadedBeam found = o.linear ? load_beam_linearly(o.beam, o.element) : load_beam(o.beam, o.element);
  Json moved = Json::array();
  for (const EndMotion& m : found.moved) moved.push_back({{"along_m", m.along}, {"down_m", m.down}, {"turn", m.turn}});
  return {{"nodes", found.nodes}, {"young_Pa", found.young}, {"end", moved}};
}

void add_cylinder(CLI::App& command, Options& o) {
  command.add_option("--radius", o.cylinder.radius, "m")->required();
  command.add_option("--height", o.cylinder.height, "m")->required();
  command.add_option("--poisson", o.cylinder.poisson)->required();
  command.add_option("--cells", o.cylinder.cells, "along the radius; even for a disc")->required();
  command.add_option("--press", o.cylinder.press)->required()->transform(CLI::CheckedTransformer(kPresses));
  command.add_option("--element", o.cylinder.element)->transform(CLI::CheckedTransformer(kElements));
  auto* yeoh = command.add_option("--yeoh", o.yeoh, "c2 and c3 over the shear modulus; default: neo-Hookean");
  yeoh->delimiter(',')->expected(2);
  command.add_option("--ogden", o.exponent, "the exponent of Ogden's law")->excludes(yeoh);
  command.add_option("--strains", o.strains, "depth over height, growing")->required()->delimiter(',');
}

void add_beam(CLI::App& command, Options& o) {
  command.add_option("--size", o.beam.size, "length, width, height, m")->required()->delimiter(',');
  command.add_option("--density", o.beam.density, "kg/m3")->required();
  command.add_option("--gravity", o.beam.gravity, "m/s2")->required();
  command.add_option("--poisson", o.beam.poisson)->required();
  command.add_option("--loads", o.beam.loads, "N, on the upper edge of the free end")->required()->delimiter(',');
  command.add_option("--sag", o.beam.sag, "m, under the own weight")->required();
  command.add_option("--above", o.beam.above, "m above the base: the point that sags so")->required();
  command.add_option("--beyond", o.beam.beyond, "m beyond the free end")->required();
  command.add_option("--cells", o.beam.cells, "through the height")->required();
  command.add_option("--element", o.element)->required()->transform(CLI::CheckedTransformer(kElements));
  command.add_flag("--linear", o.linear, "linear elasticity");
}

int run(int argc, char** argv) {
  Options o;
  CLI::App* pressed = nullptr;
  return run_program(
      argc, argv, "reality_solves", "Plays a measured test on a cylinder or a beam.",
      [&](CLI::App& app) {
        app.require_subcommand(1);
        pressed = app.add_subcommand("cylinder", "a cylinder between two plates, or glued and under a disc");
        add_cylinder(*pressed, o);
        add_beam(*app.add_subcommand("beam", "a beam that is clamped at one end"), o);
      },
      [&] {
        const PetscSession session({});
        const double begun = studies::processor_seconds();
        Json found = pressed->parsed() ? cylinder(o) : beam(o);
        found["seconds"] = studies::processor_seconds() - begun;
        std::puts(found.dump().c_str());
      });
}

}  // namespace
}  // namespace palpate::reality

int main(int argc, char** argv) {
  return palpate::reality::run(argc, argv);
}
