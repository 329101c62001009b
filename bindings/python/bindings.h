// Shared by the files of the Python module: objects that own the memory which numpy arrays of Python view.
#pragma once

#include <palpate/palpate_complete.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <palpate/palpate.hpp>
#include <stdexcept>
#include <utility>
#include <vector>

namespace palpate::python {

namespace py = pybind11;

struct FreeMemory {
  void operator()(void* memory) const noexcept { std::free(memory); }
};
using AlignedMemory = std::unique_ptr<void, FreeMemory>;

// At least `bytes` bytes, 64-byte aligned. Throws std::bad_alloc.
AlignedMemory aligned_memory(std::size_t bytes);

// Makes a call that returns a status and fills an error. Throws Error where it failed.
template <class Call>
void throw_unless_ok(Call call) {
  palpate_error error = {};
  if (call(&error) != PALPATE_OK) throw Error(error);
}

// The bytes of a Python object; they stay valid as long as this object lives.
class HeldBuffer {
 public:
  explicit HeldBuffer(const py::buffer& from) {
    if (PyObject_GetBuffer(from.ptr(), &view_, PyBUF_SIMPLE) != 0) throw py::error_already_set();
  }
  ~HeldBuffer() { PyBuffer_Release(&view_); }
  HeldBuffer(const HeldBuffer&) = delete;
  HeldBuffer& operator=(const HeldBuffer&) = delete;
  const void* data() const { return view_.buf; }
  std::size_t size() const { return static_cast<std::size_t>(view_.len); }
  bool read_only() const { return view_.readonly != 0; }

 private:
  Py_buffer view_ = {};
};

// A bundle and, where it was opened from bytes, those bytes, borrowed or copied.
struct HeldBundle {
  std::unique_ptr<HeldBuffer> borrowed;
  AlignedMemory copied;
  Bundle bundle;  // the last member, so it is destroyed first
};

inline constexpr const char* kContactsInUse =
    "these contacts are in use by a step on another thread; give each thread its own and hand them over with assign or "
    "a Mailbox";

// Contacts with room for one scene's contact nodes. All zero until the first touch.
struct HeldContacts {
  explicit HeldContacts(std::size_t capacity) : bytes(capacity), contacts(capacity) {}
  // Copies contacts from bytes. False, with nothing changed, where the bytes are not complete contacts or do not fit.
  bool assign(const void* data, std::size_t size);
  std::size_t bytes;
  Contacts contacts;
  std::atomic_flag in_use = ATOMIC_FLAG_INIT;
};

// Marks an object as in use while a call works on it without the interpreter's lock. A second thread that uses the object then
// gets a RuntimeError instead of a data race.
class InUse {
 public:
  InUse(std::atomic_flag& flag, const char* sentence) : flag_(flag) {
    if (flag.test_and_set(std::memory_order_acquire)) throw std::runtime_error(sentence);
  }
  ~InUse() { flag_.clear(std::memory_order_release); }
  InUse(const InUse&) = delete;
  InUse& operator=(const InUse&) = delete;

 private:
  std::atomic_flag& flag_;
};

// A read-only array over the owner's memory. The array keeps the owner alive. strides: in bytes; empty: contiguous.
template <class T>
py::array view_of(const py::object& owner, const T* data, std::vector<py::ssize_t> shape,
                  std::vector<py::ssize_t> strides = {}) {
  if (strides.empty()) strides = py::detail::c_strides(shape, sizeof(T));
  py::array_t<T> view(std::move(shape), std::move(strides), data, owner);
  view.attr("setflags")(py::arg("write") = false);
  return view;
}

// Flag bits as palpate.StepFlags.
py::object step_flags(std::uint32_t flags);

// The same as palpate.DeviceFlags.
py::object device_flags(std::uint32_t flags);

void add_bundle(py::module_& module);
void add_contacts(py::module_& module);
void add_tools(py::module_& module);
void add_links(py::module_& module);
void add_scene(py::module_& module);
void add_world(py::module_& module);
void add_tool_shape(py::module_& module);
void add_device(py::module_& module);

}  // namespace palpate::python
