// (stands in)
#pragma once
#include "runtime/cut/rest_mesh.h"
#include "runtime/large/hyperelastic_body.h"
#include "runtime/scene/section_reader.h"

namespace palpate {
struct CutRegion {
  HyperelasticBody body;
  CutBody mesh;
  const std::uint8_t* may_divide = nullptr;
  const std::int32_t* scene_node = nullptr;
  std::int32_t node_count = 0, reserve = 0;
  int pairs = 0;
};
inline palpate_status read_cut_region(const SectionReader& reader, const Tensors&, const std::int32_t*, CutRegion*) {
  return reader.missing("cut", formats::SectionId::tetrahedra);
}
}  // namespace palpate
