#include "runtime/cut/cut_region.h"

#include <algorithm>
#include <cmath>

#include "runtime/large/body_reader.h"

namespace palpate {

using formats::SectionId;

namespace {

constexpr const char* kEffect = "cut";

palpate_status read_mesh(const SectionReader& reader, HyperelasticBody* body) {
  TissueLaw* const laws = reader.memory().array<TissueLaw>(reader.counts().regions);
  if (!laws) return reader.no_memory(kEffect);
  palpate_status status = read_body(reader, kEffect, body, laws);
  if (status == PALPATE_OK) status = read_tetrahedra(reader, body);
  if (status == PALPATE_OK) status = read_fixed(reader, body);
  if (status == PALPATE_OK) status = read_supports(reader, reader, body);
  if (status != PALPATE_OK) return status;
  double gradient[3][3];
  for (std::int32_t e = 0; e < body->tetrahedron_count; ++e)
    if (!(shape_gradients(*body, e, gradient) > 0))
      return reader.not_usable(SectionId::tetrahedra, 4 * static_cast<std::uint64_t>(e));
  return PALPATE_OK;
}

bool is_fixed(const HyperelasticBody& body, std::int32_t node) {
  const std::uint8_t* const held = body.fixed + 3 * static_cast<std::int64_t>(node);
  return held[0] && held[1] && held[2];
}

palpate_status read_foundation(const SectionReader& reader, CutRegion* region) {
  SupportedSurface& supports = region->supports;
  supports.triangles = region->mesh.triangles, supports.count = reader.triangles();
  if (!reader.find(SectionId::foundation)) return PALPATE_OK;
  if (const palpate_status status = reader.map(SectionId::foundation, &supports.foundation)) return status;
  for (std::int64_t i = 0; i < 2 * std::int64_t{supports.count}; ++i)
    if (!(supports.foundation[i] >= 0 && supports.foundation[i] <= 1e15))
      return reader.not_usable(SectionId::foundation, static_cast<std::uint64_t>(i));
  return PALPATE_OK;
}

// With how much foundations and springs hold each triangle of the mesh.
palpate_status measure_supports(const SectionReader& reader, CutRegion* region) {
  SceneMemory scratch = reader.memory().of_same_host();
  CutTissue tissue;
  CutSupports supports;
  const bool made = tissue.create(scratch, region->body, 0) &&
                    supports.create(scratch, region->body, region->supports, tissue) && !scratch.failed();
  if (made && supports.exist()) {
    Mat3* const support = reader.memory().array<Mat3>(static_cast<std::size_t>(reader.triangles()));
    for (std::int32_t t = 0; support && t < reader.triangles(); ++t) {
      support[t] = supports.springs_of(t);
      add_scaled(support[t], 12, supports.face_of_triangle(t)->block);
    }
    region->mesh.support = support;
  }
  scratch.release_all();
  return made && !reader.memory().failed() ? PALPATE_OK : reader.no_memory(kEffect);
}

// Of a cut at a node the tetrahedra there change; where the element averages at nodes, sites at their corners as well.
palpate_status find_dividable(const SectionReader& reader, const HyperelasticBody& body, const std::int32_t* place,
                              std::uint8_t* may_divide) {
  SceneMemory scratch = reader.memory().of_same_host();
  const auto count = static_cast<std::size_t>(body.node_count);
  std::uint8_t* const before = scratch.array<std::uint8_t>(count);
  if (!before) return reader.no_memory(kEffect);
  for (std::size_t n = 0; n < count; ++n) may_divide[n] = place[n] >= 0;
  for (int ring = body.nodal_dilatation ? 2 : 1; ring > 0; --ring) {
    std::copy(may_divide, may_divide + count, before);
    for (std::int32_t e = 0; e < body.tetrahedron_count; ++e) {
      const std::int32_t* const corner = body.tetrahedra + 4 * static_cast<std::int64_t>(e);
      if (before[corner[0]] && before[corner[1]] && before[corner[2]] && before[corner[3]]) continue;
      for (int a = 0; a < 4; ++a) may_divide[corner[a]] = 0;
    }
  }
  scratch.release_all();
  // Of springs between two nodes, a cut at one acts on the other.
  for (std::int64_t p = 0; p < body.support_count; ++p) {
    const std::int32_t* const pair = body.support_nodes + 2 * p;
    for (int a = 0; a < 2; ++a)
      if (place[pair[1 - a]] < 0 && !is_fixed(body, pair[1 - a])) may_divide[pair[a]] = 0;
  }
  return PALPATE_OK;
}

palpate_status no_column(const SectionReader& reader, std::int32_t at, std::int32_t node) {
  return fail(
      reader.error(), PALPATE_ERROR_CONTENT,
      reader.find(SectionId::cut_nodes)->offset + 4 * static_cast<std::uint64_t>(at),
      "cut/nodes: expected nodes that have a column or are held along all axes, found node %d; rebuild the bundle",
      static_cast<int>(node));
}

}  // namespace

bool RegionPairs::read(std::int32_t node, const std::int32_t* others, std::int32_t count, double* rows,
                       std::size_t stride) const {
  const std::int32_t a = source_.place[node];
  const auto of_region = [&](std::int32_t k) { return a >= 0 && source_.place[others[k]] >= 0; };
  const auto of_tensors = [&](std::int32_t k) { return !of_region(k) && !is_held(node) && !is_held(others[k]); };
  for (std::int32_t k = 0; k < count;) {
    double* const out = rows + 3 * static_cast<std::size_t>(k);
    if (of_tensors(k)) {
      const std::int32_t first = k;
      while (k < count && of_tensors(k)) ++k;
      if (!others_.read(node, others + first, k - first, out, stride)) return false;
      continue;
    }
    if (of_region(k))
      copy_block(a, source_.place[others[k]], out, stride);
    else
      for (std::size_t i = 0; i < 3; ++i) std::fill_n(out + i * stride, 3, 0.0);
    ++k;
  }
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3 * static_cast<std::size_t>(count); ++j) sum += std::fabs(rows[i * stride + j]);
  return std::isfinite(sum);
}

// a, b: places in the region.
void RegionPairs::copy_block(std::int32_t a, std::int32_t b, double* rows, std::size_t stride) const {
  const auto high = static_cast<std::size_t>(std::max(a, b)), low = static_cast<std::size_t>(std::min(a, b));
  const double* const block = source_.blocks + 9 * (high * (high + 1) / 2 + low);
  const std::size_t row = a >= b ? 3 : 1, column = a >= b ? 1 : 3;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) rows[i * stride + j] = block[row * i + column * j];
}

palpate_status read_cut_region(const SectionReader& reader, const Tensors& tensors, const std::int32_t* touchable,
                               CutRegion* region) {
  HyperelasticBody& body = region->body;
  const std::uint64_t count = reader.counts().cut;
  palpate_status status = reader.map_for(kEffect, SectionId::cut_compliance, &region->pairs.blocks);
  if (status == PALPATE_OK)
    status = reader.copy_indices(SectionId::cut_nodes, count, &formats::IndexedSections::cut_nodes, &region->nodes);
  if (status == PALPATE_OK) status = read_mesh(reader, &body);
  if (status == PALPATE_OK)
    status = reader.copy_indices(SectionId::triangles, 3 * static_cast<std::size_t>(reader.counts().triangles),
                                 &formats::IndexedSections::triangles, &region->mesh.triangles);
  if (status == PALPATE_OK) status = read_foundation(reader, region);
  if (status != PALPATE_OK) return status;
  region->node_count = static_cast<std::int32_t>(count);
  const std::int32_t* reserve = nullptr;
  if ((status = reader.map(SectionId::cut_reserve, &reserve)) != PALPATE_OK) return status;
  region->first_reserve = reserve[0], region->reserve = reserve[1];
  if (region->first_reserve < 0 || region->reserve < 0 ||
      std::int64_t{region->first_reserve} + region->reserve != reader.surface_nodes())
    return reader.not_usable(SectionId::cut_reserve, 0);
  const auto nodes = static_cast<std::size_t>(body.node_count);
  auto* const place = reader.memory().array<std::int32_t>(nodes);
  auto* const column = reader.memory().array<std::int32_t>(nodes);
  auto* const held = reader.memory().array<std::uint8_t>(nodes);
  auto* const may_divide = reader.memory().array<std::uint8_t>(nodes);
  if (reader.memory().failed()) return reader.no_memory(kEffect);
  std::fill_n(place, nodes, -1);
  std::fill_n(column, nodes, -1);
  for (std::int32_t i = 0; i < region->node_count; ++i) place[region->nodes[i]] = i;
  for (std::int32_t c = 0; c < tensors.all_columns(); ++c) column[tensors.node_of(c, touchable)] = c;
  for (std::int32_t i = 0; i < region->node_count; ++i)
    if (const std::int32_t node = region->nodes[i]; column[node] < 0 && !is_fixed(body, node))
      return no_column(reader, i, node);
  for (std::int32_t n = 0; n < body.node_count; ++n) held[n] = is_fixed(body, n);
  if ((status = find_dividable(reader, body, place, may_divide)) != PALPATE_OK) return status;
  region->may_divide = may_divide;
  region->pairs.place = place, region->pairs.column = column, region->pairs.fixed = body.fixed;
  CutBody& mesh = region->mesh;
  mesh.nodes = body.nodes, mesh.node_count = body.node_count;
  mesh.tetrahedra = body.tetrahedra, mesh.tetrahedron_count = body.tetrahedron_count;
  mesh.triangle_count = reader.triangles(), mesh.held = held, mesh.dividable = may_divide;
  return measure_supports(reader, region);
}

}  // namespace palpate
