#include "runtime/scene/corridor_reader.h"

#include "runtime/scene/needs.h"

namespace palpate {

using formats::SectionId;

namespace {

palpate_status map_corridor_rows(const SectionReader& reader, const char* effect, SectionId id, std::int32_t nodes,
                                 DisplacementRows* rows) {
  const float* numbers = nullptr;
  if (const palpate_status status = reader.map_for(effect, id, &numbers)) return status;
  rows->numbers = numbers, rows->nodes = nodes;
  return PALPATE_OK;
}

}  // namespace

palpate_status read_corridor(const SectionReader& reader, const char* effect, const std::int32_t* touchable,
                             Corridor* corridor, Tensors* tensors) {
  const std::uint64_t count = reader.counts().corridor;
  palpate_status status = reader.copy_indices(SectionId::corridor_nodes, count,
                                              &formats::IndexedSections::corridor_nodes, &corridor->nodes);
  if (status == PALPATE_OK) status = reader.map_for(effect, SectionId::corridor_compliance, &corridor->compliance);
  if (status == PALPATE_OK)
    status = map_corridor_rows(reader, effect, SectionId::corridor_surface, reader.surface_nodes(), &corridor->surface);
  if (status != PALPATE_OK) return status;
  corridor->count = static_cast<std::int32_t>(count), corridor->node_of_column = touchable;
  tensors->corridor = corridor;
  return PALPATE_OK;
}

palpate_status read_corridor(const SectionReader& reader, const char* effect, palpate_scene& scene) {
  if (scene.tensors.corridor) return PALPATE_OK;
  const palpate_status status = read_corridor(reader, effect, scene.touchable, &scene.corridor, &scene.tensors);
  if (status != PALPATE_OK || !has_interior_shape(scene)) return status;
  const auto inside = static_cast<std::int32_t>(reader.counts().nodes - reader.counts().surface_nodes);
  return map_corridor_rows(reader, effect, SectionId::corridor_interior, inside, &scene.shape.corridor_interior);
}

}  // namespace palpate
