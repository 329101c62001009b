/* palpate_world_links.h - links between the organs of a world.
 *
 *     palpate_world_def def = palpate_default_world_def();
 *     def.organs = organs, def.organ_count = 2, def.max_links = 1;
 *     palpate_world_create(&def, &world, &error);
 *     palpate_world_link suture = palpate_default_world_link();
 *     suture.kind = PALPATE_LINK_THREAD;
 *     suture.ends[0].kind = suture.ends[1].kind = PALPATE_END_SURFACE_POINT;
 *     suture.organ[0] = 0, suture.ends[0].triangle = 7, suture.ends[0].barycentric[0] = 1;
 *     suture.organ[1] = 1, suture.ends[1].triangle = 9, suture.ends[1].barycentric[0] = 1;
 *     palpate_world_set_links(world, &suture, 1, &error);
 */
#ifndef PALPATE_WORLD_LINKS_H
#define PALPATE_WORLD_LINKS_H

#include "palpate_links.h"
#include "palpate_world.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A link of palpate.h whose ends are on two organs, on one, or on one and at a point of the world: a suture or a ligament from organ to
 * organ. Fields without a comment are those of palpate_link. */
typedef struct palpate_world_link {
  uint32_t struct_bytes; /* sizeof(palpate_world_link)                                                               */
  palpate_link_kind kind;
  int32_t id;       /* 0 or more, another one for each link of the world; default -1: its index in the list  */
  int32_t runs_on;  /* a thread may run on from organ to organ                                               */
  int32_t organ[2]; /* default -1, -1: of each end that is a SURFACE_POINT the organ, 0 .. organ_count - 1; of an
                               end at a point of the WORLD it is not read                                            */
  palpate_link_end ends[2]; /* at least one of them is a SURFACE_POINT                                               */
  double rest_length;       /* m    */
  double stiffness;         /* N/m  */
  double breaking_force;    /* N    */
  double radius;            /* m; above 0 it needs contact PATCH of each organ that the link holds                   */
} palpate_world_link;
PALPATE_API void palpate_init_world_link(palpate_world_link* link, size_t struct_bytes);
static inline palpate_world_link palpate_default_world_link(void) {
  palpate_world_link link;
  palpate_init_world_link(&link, sizeof link);
  return link;
}

/* Gives the world its links, in place of those that it had, as palpate_scene_set_links gives a scene its own: links: [count], count
 * 0 .. max_links; the call copies them; a link is known by its id, and keeps its state where kind, organs and ends are the same.
 * - The organs that a link with a force joins are solved as one system, those of tools and pairs included, whether they touch or not.
 * - Each organ has its pose: the line between the ends is that in the world, and turns with the poses and the tissue.
 * - A link that breaks raises LINK_BROKE in the flags of the world's step, not in those of an organ. Its organs' reports tell nothing of it.
 * - The contact nodes of these links have the source WORLD_LINK in the palpate_contacts of their organ.
 * Refused with PALPATE_ERROR_ARGUMENT, and the world keeps its links: what palpate_scene_set_links refuses; an organ that the world does
 * not have. error may be NULL. Never allocates or locks. Call it in the thread of palpate_world_touch.
 * Cost     A link with a force is one row of the joint system (a clip three). Each link, a slack one too, costs a step 9 multiply-adds for
 *          each of its nodes and each contact node of the organ. All this comes on top of palpate_scene_most_operations(). */
PALPATE_API palpate_status palpate_world_set_links(palpate_world* world, const palpate_world_link* links, int32_t count,
                                                   palpate_error* error);
/* The state of link 0 .. count - 1 of the list, inside the world and valid until the next step; NULL behind the last one. Places and
 * forces are in the world; broken counts the steps of the world. Call it in the thread of palpate_world_touch. */
PALPATE_API const palpate_link_state* palpate_world_link_state(const palpate_world* world, int32_t link);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_WORLD_LINKS_H */
