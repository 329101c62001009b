/* palpate_links.h - sutures, ligaments, springs and clips between two places.
 *
 *     palpate_scene_def def = palpate_default_scene_def();
 *     palpate_links_def links = palpate_default_links_def();
 *     links.max_links = 1;
 *     palpate_add_part(&def.parts, &links.part);
 *     palpate_scene_create(bundle, &def, &scene, &error);
 *     palpate_link suture = palpate_default_link();
 *     suture.kind = PALPATE_LINK_THREAD;
 *     suture.ends[0].kind = suture.ends[1].kind = PALPATE_END_SURFACE_POINT;
 *     suture.ends[0].triangle = 7, suture.ends[0].barycentric[0] = 1;
 *     suture.ends[1].triangle = 9, suture.ends[1].barycentric[0] = 1;
 *     suture.rest_length = 0.005; // m
 *     palpate_scene_set_links(scene, &suture, 1, &error);
 *     palpate_scene_touch(scene, tools, tool_count, dt, contacts, contacts_bytes);
 *     double tension = palpate_scene_link_state(scene, 0)->tension; // N
 */
#ifndef PALPATE_LINKS_H
#define PALPATE_LINKS_H

#include "palpate.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Links of the organ (palpate_scene_set_links). */
typedef struct palpate_links_def {
  palpate_part part;
  int32_t max_links; /* default 0    [0 .. 1000] links; 0: none, and neither time nor memory for them */
  int32_t reserved;  /* 0                                                                            */
} palpate_links_def;
PALPATE_API void palpate_init_links_def(palpate_links_def* def, size_t struct_bytes);
static inline palpate_links_def palpate_default_links_def(void) {
  palpate_links_def def;
  palpate_init_links_def(&def, sizeof def);
  return def;
}

/* How a link acts between its two ends. */
typedef enum palpate_link_kind {
  PALPATE_LINK_UNSAID = 0, /* refused: a link must say what it is                                                   */
  PALPATE_LINK_THREAD = 1, /* pulls its ends together where they are farther apart than rest_length, and never pushes:
                              a suture, a ligament                                                                  */
  PALPATE_LINK_SPRING = 2, /* pulls and pushes along the line between its ends                                      */
  PALPATE_LINK_CLIP = 3    /* brings its ends to one place, in all three directions; its rest_length is 0           */
} palpate_link_kind;

typedef enum palpate_link_end_kind {
  PALPATE_END_UNSAID = 0,        /* refused                                                                         */
  PALPATE_END_SURFACE_POINT = 1, /* a point of a triangle, which moves with the tissue                              */
  PALPATE_END_WORLD = 2          /* a point that stands in the world                                                */
} palpate_link_end_kind;

/* A part of palpate_link; it does not grow. */
typedef struct palpate_link_end {
  palpate_link_end_kind kind; /* default UNSAID                                                                     */
  int32_t triangle;           /* under SURFACE_POINT: 0 .. F-1                                                      */
  double barycentric[3];      /* under SURFACE_POINT: weights of the triangle's three vertices, 0 .. 1, that sum to 1 */
  double point[3];            /* under WORLD: m, within 1e6 m                                                       */
} palpate_link_end;

typedef struct palpate_link {
  uint32_t struct_bytes;  /* sizeof(palpate_link)                                                                 */
  palpate_link_kind kind; /* default UNSAID                                                                       */
  int32_t id;             /* 0 or more, another one for each link; default -1: its index in the list              */
  int32_t runs_on;        /* default 0; 1: the thread runs on into the next link of the list, which is a THREAD too, and
                               slides without friction where both have an end. Both are one thread then: the sum of their
                               rest lengths stays, and they have one tension. Where a part breaks, of which the one
                               with the least breaking_force is the first, no part has a force any more           */
  palpate_link_end ends[2]; /* at least one of them is a SURFACE_POINT                                              */
  double rest_length;       /* default 0 m, 0 .. 1e6                                                                */
  double stiffness;         /* default INFINITY; N/m above 0: force over what the link is longer than rest_length   */
  double breaking_force;    /* default INFINITY; N above 0: a link that bears more breaks                           */
  double radius; /* default 0 m, 0 .. 1: of the disc of tissue that each end takes hold of. Needs contact PATCH.
                               0: a point, whose stiffness falls as the mesh is refined                             */
} palpate_link;
PALPATE_API void palpate_init_link(palpate_link* link, size_t struct_bytes);
static inline palpate_link palpate_default_link(void) {
  palpate_link link;
  palpate_init_link(&link, sizeof link);
  return link;
}

/* Gives the scene its links, in place of those that it had. links: [count], count 0 .. max_links; the call copies them. Every later
 * touch step holds them, until the next call. A link is known by its id: where the list has it again with the same kind and ends,
 * its state stays, and only its numbers are new: so a host tightens a thread by sending it again with a shorter rest_length, and
 * changes a stiffness at run time. A link that has broken stays broken under its id.
 * - The places of a thread and a spring move and turn with the tissue: the force is along the line between the ends as the last
 *   step left them.
 * - A SURFACE_POINT whose three vertices are all fixed stands where the organ's frame takes it.
 * - A link acts on nodes, like a contact: its nodes count towards max_contact_nodes (8 for each end with a radius, else 3).
 * Refused with PALPATE_ERROR_ARGUMENT, and the scene keeps its links: a number out of its range, two links with one id, more links
 * than max_links. error may be NULL. Never allocates or locks. Call it in the thread of palpate_scene_touch. */
PALPATE_API palpate_status palpate_scene_set_links(palpate_scene* scene, const palpate_link* links, int32_t count,
                                                   palpate_error* error);

typedef enum palpate_link_condition {
  PALPATE_LINK_SLACK = 0, /* a thread that is not stretched: no force                                               */
  PALPATE_LINK_TAUT = 1,  /* it bears a force, or may; a spring and a clip always                                   */
  PALPATE_LINK_BROKEN = 2 /* it has borne more than its breaking_force: no force from then on                       */
} palpate_link_condition;

/* One link after a touch step; the library fills it. Places and forces are in the organ's frame. */
typedef struct palpate_link_state {
  int32_t id;                       /* of the link; its index where the host gave none                              */
  palpate_link_condition condition; /* in this step                                                                 */
  uint64_t broken;                  /* the touch step in which it broke; 0: it has not                              */
  double rest_length;               /* m: as it was given, or as the thread has run on                              */
  double length;                    /* m: between the ends, as the step left them                                   */
  double tension;    /* N: that pulls the ends together; below 0 where a spring pushes; of a clip the length
                                       of its force                                                                 */
  double force[3];   /* N: on the first end; the second one has the opposite                         */
  double ends[2][3]; /* m: where the ends are                                                        */
} palpate_link_state;

/* The state of link 0 .. count - 1 of the list, inside the scene and valid until the next step; NULL behind the last one. Call it in
 * the thread of palpate_scene_touch. */
PALPATE_API const palpate_link_state* palpate_scene_link_state(const palpate_scene* scene, int32_t link);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_LINKS_H */
