/* palpate.h - from a tensor bundle and the tools that touch the organ, to forces and the deformed shape.
 *
 * A tensor bundle holds the precomputed elastic response of one organ under one set of supports. For every touchable surface
 * node k it holds
 *     T^u_nk  the displacement of each node n per unit displacement of node k (3 x 3, without unit), and
 *     T^f_k   the stiffness of node k: its force per unit displacement (3 x 3, N/m),
 * with all other nodes free of force. A step solves for the few nodes that the tools touch and adds up their tensors.
 * The method is that of Cotin, Delingette and Ayache, "Real-time elastic deformations of soft tissues for surgery simulation",
 * IEEE Transactions on Visualization and Computer Graphics 5(1), 1999, called "the paper" below.
 *
 * A whole program, with palpate.h, stdio.h and stdlib.h, that presses a tool 5 mm into an organ whose surface is at z = 0:
 *
 *     int main(void) {
 *       palpate_bundle* bundle = NULL;
 *       palpate_scene* scene = NULL;
 *       palpate_error error = {0};
 *       palpate_scene_def def = palpate_default_scene_def();
 *       if (palpate_bundle_open_file("organ.h5", NULL, &bundle, &error) || palpate_scene_create(bundle, &def, &scene, &error))
 *         return printf("%s\n", error.text), 2;
 *       size_t contacts_bytes = palpate_contacts_bytes(scene);
 *       palpate_contacts* contacts = malloc(contacts_bytes);
 *       double point[3] = {0, 0, 0.001};
 *       palpate_tool tool = palpate_default_tool();
 *       tool.points = point, tool.point_count = 1, tool.disc_radius = 0.005;
 *       for (; point[2] > -0.005; point[2] -= 0.00002) {
 *         palpate_step_flags flags = palpate_scene_touch(scene, &tool, 1, 0.001, contacts, contacts_bytes);
 *         const double* force = palpate_contacts_tool(contacts, 0)->force;
 *         printf("%.5f m: %.4f N, flags %u\n", point[2], force[2], (unsigned)flags);
 *       }
 *       free(contacts), palpate_scene_destroy(scene), palpate_bundle_close(bundle);
 *     }
 *
 * Words
 *   rest        the organ without tools, preload included if the scene has one; positions and displacements refer to it
 *   motion      what moves the organ from outside: supports that move, pressure on a piece of the surface, gravity. It belongs to
 *               the displacement, not to rest
 *   deformed    the organ under the contacts of the last step
 *   tool        up to PALPATE_MAX_TOOLS instruments; a tool touches through its points and grips
 *   tool point  a point of the instrument that the collision tests against the surface
 *   grip        a node or surface point that a tool holds at a given displacement, whatever the collision finds
 *   contact     one surface point that a tool point or a grip holds; it acts on one or several nodes
 *   anchor      the surface point that a tool point holds; it belongs to the tissue and moves with it
 *   patch       a contact through a flat disc of the tool's disc_radius in place of a point
 *   u*          the displacement that a contact imposes, m
 *   u~          the modified displacement of a contact node (eq. 8 of the paper), m: the coefficient of the node's tensor,
 *               such that all contacts together produce every u*
 *   response    two measured curves that correct the linear answer for large strains (eqs 3-6 of the paper):
 *               P for the displacement across the tool's direction, Q for the force along it
 *   N, Ns       nodes of the mesh; surface nodes, which come first: 0 .. Ns-1
 *   F, E, S     triangles of the surface; tetrahedra; touchable nodes, which have a tensor
 *
 * Units    SI: metre, newton, second, radian. Points are x y z, node after node.
 * Frames   The organ's frame is the bundle's. The tools are in the world's frame; palpate_scene_set_pose says where the organ is
 *          in the world, and without it both frames are the same. In the world: tool points, and the forces and torques of
 *          palpate_tool_state. In the organ's frame: everything that belongs to the organ, which is nodes, grips, contact
 *          nodes, a tool state's direction, shape, skin, queries and the report.
 *          palpate_contacts says the pose that its step used.
 * Memory   palpate_bundle_open* and palpate_scene_create take all memory. A step (palpate_scene_touch, palpate_scene_shape,
 *          palpate_scene_skin) never allocates, locks, prints, throws or makes a system call.
 * Threads  A bundle is constant and threads may share it. In one scene, palpate_scene_touch belongs to one thread,
 *          palpate_scene_shape with skin, inside, carry and crossings to one thread, and palpate_scene_deform (LARGE_BESIDE) to one
 *          thread. They may be different threads and run at the same time. The palpate_contacts alone pass from touch to shape; touch and deform hand over
 *          inside the scene, without waiting.
 * Errors   Opening and creating return a status and fill the caller's palpate_error. A step always fills its output and
 *          returns flag bits that say how far to trust that output; 0 is full trust.
 * Structs  A struct that the host fills begins with struct_bytes, its size in the header that the host was compiled with.
 *          palpate_default_*() and palpate_init_*() set struct_bytes and every default. So structs can grow at their end:
 *          a library with a later header takes its defaults for the fields that the host's struct does not have; a library
 *          with an earlier header refuses a struct with fields that it does not know, unless these fields are zero. A
 *          struct_bytes that is too small for the fields without a default (0, say) is refused. All elements of an array
 *          have the same struct_bytes. ABI.md states more.
 */
#ifndef PALPATE_H
#define PALPATE_H

#include "palpate_bundle.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct palpate_scene palpate_scene;   /* mutable: one organ under one set of effects    */
typedef struct palpate_effect palpate_effect; /* constant: one effect of the library            */

/* ---- scene: only the effects it calls for ------------------------------------------------------------------------ */

/* Against which surface the tool points are tested. */
typedef enum palpate_collision {
  PALPATE_COLLISION_OFF,     /* no test: tools act through grips alone                                            */
  PALPATE_COLLISION_REST,    /* the surface at rest: cheapest; a second tool does not feel what the first one does */
  PALPATE_COLLISION_DEFORMED /* the surface as the contacts of the last step have deformed it                     */
} palpate_collision;

/* On which nodes a contact acts. */
typedef enum palpate_contact_model {
  PALPATE_CONTACT_NODE,     /* the vertex nearest to the anchor: the paper's simplest model                        */
  PALPATE_CONTACT_TRIANGLE, /* the three vertices of the anchor's triangle, each imposed: the paper's section 5     */
  PALPATE_CONTACT_POINT,    /* the anchor itself, interpolated between the three vertices                          */
  PALPATE_CONTACT_PATCH     /* a disc of the tool's disc_radius around the anchor; radius 0 acts as POINT. Its force
                               belongs to the organ; that of the other three falls as the mesh is refined          */
} palpate_contact_model;

/* How the anchor of a tool point may move against the tool. A grip always sticks. "Normal" is that of the disc as the organ bends it, for a
 * disc (PATCH) under SLIDING, UNILATERAL or COULOMB with a friction below 0.1: then the force along the slide is minus the slope of
 * the stored energy. For all other contacts, and on a fine surface, it is that of the surface at rest, with collision against the deformed
 * surface too (docs/method.md, section 6: 2 degrees below a disc that is pressed 5 mm into a liver, 13 degrees at worst beside it).
 * Under force LINEAR, without relaxation, all tools together get back at most what they put in and 2 % of it,
 * under every law and model: where a contact that slides would give more, its force falls, and PALPATE_STEP_SOLVE_INEXACT tells
 * where that did not suffice. Large deformation does so in steps that do not raise PALPATE_STEP_DEFORMATION_BEHIND. */
typedef enum palpate_contact_law {
  PALPATE_LAW_STICKING,   /* the anchor moves with the tool in every direction as long as the contact lasts        */
  PALPATE_LAW_SLIDING,    /* only motion along the surface's normal is imposed; the anchor follows the tool over the
                             surface, and no force acts across the normal                                          */
  PALPATE_LAW_UNILATERAL, /* as SLIDING, and the tool never pulls: where another tool draws the surface away, the
                             force is zero (Signorini's condition)                                                 */
  PALPATE_LAW_COULOMB     /* the tool never pulls. Across the normal the anchor sticks up to a force of the tool's
                             friction times the normal force; beyond, it slips under that force                    */
} palpate_contact_law;

/* Which force the tools receive. */
typedef enum palpate_force_model {
  PALPATE_FORCE_OFF,     /* none                                                                                  */
  PALPATE_FORCE_LINEAR,  /* that of linear elasticity                                                             */
  PALPATE_FORCE_RESPONSE /* the linear one with Q(F) for its part F along the tool's direction; the rest stays     */
} palpate_force_model;

/* Which nodes palpate_scene_shape moves. */
typedef enum palpate_shape_model {
  PALPATE_SHAPE_OFF,     /* none: a scene for forces alone                                                         */
  PALPATE_SHAPE_SURFACE, /* nodes 0 .. Ns-1                                                                        */
  PALPATE_SHAPE_VOLUME   /* all N nodes                                                                            */
} palpate_shape_model;

/* Whether P corrects the shape. P changes what is drawn and not what tools meet: collision and contacts know the shape of linear
 * elasticity alone (docs/method.md, section 7: 0.2 mm apart under a push of 5 mm into a liver, 0.7 mm at worst). */
typedef enum palpate_radial_model {
  PALPATE_RADIAL_OFF,     /* the shape of linear elasticity                                                        */
  PALPATE_RADIAL_RESPONSE /* each tool's displacement of length r across the tool's direction gets the length P(r)  */
} palpate_radial_model;

/* Whether rest includes the organ's sag under the body force that was precomputed. */
typedef enum palpate_preload_model {
  PALPATE_PRELOAD_OFF, /* rest is the shape as it was meshed                                                       */
  PALPATE_PRELOAD_ON   /* rest is the shape under the stored body force, such as gravity                           */
} palpate_preload_model;

/* What an effect beside these adds to the definition of a scene, or to a tool: a struct of its header (palpate_complete.h includes them all), which begins with a
 * palpate_part. A scene has the effects whose structs are in its definition's chain, in any order; a host that links the static library links their code alone. */
typedef struct palpate_part {
  uint32_t struct_bytes;           /* of the struct that begins with it                                           */
  uint32_t reserved;               /* 0                                                                           */
  const palpate_effect* effect;    /* whose struct it is: its palpate_init function sets it                       */
  const struct palpate_part* next; /* default NULL; the next one of the chain                                     */
} palpate_part;
/* Puts a part in front of a chain: that of a palpate_scene_def or of a palpate_tool. A part is in one chain, once. */
static inline void palpate_add_part(const palpate_part** chain, palpate_part* part) {
  part->next = *chain;
  *chain = part;
}

typedef struct palpate_scene_def {
  uint32_t struct_bytes;         /* sizeof(palpate_scene_def)                                                     */
  palpate_collision collision;   /* default REST                                                                  */
  palpate_contact_model contact; /* default PATCH                                                                 */
  palpate_contact_law law;       /* default STICKING                                                              */
  palpate_force_model force;     /* default LINEAR                                                                */
  palpate_shape_model shape;     /* default SURFACE                                                               */
  palpate_radial_model radial;   /* default OFF                                                                   */
  palpate_preload_model preload; /* default OFF                                                                   */
  int32_t max_tools;             /* default 4    [1 .. PALPATE_MAX_TOOLS]                                         */
  int32_t max_points;            /* default 64   [1 .. 100000] tool points and grips of all tools together        */
  int32_t max_contact_nodes;     /* default 0    [0 .. 3000] nodes under contact, a node under several contacts counted
                                    for each: 3 for each tool point or grip, 1 under NODE, under PATCH those below the
                                    disc, about a dozen on a coarse mesh. Where that is short, each disc and POINT acts
                                    on fewer nodes (DISCS_THINNED), and no contact is dropped as long as there is a node
                                    for each. Refused: fewer than 1 for each of max_points (under TRIANGLE 3) and what
                                    each effect needs, unless it is 3000. 0: 8 for each of max_points, but 192 .. 1024,
                                    and what effects need; where max_points needs more than that, creating the scene
                                    warns (palpate_log). The solver takes 72 bytes times the square of this number or of
                                    S, the smaller (at 3000 648 MB), and 144 bytes times the square of the contacts, of
                                    which each point or grip makes 1 (under TRIANGLE 3). palpate_scene_plan states it */
  int32_t reserved;              /* 0                                                                             */
  int64_t max_operations;        /* default 300000: counted operations of a touch step, about 0.3 ms where docs/speed.md
                                    was measured (palpate_operations_in). Tests, moves of contacts and grips that
                                    do not fit are put off to the next steps (WORK_DEFERRED), and forces are
                                    solved less exactly (SOLVE_INEXACT). A contact that no step has room for,
                                    because its rows and the others' are too many, waits and stays flagged: the
                                    default has room for 190 with three rows each.
                                    palpate_scene_most_operations() states what a step may count in all. Refused
                                    where it is less than a step needs at least, some 40000 and 25 for each of
                                    max_points. Counts do not depend on the machine, so the same input gives the
                                    same bits                                                                     */
  double force_limit;            /* default 50   N, above 0: largest length of each tool's force                  */
  double force_slew;             /* default 1e4  N/s, above 0: largest change of each tool's force; INFINITY: none */
  double torque_limit;           /* default 5    N m, above 0: largest length of each tool's torque; INFINITY: none */
  double torque_slew;            /* default 1e3  N m/s, above 0: largest change of each tool's torque; INFINITY: none */
  double max_tool_speed;         /* default 10   m/s, above 0: a tool point that moves faster has lost its tracking;
                                    INFINITY: none                                                                */
  double release_distance;       /* default 0    m: a contact ends where the tool point is farther from its anchor,
                                    both from where it rests and from where the other contacts take it; 0: a fifth
                                    of the diagonal of the organ's box; INFINITY: never                           */
  palpate_allocator allocator;   /* default NULL, NULL, NULL                                                      */
  const palpate_part* parts;     /* default NULL: no effect beside those above. palpate_scene_create copies the structs
                                    and reads the arrays that they name; it keeps neither                         */
} palpate_scene_def;
#define PALPATE_MAX_TOOLS 8

/* The defaults above; change what you need. */
PALPATE_API void palpate_init_scene_def(palpate_scene_def* def, size_t struct_bytes);
static inline palpate_scene_def palpate_default_scene_def(void) {
  palpate_scene_def def;
  palpate_init_scene_def(&def, sizeof def);
  return def;
}

/* Makes a scene: reads or maps the sections that its effects need and no others, and takes all its memory. The bundle must outlive the
 * scene. error may be NULL. Returns PALPATE_OK, or the reason, in which case *scene is NULL. */
PALPATE_API palpate_status palpate_scene_create(palpate_bundle* bundle, const palpate_scene_def* def,
                                                palpate_scene** scene, palpate_error* error);
PALPATE_API void palpate_scene_destroy(palpate_scene* scene);

/* ---- touch: the haptic half -------------------------------------------------------------------------------------- */

/* What a grip holds. */
typedef enum palpate_grip_kind {
  PALPATE_GRIP_UNSAID = 0, /* bad input: a grip must say what it holds                                            */
  PALPATE_GRIP_NODE = 1,   /* a node                                                                              */
  PALPATE_GRIP_SURFACE_POINT = 2 /* a point of a triangle, held by the scene's contact model. This needs a scene with
                                    collision, or with contact TRIANGLE, POINT or PATCH (else: bad input)               */
} palpate_grip_kind;

/* A node or surface point that the tool holds at a displacement, whatever the collision finds. */
typedef struct palpate_grip {
  uint32_t struct_bytes;  /* sizeof(palpate_grip)                                                            */
  palpate_grip_kind kind; /* default UNSAID                                                                  */
  uint32_t axes;          /* default 7: x, y and z are imposed; bits 1, 2, 4: x, y, z. Along the others the grip is
                             force-free                                                                      */
  int32_t node;           /* under NODE: a touchable node                                                    */
  int32_t triangle;       /* under SURFACE_POINT: 0 .. F-1                                                   */
  int32_t reserved;       /* 0                                                                               */
  double barycentric[3];  /* under SURFACE_POINT: weights of the triangle's three vertices, 0 .. 1, that sum to 1 */
  double displacement[3]; /* m, from rest, in the organ's frame                                              */
} palpate_grip;
PALPATE_API void palpate_init_grip(palpate_grip* grip, size_t struct_bytes);
static inline palpate_grip palpate_default_grip(void) {
  palpate_grip grip;
  palpate_init_grip(&grip, sizeof grip);
  return grip;
}

/* One instrument. How a contact of a tool point begins and ends:
 * - It begins where the point crosses into the organ. That surface point becomes the anchor, and the contact imposes on it
 *   u* = (tool point - anchor at rest).
 * - It ends when the tool point is outside the organ as the other contacts alone would shape it, unless hold is set. So a
 *   STICKING contact may still push when another tool takes the organ away from it sideways, and its force ends within the slew.
 *   A point that leaves through an opposite face has gone through a thin part: the contact stays until the point is above the
 *   plane of its anchor's triangle. There a contact with held nodes alone, which has no force, ends at once.
 * - A point that is inside when it is first seen touches nothing until it has been outside once.
 * From step to step a tool is known by its id. Its contacts, its points (by their order within the tool), its last force and
 * its relaxation follow the id when the tools' order changes. A tool that is not sent in a step is forgotten.
 * Coordinates farther than 1e6 m from the origin are bad input. */
typedef struct palpate_tool {
  uint32_t struct_bytes;     /* sizeof(palpate_tool)                                                            */
  int32_t id;                /* 0 or more, another one for each tool of a step; default -1: its index in the step */
  const double* points;      /* [point_count][3] m, in the world; tested where the scene has collision          */
  const palpate_grip* grips; /* [grip_count]                                                                    */
  int32_t point_count;       /* default 0                                                                       */
  int32_t grip_count;        /* default 0                                                                       */
  double disc_radius;        /* default 0 m, 0 .. 1: radius of the flat disc that each point presses on the organ, under
                                PATCH. It is not a collision radius: the points themselves are tested. 0: a point */
  double friction;           /* default 0, 0 .. 100: Coulomb's coefficient, under COULOMB                       */
  int32_t hold;        /* default 0: a contact ends when its tool point has come out again; 1: it stays, and pulls */
  int32_t has_torque;  /* default 0: no torque is computed; 1: the torque about `reference`. In a scene without
                          collision and with a contact other than PATCH, 1 is bad input                           */
  int32_t organ;       /* default 0: in a world (palpate_world.h), the organ that grips and parts hold; a scene has one
                          organ and does not read it                                                              */
  int32_t reserved;    /* 0                                                                                       */
  double reference[3]; /* default 0 m, in the world: the point of the tool about which its torque is taken        */
  const palpate_part* parts; /* default NULL: none; what the tool has of effects, such as a palpate_grasp, where the
                                scene has that effect                                                             */
} palpate_tool;
PALPATE_API void palpate_init_tool(palpate_tool* tool, size_t struct_bytes);
static inline palpate_tool palpate_default_tool(void) {
  palpate_tool tool;
  palpate_init_tool(&tool, sizeof tool);
  return tool;
}

/* What holds a node under contact. */
typedef enum palpate_contact_source {
  PALPATE_SOURCE_TOOL = 0, /* a tool point, a grip or a grasp                     */
  PALPATE_SOURCE_NEEDLE = 1,
  PALPATE_SOURCE_LINK = 2,      /* of the organ                                        */
  PALPATE_SOURCE_OBSTACLE = 3,  /* a rigid surface                                     */
  PALPATE_SOURCE_BLADE = 4,     /* the edge of one                                     */
  PALPATE_SOURCE_LIP = 5,       /* the other lip of a cut                              */
  PALPATE_SOURCE_ORGAN = 6,     /* another organ, which touches this one               */
  PALPATE_SOURCE_WORLD_LINK = 7 /* to another organ or a place of the world            */
} palpate_contact_source;

/* One node under contact. */
typedef struct palpate_contact_node {
  int32_t node;   /* mesh node index                                                                 */
  int32_t column; /* index of the node in tensors/nodes: its tensor column. Of an interior node: the number of touchable
                     nodes plus its index in corridor/nodes                                                          */
  palpate_contact_source source; /* what holds the node                                                             */
  int32_t index; /* of the tool in this step, also of the needle's; of the link in the list; of the other organ     */
  int32_t point; /* TOOL: index of the tool point, or point_count + index of the grip, or behind these that of the
                     grasp's patch; NEEDLE: 0, the tip, or a place on the shaft; else for the library's use          */
  int32_t reserved;                /* 0                                                                              */
  double modified_displacement[3]; /* u~ of eq. 8, m; of an interior node its force, N; LARGE: 0                      */
  double force[3];                 /* N, on the organ at this node, after the correction by Q                         */
} palpate_contact_node;

/* What a step found out about one tool. */
typedef struct palpate_tool_state {
  double force[3];     /* N, on the tool, in the world, within force_limit and force_slew: send it to a device      */
  double force_raw[3]; /* N, on the tool, before those limits                                                       */
  double direction[3]; /* direction of the sum of the tool's imposed displacements, in the organ's frame. Its length is
                            the share of P and Q that acts: 1 where the sum is at least half as long as all displacements
                            one after the other; it falls smoothly to 0 as they cancel, where the direction of their sum
                            is noise. Q acts on the part of the force along this vector alone                         */
  int32_t contact_count; /* contacts of the tool                                                                      */
  int32_t slip_count;    /* of these, contacts that slipped in this step (COULOMB)                                    */
  int32_t release_count; /* of these, contacts without force although the point is inside (UNILATERAL, COULOMB)       */
  uint32_t flags;        /* the step flags that concern this tool                                                     */
  int32_t id;            /* of the tool; its index where the host gave none                                           */
  int32_t reserved;      /* 0                                                                                         */
  double torque[3];      /* N m, on the tool, in the world, about its reference, within torque_limit and torque_slew.
                            Zero where the tool does not ask for it                                                   */
  double torque_raw[3];  /* N m, before those limits: the sum of r x f over the tool's contacts. f: the contact's force,
                            of which force_raw is the sum; r: from the reference to the tool point, or to the place that
                            the grip holds, moved by the grip's displacement                                          */
} palpate_tool_state;

/* The result of touch and the input of shape: plain data without pointers. In memory the head is followed by tool_count
 * palpate_tool_state and node_count palpate_contact_node; find them with palpate_contacts_tool and palpate_contacts_node,
 * because a later library may write a longer head or longer elements. Copy used_bytes of it through a mailbox or a socket. */
typedef struct palpate_contacts {
  uint32_t struct_bytes;        /* of this head; the tool states begin behind it                                  */
  uint32_t used_bytes;          /* of the head and all that follows it                                            */
  uint64_t bundle;              /* identity of the scene's bundle (palpate_bundle_info)                           */
  uint64_t step;                /* touch steps since creation or reset: 1, 2, ...                                 */
  uint32_t flags;               /* as palpate_scene_touch returned them                                           */
  int32_t tool_count;           /* tools of this step                                                             */
  int32_t node_count;           /* contact nodes of this step                                                     */
  int32_t node_capacity;        /* the scene's max_contact_nodes                                                  */
  uint32_t tool_state_bytes;    /* from one tool state to the next                                                */
  uint32_t nodes_offset;        /* of the first contact node, from the begin of the head                          */
  uint32_t node_bytes;          /* from one contact node to the next                                              */
  int32_t sweeps;               /* of projected Gauss-Seidel, which UNILATERAL and COULOMB may need; else 0       */
  double residual_displacement; /* m: by how much the worst contact misses its u*, or its law                     */
  double residual_force;        /* N: the same, divided by that contact's own compliance                          */
  int32_t newton_steps;         /* of Newton's method, which UNILATERAL and COULOMB may need; else 0              */
  int32_t operations;           /* that the step counted (max_operations)                                          */
  double organ_position[3];     /* m, of the organ's frame in the world in this step (palpate_pose)               */
  double organ_orientation[4];  /* w x y z                                                                        */
  /* Of the displacements that the body itself writes (palpate_large.h), from the begin of the head; 0: none. They are those of
   * field_nodes nodes, which are those of the scene's shape. field_adds: 1: they add to the superposition of the contact nodes; 0:
   * they are all of it, or there are none. A scene whose body is of the other kind refuses them as bad input. */
  uint32_t field_offset;
  int32_t field_nodes;
  int32_t body_steps; /* that the body took in this step or for its newest solution; linear: 0           */
  int32_t field_adds;
  double body_residual; /* how far that was from its solution, as palpate_large.h says; linear: 0          */
  double least_volume;  /* smallest volume of a tetrahedron, over its volume at rest; linear: 1            */
  /* Of the amounts of the organ's own displacement in this step (palpate_motions.h), from the begin of the head; 0: none. */
  uint32_t amounts_offset;
  int32_t amount_count; /* one for each motion of the bundle where the scene has motions; else 0           */
} palpate_contacts;

/* Bytes of a palpate_contacts with room for PALPATE_MAX_TOOLS tools and the scene's max_contact_nodes, and under LARGE for the
 * displacement of every node of its shape; sizeof is not enough. */
PALPATE_API size_t palpate_contacts_bytes(const palpate_scene* scene);
/* The state of tool 0 .. tool_count - 1, inside *contacts. */
static inline const palpate_tool_state* palpate_contacts_tool(const palpate_contacts* contacts, int32_t tool) {
  return (const palpate_tool_state*)(const void*)((const char*)contacts + contacts->struct_bytes +
                                                  (size_t)tool * contacts->tool_state_bytes);
}
/* Contact node 0 .. node_count - 1, inside *contacts. */
static inline const palpate_contact_node* palpate_contacts_node(const palpate_contacts* contacts, int32_t node) {
  return (const palpate_contact_node*)(const void*)((const char*)contacts + contacts->nodes_offset +
                                                    (size_t)node * contacts->node_bytes);
}

/* [field_nodes][3] m, the displacements that the body wrote, inside *contacts; NULL where there are none. */
static inline const float* palpate_contacts_field(const palpate_contacts* contacts) {
  return contacts->field_offset ? (const float*)(const void*)((const char*)contacts + contacts->field_offset) : NULL;
}

/* [amount_count] amounts of the organ's own displacement, inside *contacts; NULL where there are none. */
static inline const double* palpate_contacts_amounts(const palpate_contacts* contacts) {
  return contacts->amounts_offset ? (const double*)(const void*)((const char*)contacts + contacts->amounts_offset)
                                  : NULL;
}

/* Bits of a step's return value; 0 is a fully trusted step. */
/* clang-format off */
enum {
  PALPATE_STEP_BAD_INPUT        = 1 << 0, /* NaN, infinity, a negative count, an unknown node: the tool kept its last good input */
  PALPATE_STEP_CONTACTS_DROPPED = 1 << 1, /* more points than max_points, or more contacts than max_contact_nodes has nodes for
                                             (3 each under TRIANGLE), or lips of a cut than cut_lips; the step kept the first ones */
  PALPATE_STEP_REGULARISED      = 1 << 2, /* contacts conflict: some miss their displacement; their force has a stated bound     */
  PALPATE_STEP_RESPONSE_RANGE   = 1 << 3, /* P or Q was used beyond its measured range, where it continues as a straight line    */
  PALPATE_STEP_FORCE_LIMITED    = 1 << 4, /* a force or a torque was cut to its limit or slew                                    */
  PALPATE_STEP_BUNDLE_LOST      = 1 << 5, /* the mapped file of the bundle was cut or written over: do not trust this step       */
  PALPATE_STEP_NOT_TOUCHABLE    = 1 << 6, /* a tool met nodes without a tensor column (fixed ones, say): the contact acts on the
                                             other nodes there, or is not made where there are none; a disc may lie in the surface
                                             before it touches. In a world, fixed parts of
                                             two organs are in one another, or a vertex is in another organ past a side: nothing
                                             presses them apart                                                                 */
  PALPATE_STEP_UNSOLVED         = 1 << 7, /* a number is not finite, or the stored precision is too coarse for so many contacts:
                                             the step has no contact forces, or no displacement of those nodes                  */
  PALPATE_STEP_OTHER_BUNDLE     = 1 << 8, /* the contacts given to palpate_scene_shape are of another bundle: the shape is at rest */
  PALPATE_STEP_TRACKING_LOST    = 1 << 9, /* a tool point moved faster than max_tool_speed, jumped through the organ in one
                                             step, or left its contact by more than release_distance: it has no contact until
                                             it has been outside and comes in again                                         */
  PALPATE_STEP_WORK_DEFERRED    = 1 << 10, /* the step reached max_operations: some contacts hold although they may have come
                                             out, some free points may have come in, some contacts stay where they are
                                             although they should slide, and some grips or links do not act yet or act where
                                             they did before. The next steps go on with these                               */
  PALPATE_STEP_SOLVE_INEXACT    = 1 << 11, /* the solver came to its limit with a contact or its law missed by more than 1e-6
                                             of the step's largest u* (LARGE: 5 %) plus 1e-9 m, or jaws pull beyond their friction. Pushes
                                             never pull, other friction holds; but for LARGE, the bound is that of REGULARISED  */
  PALPATE_STEP_DISCS_THINNED    = 1 << 12, /* max_contact_nodes is short: a disc acts on so few of its nodes that these carry less
                                             than 95 % of it, or a POINT on fewer than its three. Its force is then too small, by
                                             up to a half on a single node. A disc with 95 % has its force within about 5 %      */
  PALPATE_STEP_DEFORMATION_BEHIND = 1 << 13, /* LARGE: the body has not followed its tools to the end: the steps of max_operations
                                             ended far from the solution (body_residual above 0.035); the move to the targets
                                             was cut, where it would have turned a tetrahedron inside out or taken far more energy
                                             than the linear response expects; the step was undone (above 0.5); or the body is in a
                                             balance that is not stable, as where it begins to buckle. The next steps go on from
                                             there. LARGE_BESIDE: the newest solution was cut, ended above 0.02, is not stable, or has
                                             normals that are off by 0.05 rad; or the contacts have gone so far from it that their
                                             displacements or forces are estimated to miss theirs by 5 % */
  PALPATE_STEP_LINK_BROKE       = 1 << 14, /* a link came beyond its breaking_force: it acted in this step for the last time     */
  PALPATE_STEP_MOTION_LIMITED   = 1 << 15, /* the amounts of the motions would have moved a node faster than max_tool_speed: they came
                                             so far only, and the next steps go on                                               */
  PALPATE_STEP_FRICTION_JAMS    = 1 << 16, /* two organs of a world press one another with friction where a surface has turned by
                                             more than 60 degrees: tissue is carried along instead of passing beneath, and the
                                             force across grows with the way. Linear elasticity does not hold there              */
  PALPATE_STEP_SURFACE_CROSSES  = 1 << 17 /* of palpate_scene_crossings alone: the surface passes through itself               */
};
/* clang-format on */
typedef uint32_t palpate_step_flags;

/* The touch step: finds the contacts of the tools, solves for u~ (eqs 7 and 8 of the paper) and for the forces.
 * tools: [tool_count], in any order (palpate_tool.id). A tool that is not sent has no force from that step on. Two tools with
 * one id, an id below -1, or tools with different struct_bytes: bad input, and all tools keep their last good input.
 * dt: s since the last touch step, 1e-300 .. 1e6, else bad input; for force_slew more than 0.02 s counts as 0.02 s.
 * Always fills *contacts, which has contacts_bytes bytes and is 8-byte aligned. If contacts is NULL, not aligned or smaller
 * than palpate_contacts_bytes(scene), the step does nothing, writes nothing and returns BAD_INPUT. */
PALPATE_API palpate_step_flags palpate_scene_touch(palpate_scene* scene, const palpate_tool* tools, int32_t tool_count,
                                                   double dt, palpate_contacts* contacts, size_t contacts_bytes);

/* Forgets contacts, last positions and forces: the state after creation, but the pose stays, the amounts of motions, and the links,
 * whole again. Call it in the thread of palpate_scene_touch. */
PALPATE_API void palpate_scene_reset(palpate_scene* scene);
/* The same for the tool of that id alone: its next step is like its first. The surface stays as the last step deformed it
 * until the next step. An id that is not in use changes nothing. Call it in the thread of palpate_scene_touch. */
PALPATE_API void palpate_scene_reset_tool(palpate_scene* scene, int32_t id);

/* ---- shape: the render half -------------------------------------------------------------------------------------- */

/* The caller's arrays; either may be NULL. SHAPE_SURFACE fills the first Ns nodes, SHAPE_VOLUME all N. */
typedef struct palpate_shape_out {
  uint32_t struct_bytes; /* sizeof(palpate_shape_out)                                   */
  int32_t node_capacity; /* in: room in each array                                      */
  int32_t node_count;    /* out: nodes filled                                           */
  int32_t reserved;      /* 0                                                           */
  float* displacements;  /* default NULL; [node_capacity][3] m, from rest               */
  float* positions;      /* default NULL; [node_capacity][3] m, rest plus displacement  */
} palpate_shape_out;
PALPATE_API void palpate_init_shape_out(palpate_shape_out* out, size_t struct_bytes);
static inline palpate_shape_out palpate_default_shape_out(void) {
  palpate_shape_out out;
  palpate_init_shape_out(&out, sizeof out);
  return out;
}

/* The shape step: superposes the tensor columns of the contact nodes with the coefficients u~ (eq. 9 of the paper) and, with
 * PALPATE_RADIAL_RESPONSE, corrects the sum of each tool by P. contacts: of this scene's touch step, or of another scene's on
 * the same bundle; those of another bundle give the shape at rest and OTHER_BUNDLE, and NULL or damaged contacts the shape at
 * rest and BAD_INPUT. Contacts from a library whose head or elements have other sizes count as damaged. */
PALPATE_API palpate_step_flags palpate_scene_shape(palpate_scene* scene, const palpate_contacts* contacts,
                                                   palpate_shape_out* out);

/* Fills the normals of the surface's vertices, for a host that draws the bundle's own triangles: of each vertex the mean of the
 * normals of the triangles around it, weighted by their angles there; unit length, or zero where they cancel or have no area.
 * shape: as palpate_scene_shape filled it; this call reads its positions and node_count, at least Ns. normals: [node_capacity][3],
 * of which the first Ns are filled; node_capacity: Ns or more. This needs a scene with collision, with contact TRIANGLE, POINT or
 * PATCH, with a contact law other than STICKING, or with queries (else: bad input). A triangle with a position that is not finite
 * does not count (BAD_INPUT). Any thread may call it. Cost: one pass over the triangles. */
PALPATE_API palpate_step_flags palpate_scene_normals(palpate_scene* scene, const palpate_shape_out* shape,
                                                     float* normals, int32_t node_capacity);

#ifdef __cplusplus
} /* extern "C" */
#endif
#endif /* PALPATE_H */
