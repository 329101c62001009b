// The library's version, and the defaults that palpate.h states, written as structs of the host's size.
#include <cmath>

#include "runtime/base/host_struct.h"

#define PALPATE_TEXT_OF(number) #number
#define PALPATE_TEXT(number) PALPATE_TEXT_OF(number)

using palpate::write_host_struct;

const char* palpate_version(int32_t* numbers) {
  if (numbers) {
    numbers[0] = PALPATE_API_VERSION;
    numbers[1] = PALPATE_VERSION_MAJOR, numbers[2] = PALPATE_VERSION_MINOR, numbers[3] = PALPATE_VERSION_PATCH;
  }
  return PALPATE_TEXT(PALPATE_VERSION_MAJOR) "." PALPATE_TEXT(PALPATE_VERSION_MINOR) "." PALPATE_TEXT(
      PALPATE_VERSION_PATCH);
}

void palpate_init_bundle_options(palpate_bundle_options* options, size_t struct_bytes) {
  write_host_struct(palpate_bundle_options{}, options, struct_bytes);
}

void palpate_init_scene_def(palpate_scene_def* def, size_t struct_bytes) {
  palpate_scene_def defaults = {};
  defaults.collision = PALPATE_COLLISION_REST;
  defaults.contact = PALPATE_CONTACT_PATCH;
  defaults.law = PALPATE_LAW_STICKING;
  defaults.force = PALPATE_FORCE_LINEAR;
  defaults.shape = PALPATE_SHAPE_SURFACE;
  defaults.radial = PALPATE_RADIAL_OFF;
  defaults.preload = PALPATE_PRELOAD_OFF;
  defaults.max_tools = 4;
  defaults.max_points = 64;
  defaults.force_limit = 50;
  defaults.force_slew = 1e4;
  defaults.max_tool_speed = 10;
  defaults.torque_limit = 5;
  defaults.torque_slew = 1e3;
  defaults.max_operations = 300'000;
  write_host_struct(defaults, def, struct_bytes);
}

void palpate_init_step_load(palpate_step_load* load, size_t struct_bytes) {
  write_host_struct(palpate_step_load{}, load, struct_bytes);
}

void palpate_init_pose(palpate_pose* pose, size_t struct_bytes) {
  palpate_pose defaults = {};
  defaults.orientation[0] = 1;
  write_host_struct(defaults, pose, struct_bytes);
}

void palpate_init_grip(palpate_grip* grip, size_t struct_bytes) {
  palpate_grip defaults = {};
  defaults.kind = PALPATE_GRIP_UNSAID;
  defaults.axes = 7;
  defaults.node = defaults.triangle = -1;
  write_host_struct(defaults, grip, struct_bytes);
}

void palpate_init_tool(palpate_tool* tool, size_t struct_bytes) {
  palpate_tool defaults = {};
  defaults.id = -1;
  write_host_struct(defaults, tool, struct_bytes);
}

void palpate_init_shape_out(palpate_shape_out* out, size_t struct_bytes) {
  write_host_struct(palpate_shape_out{}, out, struct_bytes);
}
