/* palpate_report.h - each contact of a step, and what began and ended in it.
 *
 *     palpate_scene_def def = palpate_default_scene_def();
 *     palpate_report_def of_contacts = palpate_default_report_def();
 *     palpate_add_part(&def.parts, &of_contacts.part);
 *     palpate_scene_create(bundle, &def, &scene, &error);
 *     palpate_scene_touch(scene, tools, tool_count, dt, contacts, contacts_bytes);
 *     const palpate_contact_report* report = palpate_scene_report(scene);
 *     for (int32_t c = 0; c < report->contact_count; ++c)
 *       depth[c] = palpate_report_contact(report, c)->depth; // m
 *     for (int32_t e = 0; e < report->event_count; ++e)
 *       if (palpate_report_event(report, e)->kind == PALPATE_EVENT_BEGIN) ++impacts;
 */
#ifndef PALPATE_REPORT_H
#define PALPATE_REPORT_H

#include "palpate.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Whether palpate_scene_report tells each contact of a step, and what began and ended in it. */
typedef enum palpate_report_model {
  PALPATE_REPORT_OFF,     /* no report, and neither time nor memory for it                                          */
  PALPATE_REPORT_CONTACTS /* contacts and events                                                                   */
} palpate_report_model;
typedef struct palpate_report_def {
  palpate_part part;
  palpate_report_model report; /* default CONTACTS */
  int32_t reserved;            /* 0                */
} palpate_report_def;
PALPATE_API void palpate_init_report_def(palpate_report_def* def, size_t struct_bytes);
static inline palpate_report_def palpate_default_report_def(void) {
  palpate_report_def def;
  palpate_init_report_def(&def, sizeof def);
  return def;
}

/* How a contact holds. */
typedef enum palpate_contact_state {
  PALPATE_CONTACT_STICKS = 0,       /* the place moves with the tool: STICKING, a grip, COULOMB within its friction  */
  PALPATE_CONTACT_SLIPS = 1,        /* COULOMB: the tool slides over the organ against its friction                  */
  PALPATE_CONTACT_FRICTIONLESS = 2, /* SLIDING, UNILATERAL: the tool slides freely                                   */
  PALPATE_CONTACT_RELEASED = 3      /* UNILATERAL, COULOMB: no force, although the point is inside                   */
} palpate_contact_state;

/* One contact of a step: a tool point or a grip that holds the organ. Places, directions and forces are in the organ's frame. */
typedef struct palpate_contact {
  int32_t tool_id;  /* of the tool                                                                        */
  int32_t tool;     /* its index in this step                                                             */
  int32_t point;    /* index of the tool point, or point_count + index of the grip                        */
  int32_t triangle; /* of the bundle, that it holds, under a fine_surface the one below its place; -1 for a grip of a
                                  node                                                                               */
  int32_t node;     /* that a grip holds; -1 for a surface point                                          */
  palpate_contact_state state; /* in this step                                                                       */
  uint64_t begun;              /* the step in which it began. Together with tool_id and point this names the contact */
  double barycentric[3];       /* weights of the triangle's vertices                                                 */
  double place[3];             /* m: where the held place is now, as this step deforms the organ (eq. 9)             */
  double normal[3];   /* outward unit normal of the deformed triangle, of the fine_surface where there is one; zero for
                                  a grip of a node                                                                   */
  double depth;       /* m: how far the tool pushes the place in from rest, along the triangle's normal at rest */
  double gap;         /* m: from the place to the tool along the normal: about 0 while the contact holds,
                                  above 0 where it was released. Under PATCH also what the disc dents below the mesh's
                                  resolution: below 0                                                                */
  double force[3];    /* N, on the tool, after Q, before relaxation, force_limit and force_slew             */
  double velocity[3]; /* m/s, of the tool past the organ there; 0 in the first step of a tool point or grip */
  double tool_point[3];  /* m: the tool point, or the place that a grip holds, moved by the grip's displacement       */
  double disc_radius;    /* m, of the disc that the contact presses under PATCH; 0: none                             */
  double disc_normal[3]; /* outward unit normal of that disc: of the surface at rest, around the place; zero: no disc */
  double
      indentation; /* m: how deep the disc alone would sink into a half-space of the tissue there, under the contact's
                            normal force before Q; below 0 where it pulls; 0: no disc                                */
} palpate_contact;

typedef enum palpate_contact_event_kind {
  PALPATE_EVENT_BEGIN = 1,      /* a contact began; its velocity is that of the impact                               */
  PALPATE_EVENT_END = 2,        /* a contact ended: it came out, lost its tracking, or its tool or point was not sent */
  PALPATE_EVENT_SLIP_START = 3, /* a contact that did not slip in the last step slips                                */
  PALPATE_EVENT_STICK_START = 4, /* a contact that slipped or was released in the last step sticks                   */
  PALPATE_EVENT_LINK_TAUT = 5,  /* a link that bore no force in the last step bears one, or may                       */
  PALPATE_EVENT_LINK_SLACK = 6, /* a link that was taut in the last step is slack                                 */
  PALPATE_EVENT_LINK_BROKE = 7, /* a link came beyond its breaking_force                                          */
  PALPATE_EVENT_GRASP_CLOSED = 8,  /* jaws closed on tissue                                                          */
  PALPATE_EVENT_GRASP_SLIPS = 9,   /* a grasp that held in the last step slips                                       */
  PALPATE_EVENT_GRASP_HOLDS = 10,  /* a grasp that slipped in the last step holds                                    */
  PALPATE_EVENT_GRASP_LET_GO = 11, /* a grasp has slipped by more than its radius                                    */
  PALPATE_EVENT_GRASP_OPENED = 12  /* jaws that held or slipped were opened, or their tool was not sent              */
} palpate_contact_event_kind;

typedef struct palpate_contact_event {
  palpate_contact_event_kind kind;
  int32_t tool_id;  /* of a link -1                                                                             */
  int32_t point;    /* as in palpate_contact; of a link its id; of a grasp -1                                   */
  int32_t contact;  /* index among the contacts of this report; -1: it has ended, or is a link or a grasp       */
  int32_t triangle; /* as in palpate_contact; of a contact that has ended, its last one; of a link that of its first
                            end on the surface, of a grasp that of its first disc                                    */
  int32_t node;     /* the same                                                                                 */
  double barycentric[3]; /* the same                                                                                 */
  double place[3];       /* the same                                                                                 */
} palpate_contact_event;

/* Of one step: plain data without pointers. In memory the head is followed by contact_count palpate_contact and event_count
 * palpate_contact_event; find them with palpate_report_contact and palpate_report_event. Copy used_bytes of it to keep it. */
typedef struct palpate_contact_report {
  uint32_t struct_bytes;  /* of this head; the contacts begin behind it                                              */
  uint32_t used_bytes;    /* of the head and all that follows it                                                     */
  uint64_t step;          /* of the touch step; 0: none since creation or reset                                      */
  int32_t contact_count;  /* at most max_points                                                                      */
  int32_t event_count;    /* at most 2 max_points + max_links, with grasps + 4 max_tools: no event is ever lost      */
  uint32_t contact_bytes; /* from one contact to the next                                                            */
  uint32_t events_offset; /* of the first event, from the begin of the head                                          */
  uint32_t event_bytes;   /* from one event to the next                                                              */
  uint32_t reserved;      /* 0                                                                                       */
} palpate_contact_report;

/* The report of the last touch step, inside the scene and valid until the next one; NULL for a scene without a report. Read it in
 * the thread of palpate_scene_touch after every step: the next step writes over its events. Ends of contacts come first; then come
 * the other contacts in their order, grasps in that of the tools, links in that of their list. A link that is taken out of the list has
 * no event. A contact is known by its tool's id and its point, whatever the order of the tools; if another tool gets
 * the id's place, its contacts end. palpate_scene_reset and palpate_scene_reset_tool forget contacts without events.
 * Cost: each contact reads 6 entries of 3 x 3 numbers for each contact node of the step, under a fine_surface some 30. */
PALPATE_API const palpate_contact_report* palpate_scene_report(const palpate_scene* scene);
/* Contact 0 .. contact_count - 1, inside *report. */
static inline const palpate_contact* palpate_report_contact(const palpate_contact_report* report, int32_t contact) {
  return (const palpate_contact*)(const void*)((const char*)report + report->struct_bytes +
                                               (size_t)contact * report->contact_bytes);
}
/* Event 0 .. event_count - 1, inside *report. */
static inline const palpate_contact_event* palpate_report_event(const palpate_contact_report* report, int32_t event) {
  return (const palpate_contact_event*)(const void*)((const char*)report + report->events_offset +
                                                     (size_t)event * report->event_bytes);
}

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_REPORT_H */
