/* palpate_queries.h - rays, nearest points and distances, on the surface at rest and deformed.
 *
 *     palpate_scene_def def = palpate_default_scene_def();
 *     palpate_queries_def queries = palpate_default_queries_def();
 *     palpate_add_part(&def.parts, &queries.part);
 *     palpate_scene_create(bundle, &def, &scene, &error);
 *     palpate_scene_touch(scene, tools, tool_count, dt, contacts, contacts_bytes);
 *     palpate_surface_hit hit = palpate_default_surface_hit();
 *     palpate_scene_cast_ray(scene, contacts, eye, direction, 1.0, &hit); // within 1 m
 *     if (hit.hit) distance = hit.distance; // m
 */
#ifndef PALPATE_QUERIES_H
#define PALPATE_QUERIES_H

#include "palpate.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Whether the scene answers queries about its surface (palpate_scene_cast_ray and others). */
typedef enum palpate_query_model {
  PALPATE_QUERIES_OFF, /* no queries, and no memory for them                                                       */
  PALPATE_QUERIES_ON   /* rays, nearest points and distances, on the surface at rest and deformed                  */
} palpate_query_model;
typedef struct palpate_queries_def {
  palpate_part part;
  palpate_query_model queries; /* default ON */
  int32_t reserved;            /* 0          */
} palpate_queries_def;
PALPATE_API void palpate_init_queries_def(palpate_queries_def* def, size_t struct_bytes);
static inline palpate_queries_def palpate_default_queries_def(void) {
  palpate_queries_def def;
  palpate_init_queries_def(&def, sizeof def);
  return def;
}

/* What a scene with queries ON says about its surface: for a mouse, for navigation, for a camera that must not enter the organ.
 *
 * Surface  contacts NULL: the surface at rest. Else the surface as these contacts deform it, which is the one that the collision
 *          of the next touch step meets. The radial correction P is not part of it, so under PALPATE_RADIAL_RESPONSE the drawn
 *          surface differs from it. contacts: of this scene's touch step, or of another scene's on the same bundle; those of
 *          another bundle give the surface at rest and OTHER_BUNDLE, damaged ones the surface at rest and BAD_INPUT.
 * Threads  The queries of a scene belong to one thread at a time: that of touch, that of shape, or a third one. They may run at
 *          the same time as touch and shape, and change nothing in either of them.
 * Input    A number that is NaN, a coordinate beyond 1e6 m, a direction of length zero (or below 1e-150), a longest or farthest
 *          distance of zero or below, or a scene without queries: no hit, and BAD_INPUT. INFINITY is a good longest distance.
 * Cost     Microseconds. The first query with new contacts also reads the square of their nodes, 3 x 3 entries each. */
typedef struct palpate_surface_hit {
  uint32_t struct_bytes; /* sizeof(palpate_surface_hit)                                                              */
  int32_t hit;           /* 1: a surface point was found; 0: none, and all that follows is zero, triangle is -1      */
  int32_t triangle;      /* 0 .. F-1; under a fine_surface the one below the point                                   */
  int32_t reserved;      /* 0                                                                                        */
  double barycentric[3]; /* weights of the triangle's three vertices, that sum to 1: a palpate_grip takes them       */
  double point[3];       /* m                                                                                        */
  double
      normal[3]; /* outward unit normal of the triangle as it is deformed, of the fine_surface where there is one; zero
                            where it has no area                                                                     */
  double distance; /* m                                                                                        */
} palpate_surface_hit;
PALPATE_API void palpate_init_surface_hit(palpate_surface_hit* hit, size_t struct_bytes);
static inline palpate_surface_hit palpate_default_surface_hit(void) {
  palpate_surface_hit hit;
  palpate_init_surface_hit(&hit, sizeof hit);
  return hit;
}

/* The first point where the ray passes through the surface, at most `longest` metres along it, from outside or from inside: a
 * normal that points along the direction tells that the ray leaves the organ there. origin: [3] m; direction: [3] of any length.
 * Exact arithmetic decides, so that a ray through an edge or a vertex passes through one triangle there and through no gap. A
 * ray that only touches an edge or lies in a triangle's plane passes by that triangle. A ray that starts exactly on a triangle
 * may or may not pass through it: start it a little in front. */
PALPATE_API palpate_step_flags palpate_scene_cast_ray(palpate_scene* scene, const palpate_contacts* contacts,
                                                      const double* origin, const double* direction, double longest,
                                                      palpate_surface_hit* hit);
/* The surface point that is nearest to a point, if it is nearer than `farthest` metres. point: [3] m. Of several triangles at
 * the same distance, the first one counts. */
PALPATE_API palpate_step_flags palpate_scene_closest_point(palpate_scene* scene, const palpate_contacts* contacts,
                                                           const double* point, double farthest,
                                                           palpate_surface_hit* hit);
/* The distance of a point from the surface, m, below zero inside; 0 on the surface. A point is inside where the surface winds
 * around it, so a place where the deformed surface overlaps itself is inside. *distance is INFINITY where there is none. */
PALPATE_API palpate_step_flags palpate_scene_signed_distance(palpate_scene* scene, const palpate_contacts* contacts,
                                                             const double* point, double* distance);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_QUERIES_H */
