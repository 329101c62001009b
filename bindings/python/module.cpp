// palpate._palpate: the C API as Python objects and numpy arrays.
#include <palpate/palpate_complete.h>

#include <new>
#include <utility>

#include "bindings/python/bindings.h"

namespace palpate::python {
namespace {

// References that the module keeps until the process ends. Nothing releases them, so the interpreter's end needs no care.
py::handle error_type, status_type, step_flags_type, device_flags_type;

using Names = std::initializer_list<std::pair<const char*, unsigned>>;

py::handle add_enum(py::module_& module, const char* kind, const char* name, const char* doc, Names names) {
  py::list members;
  for (const auto& [member, value] : names) members.append(py::make_tuple(member, value));
  py::object type = py::module_::import("enum").attr(kind)(name, members, py::arg("module") = "palpate");
  type.attr("__doc__") = doc;
  module.attr(name) = type;
  return type.release();
}

// The text may contain a file name, which may be any bytes.
void set_error(const Error& error) {
  auto text = py::reinterpret_steal<py::object>(PyUnicode_DecodeFSDefault(error.detail.text));
  if (!text) return;
  py::object instance = error_type(text);
  instance.attr("text") = text;
  instance.attr("status") = status_type(static_cast<int>(error.detail.status));
  instance.attr("byte_offset") = error.detail.byte_offset;
  PyErr_SetObject(error_type.ptr(), instance.ptr());
}

void add_errors(py::module_& module) {
  status_type = add_enum(module, "IntEnum", "Status", "Why opening or creating failed.",
                         {{"OK", PALPATE_OK},
                          {"TRUNCATED", PALPATE_ERROR_TRUNCATED},
                          {"MAGIC", PALPATE_ERROR_MAGIC},
                          {"VERSION", PALPATE_ERROR_VERSION},
                          {"SECTION", PALPATE_ERROR_SECTION},
                          {"CHECKSUM", PALPATE_ERROR_CHECKSUM},
                          {"CONTENT", PALPATE_ERROR_CONTENT},
                          {"ARGUMENT", PALPATE_ERROR_ARGUMENT},
                          {"MEMORY", PALPATE_ERROR_MEMORY},
                          {"FILE", PALPATE_ERROR_FILE},
                          {"EFFECT", PALPATE_ERROR_EFFECT},
                          {"LOCK", PALPATE_ERROR_LOCK}});
  error_type = PyErr_NewExceptionWithDoc("palpate.Error",
                                         "Opening or creating failed. text: what was expected, what was found, what to "
                                         "do; status: a Status; byte_offset: where in the bundle, or 0.",
                                         PyExc_RuntimeError, nullptr);
  if (!error_type) throw py::error_already_set();
  module.attr("Error") = error_type;
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const Error& error) {
      set_error(error);
    }
  });
}

void add_step_flags(py::module_& module) {
  step_flags_type =
      add_enum(module, "IntFlag", "StepFlags", "How far to trust a step: bits of palpate.h; 0 is full trust.",
               {{"BAD_INPUT", PALPATE_STEP_BAD_INPUT},
                {"CONTACTS_DROPPED", PALPATE_STEP_CONTACTS_DROPPED},
                {"REGULARISED", PALPATE_STEP_REGULARISED},
                {"RESPONSE_RANGE", PALPATE_STEP_RESPONSE_RANGE},
                {"FORCE_LIMITED", PALPATE_STEP_FORCE_LIMITED},
                {"BUNDLE_LOST", PALPATE_STEP_BUNDLE_LOST},
                {"NOT_TOUCHABLE", PALPATE_STEP_NOT_TOUCHABLE},
                {"UNSOLVED", PALPATE_STEP_UNSOLVED},
                {"OTHER_BUNDLE", PALPATE_STEP_OTHER_BUNDLE},
                {"TRACKING_LOST", PALPATE_STEP_TRACKING_LOST},
                {"WORK_DEFERRED", PALPATE_STEP_WORK_DEFERRED},
                {"SOLVE_INEXACT", PALPATE_STEP_SOLVE_INEXACT},
                {"DISCS_THINNED", PALPATE_STEP_DISCS_THINNED},
                {"DEFORMATION_BEHIND", PALPATE_STEP_DEFORMATION_BEHIND},
                {"LINK_BROKE", PALPATE_STEP_LINK_BROKE},
                {"MOTION_LIMITED", PALPATE_STEP_MOTION_LIMITED},
                {"FRICTION_JAMS", PALPATE_STEP_FRICTION_JAMS},
                {"SURFACE_CROSSES", PALPATE_STEP_SURFACE_CROSSES}});
}

void add_device_flags(py::module_& module) {
  device_flags_type = add_enum(module, "IntFlag", "DeviceFlags", "What Coupling, Passivity and Watchdog report.",
                               {{"BAD_INPUT", PALPATE_DEVICE_BAD_INPUT},
                                {"FORCE_LIMITED", PALPATE_DEVICE_FORCE_LIMITED},
                                {"VELOCITY_LIMITED", PALPATE_DEVICE_VELOCITY_LIMITED},
                                {"ACTIVE", PALPATE_DEVICE_ACTIVE},
                                {"SILENT", PALPATE_DEVICE_SILENT}});
}

}  // namespace

AlignedMemory aligned_memory(std::size_t bytes) {
  void* memory = std::aligned_alloc(64, (bytes + 63) / 64 * 64);
  if (!memory) throw std::bad_alloc();
  return AlignedMemory(memory);
}

py::object step_flags(std::uint32_t flags) {
  return step_flags_type(flags);
}

py::object device_flags(std::uint32_t flags) {
  return device_flags_type(flags);
}

}  // namespace palpate::python

PYBIND11_MODULE(_palpate, module) {
  using namespace palpate::python;
  module.doc() = "Touch an organ in real time: from a tensor bundle and tools to forces and the deformed shape.";
  module.attr("__version__") = palpate_version(nullptr);  // of the library that is linked
  module.attr("API_VERSION") = PALPATE_API_VERSION;
  add_errors(module);
  add_step_flags(module);
  add_bundle(module);
  add_contacts(module);
  add_tools(module);
  add_links(module);
  add_tool_shape(module);
  add_scene(module);
  add_world(module);
  add_device_flags(module);
  add_device(module);
}
