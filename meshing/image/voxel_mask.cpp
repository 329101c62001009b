#include "meshing/image/voxel_mask.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <numeric>

#include "formats/errors.h"

namespace palpate {
namespace {

constexpr std::uint64_t kMostPieces = 1000;

[[noreturn]] void refuse_absent(const std::string& wanted, const LabelImage& image, const std::string& name) {
  std::string hint;
  for (const float value : image.values) {
    if (std::abs(value) > 255 && std::fmod(std::abs(value), 256) == 0) {
      hint = "; values that are multiples of 256 mean that the header gives the wrong byte order";
      break;
    }
  }
  throw InputError(fmt::format("{}: expected voxels with {}, found only {}; choose with --labels or --threshold{}",
                               name, wanted, describe_values(image), hint));
}

// Returns the one value besides 0. Errors: InputError that lists the values when there are several or none.
double only_label(const LabelImage& image, const std::string& name) {
  std::optional<float> label;
  for (const float value : image.values) {
    if (value == 0) continue;
    if (label && *label != value) {
      throw InputError(fmt::format("{}: expected one label, found {}; choose with --labels or --threshold", name,
                                   describe_values(image)));
    }
    label = value;
  }
  if (!label)
    throw InputError(fmt::format("{}: expected a segmented organ, found an image that is 0 everywhere", name));
  return *label;
}

std::vector<std::uint8_t> select_above(const LabelImage& image, double threshold, const std::string& name) {
  std::vector<std::uint8_t> inside(image.values.size());
  bool any = false;
  for (std::size_t v = 0; v < inside.size(); ++v) {
    inside[v] = image.values[v] >= threshold;
    any |= inside[v] != 0;
  }
  if (!any) refuse_absent(fmt::format("a value of at least {}", threshold), image, name);
  return inside;
}

std::vector<std::uint8_t> select_labels(const LabelImage& image, std::vector<double> labels, const std::string& name) {
  std::sort(labels.begin(), labels.end());
  std::vector<char> found(labels.size(), 0);
  std::vector<std::uint8_t> inside(image.values.size());
  for (std::size_t v = 0; v < inside.size(); ++v) {
    const auto label = std::find(labels.begin(), labels.end(), image.values[v]);
    if (label == labels.end()) continue;
    inside[v] = 1;
    found[static_cast<std::size_t>(label - labels.begin())] = 1;
  }
  std::string absent;
  for (std::size_t i = 0; i < labels.size(); ++i)
    if (!found[i] && (i == 0 || labels[i] != labels[i - 1]))
      absent += fmt::format("{}label {}", absent.empty() ? "" : " and ", labels[i]);
  if (!absent.empty()) refuse_absent(absent, image, name);
  return inside;
}

std::vector<std::uint8_t> select(const LabelImage& image, const LabelSelection& selection, const std::string& name) {
  if (selection.threshold) return select_above(image, *selection.threshold, name);
  if (selection.labels.empty()) return select_labels(image, {only_label(image, name)}, name);
  return select_labels(image, selection.labels, name);
}

double millimetres_cubed(double number, const std::string& unit) {
  return unit == "cm3" ? 1000 * number : number;
}

}  // namespace

VoxelMask select_voxels(const LabelImage& image, const LabelSelection& selection, double padding_mm,
                        const std::string& image_name) {
  const std::vector<std::uint8_t> inside = select(image, selection, image_name);
  const VoxelGrid& whole = image.grid;

  // find the box of the selected voxels
  std::array<int, 3> low = whole.size, high = {-1, -1, -1};
  for (int k = 0; k < whole.size[2]; ++k) {
    for (int j = 0; j < whole.size[1]; ++j) {
      for (int i = 0; i < whole.size[0]; ++i) {
        if (!inside[whole.index(i, j, k)]) continue;
        low = {std::min(low[0], i), std::min(low[1], j), std::min(low[2], k)};
        high = {std::max(high[0], i), std::max(high[1], j), std::max(high[2], k)};
      }
    }
  }

  // pad the box on every side, also beyond the image
  VoxelMask mask;
  const std::array<double, 3> spacing = whole.spacing();
  std::array<int, 3> first{};
  for (int axis = 0; axis < 3; ++axis) {
    const int padding = 1 + static_cast<int>(std::ceil(padding_mm / spacing[axis]));
    first[axis] = low[axis] - padding;
    mask.grid.size[axis] = high[axis] - low[axis] + 1 + 2 * padding;
    mask.touched_border |= whole.size[axis] > 1 && (low[axis] == 0 || high[axis] == whole.size[axis] - 1);
  }
  mask.grid.axis = whole.axis;
  mask.grid.origin = whole.point(first[0], first[1], first[2]);
  mask.inside.assign(mask.grid.voxels(), 0);
  for (int k = low[2]; k <= high[2]; ++k) {
    for (int j = low[1]; j <= high[1]; ++j) {
      for (int i = low[0]; i <= high[0]; ++i) {
        mask.inside[mask.grid.index(i - first[0], j - first[1], k - first[2])] = inside[whole.index(i, j, k)];
      }
    }
  }
  return mask;
}

PieceFilter parse_piece_filter(const std::string& text) {
  using Kind = PieceFilter::Kind;
  if (text == "all") return {Kind::all, 0};
  if (text == "largest") return {Kind::largest, 1};
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const std::string unit(end, text.data() + text.size());
  if (error == std::errc() && number >= 0 && std::isfinite(number)) {
    if (unit == "%") return {Kind::share, number / 100};
    if (unit == "mm3" || unit == "cm3") return {Kind::volume, millimetres_cubed(number, unit)};
    if (unit.empty() && number >= 1 && number == std::floor(number)) return {Kind::largest, number};
  }
  throw InputError(
      fmt::format("--components: expected all, largest, a count (3), a volume (2.5mm3, 1cm3) or a share of the largest "
                  "(1%), found '{}'",
                  text));
}

std::vector<bool> kept_pieces(const PieceFilter& filter, const std::vector<double>& volumes) {
  std::vector<std::size_t> order(volumes.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return volumes[a] > volumes[b]; });
  std::vector<bool> keep(volumes.size());
  for (std::size_t rank = 0; rank < order.size(); ++rank) {
    const double volume = volumes[order[rank]];
    switch (filter.kind) {
      case PieceFilter::Kind::all:
        keep[order[rank]] = true;
        break;
      case PieceFilter::Kind::largest:
        keep[order[rank]] = rank < filter.number;
        break;
      case PieceFilter::Kind::volume:
        keep[order[rank]] = volume >= filter.number;
        break;
      case PieceFilter::Kind::share:
        keep[order[rank]] = volume >= filter.number * volumes[order[0]];
        break;
    }
  }
  return keep;
}

Pieces connected_pieces(const VoxelMask& mask) {
  const auto [nx, ny, nz] = mask.grid.size;
  constexpr std::int32_t kUnseen = std::numeric_limits<std::int32_t>::max();
  Pieces pieces;
  pieces.of_voxel.assign(mask.grid.voxels(), kUnseen);

  // list the steps to the 6 face neighbours, then those to the 12 edge neighbours
  std::vector<std::array<int, 3>> steps;
  for (const int most : {1, 2}) {
    for (int k = -1; k <= 1; ++k) {
      for (int j = -1; j <= 1; ++j) {
        for (int i = -1; i <= 1; ++i) {
          if (i * i + j * j + k * k == most) steps.push_back({i, j, k});
        }
      }
    }
  }

  std::vector<std::array<int, 3>> front;
  const auto flood = [&](std::array<int, 3> seed) {
    const std::size_t first = mask.grid.index(seed[0], seed[1], seed[2]);
    const bool in = mask.inside[first];
    std::vector<std::uint64_t>& counts = in ? pieces.inside : pieces.background;
    const auto number = static_cast<std::int32_t>(counts.size());
    const std::int32_t mark = in ? number : -1 - number;
    const std::size_t neighbours = in ? 6 : 18;
    counts.push_back(1);
    pieces.of_voxel[first] = mark;
    front.assign(1, seed);
    while (!front.empty()) {
      const auto [i, j, k] = front.back();
      front.pop_back();
      for (std::size_t s = 0; s < neighbours; ++s) {
        const int a = i + steps[s][0], b = j + steps[s][1], c = k + steps[s][2];
        if (a < 0 || b < 0 || c < 0 || a >= nx || b >= ny || c >= nz) continue;
        const std::size_t next = mask.grid.index(a, b, c);
        if (pieces.of_voxel[next] != kUnseen || mask.inside[next] != mask.inside[first]) continue;
        pieces.of_voxel[next] = mark;
        ++counts.back();
        front.push_back({a, b, c});
      }
    }
  };
  // voxel (0, 0, 0) is padding, so the outside becomes background piece 0
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) {
        if (pieces.of_voxel[mask.grid.index(i, j, k)] == kUnseen) flood({i, j, k});
      }
    }
  }
  return pieces;
}

PieceChanges filter_pieces(VoxelMask& mask, const PieceFilter& filter, bool fill_cavities,
                           const std::string& image_name) {
  const double voxel = mask.grid.voxel_volume();
  PieceChanges changes;

  // an island inside a cavity counts as a piece of its own
  Pieces pieces = connected_pieces(mask);
  std::vector<double> volumes;
  for (const std::uint64_t count : pieces.inside) volumes.push_back(voxel * static_cast<double>(count));
  const std::vector<bool> keep = kept_pieces(filter, volumes);
  const auto kept = static_cast<std::uint64_t>(std::count(keep.begin(), keep.end(), true));
  if (kept == 0) {
    throw InputError(fmt::format("{}: --components keeps nothing; the largest piece has {:.4g} mm3", image_name,
                                 *std::max_element(volumes.begin(), volumes.end())));
  }
  if (kept > kMostPieces) {
    throw InputError(
        fmt::format("{}: expected an organ of few pieces, found {} pieces of {:.3g} mm3 at most (noise, or a "
                    "pattern); clean the segmentation or keep fewer with --components",
                    image_name, kept, *std::max_element(volumes.begin(), volumes.end())));
  }
  changes.pieces = pieces.inside.size();
  changes.dropped = changes.pieces - kept;
  for (std::size_t p = 0; p < keep.size(); ++p) {
    if (keep[p]) continue;
    changes.dropped_mm3 += volumes[p];
    changes.largest_dropped_mm3 = std::max(changes.largest_dropped_mm3, volumes[p]);
  }
  if (changes.dropped) {
    for (std::size_t v = 0; v < mask.inside.size(); ++v) {
      if (mask.inside[v] && !keep[static_cast<std::size_t>(pieces.of_voxel[v])]) mask.inside[v] = 0;
    }
    pieces = connected_pieces(mask);
  }

  changes.cavities = pieces.background.size() - 1;
  if (fill_cavities && changes.cavities) {
    changes.filled = changes.cavities;
    for (std::size_t b = 1; b < pieces.background.size(); ++b) {
      const double volume = voxel * static_cast<double>(pieces.background[b]);
      changes.filled_mm3 += volume;
      changes.largest_filled_mm3 = std::max(changes.largest_filled_mm3, volume);
    }
    for (std::size_t v = 0; v < mask.inside.size(); ++v) mask.inside[v] |= pieces.of_voxel[v] < -1;
  }
  return changes;
}

std::uint64_t count_inside(const VoxelMask& mask) {
  return static_cast<std::uint64_t>(std::count(mask.inside.begin(), mask.inside.end(), 1));
}

}  // namespace palpate
