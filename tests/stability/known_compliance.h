// A box whose compliance the test knows: the reference for the forces of contacts.
#pragma once

#include <numeric>

#include "formats/half.h"
#include "tests/runtime/touched_box.h"

namespace palpate::tests {

class KnownBox {
 public:
  explicit KnownBox(const TinyBox& form, const std::function<void(BundleParts&)>& change = {})
      : box(form, [&](BundleParts& parts) {
          force_ = parts.get<double>(formats::SectionId::force);
          if (change) change(parts);
          surface_ = stored_surface(parts);
        }) {}

  Eigen::Matrix3d own_stiffness(std::int32_t column) const {
    return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(&force_[9 * column]);
  }
  // C_nk of touchable nodes, by column: T^u_nk (T^f_k)^-1, as the bundle stores it.
  Eigen::Matrix3d block(std::int32_t n, std::int32_t k) const {
    const std::size_t dofs = 3 * static_cast<std::size_t>(box.body.surface_nodes);
    Eigen::Matrix3d unit;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) unit(i, j) = surface_[(3 * k + j) * dofs + 3 * box.touchable[n] + i];
    return unit * own_stiffness(k).inverse();
  }
  // W over some columns. Of C_nk and C_kn, which rounding makes differ, it takes the one in the later column, as the runtime does.
  Eigen::MatrixXd compliance(const std::vector<std::int32_t>& columns) const {
    const auto count = static_cast<Eigen::Index>(columns.size());
    Eigen::MatrixXd w(3 * count, 3 * count);
    for (Eigen::Index a = 0; a < count; ++a)
      for (Eigen::Index b = 0; b < count; ++b) {
        const std::int32_t n = columns[a], k = columns[b];
        w.block<3, 3>(3 * a, 3 * b) = n <= k ? block(n, k) : Eigen::Matrix3d(block(k, n).transpose());
      }
    return w;
  }
  std::int32_t column_of(std::int32_t node) const {
    const auto at = std::lower_bound(box.touchable.begin(), box.touchable.end(), node);
    return at != box.touchable.end() && *at == node ? static_cast<std::int32_t>(at - box.touchable.begin()) : -1;
  }

 private:
  // The displacements that the runtime reads from rows of f32 or f16.
  static std::vector<float> stored_surface(const BundleParts& parts) {
    using formats::SectionId;
    if (!parts.sections.count(SectionId::displacement_scale)) return parts.get<float>(SectionId::displacement_surface);
    const auto halves = parts.get<std::uint16_t>(SectionId::displacement_surface);
    const auto scale = parts.get<float>(SectionId::displacement_scale);
    std::vector<float> rows(halves.size());
    for (std::size_t i = 0; i < rows.size(); ++i)
      rows[i] = formats::float_of_half(halves[i]) * scale[i / (rows.size() / scale.size())];
    return rows;
  }

  std::vector<float> surface_;
  std::vector<double> force_;

 public:
  TouchedBox box;
};

// Bound on the rounding of a solve with W: rows times half a unit in the last place times the condition of W after scaling to a
// diagonal of one.
inline double rounding_of(const Eigen::MatrixXd& w) {
  const Eigen::VectorXd d = w.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = d.asDiagonal() * w * d.asDiagonal();
  return 1.1e-16 * static_cast<double>(w.rows()) / scaled.llt().rcond();
}

inline std::vector<std::int32_t> range_of(std::int32_t count) {
  std::vector<std::int32_t> all(static_cast<std::size_t>(count));
  std::iota(all.begin(), all.end(), 0);
  return all;
}

// A displacement of some millimetres that differs from node to node.
inline Eigen::Vector3d wave(std::int32_t n) {
  return 0.002 * Eigen::Vector3d(std::sin(3.1 * n), std::cos(1.7 * n), std::sin(0.9 * n + 1));
}

}  // namespace palpate::tests
