/* A host in C whose answers are printed to the bit. Built twice, once with -ffast-math: both must print the same. Its input
 * is multiples of powers of two, which no freedom in arithmetic changes; what is no number comes from bit patterns. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <palpate/palpate.h>

static double from_bits(uint64_t bits) {
  double x;
  memcpy(&x, &bits, sizeof x);
  return x;
}

static void print_bits(const double* x, int count) {
  for (int i = 0; i < count; ++i) {
    uint64_t bits;
    memcpy(&bits, x + i, sizeof bits);
    printf(" %016" PRIx64, bits);
  }
}

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  palpate_bundle* bundle = NULL;
  palpate_scene* scene = NULL;
  palpate_error error;
  if (palpate_bundle_open_file(argv[1], NULL, &bundle, &error) != PALPATE_OK)
    return fprintf(stderr, "%s\n", error.text), 1;
  palpate_scene_def def = palpate_default_scene_def();
  def.collision = PALPATE_COLLISION_DEFORMED;
  def.law = PALPATE_LAW_COULOMB;
  def.force = PALPATE_FORCE_RESPONSE;
  def.radial = PALPATE_RADIAL_RESPONSE;
  if (palpate_scene_create(bundle, &def, &scene, &error) != PALPATE_OK) return fprintf(stderr, "%s\n", error.text), 1;
  palpate_contacts* contacts = aligned_alloc(8, palpate_contacts_bytes(scene) / 8 * 8 + 8);
  const int32_t nodes = palpate_bundle_describe(bundle).surface_node_count;
  float* displacement = malloc(3 * (size_t)nodes * sizeof *displacement);
  if (!contacts || !displacement) return 1;
  const uint64_t odd[] = {0x7ff8000000000000, 0xfff8000000000000, 0x7ff0000000000001, 0x7ff0000000000000,
                          0xfff0000000000000, 0x7fefffffffffffff, 0x8000000000000000};
  const double metre = 1.0 / 65536; /* 15 micrometres */
  for (int step = 0; step < 400; ++step) {
    const int down = step < 200 ? step : 400 - step;
    /* The far face of the box is at x = 0.06 m. */
    double point[3] = {3960 * metre - down * metre, 1500 * metre + step * metre, 1300 * metre};
    palpate_tool tool = palpate_default_tool();
    tool.points = point, tool.point_count = 1, tool.disc_radius = 256 * metre, tool.friction = 0.25;
    double dt = 1.0 / 1024;
    const double bad = from_bits(odd[step / 5 % 7]);
    if (step % 5 == 1) point[step % 3] = bad;
    if (step % 35 == 2) tool.disc_radius = bad;
    if (step % 35 == 3) dt = bad;
    const palpate_step_flags flags = palpate_scene_touch(scene, &tool, 1, dt, contacts, palpate_contacts_bytes(scene));
    printf("%d %u", step, flags);
    print_bits(palpate_contacts_tool(contacts, 0)->force, 3);
    print_bits(palpate_contacts_tool(contacts, 0)->force_raw, 3);
    palpate_shape_out out = palpate_default_shape_out();
    out.displacements = displacement, out.node_capacity = nodes;
    palpate_scene_shape(scene, contacts, &out);
    uint64_t hash = 1469598103934665603u;
    for (int32_t i = 0; i < 3 * out.node_count; ++i) {
      uint32_t bits;
      memcpy(&bits, displacement + i, sizeof bits);
      hash = (hash ^ bits) * 1099511628211u;
    }
    printf(" %016" PRIx64 "\n", hash);
  }
  free(displacement);
  free(contacts);
  palpate_scene_destroy(scene);
  palpate_bundle_close(bundle);
  return 0;
}
