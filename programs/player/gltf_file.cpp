#include "programs/player/gltf_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

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

GltfFile::GltfFile(std::filesystem::path target, const Player& player, std::uint64_t shapes)
    : target_(std::move(target)), player_(player) {
  check_target(target_);
  if (player.scene().shape == SceneConfig::Shape::off)
    throw InputError(fmt::format("{}: effects.shape: expected surface or volume for --export, found off",
                                 player.scene().file.string()));
  if (shapes > kMostShapes)
    throw InputError(fmt::format("{}: expected at most {} shapes, found {}; write fewer with --every {}",
                                 target_.string(), kMostShapes, shapes, (shapes + kMostShapes - 1) / kMostShapes));
  if (const RenderMesh* mesh = player.render_mesh()) {
    indices_ = mesh->indices, rest_ = mesh->positions, rest_normals_ = mesh->normals;
    return;
  }
  const palpate_bundle_info info = palpate_bundle_describe(player.bundle());
  const std::int32_t* triangles = palpate_bundle_triangles(player.bundle());
  indices_.assign(triangles, triangles + 3 * static_cast<std::size_t>(info.triangle_count));
}

void GltfFile::add(const ShapeRecord& shape) {
  times_.push_back(static_cast<float>(shape.time));
  if (player_.render_mesh()) {
    displacements_.push_back(difference({shape.skin_positions, shape.skin_positions + rest_.size()}, rest_));
    normal_change_.push_back(difference({shape.skin_normals, shape.skin_normals + rest_.size()}, rest_normals_));
    return;
  }
  const std::size_t numbers =
      3 * static_cast<std::size_t>(palpate_bundle_describe(player_.bundle()).surface_node_count);
  const Floats positions(shape.positions, shape.positions + numbers);
  displacements_.emplace_back(shape.displacements, shape.displacements + numbers);
  if (rest_.empty()) {
    rest_ = difference(positions, displacements_.back());
    rest_normals_ = smooth_normals(rest_, indices_);
  }
  normal_change_.push_back(difference(smooth_normals(positions, indices_), rest_normals_));
}

void GltfFile::write() const {
  Buffers buffers;
  Json primitive = {{"mode", kTriangles}, {"material", 0}, {"indices", buffers.add_indices(indices_)}};
  primitive["attributes"] = {{"POSITION", buffers.add_vectors(rest_, kVertices)},
                             {"NORMAL", buffers.add_vectors(rest_normals_, kVertices)}};
  for (std::size_t i = 0; i < times_.size(); ++i)
    primitive["targets"].push_back(Json{{"POSITION", buffers.add_vectors(displacements_[i], kVertices)},
                                        {"NORMAL", buffers.add_vectors(normal_change_[i], kVertices)}});
  const int times = buffers.add_scalars(times_), weights = buffers.add_scalars(one_at_a_time(times_.size()));

  const auto list = [](Json only) { return Json::array({std::move(only)}); };
  const std::string& name = player_.scene().name;
  const double half = std::sqrt(0.5);  // a quarter turn about x
  const Json surface = {{"baseColorFactor", {0.32, 0.07, 0.06, 1}}, {"metallicFactor", 0}, {"roughnessFactor", 0.45}};
  const Json sampler = {{"input", times}, {"output", weights}, {"interpolation", "LINEAR"}};
  const Json channel = {{"sampler", 0}, {"target", {{"node", 0}, {"path", "weights"}}}};
  Json document;
  document["asset"] = {{"version", "2.0"}, {"generator", "palpate-run " PALPATE_VERSION}};
  document["scene"] = 0;
  document["scenes"] = list({{"nodes", list(0)}});
  document["nodes"] = list({{"name", name}, {"mesh", 0}, {"rotation", {-half, 0, 0, half}}});
  document["meshes"] = list({{"name", name}, {"primitives", list(primitive)}, {"weights", Floats(times_.size(), 0)}});
  document["materials"] = list({{"name", "tissue"}, {"pbrMetallicRoughness", surface}});
  document["animations"] = list({{"name", name}, {"samplers", list(sampler)}, {"channels", list(channel)}});
  document["accessors"] = buffers.accessors;
  document["bufferViews"] = buffers.views;
  document["buffers"] = list({{"byteLength", (buffers.bytes.size() + 3) / 4 * 4}});
  write_text_atomically(target_, binary_file(document, buffers.bytes));
}

}  // namespace palpate
