// palpate.hpp - palpate.h for C++17: owners that release what they own, and errors that can be thrown.
//
// The constructors throw palpate::Error. open_file, open and create return an empty owner and fill *error instead. Where a host is
// compiled without exceptions (-fno-exceptions), Error and the constructors that throw it do not exist, so that code which needs
// them does not compile. A step never throws, allocates or locks. palpate.h documents everything else.
#pragma once

#include <palpate/palpate.h>
#include <palpate/palpate_tool_shape.h>
#include <palpate/palpate_world.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>
#ifdef __cpp_exceptions
#include <stdexcept>
#endif

namespace palpate {

#ifdef __cpp_exceptions
struct Error : std::runtime_error {
  explicit Error(const palpate_error& from) : std::runtime_error(from.text), detail(from) {}
  palpate_error detail;
};
#endif

// A tensor bundle. It is constant, so threads may share it. It must outlive its scenes.
class Bundle {
 public:
  Bundle() = default;
  // An empty Bundle and *error where it fails.
  static Bundle open_file(const char* path, palpate_error* error,
                          const palpate_bundle_options* options = nullptr) noexcept {
    palpate_bundle* opened = nullptr;
    palpate_bundle_open_file(path, options, &opened, error);
    return Bundle(opened);
  }
  // bytes: 64-byte aligned, borrowed, must outlive the bundle.
  static Bundle open(const void* bytes, std::size_t count, palpate_error* error,
                     const palpate_bundle_options* options = nullptr) noexcept {
    palpate_bundle* opened = nullptr;
    palpate_bundle_open(bytes, count, options, &opened, error);
    return Bundle(opened);
  }

  explicit operator bool() const noexcept { return handle_ != nullptr; }
  palpate_bundle* get() const noexcept { return handle_.get(); }
  palpate_bundle_info describe() const noexcept { return palpate_bundle_describe(get()); }
  const double* nodes() const noexcept { return palpate_bundle_nodes(get()); }                  // [N][3] m
  const std::int32_t* triangles() const noexcept { return palpate_bundle_triangles(get()); }    // [F][3]
  const std::int32_t* tetrahedra() const noexcept { return palpate_bundle_tetrahedra(get()); }  // [E][4]
  const std::int32_t* touchable() const noexcept { return palpate_bundle_touchable(get()); }    // [S]
  const std::uint8_t* fixed() const noexcept { return palpate_bundle_fixed(get()); }            // [N][3]
  std::string_view provenance() const noexcept {
    std::size_t count = 0;
    const char* text = palpate_bundle_provenance(get(), &count);
    return {text ? text : "", count};
  }

 private:
  struct Close {
    void operator()(palpate_bundle* bundle) const noexcept { palpate_bundle_close(bundle); }
  };
  explicit Bundle(palpate_bundle* opened) noexcept : handle_(opened) {}
  std::unique_ptr<palpate_bundle, Close> handle_;

#ifdef __cpp_exceptions
 public:
  // open_file and open; they throw Error where it fails.
  explicit Bundle(const char* path, const palpate_bundle_options* options = nullptr);
  Bundle(const void* bytes, std::size_t count, const palpate_bundle_options* options = nullptr);
#endif
};

// Room for the palpate_contacts of one scene, which touch fills and shape reads: plain bytes, of which used_bytes are in use.
class Contacts {
 public:
  explicit Contacts(std::size_t bytes) : words_(bytes / 8 + 1) {}
  palpate_contacts* get() noexcept { return reinterpret_cast<palpate_contacts*>(words_.data()); }
  const palpate_contacts* get() const noexcept { return reinterpret_cast<const palpate_contacts*>(words_.data()); }
  const palpate_contacts* operator->() const noexcept { return get(); }
  std::size_t bytes() const noexcept { return words_.size() * sizeof(std::uint64_t); }
  // t: 0 .. tool_count - 1
  const palpate_tool_state& tool(std::int32_t t) const noexcept { return *palpate_contacts_tool(get(), t); }
  // n: 0 .. node_count - 1
  const palpate_contact_node& node(std::int32_t n) const noexcept { return *palpate_contacts_node(get(), n); }

 private:
  std::vector<std::uint64_t> words_;
};

// A saved state of a scene, as bytes. Empty until Scene::save fills it.
class State {
 public:
  State() = default;
  explicit State(std::size_t bytes) : words_((bytes + 7) / 8), bytes_(bytes) {}
  void* get() noexcept { return words_.data(); }
  const void* get() const noexcept { return words_.data(); }
  std::size_t bytes() const noexcept { return bytes_; }

 private:
  std::vector<std::uint64_t> words_;
  std::size_t bytes_ = 0;
};

// One organ under one set of effects. touch and reset belong to one thread, shape and skin to one thread, which may be another.
class Scene {
 public:
  Scene() = default;
  // An empty Scene and *error where it fails.
  static Scene create(const Bundle& bundle, const palpate_scene_def& def, palpate_error* error) noexcept {
    palpate_scene* created = nullptr;
    palpate_scene_create(bundle.get(), &def, &created, error);
    return Scene(created);
  }

  explicit operator bool() const noexcept { return handle_ != nullptr; }
  palpate_scene* get() const noexcept { return handle_.get(); }
  Contacts make_contacts() const { return Contacts(palpate_contacts_bytes(get())); }

  palpate_step_flags touch(const palpate_tool* tools, std::int32_t count, double dt, Contacts& contacts) noexcept {
    return palpate_scene_touch(get(), tools, count, dt, contacts.get(), contacts.bytes());
  }
  // In a thread of its own, beside those of touch and shape.
  std::int32_t deform() noexcept { return palpate_scene_deform(get()); }
  palpate_step_flags shape(const Contacts& contacts, palpate_shape_out& out) noexcept {
    return palpate_scene_shape(get(), contacts.get(), &out);
  }
  palpate_step_flags skin(const palpate_shape_out& shape, palpate_skin_out& out) noexcept {
    return palpate_scene_skin(get(), &shape, &out);
  }
  // shape: with positions. normals: [capacity][3]
  palpate_step_flags normals(const palpate_shape_out& shape, float* normals, std::int32_t capacity) noexcept {
    return palpate_scene_normals(get(), &shape, normals, capacity);
  }

  // The queries, for scenes with queries ON. They belong to one thread at a time, whichever touch and shape run in.
  // contacts: nullptr for the surface at rest. Without a hit, hit is 0.
  palpate_surface_hit cast_ray(const palpate_contacts* contacts, const double (&origin)[3],
                               const double (&direction)[3], double longest,
                               palpate_step_flags* flags = nullptr) noexcept {
    palpate_surface_hit hit = palpate_default_surface_hit();
    const palpate_step_flags raised = palpate_scene_cast_ray(get(), contacts, origin, direction, longest, &hit);
    if (flags) *flags = raised;
    return hit;
  }
  palpate_surface_hit closest_point(const palpate_contacts* contacts, const double (&point)[3], double farthest,
                                    palpate_step_flags* flags = nullptr) noexcept {
    palpate_surface_hit hit = palpate_default_surface_hit();
    const palpate_step_flags raised = palpate_scene_closest_point(get(), contacts, point, farthest, &hit);
    if (flags) *flags = raised;
    return hit;
  }
  double signed_distance(const palpate_contacts* contacts, const double (&point)[3],
                         palpate_step_flags* flags = nullptr) noexcept {
    double distance = 0;
    const palpate_step_flags raised = palpate_scene_signed_distance(get(), contacts, point, &distance);
    if (flags) *flags = raised;
    return distance;
  }

  // False, with *error filled, where the pose is refused.
  bool set_pose(const palpate_pose& pose, palpate_error* error = nullptr) noexcept {
    return palpate_scene_set_pose(get(), &pose, error) == PALPATE_OK;
  }
  // PALPATE_OK, or the reason and *error, which may be NULL; the scene then keeps its links.
  palpate_status set_links(const palpate_link* links, std::int32_t count, palpate_error* error = nullptr) noexcept {
    return palpate_scene_set_links(get(), links, count, error);
  }
  // The same of the motions, and of a pressure whose volume is held. The state: of the last touch, nullptr behind the last motion.
  palpate_status set_motions(const double* amounts, std::int32_t count, palpate_error* error = nullptr) noexcept {
    return palpate_scene_set_motions(get(), amounts, count, error);
  }
  palpate_status hold_volume(std::int32_t motion, bool holds, double volume, palpate_error* error = nullptr) noexcept {
    return palpate_scene_hold_volume(get(), motion, holds ? 1 : 0, volume, error);
  }
  const palpate_motion_state* motion_state(std::int32_t motion) const noexcept {
    return palpate_scene_motion_state(get(), motion);
  }
  // Of the last touch; nullptr behind the last link, and where no tool has that id or may grasp.
  const palpate_link_state* link_state(std::int32_t link) const noexcept {
    return palpate_scene_link_state(get(), link);
  }
  const palpate_grasp_state* grasp_state(std::int32_t id) const noexcept {
    return palpate_scene_grasp_state(get(), id);
  }
  void reset() noexcept { palpate_scene_reset(get()); }
  void reset_tool(std::int32_t id) noexcept { palpate_scene_reset_tool(get(), id); }

  // Returns PALPATE_OK, or the reason and *error, which may be NULL. Takes memory where the state has fewer bytes than it needs.
  palpate_status save(State& state, palpate_error* error = nullptr) const {
    const std::size_t bytes = palpate_scene_state_bytes(get());
    if (state.bytes() != bytes) state = State(bytes);
    return palpate_scene_save(get(), state.get(), state.bytes(), error);
  }
  // The same; a state that is refused leaves the scene as it was.
  palpate_status restore(const State& state, palpate_error* error = nullptr) noexcept {
    return palpate_scene_restore(get(), state.get(), state.bytes(), error);
  }

 private:
  struct Destroy {
    void operator()(palpate_scene* scene) const noexcept { palpate_scene_destroy(scene); }
  };
  explicit Scene(palpate_scene* created) noexcept : handle_(created) {}
  std::unique_ptr<palpate_scene, Destroy> handle_;

#ifdef __cpp_exceptions
 public:
  // create; it throws Error where it fails.
  explicit Scene(const Bundle& bundle, const palpate_scene_def& def = palpate_default_scene_def());
#endif
};

// Room for the palpate_world_contacts of one world.
class WorldContacts {
 public:
  explicit WorldContacts(std::size_t bytes) : words_(bytes / 8 + 1) {}
  palpate_world_contacts* get() noexcept { return reinterpret_cast<palpate_world_contacts*>(words_.data()); }
  const palpate_world_contacts* get() const noexcept {
    return reinterpret_cast<const palpate_world_contacts*>(words_.data());
  }
  const palpate_world_contacts* operator->() const noexcept { return get(); }
  std::size_t bytes() const noexcept { return words_.size() * sizeof(std::uint64_t); }
  // t: 0 .. tool_count - 1
  const palpate_world_tool_state& tool(std::int32_t t) const noexcept { return *palpate_world_contacts_tool(get(), t); }
  // k: 0 .. organ_count - 1
  const palpate_world_organ_state& state(std::int32_t k) const noexcept {
    return *palpate_world_contacts_state(get(), k);
  }
  const palpate_contacts& organ(std::int32_t k) const noexcept { return *palpate_world_contacts_organ(get(), k); }
  // p: 0 .. pair_count - 1
  const palpate_world_pair& pair(std::int32_t p) const noexcept { return *palpate_world_contacts_pair(get(), p); }

 private:
  std::vector<std::uint64_t> words_;
};

// Several organs and the tools that touch them (palpate_world.h).
class World {
 public:
  World() = default;
  // An empty World and *error where it fails.
  static World create(const palpate_world_def& def, palpate_error* error) noexcept {
    palpate_world* created = nullptr;
    palpate_world_create(&def, &created, error);
    return World(created);
  }

  explicit operator bool() const noexcept { return handle_ != nullptr; }
  palpate_world* get() const noexcept { return handle_.get(); }
  std::int32_t organ_count() const noexcept { return palpate_world_organ_count(get()); }
  // The scene of an organ, for the functions of palpate.h; nullptr behind the last one.
  palpate_scene* scene(std::int32_t organ) const noexcept { return palpate_world_scene(get(), organ); }
  WorldContacts make_contacts() const { return WorldContacts(palpate_world_contacts_bytes(get())); }

  palpate_step_flags touch(const palpate_tool* tools, std::int32_t count, double dt, WorldContacts& contacts) noexcept {
    return palpate_world_touch(get(), tools, count, dt, contacts.get(), contacts.bytes());
  }
  palpate_step_flags shape(std::int32_t organ, const WorldContacts& contacts, palpate_shape_out& out) noexcept {
    return palpate_scene_shape(scene(organ), &contacts.organ(organ), &out);
  }
  // False, with *error filled, where the pose is refused.
  bool set_pose(std::int32_t organ, const palpate_pose& pose, palpate_error* error = nullptr) noexcept {
    return palpate_scene_set_pose(scene(organ), &pose, error) == PALPATE_OK;
  }
  void reset() noexcept { palpate_world_reset(get()); }
  void reset_tool(std::int32_t id) noexcept { palpate_world_reset_tool(get(), id); }

  // As those of Scene.
  palpate_status save(State& state, palpate_error* error = nullptr) const {
    const std::size_t bytes = palpate_world_state_bytes(get());
    if (state.bytes() != bytes) state = State(bytes);
    return palpate_world_save(get(), state.get(), state.bytes(), error);
  }
  palpate_status restore(const State& state, palpate_error* error = nullptr) noexcept {
    return palpate_world_restore(get(), state.get(), state.bytes(), error);
  }

 private:
  struct Destroy {
    void operator()(palpate_world* world) const noexcept { palpate_world_destroy(world); }
  };
  explicit World(palpate_world* created) noexcept : handle_(created) {}
  std::unique_ptr<palpate_world, Destroy> handle_;

#ifdef __cpp_exceptions
 public:
  // create; it throws Error where it fails.
  explicit World(const palpate_world_def& def) {
    palpate_error error = {};
    *this = create(def, &error);
    if (!handle_) throw Error(error);
  }
#endif
};

// A rigid instrument as tool points (palpate_tool_shape.h).
class ToolShape {
 public:
  ToolShape() = default;
  // An empty ToolShape and *error where it fails.
  static ToolShape create(const palpate_tool_shape_def& def, palpate_error* error) noexcept {
    palpate_tool_shape* created = nullptr;
    palpate_tool_shape_create(&def, &created, error);
    return ToolShape(created);
  }

  explicit operator bool() const noexcept { return handle_ != nullptr; }
  palpate_tool_shape* get() const noexcept { return handle_.get(); }
  std::int32_t point_count() const noexcept { return palpate_tool_shape_point_count(get()); }
  void place(const double (&position)[3], const double (&orientation)[4], palpate_tool& tool) noexcept {
    palpate_tool_shape_place(get(), position, orientation, &tool);
  }

 private:
  struct Destroy {
    void operator()(palpate_tool_shape* shape) const noexcept { palpate_tool_shape_destroy(shape); }
  };
  explicit ToolShape(palpate_tool_shape* created) noexcept : handle_(created) {}
  std::unique_ptr<palpate_tool_shape, Destroy> handle_;

#ifdef __cpp_exceptions
 public:
  // create; it throws Error where it fails.
  explicit ToolShape(const palpate_tool_shape_def& def) {
    palpate_error error = {};
    *this = create(def, &error);
    if (!handle_) throw Error(error);
  }
#endif
};

#ifdef __cpp_exceptions
inline Bundle::Bundle(const char* path, const palpate_bundle_options* options) {
  palpate_error error = {};
  *this = open_file(path, &error, options);
  if (!handle_) throw Error(error);
}
inline Bundle::Bundle(const void* bytes, std::size_t count, const palpate_bundle_options* options) {
  palpate_error error = {};
  *this = open(bytes, count, &error, options);
  if (!handle_) throw Error(error);
}
inline Scene::Scene(const Bundle& bundle, const palpate_scene_def& def) {
  palpate_error error = {};
  *this = create(bundle, def, &error);
  if (!handle_) throw Error(error);
}
#endif

}  // namespace palpate
