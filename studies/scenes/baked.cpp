#include "studies/scenes/baked.h"

#include <fmt/format.h>

#include <fstream>
#include <sstream>

#include "formats/atomic_file.h"
#include "formats/errors.h"
#include "formats/program.h"
#include "formats/tetrahedral_mesh.h"
#include "studies/accuracy/command.h"

namespace palpate::scenes {
namespace {

std::string text_of(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

}  // namespace

BakedOrgan::BakedOrgan(const ScenesOptions& options) : options_(options), organ_(read_organ_config(options.organ)) {
  for (const char* folder : {"boundary", "bundles", "logs"})
    std::filesystem::create_directories(options.output / folder);
  // Files that the boundary set names relative to its own folder.
  for (const auto& entry :
       std::filesystem::directory_iterator(std::filesystem::absolute(options.boundary).parent_path()))
    if (const auto link = options.output / "boundary" / entry.path().filename();
        entry.is_regular_file() && !std::filesystem::exists(std::filesystem::symlink_status(link)))
      std::filesystem::create_symlink(entry.path(), link);
  const ElasticBody plain = body_of(options.boundary);
  way_ = longest_way(plain), own_modes_ = static_cast<int>(plain.motions.size());
  full_ = std::make_unique<FullBody>(body_of(boundary_with(options.modes)), organ_.element);
}

ElasticBody BakedOrgan::body_of(const std::filesystem::path& boundary) const {
  return make_elastic_body(read_mesh(options_.mesh), organ_, read_boundary_config(boundary),
                           {options_.mesh, options_.organ, boundary, options_.image});
}

std::filesystem::path BakedOrgan::boundary_with(int added) const {
  std::string text = text_of(options_.boundary) + "\n";
  const auto unit = [&](const Eigen::Vector3d& p) {
    const Eigen::Vector3d q = p / organ_.mesh_unit.metres;
    return fmt::format("[{}, {}, {}]", q[0], q[1], q[2]);
  };
  for (int m = 0; m < added; ++m)
    text += fmt::format(
        "[[motion]]\nname = \"study pressure {}\"\nkind = \"pressure\"\nselect = {{ everything = true }}\n", m + 1);
  // A twentieth of the way is wide enough for the places of a needle that is moved aside.
  text +=
      fmt::format("[[corridor]]\nname = \"study needle\"\nfrom = {}\nto = {}\nradius = {}\n", unit(way_.entry.point),
                  unit(way_.entry.point + way_.length * way_.inwards), 0.05 * way_.length / organ_.mesh_unit.metres);
  const auto file = options_.output / "boundary" / fmt::format("study-{}.toml", added);
  if (text_of(file) != text) write_text_atomically(file, text);
  return file;
}

std::filesystem::path BakedOrgan::bake(const std::string& name, int added, std::vector<std::string> options) const {
  const auto file = options_.output / "bundles" / (name + ".h5");
  if (!baked_.insert(name).second) return file;
  say(fmt::format("baking {} with {} modes", options_.mesh.string(), own_modes_ + added));
  options.insert(options.end(), {"-o", file.string()});
  if (!options_.image.empty()) options.insert(options.end(), {"--image", options_.image.string()});
  accuracy::run_command(
      accuracy::precompute_command(options_.bin, options_.mesh, options_.organ, boundary_with(added), options),
      options_.output / "logs" / (name + ".txt"));
  return file;
}

std::filesystem::path BakedOrgan::bundle(int added) const {
  return bake(fmt::format("modes-{}", added), added, {});
}

std::filesystem::path BakedOrgan::large_bundle() const {
  return full_->is_linear() ? bake("large", 0, {"--large-deformation"}) : std::filesystem::path();
}

}  // namespace palpate::scenes
