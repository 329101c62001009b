// The caller's tools, checked and copied. A step works on the copies, which hold sound numbers whatever the device sent.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "runtime/base/host_struct.h"
#include "runtime/base/scene_memory.h"
#include "runtime/base/vec3.h"
#include "runtime/include/palpate/palpate.h"

namespace palpate {

// What a tool may have beside its points and grips: parts, of which each belongs to a module.
inline constexpr int kMostToolParts = 4;

struct InputLimits;

// How a module reads its part.
struct ToolPart {
  int place;  // among the parts of a Tool, of each module its own: 0 .. kMostToolParts - 1
  const palpate_effect* effect;
  std::size_t bytes;  // of the library's struct
  // from: of the host. organ: that the tool holds.
  bool (*is_sound)(const void* from, const InputLimits& organ);
  void (*copy)(const void* from, void* to);  // without its palpate_part
  bool pulls;                                // a tool that has it may pull at the surface
  bool alone =
      false;  // a tool that has it has no other part, and of several organs it touches the one alone that it holds
};
// Of a struct T without padding.
template <class T, void (*init)(T*, std::size_t), bool (*is_sound)(const T&, const InputLimits&)>
constexpr ToolPart tool_part(int place, const palpate_effect* effect, bool pulls) {
  return {place,
          effect,
          sizeof(T),
          [](const void* from, const InputLimits& organ) {
            T whole;
            const T* const sent = static_cast<const T*>(from);
            return is_readable(sent) && is_sound(whole_struct(sent, &whole, init), organ);
          },
          [](const void* from, void* to) {
            assert(!has_padding<T>());
            T whole;
            whole = whole_struct(static_cast<const T*>(from), &whole, init);
            constexpr std::size_t behind = sizeof(palpate_part);
            std::memcpy(static_cast<unsigned char*>(to) + behind, reinterpret_cast<unsigned char*>(&whole) + behind,
                        sizeof(T) - behind);
          },
          pulls};
}

constexpr ToolPart alone(ToolPart part) {
  part.alone = true;
  return part;
}

// The bounds that the checks hold the input to.
struct InputLimits {
  std::int32_t surface_nodes = 0, triangles = 0, max_tools = 0, max_points = 0;
  const std::uint8_t* active = nullptr;  // [triangles], of a surface that changes; nullptr: all triangles are active
  bool has_triangles = false;            // the scene has triangles, so grips may name surface points
  bool has_positions = false;            // the scene has the surface nodes' positions, which torques need
  const ToolPart* part[kMostToolParts] = {};  // nullptr: tools may not have it

  // How the part of that effect is read; nullptr: tools may not have one.
  const ToolPart* reader_of(const palpate_effect* effect) const {
    for (const ToolPart* how : part)
      if (how && how->effect == effect) return how;
    return nullptr;
  }
};

bool is_sound_point(const double* p);
// On a triangle that is part of the surface.
bool is_sound_place(std::int32_t triangle, const double* barycentric, const InputLimits& organ);

// What a tool has besides its arrays. It outlives a step, because a tool with bad input keeps its last good one; a saved state
// holds all of it.
struct ToolValues {
  std::int32_t id = -1;     // -1: no tool has this place
  std::int32_t index = -1;  // of the tool in this step; -1: not sent
  bool is_new = false;      // this place had no tool in the last step, or another one
  bool hold = false, has_torque = false;
  bool pulls = false;  // it may pull at the surface
  bool has_part[kMostToolParts] = {};
  std::int32_t point_count = 0, grip_count = 0;
  std::uint32_t flags = 0;  // of this step
  std::int32_t organ = 0;   // that grips and parts hold, where there are several
  Vec3 reference;           // m, in the world, where the tool has a torque
  double disc_radius = 0, friction = 0;
  Vec3 held_back;  // m, in the world: where the host sends the tool, less where an effect has it stand
};

// A tool keeps its place among the tools of the scene from step to step for as long as the host sends its id.
struct Tool : ToolValues {
  Vec3* points = nullptr;                   // [point_count]
  palpate_grip* grips = nullptr;            // [grip_count]
  palpate_part* part[kMostToolParts] = {};  // the copies; nullptr: the scene's tools may not have it
  // Of each copy what stands behind its palpate_part: a saved state holds this, and no addresses.
  unsigned char* kept[kMostToolParts] = {};
};

class ToolInput {
 public:
  // organs: whose grips and parts each have limits of their own: [organ_count], borrowed; nullptr: one organ.
  bool create(SceneMemory& memory, const InputLimits& limits, const InputLimits* organs = nullptr,
              std::int32_t organ_count = 1);
  // From now on tools may have this part. how: kept.
  bool read_part(SceneMemory& memory, const ToolPart& how);

  // Copies the step's tools. A tool with any bad number keeps all of its last good input (nothing at first); so does dt, and so
  // do all tools where the list itself is bad. Points and grips beyond max_points are dropped, the first ones kept. Returns the
  // step flags. far: [tool_count], of tools whose points and grips are neither checked nor copied; nullptr: none is.
  std::uint32_t take(const palpate_tool* tools, std::int32_t tool_count, double dt, const bool* far = nullptr);

  void forget();
  // Forgets the last good input of the tool in place t.
  void forget_input(std::int32_t t);
  // The place of tool `index` of the step.
  std::int32_t place_of_sent(std::int32_t index) const { return place_[index]; }
  // Whether a part has it touch the organ alone that it holds.
  bool is_alone(const Tool& tool) const {
    for (int place = 0; place < kMostToolParts; ++place)
      if (tool.has_part[place] && limits_.part[place]->alone) return true;
    return false;
  }
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
  Tool tools_[PALPATE_MAX_TOOLS];
  std::int32_t place_[PALPATE_MAX_TOOLS] = {};  // [sent] of each tool of the step
  std::int32_t sent_ = 0, count_ = 0;
  double dt_ = 1e-3;
};

}  // namespace palpate
