/* chosen_effects BUNDLE: a host that names the effects that it wants when it is compiled (CHOSEN; else none; ALL: all of them), presses the box
 * of write_tiny_bundle 2 mm deep and prints the force. check_linked_effects.py looks at what its linker took. */
#include <palpate/palpate.h>
#include <palpate/palpate_needles.h>
#include <palpate/palpate_relaxation.h>
#include <stdio.h>
#include <stdlib.h>

static palpate_status create(palpate_bundle* bundle, const palpate_scene_def* def, palpate_scene** scene,
                             palpate_error* error) {
#if defined(ALL)
  return palpate_scene_create(bundle, def, scene, error);
#elif defined(CHOSEN)
  const palpate_effect* const chosen[] = {CHOSEN};
  return palpate_scene_create_with(bundle, def, chosen, sizeof chosen / sizeof chosen[0], scene, error);
#else
  return palpate_scene_create_with(bundle, def, NULL, 0, scene, error);
#endif
}

static int press(palpate_scene* scene) {
  const size_t bytes = palpate_contacts_bytes(scene);
  palpate_contacts* contacts = malloc(bytes);
  palpate_step_flags flags = 0;
  double force;
  int step;
  for (step = 0; step <= 40; ++step) {
    const double point[3] = {0.062 - 1e-4 * step, 0.024, 0.021};
    palpate_tool tool = palpate_default_tool();
    tool.points = point, tool.point_count = 1, tool.disc_radius = 0.004;
    flags |= palpate_scene_touch(scene, &tool, 1, 1e-3, contacts, bytes);
  }
  force = palpate_contacts_tool(contacts, 0)->force[0];
  printf("%.17g N, flags %u\n", force, (unsigned)flags);
  free(contacts);
  return force > 0 ? 0 : 1;
}

int main(int count, char** arguments) {
  palpate_scene_def def = palpate_default_scene_def(), other = def;
  palpate_bundle* bundle = NULL;
  palpate_scene* scene = NULL;
  palpate_error error = {PALPATE_OK, 0, ""};
  int result = 1;
  if (count != 2) return 2;
  /* Motions are in nobody's list, and not in the bundle. */
  other.motions = 1, other.collision = PALPATE_COLLISION_DEFORMED;
  if (palpate_bundle_open_file(arguments[1], NULL, &bundle, &error) == PALPATE_OK &&
      create(bundle, &other, &scene, &error) == PALPATE_ERROR_EFFECT &&
      create(bundle, &def, &scene, &error) == PALPATE_OK)
    result = press(scene);
  else
    printf("%s\n", error.text);
  palpate_scene_destroy(scene);
  palpate_bundle_close(bundle);
  return result;
}
