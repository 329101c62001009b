// palpate-organ: writes the folder of a new organ from a label image, a surface or a mesh.
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "formats/command_line.h"
#include "formats/program.h"
#include "programs/organ/organ_files.h"

namespace palpate {
namespace {

void define(CLI::App& app, OrganRequest& request) {
  app.add_option("--name", request.name, "Name of the folder and the tissue: letters, digits, - and _")->required();
  auto* image = app.add_option("--image", request.image, "Label image, as for palpate-surface");
  auto* surface = app.add_option("--surface", request.surface, "Closed surface: .off .obj .ply .stl");
  auto* mesh = app.add_option("--mesh", request.mesh, "Tetrahedral mesh: MSH 2.2 or 4.1");
  surface->excludes(image), mesh->excludes(image)->excludes(surface);
  auto* label = app.add_option("--label", request.label,
                               "The organ in the image: a number, several (2,7), or a name of palpate-surface --list")
                    ->needs(image);
  app.add_option("--labels", request.labels, "Several organs: \"5=liver 2=right-kidney\", LABEL=NAME of each")
      ->needs(image)
      ->excludes(label);
  app.add_option("--unit", request.unit, "Unit of a surface or a mesh; images have their own (default: mm)")
      ->check(CLI::IsMember({"m", "cm", "mm", "um"}))
      ->excludes(image);
  app.add_option("--frame", request.frame, "What the axes of a surface or a mesh mean; images say it (default: LPS)")
      ->check(CLI::IsMember({"LPS", "RAS", "none"}))
      ->excludes(image);
  app.add_option("--folder", request.folder, "Folder that holds the organs' folders (default: pipelines)");
  app.callback([=] {
    if (image->empty() && surface->empty() && mesh->empty())
      throw CLI::RequiredError("--image (IMAGE=), --surface (SURFACE=) or --mesh (MESH=)");
  });
}

void say_size(const std::string& organ, const OrganSource& source) {
  fmt::print("{}: {:.4g} cm3, {:.0f} x {:.0f} x {:.0f} mm, {}\n", organ, source.volume_mm3 / 1000,
             source.high[0] - source.low[0], source.high[1] - source.low[1], source.high[2] - source.low[2],
             source.thickness_text);
}

void write_several(const OrganRequest& request) {
  const std::vector<NamedLabel> labels = parse_named_labels(request.labels);
  const OrganGroup group = measure_group(request, labels);
  const std::filesystem::path folder = write_organs(request, labels, group);
  for (std::size_t o = 0; o < labels.size(); ++o) say_size(labels[o].name, group.organs[o]);
  fmt::print("wrote {}, and in it a folder for each organ\n", folder.string());
  fmt::print("next: make -f Makefile.data ORGAN={}              one bundle, the organs welded where they touch\n",
             request.name);
  fmt::print("or:   make -f Makefile.data separate ORGAN={}     one bundle for each organ\n", request.name);
}

void run(const OrganRequest& request) {
  check_organ_name(request);
  if (!request.labels.empty()) return write_several(request);
  const OrganSource source = measure_source(request);
  const std::filesystem::path folder = write_organ(request, source);
  say_size(request.name, source);
  for (const char* file : {"organ.toml", "boundary/held.toml", "scenes/press.toml", "organ.mk", "new-organ.json"})
    fmt::print("wrote {}\n", (folder / file).string());
  fmt::print("next: make -f Makefile.data ORGAN={}\n", request.name);
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  palpate::OrganRequest request;
  request.folder = "pipelines";
  return palpate::run_program(
      argc, argv, "palpate-organ", "Label image, surface or mesh -> the folder of a new organ",
      [&](CLI::App& app) { palpate::define(app, request); }, [&] { palpate::run(request); });
}
