// The sections of a bundle from solved node tensors.
#pragma once

#include <string>
#include <vector>

#include "precompute/tensors/probe_columns.h"
#include "tests/support/bundle_parts.h"

namespace palpate::tests {

// The sections of a bundle with these columns. The body has one material.
inline BundleParts tensor_parts(const ElasticBody& body, Element element, const std::vector<NodeTensor>& tensors) {
  using formats::SectionId;
  const std::size_t n = body.nodes.size(), ns = static_cast<std::size_t>(body.surface_count), s = tensors.size();
  const auto flat = [](const auto& rows) {
    std::vector<typename std::decay_t<decltype(rows[0])>::value_type> numbers;
    for (const auto& row : rows) numbers.insert(numbers.end(), row.begin(), row.end());
    return numbers;
  };
  BundleParts parts;
  parts.provenance = std::string(R"({"format":"palpate bundle","version":2,"element":")") + name_of(element) + "\"}";
  parts.set(SectionId::nodes, {n, 3}, flat(body.nodes));
  parts.set(SectionId::tetrahedra, {body.tetrahedra.size(), 4}, flat(body.tetrahedra));
  parts.set(SectionId::region, {body.tetrahedra.size()}, std::vector<std::int32_t>(body.tetrahedra.size(), 0));
  parts.set(SectionId::triangles, {body.triangles.size(), 3}, flat(body.triangles));
  parts.set(SectionId::fixed, {n, 3}, flat(body.fixed));
  parts.set(SectionId::young, {1}, std::vector<double>{body.materials.at(0).young});
  parts.set(SectionId::poisson, {1}, std::vector<double>{body.materials.at(0).poisson});
  parts.set_text(SectionId::region_names, "gel\n");
  std::vector<std::int32_t> nodes;
  std::vector<float> surface;
  std::vector<double> force;
  for (const NodeTensor& tensor : tensors) {
    nodes.push_back(tensor.node);
    force.insert(force.end(), tensor.stiffness.begin(), tensor.stiffness.end());
    for (std::size_t j = 0; j < 3; ++j) {
      const auto row = tensor.displacement.begin() + static_cast<std::ptrdiff_t>(3 * n * j);
      surface.insert(surface.end(), row, row + static_cast<std::ptrdiff_t>(3 * ns));
    }
  }
  parts.set(SectionId::touchable, {s}, nodes);
  parts.set(SectionId::displacement_surface, {s, 3, ns, 3}, surface);
  parts.set(SectionId::force, {s, 3, 3}, force);
  parts.set(SectionId::residual, {s, 3}, std::vector<double>(3 * s, 0));
  parts.set(SectionId::iterations, {s, 3}, std::vector<std::int32_t>(3 * s, 1));
  return parts;
}

}  // namespace palpate::tests
