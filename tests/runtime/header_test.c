/* The headers are C99 and need nothing else; this file is compiled with -std=c99 -pedantic-errors -Werror and linked as C. */
#include "runtime/include/palpate/palpate_complete.h"

static int mailbox_works(void) {
  static unsigned char plain[8192 + 63];
  unsigned char* memory = plain + (64 - (uintptr_t)plain % 64) % 64;
  const size_t bytes = palpate_contacts_bytes(0);
  palpate_mailbox* box = palpate_mailbox_create(memory, bytes);
  if (palpate_mailbox_bytes(bytes) > sizeof plain - 63 || !box || palpate_mailbox_newest(box, 0)) return 0;
  palpate_mailbox_slot(box)->step = 42;
  palpate_mailbox_publish(box);
  return palpate_mailbox_newest(box, 0)->step == 42;
}

static int device_help_works(void) {
  palpate_device device = palpate_default_device();
  palpate_coupling coupling;
  double at[3] = {1, 2, 3}, none[3] = {0, 0, 0}, tool[3], force[3];
  device.mass = 0.1, device.damping = 0.5;
  return palpate_coupling_init(&coupling, &device, 0, 0) == PALPATE_OK &&
         palpate_coupling_step(&coupling, at, none, tool, force) == 0 && tool[2] == 3 && force[2] == 0;
}

static int world_works(void) {
  palpate_world_def def = palpate_default_world_def();
  palpate_world_organ organ = palpate_default_world_organ();
  palpate_world* world = 0;
  palpate_error error;
  def.organs = &organ, def.organ_count = 1;
  return palpate_world_create(&def, &world, &error) == PALPATE_ERROR_ARGUMENT && !world && error.text[0] != 0 &&
         palpate_world_contacts_bytes(0) == 0;
}

int main(void) {
  palpate_error error;
  palpate_bundle* bundle = 0;
  const palpate_scene_def def = palpate_default_scene_def();
  if (palpate_bundle_open("", 0, 0, &bundle, &error) == PALPATE_OK || bundle != 0 || error.text[0] == 0) return 1;
  if (!mailbox_works() || !device_help_works() || !world_works()) return 1;
  return def.max_tools == 4 && palpate_scene_touch(0, 0, 0, 0.001, 0, 0) == PALPATE_STEP_BAD_INPUT ? 0 : 1;
}
