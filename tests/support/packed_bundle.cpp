#include "tests/support/packed_bundle.h"

namespace palpate::tests {

void store_as_f64(BundleParts& parts) {
  for (const auto id : {formats::SectionId::displacement_surface, formats::SectionId::displacement_interior}) {
    if (!parts.sections.count(id)) continue;
    const auto rows = parts.get<float>(id);
    parts.set(id, parts.sections.at(id).shape, std::vector<double>(rows.begin(), rows.end()));
  }
}

void store_as_f16(BundleParts& parts) {
  using formats::SectionId;
  const auto surface = parts.get<float>(SectionId::displacement_surface);
  const auto shape = parts.sections.at(SectionId::displacement_surface).shape;
  const std::size_t columns = 3 * shape[0], run = surface.size() / columns;
  std::vector<float> scale(columns);
  for (std::size_t c = 0; c < columns; ++c) {
    float largest = 0;
    for (std::size_t i = 0; i < run; ++i) largest = std::max(largest, std::abs(surface[c * run + i]));
    scale[c] = half_scale(largest);
  }
  for (const auto id : {SectionId::displacement_surface, SectionId::displacement_interior}) {
    if (!parts.sections.count(id)) continue;
    const auto rows = parts.get<float>(id);
    std::vector<std::uint16_t> halves(rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i)
      halves[i] = formats::half_of(rows[i] / scale[i / (rows.size() / columns)]);
    parts.set(id, parts.sections.at(id).shape, halves);
  }
  parts.set(SectionId::displacement_scale, {shape[0], 3}, scale);
}

void store_interior_as_f16(BundleParts& parts) {
  using formats::SectionId;
  BundleParts halves = parts;
  store_as_f16(halves);
  for (const auto id : {SectionId::displacement_interior, SectionId::displacement_scale})
    parts.sections.insert_or_assign(id, halves.sections.at(id));
}

PackedCompliance store_in_blocks(BundleParts& parts, const CompliancePackOptions& options) {
  using formats::SectionId;
  const auto rows = parts.get<float>(SectionId::displacement_surface);
  const auto nodes = parts.get<double>(SectionId::nodes);
  const auto fixed = parts.get<std::uint8_t>(SectionId::fixed);
  const auto shape = parts.sections.at(SectionId::displacement_surface).shape;
  const std::size_t run = 3 * shape[2];
  ComplianceSource source;
  source.surface_nodes = static_cast<std::int32_t>(shape[2]);
  source.position.assign(nodes.begin(), nodes.begin() + static_cast<std::ptrdiff_t>(run));
  source.touchable = parts.get<std::int32_t>(SectionId::touchable);
  source.stiffness = parts.get<double>(SectionId::force);
  std::vector<Eigen::Matrix3d> own;
  for (std::size_t k = 0; k < shape[0]; ++k) {
    Eigen::Matrix3d force = Eigen::Map<const Eigen::Matrix3d>(&source.stiffness[9 * k]);  // symmetric
    const auto is_fixed = [&](int d) { return fixed[3 * source.touchable[k] + d] != 0; };
    for (int d = 0; d < 3; ++d)
      if (is_fixed(d)) force(d, d) = 1;
    own.emplace_back(force.inverse());
    for (int d = 0; d < 3; ++d)
      if (is_fixed(d)) own[k](d, d) = 0;
  }
  source.compliance = [&](std::size_t k, std::span<const std::int32_t> at, double* c) {
    for (std::size_t n = 0; n < at.size(); ++n)
      for (std::size_t i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
          double sum = 0;
          for (int m = 0; m < 3; ++m) sum += rows[(3 * k + m) * run + 3 * at[n] + i] * own[k](m, j);
          c[(j * at.size() + n) * 3 + i] = sum;
        }
  };
  PackedCompliance packed = pack_compliance(source, options);
  parts.sections.erase(SectionId::displacement_surface);
  parts.set(SectionId::compliance_nodes, {packed.nodes.size()}, packed.nodes);
  parts.set(SectionId::compliance_clusters, {packed.cluster_ends.size()}, packed.cluster_ends);
  parts.set(SectionId::compliance_blocks, {packed.scale.size(), 5}, packed.blocks);
  parts.set(SectionId::compliance_scale, {packed.scale.size()}, packed.scale);
  parts.sections[SectionId::compliance_values] = {{packed.values.size() / formats::element_bytes(options.type)},
                                                  {packed.values.begin(), packed.values.end()},
                                                  options.type};
  return packed;
}

}  // namespace palpate::tests
