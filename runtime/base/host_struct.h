// Structs that the host fills. The host may have been compiled with an earlier or a later header than this library, so a
// struct is read by its own struct_bytes: fields that it does not have keep their default.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "runtime/base/alignment.h"
#include "runtime/base/error_text.h"
#include "runtime/include/palpate/palpate_plan.h"
#include "runtime/include/palpate/palpate_pose.h"

namespace palpate {

// No header of version 3 declares a larger struct; a larger number is an uninitialised one.
constexpr std::uint32_t kMostStructBytes = 1024;

// The struct's own size, which every struct of the host begins with.
template <class T>
std::uint32_t struct_bytes_of(const T* from) {
  if constexpr (requires { from->part; }) {
    static_assert(offsetof(T, part) == 0);
    return from->part.struct_bytes;
  } else {
    static_assert(offsetof(T, struct_bytes) == 0);
    return from->struct_bytes;
  }
}

// The end of the fields that have no default: a smaller struct is refused.
template <class T>
inline constexpr std::size_t kLeastStructBytes = 0;
template <>
inline constexpr std::size_t kLeastStructBytes<palpate_bundle_options> = offsetof(palpate_bundle_options, allocator);
template <>
inline constexpr std::size_t kLeastStructBytes<palpate_scene_def> = offsetof(palpate_scene_def, max_tools);
template <>
inline constexpr std::size_t kLeastStructBytes<palpate_pose> = offsetof(palpate_pose, position);
template <>
inline constexpr std::size_t kLeastStructBytes<palpate_step_load> = offsetof(palpate_step_load, slips);
template <>
inline constexpr std::size_t kLeastStructBytes<palpate_grip> = offsetof(palpate_grip, displacement) + sizeof(double[3]);
template <>
inline constexpr std::size_t kLeastStructBytes<palpate_tool> = offsetof(palpate_tool, disc_radius);
template <>
inline constexpr std::size_t kLeastStructBytes<palpate_shape_out> = offsetof(palpate_shape_out, positions);

// Whether the size is one that some header may declare.
template <class T>
bool is_struct_size(std::uint32_t bytes) {
  static_assert(kLeastStructBytes<T> > 0);
  return bytes >= kLeastStructBytes<T> && bytes <= kMostStructBytes && bytes % alignof(T) == 0;
}

// Whether all bytes of the struct behind those that this library knows are zero.
template <class T>
bool has_known_fields_only(const T* from) {
  const auto* bytes = reinterpret_cast<const unsigned char*>(from);
  const std::uint32_t count = struct_bytes_of(from);
  return count <= sizeof(T) || std::all_of(bytes + sizeof(T), bytes + count, [](unsigned char b) { return b == 0; });
}

// Overwrites the defaults in *to with the fields that *from has. Its size must be one that is_struct_size accepts.
template <class T>
void copy_host_struct(const T* from, T* to) {
  std::memcpy(static_cast<void*>(to), from, std::min<std::size_t>(struct_bytes_of(from), sizeof(T)));
}

// The host's struct with all fields that this library knows: itself where it has them all, as a rule, else *whole, which takes them over
// the defaults that init writes. Its size must be one that is_struct_size accepts.
template <class T>
const T& whole_struct(const T* from, T* whole, void (*init)(T*, std::size_t)) {
  if (struct_bytes_of(from) >= sizeof(T)) return *from;
  init(whole, sizeof(T));
  copy_host_struct(from, whole);
  return *whole;
}

// Writes the defaults as the host's struct of struct_bytes bytes; fields that this library does not know become zero.
template <class T>
void write_host_struct(T defaults, T* to, std::size_t struct_bytes) {
  if (!to || struct_bytes < sizeof(std::uint32_t)) return;
  if constexpr (requires { defaults.part; })
    defaults.part.struct_bytes = static_cast<std::uint32_t>(struct_bytes);
  else
    defaults.struct_bytes = static_cast<std::uint32_t>(struct_bytes);
  // Most hosts have this library's headers, and write a tool in each step.
  if (struct_bytes == sizeof(T)) {
    std::memcpy(static_cast<void*>(to), &defaults, sizeof(T));
    return;
  }
  std::memset(static_cast<void*>(to), 0, struct_bytes);
  std::memcpy(static_cast<void*>(to), &defaults, std::min(struct_bytes, sizeof(T)));
}

// Whether a step may use *from.
template <class T>
bool is_readable(const T* from) {
  return from && is_aligned(from) && is_struct_size<T>(struct_bytes_of(from)) && has_known_fields_only(from);
}

// Reads *from over the defaults in *to. False where a step must not use *from, in which case *to is unchanged.
template <class T>
bool read_host_struct(const T* from, T* to) {
  if (!is_readable(from)) return false;
  copy_host_struct(from, to);
  return true;
}

// Of a struct of the host: the least size that some header declares, the size that this library knows, and its alignment.
struct StructSizes {
  std::size_t least, known, alignment;
};

// Reads the host's struct, which begins with its size, over the defaults in *to, or says what is wrong. name: of the struct, without
// "palpate_".
inline palpate_status read_host_struct(const char* name, const void* from, void* to, StructSizes sizes,
                                       palpate_error* error) {
  const auto* const bytes = static_cast<const unsigned char*>(from);
  if (reinterpret_cast<std::uintptr_t>(from) % sizes.alignment != 0)
    return fail(error, PALPATE_ERROR_ARGUMENT, 0, "palpate_%s: the struct's address is not aligned", name);
  std::uint32_t count = 0;
  std::memcpy(&count, from, sizeof count);
  if (count < sizes.least || count > kMostStructBytes || count % sizes.alignment != 0)
    return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                "palpate_%s: struct_bytes is %u; expected %u; start from palpate_default_%s()", name, count,
                static_cast<unsigned>(sizes.known), name);
  if (count > sizes.known && !std::all_of(bytes + sizes.known, bytes + count, [](unsigned char b) { return b == 0; }))
    return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                "palpate_%s: struct_bytes is %u, this library knows %u bytes, and a field behind them is set; use the "
                "library of the host's header, or leave that field zero",
                name, count, static_cast<unsigned>(sizes.known));
  std::memcpy(to, from, std::min<std::size_t>(count, sizes.known));
  return PALPATE_OK;
}
template <class T>
palpate_status read_host_struct(const char* name, const T* from, T* to, palpate_error* error) {
  const StructSizes sizes = {kLeastStructBytes<T>, sizeof(T), alignof(T)};
  return read_host_struct(name, static_cast<const void*>(from), static_cast<void*>(to), sizes, error);
}

// An enum's bits as a number: a host in C may have stored any number in it, and reading that as the enum is undefined.
template <class Enum>
int enum_number(const Enum& value) {
  int number = 0;
  static_assert(sizeof value == sizeof number);
  std::memcpy(&number, &value, sizeof number);
  return number;
}

}  // namespace palpate
