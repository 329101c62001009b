/* chosen_effects BUNDLE: a host whose definition has the parts of the effects that it is compiled for (RELAXATION, NEEDLES, ALL; else none), all
 * switched off. It presses the box of write_tiny_bundle 2 mm deep and prints the force. check_linked_effects.py looks at what its linker took. */
#include <palpate/palpate.h>
#include <palpate/palpate_keys.h>
#include <palpate/palpate_needles.h>
#include <palpate/palpate_relaxation.h>
#include <stdio.h>
#include <stdlib.h>

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
  palpate_scene_def def = palpate_default_scene_def();
  palpate_bundle* bundle = NULL;
  palpate_scene* scene = NULL;
  palpate_error error = {PALPATE_OK, 0, ""};
  int result = 1;
#ifdef RELAXATION
  palpate_relaxation_def relaxation = palpate_default_relaxation_def();
  palpate_add_part(&def.parts, &relaxation.part);
#endif
#ifdef NEEDLES
  palpate_needles_def needles = palpate_default_needles_def();
  needles.needles = 0; /* the bundle has no corridor */
  palpate_add_part(&def.parts, &needles.part);
#endif
#ifdef ALL
  palpate_add_all_parts(&def, malloc(palpate_all_parts_bytes())); /* until the program ends */
#endif
  if (count != 2) return 2;
  if (palpate_bundle_open_file(arguments[1], NULL, &bundle, &error) == PALPATE_OK &&
      palpate_scene_create(bundle, &def, &scene, &error) == PALPATE_OK)
    result = press(scene);
  else
    printf("%s\n", error.text);
  palpate_scene_destroy(scene);
  palpate_bundle_close(bundle);
  return result;
}
