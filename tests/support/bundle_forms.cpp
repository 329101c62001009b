#include "tests/support/bundle_forms.h"

namespace palpate::tests {

void add_everything(BundleParts& parts) {
  const auto nodes = parts.get<double>(formats::SectionId::nodes);
  std::vector<double> preload(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) preload[i] = i % 3 == 2 ? -0.001 * nodes[i - 2] : 0;
  parts.set(formats::SectionId::preload_displacement, {nodes.size() / 3, 3}, preload);
  parts.set(formats::SectionId::response_radial, {2}, std::vector<double>{0.5, 0.5});
  parts.set(formats::SectionId::response_force, {2}, std::vector<double>{0.5, 0.5});
  parts.set(formats::SectionId::response_range, {2}, std::vector<double>{1, 1});
}

void add_second_region(BundleParts& parts) {
  auto region = parts.get<std::int32_t>(formats::SectionId::region);
  std::fill(region.begin() + static_cast<std::ptrdiff_t>(region.size() / 2), region.end(), 1);
  parts.set(formats::SectionId::region, {region.size()}, region);
  parts.set(formats::SectionId::young, {2}, std::vector<double>{5400, 9000});
  parts.set(formats::SectionId::poisson, {2}, std::vector<double>{0.45, 0.3});
  parts.set_text(formats::SectionId::region_names, "near\nfar\n");
}

void widen_values(BundleParts& parts) {
  const auto values = parts.get<float>(formats::SectionId::compliance_values);
  parts.set(formats::SectionId::compliance_values, {values.size()}, std::vector<double>(values.begin(), values.end()));
}

std::vector<BundleForm> bundle_forms(const std::filesystem::path& folder) {
  const auto file = folder / ("form." + std::to_string(::getpid()) + ".h5");
  const auto written = [&](const BundleParts& parts) {
    write_bundle(file, parts);
    const std::string bytes = file_bytes(file);
    std::filesystem::remove(file);
    return bytes;
  };
  const auto rows = [&](auto store) {
    BundleParts parts = tiny_bundle({.cells = {2, 2, 2}, .single_dof = true});
    add_everything(parts);
    add_second_region(parts);
    store(parts);
    return written(parts);
  };
  // A long box: two clusters of nodes are far apart, so that the block between them has low rank.
  const auto blocks = [&](formats::ElementType type, auto store) {
    BundleParts parts = tiny_bundle({.cells = {20, 1, 1}, .size = {0.3, 0.02, 0.02}, .interior = false});
    store_in_blocks(parts, {type, 1e-2});
    store(parts);
    return written(parts);
  };
  using formats::ElementType;
  const auto as_it_is = [](BundleParts&) {};
  return {{"f32 rows", rows(as_it_is)},
          {"f64 rows", rows(store_as_f64)},
          {"f16 rows", rows(store_as_f16)},
          {"f32 blocks", blocks(ElementType::f32, as_it_is)},
          {"f64 blocks", blocks(ElementType::f32, widen_values)},
          {"f16 blocks", blocks(ElementType::f16, as_it_is)}};
}

}  // namespace palpate::tests
