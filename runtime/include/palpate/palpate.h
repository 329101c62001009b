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
 * Words
 *   rest        the organ without tools, preload included if the scene has one; positions and displacements refer to it
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
 * Units    SI: metre, newton, second. Points are x y z, node after node, in the bundle's frame.
 * Memory   palpate_bundle_open* and palpate_scene_create take all memory. A step (palpate_scene_touch, palpate_scene_shape,
 *          palpate_scene_skin) never allocates, locks, prints, throws or makes a system call.
 * Threads  A bundle is constant and threads may share it. In one scene, palpate_scene_touch belongs to one thread and
 *          palpate_scene_shape to one thread. The two may be different threads and run at the same time; the palpate_contacts
 *          alone pass between them.
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

#include <stddef.h>
#include <stdint.h>

/* Windows: PALPATE_EXPORTS is defined while the DLL is built, PALPATE_SHARED in hosts that link it (CMake and pkg-config do). */
#if defined(_WIN32) && defined(PALPATE_EXPORTS)
#define PALPATE_API __declspec(dllexport)
#elif defined(_WIN32) && defined(PALPATE_SHARED)
#define PALPATE_API __declspec(dllimport)
#elif defined(_WIN32)
#define PALPATE_API
#elif defined(__GNUC__)
#define PALPATE_API __attribute__((visibility("default")))
#else
#define PALPATE_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

#define PALPATE_API_VERSION 2

typedef struct palpate_bundle palpate_bundle; /* constant: the precomputed tensors of one organ */
typedef struct palpate_scene palpate_scene;   /* mutable: one organ under one set of effects    */

/* ---- status and errors ------------------------------------------------------------------------------------------ */

typedef enum palpate_status {
  PALPATE_OK = 0,              /* the call did what it was asked to do                        */
  PALPATE_ERROR_TRUNCATED = 1, /* the file or memory has fewer bytes than the bundle states   */
  PALPATE_ERROR_MAGIC = 2,     /* the bytes are not a bundle, or its writer did not finish    */
  PALPATE_ERROR_VERSION = 3,   /* this library does not read the bundle's layout version      */
  PALPATE_ERROR_SECTION = 4,   /* a section is missing, out of bounds or of the wrong shape   */
  PALPATE_ERROR_CHECKSUM = 5,  /* the bytes differ from those that were written               */
  PALPATE_ERROR_CONTENT = 6,   /* a number in the bundle is unusable, such as an index beyond its target */
  PALPATE_ERROR_ARGUMENT = 7,  /* an argument is NULL or out of its range                     */
  PALPATE_ERROR_MEMORY = 8,    /* the allocator returned NULL                                 */
  PALPATE_ERROR_FILE = 9,      /* the file cannot be opened or mapped                         */
  PALPATE_ERROR_EFFECT = 10,   /* an effect needs a section that this bundle does not have    */
  PALPATE_ERROR_LOCK = 11      /* the system refuses to lock that much memory                 */
} palpate_status;

typedef struct palpate_error {
  palpate_status status;
  uint64_t byte_offset; /* of the fault in the bundle, bytes; 0 where none applies         */
  char text[240];       /* what was expected, what was found, what to do; ends with a zero */
} palpate_error;

/* The host's memory functions. Both NULL: the library uses those of the C library. allocate returns memory aligned to
 * `alignment` bytes, or NULL. */
typedef struct palpate_allocator {
  void* (*allocate)(void* user, size_t bytes, size_t alignment);
  void (*release)(void* user, void* memory);
  void* user;
} palpate_allocator;

/* ---- bundle ------------------------------------------------------------------------------------------------------ */

/* How to open a bundle. */
typedef struct palpate_bundle_options {
  uint32_t struct_bytes;       /* sizeof(palpate_bundle_options)                                         */
  palpate_allocator allocator; /* default NULL, NULL, NULL: of the bundle; a scene has one of its own    */
} palpate_bundle_options;
PALPATE_API void palpate_init_bundle_options(palpate_bundle_options* options, size_t struct_bytes);
static inline palpate_bundle_options palpate_default_bundle_options(void) {
  palpate_bundle_options options;
  palpate_init_bundle_options(&options, sizeof options);
  return options;
}

/* Checks and wraps the bytes of a bundle: a mapped file, an asset, a WebAssembly heap. The library never writes to the bytes,
 * which must be 64-byte aligned and outlive *bundle. Safe on untrusted input. options may be NULL: the defaults. error may be
 * NULL. Returns PALPATE_OK, or the reason, in which case *bundle is NULL. */
PALPATE_API palpate_status palpate_bundle_open(const void* bytes, size_t byte_count,
                                               const palpate_bundle_options* options, palpate_bundle** bundle,
                                               palpate_error* error);

/* The same for a file. Creating a scene maps the sections that the scene needs, read-only, and no others. A file that shrinks
 * while it is mapped does not end the host: the lost pages read as zero. Every step after the file was cut or written over
 * raises PALPATE_STEP_BUNDLE_LOST. A new file that replaces the old one by renaming changes nothing.
 * Windows: path is UTF-8. While the bundle is open the system lets nobody write to its file, so it can neither shrink nor be
 * replaced before palpate_bundle_close; a file that another program is writing does not open. A file on a network drive whose
 * server goes away ends the host: read such a file and use palpate_bundle_open. */
PALPATE_API palpate_status palpate_bundle_open_file(const char* path, const palpate_bundle_options* options,
                                                    palpate_bundle** bundle, palpate_error* error);

/* Compares every section with its checksum. Cost: reads the whole bundle. */
PALPATE_API palpate_status palpate_bundle_check(const palpate_bundle* bundle, palpate_error* error);

/* For loops with deadlines: reads every page of the sections that the bundle's scenes have mapped, so that no step waits for
 * the disk or takes a page fault. lock: not 0 also asks the system to keep those pages in memory (mlock; Windows: VirtualLock); without it the
 * system may take pages back when memory is short. Call it after palpate_scene_create and outside a step. Cost: one read of
 * those sections, and their size in memory while the bundle is open. For a bundle opened from bytes it does nothing, because
 * those bytes are the host's memory. Returns PALPATE_ERROR_LOCK where the system refuses to lock (its limit is RLIMIT_MEMLOCK,
 * `ulimit -l`); the pages have then been read all the same and the scene works as before. */
PALPATE_API palpate_status palpate_bundle_prefault(palpate_bundle* bundle, int32_t lock, palpate_error* error);

/* Destroy the bundle's scenes first. NULL is allowed. */
PALPATE_API void palpate_bundle_close(palpate_bundle* bundle);

typedef struct palpate_bundle_info {
  uint64_t identity;          /* checksum of the bundle's index, which holds the checksums of all sections: bundles
                                 with the same bytes have the same one                    */
  int32_t node_count;         /* N                                                        */
  int32_t surface_node_count; /* Ns                                                       */
  int32_t triangle_count;     /* F                                                        */
  int32_t tetrahedron_count;  /* E                                                        */
  int32_t touchable_count;    /* S                                                        */
  int32_t has_interior;       /* 1: PALPATE_SHAPE_VOLUME is possible                      */
  int32_t has_radial;         /* 1: the bundle has P (PALPATE_RADIAL_RESPONSE)            */
  int32_t has_force;          /* 1: the bundle has Q (PALPATE_FORCE_RESPONSE)             */
  int32_t has_preload;        /* 1: the bundle has the displacement under a body force    */
  int32_t reserved;           /* 0                                                        */
} palpate_bundle_info;
PALPATE_API void palpate_bundle_fill_info(const palpate_bundle* bundle, palpate_bundle_info* info, size_t struct_bytes);
static inline palpate_bundle_info palpate_bundle_describe(const palpate_bundle* bundle) {
  palpate_bundle_info info;
  palpate_bundle_fill_info(bundle, &info, sizeof info);
  return info;
}

/* Views of the bundle's own bytes, valid until the bundle is closed; NULL where the section cannot be mapped. The first call
 * maps the section of a file: do not call these in a step.
 *   nodes       [N][3] m, positions as meshed        triangles   [F][3] node indices, counter-clockwise from outside
 *   tetrahedra  [E][4] node indices                  touchable   [S] the node of each tensor column
 *   fixed       [N][3] 1: the node is fixed along x, y or z */
PALPATE_API const double* palpate_bundle_nodes(const palpate_bundle* bundle);
PALPATE_API const int32_t* palpate_bundle_triangles(const palpate_bundle* bundle);
PALPATE_API const int32_t* palpate_bundle_tetrahedra(const palpate_bundle* bundle);
PALPATE_API const int32_t* palpate_bundle_touchable(const palpate_bundle* bundle);
PALPATE_API const uint8_t* palpate_bundle_fixed(const palpate_bundle* bundle);
/* JSON of *byte_count bytes without a zero at the end: organ, element, sources of the bundle (formats/BUNDLE.md). */
PALPATE_API const char* palpate_bundle_provenance(const palpate_bundle* bundle, size_t* byte_count);

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

/* How the anchor of a tool point may move against the tool. A grip always sticks. */
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
  PALPATE_FORCE_RESPONSE /* the linear one, corrected by Q: its component F along the tool's direction becomes Q(F) */
} palpate_force_model;

/* Which nodes palpate_scene_shape moves. */
typedef enum palpate_shape_model {
  PALPATE_SHAPE_OFF,     /* none: a scene for forces alone                                                         */
  PALPATE_SHAPE_SURFACE, /* nodes 0 .. Ns-1                                                                        */
  PALPATE_SHAPE_VOLUME   /* all N nodes                                                                            */
} palpate_shape_model;

/* Whether P corrects the shape. */
typedef enum palpate_radial_model {
  PALPATE_RADIAL_OFF,     /* the shape of linear elasticity                                                        */
  PALPATE_RADIAL_RESPONSE /* each tool's displacement of length r across the tool's direction gets the length P(r)  */
} palpate_radial_model;

/* Whether rest includes the organ's sag under the body force that was precomputed. */
typedef enum palpate_preload_model {
  PALPATE_PRELOAD_OFF, /* rest is the shape as it was meshed                                                       */
  PALPATE_PRELOAD_ON   /* rest is the shape under the stored body force, such as gravity                           */
} palpate_preload_model;

/* Whether a force decays while a displacement is held. */
typedef enum palpate_relaxation_model {
  PALPATE_RELAXATION_OFF,  /* forces depend on the present displacements alone                                     */
  PALPATE_RELAXATION_PRONY /* forces decay by a sum of exponentials (a Prony series)                               */
} palpate_relaxation_model;

/* A force that decays while a displacement is held: R(t) = 1 - sum_i share[i] (1 - exp(-t / time[i])) times the instantaneous
 * force, which the bundle's moduli give. Exact for tissue that relaxes alike everywhere, under given displacements. Loading
 * that is slow against time[i] is softer, down to the factor 1 - sum share. It acts on each tool's force, after Q; the contact
 * nodes keep the instantaneous force. Relaxation never makes a tool without `hold` pull. A tool without contacts feels no
 * force, and its memory of earlier forces fades. */
#define PALPATE_MAX_RELAXATION_TERMS 8
typedef struct palpate_relaxation {
  palpate_relaxation_model model;             /* default OFF                                    */
  int32_t terms;                              /* 1 .. PALPATE_MAX_RELAXATION_TERMS              */
  double share[PALPATE_MAX_RELAXATION_TERMS]; /* each 0 or more, together below 1               */
  double time[PALPATE_MAX_RELAXATION_TERMS];  /* s, above 0                                     */
} palpate_relaxation;

/* A finer mesh that follows the organ's surface, for a renderer (palpate_scene_skin). Creating the scene binds each vertex to
 * the surface point that is nearest to it on the meshed shape. In a step the vertex moves by the barycentric weights of that
 * point, and its offset from the surface turns and stretches with the surface. Vertices may repeat, as at the seam of a
 * texture, and need no triangles. A vertex that is not finite, or farther from the organ than the organ is large, is refused. */
typedef struct palpate_render_mesh {
  uint32_t struct_bytes; /* sizeof(palpate_render_mesh)                                                         */
  int32_t vertex_count;  /* 1 or more                                                                           */
  const float*
      positions; /* [vertex_count][3] m, in the bundle's frame, on the shape as it was meshed (without preload) */
  const float* normals; /* default NULL: palpate_scene_skin gives no normals; else [vertex_count][3] outward, of any
                           length                                                                               */
} palpate_render_mesh;
PALPATE_API void palpate_init_render_mesh(palpate_render_mesh* mesh, size_t struct_bytes);
static inline palpate_render_mesh palpate_default_render_mesh(void) {
  palpate_render_mesh mesh;
  palpate_init_render_mesh(&mesh, sizeof mesh);
  return mesh;
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
  palpate_relaxation relaxation; /* default OFF                                                                   */
  int32_t max_tools;             /* default 4    [1 .. PALPATE_MAX_TOOLS]                                         */
  int32_t max_points;            /* default 64   [1 .. 100000] tool points and grips of all tools together        */
  int32_t max_contact_nodes;     /* default 192  [1 .. 3000] nodes under contact: up to 3 for each tool point or grip;
                                    under a PATCH the nodes below the disc, about a dozen on a coarse mesh        */
  double force_limit;            /* default 50   N, above 0: largest length of each tool's force                  */
  double force_slew;             /* default 1e4  N/s, above 0: largest change of each tool's force; INFINITY: none */
  double max_tool_speed;         /* default 10   m/s, above 0: a tool point that moves faster has lost its tracking;
                                    INFINITY: none                                                              */
  double release_distance;       /* default 0    m: a contact ends where the tool point is farther from its anchor,
                                    both from where it rests and from where the other contacts take it; 0: a fifth
                                    of the diagonal of the organ's box; INFINITY: never                         */
  const palpate_render_mesh* render_mesh; /* default NULL: none. palpate_scene_create reads it and does not keep it */
  palpate_allocator allocator;            /* default NULL, NULL, NULL                                              */
} palpate_scene_def;
#define PALPATE_MAX_TOOLS 8

/* The defaults above; change what you need. */
PALPATE_API void palpate_init_scene_def(palpate_scene_def* def, size_t struct_bytes);
static inline palpate_scene_def palpate_default_scene_def(void) {
  palpate_scene_def def;
  palpate_init_scene_def(&def, sizeof def);
  return def;
}

/* Makes a scene: maps the sections that its effects need and no others, and takes all its memory. The bundle must outlive the
 * scene. error may be NULL. Returns PALPATE_OK, or the reason, in which case *scene is NULL. */
PALPATE_API palpate_status palpate_scene_create(palpate_bundle* bundle, const palpate_scene_def* def,
                                                palpate_scene** scene, palpate_error* error);
PALPATE_API void palpate_scene_destroy(palpate_scene* scene);

/* One pass of the plan: a piece of work that a step does, or that creating the scene did. */
typedef struct palpate_plan_pass {
  const char* name;      /* "collision: deformed", "superposition: surface", ...          */
  const char* half;      /* who runs it: "create", "touch" or "shape"                     */
  const char* sections;  /* the bundle sections it reads: "tensors/force mesh/nodes"      */
  uint64_t mapped_bytes; /* of those sections                                             */
} palpate_plan_pass;
/* The passes in order, pass 0 first; NULL behind the last one. Valid until the scene is destroyed. */
PALPATE_API const palpate_plan_pass* palpate_scene_plan(const palpate_scene* scene, int32_t pass);

/* The quantities of a step that its cost depends on. */
typedef struct palpate_step_load {
  uint32_t struct_bytes;        /* sizeof(palpate_step_load)                                                */
  int32_t tools, points, grips; /* sent to the step; points and grips of all tools together                 */
  int32_t contacts;             /* made by the step                                                         */
  int32_t rows;                 /* imposed directions: 3 of each contact, 1 where it slides, a grip's axes   */
  int32_t nodes;                /* under contact: node_count of palpate_contacts                            */
  int32_t slips;                /* contacts that slip                                                       */
  int32_t sweeps;               /* of palpate_contacts                                                      */
  int32_t reserved;             /* 0                                                                        */
} palpate_step_load;
PALPATE_API void palpate_init_step_load(palpate_step_load* load, size_t struct_bytes);
static inline palpate_step_load palpate_default_step_load(void) {
  palpate_step_load load;
  palpate_init_step_load(&load, sizeof load);
  return load;
}

/* The work of one pass in such a step. A machine that reads b bytes, does f flops and runs s steps of scalar code in a second
 * takes about max(bytes / b, flops / f) + steps / s seconds. */
typedef struct palpate_pass_work {
  double bytes; /* read from memory in long runs                                                              */
  double flops; /* in loops over long runs: a multiply-add counts 2                                           */
  double steps; /* of scalar code; the unit is one multiply-add that waits for the one before; measured       */
} palpate_pass_work;
/* pass: its index in the plan. All zero for a pass of creation, and for a load that is NULL or refused. */
PALPATE_API palpate_pass_work palpate_predict_pass(const palpate_scene* scene, int32_t pass,
                                                   const palpate_step_load* load);

/* For measuring. A step calls the watcher, in its own thread, each time that it has finished a part of a pass; pass: the
 * index in the plan. The time since the watcher's last call, or since the step began, belongs to that pass. A pass may come
 * several times in a step. NULL, the default, calls nothing. Do not change the watcher while a step runs. */
typedef void (*palpate_pass_watcher)(void* user, int32_t pass);
PALPATE_API void palpate_watch_passes(palpate_scene* scene, palpate_pass_watcher watcher, void* user);

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
  double displacement[3]; /* m, from rest                                                                    */
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
 * - It ends when the tool point has come out again, unless hold is set. A point that leaves through an opposite face has gone
 *   through a thin part: the contact stays until the point is above the plane of its anchor's triangle.
 * - A point that is inside when it is first seen touches nothing until it has been outside once.
 * From step to step a tool is known by its id. Its contacts, its points (by their order within the tool), its last force and
 * its relaxation follow the id when the tools' order changes. A tool that is not sent in a step is forgotten.
 * Coordinates farther than 1e6 m from the origin are bad input. */
typedef struct palpate_tool {
  uint32_t struct_bytes;     /* sizeof(palpate_tool)                                                            */
  int32_t id;                /* 0 or more, another one for each tool of a step; default -1: its index in the step */
  const double* points;      /* [point_count][3] m, tested against the surface where the scene has collision    */
  const palpate_grip* grips; /* [grip_count]                                                                    */
  int32_t point_count;       /* default 0                                                                       */
  int32_t grip_count;        /* default 0                                                                       */
  double disc_radius;        /* default 0 m, 0 .. 1: radius of the flat disc that each point presses on the organ, under
                                PATCH. It is not a collision radius: the points themselves are tested. 0: a point */
  double friction;           /* default 0, 0 .. 100: Coulomb's coefficient, under COULOMB                       */
  int32_t hold;     /* default 0: a contact ends when its tool point has come out again; 1: it stays, and pulls */
  int32_t reserved; /* 0                                                                               */
} palpate_tool;
PALPATE_API void palpate_init_tool(palpate_tool* tool, size_t struct_bytes);
static inline palpate_tool palpate_default_tool(void) {
  palpate_tool tool;
  palpate_init_tool(&tool, sizeof tool);
  return tool;
}

/* One node under contact. */
typedef struct palpate_contact_node {
  int32_t node;                    /* mesh node index                                                                 */
  int32_t column;                  /* index of the node in tensors/nodes: its tensor column                           */
  int32_t tool;                    /* index of the tool in this step                                                  */
  int32_t point;                   /* index of the tool point, or point_count + index of the grip                     */
  double modified_displacement[3]; /* u~ of eq. 8, m                                                                  */
  double force[3];                 /* N, on the organ at this node, after the correction by Q                         */
} palpate_contact_node;

/* What a step found out about one tool. */
typedef struct palpate_tool_state {
  double force[3];     /* N, on the tool, within force_limit and force_slew: send this one to a device              */
  double force_raw[3]; /* N, on the tool, before those limits                                                       */
  double direction[3]; /* unit direction of the sum of the tool's imposed displacements. Zero where they cancel: P then
                            leaves the tool's displacements as they are, and Q acts with its slope at zero             */
  int32_t contact_count; /* contacts of the tool                                                                      */
  int32_t slip_count;    /* of these, contacts that slipped in this step (COULOMB)                                    */
  int32_t release_count; /* of these, contacts without force although the point is inside (UNILATERAL, COULOMB)       */
  uint32_t flags;        /* the step flags that concern this tool                                                     */
  int32_t id;            /* of the tool; its index where the host gave none                                           */
  int32_t reserved;      /* 0                                                                                         */
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
  double residual_displacement; /* m: by how much the worst contact misses its u*                                 */
  double residual_force;        /* N: the same, divided by that contact's own compliance                          */
} palpate_contacts;

/* Bytes of a palpate_contacts with room for PALPATE_MAX_TOOLS tools and the scene's max_contact_nodes; sizeof is not enough. */
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

/* Bits of a step's return value; 0 is a fully trusted step. */
/* clang-format off */
enum {
  PALPATE_STEP_BAD_INPUT        = 1 << 0, /* NaN, infinity, a negative count, an unknown node: the tool kept its last good input */
  PALPATE_STEP_CONTACTS_DROPPED = 1 << 1, /* more points or contacts than the scene's limits; the step kept the first ones       */
  PALPATE_STEP_REGULARISED      = 1 << 2, /* contacts conflict: some miss their displacement; their force has a stated bound     */
  PALPATE_STEP_RESPONSE_RANGE   = 1 << 3, /* P or Q was used beyond its measured range, where it continues as a straight line    */
  PALPATE_STEP_FORCE_LIMITED    = 1 << 4, /* a force was cut to force_limit or force_slew                                        */
  PALPATE_STEP_BUNDLE_LOST      = 1 << 5, /* the bundle's file was cut or written over: do not trust this step                   */
  PALPATE_STEP_NOT_TOUCHABLE    = 1 << 6, /* a tool met nodes without a tensor column (fixed ones, say): the contact acts on the
                                             other nodes there, or is not made where there are none                             */
  PALPATE_STEP_UNSOLVED         = 1 << 7, /* a number is not finite, or the stored precision is too coarse for so many contacts:
                                             the step has no contact forces, or no displacement of those nodes                  */
  PALPATE_STEP_OTHER_BUNDLE     = 1 << 8, /* the contacts given to palpate_scene_shape are of another bundle: the shape is at rest */
  PALPATE_STEP_TRACKING_LOST    = 1 << 9, /* a tool point moved faster than max_tool_speed, jumped through the organ in one
                                             step, or left its contact by more than release_distance: it has no contact until
                                             it has been outside and comes in again                                         */
  PALPATE_STEP_WORK_DEFERRED    = 1 << 10 /* more contacts had to be tested than a step's work allows: some of them hold, although
                                             they may have come out, and are tested in the next steps                       */
};
/* clang-format on */
typedef uint32_t palpate_step_flags;

/* The touch step: finds the contacts of the tools, solves for u~ (eqs 7 and 8 of the paper) and for the forces.
 * tools: [tool_count], in any order (palpate_tool.id). A tool that is not sent has no force from that step on. Two tools with
 * one id, an id below -1, or tools with different struct_bytes: bad input, and all tools keep their last good input.
 * dt: s since the last touch step, above 0; for force_slew more than 0.02 s counts as 0.02 s.
 * Always fills *contacts, which has contacts_bytes bytes and is 8-byte aligned. If contacts is NULL, not aligned or smaller
 * than palpate_contacts_bytes(scene), the step does nothing, writes nothing and returns BAD_INPUT. */
PALPATE_API palpate_step_flags palpate_scene_touch(palpate_scene* scene, const palpate_tool* tools, int32_t tool_count,
                                                   double dt, palpate_contacts* contacts, size_t contacts_bytes);

/* Forgets contacts, last positions and forces: the state after creation. Call it in the thread of palpate_scene_touch. */
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

/* The caller's arrays; either may be NULL. */
typedef struct palpate_skin_out {
  uint32_t struct_bytes;   /* sizeof(palpate_skin_out)                                                            */
  int32_t vertex_capacity; /* in: room in each array                                                              */
  int32_t vertex_count;    /* out: vertices filled                                                                */
  int32_t reserved;        /* 0                                                                                   */
  float* positions;        /* default NULL; [vertex_capacity][3] m                                                */
  float* normals;          /* default NULL; [vertex_capacity][3] unit length; NULL for a render mesh without normals */
} palpate_skin_out;
PALPATE_API void palpate_init_skin_out(palpate_skin_out* out, size_t struct_bytes);
static inline palpate_skin_out palpate_default_skin_out(void) {
  palpate_skin_out out;
  palpate_init_skin_out(&out, sizeof out);
  return out;
}

/* Moves the scene's render mesh with a shape. shape: as palpate_scene_shape filled it; this call reads its displacements and
 * node_count, at least Ns. Call it in the thread of palpate_scene_shape. A node whose displacement is not finite counts as
 * unmoved (BAD_INPUT). A vertex that would not be finite stays where it was bound (UNSOLVED). Cost: one pass over the surface's
 * triangles and one over the vertices. */
PALPATE_API palpate_step_flags palpate_scene_skin(palpate_scene* scene, const palpate_shape_out* shape,
                                                  palpate_skin_out* out);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_H */
