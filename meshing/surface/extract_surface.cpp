#include "meshing/surface/extract_surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "formats/errors.h"
#include "formats/program.h"
#include "meshing/image/thickness.h"
#include "meshing/surface/isosurface.h"
#include "meshing/surface/offset_to_volume.h"
#include "meshing/surface/remesh.h"
#include "meshing/surface/surface_checks.h"

namespace palpate {
namespace {

constexpr std::size_t kFewestTriangles = 40;  // of any shell; with fewer a shell loses its shape
constexpr std::int64_t kMostHandles = 1000;

// Finds the parts of the organ that are thinner than the smoothing: voxels that smoothing put outside and that have
// no voxel left inside within two Gaussian widths. Stores their volume and the first such voxel.
void find_thin_parts(const VoxelMask& mask, const std::vector<float>& field, double smooth_mm,
                     ExtractedSurface& result) {
  const std::array<double, 3> spacing = mask.grid.spacing();
  std::array<int, 3> reach{};
  for (int axis = 0; axis < 3; ++axis)
    reach[axis] = std::max(1, static_cast<int>(std::ceil(2 * smooth_mm / spacing[axis])));
  const auto stayed_near = [&](int i, int j, int k) {
    for (int c = std::max(0, k - reach[2]); c <= std::min(mask.grid.size[2] - 1, k + reach[2]); ++c) {
      for (int b = std::max(0, j - reach[1]); b <= std::min(mask.grid.size[1] - 1, j + reach[1]); ++b) {
        for (int a = std::max(0, i - reach[0]); a <= std::min(mask.grid.size[0] - 1, i + reach[0]); ++a) {
          if (field[mask.grid.index(a, b, c)] > 0.5f) return true;
        }
      }
    }
    return false;
  };
  for (int k = 0; k < mask.grid.size[2]; ++k) {
    for (int j = 0; j < mask.grid.size[1]; ++j) {
      for (int i = 0; i < mask.grid.size[0]; ++i) {
        const std::size_t v = mask.grid.index(i, j, k);
        if (!mask.inside[v] || field[v] > 0.5f || stayed_near(i, j, k)) continue;
        if (result.thin_mm3 == 0) result.thin_place = mask.grid.point(i, j, k);
        result.thin_mm3 += mask.grid.voxel_volume();
      }
    }
  }
}

void refuse_noise(const TriangleSurface& surface, const std::string& image_name) {
  const std::vector<std::int64_t> handles = handles_of_shells(surface);
  const std::int64_t total = std::accumulate(handles.begin(), handles.end(), std::int64_t{0});
  if (total > kMostHandles || handles.size() > static_cast<std::size_t>(kMostHandles)) {
    throw InputError(
        fmt::format("{}: expected an organ, found a surface of {} shells with {} handles after smoothing (noise, "
                    "or a pattern); clean the segmentation or give a larger --smooth",
                    image_name, handles.size(), total));
  }
}

// The volume inside the outer face of each piece, in mm^3. It includes the pieces and the cavities that the piece
// encloses.
struct EnclosedVolumes {
  std::vector<double> inside, background;  // [pieces]
};

EnclosedVolumes enclosed_volumes(const VoxelMask& mask, const Pieces& pieces) {
  // Pieces that share a face are neighbours in a graph. The nodes are the background pieces, then the organ's pieces.
  const std::size_t backgrounds = pieces.background.size();
  const auto node = [&](std::int32_t piece) {
    return piece >= 0 ? backgrounds + static_cast<std::size_t>(piece) : static_cast<std::size_t>(-1 - piece);
  };
  std::vector<std::set<std::size_t>> neighbours(backgrounds + pieces.inside.size());
  const std::array<std::size_t, 3> step = {1, mask.grid.index(0, 1, 0), mask.grid.index(0, 0, 1)};
  for (int k = 0; k < mask.grid.size[2]; ++k) {
    for (int j = 0; j < mask.grid.size[1]; ++j) {
      for (int i = 0; i < mask.grid.size[0]; ++i) {
        const std::array<bool, 3> has_next = {i + 1 < mask.grid.size[0], j + 1 < mask.grid.size[1],
                                              k + 1 < mask.grid.size[2]};
        const std::size_t here = mask.grid.index(i, j, k);
        for (int axis = 0; axis < 3; ++axis) {
          if (!has_next[axis] || mask.inside[here] == mask.inside[here + step[axis]]) continue;
          const std::size_t a = node(pieces.of_voxel[here]), b = node(pieces.of_voxel[here + step[axis]]);
          neighbours[a].insert(b);
          neighbours[b].insert(a);
        }
      }
    }
  }
  // walk breadth first from the outside, then sum the volumes from the leaves back
  std::vector<std::size_t> order = {0}, parent(neighbours.size(), neighbours.size());
  parent[0] = 0;
  for (std::size_t n = 0; n < order.size(); ++n) {
    for (const std::size_t next : neighbours[order[n]]) {
      if (parent[next] != neighbours.size()) continue;
      parent[next] = order[n];
      order.push_back(next);
    }
  }
  std::vector<double> volume(neighbours.size());
  for (std::size_t n = 0; n < volume.size(); ++n) {
    volume[n] = mask.grid.voxel_volume() *
                static_cast<double>(n < backgrounds ? pieces.background[n] : pieces.inside[n - backgrounds]);
  }
  for (std::size_t n = order.size(); n-- > 1;) volume[parent[order[n]]] += volume[order[n]];
  return {{volume.begin() + static_cast<std::ptrdiff_t>(backgrounds), volume.end()},
          {volume.begin(), volume.begin() + static_cast<std::ptrdiff_t>(backgrounds)}};
}

// Matches the shells of the smoothed isosurface with the pieces of the mask. An outer shell matches the pieces that
// its inner voxels belong to. The shell of a cavity matches the cavities that its outer voxels belong to. Shells that
// match a common piece form a group, which keeps the volume of its pieces.
struct ShellGroups {
  std::vector<std::size_t> of_shell;
  std::vector<double> volumes;
};

ShellGroups match_shells(const VoxelMask& mask, const Isosurface& iso, const std::vector<TriangleSurface>& shells,
                         ExtractedSurface& result) {
  const Pieces pieces = connected_pieces(mask);
  const EnclosedVolumes enclosed = enclosed_volumes(mask, pieces);

  // union-find over the shells, the pieces and the cavities, in this order
  const std::size_t first_piece = shells.size(), first_cavity = first_piece + pieces.inside.size();
  std::vector<std::size_t> parent(first_cavity + pieces.background.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](std::size_t n) {
    while (parent[n] != n) n = parent[n] = parent[parent[n]];
    return n;
  };
  std::int32_t count = 0;
  const std::vector<std::int32_t> shell_of = shell_of_triangle(iso.surface, &count);
  std::vector<bool> outer;
  for (const TriangleSurface& shell : shells) outer.push_back(enclosed_volume(shell) > 0);
  std::vector<bool> matched(parent.size());
  for (std::size_t t = 0; t < shell_of.size(); ++t) {
    const auto shell = static_cast<std::size_t>(shell_of[t]);
    for (const std::int32_t p : iso.surface.triangles[t]) {
      const std::int32_t inner = pieces.of_voxel[iso.inside_voxel[p]], beyond = pieces.of_voxel[iso.outside_voxel[p]];
      std::size_t other = parent.size();
      if (outer[shell] && inner >= 0) other = first_piece + static_cast<std::size_t>(inner);
      if (!outer[shell] && beyond < -1) other = first_cavity + static_cast<std::size_t>(-1 - beyond);
      if (other == parent.size()) continue;
      parent[root(other)] = root(shell);
      matched[other] = true;
    }
  }

  ShellGroups groups;
  std::vector<std::size_t> number(parent.size(), parent.size());
  for (std::size_t s = 0; s < shells.size(); ++s) {
    std::size_t& n = number[root(s)];
    if (n == parent.size()) {
      n = groups.volumes.size();
      groups.volumes.push_back(0);
    }
    groups.of_shell.push_back(n);
  }
  for (std::size_t p = 0; p < pieces.inside.size(); ++p) {
    if (matched[first_piece + p])
      groups.volumes[number[root(first_piece + p)]] += enclosed.inside[p];
    else {
      ++result.vanished_pieces;
      result.vanished_mm3 += mask.grid.voxel_volume() * static_cast<double>(pieces.inside[p]);
    }
  }
  for (std::size_t b = 1; b < pieces.background.size(); ++b) {
    if (matched[first_cavity + b])
      groups.volumes[number[root(first_cavity + b)]] -= enclosed.background[b];
    else
      ++result.closed_cavities;
  }
  // smoothing can make a bubble, which matches no piece; a bubble keeps its volume
  for (std::size_t s = 0; s < shells.size(); ++s) {
    double& volume = groups.volumes[groups.of_shell[s]];
    if (volume == 0) volume = enclosed_volume(shells[s]);
  }
  return groups;
}

// Divides the wanted number of triangles among the shells by area.
std::vector<std::size_t> shares(const std::vector<TriangleSurface>& shells, const SurfaceTarget& target) {
  std::vector<double> areas;
  for (const TriangleSurface& shell : shells) areas.push_back(area(shell));
  const double total = std::accumulate(areas.begin(), areas.end(), 0.0);
  const double wanted =
      target.triangles ? static_cast<double>(*target.triangles) : triangles_for_edge(total, *target.edge_mm);
  std::vector<std::size_t> counts;
  for (const double a : areas) {
    const double count = std::max(wanted * a / total, static_cast<double>(kFewestTriangles));
    counts.push_back(2 * static_cast<std::size_t>(count / 2));
  }
  return counts;
}

}  // namespace

std::vector<TriangleSurface> split_shells(const TriangleSurface& surface) {
  std::int32_t count = 0;
  const std::vector<std::int32_t> shell_of = shell_of_triangle(surface, &count);
  std::vector<TriangleSurface> shells(static_cast<std::size_t>(count));
  std::vector<std::int32_t> number(surface.points.size(), -1);
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    TriangleSurface& shell = shells[static_cast<std::size_t>(shell_of[t])];
    Triangle triangle{};
    for (int corner = 0; corner < 3; ++corner) {
      const std::int32_t p = surface.triangles[t][corner];
      if (number[p] < 0) {
        number[p] = static_cast<std::int32_t>(shell.points.size());
        shell.points.push_back(surface.points[p]);
      }
      triangle[corner] = number[p];
    }
    shell.triangles.push_back(triangle);
  }
  return shells;
}

TriangleSurface join_shells(const std::vector<TriangleSurface>& shells) {
  TriangleSurface all;
  for (const TriangleSurface& shell : shells) {
    const auto first = static_cast<std::int32_t>(all.points.size());
    all.points.insert(all.points.end(), shell.points.begin(), shell.points.end());
    for (const auto& [a, b, c] : shell.triangles) all.triangles.push_back({first + a, first + b, first + c});
  }
  return all;
}

TriangleSurface remesh_shells(const std::vector<TriangleSurface>& shells, const std::vector<std::size_t>& groups,
                              const std::vector<double>& volumes, const SurfaceTarget& target, const std::string& what,
                              int* attempts) {
  constexpr int kAttempts = 4;
  const std::vector<std::size_t> counts = shares(shells, target);
  std::string defect;
  for (*attempts = 1; *attempts <= kAttempts; ++*attempts) {
    std::vector<TriangleSurface> remeshed;
    for (std::size_t s = 0; s < shells.size(); ++s) {
      // each further attempt uses more triangles and makes them more regular
      const std::size_t count = counts[s] + 2 * (counts[s] * static_cast<std::size_t>(*attempts - 1) / 40);
      if (target.spread == SurfaceTarget::Spread::even) {
        remeshed.push_back(remesh_evenly(shells[s], count, static_cast<unsigned>(1 + 2 * *attempts)));
      } else {
        remeshed.push_back(simplify_by_curvature(shells[s], count));
      }
    }
    const auto restore_volumes = [&] {
      bool restored = true;
      for (std::size_t g = 0; g < volumes.size(); ++g) {
        std::vector<TriangleSurface*> members;
        for (std::size_t s = 0; s < shells.size(); ++s) {
          if (groups[s] == g) members.push_back(&remeshed[s]);
        }
        restored &= !std::isnan(offset_to_volume(members, volumes[g]));
      }
      return restored;
    };
    if (!restore_volumes()) {
      defect = "its volume cannot be restored";
      continue;
    }
    for (int repair = 0; repair < 2; ++repair) {
      const TriangleSurface whole = join_shells(remeshed);
      defect = first_defect(whole);
      if (defect.empty()) return whole;
      // repair each shell locally, then restore the volume again
      if (repair == 1) break;
      bool repaired = true;
      for (TriangleSurface& shell : remeshed) {
        if (find_self_intersections(shell).pairs) repaired &= remove_self_intersections(shell);
      }
      if (!repaired || !restore_volumes()) break;
    }
  }
  const std::size_t wanted = std::accumulate(counts.begin(), counts.end(), std::size_t{0});
  throw NoValidSurface(
      fmt::format("{}: no valid surface of about {} triangles was found in {} attempts: {}; ask for more, such as "
                  "--triangles {}",
                  what, wanted, kAttempts, defect, 4 * wanted));
}

TriangleSurface remesh_surface(const TriangleSurface& surface, const SurfaceTarget& target, const std::string& what,
                               int* attempts, double too_far_out_mm) {
  const std::vector<TriangleSurface> shells = split_shells(surface);
  std::vector<std::size_t> groups;
  std::vector<double> volumes;
  for (const TriangleSurface& shell : shells) {
    groups.push_back(groups.size());
    volumes.push_back(enclosed_volume(shell) - too_far_out_mm * area(shell));
  }
  return remesh_shells(shells, groups, volumes, target, what, attempts);
}

namespace {

ExtractedSurface extract_once(const VoxelMask& mask, double smooth_mm, const SurfaceTarget& target,
                              const std::string& image_name) {
  ExtractedSurface result;
  result.smooth_mm = smooth_mm;
  const std::vector<float> field = smooth_mask(mask, smooth_mm);
  find_thin_parts(mask, field, smooth_mm, result);
  const Isosurface iso = isosurface(mask.grid, field);
  if (iso.surface.triangles.empty()) {
    throw NoValidSurface(fmt::format("{}: smoothing by {:.3g} mm leaves nothing of the label; give a smaller --smooth",
                                     image_name, smooth_mm));
  }
  refuse_noise(iso.surface, image_name);
  const std::vector<TriangleSurface> shells = split_shells(iso.surface);
  const ShellGroups groups = match_shells(mask, iso, shells, result);
  result.surface = remesh_shells(shells, groups.of_shell, groups.volumes, target, image_name, &result.attempts);
  return result;
}

}  // namespace

ExtractedSurface extract_surface(const VoxelMask& mask, double smooth_mm, const SurfaceTarget& target,
                                 const std::string& image_name) {
  // A Gaussian wider than a quarter of a part's thickness thins the part. Then opposite sides cross.
  double next = smooth_mm;
  std::string first_failure;
  for (int round = 0;; ++round) {
    try {
      ExtractedSurface result = extract_once(mask, next, target, image_name);
      result.voxel_surface = isosurface(mask.grid, {mask.inside.begin(), mask.inside.end()}).surface;
      return result;
    } catch (const NoValidSurface& failed) {
      if (round == 0) first_failure = failed.what();
      if (round == 2 || next == 0) throw InputError(first_failure);
    } catch (const InputError&) {
      if (round == 0) throw;
      throw InputError(first_failure);
    }
    const double thickness = local_thickness(mask, 0.98);
    const double voxel = std::cbrt(mask.grid.voxel_volume());
    next = std::min(next / 2, thickness / 4);
    if (next < voxel / 4) next = 0;  // has no effect
    warn(
        fmt::format("{}: no valid surface was found with a smoothing of {:.3g} mm, and parts are only {:.3g} mm thick; "
                    "trying --smooth {:.3g}",
                    image_name, smooth_mm, thickness, next));
  }
}

}  // namespace palpate
