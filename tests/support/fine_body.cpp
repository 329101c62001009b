#include "tests/support/fine_body.h"

namespace palpate::tests {

void FineHost::add(const Eigen::Vector3d& p) {
  for (int d = 0; d < 3; ++d) positions.push_back(static_cast<float>(p[d]));
}

Eigen::Vector3d FineHost::vertex(std::int32_t v) const {
  return Eigen::Map<const Eigen::Vector3f>(&positions[3 * v]).cast<double>();
}

palpate_fine_surface FineHost::view() const {
  palpate_fine_surface surface = palpate_default_fine_surface();
  surface.positions = positions.data(), surface.vertex_count = vertices();
  surface.triangles = triangles.data(), surface.triangle_count = static_cast<std::int32_t>(triangles.size() / 3);
  return surface;
}

SurfaceFirst FineHost::surface() const {
  SurfaceFirst body;
  for (std::int32_t v = 0; v < vertices(); ++v) body.mesh.nodes.push_back({vertex(v)[0], vertex(v)[1], vertex(v)[2]});
  for (std::size_t t = 0; t < triangles.size(); t += 3)
    body.triangles.push_back({triangles[t], triangles[t + 1], triangles[t + 2]});
  body.surface_nodes = vertices();
  return body;
}

FineHost fine_of(const SurfaceFirst& body, int splits, double bump) {
  std::vector<Eigen::Vector3d> place;
  for (std::int32_t n = 0; n < body.surface_nodes; ++n) place.emplace_back(body.mesh.nodes[n].data());
  std::vector<std::array<std::int32_t, 3>> triangles = body.triangles;
  for (int s = 0; s < splits; ++s) {
    std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> middle_of;
    const auto middle = [&](std::int32_t a, std::int32_t b) {
      const auto [found, fresh] = middle_of.emplace(std::minmax(a, b), static_cast<std::int32_t>(place.size()));
      if (fresh) place.push_back(0.5 * (place[a] + place[b]));
      return found->second;
    };
    std::vector<std::array<std::int32_t, 3>> finer;
    for (const auto& [a, b, c] : triangles) {
      const std::int32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    triangles = finer;
  }
  std::vector<Eigen::Vector3d> normal(place.size(), Eigen::Vector3d::Zero());
  for (const auto& [a, b, c] : triangles) {
    const Eigen::Vector3d area = (place[b] - place[a]).cross(place[c] - place[a]);
    for (const std::int32_t v : {a, b, c}) normal[v] += area;
  }
  FineHost fine;
  for (std::size_t v = 0; v < place.size(); ++v)
    fine.add(place[v] + bump * std::sin(7.3 * static_cast<double>(v)) * normal[v].normalized());
  for (const auto& t : triangles) fine.triangles.insert(fine.triangles.end(), t.begin(), t.end());
  return fine;
}

DenseBody coarse_ball() {
  const TriangleSurface sphere = sphere_surface(1, kBallRadius);
  TetrahedralMesh mesh;
  mesh.nodes.assign(sphere.points.begin(), sphere.points.end());
  const auto middle = static_cast<std::int32_t>(mesh.nodes.size());
  mesh.nodes.push_back({0, 0, 0});
  for (const auto& [a, b, c] : sphere.triangles) mesh.tetrahedra.push_back({middle, a, b, c});
  mesh.region.assign(mesh.tetrahedra.size(), 0);
  mesh.region_names = {"ball"};
  DenseBody dense{surface_first(mesh), 5400, 0.3, false, {}};
  for (const auto& p : dense.body.mesh.nodes) dense.fixed.insert(dense.fixed.end(), 3, p[2] < -0.02 ? 1 : 0);
  return dense;
}

FineHost fine_sphere(int splits) {
  const TriangleSurface sphere = sphere_surface(splits, kBallRadius);
  FineHost fine;
  for (const Point& p : sphere.points) fine.add(Eigen::Vector3d(p.data()));
  for (const Triangle& t : sphere.triangles) fine.triangles.insert(fine.triangles.end(), t.begin(), t.end());
  return fine;
}

BoundFine::BoundFine(const FineHost& host, const SurfaceFirst& body) : memory_(palpate_allocator{}), scratch_(memory_) {
  for (std::int32_t n = 0; n < body.surface_nodes; ++n)
    nodes_.insert(nodes_.end(), body.mesh.nodes[n].begin(), body.mesh.nodes[n].end());
  for (const auto& t : body.triangles) triangles_.insert(triangles_.end(), t.begin(), t.end());
  const FineSurface::Mesh mesh = {nodes_.data(), nullptr, triangles_.data(), body.surface_nodes,
                                  static_cast<std::int32_t>(body.triangles.size())};
  palpate_error error = {};
  if (fine_.bind(memory_, scratch_, host.view(), mesh, nodes_.data(), &error) != PALPATE_OK)
    throw std::runtime_error(error.text);
}

BoundFine::~BoundFine() {
  memory_.release_all();
  scratch_.release_all();
}

std::vector<float> BoundFine::moved_by(const std::vector<float>& displacement) const {
  std::vector<float> moved;
  for (std::int32_t v = 0; v < fine_.vertex_count(); ++v) {
    const Vec3 u = fine_.displacement(v, [&](std::int32_t node) {
      const float* at = &displacement[3 * node];
      return Vec3{at[0], at[1], at[2]};
    });
    for (int d = 0; d < 3; ++d) moved.push_back(static_cast<float>(u[d]));
  }
  return moved;
}

}  // namespace palpate::tests
