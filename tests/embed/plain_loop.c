/* A host in one plain loop: an organ that lies turned in the world and breathes, two tools, the contacts' events, and what is under
 * the mouse. A probe presses the organ, drags over it and lifts; a forceps pulls at the place that the mouse picked. */
#include <math.h>
#include <palpate/palpate.h>
#include <palpate/palpate_pose.h>
#include <palpate/palpate_queries.h>
#include <palpate/palpate_report.h>
#include <stdio.h>
#include <stdlib.h>

enum { PROBE = 7, FORCEPS = 8 }; /* the tools' ids: they may come in any order */

static double place_along(double low, double high, double share) {
  return low + share * (high - low);
}

/* What the mouse points at: a ray from a camera above the organ, in the organ's frame (palpate_point_to_organ and
 * palpate_vector_to_organ take it there from the world). x and y: 0 .. 1 over the organ's box. */
static palpate_surface_hit pick(palpate_scene* scene, const palpate_contacts* contacts, const double low[3],
                                const double high[3], double x, double y) {
  const double eye[3] = {place_along(low[0], high[0], x), place_along(low[1], high[1], y), high[2] + 0.2};
  const double down[3] = {0, 0, -1};
  palpate_surface_hit hit = palpate_default_surface_hit();
  palpate_scene_cast_ray(scene, contacts, eye, down, INFINITY, &hit);
  return hit;
}

static void tell(const palpate_contact_report* report, int ms) {
  for (int32_t e = 0; e < report->event_count; ++e) {
    const palpate_contact_event* event = palpate_report_event(report, e);
    const char* words[] = {"", "touches", "lets go", "begins to slip", "sticks again"};
    const char* name = event->tool_id == PROBE ? "probe" : "forceps";
    printf("%4d ms  the %s %s at triangle %d", ms, name, words[event->kind], event->triangle);
    if (event->kind == PALPATE_EVENT_BEGIN) {
      const double* v = palpate_report_contact(report, event->contact)->velocity;
      printf(", at %.2f m/s", sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])); /* here: the loudness of a sound */
    }
    printf("\n");
  }
}

int main(int argc, char** argv) {
  palpate_error error = {PALPATE_OK, 0, "usage: plain_loop BUNDLE.h5"};
  palpate_bundle* bundle = NULL;
  palpate_scene* scene = NULL;
  palpate_scene_def def = palpate_default_scene_def();
  palpate_queries_def queries = palpate_default_queries_def();
  palpate_report_def report = palpate_default_report_def();
  def.collision = PALPATE_COLLISION_DEFORMED, def.law = PALPATE_LAW_COULOMB;
  palpate_add_part(&def.parts, &queries.part), palpate_add_part(&def.parts, &report.part);
  if (argc != 2 || palpate_bundle_open_file(argv[1], NULL, &bundle, &error) != PALPATE_OK ||
      palpate_scene_create(bundle, &def, &scene, &error) != PALPATE_OK)
    return fprintf(stderr, "%s\n", error.text), 2;
  const int32_t nodes = palpate_bundle_describe(bundle).surface_node_count;
  const double* node = palpate_bundle_nodes(bundle);
  double low[3], high[3];
  for (int d = 0; d < 3; ++d) low[d] = high[d] = node[d];
  for (int32_t n = 0; n < 3 * nodes; ++n)
    low[n % 3] = fmin(low[n % 3], node[n]), high[n % 3] = fmax(high[n % 3], node[n]);

  const size_t bytes = palpate_contacts_bytes(scene);
  palpate_contacts* contacts = malloc(bytes);
  palpate_shape_out shape = palpate_default_shape_out();
  float* normals = malloc(sizeof(float) * 3 * (size_t)nodes);
  shape.positions = malloc(sizeof(float) * 3 * (size_t)nodes), shape.node_capacity = nodes;

  /* The mouse picks two places on the organ at rest (no contacts yet: NULL). */
  const palpate_surface_hit pressed = pick(scene, NULL, low, high, 0.6, 0.4),
                            pulled = pick(scene, NULL, low, high, 0.8, 0.7);
  if (!pressed.hit || !pulled.hit) return fprintf(stderr, "the mouse is beside the organ\n"), 1;

  /* The organ lies turned by a quarter about z. It breathes: up and down by 0.5 mm, once in 0.4 s. */
  const double turned[4] = {sqrt(0.5), 0, 0, sqrt(0.5)}, lies[3] = {0.5, 0.2, 0.9};
  palpate_pose pose = palpate_default_pose();
  for (int i = 0; i < 4; ++i) pose.orientation[i] = turned[i];

  double deepest = 0;
  for (int ms = 1; ms <= 600; ++ms) {
    /* The probe: 4 mm down within 200 ms, 10 mm aside within 200 ms, up again. The forceps pulls 3 mm between 100 and 500 ms. */
    const double down = ms <= 200 ? 0.025e-3 * ms : ms <= 400 ? 0.005 : 0.005 - 0.05e-3 * (ms - 400);
    const double aside = 0.05e-3 * (ms <= 200 ? 0 : ms <= 400 ? ms - 200 : 200);
    double tip_on_organ[3] = {pressed.point[0] - aside, pressed.point[1], pressed.point[2] + 0.001 - down};
    double tip[3]; /* in the world: here from the organ's place at rest, in your host from the device */
    palpate_point_to_world(lies, turned, tip_on_organ, tip);
    palpate_grip grip = palpate_default_grip();
    grip.kind = PALPATE_GRIP_SURFACE_POINT, grip.triangle = pulled.triangle;
    for (int v = 0; v < 3; ++v) grip.barycentric[v] = pulled.barycentric[v];
    grip.displacement[2] = 0.003 * fmin(1, fmax(0, (ms - 100) / 100.0));
    palpate_tool probe = palpate_default_tool(), forceps = palpate_default_tool();
    probe.id = PROBE, probe.points = tip, probe.point_count = 1, probe.disc_radius = 0.003, probe.friction = 0.2;
    forceps.id = FORCEPS, forceps.grips = &grip, forceps.grip_count = ms > 100 && ms <= 500;
    const palpate_tool tools[2] = {ms % 2 ? probe : forceps, ms % 2 ? forceps : probe};

    for (int d = 0; d < 3; ++d) pose.position[d] = lies[d];
    pose.position[2] += 0.0005 * sin(2 * 3.14159265 * ms / 400.0);
    if (palpate_scene_set_pose(scene, &pose, &error) != PALPATE_OK) return fprintf(stderr, "%s\n", error.text), 2;
    palpate_scene_touch(scene, tools, 2, 0.001, contacts, bytes);
    tell(palpate_scene_report(scene), ms); /* after every step, because the next one writes over the events */

    if (ms % 16 == 0) { /* 60 Hz: draw, and look under the mouse on the surface that is drawn */
      palpate_scene_shape(scene, contacts, &shape);
      palpate_scene_normals(scene, &shape, normals, nodes);
      const palpate_surface_hit under = pick(scene, contacts, low, high, 0.6, 0.4);
      if (under.hit) deepest = fmax(deepest, high[2] - under.point[2]);
    }
  }
  printf("under the mouse the organ went down by %.1f mm\n", 1000 * deepest);
  free(normals), free(shape.positions), free(contacts), palpate_scene_destroy(scene), palpate_bundle_close(bundle);
  return 0;
}
