/* palpate_skin.h - a finer mesh that follows the organ, for a renderer.
 *
 *     palpate_render_mesh mesh = palpate_default_render_mesh();
 *     mesh.vertex_count = vertex_count, mesh.positions = positions;
 *     palpate_scene_def def = palpate_default_scene_def();
 *     palpate_add_part(&def.parts, &mesh.part);
 *     palpate_scene_create(bundle, &def, &scene, &error);
 *     palpate_scene_shape(scene, contacts, &shape);
 *     palpate_skin_out skin = palpate_default_skin_out();
 *     skin.vertex_capacity = vertex_count, skin.positions = drawn;
 *     palpate_scene_skin(scene, &shape, &skin);
 */
#ifndef PALPATE_SKIN_H
#define PALPATE_SKIN_H

#include "palpate_report.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A finer mesh that follows the organ's surface, for a renderer (palpate_scene_skin). Creating the scene binds each vertex to
 * the surface point that is nearest to it on the meshed shape. In a step the vertex moves by the barycentric weights of that
 * point, and its offset from the surface turns and stretches with the surface. Vertices may repeat, as at the seam of a
 * texture, and need no triangles. A vertex that is not finite, or farther from the organ than the organ is large, is refused.
 * Needs a shape. A struct in which nothing is set is off. */
typedef struct palpate_render_mesh {
  palpate_part part;
  const float*
      positions; /* [vertex_count][3] m, in the bundle's frame, on the shape as it was meshed (without preload) */
  int32_t vertex_count; /* 1 or more                                                                            */
  int32_t reserved;     /* 0                                                                                    */
  const float* normals; /* default NULL: palpate_scene_skin gives no normals; else [vertex_count][3] outward, of any
                           length                                                                               */
} palpate_render_mesh;
PALPATE_API void palpate_init_render_mesh(palpate_render_mesh* mesh, size_t struct_bytes);
static inline palpate_render_mesh palpate_default_render_mesh(void) {
  palpate_render_mesh mesh;
  palpate_init_render_mesh(&mesh, sizeof mesh);
  return mesh;
}

/* Whether palpate_scene_skin dents the render mesh below each disc, where the bundle's mesh is too coarse to show it. */
typedef enum palpate_dent_model {
  PALPATE_DENT_OFF, /* the render mesh follows the bundle's surface alone                                         */
  PALPATE_DENT_DISCS /* it also meets the disc of each contact: the closed-form dent of a rigid punch less what the mesh shows
                        of it (docs/method.md, section 18). Needs a render_mesh, contact PATCH and report CONTACTS; it changes
                        what is drawn, and no force                                                                */
} palpate_dent_model;
typedef struct palpate_dent_def {
  palpate_part part;
  palpate_dent_model dent; /* default DISCS */
  int32_t reserved;        /* 0             */
} palpate_dent_def;
PALPATE_API void palpate_init_dent_def(palpate_dent_def* def, size_t struct_bytes);
static inline palpate_dent_def palpate_default_dent_def(void) {
  palpate_dent_def def;
  palpate_init_dent_def(&def, sizeof def);
  return def;
}

/* The caller's arrays; either may be NULL. */
typedef struct palpate_skin_out {
  uint32_t struct_bytes;   /* sizeof(palpate_skin_out)                                                            */
  int32_t vertex_capacity; /* in: room in each array                                                              */
  int32_t vertex_count;    /* out: vertices filled                                                                */
  int32_t reserved;        /* 0                                                                                   */
  float* positions;        /* default NULL; [vertex_capacity][3] m                                                */
  float* normals;          /* default NULL; [vertex_capacity][3] unit length; NULL for a render mesh without normals */
  const palpate_contact_report*
      report; /* default NULL: no dents. With dent DISCS: of the touch step whose contacts made the
                                           shape. Where shape and touch are two threads: a copy of its used_bytes    */
  float*
      disc_normals; /* default NULL; [disc_capacity][3], for each contact of the report: outward unit normal of the plane
                            through its tool_point that its disc is drawn in; zero: no disc                          */
  int32_t disc_capacity; /* in: room in disc_normals                                                                */
  int32_t disc_count;    /* out: contacts filled                                                                    */
} palpate_skin_out;
PALPATE_API void palpate_init_skin_out(palpate_skin_out* out, size_t struct_bytes);
static inline palpate_skin_out palpate_default_skin_out(void) {
  palpate_skin_out out;
  palpate_init_skin_out(&out, sizeof out);
  return out;
}

/* Moves the scene's render mesh with a shape. shape: as palpate_scene_shape filled it; this call reads its displacements and
 * node_count, at least Ns. Call it in the thread of palpate_scene_shape. A node whose displacement is not finite counts as
 * unmoved (BAD_INPUT). A vertex that would not be finite stays where it was bound (UNSOLVED). With dent DISCS and a report, the vertices
 * around each disc then sink to it; a contact or a report that is damaged makes no dent (BAD_INPUT). Cost: one pass over the
 * surface's triangles and one over the vertices; with discs a second one over the vertices. */
PALPATE_API palpate_step_flags palpate_scene_skin(palpate_scene* scene, const palpate_shape_out* shape,
                                                  palpate_skin_out* out);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_SKIN_H */
