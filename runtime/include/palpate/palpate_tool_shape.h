/* palpate_tool_shape.h - rigid instruments with a shape, made into tool points.
 *
 * A scene tests points against the organ. A tool shape is the surface of a rigid body, sampled with points once, when it is created.
 * In each step palpate_tool_shape_place takes the points to the tool's pose and fills a palpate_tool; the touch then states the
 * force on the tool and the torque about the origin of the shape's frame, both summed over the points:
 *     palpate_tool_shape_place(instrument, position, orientation, &tool);
 *     palpate_scene_touch(scene, &tool, 1, dt, contacts, contacts_bytes);
 *     const double* torque = palpate_contacts_tool(contacts, 0)->torque; // N m
 * - Each point presses a disc on the organ (contact PATCH, the default) of the area that the point stands for. So the force belongs to
 *   the shape, and a finer spacing changes it little: docs/method.md has the figures.
 * - Let the law be UNILATERAL, or COULOMB with friction: under STICKING and SLIDING the points beside the deepest ones pull.
 * - The same definition gives the same points, in the same order, in every build. So a point keeps its contact from step to step.
 * - Features of the organ that are smaller than the spacing, such as a sharp edge, reach in between the points. A sphere of radius R
 *   touches later than the true one by at most spacing^2 / (4 R).
 */
#ifndef PALPATE_TOOL_SHAPE_H
#define PALPATE_TOOL_SHAPE_H

#include "palpate.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct palpate_tool_shape palpate_tool_shape;

typedef enum palpate_tool_shape_kind {
  PALPATE_TOOL_POINT,   /* the origin, with a disc of `radius`                                                    */
  PALPATE_TOOL_SPHERE,  /* of `radius` about the origin                                                           */
  PALPATE_TOOL_CAPSULE, /* all within `radius` of the line of `length` along z whose middle is the origin           */
  PALPATE_TOOL_HULL,    /* the smallest convex body around the vertices: 4 to 256, not all in one plane             */
  PALPATE_TOOL_MESH     /* the triangles over the vertices; closed or open, of any sense                            */
} palpate_tool_shape_kind;

/* The most points that a shape may have. */
#define PALPATE_MAX_TOOL_SHAPE_POINTS 4096

typedef struct palpate_tool_shape_def {
  uint32_t struct_bytes;        /* sizeof(palpate_tool_shape_def)                                                   */
  palpate_tool_shape_kind kind; /* default SPHERE                                                                   */
  double radius;                /* m, above 0: of POINT (0 .. 1), SPHERE and CAPSULE                                */
  double length;                /* m, 0 or more: of CAPSULE                                                         */
  double spacing;               /* m, above 0: no place of the surface is farther than that from a point            */
  const double* vertices;       /* [vertex_count][3] m, of HULL and MESH; read by palpate_tool_shape_create alone   */
  const int32_t* triangles;     /* [triangle_count][3] vertices, of MESH                                            */
  int32_t vertex_count;         /* default 0                                                                        */
  int32_t triangle_count;       /* default 0                                                                        */
  int32_t max_points; /* default 64 [1 .. 4096]: points that the shape may have. The scene's max_points must hold the
                                   points of all its tools                                                          */
  int32_t reserved;   /* 0                                                                                */
  palpate_allocator allocator; /* default NULL, NULL, NULL                                                         */
} palpate_tool_shape_def;
PALPATE_API void palpate_init_tool_shape_def(palpate_tool_shape_def* def, size_t struct_bytes);
static inline palpate_tool_shape_def palpate_default_tool_shape_def(void) {
  palpate_tool_shape_def def;
  palpate_init_tool_shape_def(&def, sizeof def);
  return def;
}

/* Samples the surface and takes all memory. Where the shape needs more than max_points points it is refused with a sentence that
 * says how many it needs. error may be NULL. Returns PALPATE_OK, or the reason, in which case *shape is NULL. */
PALPATE_API palpate_status palpate_tool_shape_create(const palpate_tool_shape_def* def, palpate_tool_shape** shape,
                                                     palpate_error* error);
PALPATE_API void palpate_tool_shape_destroy(palpate_tool_shape* shape);

PALPATE_API int32_t palpate_tool_shape_point_count(const palpate_tool_shape* shape);
/* [point_count][3] m, in the shape's frame, until the shape is destroyed. */
PALPATE_API const double* palpate_tool_shape_points(const palpate_tool_shape* shape);
/* m, of the disc of each point: all discs together have the shape's area. */
PALPATE_API double palpate_tool_shape_patch_radius(const palpate_tool_shape* shape);

/* Takes the points to the tool's pose in the world (m, quaternion w x y z of length 1 within 0.001) and sets points, point_count,
 * disc_radius, has_torque and reference of *tool; its other fields stay. The points belong to the shape and last until it is
 * placed again, so two tools of a step need two shapes. A pose that is none makes the touch say BAD_INPUT, and the tool keeps
 * its last good place. Never allocates or locks. Cost: a nanosecond or two for each point. */
PALPATE_API void palpate_tool_shape_place(palpate_tool_shape* shape, const double position[3],
                                          const double orientation[4], palpate_tool* tool);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_TOOL_SHAPE_H */
