#include "programs/organ/organ_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>
#include <sstream>

#include "formats/errors.h"
#include "formats/plausible_size.h"
#include "formats/tetrahedral_mesh.h"
#include "meshing/image/label_list.h"
#include "meshing/image/thickness.h"
#include "meshing/image/voxel_mask.h"
#include "meshing/surface/repair_surface.h"
#include "meshing/surface/surface_file.h"

namespace palpate {
namespace {

constexpr double kThickShare = 0.95;  // of the volume is at least as thick as thickness_mm

double millimetres(const std::string& unit) {
  return unit == "m" ? 1000 : unit == "cm" ? 10 : unit == "um" ? 1e-3 : 1;
}

void set_box(OrganSource& source) {
  source.low.fill(std::numeric_limits<double>::infinity());
  source.high.fill(-std::numeric_limits<double>::infinity());
  for (const auto& p : source.border_points)
    for (int d = 0; d < 3; ++d)
      source.low[d] = std::min(source.low[d], p[d]), source.high[d] = std::max(source.high[d], p[d]);
  for (int d = 0; d < 3; ++d)  // an image's points are voxels' centres
    source.low[d] -= 0.5 * source.voxel_mm, source.high[d] += 0.5 * source.voxel_mm;
}

// ---- from an image -------------------------------------------------------------------------------------------------

std::string shown(const LabelEntry& e) {
  return fmt::format("{}{} ({:.4g} cm3)", e.label, e.name.empty() ? "" : " " + e.name, e.volume_mm3 / 1000);
}

// As many labels as a reader takes in, and where the others are.
std::string listed(const std::vector<LabelEntry>& labels) {
  constexpr std::size_t kShown = 8;
  std::string text;
  for (std::size_t l = 0; l < std::min(kShown, labels.size()); ++l) text += (l > 0 ? ", " : "") + shown(labels[l]);
  if (labels.size() > kShown)
    text += fmt::format(" and {} more, which palpate-surface --list shows", labels.size() - kShown);
  return text;
}

// "kidney_right", "Right Kidney" and "kidney right" have the same letters.
std::string letters_of(const std::string& name) {
  std::string letters;
  for (const unsigned char c : name)
    if (std::isalnum(c) || c >= 0x80) letters += static_cast<char>(std::tolower(c));
  return letters;
}

// The labels whose names are nearly the word: equal letters, else those that begin with it or with which it begins.
std::vector<LabelEntry> similar(const std::string& word, const std::vector<LabelEntry>& labels) {
  const std::string asked = letters_of(word);
  for (const bool whole : {true, false}) {
    std::vector<LabelEntry> found;
    for (const LabelEntry& e : labels) {
      const std::string name = letters_of(e.name);
      const bool alike = whole ? name == asked : name.starts_with(asked) || asked.starts_with(name);
      if (!name.empty() && !asked.empty() && alike) found.push_back(e);
    }
    if (!found.empty()) return found;
  }
  return {};
}

// The labels that the text names, by number or by name, separated by commas.
std::vector<LabelEntry> chosen_labels(const std::string& text, const std::vector<LabelEntry>& labels,
                                      const std::string& file, const char* variable) {
  if (labels.empty())
    throw InputError(fmt::format("{}: expected a segmented organ, found an image that is 0 everywhere", file));
  if (text.empty()) {
    if (labels.size() == 1) return labels;
    throw InputError(fmt::format("{}: expected LABEL=, the number or the name of the organ, found several labels: {}",
                                 file, listed(labels)));
  }
  std::vector<LabelEntry> chosen;
  std::istringstream words(text);
  for (std::string word; std::getline(words, word, ',');) {
    double number = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    const bool is_number = error == std::errc() && end == word.data() + word.size();
    const auto found = std::find_if(labels.begin(), labels.end(), [&](const LabelEntry& e) {
      return is_number ? e.label == static_cast<float>(number) : e.name == word;
    });
    if (found == labels.end()) {
      const std::vector<LabelEntry> meant = is_number ? std::vector<LabelEntry>() : similar(word, labels);
      if (meant.empty())
        throw InputError(fmt::format("{}: expected one of its labels, found {}={}; its labels are {}", file, variable,
                                     word, listed(labels)));
      throw InputError(fmt::format("{}: expected one of its labels, found {}={}; nearest are {}", file, variable, word,
                                   listed(meant)));
    }
    chosen.push_back(*found);
  }
  return chosen;
}

// The centres of the voxels that have a neighbour outside, and the area of the faces between the two. The faces of a smooth body
// have 1.5 times its area, the mean over all directions of |n_x| + |n_y| + |n_z|.
void measure_border(const VoxelMask& mask, OrganSource& source) {
  constexpr double kStaircase = 1.5;
  const std::array<double, 3> side = mask.grid.spacing();
  const std::array<double, 3> face = {side[1] * side[2], side[0] * side[2], side[0] * side[1]};
  double faces = 0;
  const auto inside = [&](std::array<int, 3> at) { return mask.inside[mask.grid.index(at[0], at[1], at[2])] != 0; };
  for (int k = 1; k + 1 < mask.grid.size[2]; ++k)
    for (int j = 1; j + 1 < mask.grid.size[1]; ++j)
      for (int i = 1; i + 1 < mask.grid.size[0]; ++i) {
        const std::array<int, 3> at = {i, j, k};
        if (!inside(at)) continue;
        double here = 0;
        for (int a = 0; a < 3; ++a)
          for (const int way : {-1, 1}) {
            std::array<int, 3> next = at;
            next[a] += way;
            if (!inside(next)) here += face[a];
          }
        faces += here;
        if (here > 0) source.border_points.push_back(mask.grid.point(i, j, k));
      }
  source.area_mm2 = faces / kStaircase;
}

void measure_labels(const LabelImage& image, const std::vector<LabelEntry>& chosen, const std::string& name,
                    OrganSource& source) {
  for (const LabelEntry& e : chosen) {
    source.labels.push_back(e.label);
    source.labels_text += fmt::format("{}{}{}", source.labels_text.empty() ? "" : ", ", e.label,
                                      e.name.empty() ? "" : " (" + e.name + ")");
  }
  VoxelMask mask = select_voxels(image, {source.labels, {}}, 0, name);
  const PieceChanges changes = filter_pieces(mask, {PieceFilter::Kind::largest, 1}, true, name);
  source.pieces = changes.pieces, source.dropped_mm3 = changes.dropped_mm3;
  source.touches_border = mask.touched_border;
  const std::array<double, 3> side = mask.grid.spacing();
  source.voxel_mm = (side[0] + side[1] + side[2]) / 3;
  source.volume_mm3 = static_cast<double>(count_inside(mask)) * mask.grid.voxel_volume();
  measure_border(mask, source);
  source.thickness_mm = local_thickness(mask, kThickShare);
  source.thickness_text = fmt::format("95 % of the organ is at least {:.3g} mm thick", source.thickness_mm);
}

void measure_image(const OrganRequest& request, OrganSource& source) {
  const std::string name = request.image.string();
  const LabelImage image = read_label_image(name);
  measure_labels(image, chosen_labels(request.label, list_labels(image, name), name, "LABEL"), name, source);
}

// The area of the faces between voxels of two organs, for each pair.
std::vector<std::vector<double>> contact_areas(const LabelImage& image, const std::vector<OrganSource>& organs) {
  const auto organ_of = [&](float value) {
    for (std::size_t o = 0; o < organs.size(); ++o)
      if (static_cast<float>(organs[o].labels.front()) == value) return static_cast<int>(o);
    return -1;
  };
  const std::array<double, 3> side = image.grid.spacing();
  const std::array<double, 3> face = {side[1] * side[2], side[0] * side[2], side[0] * side[1]};
  std::vector<std::vector<double>> contact(organs.size(), std::vector<double>(organs.size(), 0.0));
  const auto [nx, ny, nz] = image.grid.size;
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i) {
        const float here = image.values[image.grid.index(i, j, k)];
        if (here == 0) continue;
        for (int a = 0; a < 3; ++a) {
          const std::array<int, 3> next = {i + (a == 0), j + (a == 1), k + (a == 2)};
          if (next[0] >= nx || next[1] >= ny || next[2] >= nz) continue;
          const float there = image.values[image.grid.index(next[0], next[1], next[2])];
          if (there == here) continue;
          const int one = organ_of(here), two = organ_of(there);
          if (one < 0 || two < 0) continue;
          contact[one][two] += face[a], contact[two][one] += face[a];
        }
      }
  return contact;
}

// ---- from a surface or a mesh --------------------------------------------------------------------------------------

void measure_triangles(const TriangleSurface& surface, OrganSource& source) {
  source.border_points = surface.points;
  source.volume_mm3 = enclosed_volume(surface), source.area_mm2 = area(surface);
  source.thickness_mm = 2 * source.volume_mm3 / source.area_mm2;  // of a plate; a third of a ball's diameter
  source.thickness_text = fmt::format("a plate of this volume and area is {:.3g} mm thick", source.thickness_mm);
}

void measure_surface(const OrganRequest& request, OrganSource& source) {
  const std::string name = request.surface.string();
  const RepairedSurface repaired =
      repair_surface(read_surface(name, millimetres(source.unit)), {PieceFilter::Kind::largest, 1}, "", name);
  measure_triangles(repaired.surface, source);
  source.pieces = 1 + repaired.dropped, source.dropped_mm3 = repaired.dropped_mm3;
}

void measure_mesh(const OrganRequest& request, OrganSource& source) {
  const TetrahedralMesh mesh = read_mesh(request.mesh);
  source.region_names = mesh.region_names;
  const std::vector<std::array<std::int32_t, 3>> triangles = boundary_triangles(mesh);
  std::vector<bool> used(mesh.nodes.size());
  for (const auto& triangle : triangles)
    for (const auto n : triangle) used[n] = true;
  TriangleSurface surface;
  std::vector<std::int32_t> number(mesh.nodes.size(), -1);
  const double scale = millimetres(source.unit);
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
    if (!used[n]) continue;
    number[n] = static_cast<std::int32_t>(surface.points.size());
    surface.points.push_back(scale * mesh.nodes[n]);
  }
  for (const auto& [a, b, c] : triangles) surface.triangles.push_back({number[a], number[b], number[c]});
  measure_triangles(surface, source);
}

void finish(OrganSource& source, const std::filesystem::path& file) {
  source.file = std::filesystem::absolute(file).lexically_normal();
  set_box(source);
}

}  // namespace

namespace {

double longest_mm(const OrganSource& source) {
  double longest = 0;
  for (int d = 0; d < 3; ++d) longest = std::max(longest, source.high[d] - source.low[d]);
  return longest;
}

std::string length_text(double mm) {
  return mm >= 1e6   ? fmt::format("{:.3g} km", mm / 1e6)
         : mm >= 1e4 ? fmt::format("{:.3g} m", mm / 1e3)
                     : fmt::format("{:.3g} mm", mm);
}

// What to do about a size that is not an organ's: the unit in which it would be one.
std::string other_unit(const OrganSource& source) {
  if (source.kind == OrganSource::Kind::image) return "correct the size of the voxels in the image's header";
  for (const char* unit : {"mm", "cm", "m", "um"}) {
    const double then = longest_mm(source) / millimetres(source.unit) * millimetres(unit);
    if (then >= 1e3 * kSmallestOrgan && then <= 1e3 * kLargestOrgan)
      return fmt::format("with UNIT={} it would be {} long", unit, length_text(then));
  }
  return "no UNIT= makes it one; is this the right file?";
}

}  // namespace

std::vector<std::string> doubts(const OrganRequest& request, const OrganSource& source) {
  constexpr double kNoOrgan = 10;      // times as long as the longest
  constexpr double kNoVolume = 1.001;  // mm^3: a cube of 1 mm, and what the file's numbers round
  const double longest = longest_mm(source), shortest_organ = 1e3 * kSmallestOrgan, longest_organ = 1e3 * kLargestOrgan;
  const bool knows_unit = source.kind == OrganSource::Kind::image || request.unit;
  const bool knows_frame = source.kind == OrganSource::Kind::image || request.frame;
  std::vector<std::string> sentences;
  const bool is_speck = source.volume_mm3 <= kNoVolume;
  if (is_speck || longest < shortest_organ || longest > longest_organ) {
    const std::string text = fmt::format("{}: expected an organ of 1 cm to 1 m, found one of {}, {:.3g} cm3{}; {}",
                                         source.file.string(), length_text(longest), source.volume_mm3 / 1000,
                                         knows_unit ? "" : ", in mm, since UNIT= is not given", other_unit(source));
    if (is_speck || longest > longest_organ * kNoOrgan || !knows_unit) throw InputError(text);
    sentences.push_back(text);
  }
  if (!knows_unit)
    sentences.push_back(
        fmt::format("{}: taken to be in mm, in which the organ is {} long; UNIT= (m, cm, mm, um) says it",
                    source.file.string(), length_text(longest)));
  if (!knows_frame)
    sentences.push_back(fmt::format(
        "{}: x, y, z are taken to point to the patient's left, back and head; FRAME= (LPS, RAS, none) says it",
        source.file.string()));
  return sentences;
}

bool is_plain_name(const std::string& name) {
  return !name.empty() && name.size() <= 64 && std::isalnum(static_cast<unsigned char>(name[0])) &&
         std::all_of(name.begin(), name.end(),
                     [](unsigned char c) { return c < 128 && (std::isalnum(c) || c == '-' || c == '_'); });
}

std::vector<NamedLabel> parse_named_labels(const std::string& text) {
  std::string blanks = text;
  std::replace(blanks.begin(), blanks.end(), ',', ' ');
  std::istringstream words(blanks);
  std::vector<NamedLabel> labels;
  for (std::string word; words >> word;) {
    const std::size_t equals = word.find('=');
    const NamedLabel label{word.substr(0, equals), equals == std::string::npos ? "" : word.substr(equals + 1)};
    if (label.label.empty() || !is_plain_name(label.name))
      throw InputError(
          fmt::format("LABELS: expected LABEL=NAME LABEL=NAME (5=liver 2=right-kidney), each NAME of letters, digits, "
                      "- and _, found \"{}\"",
                      word));
    for (const NamedLabel& other : labels)
      if (other.label == label.label || other.name == label.name)
        throw InputError(fmt::format("LABELS: expected each label and each name once, found \"{}\" after \"{}={}\"",
                                     word, other.label, other.name));
    labels.push_back(label);
  }
  if (labels.size() < 2)
    throw InputError(
        fmt::format("LABELS: expected two organs or more (5=liver 2=right-kidney), found \"{}\"; for one organ: "
                    "LABEL=",
                    text));
  return labels;
}

OrganGroup measure_group(const OrganRequest& request, const std::vector<NamedLabel>& labels) {
  const std::string name = request.image.string();
  const LabelImage image = read_label_image(name);
  const std::vector<LabelEntry> entries = list_labels(image, name);
  OrganGroup group;
  for (const NamedLabel& label : labels) {
    OrganSource source;
    measure_labels(image, chosen_labels(label.label, entries, name, "LABELS"), name, source);
    for (std::size_t other = 0; other < group.organs.size(); ++other)
      if (group.organs[other].labels == source.labels)
        throw InputError(fmt::format("LABELS: expected each label once, found {} for \"{}\" and \"{}\"",
                                     source.labels_text, labels[other].name, label.name));
    finish(source, request.image);
    group.organs.push_back(std::move(source));
  }
  group.contact = contact_areas(image, group.organs);
  return group;
}

OrganSource measure_source(const OrganRequest& request) {
  OrganSource source;
  source.unit = request.unit.value_or("mm"), source.frame = request.frame.value_or("LPS");
  std::filesystem::path file = request.image;
  if (!request.image.empty()) {
    measure_image(request, source);
  } else if (!request.surface.empty()) {
    source.kind = OrganSource::Kind::surface, file = request.surface;
    measure_surface(request, source);
  } else {
    source.kind = OrganSource::Kind::mesh, file = request.mesh;
    measure_mesh(request, source);
  }
  finish(source, file);
  return source;
}

}  // namespace palpate
