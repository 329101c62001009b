// palpate.Bundle: opened from a file or from bytes. Its arrays are views, which keep it open.
#include <cstring>
#include <string>

#include "bindings/python/bindings.h"

namespace palpate::python {
namespace {

// str, bytes or os.PathLike.
std::string file_path(const py::object& path) {
  PyObject* encoded = nullptr;
  if (!PyUnicode_FSConverter(path.ptr(), &encoded)) throw py::error_already_set();
  return py::reinterpret_steal<py::bytes>(encoded);
}

palpate_file_access file_access(const std::string& name) {
  if (name == "map") return PALPATE_FILE_MAP;
  if (name == "map guarded") return PALPATE_FILE_MAP_GUARDED;
  if (name == "copy") return PALPATE_FILE_COPY;
  throw py::value_error("access is \"" + name + "\"; expected \"map\", \"map guarded\" or \"copy\"");
}

// Hands a line of the library's log to the logger "palpate" of Python. The library calls it while a bundle is opened or a scene
// is created, without the interpreter's lock; nothing may be thrown through the library.
void write_log(void*, palpate_log_level level, const char* text) {
  const py::gil_scoped_acquire acquired;
  try {
    py::module_::import("logging").attr("getLogger")("palpate").attr(
        level == PALPATE_LOG_WARNING ? "warning" : "debug")("%s", text);
  } catch (py::error_already_set& error) {
    error.discard_as_unraisable("palpate's log");
  }
}

palpate_bundle_options options_with_log() {
  palpate_bundle_options options = palpate_default_bundle_options();
  options.log = write_log;
  return options;
}

std::shared_ptr<HeldBundle> open_file(const py::object& path, const std::string& access) {
  const std::string name = file_path(path);
  auto held = std::make_shared<HeldBundle>();
  palpate_bundle_options options = options_with_log();
  options.file_access = file_access(access);
  const py::gil_scoped_release released;
  held->bundle = Bundle(name.c_str(), &options);
  return held;
}

// A bundle must not change while it is open, so read-only bytes are borrowed and others are copied.
std::shared_ptr<HeldBundle> open_bytes(const py::buffer& bytes) {
  auto held = std::make_shared<HeldBundle>();
  auto buffer = std::make_unique<HeldBuffer>(bytes);
  const std::size_t size = buffer->size();
  const void* data = buffer->data();
  if (buffer->read_only() && reinterpret_cast<std::uintptr_t>(data) % 64 == 0) {
    held->borrowed = std::move(buffer);
  } else {
    held->copied = aligned_memory(size);
    if (size > 0) std::memcpy(held->copied.get(), data, size);
    data = held->copied.get();
  }
  const py::gil_scoped_release released;
  const palpate_bundle_options options = options_with_log();
  held->bundle = Bundle(data, size, &options);
  return held;
}

// An array of the bundle. Its section exists, so a failure means that the system cannot map or copy it.
template <class T>
py::array section_view(const py::object& self, const T* (Bundle::*section)() const noexcept,
                       std::int32_t palpate_bundle_info::*count, int width) {
  const Bundle& bundle = self.cast<const HeldBundle&>().bundle;
  const T* data = (bundle.*section)();
  if (!data)
    throw Error({PALPATE_ERROR_FILE, 0, "a section of the bundle cannot be mapped or copied; close other bundles"});
  const py::ssize_t rows = bundle.describe().*count;
  return width == 1 ? view_of(self, data, {rows}) : view_of(self, data, {rows, width});
}

void check(HeldBundle& held) {
  const py::gil_scoped_release released;
  throw_unless_ok([&](palpate_error* error) { return palpate_bundle_check(held.bundle.get(), error); });
}

void prefault(HeldBundle& held, bool lock) {
  const py::gil_scoped_release released;
  throw_unless_ok([&](palpate_error* error) { return palpate_bundle_prefault(held.bundle.get(), lock, error); });
}

// Name and kind of each.
py::list motions(const HeldBundle& held) {
  static constexpr const char* kinds[] = {"piston", "rotation", "field", "pressure", "gravity"};
  py::list all;
  for (std::int32_t m = 0; m < held.bundle.describe().motion_count; ++m) {
    palpate_motion_info info = {};
    throw_unless_ok(
        [&](palpate_error* error) { return palpate_bundle_motion(held.bundle.get(), m, &info, sizeof info, error); });
    all.append(py::make_tuple(info.name, kinds[info.kind - PALPATE_MOTION_PISTON]));
  }
  return all;
}

}  // namespace

void add_bundle(py::module_& module) {
  py::class_<HeldBundle, std::shared_ptr<HeldBundle>> type(
      module, "Bundle",
      "A tensor bundle: the precomputed elastic response of an organ. Threads may share it. It stays open while a\n"
      "scene or an array of it is in use. Its arrays are read-only views, not copies.");
  type.def(
      py::init(&open_file), py::arg("path"), py::kw_only(), py::arg("access") = "map",
      "Opens and checks a file. Takes only the sections that are used. access: \"map\" maps them: if somebody cuts\n"
      "the file while it is open, reading it raises SIGBUS, which ends Python. \"map guarded\" handles that signal\n"
      "in this process while the bundle is open. \"copy\" copies them. Raises Error.");
  type.def_static(
      "from_bytes", &open_bytes, py::arg("data"),
      "Opens and checks a bundle in memory: any object with a buffer (bytes, mmap, numpy array). Read-only\n"
      "data at a multiple of 64 bytes, such as an mmap, is borrowed and must not change; other data is\n"
      "copied once. Raises Error.");

  const auto view = [&type](const char* name, auto section, auto count, int width, const char* doc) {
    type.def_property_readonly(
        name, [=](const py::object& self) { return section_view(self, section, count, width); }, doc);
  };
  using Info = palpate_bundle_info;
  view("nodes", &Bundle::nodes, &Info::node_count, 3,
       "float64 [node_count, 3], m: positions as meshed; surface nodes first");
  view("triangles", &Bundle::triangles, &Info::triangle_count, 3,
       "int32 [triangle_count, 3]: node indices, counter-clockwise from outside");
  view("tetrahedra", &Bundle::tetrahedra, &Info::tetrahedron_count, 4, "int32 [tetrahedron_count, 4]");
  view("touchable", &Bundle::touchable, &Info::touchable_count, 1,
       "int32 [touchable_count]: node of each tensor column");

  view("fixed", &Bundle::fixed, &Info::node_count, 3, "uint8 [node_count, 3]: 1 where a node is fixed along x, y, z");
  type.def_property_readonly("motions", &motions,
                             "list of (name, kind), one for each motion: piston, rotation, field, pressure, gravity");
  type.def_property_readonly(
      "provenance",
      [](const HeldBundle& self) {
        const std::string_view text = self.bundle.provenance();
        return py::module_::import("json").attr("loads")(py::bytes(text.data(), text.size()));
      },
      "dict: organ, element, sources of the bundle (formats/BUNDLE.md)");

  const auto count = [&type](const char* name, auto member, const char* doc) {
    type.def_property_readonly(
        name, [=](const HeldBundle& self) { return self.bundle.describe().*member; }, doc);
  };
  count("node_count", &Info::node_count, "N");
  count("surface_node_count", &Info::surface_node_count, "Ns: nodes 0 .. Ns-1 are the surface");
  count("triangle_count", &Info::triangle_count, "F");
  count("tetrahedron_count", &Info::tetrahedron_count, "E");
  count("touchable_count", &Info::touchable_count, "S");
  const auto has = [&type](const char* name, auto member, const char* doc) {
    type.def_property_readonly(
        name, [=](const HeldBundle& self) { return self.bundle.describe().*member != 0; }, doc);
  };
  has("has_interior", &Info::has_interior,
      "True: the bundle has displacements of inner nodes, so shape=\"volume\" works");
  has("has_radial", &Info::has_radial, "True: the bundle has the measured radial response P");
  has("has_force", &Info::has_force, "True: the bundle has the measured force response Q");
  has("has_preload", &Info::has_preload, "True: the bundle has the displacement under a body force");
  has("has_large", &Info::has_large, "True: deformation=\"large\" is possible");

  type.def("check", &check, "Compares every section with its checksum; reads the whole bundle. Raises Error.");
  type.def("prefault", &prefault, py::arg("lock") = false,
           "Reads every page that the existing scenes use, so that no step waits for the disk. lock: asks the system\n"
           "to keep them in memory. Raises Error (Status.LOCK) where the system refuses to lock.");
  type.def("__repr__", [](const HeldBundle& self) {
    const Info info = self.bundle.describe();
    return "<palpate.Bundle: " + std::to_string(info.node_count) + " nodes, " + std::to_string(info.touchable_count) +
           " touchable>";
  });
}

}  // namespace palpate::python
