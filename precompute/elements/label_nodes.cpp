#include "precompute/elements/label_nodes.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "formats/errors.h"

namespace palpate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// The voxels with one of the labels, by rows along the first axis: of row (j, k), the runs [first, last] of its voxels.
class LabelledVoxels {
 public:
  LabelledVoxels(const LabelImage& image, const std::vector<double>& labels) : grid_(image.grid) {
    const auto [nx, ny, nz] = grid_.size;
    std::vector<std::uint64_t> found(labels.size(), 0);
    rows_.resize(static_cast<std::size_t>(ny) * nz);
    for (int k = 0; k < nz; ++k)
      for (int j = 0; j < ny; ++j)
        for (int i = 0; i < nx; ++i) {
          const auto value = static_cast<double>(image.values[grid_.index(i, j, k)]);
          const auto at = std::find(labels.begin(), labels.end(), value);
          if (at == labels.end()) continue;
          ++found[static_cast<std::size_t>(at - labels.begin())];
          auto& runs = row(j, k);
          if (!runs.empty() && runs.back().last == i - 1)
            runs.back().last = i;
          else
            runs.push_back({i, i});
        }
    for (std::size_t l = 0; l < labels.size(); ++l)
      if (found[l] == 0)
        throw InputError(fmt::format("label {} is in no voxel; the image has {}", labels[l], describe_values(image)));
    for (int d = 0; d < 3; ++d)
      for (int c = 0; c < 3; ++c) axes_(c, d) = grid_.axis[d][c];
    to_index_ = axes_.inverse();
  }

  bool near(const std::array<double, 3>& point, double distance) const {
    const Vector3d index = to_index_ * (Vector3d(point.data()) - Vector3d(grid_.origin.data()));
    const auto spacing = grid_.spacing();
    // Voxel i reaches from i - 1/2 to i + 1/2.
    const auto lowest = [&](int d) {
      return static_cast<int>(std::clamp(std::ceil(index[d] - distance / spacing[d] - 0.5), -1.0, 1.0 * grid_.size[d]));
    };
    const auto highest = [&](int d) {
      return static_cast<int>(
          std::clamp(std::floor(index[d] + distance / spacing[d] + 0.5), -1.0, 1.0 * grid_.size[d]));
    };
    const auto gap = [&](int d, double first, double last) {
      return spacing[d] * std::max({first - 0.5 - index[d], index[d] - last - 0.5, 0.0});
    };
    for (int k = std::max(0, lowest(2)); k <= std::min(grid_.size[2] - 1, highest(2)); ++k)
      for (int j = std::max(0, lowest(1)); j <= std::min(grid_.size[1] - 1, highest(1)); ++j) {
        const double aside = std::hypot(gap(1, j, j), gap(2, k, k));
        for (const Run& run : row(j, k))
          if (std::hypot(aside, gap(0, run.first, run.last)) <= distance) return true;
      }
    return false;
  }

 private:
  struct Run {
    int first, last;
  };
  std::vector<Run>& row(int j, int k) { return rows_[static_cast<std::size_t>(k) * grid_.size[1] + j]; }
  const std::vector<Run>& row(int j, int k) const { return rows_[static_cast<std::size_t>(k) * grid_.size[1] + j]; }

  VoxelGrid grid_;
  std::vector<std::vector<Run>> rows_;
  Matrix3d axes_, to_index_;
};

}  // namespace

std::vector<char> near_labels(const LabelImage& image, const std::vector<double>& labels, double distance,
                              const std::vector<std::array<double, 3>>& points) {
  const LabelledVoxels voxels(image, labels);
  std::vector<char> result;
  for (const auto& point : points) result.push_back(voxels.near(point, distance));
  return result;
}

LabelledNodes labelled_nodes(const TetrahedralMesh& mesh, const OrganConfig& organ, const std::filesystem::path& image,
                             const std::filesystem::path& boundary_file) {
  const auto images = std::make_shared<std::map<std::filesystem::path, LabelImage>>();
  return [&mesh, &organ, &image, &boundary_file, images](const Selector& s) {
    const std::filesystem::path file = s.image ? s.image->path : image;
    const std::string place = fmt::format("{}:{}: label: ", boundary_file.string(), s.line);
    if (file.empty())
      throw InputError(place +
                       "expected the image that the mesh was made from, found none; give --image FILE, or name the "
                       "image in the selector");
    const double mm = organ.mesh_unit.metres * 1000, turned = organ.frame == "RAS" ? -mm : mm;
    std::vector<std::array<double, 3>> points;
    for (const auto& p : mesh.nodes) points.push_back({turned * p[0], turned * p[1], mm * p[2]});
    try {
      if (!images->contains(file)) images->emplace(file, read_label_image(file.string()));
      return near_labels(images->at(file), s.labels, s.number * mm, points);
    } catch (const InputError& error) {
      const std::string name = file.string(), text = error.what();
      throw InputError(place + (text.starts_with(name) ? text : name + ": " + text));
    }
  };
}

}  // namespace palpate
