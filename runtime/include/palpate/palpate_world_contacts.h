/* palpate_world_contacts.h - what the touch step of a world found out.
 *
 *     const double* force = palpate_world_contacts_tool(world_contacts, 0)->force; // N, on tool 0, of all organs together
 *     const palpate_contacts* liver_contacts = palpate_world_contacts_organ(world_contacts, 0); // of organ 0
 *
 * palpate_world.h includes this header.
 */
#ifndef PALPATE_WORLD_CONTACTS_H
#define PALPATE_WORLD_CONTACTS_H

#include "palpate.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What a step found out about one tool, in the world. */
typedef struct palpate_world_tool_state {
  double force[3]; /* N, on the tool, of all organs together, within force_limit and force_slew: send it to a device */
  double force_raw[3];   /* N, the sum of the organs' force_raw (palpate_tool_state)                                */
  double torque[3];      /* N m, about the tool's reference, within torque_limit and torque_slew                    */
  double torque_raw[3];  /* N m, the sum of the organs' torque_raw                                                  */
  int32_t id;            /* of the tool; its index where the host gave none                                         */
  int32_t organ_count;   /* organs that the tool is in contact with                                                 */
  int32_t contact_count; /* the sum of the organs'                                                                  */
  int32_t slip_count;    /* the same                                                                                */
  int32_t release_count; /* the same                                                                                */
  uint32_t flags;        /* the step flags that concern this tool, of all organs                                    */
} palpate_world_tool_state;

/* What a step found out about one organ, in the world. */
typedef struct palpate_world_organ_state {
  uint64_t contacts_offset; /* of its palpate_contacts, from the begin of the head                                  */
  uint32_t flags;           /* of its step                                                                          */
  int32_t near_tools;       /* tools that were not far from it                                                      */
  double force[3];          /* N, in the world, on the organ, by all tools: the sum of its nodes' forces            */
  double torque[3]; /* N m, in the world, of these forces at the rest places, about the origin of the organ's frame;
                               zero in a scene that has no positions (contact NODE without collision)               */
  double
      pressed[3]; /* N, in the world, on the organ, by all other organs that it touches, without the forces of links */
} palpate_world_organ_state;

/* The result of a touch step: plain data without pointers, as palpate_contacts is. In memory the head is followed by tool_count
 * palpate_world_tool_state, organ_count palpate_world_organ_state and the palpate_contacts of each organ. Find them with the
 * functions below. Copy used_bytes of it through a socket; through a palpate_mailbox of palpate_world_contacts_bytes with a cast. */
typedef struct palpate_world_contacts {
  uint32_t struct_bytes;      /* of this head; the tool states begin behind it                                      */
  uint32_t flags;             /* of all organs and the world, as palpate_world_touch returned them                  */
  uint64_t used_bytes;        /* of the head and all that follows it                                                */
  uint64_t step;              /* touch steps since creation or reset: 1, 2, ...                                     */
  int32_t tool_count;         /* tools of this step                                                                 */
  int32_t organ_count;        /* organs of the world                                                                */
  uint32_t tool_state_bytes;  /* from one tool state to the next                                                    */
  uint32_t organs_offset;     /* of the first organ state, from the begin of the head                               */
  uint32_t organ_state_bytes; /* from one organ state to the next                                                   */
  uint32_t pair_bytes;        /* from one pair to the next                                                          */
  uint64_t pairs_offset;      /* of the first pair, from the begin of the head                                      */
  int32_t pair_count;         /* pairs that the step held, those without a force too                                */
  int32_t pair_sweeps;        /* of projected Gauss-Seidel and Newton's method, that the joint systems took         */
} palpate_world_contacts;

/* The state of tool 0 .. tool_count - 1, inside *contacts. */
static inline const palpate_world_tool_state* palpate_world_contacts_tool(const palpate_world_contacts* contacts,
                                                                          int32_t tool) {
  return (const palpate_world_tool_state*)(const void*)((const char*)contacts + contacts->struct_bytes +
                                                        (size_t)tool * contacts->tool_state_bytes);
}
/* The state of organ 0 .. organ_count - 1, inside *contacts. */
static inline const palpate_world_organ_state* palpate_world_contacts_state(const palpate_world_contacts* contacts,
                                                                            int32_t organ) {
  return (const palpate_world_organ_state*)(const void*)((const char*)contacts + contacts->organs_offset +
                                                         (size_t)organ * contacts->organ_state_bytes);
}
/* What the step of organ 0 .. organ_count - 1 found, inside *contacts: for palpate_scene_shape and the queries of that organ. */
static inline const palpate_contacts* palpate_world_contacts_organ(const palpate_world_contacts* contacts,
                                                                   int32_t organ) {
  return (const palpate_contacts*)(const void*)((const char*)contacts +
                                                palpate_world_contacts_state(contacts, organ)->contacts_offset);
}

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_WORLD_CONTACTS_H */
