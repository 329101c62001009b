/* A simulated device presses an organ that is made a hundred times stiffer, once with the organ's force as it is and once through
 * the virtual coupling; a passivity observer and a watchdog stand before the device. */
#include <math.h>
#include <palpate/palpate.h>
#include <palpate/palpate_passivity.h>
#include <palpate/palpate_watchdog.h>
#include <stdio.h>
#include <stdlib.h>

/* The handle and the hand on it: 200 N/m and 2 N s/m. `late` holds the force of the last tick: one tick of delay. */
typedef struct handle {
  double position[3], velocity[3], late[3];
} handle;

static void move_handle(handle* h, const palpate_device* device, const double force[3], const double hand[3]) {
  for (int d = 0; d < 3; ++d) {
    for (int i = 0; i < 50; ++i) {
      const double pull = 200 * (hand[d] - h->position[d]) - (2 + device->damping) * h->velocity[d];
      h->velocity[d] += device->tick / 50 * (h->late[d] + pull) / device->mass;
      h->position[d] += device->tick / 50 * h->velocity[d];
    }
    h->late[d] = force[d];
  }
}

/* The middle of a triangle that can be touched, and the direction into the organ. */
static void aim(const palpate_bundle* bundle, double place[3], double inward[3]) {
  const int32_t half = palpate_bundle_describe(bundle).touchable_count / 2, k = palpate_bundle_touchable(bundle)[half];
  const double* node = palpate_bundle_nodes(bundle);
  const int32_t* t = palpate_bundle_triangles(bundle);
  while (t[0] != k && t[1] != k && t[2] != k) t += 3;
  const double *a = node + 3 * t[0], *b = node + 3 * t[1], *c = node + 3 * t[2];
  double n[3], length = 0;
  for (int d = 0; d < 3; ++d) {
    const int e = (d + 1) % 3, f = (d + 2) % 3;
    n[d] = (b[e] - a[e]) * (c[f] - a[f]) - (b[f] - a[f]) * (c[e] - a[e]), length += n[d] * n[d];
  }
  for (int d = 0; d < 3; ++d) inward[d] = -n[d] / sqrt(length), place[d] = (a[d] + b[d] + c[d]) / 3;
}

/* How much the force on the device varies in the last half second of two, N. The hand goes 4 mm into the organ. */
static double press(const palpate_bundle* bundle, palpate_scene* scene, int coupled, palpate_device_flags* raised) {
  palpate_device device = palpate_default_device(); /* 1 kHz, one tick of delay, 3 N, 2 m/s */
  device.mass = 0.1, device.damping = 0.5;          /* measure yours */
  palpate_coupling coupling;
  palpate_passivity passivity;
  palpate_watchdog watchdog;
  palpate_error error;
  if (palpate_coupling_init(&coupling, &device, NULL, &error) != PALPATE_OK ||
      palpate_passivity_init(&passivity, &device, NULL, &error) != PALPATE_OK ||
      palpate_watchdog_init(&watchdog, NULL, &error) != PALPATE_OK)
    return fprintf(stderr, "%s\n", error.text), NAN;

  const size_t bytes = palpate_contacts_bytes(scene);
  palpate_contacts* contacts = malloc(bytes);
  double place[3], inward[3], tool[3], organ_force[3] = {0, 0, 0}, force[3] = {0, 0, 0}, least = INFINITY, most = 0;
  aim(bundle, place, inward);
  handle h = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  for (int d = 0; d < 3; ++d) h.position[d] = place[d] - 0.002 * inward[d];
  palpate_scene_reset(scene);
  for (int ms = 0; ms < 2000; ++ms) {
    if (coupled)
      *raised |= palpate_coupling_step(&coupling, h.position, organ_force, tool, force);
    else
      for (int d = 0; d < 3; ++d) tool[d] = h.position[d];
    palpate_tool probe = palpate_default_tool();
    probe.points = tool, probe.point_count = 1, probe.disc_radius = 0.003;
    const palpate_step_flags flags = palpate_scene_touch(scene, &probe, 1, device.tick, contacts, bytes);
    const int trusted = !(flags & (PALPATE_STEP_BUNDLE_LOST | PALPATE_STEP_UNSOLVED));
    for (int d = 0; d < 3; ++d) organ_force[d] = trusted ? 100 * palpate_contacts_tool(contacts, 0)->force_raw[d] : 0;
    if (!coupled)
      for (int d = 0; d < 3; ++d) force[d] = organ_force[d];
    *raised |= palpate_watchdog_step(&watchdog, contacts->step, force, device.tick, force);
    *raised |= palpate_passivity_step(&passivity, h.position, force, coupled ? coupling.energy : 0, force);

    double hand[3],
        length = 0; /* in your host: send `force` to the device, wait for the next tick, read its position */
    for (int d = 0; d < 3; ++d) hand[d] = place[d] + (-0.002 + 0.006 * fmin(1, ms / 200.0)) * inward[d];
    move_handle(&h, &device, force, hand);
    for (int d = 0; d < 3; ++d) length += force[d] * force[d];
    if (ms >= 1500) least = fmin(least, sqrt(length)), most = fmax(most, sqrt(length));
  }
  free(contacts);
  return most - least;
}

int main(int argc, char** argv) {
  palpate_error error = {PALPATE_OK, 0, "usage: device_loop BUNDLE.h5"};
  palpate_bundle* bundle = NULL;
  palpate_scene* scene = NULL;
  palpate_scene_def def = palpate_default_scene_def();
  if (argc != 2 || palpate_bundle_open_file(argv[1], NULL, &bundle, &error) != PALPATE_OK ||
      palpate_scene_create(bundle, &def, &scene, &error) != PALPATE_OK)
    return fprintf(stderr, "%s\n", error.text), 2;
  palpate_device_flags plain_flags = 0, coupled_flags = 0;
  const double plain = press(bundle, scene, 0, &plain_flags), coupled = press(bundle, scene, 1, &coupled_flags);
  printf("as it is: the force varies by %.3f N, flags %u\n", plain, plain_flags);
  printf("coupled:  the force varies by %.3f N, flags %u\n", coupled, coupled_flags);
  palpate_scene_destroy(scene), palpate_bundle_close(bundle);
  return plain > 1 && plain_flags & PALPATE_DEVICE_ACTIVE && coupled < 1e-3 && coupled_flags == 0 ? 0 : 1;
}
