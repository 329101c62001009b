#include "tests/effects/cut_truth.h"

#include "tests/support/box_corridor.h"

namespace palpate::tests {

bool CutTruth::follow(const CutMesh& mesh) {
  const TouchedBody& whole = whole_.touched;
  const auto nodes = static_cast<std::int32_t>(whole.body.mesh.nodes.size());
  if (mesh.nodes() - nodes == new_nodes_) return false;
  new_nodes_ = mesh.nodes() - nodes;
  const auto in_scene = [&](std::int32_t n) { return n < nodes ? n : nodes - kReserveOfBox + n - nodes; };
  DenseBody left = {whole.body, 5400, 0.45, false, whole.fixed};
  origin_.resize(static_cast<std::size_t>(nodes));
  std::iota(origin_.begin(), origin_.end(), 0);
  for (std::int32_t n = nodes; n < mesh.nodes(); ++n) {
    const auto own = static_cast<std::size_t>(in_scene(n)), from = static_cast<std::size_t>(mesh.at_rest(n));
    origin_[own] = mesh.at_rest(n);
    left.body.mesh.nodes[own] = whole.body.mesh.nodes[from];
    std::copy_n(whole.fixed.begin() + static_cast<std::ptrdiff_t>(3 * from), 3,
                left.fixed.begin() + static_cast<std::ptrdiff_t>(3 * own));
  }
  auto& tetrahedra = left.body.mesh.tetrahedra;
  for (std::size_t e = 0; e < tetrahedra.size(); ++e)
    for (std::size_t c = 0; c < 4; ++c) tetrahedra[e][c] = in_scene(mesh.nodes_of(static_cast<std::int32_t>(e))[c]);
  left.stiffness = stiffness_ = dense_stiffness(left.body.mesh, left.young, left.poisson);
  compliance_ = dense_compliance(left);
  // The arrays keep their sizes, and `body` points to them.
  seen_ = std::make_unique<Seen>(whole, false, 0);
  std::copy_n(left.body.mesh.nodes[0].data(), seen_->nodes.size(), seen_->nodes.begin());
  std::copy_n(tetrahedra[0].data(), seen_->tetrahedra.size(), seen_->tetrahedra.begin());
  seen_->fixed = left.fixed;
  large_ = std::make_unique<LargeReference>(seen_->body);
  return true;
}

const LargeReference& CutTruth::whole_large() {
  static const Seen seen(body_of(Store::f32).touched, false, 0);
  static const LargeReference reference(seen.body);
  return reference;
}

Eigen::VectorXd CutTruth::moved(const Eigen::VectorXd& by) const {
  if (!is_cut()) return by;
  Eigen::VectorXd load = whole_.touched.stiffness() * by, imposed = Eigen::VectorXd::Zero(by.size());
  for (Eigen::Index i = 0; i < by.size(); ++i) {
    if (!whole_.touched.fixed[static_cast<std::size_t>(i)]) continue;
    load[i] = 0, imposed[i] = by[i];
  }
  return imposed + compliance_ * (load - stiffness_ * imposed);
}

}  // namespace palpate::tests
