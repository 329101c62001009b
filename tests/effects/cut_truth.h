// The dense body that is left where a scene has cut the box.
#pragma once

#include "runtime/cut/cut_mesh.h"
#include "studies/hyperelastic/large_reference.h"
#include "tests/effects/effects.h"
#include "tests/runtime/large/large_scene.h"

namespace palpate::tests {

class CutTruth {
 public:
  explicit CutTruth(const EffectBody& whole) : whole_(whole) {}
  // As the mesh is now; new nodes have the numbers of the scene. Whether it has changed.
  bool follow(const CutMesh& mesh);

  // [3N][3N] m/N; zero for nodes that are not in use.
  const Eigen::MatrixXd& compliance() const { return is_cut() ? compliance_ : whole_.compliance; }
  // [3N] m, where loads and supports move what is left that would move the whole box by this.
  Eigen::VectorXd moved(const Eigen::VectorXd& by, bool in_volume) const;
  // Loads on the nodes at rest, [3N] N, as the nodes have them: by volume, as gravity, or by the area of the triangles that a node has.
  Eigen::VectorXd divided(const Eigen::VectorXd& load, bool in_volume) const;
  // Triangles of the surface at rest, with the corners that they have now.
  std::vector<std::array<std::int32_t, 3>> triangles() const;
  // What is left, under large deformation.
  const LargeReference& large() const { return large_ ? *large_ : whole_large(); }
  // The node at rest where a node began.
  std::int32_t origin(std::int32_t node) const { return is_cut() ? origin_[static_cast<std::size_t>(node)] : node; }

 private:
  bool is_cut() const { return new_nodes_ > 0; }

  static const LargeReference& whole_large();

  const EffectBody& whole_;
  std::int32_t new_nodes_ = 0;
  std::vector<std::int32_t> origin_;
  std::vector<std::array<std::int32_t, 4>> tetrahedra_;
  Eigen::MatrixXd stiffness_, compliance_;
  std::unique_ptr<Seen> seen_;
  std::unique_ptr<LargeReference> large_;
};

}  // namespace palpate::tests
