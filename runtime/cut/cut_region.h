// What the bundle has of a cut: the body in both forms that this room takes, the nodes that may be divided, and the compliance between the nodes
// on which a cut acts.
//
// A bundle of a boundary file with [cut] has the sections cut/*: the compliance in double precision between the nodes of the region, on the
// surface and inside. Those inside are numbered among the nodes of the surface, with columns, and so are the nodes in reserve, which are in no tetrahedron: they
// become the new nodes of the mesh.
#pragma once

#include <cstdint>

#include "runtime/cut/cut_supports.h"
#include "runtime/cut/pair_compliance.h"
#include "runtime/cut/rest_mesh.h"
#include "runtime/large/hyperelastic_body.h"
#include "runtime/scene/section_reader.h"

namespace palpate {

// Pairs within the region in double precision; all others from the tensors.
class RegionPairs final : public PairCompliance {
 public:
  // What pairs are read from, borrowed.
  struct Source {
    const double* blocks = nullptr;        // the section cut/compliance
    const std::int32_t* place = nullptr;   // [nodes] in cut/nodes; -1: none
    const std::int32_t* column = nullptr;  // [nodes] of the tensors; -1: none
    const std::uint8_t* fixed = nullptr;   // [nodes][3]
  };
  RegionPairs(const Tensors& tensors, const Source& source) : source_(source), others_(tensors, source.column) {}
  // False also where a number of the bundle is not finite.
  bool read(std::int32_t node, const std::int32_t* others, std::int32_t count, double* rows,
            std::size_t stride) const override;

 private:
  bool is_held(std::int32_t node) const {
    const std::uint8_t* const held = source_.fixed + 3 * static_cast<std::size_t>(node);
    return held[0] && held[1] && held[2];
  }
  void copy_block(std::int32_t a, std::int32_t b, double* rows, std::size_t stride) const;

  Source source_;
  TensorPairs others_;
};

// Arrays live as long as the memory of the reader that filled them in, and the bundle.
struct CutRegion {
  HyperelasticBody body;                // at rest, for CutCompliance
  CutBody mesh;                         // the same body, for CutMesh. Held: along three axes
  SupportedSurface supports;            // of CutCompliance
  const std::int32_t* nodes = nullptr;  // [node_count] on which a cut may act, ascending
  std::int32_t node_count = 0;          //
  const std::uint8_t* may_divide =
      nullptr;                // [nodes of the body] 1: a cut at the node acts on nodes of the region alone
  RegionPairs::Source pairs;  // for RegionPairs
  std::int32_t first_reserve = 0, reserve = 0;  // nodes for new ones: the last ones of the surface
  // Whether all of a tetrahedron's corners may be divided, so that it may be removed.
  bool may_remove(std::int32_t tetrahedron) const {
    const std::int32_t* const corner = body.tetrahedra + 4 * static_cast<std::int64_t>(tetrahedron);
    return may_divide[corner[0]] && may_divide[corner[1]] && may_divide[corner[2]] && may_divide[corner[3]];
  }
};

// touchable: [S] node of each column. Errors: PALPATE_ERROR_EFFECT where the bundle
// has no region; PALPATE_ERROR_CONTENT where a section is damaged, or a node of the region has no column. Cost: passes over the mesh.
palpate_status read_cut_region(const SectionReader& reader, const Tensors& tensors, const std::int32_t* touchable,
                               CutRegion* region);

}  // namespace palpate
