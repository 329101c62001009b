#include "programs/organ/organ_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <functional>

#include <nlohmann/json.hpp>

#include "formats/errors.h"
#include "formats/program.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
  return text;
}

std::string in_make(const std::string& text) {
  return replaced(replaced(text, "$", "$$"), "#", "\\#");
}

// A TOML string with its quotes; names of regions come from files.
std::string in_toml(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += static_cast<unsigned char>(c) < 32 ? ' ' : c;
  }
  return quoted + "\"";
}

// The text as lines of a comment, each at most 120 characters.
std::string comment(const std::string& text) {
  std::string lines, line = "#";
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find(' ', at), text.size());
    const std::string word = text.substr(at, end - at);
    if (line.size() + 1 + word.size() > 120) lines += line + "\n", line = "#";
    line += " " + word;
    at = end + 1;
  }
  return lines + line + "\n";
}

std::string source_text(const OrganSource& source) {
  const std::string file = source.file.string();
  switch (source.kind) {
    case OrganSource::Kind::image:
      return fmt::format("label {} of {}", source.labels_text, file);
    case OrganSource::Kind::surface:
      return fmt::format("the surface {}, in {}", file, source.unit);
    case OrganSource::Kind::mesh:
      return fmt::format("the mesh {}, in {}", file, source.unit);
  }
  return file;
}

// ---- organ.toml ----------------------------------------------------------------------------------------------------

std::string organ_toml(const OrganRequest& request, const OrganSource& source,
                       const std::vector<std::string>& regions) {
  std::string text = comment(
      fmt::format("{}: {}; {:.4g} cm3, box x {:.1f} .. {:.1f}, y {:.1f} .. {:.1f}, z {:.1f} .. {:.1f} mm. Written by "
                  "palpate-organ; docs/files.md explains every key.",
                  request.name, source_text(source), source.volume_mm3 / 1000, source.low[0], source.high[0],
                  source.low[1], source.high[1], source.low[2], source.high[2]));
  text += fmt::format("name = \"{}\"\n", request.name);
  const bool mesh = source.kind == OrganSource::Kind::mesh;
  if (!mesh) text += "# What palpate-surface and palpate-tetrahedra write.\n";
  if (mesh && !request.unit)
    text += "# An assumption: the file does not say its unit. UNIT= says it (m, cm, mm, um).\n";
  text += fmt::format("mesh_unit = \"{}\"\n", mesh ? source.unit : "mm");
  if (source.kind != OrganSource::Kind::image && !request.frame)
    text += "# An assumption: the file does not say what its axes mean. FRAME= says it (LPS, RAS, none).\n";
  text += fmt::format("frame = \"{}\"\n", source.frame);
  text += "# The element for soft, nearly incompressible tissue.\nelement = \"p1-anp\"\n";
  for (const std::string& region : regions) {
    text += fmt::format("\n[[region]]\nname = {}\n", in_toml(region));
    text +=
        "# No image tells the stiffness, and the force is proportional to it: replace the value and its source.\n"
        "young = { value = 5.4, unit = \"kPa\", source = \"assumed: that of liver, 3 x the shear modulus 1.8 +- 0.4 "
        "kPa "
        "of Phys. Med. Biol. 64 (2019) 225001, table 1\" }\n"
        "poisson = { value = 0.45, source = \"assumed: soft tissue is nearly incompressible\" }\n"
        "density = { value = 1060, unit = \"kg/m^3\", source = \"assumed: that of liver, same table\" }\n";
  }
  return text;
}

// ---- boundary/held.toml --------------------------------------------------------------------------------------------

std::string held_toml(const OrganChoices& choices) {
  const auto& d = choices.held_towards;
  return comment(choices.held_reason + " Pictures: boundary.png.") +
         fmt::format(
             "name = \"held\"\n\n[[fixed]]\ndofs = \"xyz\"\nselect = {{ below_quantile = {{ direction = [{}, {}, {}], "
             "quantile = {} }} }}\n",
             -d[0] + 0.0, -d[1] + 0.0, -d[2] + 0.0, choices.held_share);
}

std::string listed(const HeldSet& set, const std::function<std::string(std::size_t)>& text) {
  std::string all;
  for (const std::size_t organ : set.organs) all += (all.empty() ? "" : ", ") + text(organ);
  return all;
}

std::string held_sets_toml(const std::vector<NamedLabel>& labels, const OrganGroup& group) {
  std::string text = comment(
      "An assumption: of each set of organs that touch, the fifth of the surface that lies farthest to the back is "
      "held. Hold what "
      "the body holds, and keep the rest free. Pictures: boundary.png.");
  text += "name = \"held\"\n";
  for (const HeldSet& set : choose_held_sets(group)) {
    text += "\n" + comment(listed(set, [&](std::size_t o) { return labels[o].name; }));
    text += fmt::format(
        "[[fixed]]\ndofs = \"xyz\"\nselect = {{ and = [\n  {{ label = {{ labels = [{}], within = {:.3g} }} }},\n"
        "  {{ half_space = {{ point = [0, {:.4g}, 0], normal = [0, -1, 0] }} }},\n] }}\n",
        listed(set, [&](std::size_t o) { return fmt::format("{}", group.organs[o].labels.front()); }), set.within,
        set.beyond);
  }
  return text;
}

// ---- scenes/press.toml ---------------------------------------------------------------------------------------------

std::string press_toml(const OrganSource& source, const OrganChoices& choices) {
  const double away = std::max(5.0, choices.depth_mm);
  std::string text =
      comment("A finger comes from outside, presses the organ along the surface's normal, rests and withdraws.") +
      "name = \"press\"\nunit = \"mm\"\n\n[[tool]]\nname = \"finger\"\npoints = [[0, 0, 0]]\n";
  text += comment("A disc: the force of a point without a radius belongs to the mesh, not to the organ.");
  text += fmt::format("disc_radius = {:.3g}\n", choices.disc_mm);
  if (source.frame == "none") {
    text += comment(
        "The middle of the side of small y, opposite the held part; the frame does not say where the front is.");
    text += fmt::format("near = [{:.4g}, {:.4g}, {:.4g}]\n", 0.5 * (source.low[0] + source.high[0]), source.low[1],
                        0.5 * (source.low[2] + source.high[2]));
  } else {
    text += comment(
        "The touchable point nearest to the patient's front. Other places: hindmost, leftmost, rightmost, uppermost, "
        "lowest; or near = [x, y, z].");
    text += "at = \"foremost\"\n";
  }
  text +=
      comment("Rows of seconds and depth in mm; below 0 the tool is in front of the surface. " + choices.press_reason);
  text += fmt::format("depth = [[0, -{0:.3g}], [0.5, 0], [1, {1:.3g}], [1.3, {1:.3g}], [1.8, -{0:.3g}]]\n", away,
                      choices.depth_mm);
  return text;
}

// ---- organ.mk ------------------------------------------------------------------------------------------------------

std::string surface_options(const OrganSource& source, const OrganChoices& choices,
                            const OrganChoices::MeshSize& size) {
  std::string text;
  if (source.kind == OrganSource::Kind::image) {
    std::string labels;
    for (const double label : source.labels) labels += fmt::format("{}{}", labels.empty() ? "" : ",", label);
    text = fmt::format("--labels {} --smooth {:.3g}", labels, choices.smooth_mm);
  } else {
    text = "--unit " + source.unit;
  }
  if (source.pieces > 1 || source.kind == OrganSource::Kind::surface) text += " --components largest";
  return text + fmt::format(" --edge-mm {:.3g}", size.surface_mm);
}

std::string organ_mk(const OrganRequest& request, const OrganSource& source, const OrganChoices& choices) {
  std::string text = comment(fmt::format("{}: {}. Written by palpate-organ; docs/files.md explains every variable.",
                                         request.name, source_text(source)));
  const std::string file = in_make(source.file.string());
  if (source.kind == OrganSource::Kind::mesh)
    return text + "# The mesh as it is.\nRESOLUTIONS := given\nMESH ?= " + file + "\n";
  if (source.kind == OrganSource::Kind::surface && !request.unit)
    text +=
        "# An assumption: the file does not say its unit. UNIT= says it (m, cm, mm, um); here it is --unit below.\n";
  text += (source.kind == OrganSource::Kind::image ? "IMAGE ?= " : "SURFACE ?= ") + file + "\n";
  text += "\n" + comment("Mesh sizes, edges in mm: --edge-mm on the surface, --size inside. " + choices.size_reason);
  std::string names, options;
  if (source.kind == OrganSource::Kind::image) options += comment("--smooth: " + choices.smooth_reason);
  if (source.pieces > 1)
    options += comment(fmt::format(
        "--components: the {} has {} pieces. Only the largest is held and kept; the others "
        "have {:.3g} cm3 together.",
        source.kind == OrganSource::Kind::image ? "label" : "surface", source.pieces, source.dropped_mm3 / 1000));
  for (const auto& size : choices.sizes) {
    text += fmt::format("# {}: about {:.0f} vertices, a bundle of up to {:.2g} MB\n", size.name, size.vertices,
                        size.bundle_megabytes);
    names += " " + size.name;
    options += fmt::format("SURFACE_OPTIONS_{} := {}\n", size.name, surface_options(source, choices, size));
  }
  for (const auto& size : choices.sizes)
    options +=
        fmt::format("TETRAHEDRA_OPTIONS_{} := --region {} --size {:.3g}\n", size.name, request.name, size.inside_mm);
  return text + "RESOLUTIONS :=" + names + "\nRESOLUTION ?= medium\n" + options;
}

// Several organs: LABELS in place of a surface.
std::string welded_mk(const OrganRequest& request, const std::vector<NamedLabel>& labels, const OrganSource& source,
                      const OrganGroup& group, const OrganChoices& choices) {
  std::string text =
      comment(fmt::format("{}: {}, welded: one mesh, whose organs share their triangles where they touch, so that they "
                          "cannot slide or part. `make -f "
                          "Makefile.data separate ORGAN={}` makes a bundle of each organ, from the folders in this "
                          "one. Written by palpate-organ; "
                          "docs/files.md explains every variable.",
                          request.name, source_text(source), request.name));
  text += "IMAGE ?= " + in_make(source.file.string()) + "\nLABELS :=";
  for (std::size_t o = 0; o < labels.size(); ++o)
    text += fmt::format(" {}={}", group.organs[o].labels.front(), labels[o].name);
  text += "\n\n" +
          comment(
              "Mesh sizes, edges in mm: --edge-mm on the surfaces, --size inside. A small organ gets shorter edges by "
              "itself. " +
              choices.size_reason);
  std::string names, options;
  for (const auto& size : choices.sizes) {
    text += fmt::format("# {}: about {:.0f} vertices, and more for small organs\n", size.name, size.vertices);
    names += " " + size.name;
    options += fmt::format("TETRAHEDRA_OPTIONS_{} := --edge-mm {:.3g} --size {:.3g}{}\n", size.name, size.surface_mm,
                           size.inside_mm, source.pieces > 1 ? " --components largest" : "");
  }
  return text + "RESOLUTIONS :=" + names + "\nRESOLUTION ?= medium\n" + options;
}

void write_text(const fs::path& file, const std::string& text) {
  std::ofstream stream(file, std::ios::binary);
  stream << text;
  stream.close();
  if (!stream) throw OperationError(fmt::format("{}: cannot be written", file.string()));
}

// Removed unless it was renamed.
struct PartFolder {
  explicit PartFolder(fs::path p) : path(std::move(p)) { fs::remove_all(path); }
  ~PartFolder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
  fs::path path;
};

}  // namespace

void check_organ_name(const OrganRequest& request) {
  const std::string& name = request.name;
  if (!is_plain_name(name))
    throw InputError(fmt::format("NAME: expected letters, digits, - and _ (spleen, left-kidney), found \"{}\"", name));
  if (!fs::is_directory(request.folder))
    throw InputError(
        fmt::format("{}: expected the folder that holds the organs' folders, found none", request.folder.string()));
  const fs::path target = request.folder / name;
  if (fs::exists(target))
    throw InputError(
        fmt::format("{}: expected no such folder yet, found one, which is left as it is; choose another NAME "
                    "or remove the folder",
                    target.string()));
}

namespace {

struct OrganTexts {
  std::string material, held, press, make;
  std::vector<std::string> warnings;
};

void write_folder(const fs::path& folder, const OrganTexts& texts) {
  fs::create_directories(folder / "boundary");
  fs::create_directories(folder / "scenes");
  write_text(folder / "organ.toml", texts.material);
  write_text(folder / "boundary" / "held.toml", texts.held);
  write_text(folder / "scenes" / "press.toml", texts.press);
  write_text(folder / "organ.mk", texts.make);
  const nlohmann::ordered_json report = {{"warnings", texts.warnings}};
  write_text(folder / "new-organ.json", report.dump(2) + "\n");
}

void write_one(const fs::path& folder, const OrganRequest& request, const OrganSource& source,
               std::vector<std::string> warnings) {
  const bool mesh = source.kind == OrganSource::Kind::mesh;
  const OrganChoices choices = choose(source);
  write_folder(folder,
               {organ_toml(request, source, mesh ? source.region_names : std::vector{request.name}), held_toml(choices),
                press_toml(source, choices), organ_mk(request, source, choices), std::move(warnings)});
}

std::vector<std::string> warned(const std::string& organ, const OrganRequest& request, const OrganSource& source) {
  std::vector<std::string> sentences = warnings_of(organ, request, source);
  for (const std::string& sentence : sentences) warn(sentence);
  return sentences;
}

// Calls write with a folder that becomes folder/name at the end.
fs::path write_whole(const OrganRequest& request, const std::function<void(const fs::path&)>& write) {
  const fs::path target = request.folder / request.name;
  try {
    const PartFolder part(request.folder / (request.name + ".part"));
    write(part.path);
    fs::rename(part.path, target);
  } catch (const fs::filesystem_error& error) {
    throw OperationError(fmt::format("{}: cannot be written: {}", target.string(), error.code().message()));
  }
  return target;
}

}  // namespace

fs::path write_organ(const OrganRequest& request, const OrganSource& source) {
  const std::vector<std::string> warnings = warned("the organ", request, source);
  return write_whole(request, [&](const fs::path& folder) { write_one(folder, request, source, warnings); });
}

fs::path write_organs(const OrganRequest& request, const std::vector<NamedLabel>& labels, const OrganGroup& group) {
  const OrganSource all = welded(group);
  const OrganChoices choices = choose(all);
  std::vector<std::string> regions, warnings;
  std::vector<std::vector<std::string>> of_organ;
  for (std::size_t o = 0; o < labels.size(); ++o) {
    regions.push_back(labels[o].name);
    of_organ.push_back(warned(labels[o].name, request, group.organs[o]));
    warnings.insert(warnings.end(), of_organ[o].begin(), of_organ[o].end());
  }
  return write_whole(request, [&](const fs::path& folder) {
    write_folder(folder, {organ_toml(request, all, regions), held_sets_toml(labels, group), press_toml(all, choices),
                          welded_mk(request, labels, all, group, choices), warnings});
    for (std::size_t o = 0; o < labels.size(); ++o) {
      OrganRequest one = request;
      one.name = labels[o].name;
      write_one(folder / one.name, one, group.organs[o], of_organ[o]);
    }
  });
}

}  // namespace palpate
