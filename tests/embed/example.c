#include <palpate/palpate.h>
#include <stdio.h>
#include <stdlib.h>

int main(int argc, char** argv) {
  palpate_error error = {PALPATE_OK, 0, "usage: example BUNDLE.h5"};
  palpate_bundle* bundle = NULL;
  palpate_scene* scene = NULL;
  palpate_scene_def def = palpate_default_scene_def();
  if (argc != 2 || palpate_bundle_open_file(argv[1], &bundle, &error) != PALPATE_OK ||
      palpate_scene_create(bundle, &def, &scene, &error) != PALPATE_OK)
    return fprintf(stderr, "%s\n", error.text), 2;

  palpate_grip grip = {.node = palpate_bundle_touchable(bundle)[0], .displacement = {0, 0, -0.002}, .axes = 7};
  palpate_tool tool = {.grips = &grip, .grip_count = 1};
  palpate_contacts* contacts = malloc(palpate_contacts_bytes(scene));
  palpate_step_flags flags = palpate_touch(scene, &tool, 1, 0.001, contacts); /* the haptic loop, 1 kHz */
  const double* force = contacts->tools[0].force_raw;
  printf("node %d, 2 mm down: %.4f %.4f %.4f N, flags %u\n", grip.node, force[0], force[1], force[2], flags);

  palpate_shape_out shape = {.node_capacity = palpate_bundle_describe(bundle).surface_node_count};
  shape.positions = malloc(sizeof(float) * 3 * (size_t)shape.node_capacity);
  flags = palpate_shape(scene, contacts, &shape); /* the render loop, 60 Hz */
  printf("%d nodes drawn, flags %u\n", shape.node_count, flags);
  free(shape.positions), free(contacts), palpate_scene_destroy(scene), palpate_bundle_close(bundle);
  return 0;
}
