#include "programs/organ/organ_choices.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

// Rounded down to two digits, so that the files are easy to read.
double two_digits(double value) {
  if (!(value > 0)) return value;
  const double unit = std::pow(10, std::floor(std::log10(value)) - 1);
  return std::floor(value / unit + 1e-9) * unit;
}

// Both from meshes of the liver of pipelines/liver, of 200 to 20,000 vertices.
constexpr double kVertexShare = 0.75;   // vertices = share * volume / edge^3, edge: --size
constexpr double kSurfaceFactor = 1.5;  // edges on the surface, of those inside

double vertices_of(const OrganSource& source, double edge) {
  return kVertexShare * source.volume_mm3 / std::pow(edge, 3);
}

// A column for each axis of each surface node, each with three numbers of 4 bytes for each surface node. The surface has half as many
// vertices as triangles.
double bundle_megabytes(const OrganSource& source, double edge) {
  const double nodes = 0.5 * source.area_mm2 / (0.25 * std::sqrt(3.0) * edge * edge);
  return 1e-6 * (3 * nodes) * (3 * nodes) * 4;
}

void choose_sizes(const OrganSource& source, OrganChoices& choices) {
  constexpr double kVertices = 1700, kMostVertices = 10'000;  // of the default size
  const double by_volume = std::cbrt(kVertexShare * source.volume_mm3 / kVertices);
  const double by_thickness = source.thickness_mm / 2;
  const double least = std::cbrt(kVertexShare * source.volume_mm3 / kMostVertices);
  const double edge = std::max(std::min(by_volume, by_thickness), least);
  choices.size_reason =
      edge == by_volume
          ? fmt::format("From the volume of {:.4g} cm3: about {} vertices, which take seconds.",
                        source.volume_mm3 / 1000, kVertices)
          : fmt::format("From the thickness: {}, and thin parts need two edges across{}.", source.thickness_text,
                        edge == least ? fmt::format("; no more than about {} vertices", kMostVertices) : "");
  for (const auto& [name, factor] : {std::pair{"coarse", 1.4}, std::pair{"medium", 1.0}, std::pair{"fine", 0.7}}) {
    const double inside = two_digits(factor * edge);
    const double surface = two_digits(kSurfaceFactor * inside);
    choices.sizes.push_back({name, inside, surface, vertices_of(source, inside), bundle_megabytes(source, surface)});
  }
  constexpr double kLargeBundle = 200;  // MB; that of a compact organ has 10 to 30 at this size
  if (const double megabytes = choices.sizes[1].bundle_megabytes; megabytes > kLargeBundle)
    choices.size_warning = fmt::format(
        "the surface of {:.4g} cm2 around {:.4g} cm3 makes a bundle of up to {:.0f} MB: noise in the label, or thin "
        "parts ({}); "
        "smooth the label, or set longer edges in organ.mk",
        source.area_mm2 / 100, source.volume_mm3 / 1000, megabytes, source.thickness_text);
}

// Gaussian smoothing by a width s loses a rod that is thinner than 2.35 s: in its middle exp(-r^2 / (2 s^2)) is one half.
void choose_smoothing(const OrganSource& source, OrganChoices& choices) {
  const double by_voxel = 2 * source.voxel_mm, by_thickness = source.thickness_mm / 3;
  choices.smooth_mm = two_digits(std::min(by_voxel, by_thickness));
  choices.smooth_reason =
      by_voxel <= by_thickness
          ? fmt::format("Twice the voxels' mean side of {:.3g} mm, which hides their steps.", source.voxel_mm)
          : fmt::format(
                "A third of the thickness of {:.3g} mm, so that thin parts are kept; the voxels' mean side is "
                "{:.3g} mm.",
                source.thickness_mm, source.voxel_mm);
}

std::array<double, 3> back_of(const std::string& frame) {
  return frame == "RAS" ? std::array<double, 3>{0, -1, 0} : std::array<double, 3>{0, 1, 0};
}

// The extents of the points beyond a share of them along a direction, across it; direction: along y.
double narrower_extent(std::vector<std::array<double, 3>> points, double towards, double share) {
  std::sort(points.begin(), points.end(),
            [&](const auto& a, const auto& b) { return towards * a[1] > towards * b[1]; });
  points.resize(std::max<std::size_t>(3, static_cast<std::size_t>(share * static_cast<double>(points.size()))));
  double extent[2];
  for (const int d : {0, 2}) {
    const auto [low, high] =
        std::minmax_element(points.begin(), points.end(), [d](const auto& a, const auto& b) { return a[d] < b[d]; });
    extent[d / 2] = (*high)[d] - (*low)[d];
  }
  return std::min(extent[0], extent[1]);
}

void choose_held(const OrganSource& source, OrganChoices& choices) {
  const std::array<double, 3> back = back_of(source.frame);
  choices.held_towards = back;
  const double across = std::min(source.high[0] - source.low[0], source.high[2] - source.low[2]);
  constexpr double kWide = 0.4;  // of the organ's narrower extent across; on a narrower base it would swing as a whole
  double width = 0;
  for (const double share : {0.2, 0.3, 0.4}) {
    choices.held_share = share;
    width = narrower_extent(source.border_points, back[1], share);
    if (width >= kWide * across) break;
  }
  choices.held_reason = fmt::format(
      "An assumption: the {:.0f} % of the surface that lies farthest {} is held, {:.0f} mm wide where it is "
      "narrower{}. "
      "Hold what the body holds, and keep the rest free.",
      100 * choices.held_share, source.frame == "none" ? "along y" : "to the back", width,
      choices.held_share > 0.2 ? " (20 % would be a base too narrow)" : "");
}

void choose_press(const OrganSource& source, OrganChoices& choices) {
  double extent = source.high[0] - source.low[0];
  for (int d = 1; d < 3; ++d) extent = std::min(extent, source.high[d] - source.low[d]);
  choices.depth_mm = two_digits(std::min(10.0, 0.08 * extent));  // the surface may move by more than the tool's place
  choices.disc_mm = two_digits(std::min(8.0, 0.12 * extent));
  choices.press_reason = fmt::format(
      "8 % of the organ's smallest extent of {:.3g} mm, at most 10 mm: linear elasticity is good up to 10 %.", extent);
}

}  // namespace

OrganChoices choose(const OrganSource& source) {
  OrganChoices choices;
  if (source.kind != OrganSource::Kind::mesh) choose_sizes(source, choices);
  if (source.kind == OrganSource::Kind::image) choose_smoothing(source, choices);
  choose_held(source, choices);
  choose_press(source, choices);
  return choices;
}

std::vector<std::string> warnings_of(const std::string& organ, const OrganRequest& request, const OrganSource& source) {
  std::vector<std::string> sentences = doubts(request, source);
  if (const std::string large = choose(source).size_warning; !large.empty())
    sentences.push_back(fmt::format("{}: {}", organ, large));
  if (source.pieces > 1)
    sentences.push_back(
        fmt::format("{} has {} pieces; the largest is kept, {:.4g} cm3; the others have {:.3g} cm3 together", organ,
                    source.pieces, source.volume_mm3 / 1000, source.dropped_mm3 / 1000));
  if (source.touches_border) sentences.push_back(organ + " touches the image's border, where the organ may be cut off");
  return sentences;
}

OrganSource welded(const OrganGroup& group) {
  OrganSource all = group.organs.front();
  all.labels.clear(), all.labels_text.clear(), all.border_points.clear();
  all.volume_mm3 = all.area_mm2 = all.thickness_mm = all.dropped_mm3 = 0;
  for (const OrganSource& organ : group.organs) {
    all.labels.insert(all.labels.end(), organ.labels.begin(), organ.labels.end());
    all.labels_text += (all.labels_text.empty() ? "" : ", ") + organ.labels_text;
    all.border_points.insert(all.border_points.end(), organ.border_points.begin(), organ.border_points.end());
    all.volume_mm3 += organ.volume_mm3, all.area_mm2 += organ.area_mm2, all.dropped_mm3 += organ.dropped_mm3;
    all.touches_border |= organ.touches_border, all.pieces = std::max(all.pieces, organ.pieces);
    // The mesher gives small and thin tissues finer triangles by itself: the thickest organ sets the common size.
    if (organ.thickness_mm > all.thickness_mm)
      all.thickness_mm = organ.thickness_mm, all.thickness_text = organ.thickness_text;
    for (int d = 0; d < 3; ++d)
      all.low[d] = std::min(all.low[d], organ.low[d]), all.high[d] = std::max(all.high[d], organ.high[d]);
  }
  return all;
}

std::vector<HeldSet> choose_held_sets(const OrganGroup& group) {
  constexpr double kLeastContact = 0.02, kHeldShare = 0.2;
  const std::size_t count = group.organs.size();
  std::vector<HeldSet> sets;
  std::vector<bool> placed(count, false);
  for (std::size_t first = 0; first < count; ++first) {
    if (placed[first]) continue;
    HeldSet set;
    set.organs = {first}, placed[first] = true;
    for (std::size_t at = 0; at < set.organs.size(); ++at)
      for (std::size_t other = 0; other < count; ++other) {
        const OrganSource &one = group.organs[set.organs[at]], &two = group.organs[other];
        if (placed[other] ||
            group.contact[set.organs[at]][other] < kLeastContact * std::min(one.area_mm2, two.area_mm2))
          continue;
        set.organs.push_back(other), placed[other] = true;
      }
    std::vector<double> back;
    for (const std::size_t o : set.organs)
      for (const auto& p : group.organs[o].border_points) back.push_back(p[1]);
    const auto at = back.begin() + static_cast<std::ptrdiff_t>((1 - kHeldShare) * static_cast<double>(back.size()));
    std::nth_element(back.begin(), at, back.end());
    set.beyond = *at;
    set.within = std::max(3.0, 2 * group.organs.front().voxel_mm);
    sets.push_back(std::move(set));
  }
  return sets;
}

}  // namespace palpate
