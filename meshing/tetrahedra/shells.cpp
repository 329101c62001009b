#include "meshing/tetrahedra/shells.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <numeric>
#include <set>

#include "formats/errors.h"

namespace palpate {
namespace {

struct Shell {
  TriangleSurface surface;  // turned outward
  Box box;
  double volume = 0;
  bool was_inward = false;
  int input = 0;
  int parent = -1;  // the smallest shell that encloses it
  bool cavity = false;
  std::int32_t region = 0;
};

void turn_around(TriangleSurface& surface) {
  for (Triangle& t : surface.triangles) std::swap(t[1], t[2]);
}

std::vector<Shell> split(const ShellInput& input, int number) {
  std::int32_t count = 0;
  const auto shell_of = shell_of_triangle(input.surface, &count);
  std::vector<Shell> shells;
  for (std::int32_t s = 0; s < count; ++s) {
    std::vector<bool> keep(shell_of.size());
    for (std::size_t t = 0; t < keep.size(); ++t) keep[t] = shell_of[t] == s;
    Shell shell;
    shell.surface = subset(input.surface, keep);
    shell.volume = enclosed_volume(shell.surface);
    shell.input = number;
    shell.was_inward = shell.volume < 0;
    if (shell.was_inward) turn_around(shell.surface);
    shell.volume = std::abs(shell.volume);
    shell.box = bounding_box(shell.surface);
    shells.push_back(std::move(shell));
  }
  std::stable_sort(shells.begin(), shells.end(), [](const Shell& a, const Shell& b) { return a.volume > b.volume; });
  return shells;
}

bool contains(const Shell& outer, const Shell& inner) {
  for (int d = 0; d < 3; ++d)
    if (inner.box.low[d] < outer.box.low[d] || inner.box.high[d] > outer.box.high[d]) return false;
  return outer.volume > inner.volume && winding_number(outer.surface, inner.surface.points.front()) != 0;
}

void find_parents(std::vector<Shell>& shells) {
  for (std::size_t i = 0; i < shells.size(); ++i)
    for (std::size_t o = 0; o < shells.size(); ++o)
      if (o != i && (shells[i].parent < 0 || shells[o].volume < shells[shells[i].parent].volume) &&
          contains(shells[o], shells[i]))
        shells[i].parent = static_cast<int>(o);
}

std::string describe(const Shell& shell, const std::vector<ShellInput>& inputs) {
  const Point c = centroid_of_volume(shell.surface);
  return fmt::format("{}: shell of volume {:.6g} around ({:.5g}, {:.5g}, {:.5g})", inputs[shell.input].file,
                     shell.volume, c[0], c[1], c[2]);
}

// Within one input the largest shell comes first, so each shell comes after the shells that enclose it.
void find_cavities(std::vector<Shell>& shells, const std::vector<ShellInput>& inputs) {
  for (Shell& shell : shells) {
    if (shell.parent < 0) continue;
    const Shell& parent = shells[shell.parent];
    if (parent.input != shell.input || parent.cavity) continue;
    if (shell.was_inward == parent.was_inward)
      throw InputError(
          fmt::format("{} lies inside another shell of the file and its normals point the same way, so it could be a "
                      "cavity or a tissue of its own; say which with --cavities keep or --nested-regions",
                      describe(shell, inputs)));
    shell.cavity = true;
  }
}

std::string stem(const std::string& file) {
  return std::filesystem::path(file).stem().string();
}

// Makes one region for each named input. For other inputs it makes one for each shell that is not a cavity. Returns
// the names.
std::vector<std::string> number_regions(std::vector<Shell>& shells, const std::vector<ShellInput>& inputs,
                                        const std::vector<std::string>& names) {
  std::vector<std::string> regions;
  std::vector<std::int32_t> of_input(inputs.size(), -1);
  std::vector<int> unnamed(inputs.size(), 0), solid(inputs.size(), 0);
  for (const Shell& shell : shells) solid[shell.input] += !shell.cavity;
  std::string list;
  for (Shell& shell : shells) {
    if (shell.cavity) continue;
    const ShellInput& input = inputs[shell.input];
    if (!input.name.empty() && of_input[shell.input] >= 0) {
      shell.region = of_input[shell.input];
      continue;
    }
    shell.region = of_input[shell.input] = static_cast<std::int32_t>(regions.size());
    ++unnamed[shell.input];
    list += fmt::format("{}{}", list.empty() ? "" : "; ", describe(shell, inputs));
    regions.push_back(!input.name.empty()       ? input.name
                      : solid[shell.input] == 1 ? stem(input.file)
                                                : fmt::format("{} {}", stem(input.file), unnamed[shell.input]));
  }
  if (!names.empty() && names.size() != regions.size())
    throw InputError(
        fmt::format("{} regions are named with --region, but there are {}: {}; give a name for each, in that order",
                    names.size(), regions.size(), list));
  if (!names.empty()) regions = names;
  std::set<std::string> seen;
  for (const std::string& name : regions)
    if (!seen.insert(name).second)
      throw InputError(fmt::format("two regions are called \"{}\"; name each one with --region NAME=FILE", name));
  return regions;
}

// A cavity bounds the region around it.
std::int32_t region_around(const std::vector<Shell>& shells, const Shell& shell) {
  if (shell.parent < 0) return VolumeBoundary::kOutside;
  const Shell& parent = shells[shell.parent];
  return parent.cavity ? VolumeBoundary::kCavity : parent.region;
}

void append(VolumeBoundary& boundary, const Shell& shell, std::int32_t behind, std::int32_t ahead, bool inward) {
  auto patch = std::find_if(boundary.patches.begin(), boundary.patches.end(),
                            [&](const auto& p) { return p.behind == behind && p.ahead == ahead; });
  if (patch == boundary.patches.end()) {
    boundary.patches.push_back({behind, ahead, {}});
    patch = boundary.patches.end() - 1;
  }
  const auto first = static_cast<std::int32_t>(boundary.points.size());
  boundary.points.insert(boundary.points.end(), shell.surface.points.begin(), shell.surface.points.end());
  for (Triangle t : shell.surface.triangles) {
    if (inward) std::swap(t[1], t[2]);
    patch->triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
}

}  // namespace

int winding_number(const TriangleSurface& surface, const Point& point) {
  double angle = 0;
  for (const Triangle& t : surface.triangles) {
    const Point a = surface.points[t[0]] - point, b = surface.points[t[1]] - point, c = surface.points[t[2]] - point;
    const double la = std::sqrt(dot(a, a)), lb = std::sqrt(dot(b, b)), lc = std::sqrt(dot(c, c));
    angle += 2 * std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }
  return static_cast<int>(std::lround(angle / (4 * std::numbers::pi)));
}

VolumeBoundary regions_of_shells(const std::vector<ShellInput>& inputs, bool nested_are_regions,
                                 const std::vector<std::string>& names) {
  std::vector<Shell> shells;
  for (std::size_t i = 0; i < inputs.size(); ++i)
    for (Shell& shell : split(inputs[i], static_cast<int>(i))) shells.push_back(std::move(shell));
  find_parents(shells);
  if (!nested_are_regions) find_cavities(shells, inputs);
  VolumeBoundary boundary;
  boundary.region_names = number_regions(shells, inputs, names);
  for (const Shell& shell : shells) {
    const std::int32_t around = region_around(shells, shell);
    if (shell.cavity && around < 0)
      throw InputError(
          fmt::format("{} is a cavity directly inside a cavity; check the file's shells", describe(shell, inputs)));
    if (!shell.cavity && around == shell.region)
      throw InputError(
          fmt::format("{} lies inside another shell of the same region \"{}\"; leave out the region's file "
                      "name, so that each shell is a region",
                      describe(shell, inputs), boundary.region_names[shell.region]));
    if (shell.cavity)
      append(boundary, shell, around, VolumeBoundary::kCavity, /*inward=*/true);
    else
      append(boundary, shell, shell.region, around, /*inward=*/false);
  }
  return boundary;
}

}  // namespace palpate
