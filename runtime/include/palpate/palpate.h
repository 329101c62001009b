/* palpate.h - from a tensor bundle and the tools that touch the organ, to forces and the deformed shape.
 *
 * Units    SI: metre, newton, second. Points are x y z, node after node, in the bundle's frame.
 * Memory   all of it is taken in palpate_bundle_open* and palpate_scene_create; a step (palpate_touch, palpate_shape,
 *          palpate_skin) never allocates, locks, prints, throws or makes a system call.
 * Threads  a bundle is constant and may be shared. Of one scene, palpate_touch belongs to one thread and palpate_shape to
 *          one thread; the two may differ and run at the same time: what passes between them is the palpate_contacts.
 * Errors   opening and creating return a status and fill the caller's palpate_error; a step always fills its output and
 *          returns flag bits that say how far to trust it. 0 is full trust.
 */
#ifndef PALPATE_H
#define PALPATE_H

#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32) && defined(PALPATE_SHARED)
#define PALPATE_API __declspec(dllexport)
#elif defined(__GNUC__)
#define PALPATE_API __attribute__((visibility("default")))
#else
#define PALPATE_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

#define PALPATE_API_VERSION 1

typedef struct palpate_bundle palpate_bundle; /* constant: what was computed offline           */
typedef struct palpate_scene palpate_scene;   /* mutable: one organ under one set of effects   */

/* ---- status and errors ------------------------------------------------------------------------------------------ */

typedef enum palpate_status {
  PALPATE_OK = 0,
  PALPATE_ERROR_TRUNCATED = 1, /* fewer bytes than the bundle says it has            */
  PALPATE_ERROR_MAGIC = 2,     /* not a bundle, or one that was not finished          */
  PALPATE_ERROR_VERSION = 3,   /* a layout version this library does not read         */
  PALPATE_ERROR_SECTION = 4,   /* a section is missing, out of bounds or of odd shape */
  PALPATE_ERROR_CHECKSUM = 5,  /* bytes differ from those that were written           */
  PALPATE_ERROR_CONTENT = 6,   /* an index in the bundle points outside its target    */
  PALPATE_ERROR_ARGUMENT = 7,  /* a null pointer, a bad enum, a limit of zero         */
  PALPATE_ERROR_MEMORY = 8,    /* the allocator returned NULL                         */
  PALPATE_ERROR_FILE = 9,      /* the file cannot be opened or mapped                 */
  PALPATE_ERROR_EFFECT = 10,   /* an effect needs a section this bundle does not have */
  PALPATE_ERROR_LOCK = 11      /* the system does not lock that much memory           */
} palpate_status;

typedef struct palpate_error {
  palpate_status status;
  uint64_t byte_offset; /* where in the bundle, or 0 */
  char text[240];       /* what was expected, what was found, what to do */
} palpate_error;

/* ---- bundle ------------------------------------------------------------------------------------------------------ */

/* Checks and wraps bundle bytes (a mapped file, an asset, a WebAssembly heap). The bytes are borrowed, never written, and
 * must outlive *bundle. Safe on untrusted input. bytes: 64-byte aligned. error may be NULL.
 * Returns PALPATE_OK, or the reason; *bundle is then NULL. */
PALPATE_API palpate_status palpate_bundle_open(const void* bytes, size_t byte_count, palpate_bundle** bundle,
                                               palpate_error* error);

/* The same for a file: only the sections that a scene needs are mapped (read-only), when it is created. A file that shrinks
 * under the map does not kill the host: its lost pages read as zero. Every step after the file was cut, at whatever byte, or
 * written over by another bundle raises PALPATE_STEP_BUNDLE_LOST; a new file put in its place by renaming changes nothing. */
PALPATE_API palpate_status palpate_bundle_open_file(const char* path, palpate_bundle** bundle, palpate_error* error);

/* Compares every section with its checksum; reads the whole bundle. */
PALPATE_API palpate_status palpate_bundle_check(const palpate_bundle* bundle, palpate_error* error);

/* For loops with deadlines: reads every page of the sections that the bundle's scenes have mapped, so that no step waits for
 * the disk or takes a page fault on them; lock: also asks the system to keep them in memory (mlock), without which it may
 * take pages back when memory is short. Call it after palpate_scene_create, not in a step. Cost: one read of those sections,
 * and as much memory for as long as the bundle is open. A bundle opened from bytes is in the host's memory: nothing is done.
 * Returns PALPATE_ERROR_LOCK when the system refuses to lock (its limit is RLIMIT_MEMLOCK, `ulimit -l`): the pages have been
 * read all the same and the scene works as before. */
PALPATE_API palpate_status palpate_bundle_prefault(palpate_bundle* bundle, int32_t lock, palpate_error* error);

/* NULL is allowed. Scenes of the bundle must be destroyed first. */
PALPATE_API void palpate_bundle_close(palpate_bundle* bundle);

typedef struct palpate_bundle_info {
  int32_t node_count;         /* N                                   */
  int32_t surface_node_count; /* Ns: nodes 0 .. Ns-1 are the surface */
  int32_t triangle_count;     /* F                                   */
  int32_t tetrahedron_count;  /* E                                   */
  int32_t touchable_count;    /* S                                   */
  int32_t has_interior;       /* displacement_interior is there      */
  int32_t has_radial;         /* P is there                          */
  int32_t has_force;          /* Q is there                          */
  int32_t has_preload;        /* preload/displacement is there       */
} palpate_bundle_info;
PALPATE_API palpate_bundle_info palpate_bundle_describe(const palpate_bundle* bundle);

/* Borrowed views, valid until the bundle is closed (maps the section of a file on first use; not for use in a step). NULL
 * where the section cannot be mapped. */
PALPATE_API const double* palpate_bundle_nodes(const palpate_bundle* bundle);       /* [N][3] m, rest   */
PALPATE_API const int32_t* palpate_bundle_triangles(const palpate_bundle* bundle);  /* [F][3]           */
PALPATE_API const int32_t* palpate_bundle_tetrahedra(const palpate_bundle* bundle); /* [E][4]           */
PALPATE_API const int32_t* palpate_bundle_touchable(const palpate_bundle* bundle);  /* [S] node indices */
PALPATE_API const uint8_t* palpate_bundle_fixed(const palpate_bundle* bundle);      /* [N][3] 1: held   */
/* JSON of *byte_count bytes, not ended by a zero: organ, element, what it was made from (formats/BUNDLE.md). */
PALPATE_API const char* palpate_bundle_provenance(const palpate_bundle* bundle, size_t* byte_count);

/* ---- scene: only the effects it calls for ------------------------------------------------------------------------ */

typedef enum palpate_collision {
  PALPATE_COLLISION_OFF,
  PALPATE_COLLISION_REST,
  PALPATE_COLLISION_DEFORMED
} palpate_collision;
typedef enum palpate_contact_model {
  PALPATE_CONTACT_NODE,
  PALPATE_CONTACT_TRIANGLE,
  PALPATE_CONTACT_POINT,
  PALPATE_CONTACT_PATCH
} palpate_contact_model;
typedef enum palpate_contact_law {
  PALPATE_LAW_STICKING,
  PALPATE_LAW_SLIDING,
  PALPATE_LAW_UNILATERAL,
  PALPATE_LAW_COULOMB
} palpate_contact_law;
typedef enum palpate_force_model {
  PALPATE_FORCE_OFF,
  PALPATE_FORCE_LINEAR,
  PALPATE_FORCE_RESPONSE
} palpate_force_model;
typedef enum palpate_shape_model { PALPATE_SHAPE_OFF, PALPATE_SHAPE_SURFACE, PALPATE_SHAPE_VOLUME } palpate_shape_model;
typedef enum palpate_radial_model { PALPATE_RADIAL_OFF, PALPATE_RADIAL_RESPONSE } palpate_radial_model;
typedef enum palpate_preload_model { PALPATE_PRELOAD_OFF, PALPATE_PRELOAD_ON } palpate_preload_model;
typedef enum palpate_relaxation_model { PALPATE_RELAXATION_OFF, PALPATE_RELAXATION_PRONY } palpate_relaxation_model;

/* Force that relaxes while a displacement is held: R(t) = 1 - sum_i share[i] (1 - exp(-t / time[i])) times the force that the
 * bundle's tissue has at once. Exact for tissue that relaxes alike everywhere under given displacements; loading slowly against
 * time[i] is softer, down to 1 - sum share. Acts on the tools' forces, after the response Q; contact nodes keep the force at
 * once. A tool that does not hold is never pulled by it; without contacts it feels nothing and its memory fades. */
#define PALPATE_MAX_RELAXATION_TERMS 8
typedef struct palpate_relaxation {
  palpate_relaxation_model model;             /* default OFF                                    */
  int32_t terms;                              /* 1 .. PALPATE_MAX_RELAXATION_TERMS              */
  double share[PALPATE_MAX_RELAXATION_TERMS]; /* 0 and above, together below 1                  */
  double time[PALPATE_MAX_RELAXATION_TERMS];  /* s, above 0                                     */
} palpate_relaxation;

/* A finer mesh that follows the surface: the one a renderer draws (palpate_skin). Every vertex is bound once, when the scene
 * is created, to the place of the surface at rest that is nearest to it, and moves by the barycentric weights of that place;
 * what it stands off the surface turns and stretches with the surface. Vertices may repeat, as at a texture's seam, and need
 * no triangles. Refused: a vertex that is not finite, or farther from the organ than the organ is large. */
typedef struct palpate_render_mesh {
  const float* positions; /* [vertex_count][3] m, in the bundle's frame, as the organ was meshed: before any preload */
  const float* normals;   /* [vertex_count][3] outward, of any length; NULL: palpate_skin gives none                 */
  int32_t vertex_count;   /* 1 and more                                                                              */
} palpate_render_mesh;

/* The host's memory; both NULL: malloc and free. allocate returns memory aligned to `alignment`, or NULL. */
typedef struct palpate_allocator {
  void* (*allocate)(void* user, size_t bytes, size_t alignment);
  void (*release)(void* user, void* memory);
  void* user;
} palpate_allocator;

typedef struct palpate_scene_def {
  palpate_collision collision;   /* default REST                                                                  */
  palpate_contact_model contact; /* default PATCH. Where a tool point that meets a triangle holds it: its nearest NODE,
                                    its TRIANGLE's vertices, the POINT itself, or a PATCH of the tool's radius about
                                    it; a tool of radius 0 is a POINT then                                         */
  palpate_contact_law law;       /* default STICKING. How tool points hold; grips always stick                    */
  palpate_force_model force;     /* default LINEAR                                                                */
  palpate_shape_model shape;     /* default SURFACE                                                               */
  palpate_radial_model radial;   /* default OFF                                                                   */
  palpate_preload_model preload; /* default OFF. ON: the rest shape is the one under the stored body force        */
  palpate_relaxation relaxation; /* default OFF                                                                   */
  int32_t max_tools;             /* default 4    [1 .. PALPATE_MAX_TOOLS]                                         */
  int32_t max_points;            /* default 64   tool points and grips of all tools together                      */
  int32_t max_contact_nodes;     /* default 192  nodes under contact: 3 per point or grip; of a PATCH those under its
                                    disc, a dozen where the mesh is coarse                                         */
  double force_limit;            /* default 50   N, on the length of each tool's force                            */
  double force_slew;             /* default 1e4  N/s, on the change of each tool's force; INFINITY: none          */
  /* default NULL: none. Read while the scene is created, and no longer. */
  const palpate_render_mesh* render_mesh;
  palpate_allocator allocator;
} palpate_scene_def;
#define PALPATE_MAX_TOOLS 8

PALPATE_API palpate_scene_def palpate_default_scene_def(void); /* start here, then change what you need */

/* Builds the plan: maps the sections the effects need and no other, and takes all memory. */
PALPATE_API palpate_status palpate_scene_create(palpate_bundle* bundle, const palpate_scene_def* def,
                                                palpate_scene** scene, palpate_error* error);
PALPATE_API void palpate_scene_destroy(palpate_scene* scene);

/* One line of the plan: a pass and what it maps. */
typedef struct palpate_plan_pass {
  const char* name;     /* "collision: deformed", "superposition: surface", ... */
  const char* half;     /* "create", "touch" or "shape"                        */
  const char* sections; /* "tensors/force mesh/nodes"                          */
  uint64_t mapped_bytes;
} palpate_plan_pass;
/* The passes in order; *count is set. Valid until the scene is destroyed. */
PALPATE_API const palpate_plan_pass* palpate_scene_plan(const palpate_scene* scene, int32_t* count);

/* What a step meets, on which its cost depends. */
typedef struct palpate_step_load {
  int32_t tools, points, grips; /* that are sent; points and grips of all tools together */
  int32_t contacts;             /* places and nodes that are held                        */
  int32_t rows;                 /* directions held of them: 3 each, fewer of some grips, 1 where they slide */
  int32_t nodes;                /* under contact: node_count of palpate_contacts         */
  int32_t slips;                /* contacts that slip                                    */
  int32_t sweeps;               /* of palpate_contacts                                   */
} palpate_step_load;

/* What a pass does in such a step. A machine that reads b bytes, does f flops and goes through s steps in a second takes
 * about max(bytes / b, flops / f) + steps / s. */
typedef struct palpate_pass_work {
  double bytes; /* read in runs                                                                          */
  double flops; /* of loops over runs: multiply-adds count twice                                         */
  double steps; /* of scalar code, in units of one multiply-add that waits for the one before: measured  */
} palpate_pass_work;
/* pass: its place in the plan. Zero for a pass of creation. */
PALPATE_API palpate_pass_work palpate_predict_pass(const palpate_scene* scene, int32_t pass,
                                                   const palpate_step_load* load);

/* For measuring: is called at the end of each stretch of a pass, in the thread of the step, with the pass's place in the
 * plan. The time since its last call, or since the step began, is that pass's; a pass may come several times in a step. NULL:
 * nothing is called (the default). Not while a step runs. */
typedef void (*palpate_pass_watcher)(void* user, int32_t pass);
PALPATE_API void palpate_watch_passes(palpate_scene* scene, palpate_pass_watcher watcher, void* user);

/* ---- touch: the haptic half -------------------------------------------------------------------------------------- */

/* A place of the surface held at a displacement, whatever the collision finds. A place in a triangle is held by the scene's
 * contact model; it needs a scene with collision, or with contact TRIANGLE or POINT (else it is bad input). */
typedef struct palpate_grip {
  int32_t node;           /* a touchable node, or -1: then triangle and barycentric say where                */
  int32_t triangle;       /* 0 .. F-1                                                                        */
  double barycentric[3];  /* sums to 1                                                                       */
  double displacement[3]; /* m, from the rest position                                                       */
  uint32_t axes;          /* bits 1, 2, 4: which of x, y, z are imposed; the others stay force-free. 7: all  */
} palpate_grip;

/* How a tool point holds the place it has met (palpate_contact_law):
 *   STICKING    the place moves with the tool, in every direction, as long as the contact lasts.
 *   SLIDING     along the surface's normal only; the place under the tool is found anew every step. No force across it.
 *   UNILATERAL  the same, and the tool never pulls: where another tool draws the surface away, the force is zero.
 *   COULOMB     the tool never pulls, and across the normal the place sticks as long as that takes no more than friction
 *               times the normal force; beyond, it slips under that force, and sticks again where it has come to.
 * The last two are solved by projected Gauss-Seidel, warm-started, when what sticking asks for is forbidden; the contacts'
 * residual says how well.
 *
 * A tool point that crosses into the organ sticks to the place where it went in: the place's displacement is the point minus
 * the place at rest. The contact ends when the point has come out again (unless hold); a point that left through a face
 * opposite to where it went in has passed through a thin part, pushes on, and is out once it is above its place's plane. A
 * point that is inside when it is first seen touches nothing until it has been outside.
 * Coordinates are at most 1e6 m from the origin; larger ones are bad input. */
typedef struct palpate_tool {
  const double* points; /* [point_count][3] m: tested against the surface when collision is on              */
  int32_t point_count;
  const palpate_grip* grips; /* [grip_count] */
  int32_t grip_count;
  int32_t hold;    /* 0: a contact ends when its tool point has moved out again; 1: it is held, and pulls  */
  double radius;   /* m, 0 .. 1: of the flat disc about each of its points, under PATCH. A displaced point has no
                      stiffness, its force belongs to the mesh; a disc's belongs to the organ              */
  double friction; /* 0 .. 100: of COULOMB                                                                 */
} palpate_tool;

/* One node under contact. */
typedef struct palpate_contact_node {
  int32_t node;                    /* mesh node index                                                                 */
  int32_t column;                  /* its place in tensors/nodes                                                      */
  int32_t tool;                    /* whose contact it is                                                             */
  int32_t point;                   /* the tool's point index, or point_count + grip index                             */
  double modified_displacement[3]; /* u~ of eq. 8: the coefficient of the node's tensor column, m                     */
  double force[3];                 /* f of W f = u*: on the organ at this node, N, after the force correction         */
} palpate_contact_node;

typedef struct palpate_tool_state {
  double force[3];     /* N, what the organ does to the tool, limited and slew-limited: send this to a device */
  double force_raw[3]; /* the same before the limits                                                            */
  double direction[3]; /* d_t: unit direction of the sum of the tool's imposed displacements; zero without one: P then
                          leaves its contribution as it is, and Q acts by its slope at zero */
  int32_t contact_count;
  int32_t slip_count;    /* of these, contacts that slipped this step (COULOMB)                   */
  int32_t release_count; /* of these, contacts that push nothing, though inside (UNILATERAL, COULOMB) */
  uint32_t flags;        /* the step flags that concern this tool */
} palpate_tool_state;

/* What touch hands to shape: plain data without pointers, node_count palpate_contact_node follow the struct. Copy used_bytes
 * of it through a mailbox or a socket. */
typedef struct palpate_contacts {
  uint32_t used_bytes;
  uint32_t flags; /* what palpate_touch returned */
  uint64_t step;
  int32_t node_count, node_capacity;
  int32_t tool_count;
  int32_t sweeps;               /* of Gauss-Seidel over the contacts; 0 where none was needed           */
  double residual_displacement; /* m: by how much the worst contact misses what was asked of it         */
  double residual_force;        /* N: the same, over that contact's own compliance                      */
  palpate_tool_state tools[PALPATE_MAX_TOOLS];
} palpate_contacts;

/* Bytes of a palpate_contacts with room for the scene's max_contact_nodes. 8-byte aligned memory of the caller's. */
PALPATE_API size_t palpate_contacts_bytes(const palpate_scene* scene);
PALPATE_API const palpate_contact_node* palpate_contacts_nodes(const palpate_contacts* contacts);

/* Bits of a step's return value; 0 is a fully trusted step. */
/* clang-format off */
enum {
  PALPATE_STEP_BAD_INPUT        = 1 << 0, /* NaN, infinity, negative count, unknown node: the tool kept its last good input */
  PALPATE_STEP_CONTACTS_DROPPED = 1 << 1, /* more contacts than the limits; the first ones kept                             */
  PALPATE_STEP_REGULARISED      = 1 << 2, /* contacts conflict: some miss their displacement, the force has a stated bound  */
  PALPATE_STEP_RESPONSE_RANGE   = 1 << 3, /* a correction was used outside its measured range (continued linearly)          */
  PALPATE_STEP_FORCE_LIMITED    = 1 << 4, /* a force was cut to force_limit or force_slew                                   */
  PALPATE_STEP_BUNDLE_LOST      = 1 << 5, /* the bundle's file shrank or was written over: do not trust this step           */
  PALPATE_STEP_NOT_TOUCHABLE    = 1 << 6, /* a tool met the surface where the bundle has no tensor column: the contact acts
                                             on the triangle's other nodes, or is not made where none has one               */
  PALPATE_STEP_UNSOLVED         = 1 << 7  /* numbers of the bundle, or made of them, are not finite, or too coarse for so many contacts: no contact forces, or no displacement of those nodes */
};
/* clang-format on */
typedef uint32_t palpate_step_flags;

/* Collision, contact solve, force. tools: [tool_count], in the same order every step. dt: s since the last touch, > 0; more
 * than 20 ms counts as 20 ms for force_slew. Always fills *contacts (of palpate_contacts_bytes, 8-byte aligned; NULL or not
 * aligned: bad input, and nothing is done). A tool that is not sent, tool_count 0 included, has no force from that step on. */
PALPATE_API palpate_step_flags palpate_touch(palpate_scene* scene, const palpate_tool* tools, int32_t tool_count,
                                             double dt, palpate_contacts* contacts);

/* Forgets contacts, last positions and forces, as after create. Belongs to the thread of palpate_touch. */
PALPATE_API void palpate_reset(palpate_scene* scene);

/* ---- shape: the render half -------------------------------------------------------------------------------------- */

/* Caller's arrays; either may be NULL. SHAPE_SURFACE fills the first Ns nodes, SHAPE_VOLUME all N. */
typedef struct palpate_shape_out {
  float* displacements; /* [node_capacity][3] m, from the rest shape                 */
  float* positions;     /* [node_capacity][3] m, rest shape (preload included) + that */
  int32_t node_capacity;
  int32_t node_count; /* out: nodes filled */
} palpate_shape_out;

/* Superposition (eq. 9) and radial correction of the contacts that touch made. */
PALPATE_API palpate_step_flags palpate_shape(palpate_scene* scene, const palpate_contacts* contacts,
                                             palpate_shape_out* out);

/* Caller's arrays; either may be NULL. */
typedef struct palpate_skin_out {
  float* positions; /* [vertex_capacity][3] m                                                      */
  float* normals;   /* [vertex_capacity][3] unit length; NULL for a render mesh without normals     */
  int32_t vertex_capacity;
  int32_t vertex_count; /* out: vertices filled */
} palpate_skin_out;

/* The scene's render mesh under a shape: of it, displacements and node_count as palpate_shape left them, at least those of the
 * surface. Belongs to the thread of palpate_shape. A node whose displacement is not finite counts as one that rests:
 * BAD_INPUT. A vertex that comes out not finite stays where it was bound: UNSOLVED. Cost: a pass over the surface's triangles
 * and one over the vertices. */
PALPATE_API palpate_step_flags palpate_skin(palpate_scene* scene, const palpate_shape_out* shape,
                                            palpate_skin_out* out);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_H */
