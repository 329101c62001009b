// Strain and stress inside the organ, from the displacements of all nodes.
//
// Within a tetrahedron both are constant. A place takes them from sites: a site is a node with one of the regions that meet there, and
// has the mean over the tetrahedra of its region around it, each weighted by its volume. Between sites they are linear. So the
// stress is continuous within a region and jumps where two regions meet, as it does in truth.
//
// The part of the stress that is alike in all directions is averaged twice, tetrahedra -> sites -> tetrahedra -> sites, because
// single tetrahedra of nearly incompressible tissue alternate between much pressure and none. The first mean is that of the element
// p1-anp itself (docs/method.md, section 1): with it, the stress of a tetrahedron is the one that balances the forces K u. Of p1-ang the
// same holds for a share of the whole stress.
//
// Small displacements: the strain is the symmetric part of the displacement gradient, and the stress that of linear elasticity. Under
// large deformation: Green and Lagrange's strain (H + H^T + H^T H) / 2, and Cauchy's stress by the region's law.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/include/palpate/palpate_inside.h"
#include "runtime/inside/stress_measures.h"
#include "runtime/inside/tetrahedron_tree.h"
#include "runtime/large/hyperelastic_body.h"

namespace palpate {

// Strain without unit, stress in Pa.
struct StrainAndStress {
  double strain[kTensorNumbers];
  double stress[kTensorNumbers];
};

class InsideField {
 public:
  // body: indices checked, volumes above zero; its laws and fixed, preload and preload_count are read and not kept. large: see above.
  // preload: [nodes][3] m, displacement of the nodes at rest from where they were meshed, or nullptr. False where memory ends.
  // Memory: about 180 bytes a tetrahedron and 300 a node.
  bool create(SceneMemory& memory, const HyperelasticBody& body, bool large, const double* preload);

  std::int32_t nodes() const { return node_count_; }
  std::int32_t tetrahedra() const { return tetrahedron_count_; }
  TetrahedronTree::Found locate(Vec3 p, double farthest) const { return tree_.nearest(p, farthest); }

  // displacements: [nodes][3] m from rest, any floats; one that is not finite counts as zero. The field is kept until the next call.
  // Returns step flags. Cost: two passes over the tetrahedra.
  palpate_step_flags compute(const float* displacements);
  bool computed() const { return computed_; }

  // After compute():
  // Of a node: the mean over its sites, each weighted by its volume.
  StrainAndStress at_node(std::int32_t node) const;
  // The weights are first brought into the tetrahedron.
  StrainAndStress at_place(const palpate_inside_place& place) const;
  // Of a tetrahedron itself: with the stress that balances K u.
  StrainAndStress in_tetrahedron(std::int32_t e) const;
  // m, from rest. weights may lie outside of the tetrahedron.
  Vec3 displacement(const palpate_inside_place& place) const;
  Vec3 displacement(std::int32_t node) const;

  // Whether a place is one that locate() may have filled.
  bool is_place(const palpate_inside_place& place) const;
  const std::int32_t* corners(std::int32_t e) const { return tetrahedra_ + 4 * static_cast<std::size_t>(e); }

 private:
  struct Element {
    double gradient[3][3];  // 1/m, of the shape functions of corners 1, 2 and 3
    double volume;          // m^3
    std::int32_t region;
    std::int32_t unused;
  };
  void displacement_gradient(std::int32_t e, double h[3][3]) const;
  // With the element's own mean stress, which for p1-anp is that of the dilatation in the tetrahedron alone.
  void evaluate(std::int32_t e, StrainAndStress* out, bool* turned) const;
  void evaluate_largely(const TissueLaw& law, const double h[3][3], StrainAndStress* out, bool* turned) const;
  double mean_of_sites(std::int32_t e) const;
  palpate_step_flags take(const float* displacements);

  TetrahedronTree tree_;
  std::int32_t node_count_ = 0, tetrahedron_count_ = 0, site_count_ = 0;
  bool large_ = false, nodal_ = false, computed_ = false;
  double averaged_ = 0;                 // share of the shear that follows the mean gradient of the sites
  double* positions_ = nullptr;         // [nodes][3] m, as meshed
  std::int32_t* tetrahedra_ = nullptr;  // [E][4]
  Element* elements_ = nullptr;         // [E]
  TissueLaw* laws_ = nullptr;           // [regions]
  std::int32_t* site_of_ = nullptr;     // [E][4] of each corner
  double* site_volume_ = nullptr;       // [sites] m^3, of a quarter of each of its tetrahedra
  std::int32_t* first_site_ = nullptr;  // [nodes] -1: none
  std::int32_t* next_site_ = nullptr;   // [sites] of the same node; -1: none
  float* preload_ = nullptr;            // [nodes][3] m; nullptr: none
  float* displacements_ = nullptr;      // [nodes][3] m, from rest
  double* mean_stress_ = nullptr;       // [sites] Pa, averaged once
  StrainAndStress* at_site_ = nullptr;  // [sites]
};

}  // namespace palpate
