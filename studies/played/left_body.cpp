#include "studies/played/left_body.h"

#include <algorithm>

#include "runtime/cut/effect.h"

namespace palpate::played {

LeftBody::LeftBody(const HyperelasticBody& uncut, const palpate_scene& scene)
    : body_(uncut),
      nodes_(uncut.nodes, uncut.nodes + 3 * std::ptrdiff_t{uncut.node_count}),
      fixed_(3 * static_cast<std::size_t>(uncut.node_count), 1),
      is_left_(static_cast<std::size_t>(uncut.node_count)) {
  const CutMesh& mesh = cut_mesh_of(scene);
  std::vector<char> is_used(static_cast<std::size_t>(uncut.node_count));
  for (std::int32_t c = 0; c < 4 * uncut.tetrahedron_count; ++c)
    is_used[static_cast<std::size_t>(uncut.tetrahedra[c])] = 1;
  const auto first_reserve = static_cast<std::int32_t>(std::find(is_used.begin(), is_used.end(), 0) - is_used.begin());
  const auto in_bundle = [&](std::int32_t node) {
    return node < uncut.node_count ? node : first_reserve + node - uncut.node_count;
  };
  for (std::int32_t n = uncut.node_count; n < mesh.nodes(); ++n)
    std::copy_n(uncut.nodes + 3 * std::ptrdiff_t{mesh.at_rest(n)}, 3,
                nodes_.begin() + 3 * std::ptrdiff_t{in_bundle(n)});
  for (std::int32_t e = 0; e < uncut.tetrahedron_count; ++e) {
    if (mesh.is_removed(e)) continue;
    region_.push_back(uncut.region[e]);
    for (int a = 0; a < 4; ++a) {
      const std::int32_t node = in_bundle(mesh.nodes_of(e)[a]);
      const std::int32_t at_rest = mesh.at_rest(mesh.nodes_of(e)[a]);
      tetrahedra_.push_back(node), is_left_[static_cast<std::size_t>(node)] = 1;
      std::copy_n(uncut.fixed + 3 * std::ptrdiff_t{at_rest}, 3, fixed_.begin() + 3 * std::ptrdiff_t{node});
    }
  }
  body_.nodes = nodes_.data(), body_.tetrahedra = tetrahedra_.data(), body_.region = region_.data(),
  body_.fixed = fixed_.data();
  body_.tetrahedron_count = static_cast<std::int32_t>(region_.size());
}

}  // namespace palpate::played
