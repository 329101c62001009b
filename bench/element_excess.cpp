// How good the estimate of the element's own stiffness is: it beside the true one, that of p2-p0 on the same mesh.
//   element_excess_bench MESH.msh organ.toml boundary.toml
#include <cstdio>

#include "precompute/solver/petsc_session.h"
#include "studies/bodies/element_truth.h"

int main(int argc, char** argv) {
  using namespace palpate;
  if (argc != 4) {
    std::fputs("usage: element_excess_bench MESH.msh organ.toml boundary.toml\n", stderr);
    return 2;
  }
  const PetscSession session({});
  const OrganConfig organ = read_organ_config(argv[2]);
  const BodyFiles files{argv[1], argv[2], argv[3], {}};
  const ElasticBody body = make_elastic_body(read_mesh(argv[1]), organ, read_boundary_config(argv[3]), files);
  std::printf("%zu vertices, %zu tetrahedra\n", body.nodes.size(), body.tetrahedra.size());
  for (const Element element : {Element::p1, Element::p1_anp}) {
    const ElementExcess estimate = estimated_excess(body, element), truth = element_truth(body, element);
    std::printf("%-7s largest: %5.1f %% estimated, %5.1f %% true; median: %5.1f %% estimated, %5.1f %% true\n",
                name_of(element), 100 * estimate.largest, 100 * truth.largest, 100 * estimate.median,
                100 * truth.median);
  }
  return 0;
}
