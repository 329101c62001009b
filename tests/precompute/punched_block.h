// A block of gel that is held on all sides but its top, with its tensors, and a tool on the top: what discs are measured on against the closed
// forms of a half-space.
#pragma once

#include <palpate/palpate_scene_def.hpp>

#include <numbers>

#include "tests/precompute/support.h"
#include "tests/runtime/touched_box.h"
#include "tests/support/tensor_bundle.h"

namespace palpate::tests {

inline constexpr double kYoung = 3000, kEdge = 0.005;

// A block with its nodes at the given distances from the middle of its top, in metres, downwards and to all sides.
inline TetrahedralMesh graded_block(const std::vector<double>& distance) {
  const int cells = static_cast<int>(distance.size()) - 1;
  TetrahedralMesh mesh = box_mesh({2 * cells, 2 * cells, cells}, {2.0 * cells, 2.0 * cells, 1.0 * cells});
  const auto spread = [&](double at) {
    return std::copysign(distance[static_cast<std::size_t>(std::lround(std::abs(at)))], at);
  };
  for (auto& p : mesh.nodes) p = {spread(p[0] - cells), spread(p[1] - cells), spread(p[2] - cells)};
  return mesh;
}

// A slab in place of a block: so thick, in layers of the same height.
inline TetrahedralMesh graded_slab(const std::vector<double>& distance, double thickness, int layers) {
  const int cells = static_cast<int>(distance.size()) - 1;
  TetrahedralMesh mesh = box_mesh({2 * cells, 2 * cells, layers}, {2.0 * cells, 2.0 * cells, thickness});
  for (auto& p : mesh.nodes) {
    for (int i = 0; i < 2; ++i) {
      const double from = p[i] - cells;
      p[i] = std::copysign(distance[static_cast<std::size_t>(std::lround(std::abs(from)))], from);
    }
    p[2] -= thickness;
  }
  return mesh;
}

// A scene with a block of gel that is held on all sides but its top. The nodes of the top within `reach` of its middle are
// touchable. Where the bottom is not held, so are the nodes of the bottom.
class Punched {
 public:
  enum class Bottom { held, bare };
  Punched(const TetrahedralMesh& mesh, Element element, double poisson, double reach, Bottom bottom = Bottom::held) {
    ElasticBody body = body_of(mesh, {{kYoung, poisson, 0}});
    double low = 0, side = 0;
    for (const auto& p : body.nodes) low = std::min(low, p[2]), side = std::max(side, p[0]);
    low_ = low;
    const auto at_side = [&](const auto& p) {
      return (bottom == Bottom::held && p[2] < low + 1e-9) || std::abs(p[0]) > side - 1e-9 ||
             std::abs(p[1]) > side - 1e-9;
    };
    hold(body, [&](const auto& p) { return at_side(p) ? 7 : 0; });
    std::vector<std::int32_t> touched;
    for (const std::int32_t n : body.touchable) {
      const auto& p = body.nodes[static_cast<std::size_t>(n)];
      if (!at_side(p) && std::abs(p[0]) < reach && std::abs(p[1]) < reach) touched.push_back(n);
    }
    for (std::size_t t = 0; t < body.triangles.size(); ++t)
      for (int v = 0; v < 3; ++v)
        if (const auto& p = body.nodes[static_cast<std::size_t>(body.triangles[t][v])];
            p[0] == 0 && p[1] == 0 && p[2] > low)
          middle_triangle_ = static_cast<std::int32_t>(t), middle_corner_ = v;
    nodes_ = body.nodes, triangles_ = body.triangles;
    write(body, element, solve_node_tensors(body, element, touched));
  }

  // Discs of one radius, of one tool: where they come down on the top, x and y; or where they come up to the bottom. Or jaws that close at
  // the first of these places.
  struct Discs {
    double radius;
    std::vector<std::array<double, 2>> at;
    bool below = false, jaws = false;
  };
  // The force in N on discs that come down and are then moved by `way`, all alike, along the way. Discs below go the mirrored way.
  double move(const std::vector<Discs>& tools, Eigen::Vector3d way) {
    palpate_scene_reset(scene_.get());
    Contacts contacts(scene_.get());
    std::vector<std::vector<double>> points(tools.size());
    std::vector<palpate_tool> sent(tools.size(), palpate_default_tool());
    std::vector<palpate_grasp> grasps(tools.size(), palpate_default_grasp());
    for (const double share : {-1.0, 0.0, 1.0}) {
      for (std::size_t t = 0; t < tools.size(); ++t) {
        sent[t].id = static_cast<std::int32_t>(t);
        if (tools[t].jaws) {
          const Eigen::Vector3d at(tools[t].at[0][0], tools[t].at[0][1], 0);
          find_on_top(at, &grasps[t]);
          Eigen::Map<Eigen::Vector3d>(grasps[t].position) = at + std::max(0.0, share) * way;
          grasps[t].radius = tools[t].radius, sent[t].parts = &grasps[t].part;
          continue;
        }
        points[t].clear();
        for (const auto& [x, y] : tools[t].at) {
          Eigen::Vector3d p = Eigen::Vector3d(x, y, share < 0 ? 1e-3 : -1e-9) + std::max(0.0, share) * way;
          if (tools[t].below) p[2] = low_ - p[2];
          points[t].insert(points[t].end(), p.data(), p.data() + 3);
        }
        sent[t].disc_radius = tools[t].radius;
        sent[t].points = points[t].data(), sent[t].point_count = static_cast<std::int32_t>(tools[t].at.size());
      }
      EXPECT_EQ(palpate_scene_touch(scene_.get(), sent.data(), static_cast<std::int32_t>(sent.size()), 1e-3,
                                    contacts.get(), contacts.bytes()),
                0u);
    }
    double force = 0;
    for (std::size_t t = 0; t < tools.size(); ++t) {
      Eigen::Vector3d along = way.normalized();
      if (tools[t].below) along[2] = -along[2];
      force -= along.dot(Eigen::Vector3d(palpate_contacts_tool(contacts, static_cast<std::int32_t>(t))->force_raw));
    }
    return force;
  }
  // The force in N on a disc that comes down at x, y and is pushed by 1 mm into the gel.
  double push(double x, double y, double radius) { return move({{radius, {{x, y}}}}, {0, 0, -1e-3}); }

  // The force along x in N on discs that all grip the middle and are dragged by 1 mm along x.
  double drag(double radius, std::size_t discs = 1) {
    palpate_scene_reset(scene_.get());
    Contacts contacts(scene_.get());
    const std::vector<palpate_grip> grips(
        discs, grip_at_place(middle_triangle_, Eigen::Vector3d::Unit(middle_corner_), {1e-3, 0, 0}));
    palpate_tool tool = tool_of(grips);
    tool.disc_radius = radius;
    EXPECT_EQ(palpate_scene_touch(scene_.get(), &tool, 1, 1e-3, contacts.get(), contacts.bytes()), 0u);
    return -palpate_contacts_tool(contacts, 0)->force_raw[0];
  }

  // What tools feel together, N and N m about the middle of the disc, whose jaws close at one place of the top and then move and turn alike.
  struct Felt {
    Eigen::Vector3d force = Eigen::Vector3d::Zero(), torque = Eigen::Vector3d::Zero();
  };
  Felt grasp(Eigen::Vector3d at, double radius, Eigen::Vector3d way, Eigen::Vector3d turn, int tools = 1) {
    palpate_scene* const scene = tools > 1 ? scene_.get() : grasping_.get();
    palpate_scene_reset(scene);
    Contacts contacts(scene);
    palpate_grasp grasp = palpate_default_grasp();
    grasp.radius = radius;
    find_on_top(at, &grasp);
    palpate_tool tool = palpate_default_tool();
    tool.parts = &grasp.part, tool.has_torque = 1;
    for (const double share : {0.0, 1.0}) {
      Eigen::Map<Eigen::Vector3d>(grasp.position) = at + share * way;
      Eigen::Map<Eigen::Vector3d>(tool.reference) = at + share * way;
      const double angle = share * turn.norm();
      grasp.orientation[0] = std::cos(angle / 2);
      for (int d = 0; d < 3; ++d) grasp.orientation[1 + d] = angle > 0 ? std::sin(angle / 2) * turn.normalized()[d] : 0;
      std::vector<palpate_tool> sent(static_cast<std::size_t>(tools), tool);
      for (int t = 0; t < tools; ++t) sent[static_cast<std::size_t>(t)].id = t;
      EXPECT_EQ(palpate_scene_touch(scene, sent.data(), tools, 1e-3, contacts.get(), contacts.bytes()), 0u);
    }
    Felt felt;
    for (int t = 0; t < tools; ++t) {
      const palpate_tool_state& state = *palpate_contacts_tool(contacts, t);
      felt.force += Eigen::Vector3d(state.force_raw), felt.torque += Eigen::Vector3d(state.torque_raw);
    }
    return felt;
  }

 private:
  void find_on_top(const Eigen::Vector3d& at, palpate_grasp* grasp) const {
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      Eigen::Matrix3d corners = Eigen::Matrix3d::Ones();
      bool on_top = true;
      for (int v = 0; v < 3; ++v) {
        const auto& p = nodes_[static_cast<std::size_t>(triangles_[t][v])];
        corners(0, v) = p[0], corners(1, v) = p[1], on_top = on_top && p[2] == 0;
      }
      if (!on_top) continue;
      const Eigen::Vector3d k = corners.partialPivLu().solve(Eigen::Vector3d(at[0], at[1], 1));
      if (k.minCoeff() < -1e-9) continue;
      grasp->triangle = static_cast<std::int32_t>(t);
      Eigen::Map<Eigen::Vector3d>(grasp->barycentric) = k.cwiseMax(0) / k.cwiseMax(0).sum();
      return;
    }
    throw std::logic_error("no such place on the top");
  }

  void write(const ElasticBody& body, Element element, const std::vector<NodeTensor>& tensors) {
    bytes_ = std::make_unique<AlignedBytes>(bundle_bytes(tensor_parts(body, element, tensors)));
    palpate_bundle* opened = nullptr;
    palpate_error error = {};
    if (palpate_bundle_open(bytes_->data(), bytes_->size(), nullptr, &opened, &error) != PALPATE_OK)
      throw std::runtime_error(error.text);
    bundle_.reset(opened);
    SceneDef def = unlimited_def();
    def.grasps.grasps = 1, def.max_tools = 4, def.torque_limit = def.torque_slew = INFINITY;
    scene_ = scene_of(def);
    def.max_tools = 1;
    grasping_ = scene_of(def);
  }
  ScenePointer scene_of(const SceneDef& def) const {
    palpate_scene* scene = nullptr;
    palpate_error error = {};
    if (palpate_scene_create(bundle_.get(), &def, &scene, &error) != PALPATE_OK) throw std::runtime_error(error.text);
    return ScenePointer(scene);
  }

  double low_ = 0;                     // m, of the bottom
  std::int32_t middle_triangle_ = -1;  // a triangle with a corner in the middle of the top
  int middle_corner_ = 0;
  std::vector<std::array<double, 3>> nodes_;
  std::vector<std::array<std::int32_t, 3>> triangles_;
  std::unique_ptr<AlignedBytes> bytes_;
  BundlePointer bundle_;
  ScenePointer scene_, grasping_;  // grasping_: one tool, whose jaws have all their nodes
};

// The distances of planes of nodes from the middle of the top: even cells of kEdge, then cells that grow, up to kReach edges, where
// the sides and the bottom are held.
inline constexpr double kReach = 148.5;
inline TetrahedralMesh flat_block() {
  std::vector<double> distance;
  for (const double edges : {0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.5, 10.5, 16.5, 28.5, 58.5, kReach})
    distance.push_back(kEdge * edges);
  return graded_block(distance);
}

}  // namespace palpate::tests
