#include "programs/player/organ_obstacles.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "formats/errors.h"
#include "programs/player/obstacle_surface.h"

namespace palpate {
namespace {

using Kind = SceneConfig::Obstacle::Kind;

palpate_obstacle_kind kind_of(Kind kind) {
  return kind == Kind::rectangle ? PALPATE_OBSTACLE_RECTANGLE
         : kind == Kind::disc    ? PALPATE_OBSTACLE_DISC
                                 : PALPATE_OBSTACLE_MESH;
}

}  // namespace

OrganObstacles::OrganObstacles(const SceneConfig& scene) : file_(scene.file.string()), obstacles_(scene.obstacles) {
  for (const SceneConfig::Obstacle& from : obstacles_) {
    const RenderMesh& mesh = surfaces_.emplace_back(surface_of(from));
    auto& triangles = triangles_.emplace_back(mesh.indices.begin(), mesh.indices.end());
    palpate_obstacle& one = given_.emplace_back(palpate_default_obstacle());
    one.kind = kind_of(from.kind);
    one.size[0] = from.size[0], one.size[1] = from.size[1], one.friction = from.friction;
    if (from.depth) one.depth = *from.depth;
    const palpate_pose pose = pose_at(from, 0);
    std::copy_n(pose.position, 3, one.position), std::copy_n(pose.orientation, 4, one.orientation);
    if (from.kind != Kind::mesh) continue;
    one.positions = mesh.positions.data(), one.triangles = triangles.data();
    one.vertex_count = static_cast<std::int32_t>(mesh.positions.size() / 3);
    one.triangle_count = static_cast<std::int32_t>(triangles.size() / 3);
  }
}

void OrganObstacles::put(palpate_obstacles_def* def) const {
  def->count = static_cast<std::int32_t>(given_.size()), def->list = given_.data();
}

std::string OrganObstacles::named(const std::string& sentence) const {
  std::size_t i = 0;
  int read = 0;
  if (std::sscanf(sentence.c_str(), "palpate_obstacle: obstacle %zu: %n", &i, &read) != 1 || i >= obstacles_.size())
    return fmt::format("{}: {}", file_, sentence);
  const SceneConfig::Obstacle& of = obstacles_[i];
  const std::string mesh = of.surface ? fmt::format(" ({})", of.surface->file.string()) : "";
  return fmt::format("{}:{}: obstacle \"{}\"{}: {}", file_, of.line, of.name, mesh,
                     sentence.substr(static_cast<std::size_t>(read)));
}

void OrganObstacles::set(palpate_scene* scene, double time) const {
  for (std::size_t i = 0; i < obstacles_.size(); ++i) {
    if (!moves(obstacles_[i])) continue;
    const palpate_pose pose = pose_at(obstacles_[i], time);
    palpate_error error = {};
    if (palpate_scene_set_obstacle_pose(scene, static_cast<std::int32_t>(i), &pose, &error) != PALPATE_OK)
      throw InputError(
          fmt::format("{}:{}: obstacle \"{}\": {}", file_, obstacles_[i].line, obstacles_[i].name, error.text));
  }
}

}  // namespace palpate
