// What the recorded run reads: the bundle and the path. They are written once, and every build reads the same bytes.
#pragma once

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <vector>

#include "tests/runtime/recorded_path.h"
#include "tests/support/box_motions.h"

namespace palpate::tests {

using RecordedForm = std::function<void(BundleParts&)>;

// Writes the bundle in another form, on a mesh fine enough for low-rank blocks.
inline void write_recorded_bundle(const std::filesystem::path& file, const RecordedForm& store = {}) {
  using formats::SectionId;
  const DenseBody box = dense_box(store ? TinyBox{.cells = {6, 5, 4}} : TinyBox{});
  BundleParts parts = dense_bundle(box);
  add_motions(parts, box);
  add_large_deformation(parts);
  const auto nodes = parts.get<double>(SectionId::nodes);
  std::vector<double> preload(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) preload[i] = i % 3 == 2 ? -0.01 * nodes[i - 2] : 0;
  parts.set(SectionId::preload_displacement, {nodes.size() / 3, 3}, preload);
  // The curves grow on their ranges, because the higher terms are small.
  parts.set(SectionId::response_radial, {4}, std::vector<double>{1.03e-3, 1.2e-3, 2e-4, 3e-5});
  parts.set(SectionId::response_force, {5}, std::vector<double>{0.299, 0.34, 0.05, 0.01, 1e-3});
  parts.set(SectionId::response_range, {2}, std::vector<double>{0.002, 0.5});
  if (store) store(parts);
  write_bundle(file, parts);
}

// 400 steps of 1 ms over the 60 x 50 x 40 mm box. Three points go in and out of the face x = 60 mm and slide; two come
// down on the face z = 40 mm and close until they conflict; a grip pulls.
inline std::vector<RecordedStep> recorded_path() {
  std::vector<RecordedStep> path;
  for (int s = 0; s < 400; ++s) {
    RecordedStep step;
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d p(0.0601 + 0.004 * std::cos(0.05 * s), 0.02 + 0.005 * i + 0.003 * std::sin(0.031 * s),
                              0.012 + 0.004 * i * i + 0.002 * std::sin(0.017 * s));
      std::copy(p.begin(), p.end(), step.press[i]);
    }
    const double gap = 0.01 * std::exp(-0.03 * s);
    for (int i = 0; i < 2; ++i) {
      const Eigen::Vector3d p(0.035 + (i - 0.5) * gap, 0.027 + 0.001 * i,
                              0.0415 - 0.00003 * (1 + i) * std::min(s, 300));
      std::copy(p.begin(), p.end(), step.pinch[i]);
    }
    step.pull[0] = 0.002 * std::sin(0.02 * s), step.pull[1] = 0, step.pull[2] = 0.001 * std::sin(0.07 * s);
    path.push_back(step);
  }
  return path;
}
inline void write_path(const std::filesystem::path& file, const std::vector<RecordedStep>& path) {
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(path.data()), static_cast<std::streamsize>(path.size() * sizeof path[0]));
}

}  // namespace palpate::tests
