// The caller's tools, checked and copied. A step works on the copies, which hold sound numbers whatever the device sent.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <iterator>

#include "runtime/base/host_struct.h"
#include "runtime/base/scene_memory.h"
#include "runtime/base/vec3.h"
#include "runtime/include/palpate/palpate.h"

namespace palpate {

// What a tool has beside its points and grips: the structs that these pointers of a palpate_tool name. A module reads each of them.
inline constexpr std::size_t kToolParts[] = {offsetof(palpate_tool, grasp), offsetof(palpate_tool, needle)};
inline constexpr int kToolPartCount = std::size(kToolParts);
// The number of the pointer at that offset.
constexpr int tool_part_at(std::size_t offset) {
  int part = 0;
  while (kToolParts[part] != offset) ++part;
  return part;
}
// The pointer as the host has set it.
inline const void* part_of(const palpate_tool& tool, int part) {
  const void* pointer = nullptr;
  std::memcpy(&pointer, reinterpret_cast<const unsigned char*>(&tool) + kToolParts[part], sizeof pointer);
  return pointer;
}
inline void set_part(palpate_tool& tool, int part, const void* pointer) {
  std::memcpy(reinterpret_cast<unsigned char*>(&tool) + kToolParts[part], &pointer, sizeof pointer);
}
inline bool has_parts(const palpate_tool& tool) {
  for (int part = 0; part < kToolPartCount; ++part)
    if (part_of(tool, part)) return true;
  return false;
}

struct InputLimits;

// How a module reads one of them.
struct ToolPart {
  std::size_t bytes;  // of the library's struct
  // from: of the host, not NULL. organ: that the tool holds.
  bool (*is_sound)(const void* from, const InputLimits& organ);
  void (*copy)(const void* from, void* to);
  bool pulls;  // a tool that has it may pull at the surface
};
// Of a struct T without padding.
template <class T, void (*init)(T*, std::size_t), bool (*is_sound)(const T&, const InputLimits&)>
constexpr ToolPart tool_part(bool pulls) {
  return {sizeof(T),
          [](const void* from, const InputLimits& organ) {
            T whole;
            const T* const sent = static_cast<const T*>(from);
            return is_readable(sent) && is_sound(whole_struct(sent, &whole, init), organ);
          },
          [](const void* from, void* to) {
            assert(!has_padding<T>());
            T whole;
            std::memcpy(to, &whole_struct(static_cast<const T*>(from), &whole, init), sizeof(T));
          },
          pulls};
}

// The bounds that the checks hold the input to.
struct InputLimits {
  std::int32_t surface_nodes = 0, triangles = 0, max_tools = 0, max_points = 0;
  bool has_triangles = false;                 // the scene has triangles, so grips may name surface points
  bool has_positions = false;                 // the scene has the surface nodes' positions, which torques need
  const ToolPart* part[kToolPartCount] = {};  // nullptr: tools may not have it
};

bool is_sound_point(const double* p);
bool is_sound_place(std::int32_t triangle, const double* barycentric, std::int32_t triangles);

// What a tool has besides its arrays. It outlives a step, because a tool with bad input keeps its last good one; a saved state
// holds all of it.
struct ToolValues {
  std::int32_t id = -1;     // -1: no tool has this place
  std::int32_t index = -1;  // of the tool in this step; -1: not sent
  bool is_new = false;      // this place had no tool in the last step, or another one
  bool hold = false, has_torque = false;
  bool pulls = false;  // it may pull at the surface
  bool has_part[kToolPartCount] = {};
  bool unused_flags[2] = {};  // in the place of padding, which a saved state would hold
  std::int32_t point_count = 0, grip_count = 0;
  std::uint32_t flags = 0;  // of this step
  std::int32_t organ = 0;   // that grips and parts hold, where there are several
  Vec3 reference;           // m, in the world, where the tool has a torque
  double disc_radius = 0, friction = 0;
};

// A tool keeps its place among the tools of the scene from step to step for as long as the host sends its id.
struct Tool : ToolValues {
  Vec3* points = nullptr;           // [point_count]
  palpate_grip* grips = nullptr;    // [grip_count]
  void* part[kToolPartCount] = {};  // the copies; nullptr: the scene's tools may not have it
};

class ToolInput {
 public:
  // organs: whose grips and parts each have limits of their own: [organ_count], borrowed; nullptr: one organ.
  bool create(SceneMemory& memory, const InputLimits& limits, const InputLimits* organs = nullptr,
              std::int32_t organ_count = 1);
  // From now on tools may have this part. how: kept.
  bool read_part(SceneMemory& memory, int part, const ToolPart& how);

  // Copies the step's tools. A tool with any bad number keeps all of its last good input (nothing at first); so does dt, and so
  // do all tools where the list itself is bad. Points and grips beyond max_points are dropped, the first ones kept. Returns the
  // step flags. far: [tool_count], of tools whose points and grips are neither checked nor copied; nullptr: none is.
  std::uint32_t take(const palpate_tool* tools, std::int32_t tool_count, double dt, const bool* far = nullptr);

  void forget();
  // Forgets the last good input of the tool in place t.
  void forget_input(std::int32_t t);
  // The place of tool `index` of the step.
  std::int32_t place_of_sent(std::int32_t index) const { return place_[index]; }
  // The place of the tool with that id; -1: none.
  std::int32_t place_of(std::int32_t id) const;

  // Tools of the step.
  std::int32_t sent() const { return sent_; }
  // Places in use: those of the step's tools and, between them, places without points and grips.
  std::int32_t count() const { return count_; }
  Tool& tool(std::int32_t t) { return tools_[t]; }
  const Tool& tool(std::int32_t t) const { return tools_[t]; }
  double dt() const { return dt_; }
  const InputLimits& limits() const { return limits_; }

 private:
  bool is_sound(const palpate_tool& tool, std::int32_t points, std::int32_t grips) const;
  void free_place(std::int32_t t);
  void assign_places(const palpate_tool* tools, std::uint32_t stride, std::int32_t tool_count);
  void take_tool(const palpate_tool& from, Tool& tool, bool known, std::int32_t* room);
  static void take_far_tool(const palpate_tool& from, Tool& tool, std::int32_t* room);
  const InputLimits* limits_of(std::int32_t organ) const;

  InputLimits limits_;
  const InputLimits* organs_ = nullptr;
  std::int32_t organ_count_ = 1;
  unsigned char* copies_[kToolPartCount] = {};  // [max_tools] of ToolPart::bytes each
  Tool tools_[PALPATE_MAX_TOOLS];
  std::int32_t place_[PALPATE_MAX_TOOLS] = {};  // [sent] of each tool of the step
  std::int32_t sent_ = 0, count_ = 0;
  double dt_ = 1e-3;
};

}  // namespace palpate
