// A game engine's calling pattern, compiled without exceptions. The game thread runs fixed updates from an accumulator; the render
// thread draws at a rate of its own, between the last two shapes of a render mesh. Contacts pass through a mailbox.
#include <palpate/palpate.h>
#include <palpate/palpate_mailbox.h>
#include <palpate/palpate_skin.h>
#include <palpate/palpate.hpp>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <thread>
#include <vector>

namespace {

constexpr double kFixedStep = 0.005;  // s: 200 fixed updates a second
constexpr double kPressEnds = 0.5;    // s

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

struct Mesh {
  std::vector<float> positions, normals;  // [count()][3]
  std::int32_t count() const { return static_cast<std::int32_t>(positions.size() / 3); }
};

struct alignas(64) CacheLine {
  unsigned char bytes[64];
};

class Organ {
 public:
  // While a level loads. False: *error says why.
  bool load(const char* path, palpate_error* error) {
    bundle_ = palpate::Bundle::open_file(path, error);
    if (!bundle_) return false;
    at_rest_ = mesh_asset();
    palpate_render_mesh render_mesh = palpate_default_render_mesh();
    render_mesh.positions = at_rest_.positions.data(), render_mesh.normals = at_rest_.normals.data();
    render_mesh.vertex_count = at_rest_.count();
    palpate::SceneDef def;
    def.collision = PALPATE_COLLISION_DEFORMED, def.render_mesh = render_mesh;
    scene_ = palpate::Scene::create(bundle_, def, error);
    if (!scene_) return false;
    contacts_bytes_ = palpate_contacts_bytes(scene_.get());
    memory_.resize(palpate_mailbox_bytes(contacts_bytes_) / 64 + 1);
    mailbox_ = palpate_mailbox_create(memory_.data(), contacts_bytes_);
    displacements_.resize(3 * static_cast<std::size_t>(bundle_.describe().surface_node_count));
    before_ = after_ = at_rest_;
    aim();
    return true;
  }

  // FixedUpdate, on the game thread: moves the tool and touches. time: s, at the end of this step.
  double fixed_update(double time) {
    double point[3];  // here: 10 mm down within the press; in a game: the controller
    for (int d = 0; d < 3; ++d) point[d] = start_[d] + inward_[d] * 0.01 * std::min(1.0, time / kPressEnds);
    palpate_tool tool = palpate_default_tool();
    tool.points = point, tool.point_count = 1, tool.disc_radius = 0.003;
    palpate_contacts* contacts = palpate_mailbox_slot(mailbox_);
    palpate_scene_touch(scene_.get(), &tool, 1, kFixedStep, contacts, contacts_bytes_);
    const double* force = palpate_contacts_tool(contacts, 0)->force;  // here: for a rumble, or the sound of a touch
    const double size = std::sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2]);
    palpate_mailbox_publish(mailbox_);
    return size;
  }

  // Update, on the render thread: *out is the mesh at `time`, s. It lies between the last two shapes, so draw one fixed step in the
  // past. contacts->step counts the fixed updates and so tells the time of a shape, also where some were dropped.
  void draw(double time, Mesh* out) {
    std::int32_t fresh = 0;
    const palpate_contacts* contacts = palpate_mailbox_newest(mailbox_, &fresh);
    if (fresh) {
      std::swap(before_, after_), before_time_ = after_time_;
      palpate_shape_out shape = palpate_default_shape_out();
      shape.displacements = displacements_.data(), shape.node_capacity = bundle_.describe().surface_node_count;
      palpate_skin_out skin = palpate_default_skin_out();
      skin.positions = after_.positions.data(), skin.normals = after_.normals.data(),
      skin.vertex_capacity = after_.count();
      palpate_scene_shape(scene_.get(), contacts, &shape);
      scene_.skin(shape, skin);
      after_time_ = static_cast<double>(contacts->step) * kFixedStep;
    }
    const double span = after_time_ - before_time_, part = span > 0 ? (time - before_time_) / span : 1;
    const auto alpha = static_cast<float>(std::clamp(part, 0.0, 1.0));
    for (std::size_t i = 0; i < out->positions.size(); i += 3) {
      float length = 0;
      for (std::size_t d = i; d < i + 3; ++d) {
        out->positions[d] = before_.positions[d] + alpha * (after_.positions[d] - before_.positions[d]);
        out->normals[d] = before_.normals[d] + alpha * (after_.normals[d] - before_.normals[d]);
        length += out->normals[d] * out->normals[d];
      }
      for (std::size_t d = i; d < i + 3; ++d) out->normals[d] /= std::sqrt(std::max(length, 1e-12f));
    }
  }

  const Mesh& at_rest() const { return at_rest_; }

 private:
  // In a game: the artist's mesh of the organ. Here: three vertices for each triangle of the surface, with the triangle's normal.
  Mesh mesh_asset() const {
    Mesh mesh;
    const std::int32_t* t = bundle_.triangles();
    for (std::int32_t i = 0; i < bundle_.describe().triangle_count; ++i, t += 3) {
      const double *a = bundle_.nodes() + 3 * t[0], *b = bundle_.nodes() + 3 * t[1], *c = bundle_.nodes() + 3 * t[2];
      float n[3];
      for (int d = 0, e = 1, f = 2; d < 3; e = f, f = d++)
        n[d] = static_cast<float>((b[e] - a[e]) * (c[f] - a[f]) - (b[f] - a[f]) * (c[e] - a[e]));
      const float length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
      for (const double* vertex : {a, b, c})
        for (int d = 0; d < 3; ++d)
          mesh.positions.push_back(static_cast<float>(vertex[d])), mesh.normals.push_back(n[d] / length);
    }
    return mesh;
  }
  // The tool starts 2 mm above the middle of a triangle that can be touched.
  void aim() {
    const std::int32_t node = bundle_.touchable()[bundle_.describe().touchable_count / 2], *t = bundle_.triangles();
    std::size_t i = 0;  // of the triangle's first coordinate in the mesh
    for (; t[0] != node && t[1] != node && t[2] != node; t += 3) i += 9;
    const float *p = &at_rest_.positions[i], *n = &at_rest_.normals[i];
    for (int d = 0; d < 3; ++d) start_[d] = (p[d] + p[3 + d] + p[6 + d]) / 3 + 0.002 * n[d], inward_[d] = -n[d];
  }

  palpate::Bundle bundle_;
  palpate::Scene scene_;  // after the bundle, so that it goes first
  std::size_t contacts_bytes_ = 0;
  std::vector<CacheLine> memory_;
  palpate_mailbox* mailbox_ = nullptr;
  std::vector<float> displacements_;
  Mesh at_rest_, before_, after_;  // the drawn shape lies between the last two
  double before_time_ = 0, after_time_ = 0, start_[3] = {}, inward_[3] = {};
};

}  // namespace

int main(int argc, char** argv) {
  Organ organ;
  palpate_error error = {PALPATE_OK, 0, "usage: game_loop BUNDLE.h5"};
  if (argc != 2 || !organ.load(argv[1], &error)) return std::fprintf(stderr, "%s\n", error.text), 2;

  const auto start = std::chrono::steady_clock::now();
  std::atomic<bool> running{true};
  double largest_force = 0;
  long updates = 0;
  std::thread game([&] {
    double accumulator = 0, last = seconds_since(start);
    while (static_cast<double>(updates) * kFixedStep < kPressEnds) {
      const double now = seconds_since(start);
      accumulator += std::min(now - last, 0.1),
          last = now;  // after a pause the game falls behind and does not catch up
      for (; accumulator >= kFixedStep; accumulator -= kFixedStep)
        largest_force = std::max(largest_force, organ.fixed_update(static_cast<double>(++updates) * kFixedStep));
      std::this_thread::sleep_for(std::chrono::milliseconds(7));  // the rest of the game
    }
    running = false;
  });

  Mesh drawn = organ.at_rest();
  long frames = 0;
  for (; running; ++frames) {
    organ.draw(seconds_since(start) - kFixedStep, &drawn);  // then hand `drawn` to the renderer
    std::this_thread::sleep_for(std::chrono::milliseconds(16));
  }
  game.join();
  organ.draw(INFINITY, &drawn);  // the last shape itself

  float farthest = 0;
  for (std::size_t i = 0; i < drawn.positions.size(); ++i)
    farthest = std::max(farthest, std::fabs(drawn.positions[i] - organ.at_rest().positions[i]));
  std::printf("%ld updates, %ld frames, largest force %.4f N, a vertex moved by %.4f mm\n", updates, frames,
              largest_force, 1000 * static_cast<double>(farthest));
  return frames > 0 && largest_force > 0 && farthest > 0 ? 0 : 1;
}
