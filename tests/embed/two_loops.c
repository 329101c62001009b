/* Two loops on one scene: a haptic thread at 1 kHz and a render thread at 60 Hz; contacts pass through a mailbox. */
#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <palpate/palpate.h>
#include <palpate/palpate_mailbox.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

typedef struct host {
  palpate_scene* scene;
  palpate_mailbox* mailbox;
  size_t contacts_bytes;
  double start[3], inward[3]; /* the stand-in for a device moves from start along inward, 10 mm in half a second */
  atomic_bool stop;
  double largest_force; /* N, written by the haptic thread, read after it has ended */
} host;

static void wait_until(struct timespec* next, long nanoseconds) {
  next->tv_nsec += nanoseconds;
  if (next->tv_nsec >= 1000000000L) next->tv_nsec -= 1000000000L, next->tv_sec += 1;
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, next, NULL);
}

static void* haptic_loop(void* argument) {
  host* h = argument;
  struct timespec next;
  clock_gettime(CLOCK_MONOTONIC, &next);
  for (int ms = 0; !atomic_load(&h->stop); ++ms) {
    double position[3]; /* read the device here: metres, in the bundle's frame */
    for (int d = 0; d < 3; ++d) position[d] = h->start[d] + h->inward[d] * 0.01 * (ms < 500 ? ms / 500.0 : 1.0);

    palpate_tool probe = palpate_default_tool();
    probe.points = position, probe.point_count = 1, probe.disc_radius = 0.003;
    palpate_contacts* contacts = palpate_mailbox_slot(h->mailbox);
    palpate_step_flags flags = palpate_scene_touch(h->scene, &probe, 1, 0.001, contacts, h->contacts_bytes);
    palpate_mailbox_publish(h->mailbox);

    double force[3] = {0, 0, 0}; /* send `force` to the device here, newtons; never force_raw */
    if (!(flags & (PALPATE_STEP_BUNDLE_LOST | PALPATE_STEP_UNSOLVED)))
      for (int d = 0; d < 3; ++d) force[d] = palpate_contacts_tool(contacts, 0)->force[d];
    h->largest_force = fmax(h->largest_force, sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2]));
    wait_until(&next, 1000000L);
  }
  return NULL;
}

/* The middle of a triangle that can be touched, 2 mm above it, and the direction into the organ. */
static void aim(const palpate_bundle* bundle, host* h) {
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
  for (int d = 0; d < 3; ++d) h->inward[d] = -n[d] / sqrt(length);
  for (int d = 0; d < 3; ++d) h->start[d] = (a[d] + b[d] + c[d]) / 3 - 0.002 * h->inward[d];
}

int main(int argc, char** argv) {
  palpate_error error = {PALPATE_OK, 0, "usage: two_loops BUNDLE.h5"};
  palpate_bundle* bundle = NULL;
  host h = {0};
  palpate_scene_def def = palpate_default_scene_def();
  def.collision = PALPATE_COLLISION_DEFORMED;
  def.force_limit = 3;  /* N: what the device and its user may get at most */
  def.force_slew = 300; /* N/s */
  if (argc != 2 || palpate_bundle_open_file(argv[1], NULL, &bundle, &error) != PALPATE_OK ||
      palpate_scene_create(bundle, &def, &h.scene, &error) != PALPATE_OK)
    return fprintf(stderr, "%s\n", error.text), 2;
  palpate_bundle_prefault(bundle, 1, NULL); /* no step waits for the disk; works also where memory may not be locked */

  h.contacts_bytes = palpate_contacts_bytes(h.scene);
  const size_t bytes = palpate_mailbox_bytes(h.contacts_bytes);
  void* memory = aligned_alloc(64, (bytes + 63) / 64 * 64);
  h.mailbox = palpate_mailbox_create(memory, h.contacts_bytes);
  aim(bundle, &h);
  pthread_t haptic;
  if (pthread_create(&haptic, NULL, haptic_loop, &h) != 0) return 1;

  palpate_shape_out shape = palpate_default_shape_out();
  shape.node_capacity = palpate_bundle_describe(bundle).surface_node_count;
  shape.positions = malloc(sizeof(float) * 3 * (size_t)shape.node_capacity);
  struct timespec next;
  clock_gettime(CLOCK_MONOTONIC, &next);
  int drawn = 0;
  for (int frame = 0; frame < 45; ++frame) {
    const palpate_contacts* contacts = palpate_mailbox_newest(h.mailbox, NULL);
    if (contacts) palpate_scene_shape(h.scene, contacts, &shape), ++drawn; /* draw shape.positions here */
    wait_until(&next, 16666667L);
  }

  atomic_store(&h.stop, 1);
  pthread_join(haptic, NULL);
  printf("%d frames drawn, largest force %.3f N\n", drawn, h.largest_force);
  free(shape.positions), palpate_scene_destroy(h.scene), free(memory), palpate_bundle_close(bundle);
  return drawn > 0 && h.largest_force > 0 ? 0 : 1;
}
