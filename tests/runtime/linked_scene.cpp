#include "tests/runtime/linked_scene.h"

namespace palpate::tests {

using Eigen::Vector3d;

palpate_link_end on_surface(std::int32_t triangle, Vector3d k) {
  palpate_link_end end = {};
  end.kind = PALPATE_END_SURFACE_POINT, end.triangle = triangle;
  Eigen::Map<Vector3d>(end.barycentric) = k;
  return end;
}

palpate_link_end in_world(Vector3d point) {
  palpate_link_end end = {};
  end.kind = PALPATE_END_WORLD;
  Eigen::Map<Vector3d>(end.point) = point;
  return end;
}

palpate_link link_of(palpate_link_kind kind, palpate_link_end a, palpate_link_end b, double rest_length,
                     double stiffness) {
  palpate_link link = palpate_default_link();
  link.kind = kind, link.ends[0] = a, link.ends[1] = b;
  link.rest_length = rest_length, link.stiffness = stiffness;
  return link;
}

void LinkedScene::set(const std::vector<palpate_link>& wanted) {
  links = wanted;
  palpate_error error = {};
  EXPECT_EQ(palpate_scene_set_links(get(), links.data(), static_cast<std::int32_t>(links.size()), &error), PALPATE_OK)
      << error.text;
}

palpate_step_flags LinkedScene::steps(int count) {
  for (int s = 0; s < count; ++s) touch();
  return flags;
}

Vector3d LinkedScene::place_of(const palpate_link_end& end, const Eigen::VectorXd& u) const {
  if (end.kind == PALPATE_END_WORLD) return Vector3d(end.point);
  Vector3d sum = Vector3d::Zero();
  for (int v = 0; v < 3; ++v) {
    const auto n = body.body.triangles[end.triangle][v];
    sum += end.barycentric[v] * (body.node(n) + u.segment<3>(3 * n));
  }
  return sum;
}

void LinkedScene::expect_laws(const Eigen::VectorXd& u, double off, double within, double share) const {
  for (std::size_t i = 0; i < links.size(); ++i) {
    const palpate_link& link = links[i];
    const palpate_link_state& found = state(static_cast<std::int32_t>(i));
    const Vector3d a = place_of(link.ends[0], u), b = place_of(link.ends[1], u), x = b - a, force(found.force);
    EXPECT_LT((a - Vector3d(found.ends[0])).norm(), off) << i;
    EXPECT_LT((b - Vector3d(found.ends[1])).norm(), off) << i;
    EXPECT_NEAR(found.length, x.norm(), 2 * off) << i;
    if (link.kind == PALPATE_LINK_CLIP) {
      EXPECT_LT((x - force / link.stiffness).norm(), 1e-7) << i;
      continue;
    }
    EXPECT_LT((force - found.tension * x.normalized()).norm(), within + share * std::fabs(found.tension))
        << i << ": along the line between the ends";
    if (found.condition == PALPATE_LINK_TAUT) {
      EXPECT_NEAR(x.norm(), found.rest_length + found.tension / link.stiffness, 1e-7) << i;
    } else {
      EXPECT_EQ(found.tension, 0) << i;
      EXPECT_LT(x.norm(), found.rest_length + 1e-7) << i;
    }
  }
}

}  // namespace palpate::tests
