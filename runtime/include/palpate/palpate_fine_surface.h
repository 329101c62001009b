/* palpate_fine_surface.h - a finer surface that tools meet in place of the bundle's triangles.
 *
 *     palpate_fine_surface surface = palpate_default_fine_surface();
 *     surface.vertex_count = vertex_count, surface.positions = positions;
 *     surface.triangle_count = triangle_count, surface.triangles = triangles;
 *     palpate_scene_def def = palpate_default_scene_def();
 *     palpate_add_part(&def.parts, &surface.part);
 *     palpate_scene_create(bundle, &def, &scene, &error);
 */
#ifndef PALPATE_FINE_SURFACE_H
#define PALPATE_FINE_SURFACE_H

#include "palpate.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A finer surface of the organ, which tools meet in place of the bundle's triangles: collision, the places and normals of contacts,
 * the directions of contact laws and discs, the report and the queries are those of this surface. The mechanics stay those of
 * the bundle: a contact acts on the nodes below its place. Give the surface that is drawn: its vertices move as those of the same
 * render mesh, apart from what the mesh stretches (docs/method.md, section 9). Grips and the shape stay on the bundle's triangles.
 * Creating the scene binds each vertex to the surface point that is nearest to it on the meshed shape. Refused: a surface that is
 * not closed, is inside out, has a vertex that is not finite or farther from the mesh than a mean edge of the mesh. Needs collision or
 * queries. A struct in which nothing is set is off. */
typedef struct palpate_fine_surface {
  palpate_part part;
  const float* positions; /* [vertex_count][3] m, in the bundle's frame, on the shape as it was meshed            */
  const int32_t*
      triangles;          /* [triangle_count][3] vertices, counter-clockwise from outside; each edge in two triangles */
  int32_t vertex_count;   /* 4 .. 10 million                                                                      */
  int32_t triangle_count; /* 4 .. 20 million                                                                      */
} palpate_fine_surface;
PALPATE_API void palpate_init_fine_surface(palpate_fine_surface* surface, size_t struct_bytes);
static inline palpate_fine_surface palpate_default_fine_surface(void) {
  palpate_fine_surface surface;
  palpate_init_fine_surface(&surface, sizeof surface);
  return surface;
}

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_FINE_SURFACE_H */
