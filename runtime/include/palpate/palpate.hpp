// palpate.hpp - palpate.h for C++17: owners that release what they own, and errors that can be thrown.
//
// The constructors throw palpate::Error. open_file, open and create return an empty owner and fill *error instead. Where a host is
// compiled without exceptions (-fno-exceptions), Error and the constructors that throw it do not exist, so that code which needs
// them does not compile. A step never throws, allocates or locks. palpate.h documents everything else.
#pragma once

#include <palpate/palpate.h>

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
  palpate_step_flags shape(const Contacts& contacts, palpate_shape_out& out) noexcept {
    return palpate_scene_shape(get(), contacts.get(), &out);
  }
  palpate_step_flags skin(const palpate_shape_out& shape, palpate_skin_out& out) noexcept {
    return palpate_scene_skin(get(), &shape, &out);
  }
  void reset() noexcept { palpate_scene_reset(get()); }
  void reset_tool(std::int32_t id) noexcept { palpate_scene_reset_tool(get(), id); }

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
