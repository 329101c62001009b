// palpate.hpp - palpate.h for C++17: owners that release what they own, and errors that can be thrown.
//
// The constructors throw palpate::Error. open_file, open and create return an empty owner and fill *error instead. Where a host is
// compiled without exceptions (-fno-exceptions), Error and the constructors that throw it do not exist, so that code which needs
// them does not compile. A step never throws, allocates or locks. palpate.h documents everything else.
#pragma once

#include <palpate/palpate_complete.h>
#include <palpate/palpate_scene_def.hpp>

#include <cstddef>
#include <cstdint>
#include <iterator>
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

// A view of elements that lie behind one another, `stride` bytes apart: a later library may write longer ones.
template <class Element>
class Elements {
 public:
  class Iterator {
   public:
    using iterator_category = std::forward_iterator_tag;
    using value_type = Element;
    using difference_type = std::ptrdiff_t;
    using pointer = const Element*;
    using reference = const Element&;

    Iterator() = default;
    Iterator(const void* at, std::size_t stride) noexcept : at_(static_cast<const char*>(at)), stride_(stride) {}
    reference operator*() const noexcept { return *static_cast<pointer>(static_cast<const void*>(at_)); }
    pointer operator->() const noexcept { return &**this; }
    Iterator& operator++() noexcept {
      at_ += stride_;
      return *this;
    }
    Iterator operator++(int) noexcept {
      const Iterator before = *this;
      ++*this;
      return before;
    }
    friend bool operator==(const Iterator& a, const Iterator& b) noexcept { return a.at_ == b.at_; }
    friend bool operator!=(const Iterator& a, const Iterator& b) noexcept { return a.at_ != b.at_; }

   private:
    const char* at_ = nullptr;
    std::size_t stride_ = 0;
  };

  Elements() = default;
  Elements(const void* first, std::int32_t count, std::size_t stride) noexcept
      : first_(static_cast<const char*>(first)), count_(count), stride_(stride) {}
  std::int32_t size() const noexcept { return count_; }
  bool empty() const noexcept { return count_ == 0; }
  // i: 0 .. size() - 1
  const Element& operator[](std::int32_t i) const noexcept { return *Iterator(at(i), stride_); }
  Iterator begin() const noexcept { return Iterator(first_, stride_); }
  Iterator end() const noexcept { return Iterator(at(count_), stride_); }

 private:
  const char* at(std::int32_t i) const noexcept {
    return i == 0 ? first_ : first_ + static_cast<std::size_t>(i) * stride_;
  }
  const char* first_ = nullptr;
  std::int32_t count_ = 0;
  std::size_t stride_ = 0;
};

// A view of a scene's report, valid until its next touch step, or of a host's copy of used_bytes of it. An empty one has no contacts and no
// events.
class Report {
 public:
  Report() = default;
  explicit Report(const palpate_contact_report* report) noexcept : report_(report) {}
  explicit operator bool() const noexcept { return report_ != nullptr; }
  const palpate_contact_report* get() const noexcept { return report_; }
  const palpate_contact_report* operator->() const noexcept { return report_; }
  Elements<palpate_contact> contacts() const noexcept {
    if (!report_) return {};
    return {palpate_report_contact(report_, 0), report_->contact_count, report_->contact_bytes};
  }
  Elements<palpate_contact_event> events() const noexcept {
    if (!report_) return {};
    return {palpate_report_event(report_, 0), report_->event_count, report_->event_bytes};
  }

 private:
  const palpate_contact_report* report_ = nullptr;
};

// A view of the passes of a scene's plan, valid until the scene is destroyed.
class PlanPasses {
 public:
  class Iterator {
   public:
    using iterator_category = std::forward_iterator_tag;
    using value_type = palpate_plan_pass;
    using difference_type = std::ptrdiff_t;
    using pointer = const palpate_plan_pass*;
    using reference = const palpate_plan_pass&;

    Iterator() = default;
    Iterator(const palpate_scene* scene, std::int32_t pass) noexcept : scene_(scene), pass_(pass) {}
    reference operator*() const noexcept { return *palpate_scene_plan(scene_, pass_); }
    pointer operator->() const noexcept { return palpate_scene_plan(scene_, pass_); }
    Iterator& operator++() noexcept {
      ++pass_;
      return *this;
    }
    Iterator operator++(int) noexcept { return Iterator(scene_, pass_++); }
    friend bool operator==(const Iterator& a, const Iterator& b) noexcept { return a.pass_ == b.pass_; }
    friend bool operator!=(const Iterator& a, const Iterator& b) noexcept { return a.pass_ != b.pass_; }

   private:
    const palpate_scene* scene_ = nullptr;
    std::int32_t pass_ = 0;
  };

  PlanPasses() = default;
  explicit PlanPasses(const palpate_scene* scene) noexcept : scene_(scene) {
    while (palpate_scene_plan(scene, count_)) ++count_;
  }
  std::int32_t size() const noexcept { return count_; }
  // pass: 0 .. size() - 1
  const palpate_plan_pass& operator[](std::int32_t pass) const noexcept { return *Iterator(scene_, pass); }
  Iterator begin() const noexcept { return Iterator(scene_, 0); }
  Iterator end() const noexcept { return Iterator(scene_, count_); }

 private:
  const palpate_scene* scene_ = nullptr;
  std::int32_t count_ = 0;
};

// Counted operations that this machine does in that time, for max_operations; 0 where it cannot be measured.
inline std::int64_t operations_in(double microseconds) noexcept {
  return palpate_operations_in(microseconds);
}

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

  PlanPasses plan() const noexcept { return PlanPasses(get()); }
  std::int64_t most_operations() const noexcept { return palpate_scene_most_operations(get()); }
  // pass: its index in the plan
  palpate_pass_work predict_pass(std::int32_t pass, const palpate_step_load& load) const noexcept {
    return palpate_predict_pass(get(), pass, &load);
  }
  // nullptr: nobody watches.
  void watch_passes(palpate_pass_watcher watcher, void* user = nullptr) noexcept {
    palpate_watch_passes(get(), watcher, user);
  }

  palpate_step_flags touch(const palpate_tool* tools, std::int32_t count, double dt, Contacts& contacts) noexcept {
    return palpate_scene_touch(get(), tools, count, dt, contacts.get(), contacts.bytes());
  }
  // Contacts and events of the last touch step, to be read before the next one; empty for a scene without a report.
  Report report() const noexcept { return Report(palpate_scene_report(get())); }
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

  // For scenes with inside ON. points: [count][3] m on the shape as it was meshed; places: [count]. Any thread may call it. Returns how many
  // points have no tetrahedron within `farthest` metres, or -1.
  std::int32_t locate(const double* points, std::int32_t count, double farthest,
                      palpate_inside_place* places) const noexcept {
    return palpate_scene_locate(get(), points, count, farthest, places);
  }
  // shape: with displacements of all nodes. out: of the nodes, or nullptr.
  palpate_step_flags inside(const palpate_shape_out& shape, palpate_inside_out* out) noexcept {
    return palpate_scene_inside(get(), &shape, out);
  }
  palpate_step_flags inside_at(const palpate_inside_place* places, std::int32_t count,
                               palpate_inside_out& out) noexcept {
    return palpate_scene_inside_at(get(), places, count, &out);
  }
  // shape: with positions of all nodes. positions: [count][3]
  palpate_step_flags carry(const palpate_shape_out& shape, const palpate_inside_place* places, std::int32_t count,
                           float* positions) noexcept {
    return palpate_scene_carry(get(), &shape, places, count, positions);
  }

  // For scenes with crossings ON. shape: with positions. out: where they are, or nullptr.
  palpate_step_flags crossings(const palpate_shape_out& shape, palpate_crossings_out* out) noexcept {
    return palpate_scene_crossings(get(), &shape, out);
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
  // As that of Scene, of one organ.
  Report report(std::int32_t organ) const noexcept { return Report(palpate_scene_report(scene(organ))); }
  palpate_step_flags shape(std::int32_t organ, const WorldContacts& contacts, palpate_shape_out& out) noexcept {
    return palpate_scene_shape(scene(organ), &contacts.organ(organ), &out);
  }
  // False, with *error filled, where the pose is refused.
  bool set_pose(std::int32_t organ, const palpate_pose& pose, palpate_error* error = nullptr) noexcept {
    return palpate_scene_set_pose(scene(organ), &pose, error) == PALPATE_OK;
  }
  // pass: its index in palpate_world_plan
  palpate_pass_work predict_pass(std::int32_t pass, const palpate_step_load& load) const noexcept {
    return palpate_world_predict_pass(get(), pass, &load);
  }
  // nullptr: nobody watches.
  void watch_passes(palpate_pass_watcher watcher, void* user = nullptr) noexcept {
    palpate_world_watch_passes(get(), watcher, user);
  }
  // The links between organs, as Scene::set_links and link_state of one organ.
  palpate_status set_links(const palpate_world_link* links, std::int32_t count,
                           palpate_error* error = nullptr) noexcept {
    return palpate_world_set_links(get(), links, count, error);
  }
  const palpate_link_state* link_state(std::int32_t link) const noexcept {
    return palpate_world_link_state(get(), link);
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

// ---- help for a device (palpate_device.h) ------------------------------------------------------------------------
//
// Each of the three is a plain value: a copy of it is its saved state. One that was not made has no force to send, and its step says
// PALPATE_DEVICE_BAD_INPUT. A step may write its force over the one that it reads.

// The least damping of a device with which a coupling is stable, N s/m; NaN where an argument is out of its range.
inline double required_damping(double stiffness, double damping, double tick, std::int32_t delay_ticks) noexcept {
  return palpate_required_damping(stiffness, damping, tick, delay_ticks);
}

// A spring and a damper between a device and the tool that the scene is sent.
class Coupling {
 public:
  Coupling() = default;
  // An empty Coupling and *error where it fails. def: nullptr for the defaults of the device.
  static Coupling create(const palpate_device& device, palpate_error* error,
                         const palpate_coupling_def* def = nullptr) noexcept {
    Coupling made;
    made.made_ = palpate_coupling_init(&made.coupling_, &device, def, error) == PALPATE_OK;
    return made;
  }

  explicit operator bool() const noexcept { return made_; }
  const palpate_coupling& get() const noexcept { return coupling_; }
  const palpate_coupling* operator->() const noexcept { return &coupling_; }
  palpate_device_flags step(const double (&device_position)[3], const double (&organ_force)[3],
                            double (&tool_position)[3], double (&device_force)[3]) noexcept {
    if (made_) return palpate_coupling_step(&coupling_, device_position, organ_force, tool_position, device_force);
    for (int d = 0; d < 3; ++d) tool_position[d] = device_position[d], device_force[d] = 0;
    return PALPATE_DEVICE_BAD_INPUT;
  }
  void reset() noexcept { palpate_coupling_reset(&coupling_); }

 private:
  palpate_coupling coupling_ = {};
  bool made_ = false;

#ifdef __cpp_exceptions
 public:
  // create; it throws Error where it fails.
  explicit Coupling(const palpate_device& device, const palpate_coupling_def* def = nullptr) {
    palpate_error error = {};
    *this = create(device, &error, def);
    if (!made_) throw Error(error);
  }
#endif
};

// Keeps the account of the energy that the device gets, and damps it where its definition has a controller.
class PassivityObserver {
 public:
  PassivityObserver() = default;
  // An empty PassivityObserver and *error where it fails. def: nullptr for the defaults.
  static PassivityObserver create(const palpate_device& device, palpate_error* error,
                                  const palpate_passivity_def* def = nullptr) noexcept {
    PassivityObserver made;
    made.made_ = palpate_passivity_init(&made.passivity_, &device, def, error) == PALPATE_OK;
    return made;
  }

  explicit operator bool() const noexcept { return made_; }
  const palpate_passivity& get() const noexcept { return passivity_; }
  const palpate_passivity* operator->() const noexcept { return &passivity_; }
  // stored_energy: that of the coupling; 0 without one.
  palpate_device_flags step(const double (&device_position)[3], const double (&force)[3], double stored_energy,
                            double (&device_force)[3]) noexcept {
    if (made_) return palpate_passivity_step(&passivity_, device_position, force, stored_energy, device_force);
    for (double& f : device_force) f = 0;
    return PALPATE_DEVICE_BAD_INPUT;
  }

 private:
  palpate_passivity passivity_ = {};
  bool made_ = false;

#ifdef __cpp_exceptions
 public:
  // create; it throws Error where it fails.
  explicit PassivityObserver(const palpate_device& device, const palpate_passivity_def* def = nullptr) {
    palpate_error error = {};
    *this = create(device, &error, def);
    if (!made_) throw Error(error);
  }
#endif
};

// Lets the force go where no new input comes. It belongs into the thread that sends forces to the device.
class Watchdog {
 public:
  Watchdog() = default;
  // An empty Watchdog and *error where it fails.
  static Watchdog create(const palpate_watchdog_def& def, palpate_error* error) noexcept {
    Watchdog made;
    made.made_ = palpate_watchdog_init(&made.watchdog_, &def, error) == PALPATE_OK;
    return made;
  }

  explicit operator bool() const noexcept { return made_; }
  const palpate_watchdog& get() const noexcept { return watchdog_; }
  const palpate_watchdog* operator->() const noexcept { return &watchdog_; }
  // sequence: that of the newest input, such as palpate_contacts.step.
  palpate_device_flags step(std::uint64_t sequence, const double (&force)[3], double dt,
                            double (&device_force)[3]) noexcept {
    if (made_) return palpate_watchdog_step(&watchdog_, sequence, force, dt, device_force);
    for (double& f : device_force) f = 0;
    return PALPATE_DEVICE_BAD_INPUT;
  }

 private:
  palpate_watchdog watchdog_ = {};
  bool made_ = false;

#ifdef __cpp_exceptions
 public:
  // create; it throws Error where it fails.
  explicit Watchdog(const palpate_watchdog_def& def) {
    palpate_error error = {};
    *this = create(def, &error);
    if (!made_) throw Error(error);
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
