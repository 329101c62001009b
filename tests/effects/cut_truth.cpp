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
  tetrahedra_ = tetrahedra;
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

std::vector<std::array<std::int32_t, 3>> CutTruth::triangles() const {
  std::vector<std::array<std::int32_t, 3>> all = whole_.touched.body.triangles;
  for (auto& t : all)
    for (const auto& e : tetrahedra_) {
      const auto now = [&](std::int32_t at_rest) {
        const auto c = std::ranges::find_if(e, [&](std::int32_t n) { return origin(n) == at_rest; });
        return c == e.end() ? -1 : *c;
      };
      const std::array<std::int32_t, 3> with = {now(t[0]), now(t[1]), now(t[2])};
      if (std::ranges::find(with, -1) != with.end()) continue;
      t = with;
      break;
    }
  return all;
}

Eigen::VectorXd CutTruth::divided(const Eigen::VectorXd& load, bool in_volume) const {
  if (!is_cut()) return load;
  const auto& nodes = whole_.touched.body.mesh.nodes;
  const auto at = [&](std::int32_t n) { return Eigen::Vector3d(nodes[static_cast<std::size_t>(origin(n))].data()); };
  Eigen::VectorXd own = Eigen::VectorXd::Zero(load.size() / 3), all = own, result = load;
  const auto add = [&](std::int32_t n, double size) { own[n] += size, all[origin(n)] += size; };
  for (const auto& e : tetrahedra_)
    for (const std::int32_t n : e)
      if (in_volume) add(n, std::abs((at(e[1]) - at(e[0])).cross(at(e[2]) - at(e[0])).dot(at(e[3]) - at(e[0]))));
  for (const auto& t : triangles())
    for (const std::int32_t n : t)
      if (!in_volume) add(n, (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])).norm());
  for (Eigen::Index n = 0; n < own.size(); ++n) {
    const std::int32_t from = origin(static_cast<std::int32_t>(n));
    result.segment<3>(3 * n) = (all[from] > 0 ? own[n] / all[from] : n == from) * load.segment<3>(3 * from);
  }
  return result;
}

Eigen::VectorXd CutTruth::moved(const Eigen::VectorXd& by, bool in_volume) const {
  if (!is_cut()) return by;
  Eigen::VectorXd load = whole_.touched.stiffness() * by, imposed = Eigen::VectorXd::Zero(by.size());
  for (Eigen::Index i = 0; i < by.size(); ++i) {
    if (!whole_.touched.fixed[static_cast<std::size_t>(i)]) continue;
    load[i] = 0, imposed[i] = by[i];
  }
  return imposed + compliance_ * (divided(load, in_volume) - stiffness_ * imposed);
}

}  // namespace palpate::tests
