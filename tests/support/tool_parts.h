// The grasp and the needle of a tool; nullptr where it has none.
#pragma once

#include "runtime/include/palpate/palpate_grasps.h"
#include "runtime/include/palpate/palpate_needles.h"

namespace palpate {

inline const palpate_part* part_of(const palpate_tool& tool, const palpate_effect* effect) {
  const palpate_part* part = tool.parts;
  while (part && part->effect != effect) part = part->next;
  return part;
}
inline const palpate_grasp* grasp_of(const palpate_tool& tool) {
  return reinterpret_cast<const palpate_grasp*>(part_of(tool, palpate_default_grasp().part.effect));
}
inline const palpate_needle* needle_of(const palpate_tool& tool) {
  return reinterpret_cast<const palpate_needle*>(part_of(tool, palpate_default_needle().part.effect));
}

}  // namespace palpate
