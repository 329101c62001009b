#include <palpate/palpate.h>
#include <stdio.h>
#include <stdlib.h>

/* A place in a triangle that can be touched; not displaced yet. */
static palpate_grip place_on(const palpate_bundle* bundle) {
  const int32_t half = palpate_bundle_describe(bundle).touchable_count / 2, k = palpate_bundle_touchable(bundle)[half];
  palpate_grip grip = palpate_default_grip();
  grip.kind = PALPATE_GRIP_SURFACE_POINT, grip.triangle = 0;
  grip.barycentric[0] = grip.barycentric[1] = 0.25, grip.barycentric[2] = 0.5;
  for (const int32_t* t = palpate_bundle_triangles(bundle); t[0] != k && t[1] != k && t[2] != k; t += 3)
    ++grip.triangle;
  return grip;
}

int main(int argc, char** argv) {
  palpate_error error = {PALPATE_OK, 0, ""};
  palpate_bundle* bundle = NULL;
  palpate_scene* scene = NULL;
  if (argc != 2) return fprintf(stderr, "usage: example BUNDLE.h5\n"), 2;

  palpate_scene_def def = palpate_default_scene_def(); /* then change what you need */
  if (palpate_bundle_open_file(argv[1], NULL, &bundle, &error) != PALPATE_OK ||
      palpate_scene_create(bundle, &def, &scene, &error) != PALPATE_OK)
    return fprintf(stderr, "%s\n", error.text), 2;
  const size_t contacts_bytes = palpate_contacts_bytes(scene);
  palpate_contacts* contacts = malloc(contacts_bytes);
  palpate_shape_out shape = palpate_default_shape_out();
  shape.node_capacity = palpate_bundle_describe(bundle).surface_node_count;
  shape.positions = malloc(sizeof(float) * 3 * (size_t)shape.node_capacity);

  /* The haptic loop, 1 kHz: a disc of 3 mm radius holds a place of the surface 2 mm lower. */
  palpate_grip grip = place_on(bundle);
  grip.displacement[2] = -0.002;
  palpate_tool tool = palpate_default_tool();
  tool.grips = &grip, tool.grip_count = 1, tool.disc_radius = 0.003;
  palpate_step_flags flags = palpate_scene_touch(scene, &tool, 1, 0.001, contacts, contacts_bytes);
  const double* force = palpate_contacts_tool(contacts, 0)->force_raw;
  printf("%.4f %.4f %.4f N, flags %u\n", force[0], force[1], force[2], flags);

  /* The render loop, 60 Hz: where the surface is now. */
  flags = palpate_scene_shape(scene, contacts, &shape);
  printf("%d nodes drawn, flags %u\n", shape.node_count, flags);

  free(shape.positions), free(contacts), palpate_scene_destroy(scene), palpate_bundle_close(bundle);
  return 0;
}
