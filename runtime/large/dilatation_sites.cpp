#include "runtime/large/dilatation_sites.h"

namespace palpate {

bool find_dilatation_sites(SceneMemory& memory, const HyperelasticBody& body, DilatationSites* sites) {
  const auto corners = 4 * static_cast<std::size_t>(body.tetrahedron_count);
  const auto nodes = static_cast<std::size_t>(body.node_count);
  // The sites of a node form a list, with one for each of its regions; few nodes have more than one.
  sites->of_corner = memory.array<std::int32_t>(corners);
  sites->region = memory.array<std::int32_t>(corners);
  sites->volume = memory.array<double>(corners);
  SceneMemory scratch = memory.of_same_host();
  std::int32_t* const first = scratch.array<std::int32_t>(nodes);  // of a node, plus 1; 0: none
  std::int32_t* const next = scratch.array<std::int32_t>(corners);
  if (!memory.failed() && !scratch.failed()) {
    double gradient[3][3];
    for (std::int32_t e = 0; e < body.tetrahedron_count; ++e) {
      const double quarter = shape_gradients(body, e, gradient) / 4;
      for (int a = 0; a < 4; ++a) {
        const std::size_t corner = 4 * static_cast<std::size_t>(e) + static_cast<std::size_t>(a);
        const std::int32_t node = body.tetrahedra[corner];
        std::int32_t site = first[node];
        while (site && sites->region[site - 1] != body.region[e]) site = next[site - 1];
        if (!site) {
          site = ++sites->count;
          sites->region[site - 1] = body.region[e];
          next[site - 1] = first[node], first[node] = site;
        }
        sites->of_corner[corner] = site - 1;
        sites->volume[site - 1] += quarter;
      }
    }
  }
  const bool made = !memory.failed() && !scratch.failed();
  scratch.release_all();
  return made;
}

}  // namespace palpate
