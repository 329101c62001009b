#include "programs/player/gltf_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <numeric>

#include "formats/atomic_file.h"
#include "formats/errors.h"

namespace palpate {
namespace {

using Json = nlohmann::json;
using Floats = std::vector<float>;

// Numbers of the glTF specification.
constexpr int kFloat = 5126, kUnsignedInt = 5125, kTriangles = 4;
constexpr int kVertices = 34962, kIndices = 34963;
constexpr std::uint32_t kMagic = 0x46546C67, kVersion = 2, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;

Floats difference(const Floats& a, const Floats& b) {
  Floats result(a.size());
  std::transform(a.begin(), a.end(), b.begin(), result.begin(), std::minus<>());
  return result;
}

// The binary chunk, and its views and accessors in the JSON document.
class Buffers {
 public:
  Json views = Json::array(), accessors = Json::array();
  std::string bytes;

  // Each returns the index of its accessor. target: of the view, 0 for none.
  int add_vectors(const Floats& numbers, int target) {
    std::array<float, 3> low = {numbers[0], numbers[1], numbers[2]}, high = low;
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      low[i % 3] = std::min(low[i % 3], numbers[i]);
      high[i % 3] = std::max(high[i % 3], numbers[i]);
    }
    const int accessor = add(numbers.data(), numbers.size() / 3, 12, kFloat, "VEC3", target);
    accessors[accessor]["min"] = low;
    accessors[accessor]["max"] = high;
    return accessor;
  }
  int add_scalars(const Floats& numbers) {
    const int accessor = add(numbers.data(), numbers.size(), 4, kFloat, "SCALAR", 0);
    accessors[accessor]["min"] = Json::array({*std::min_element(numbers.begin(), numbers.end())});
    accessors[accessor]["max"] = Json::array({*std::max_element(numbers.begin(), numbers.end())});
    return accessor;
  }
  int add_quaternions(const Floats& numbers) { return add(numbers.data(), numbers.size() / 4, 16, kFloat, "VEC4", 0); }
  int add_indices(const std::vector<std::uint32_t>& indices) {
    return add(indices.data(), indices.size(), 4, kUnsignedInt, "SCALAR", kIndices);
  }

 private:
  int add(const void* data, std::size_t count, std::size_t size, int component, const char* type, int target) {
    Json view = {{"buffer", 0}, {"byteOffset", bytes.size()}, {"byteLength", count * size}};
    if (target) view["target"] = target;
    bytes.append(static_cast<const char*>(data), count * size);
    views.push_back(view);
    accessors.push_back(
        Json{{"bufferView", views.size() - 1}, {"componentType", component}, {"count", count}, {"type", type}});
    return static_cast<int>(accessors.size()) - 1;
  }
};

// At each shape one weight is 1, and all others are 0.
Floats one_at_a_time(std::size_t shapes) {
  Floats weights(shapes * shapes, 0);
  for (std::size_t i = 0; i < shapes; ++i) weights[i * shapes + i] = 1;
  return weights;
}

// Adds the turn and the place of a node to an animation, at its times.
void animate(Buffers& buffers, std::size_t node, int times, const Floats& places, const Floats& turns, Json& samplers,
             Json& channels) {
  for (const auto& [path, numbers] :
       {std::pair{"translation", buffers.add_vectors(places, 0)}, {"rotation", buffers.add_quaternions(turns)}}) {
    channels.push_back(Json{{"sampler", samplers.size()}, {"target", {{"node", node}, {"path", path}}}});
    samplers.push_back(Json{{"input", times}, {"output", numbers}, {"interpolation", "LINEAR"}});
  }
}

// Shows a node at its shapes alone, by its scale.
void show_while(Buffers& buffers, std::size_t node, const Floats& times, std::size_t first, std::size_t count,
                Json& samplers, Json& channels) {
  Floats at, scales;
  const auto add = [&](std::size_t shape, float scale) {
    if (shape >= times.size()) return;
    at.push_back(times[shape]), scales.insert(scales.end(), 3, scale);
  };
  if (first > 0) add(0, 0);
  add(first, 1), add(first + count, 0);
  channels.push_back(Json{{"sampler", samplers.size()}, {"target", {{"node", node}, {"path", "scale"}}}});
  samplers.push_back(
      Json{{"input", buffers.add_scalars(at)}, {"output", buffers.add_vectors(scales, 0)}, {"interpolation", "STEP"}});
}

void append_word(std::string& out, std::size_t word) {
  const auto value = static_cast<std::uint32_t>(word);
  out.append(reinterpret_cast<const char*>(&value), 4);
}

std::string binary_file(const Json& document, std::string bytes) {
  std::string text = document.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  bytes.resize((bytes.size() + 3) / 4 * 4, '\0');
  std::string file;
  for (const std::size_t word : {std::size_t{kMagic}, std::size_t{kVersion}, 28 + text.size() + bytes.size()})
    append_word(file, word);
  append_word(file, text.size()), append_word(file, kJsonChunk);
  file += text;
  append_word(file, bytes.size()), append_word(file, kBinaryChunk);
  return file + bytes;
}

}  // namespace

GltfFile::GltfFile(std::filesystem::path target, const SceneConfig& scene, std::uint64_t shapes)
    : target_(std::move(target)), scene_(scene) {
  check_target(target_);
  if (shapes > kMostShapes)
    throw InputError(fmt::format("{}: expected at most {} shapes, found {}; write fewer with --every {}",
                                 target_.string(), kMostShapes, shapes, (shapes + kMostShapes - 1) / kMostShapes));
}

GltfFile::GltfFile(std::filesystem::path target, const Player& player, std::uint64_t shapes)
    : GltfFile(std::move(target), player.scene(), shapes) {
  begin(player.organ(), player.scene().name, nullptr);
  begin_obstacles();
}

GltfFile::GltfFile(std::filesystem::path target, const WorldPlayer& player, std::uint64_t shapes)
    : GltfFile(std::move(target), player.scene(), shapes) {
  for (std::size_t k = 0; k < player.organ_count(); ++k)
    begin(player.organ(k), player.scene().organs[k].name, &player.pose(k));
  begin_obstacles();
}

void GltfFile::begin(const PlayedOrgan& organ, const std::string& name, const palpate_pose* pose) {
  if (organ.scene().def.shape == PALPATE_SHAPE_OFF)
    throw InputError(
        fmt::format("{}: effects.shape: expected surface or volume for --export, found off", scene_.file.string()));
  Surface& surface = surfaces_.emplace_back(Surface{&organ, name, pose});
  organs_.push_back({surfaces_.size() - 1, name, {}});
  if (const RenderMesh* mesh = organ.render_mesh()) {
    surface.indices = mesh->indices, surface.rest = mesh->positions, surface.rest_normals = mesh->normals;
    return;
  }
  const palpate_bundle_info info = palpate_bundle_describe(organ.bundle());
  const std::int32_t* triangles = palpate_bundle_triangles(organ.bundle());
  surface.indices.assign(triangles, triangles + 3 * static_cast<std::size_t>(info.triangle_count));
  surface.nodes.resize(static_cast<std::size_t>(info.surface_node_count));
  std::iota(surface.nodes.begin(), surface.nodes.end(), 0);
}

void GltfFile::begin_obstacles() {
  std::vector<const PlayedOrgan*> organs;
  for (const Organ& organ : organs_) organs.push_back(surfaces_[organ.surface].organ);
  for (ShownObstacle& obstacle : shown_obstacles(organs)) obstacles_.push_back({std::move(obstacle), {}, {}});
}

void GltfFile::add_obstacles() {
  for (Obstacle& obstacle : obstacles_) {
    const palpate_obstacle_state state = obstacle.of.state();
    const double* q = state.orientation;
    for (const double x : state.position) obstacle.places.push_back(static_cast<float>(x));
    for (const double x : {q[1], q[2], q[3], q[0]}) obstacle.turns.push_back(static_cast<float>(x));
  }
}

// The surface that a cut has made of an organ's: with the nodes that it has, each once, and the lips behind the others.
void GltfFile::begin_cut(Organ& organ) {
  if (const Surface& before = surfaces_[organ.surface]; !before.displacements.empty()) {
    Surface next{before.organ, fmt::format("{} {}", organ.name, ++organ.surfaces), before.pose};
    surfaces_.push_back(std::move(next));
    organ.surface = surfaces_.size() - 1;
  }
  Surface& surface = surfaces_[organ.surface];
  surface.first = times_.size() - 1, surface.indices.clear(), surface.nodes.clear();
  const std::vector<std::int32_t>& triangles = organ.cut.triangles();
  std::vector<std::uint32_t> own(static_cast<std::size_t>(surface.organ->shape_node_count()));
  for (const std::int32_t node : triangles) own[static_cast<std::size_t>(node)] = 1;
  for (std::size_t n = 0; n < own.size(); ++n)
    if (own[n])
      own[n] = static_cast<std::uint32_t>(surface.nodes.size()), surface.nodes.push_back(static_cast<std::int32_t>(n));
  for (const bool lips : {false, true})
    for (std::size_t corner = 0; corner < triangles.size(); ++corner)
      if ((organ.cut.is_lip()[corner / 3] != 0) == lips)
        surface.indices.push_back(own[static_cast<std::size_t>(triangles[corner])]), surface.lips += lips;
}

void GltfFile::add(std::size_t k, const ShapeRecord& shape) {
  Organ& organ = organs_[k];
  const PlayedOrgan& played = *surfaces_[organ.surface].organ;
  if (!played.render_mesh() && organ.cut.follow(played.runtime_scene())) begin_cut(organ);
  add_shape(surfaces_[organ.surface], shape);
}

void GltfFile::add_shape(Surface& surface, const ShapeRecord& shape) {
  if (surface.organ->render_mesh()) {
    const std::size_t numbers = surface.rest.size();
    surface.displacements.push_back(difference({shape.skin_positions, shape.skin_positions + numbers}, surface.rest));
    surface.normal_change.push_back(
        difference({shape.skin_normals, shape.skin_normals + numbers}, surface.rest_normals));
    return;
  }
  const auto of_surface = [&](const float* of_shape) {
    Floats numbers;
    for (const std::int32_t node : surface.nodes)
      for (int d = 0; d < 3; ++d) numbers.push_back(of_shape[3 * static_cast<std::ptrdiff_t>(node) + d]);
    return numbers;
  };
  const Floats positions = of_surface(shape.positions);
  surface.displacements.push_back(of_surface(shape.displacements));
  if (surface.rest.empty()) {
    surface.rest = difference(positions, surface.displacements.back());
    surface.rest_normals = smooth_normals(surface.rest, surface.indices);
  }
  surface.normal_change.push_back(difference(smooth_normals(positions, surface.indices), surface.rest_normals));
}

void GltfFile::add(const ShapeRecord& shape) {
  times_.push_back(static_cast<float>(shape.time));
  add(0, shape);
  add_obstacles();
}

void GltfFile::add(const WorldShapeRecord& shapes) {
  times_.push_back(static_cast<float>(shapes.organs[0].time));
  for (std::size_t k = 0; k < organs_.size(); ++k) add(k, shapes.organs[k]);
  add_obstacles();
}

void GltfFile::write() const {
  Buffers buffers;
  const bool alone = surfaces_.size() == 1 && !surfaces_[0].pose && obstacles_.empty();  // without a world's node
  const double half = std::sqrt(0.5);                                                    // a quarter turn about x
  const int lip = obstacles_.empty() ? 1 : 2;                                            // material
  Json nodes = Json::array(), meshes = Json::array(), channels = Json::array(), in_world = Json::array(),
       samplers = Json::array();
  const auto add_weights = [&](int at, std::size_t count) {
    const int weights = buffers.add_scalars(one_at_a_time(count));
    samplers.push_back(Json{{"input", at}, {"output", weights}, {"interpolation", "LINEAR"}});
    return samplers.size() - 1;
  };
  const bool any_lasts = std::ranges::any_of(surfaces_, [&](const Surface& surface) { return lasts(surface); });
  int times = -1;  // of all shapes
  if (any_lasts || !obstacles_.empty()) times = buffers.add_scalars(times_);
  if (any_lasts) add_weights(times, times_.size());  // sampler 0
  if (!alone) nodes.push_back({{"name", scene_.name}, {"rotation", {-half, 0, 0, half}}});
  for (const Surface& surface : surfaces_) {
    const auto lips = surface.indices.end() - static_cast<std::ptrdiff_t>(surface.lips);
    Json primitive = {
        {"mode", kTriangles}, {"material", 0}, {"indices", buffers.add_indices({surface.indices.begin(), lips})}};
    primitive["attributes"] = {{"POSITION", buffers.add_vectors(surface.rest, kVertices)},
                               {"NORMAL", buffers.add_vectors(surface.rest_normals, kVertices)}};
    for (std::size_t i = 0; i < surface.displacements.size(); ++i)
      primitive["targets"].push_back(Json{{"POSITION", buffers.add_vectors(surface.displacements[i], kVertices)},
                                          {"NORMAL", buffers.add_vectors(surface.normal_change[i], kVertices)}});
    Json node = {{"name", surface.name}, {"mesh", meshes.size()}};
    if (const palpate_pose* pose = surface.pose) {
      const double* q = pose->orientation;
      node["translation"] = Json::array({pose->position[0], pose->position[1], pose->position[2]});
      node["rotation"] = Json::array({q[1], q[2], q[3], q[0]});
    } else if (alone) {
      node["rotation"] = {-half, 0, 0, half};
    }
    if (!alone) in_world.push_back(nodes.size());
    std::size_t sampler = 0;
    if (!lasts(surface)) {
      const auto first = times_.begin() + static_cast<std::ptrdiff_t>(surface.first);
      const std::size_t count = surface.displacements.size();
      sampler = add_weights(buffers.add_scalars({first, first + static_cast<std::ptrdiff_t>(count)}), count);
      node["scale"] = Floats(3, surface.first == 0 ? 1 : 0);
      show_while(buffers, nodes.size(), times_, surface.first, count, samplers, channels);
    }
    channels.push_back(Json{{"sampler", sampler}, {"target", {{"node", nodes.size()}, {"path", "weights"}}}});
    nodes.push_back(node);
    Json primitives = Json::array({primitive});
    if (surface.lips > 0) {
      primitive["material"] = lip, primitive["indices"] = buffers.add_indices({lips, surface.indices.end()});
      primitives.push_back(primitive);
    }
    meshes.push_back(
        Json{{"name", surface.name}, {"primitives", primitives}, {"weights", Floats(surface.displacements.size(), 0)}});
  }
  for (const Obstacle& obstacle : obstacles_) {
    const RenderMesh& surface = *obstacle.of.surface;
    Json primitive = {{"mode", kTriangles}, {"material", 1}, {"indices", buffers.add_indices(surface.indices)}};
    primitive["attributes"] = {{"POSITION", buffers.add_vectors(surface.positions, kVertices)},
                               {"NORMAL", buffers.add_vectors(surface.normals, kVertices)}};
    if (obstacle.of.moves) animate(buffers, nodes.size(), times, obstacle.places, obstacle.turns, samplers, channels);
    in_world.push_back(nodes.size());
    nodes.push_back({{"name", obstacle.of.name},
                     {"mesh", meshes.size()},
                     {"translation", Floats(obstacle.places.begin(), obstacle.places.begin() + 3)},
                     {"rotation", Floats(obstacle.turns.begin(), obstacle.turns.begin() + 4)}});
    meshes.push_back(Json{{"name", obstacle.of.name}, {"primitives", Json::array({primitive})}});
  }
  if (!alone) nodes[0]["children"] = in_world;

  const auto list = [](Json only) { return Json::array({std::move(only)}); };
  const auto material = [](const char* name, std::array<double, 4> colour, bool double_sided) {
    return Json{
        {"name", name},
        {"doubleSided", double_sided},
        {"pbrMetallicRoughness", {{"baseColorFactor", colour}, {"metallicFactor", 0}, {"roughnessFactor", 0.45}}}};
  };
  Json document;
  document["asset"] = {{"version", "2.0"}, {"generator", "palpate-run " PALPATE_VERSION}};
  document["scene"] = 0;
  document["scenes"] = list({{"nodes", list(0)}});
  document["nodes"] = nodes;
  document["meshes"] = meshes;
  document["materials"] = list(material("tissue", {0.32, 0.07, 0.06, 1}, false));
  if (!obstacles_.empty()) document["materials"].push_back(material("obstacle", {0.55, 0.58, 0.62, 1}, true));
  if (std::ranges::any_of(surfaces_, &Surface::lips))
    document["materials"].push_back(material("lip", {0.62, 0.20, 0.17, 1}, false));
  document["animations"] = list({{"name", scene_.name}, {"samplers", samplers}, {"channels", channels}});
  document["accessors"] = buffers.accessors;
  document["bufferViews"] = buffers.views;
  document["buffers"] = list({{"byteLength", (buffers.bytes.size() + 3) / 4 * 4}});
  write_text_atomically(target_, binary_file(document, buffers.bytes));
}

}  // namespace palpate
