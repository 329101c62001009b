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
 *          palpate_scene_shape with skin, inside and carry to one thread, and palpate_scene_deform (LARGE_BESIDE) to one thread. They may be different
 *          threads and run at the same time. The palpate_contacts alone pass from touch to shape; touch and deform hand over
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
#define PALPATE_VERSION_MAJOR 0
#define PALPATE_VERSION_MINOR 1
#define PALPATE_VERSION_PATCH 0

/* The version of the library that is linked at run time, "0.1.0"; the macros above are those of this header.
 * numbers: [4] PALPATE_API_VERSION, major, minor and patch of the library; may be NULL. */
PALPATE_API const char* palpate_version(int32_t* numbers);

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

/* What palpate_bundle_open_file does with a section of the file that a scene needs. */
typedef enum palpate_file_access {
  PALPATE_FILE_MAP, /* maps it, read-only: pages are read when they are used, take no memory of the process and are shared with
                       other processes. Reading a page of a file that was cut meanwhile raises SIGBUS in the host, which ends
                       a process without a handler. The library installs none                                              */
  PALPATE_FILE_MAP_GUARDED, /* the same with a handler of SIGBUS for the whole process: the lost page then reads as zeros, and
                       each later step raises PALPATE_STEP_BUNDLE_LOST. Any other SIGBUS goes on to the handler that was there
                       before. When the last bundle that was opened so is closed, or the library is unloaded, that handler is
                       put back, unless the host has installed another one meanwhile: a host that passes signals from its own
                       handler on to the library's must stop that before it unloads the library                            */
  PALPATE_FILE_COPY /* copies it into memory of the bundle's allocator, once for all scenes of the bundle. No signal can come,
                       and whoever cuts or overwrites the file later cannot harm a scene that exists                       */
} palpate_file_access;

typedef enum palpate_log_level {
  PALPATE_LOG_NOTE,   /* what was opened or created                                                 */
  PALPATE_LOG_WARNING /* works, but the host may want something else                                */
} palpate_log_level;
/* The host's log. Opening a bundle, creating a scene on it and palpate_bundle_prefault call it in the thread that calls
 * them; a step never does. text: one sentence without a line break, valid during the call. Errors are not logged: they are
 * in palpate_error. */
typedef void (*palpate_log)(void* user, palpate_log_level level, const char* text);

/* How to open a bundle. */
typedef struct palpate_bundle_options {
  uint32_t struct_bytes;           /* sizeof(palpate_bundle_options)                                         */
  palpate_file_access file_access; /* default MAP; for palpate_bundle_open_file alone                        */
  palpate_allocator allocator;     /* default NULL, NULL, NULL: of the bundle; a scene has one of its own    */
  palpate_log log;                 /* default NULL: nothing is logged                                        */
  void* log_user;                  /* default NULL: passed to log                                            */
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

/* The same for a file. Creating a scene maps or copies (palpate_file_access) the sections that the scene needs and no others.
 * The file stays open until the bundle is closed. A new file that replaces the old one by renaming changes nothing. Where a
 * mapped file is written over in place, each later step raises PALPATE_STEP_BUNDLE_LOST.
 * Windows: path is UTF-8. While the bundle is open the system lets nobody write to its file, so it can neither shrink nor be
 * replaced before palpate_bundle_close; both ways of mapping are the same. A file that another program is writing does not open.
 * A mapped file on a network drive whose server goes away ends the host: copy such a file. */
PALPATE_API palpate_status palpate_bundle_open_file(const char* path, const palpate_bundle_options* options,
                                                    palpate_bundle** bundle, palpate_error* error);

/* Compares every section with its checksum. Cost: reads the whole bundle. */
PALPATE_API palpate_status palpate_bundle_check(const palpate_bundle* bundle, palpate_error* error);

/* For loops with deadlines: reads every page of the sections that the bundle's scenes have mapped or copied, so that no step
 * waits for the disk or takes a page fault. lock: not 0 also asks the system to keep those pages in memory (mlock; Windows:
 * VirtualLock); without it the system may take pages back when memory is short. Call it after palpate_scene_create and outside
 * a step. Cost: one read of
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
  int32_t has_large;          /* 1: PALPATE_DEFORMATION_LARGE and _BESIDE are possible    */
  int32_t motion_count;       /* M: motions (palpate_bundle_motion)                       */
  int32_t reserved;           /* 0                                                        */
} palpate_bundle_info;
PALPATE_API void palpate_bundle_fill_info(const palpate_bundle* bundle, palpate_bundle_info* info, size_t struct_bytes);
static inline palpate_bundle_info palpate_bundle_describe(const palpate_bundle* bundle) {
  palpate_bundle_info info;
  palpate_bundle_fill_info(bundle, &info, sizeof info);
  return info;
}

/* Views of the bundle's own bytes, valid until the bundle is closed; NULL where the section cannot be mapped or copied. The
 * first call maps or copies the section of a file: do not call these in a step.
 *   nodes       [N][3] m, positions as meshed        triangles   [F][3] node indices, counter-clockwise from outside
 *   tetrahedra  [E][4] node indices                  touchable   [S] the node of each tensor column
 *   fixed       [N][3] 1: the node is fixed along x, y or z */
PALPATE_API const double* palpate_bundle_nodes(const palpate_bundle* bundle);
PALPATE_API const int32_t* palpate_bundle_triangles(const palpate_bundle* bundle);
PALPATE_API const int32_t* palpate_bundle_tetrahedra(const palpate_bundle* bundle);
PALPATE_API const int32_t* palpate_bundle_touchable(const palpate_bundle* bundle);
PALPATE_API const uint8_t* palpate_bundle_fixed(const palpate_bundle* bundle);
/* What a unit of a motion is. */
typedef enum palpate_motion_kind {
  PALPATE_MOTION_PISTON = 1,   /* supports move by 1 m along an axis                                                */
  PALPATE_MOTION_ROTATION = 2, /* supports turn by 1 rad about an axis, linearly: right for small angles            */
  PALPATE_MOTION_FIELD = 3,    /* supports move once as a file said                                                 */
  PALPATE_MOTION_PRESSURE = 4, /* 1 Pa on a piece of the surface, or in a cavity                                    */
  PALPATE_MOTION_GRAVITY = 5   /* 1 m/s^2 along x, y or z of the organ's frame                                      */
} palpate_motion_kind;
#define PALPATE_MAX_MOTIONS 32

/* One motion of a bundle; the library fills it. */
typedef struct palpate_motion_info {
  palpate_motion_kind kind; /* what its unit is                                                                     */
  int32_t reserved;         /* 0                                                                                    */
  char name[64];            /* as the boundary file has it; ends with a zero                                        */
} palpate_motion_info;
/* Fills *info for motion 0 .. motion_count - 1 (palpate_bundle_info). The first call maps or copies sections of a file: do not call
 * it in a step. error may be NULL. */
PALPATE_API palpate_status palpate_bundle_motion(const palpate_bundle* bundle, int32_t motion,
                                                 palpate_motion_info* info, size_t struct_bytes, palpate_error* error);

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

/* Whether the scene answers queries about its surface (palpate_scene_cast_ray and others). */
typedef enum palpate_query_model {
  PALPATE_QUERIES_OFF, /* no queries, and no memory for them                                                       */
  PALPATE_QUERIES_ON   /* rays, nearest points and distances, on the surface at rest and deformed                  */
} palpate_query_model;

/* Whether palpate_scene_report tells each contact of a step, and what began and ended in it. */
typedef enum palpate_report_model {
  PALPATE_REPORT_OFF,     /* no report, and neither time nor memory for it                                          */
  PALPATE_REPORT_CONTACTS /* contacts and events                                                                   */
} palpate_report_model;

/* Whether palpate_scene_skin dents the render mesh below each disc, where the bundle's mesh is too coarse to show it. */
typedef enum palpate_dent_model {
  PALPATE_DENT_OFF, /* the render mesh follows the bundle's surface alone                                         */
  PALPATE_DENT_DISCS /* it also meets the disc of each contact: the closed-form dent of a rigid punch less what the mesh shows
                        of it (docs/method.md, section 18). Needs a render_mesh, contact PATCH and report CONTACTS; it changes
                        what is drawn, and no force                                                                */
} palpate_dent_model;

/* Whether the scene tells strain and stress inside the organ (palpate_scene_inside) and carries meshes inside it
 * (palpate_scene_carry). */
typedef enum palpate_inside_model {
  PALPATE_INSIDE_OFF, /* neither, and neither memory nor time for them                                           */
  PALPATE_INSIDE_ON   /* both. Needs shape VOLUME and a bundle of the elements p1 or p1-anp                      */
} palpate_inside_model;

/* How the organ deforms. */
typedef enum palpate_deformation_model {
  PALPATE_DEFORMATION_LINEAR, /* by superposition of the tensors: right for small displacements                    */
  PALPATE_DEFORMATION_LARGE, /* as the hyperelastic body that its mesh and laws make: forces and shape are right at any depth,
                                 and a step takes longer (docs/method.md, section 14). The bundle must have been made for it
                                 (palpate-precompute --large-deformation). RESPONSE is refused beside it: it corrects a
                                 linear answer                                                                            */
  PALPATE_DEFORMATION_LARGE_BESIDE, /* the same body, solved by palpate_scene_deform in a thread of its own. The touch step takes
                                 the newest solution and goes on from it by superposition, as fast as LINEAR: for bodies that
                                 are too large to be solved in each step                                                  */
  PALPATE_DEFORMATION_LARGE_RENEWED /* LARGE_BESIDE for slender parts and nearly incompressible tissue (Poisson's ratio above 0.495): while
                                 it solves, palpate_scene_deform also makes a new metric of the solver from the body as it is, a 16th of it in
                                 each call. Takes five times the memory of the factor, and more time in the third thread */
} palpate_deformation_model;

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

/* A finer surface of the organ, which tools meet in place of the bundle's triangles: collision, the places and normals of contacts,
 * the directions of contact laws and discs, the report and the queries are those of this surface. The mechanics stay those of
 * the bundle: a contact acts on the nodes below its place. Give the surface that is drawn: its vertices move as those of the same
 * render mesh, apart from what the mesh stretches (docs/method.md, section 9). Grips and the shape stay on the bundle's triangles.
 * Creating the scene binds each vertex to the surface point that is nearest to it on the meshed shape. Refused: a surface that is
 * not closed, is inside out, has a vertex that is not finite or farther from the mesh than a mean edge of the mesh. */
typedef struct palpate_fine_surface {
  uint32_t struct_bytes;  /* sizeof(palpate_fine_surface)                                                         */
  int32_t vertex_count;   /* 4 .. 10 million                                                                      */
  const float* positions; /* [vertex_count][3] m, in the bundle's frame, on the shape as it was meshed            */
  const int32_t*
      triangles;          /* [triangle_count][3] vertices, counter-clockwise from outside; each edge in two triangles */
  int32_t triangle_count; /* 4 .. 20 million                                                                      */
  int32_t reserved;       /* 0                                                                                    */
} palpate_fine_surface;
PALPATE_API void palpate_init_fine_surface(palpate_fine_surface* surface, size_t struct_bytes);
static inline palpate_fine_surface palpate_default_fine_surface(void) {
  palpate_fine_surface surface;
  palpate_init_fine_surface(&surface, sizeof surface);
  return surface;
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
  int32_t max_contact_nodes;     /* default 0    [0 .. 3000] nodes under contact, a node under several contacts counted
                                    for each: 3 for each tool point or grip, 1 under NODE, under PATCH those below the
                                    disc, about a dozen on a coarse mesh. Where that is short, each disc and POINT acts
                                    on fewer nodes (DISCS_THINNED), and no contact is dropped as long as there is a node
                                    for each. Refused: fewer than 1 for each of max_points (under TRIANGLE 3), each of
                                    max_links and each tool that may grasp, unless it is 3000. 0: 8 for each of
                                    max_points, but 192 .. 1024, and what links and grasps need; where max_points needs
                                    more than that, creating the scene warns (palpate_log). The solver takes 72 bytes
                                    times the square of this number or of S, the smaller (at 3000 648 MB), and 144
                                    bytes times the square of the contacts, of which each point or grip makes 1 (under
                                    TRIANGLE 3). palpate_scene_plan states it                                   */
  double force_limit;            /* default 50   N, above 0: largest length of each tool's force                  */
  double force_slew;             /* default 1e4  N/s, above 0: largest change of each tool's force; INFINITY: none */
  double max_tool_speed;         /* default 10   m/s, above 0: a tool point that moves faster has lost its tracking;
                                    INFINITY: none                                                              */
  double release_distance;       /* default 0    m: a contact ends where the tool point is farther from its anchor,
                                    both from where it rests and from where the other contacts take it; 0: a fifth
                                    of the diagonal of the organ's box; INFINITY: never                         */
  const palpate_render_mesh* render_mesh; /* default NULL: none. palpate_scene_create reads it and does not keep it */
  palpate_allocator allocator;            /* default NULL, NULL, NULL                                              */
  palpate_query_model queries;            /* default OFF                                                           */
  palpate_report_model report;            /* default OFF                                                           */
  double torque_limit;    /* default 5    N m, above 0: largest length of each tool's torque; INFINITY: none          */
  double torque_slew;     /* default 1e3  N m/s, above 0: largest change of each tool's torque; INFINITY: none        */
  int64_t max_operations; /* default 300000: counted operations of a touch step, about 0.3 ms where docs/speed.md
                                             was measured (palpate_operations_in). Tests, moves of contacts and grips that
                                             do not fit are put off to the next steps (WORK_DEFERRED), and forces are
                                             solved less exactly (SOLVE_INEXACT). A contact that no step has room for,
                                             because its rows and the others' are too many, waits and stays flagged: the
                                             default has room for 190 with three rows each.
                                             palpate_scene_most_operations() states what a step may count in all. Refused
                                             where it is less than a step needs at least, some 40000 and 25 for each of
                                             max_points. Counts do not depend on the machine, so the same input gives the
                                             same bits                                                                  */
  const palpate_fine_surface*
      fine_surface; /* default NULL: tools meet the bundle's triangles. palpate_scene_create reads it and
                                               does not keep it. Needs collision or queries                     */
  palpate_deformation_model deformation; /* default LINEAR                                                           */
  int32_t
      max_links; /* default 0    [0 .. 1000] links (palpate_scene_set_links); 0: none, and neither time nor memory for
                                     them. Refused beside LARGE and LARGE_BESIDE                                      */
  int32_t
      grasps; /* default 0: no tool grasps, and there is no memory for it; 1: each tool may (palpate_grasp). Needs PATCH
                                     and LINEAR                                                                       */
  palpate_dent_model dent; /* default OFF                                                                            */
  int32_t motions; /* default 0: supports stand, nothing presses, and it costs neither time nor memory; 1: the bundle's
                       motions move the organ (palpate_scene_set_motions). Needs collision OFF or DEFORMED, and LINEAR  */
  palpate_inside_model inside; /* default OFF                                                                        */
  int32_t needles; /* default 0: no tool has a needle, and it costs neither time nor memory; 1: each tool may
                            (palpate_needle). Needs a bundle with a corridor, LINEAR, and displacements that are stored in
                            f32 or as a compliance in blocks                                                        */
  int32_t
      needle_places; /* default 32, 2 .. 64: places of the tissue that each needle holds at most, where there are needles */
} palpate_scene_def;
#define PALPATE_MAX_TOOLS 8

/* The defaults above; change what you need. */
PALPATE_API void palpate_init_scene_def(palpate_scene_def* def, size_t struct_bytes);
static inline palpate_scene_def palpate_default_scene_def(void) {
  palpate_scene_def def;
  palpate_init_scene_def(&def, sizeof def);
  return def;
}

/* The fields of palpate_scene_def, for hosts that give them by their names: bindings, readers of files, forms. */
typedef enum palpate_key_type {
  PALPATE_KEY_CHOICE, /* an enum: the index of one of `words`                              */
  PALPATE_KEY_FLAG,   /* int32_t: 0 or 1                                                   */
  PALPATE_KEY_COUNT,  /* a whole number: int32_t, or int64_t where it has 8 bytes          */
  PALPATE_KEY_NUMBER, /* double; an array of them where it has more than 8 bytes           */
  PALPATE_KEY_POINTER /* the host's, or NULL; the allocator begins with one                */
} palpate_key_type;
typedef struct palpate_key {
  const char* name;      /* "force_limit"; of a struct in the struct "relaxation.share"    */
  int32_t offset, bytes; /* of the field, in the palpate_scene_def of this library         */
  palpate_key_type type;
  const char* unit;   /* "N"; "" where it has none                                         */
  const char* words;  /* of a CHOICE "off, rest, deformed"; else what 0 stands for, or ""  */
  double least, most; /* both allowed; the least number above 0 where it must be above 0   */
} palpate_key;
/* The keys in order, key 0 first; NULL behind the last one. Constant. Defaults: those of palpate_init_scene_def. */
PALPATE_API const palpate_key* palpate_scene_key(int32_t key);
/* The number in a field, of a CHOICE its index, the first one of an array; of a POINTER 1 where it is not NULL; 0 where the host's struct,
 * which may be an earlier one, ends before the field. */
PALPATE_API double palpate_key_number(const palpate_key* key, const palpate_scene_def* def);
/* Sets it; palpate_scene_create compares it with the limits. Returns 1; 0 for a POINTER, and where the struct ends before the field. */
PALPATE_API int32_t palpate_set_key(const palpate_key* key, palpate_scene_def* def, double number);

/* Makes a scene: reads or maps the sections that its effects need and no others, and takes all its memory. The bundle must outlive the
 * scene. error may be NULL. Returns PALPATE_OK, or the reason, in which case *scene is NULL. */
PALPATE_API palpate_status palpate_scene_create(palpate_bundle* bundle, const palpate_scene_def* def,
                                                palpate_scene** scene, palpate_error* error);
PALPATE_API void palpate_scene_destroy(palpate_scene* scene);

/* One pass of the plan: a piece of work that a step does, or that creating the scene did. */
typedef struct palpate_plan_pass {
  const char* name;        /* "collision: deformed", "superposition: surface", ...          */
  const char* half;        /* who runs it: "create", "touch", "deform" or "shape"           */
  const char* sections;    /* the bundle sections it reads: "tensors/force mesh/nodes"      */
  uint64_t mapped_bytes;   /* of those sections                                             */
  uint64_t memory_bytes;   /* that the scene has taken for this pass                        */
  int64_t most_operations; /* that a step may count in this pass, whatever the tools do; 0: nothing is counted */
} palpate_plan_pass;
/* The passes in order, pass 0 first; NULL behind the last one. Valid until the scene is destroyed. */
PALPATE_API const palpate_plan_pass* palpate_scene_plan(const palpate_scene* scene, int32_t pass);

/* That a whole touch step may count, whatever the tools do: operations of palpate_contacts never exceeds it. max_operations, and what
 * comes on top of it: links, grasps that close, needles, normals of a fine surface, the body under LARGE. No report is counted. */
PALPATE_API int64_t palpate_scene_most_operations(const palpate_scene* scene);

/* How many counted operations this machine does in that time, for max_operations. Measures for some milliseconds (up to a
 * second where the clock is coarse), so two calls differ; store the number if runs are to be the same to the bit. 0 where
 * the time is not above 0, or there is no memory or no clock (the browser's module). */
PALPATE_API int64_t palpate_operations_in(double microseconds);

/* The quantities of a step that its cost depends on. */
typedef struct palpate_step_load {
  uint32_t struct_bytes;        /* sizeof(palpate_step_load)                                                */
  int32_t tools, points, grips; /* sent to the step; points and grips of all tools together                 */
  int32_t contacts;             /* made by the step                                                         */
  int32_t rows;                 /* imposed directions: 3 of each contact, 1 where it slides, a grip's axes   */
  int32_t nodes;                /* under contact: node_count of palpate_contacts                            */
  int32_t slips;                /* contacts that slip                                                       */
  int32_t sweeps, newton_steps; /* of palpate_contacts                                                      */
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

/* ---- pose: where the organ is in the world ------------------------------------------------------------------------ */

/* The organ's frame in the world. A point p of the organ is at position + R p, R the turn of the orientation. */
typedef struct palpate_pose {
  uint32_t struct_bytes;      /* sizeof(palpate_pose)                                                               */
  uint32_t reserved;          /* 0                                                                                  */
  double position[3];         /* default 0 m, within 1e6 m: where the origin of the organ's frame is                */
  double orientation[4];      /* default 1 0 0 0: quaternion w x y z of length 1                                    */
  double velocity[3];         /* default 0 m/s, of that origin                                                      */
  double angular_velocity[3]; /* default 0 rad/s, about the world's axes                                            */
} palpate_pose;
PALPATE_API void palpate_init_pose(palpate_pose* pose, size_t struct_bytes);
static inline palpate_pose palpate_default_pose(void) {
  palpate_pose pose;
  palpate_init_pose(&pose, sizeof pose);
  return pose;
}

/* Says where the organ is at the next touch step. Each later touch step without a new pose moves it on by its velocities times
 * the step's dt, so a host that animates the organ at 60 Hz sends the velocities too, and an organ with velocities 0 stays.
 * - Contacts depend on the motion of a tool relative to the organ alone: an organ that moves against a tool at rest is met,
 *   drags and slips like a tool that moves against an organ at rest. Between two steps the tool points move along straight
 *   lines in the organ's frame. Where the organ turns by an angle a in one step, a point at the distance r from the axis leaves
 *   its true path by r a^2 / 8.
 * - Relative motion faster than max_tool_speed is lost tracking (TRACKING_LOST), so a pose that jumps ends the contacts.
 * - palpate_scene_reset does not change the pose.
 * The organ stays in place once its velocity would take its origin beyond 1e6 m. Forces do not depend on the pose otherwise:
 * gravity does not turn against an organ with a preload.
 * An orientation whose length differs from 1 by 0.001 or less is brought to length 1; another one is refused, and so is a number
 * that is not finite: PALPATE_ERROR_ARGUMENT, and the scene keeps its pose. error may be NULL.
 * Never allocates or locks. Call it in the thread of palpate_scene_touch. */
PALPATE_API palpate_status palpate_scene_set_pose(palpate_scene* scene, const palpate_pose* pose, palpate_error* error);

/* Between the frames. position and orientation: of a palpate_pose, or organ_position and organ_orientation of a
 * palpate_contacts. The orientation counts with length 1, and as no turn where it is zero or not finite. *world and *organ may
 * be the same array. A direction, velocity or force turns with the organ; a point also moves with its position. */
PALPATE_API void palpate_point_to_world(const double position[3], const double orientation[4], const double organ[3],
                                        double world[3]);
PALPATE_API void palpate_point_to_organ(const double position[3], const double orientation[4], const double world[3],
                                        double organ[3]);
PALPATE_API void palpate_vector_to_world(const double orientation[4], const double organ[3], double world[3]);
PALPATE_API void palpate_vector_to_organ(const double orientation[4], const double world[3], double organ[3]);
/* The same as a matrix for a renderer, column after column: matrix[12 .. 14] is the position. */
PALPATE_API void palpate_pose_matrix(const double position[3], const double orientation[4], double matrix[16]);

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

/* Jaws that hold tissue: the surface below one disc, or below two discs that face each other across a fold, follows the rigid motion of the
 * tool since the jaws closed, in all six degrees of freedom. The tool gets the force and, with has_torque, the torque.
 * - The grasp closes in the first step that has it, and anew where the id changes: with no force of its own, wherever the tissue then is.
 *   Jaws that close anew while they hold tissue let it go in that step, without a force, and take hold of it in the next one.
 *   It opens in the first step of the tool without it.
 * - Beyond its friction it slips: the tissue stays behind so far that the force is friction times what presses the jaws on the tissue
 *   (the force along the jaws, between two discs from both sides). Once it has slipped by more than `radius` it lets go, until it closes anew.
 * - Its nodes count towards max_contact_nodes, each three times: at most 192 for each disc, and no more than 96 where
 *   max_contact_nodes leaves no room for more beside 8 for each of max_points and 192 for each of max_tools.
 * - A grasp needs grasps 1, contact PATCH and deformation LINEAR (else: bad input). */
typedef struct palpate_grasp {
  uint32_t struct_bytes;          /* sizeof(palpate_grasp)                                                          */
  int32_t id;                     /* default 0: of this closing                                                     */
  int32_t triangle;               /* 0 .. F-1: where the first disc's middle is                                     */
  int32_t opposite_triangle;      /* default -1: one disc; 0 .. F-1: where the second one's middle is               */
  double barycentric[3];          /* weights of the triangle's vertices, 0 .. 1, that sum to 1                      */
  double opposite_barycentric[3]; /* the same of the opposite triangle                                              */
  double position[3];             /* m, of the tool in the world, within 1e6 m                                      */
  double orientation[4];          /* default 1 0 0 0: of the tool, a quaternion w x y z of length 1                 */
  double radius;                  /* m, above 0 .. 1: of each disc                                                  */
  double closing;     /* default 0 m: by how much the discs have come nearer since the jaws closed; 0 .. 1 */
  double friction;    /* default INFINITY: it never slips; 0 or more                                    */
  double clamp_force; /* default INFINITY; N, 0 or more: what presses the jaws on the tissue of one disc. Two discs have
                         the force between them in its place                                                        */
} palpate_grasp;
PALPATE_API void palpate_init_grasp(palpate_grasp* grasp, size_t struct_bytes);
static inline palpate_grasp palpate_default_grasp(void) {
  palpate_grasp grasp;
  palpate_init_grasp(&grasp, sizeof grasp);
  return grasp;
}

/* A straight, stiff needle that pierces the organ. The host moves it; the tissue around the shaft follows it.
 * - It enters at a place of the surface, in the first step of the tool with this id. While its tip is in front of that place as the step
 *   deforms it, nothing happens. Then it presses the place along its direction, until the force reaches `puncture_force`.
 * - Inside, its tip pushes the tissue ahead until the force reaches `cutting_force`, and then cuts its way. What is cut stays cut for the
 *   friction of the shaft alone: a tip that was drawn back cuts again.
 * - Each `spacing` of its way it takes hold of one more place of the tissue: that place stays on the axis of the needle, and moves along
 *   it only where the force along it reaches `friction` times `spacing`. Drawn back, it lets go of the places that it has passed.
 * - The places lie in the bundle's corridor. Where the tip would leave it, or holds needle_places already, the tip stays in the tissue and
 *   its force at cutting_force, and the step is flagged NOT_TOUCHABLE or CONTACTS_DROPPED.
 * - It is out once its tip is drawn back to the place where it entered. It enters anew with another id.
 * - The forces of all places are one system with all contacts of the organ. Each place gives way by what a thin shaft of its length does in
 *   tissue that the mesh does not resolve (docs/method.md, section 21).
 * The tool gets the force and, with has_torque, the torque. */
typedef struct palpate_needle {
  uint32_t struct_bytes; /* sizeof(palpate_needle)                                                                   */
  int32_t id;            /* default 0: of this piercing                                                              */
  int32_t triangle;      /* 0 .. F-1: where it enters                                                                */
  int32_t reserved;      /* 0                                                                                        */
  double barycentric[3]; /* weights of the triangle's vertices, 0 .. 1, that sum to 1                                */
  double tip[3];         /* m, in the world, within 1e6 m                                                            */
  double direction[3];   /* in the world, of length 1: from the handle to the tip                                    */
  double radius;         /* m, above 0 .. 0.01: of the shaft                                                         */
  double friction;       /* default 0 N/m, 0 .. 1e6: along the shaft, for its length in the tissue                   */
  double cutting_force;  /* default 0 N, 0 .. 1e6                                                                    */
  double puncture_force; /* default 0 N, 0 .. 1e6                                                                    */
  double spacing;        /* default 5e-3 m, 1e-4 .. 1: of the places that it holds                                   */
} palpate_needle;
PALPATE_API void palpate_init_needle(palpate_needle* needle, size_t struct_bytes);
static inline palpate_needle palpate_default_needle(void) {
  palpate_needle needle;
  palpate_init_needle(&needle, sizeof needle);
  return needle;
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
  double reference[3]; /* default 0 m, in the world: the point of the tool about which its torque is taken        */
  const palpate_grasp* grasp; /* default NULL: none                                                             */
  int32_t organ; /* default 0: in a world (palpate_world.h), the organ that grips and grasp hold; a scene has one organ
                       and does not read it                                                                          */
  int32_t reserved; /* 0                                                                                             */
  const palpate_needle* needle; /* default NULL: none                                                           */
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
  PALPATE_SOURCE_ORGAN = 3,     /* another organ, which touches this one               */
  PALPATE_SOURCE_WORLD_LINK = 4 /* to another organ or a place of the world            */
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
  uint32_t field_offset;        /* LARGE: of the displacements, LARGE_BESIDE: of those that add to the superposition of
                                   the contact nodes; from the begin of the head; else 0                          */
  int32_t field_nodes;          /* nodes that have such a displacement: those of the scene's shape; else 0        */
  int32_t deformation_steps;    /* LARGE: quasi-Newton steps that this step took; else 0. LARGE_BESIDE: this and the
                                   next two are those of the newest solution                                      */
  int32_t field_adds;          /* 1: the displacements behind field_offset add to the superposition of the contact nodes
                                   (LARGE_BESIDE and LARGE_RENEWED); 0: they are all of it (LARGE), or there are none.
                                   A scene whose deformation is of the other kind refuses them as bad input       */
  double deformation_residual; /* LARGE: square root of the share of its energy that the body had still to lose before
                                   the last of them, as the method estimates it. 0.5 stands for 0.5 and more; above it
                                   the step was undone, and the body and its forces are those of the step before   */
  double least_volume;         /* LARGE: smallest volume of a tetrahedron, over its volume at rest; else 1       */
  uint32_t motions_offset;     /* of the amounts of the motions in this step, from the begin of the head; 0: none */
  int32_t motion_count;        /* amounts: all motions of the bundle where the scene has motions, else 0         */
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

/* [field_nodes][3] m, the displacements of the step under LARGE, inside *contacts; NULL where there are none. */
static inline const float* palpate_contacts_field(const palpate_contacts* contacts) {
  return contacts->field_offset ? (const float*)(const void*)((const char*)contacts + contacts->field_offset) : NULL;
}

/* [motion_count] amounts of the motions in the step, inside *contacts; NULL where there are none. */
static inline const double* palpate_contacts_motions(const palpate_contacts* contacts) {
  return contacts->motions_offset ? (const double*)(const void*)((const char*)contacts + contacts->motions_offset)
                                  : NULL;
}

/* Bits of a step's return value; 0 is a fully trusted step. */
/* clang-format off */
enum {
  PALPATE_STEP_BAD_INPUT        = 1 << 0, /* NaN, infinity, a negative count, an unknown node: the tool kept its last good input */
  PALPATE_STEP_CONTACTS_DROPPED = 1 << 1, /* more points than max_points, or more contacts than max_contact_nodes has nodes for
                                             (3 each under TRIANGLE); the step kept the first ones                              */
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
                                             of the step's largest u* plus 1e-9 m (LARGE: 5 %), or jaws pull beyond their friction. Pushes
                                             never pull, other friction holds; but for LARGE, the bound is that of REGULARISED  */
  PALPATE_STEP_DISCS_THINNED    = 1 << 12, /* max_contact_nodes is short: a disc acts on so few of its nodes that these carry less
                                             than 95 % of it, or a POINT on fewer than its three. Its force is then too small, by
                                             up to a half on a single node. A disc with 95 % has its force within about 5 %      */
  PALPATE_STEP_DEFORMATION_BEHIND = 1 << 13, /* LARGE: the body has not followed its tools to the end: the steps of max_operations
                                             ended far from the solution (deformation_residual above 0.035); the move to the targets
                                             was cut, where it would have turned a tetrahedron inside out or taken far more energy
                                             than the linear response expects; or the step was undone (above 0.5). The next steps go
                                             on from there. LARGE_BESIDE: the newest solution was cut, ended above 0.02, or has
                                             normals that are off by 0.05 rad; or the contacts have gone so far from it that their
                                             displacements or forces are estimated to miss theirs by 5 % */
  PALPATE_STEP_LINK_BROKE       = 1 << 14, /* a link came beyond its breaking_force: it acted in this step for the last time     */
  PALPATE_STEP_MOTION_LIMITED   = 1 << 15 /* the amounts of the motions would have moved a node faster than max_tool_speed: they came
                                             so far only, and the next steps go on                                               */
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

/* LARGE_BESIDE, LARGE_RENEWED: solves the body under the contacts of the newest touch step, eight quasi-Newton steps at most, and hands the solution
 * to the touch steps that follow. Call it in a loop in a third thread, beside those of touch and shape; neither waits for the
 * other. A host without a third thread may call it between touch steps. Returns the evaluations of the energy that it took: 0 where
 * there was nothing to do, so that the thread may sleep for a millisecond; -1 for a scene of another deformation.
 * Never allocates or locks. Cost: docs/method.md, section 14. While it runs, palpate_scene_save and palpate_scene_restore must not be
 * called for the scene, nor palpate_scene_destroy. */
PALPATE_API int32_t palpate_scene_deform(palpate_scene* scene);

/* ---- motions: breathing, pressure, gravity ------------------------------------------------------------------------ */

/* Says by how much each motion of the bundle moves the organ, from the next touch step on: amounts [count], count the bundle's
 * motion_count, in the units of palpate_motion_kind. At first all are 0. The organ is at the same amounts until the next call, so a
 * host that breathes calls this in every touch step.
 * - The first step, and the first one after palpate_scene_reset, takes the amounts at once. In later steps no node moves faster than
 *   max_tool_speed by a change of amounts: what is more waits for the next steps (MOTION_LIMITED).
 * - Contacts hold places that move: a tool at rest is met and pressed by an organ that moves against it. Contacts and grasps
 *   hold d - B q in place of d, B q the displacement by the motions (docs/method.md, section 19).
 * - The amounts of a step travel in its palpate_contacts, so that shape and queries show the organ at the same ones.
 * Refused with PALPATE_ERROR_ARGUMENT, and the scene keeps its amounts: another count, a number that is not finite, amounts that may
 * move a node by more than 1e6 m. error may be NULL. Never allocates or locks. Call it in the thread of palpate_scene_touch. */
PALPATE_API palpate_status palpate_scene_set_motions(palpate_scene* scene, const double* amounts, int32_t count,
                                                     palpate_error* error);

/* For a motion of kind PRESSURE: holds 1: its surface sweeps `volume` (m^3, away from where the pressure acts; of a cavity, by how much
 * it grows), and the pressure is what that takes, whatever palpate_scene_set_motions says; so a host pumps, or closes a valve at the volume that
 * palpate_scene_motion_state tells. holds 0: the pressure is given again, at first the last one. Contacts that change the pressure make
 * the step solve up to four times. error may be NULL. Never allocates or locks. Call it in the thread of palpate_scene_touch. */
PALPATE_API palpate_status palpate_scene_hold_volume(palpate_scene* scene, int32_t motion, int32_t holds, double volume,
                                                     palpate_error* error);

/* One motion after a touch step; the library fills it. */
typedef struct palpate_motion_state {
  double amount; /* in this step: as set, or as far as MOTION_LIMITED let it come; of a held volume the pressure, Pa */
  double volume; /* m^3: of a pressure, what its surface has swept, under contacts too; else 0                       */
} palpate_motion_state;
/* Of motion 0 .. motion_count - 1, inside the scene and valid until the next step; NULL behind the last one, and for a scene without
 * motions. Call it in the thread of palpate_scene_touch. */
PALPATE_API const palpate_motion_state* palpate_scene_motion_state(const palpate_scene* scene, int32_t motion);

/* ---- links: sutures, clips, ligaments, springs --------------------------------------------------------------------- */

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

/* ---- grasps ---------------------------------------------------------------------------------------------------------- */

typedef enum palpate_grasp_condition {
  PALPATE_GRASP_OPEN = 0,  /* the tool has no grasp                                                                 */
  PALPATE_GRASP_HOLDS = 1, /* the tissue follows the jaws                                                           */
  PALPATE_GRASP_SLIPS = 2, /* it slipped in this step                                                               */
  PALPATE_GRASP_LET_GO = 3 /* it has slipped by more than its radius: no force until it closes anew                 */
} palpate_grasp_condition;

/* The grasp of one tool after a touch step; the library fills it. In the world. */
typedef struct palpate_grasp_state {
  palpate_grasp_condition condition; /* in this step                                                                */
  int32_t reserved;                  /* 0                                                                           */
  double force[3];                   /* N, on the tool, of the grasp alone, before Q, relaxation and limits         */
  double torque[3];                  /* N m, the same about the tool's reference                                    */
  double place[3];                   /* m: where the first disc's middle is held                                    */
  double slipped;                    /* m: by how much the tissue has stayed behind                                 */
  double friction_limit;             /* N: beyond which it slips; INFINITY: never                                   */
} palpate_grasp_state;

/* Of the tool with that id, inside the scene and valid until the next step; NULL where no tool has the id, or no tool may grasp. Call it
 * in the thread of palpate_scene_touch. */
PALPATE_API const palpate_grasp_state* palpate_scene_grasp_state(const palpate_scene* scene, int32_t id);

/* ---- needles --------------------------------------------------------------------------------------------------------- */

typedef enum palpate_needle_condition {
  PALPATE_NEEDLE_NONE = 0,    /* the tool has no needle                                                             */
  PALPATE_NEEDLE_OUTSIDE = 1, /* it does not touch the tissue: before it enters, or after it came out               */
  PALPATE_NEEDLE_PRESSES = 2, /* its tip presses the surface and has not pierced it                                 */
  PALPATE_NEEDLE_INSIDE = 3,  /* it is in the tissue, and its tip does not cut                                      */
  PALPATE_NEEDLE_CUTS = 4,    /* its tip cut in this step                                                           */
  PALPATE_NEEDLE_STUCK = 5    /* its tip would cut where it may not: outside of the corridor, or without a place left */
} palpate_needle_condition;

/* The needle of one tool after a touch step; the library fills it. In the world, forces on the tool, before Q, relaxation and limits. */
typedef struct palpate_needle_state {
  palpate_needle_condition condition; /* in this step                                                               */
  int32_t places;                     /* of the tissue that it holds, without the tip                               */
  int32_t slipping;                   /* of these, places along which it slid in this step                          */
  int32_t reserved;                   /* 0                                                                          */
  double force[3];                    /* N, of the needle alone                                                     */
  double torque[3];                   /* N m, the same about the tool's reference                                   */
  double tip_force;                   /* N, 0 or more: what the tissue ahead of the tip resists                     */
  double shaft_force;    /* N, along the shaft: above 0 where friction holds the needle back from advancing */
  double depth;          /* m: the way of the tip in the tissue at rest, from where it entered         */
  double tip_at_rest[3]; /* m, in the organ's frame: the tissue at the tip, where it is at rest        */
} palpate_needle_state;

/* Of the tool with that id, inside the scene and valid until the next step; NULL where no tool has the id, or no tool may have a needle.
 * Call it in the thread of palpate_scene_touch. */
PALPATE_API const palpate_needle_state* palpate_scene_needle_state(const palpate_scene* scene, int32_t id);

/* ---- report: contacts and events ----------------------------------------------------------------------------------- */

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

/* ---- reset ---------------------------------------------------------------------------------------------------------- */

/* Forgets contacts, last positions and forces: the state after creation, but the pose stays, the amounts of motions, and the links,
 * whole again. Call it
 * in the thread of palpate_scene_touch. */
PALPATE_API void palpate_scene_reset(palpate_scene* scene);
/* The same for the tool of that id alone: its next step is like its first. The surface stays as the last step deformed it
 * until the next step. An id that is not in use changes nothing. Call it in the thread of palpate_scene_touch. */
PALPATE_API void palpate_scene_reset_tool(palpate_scene* scene, int32_t id);

/* ---- state: to save, restore and copy what the steps have left --------------------------------------------------- */

/* What the touch steps have left in a scene: contacts, forces, last positions, relaxation, the pose with its velocities, and the
 * report. After a restore the next steps give the same bits as the next steps of the scene that was saved, if they get the same
 * input. The shape half and the queries have no state of their own.
 * A state is plain bytes, for the same version of the library, the same byte order, a scene with the same definition (render mesh,
 * dent, inside and allocator aside), and a bundle with the same identity; it may be restored into another scene or another process.
 * None of these functions allocates or locks; call them in the thread of palpate_scene_touch. */

/* The bytes that a saved state of the scene takes now. They grow with the contacts: ask after the last step. */
PALPATE_API size_t palpate_scene_state_bytes(const palpate_scene* scene);
/* Writes palpate_scene_state_bytes(scene) bytes to `state`, which is 8-byte aligned and has state_bytes bytes, so many or more.
 * The scene does not change. error may be NULL. Cost: a copy of these bytes and their checksum. */
PALPATE_API palpate_status palpate_scene_save(const palpate_scene* scene, void* state, size_t state_bytes,
                                              palpate_error* error);
/* Restores a state of state_bytes bytes, 8-byte aligned. A state that is damaged, or of another version, definition or bundle, is
 * refused, and the scene stays as it was. A checksum finds damage, not intent: restore no state that you would not run. Cost: as
 * saving, and the compliances between the nodes under contact are read anew. */
PALPATE_API palpate_status palpate_scene_restore(palpate_scene* scene, const void* state, size_t state_bytes,
                                                 palpate_error* error);

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

/* Fills the normals of the surface's vertices, for a host that draws the bundle's own triangles: of each vertex the mean of the
 * normals of the triangles around it, weighted by their angles there; unit length, or zero where they cancel or have no area.
 * shape: as palpate_scene_shape filled it; this call reads its positions and node_count, at least Ns. normals: [node_capacity][3],
 * of which the first Ns are filled; node_capacity: Ns or more. This needs a scene with collision, with contact TRIANGLE, POINT or
 * PATCH, with a contact law other than STICKING, or with queries (else: bad input). A triangle with a position that is not finite
 * does not count (BAD_INPUT). Any thread may call it. Cost: one pass over the triangles. */
PALPATE_API palpate_step_flags palpate_scene_normals(palpate_scene* scene, const palpate_shape_out* shape,
                                                     float* normals, int32_t node_capacity);

/* ---- inside: strain and stress, and meshes that are carried along ------------------------------------------------- */

/* What a scene with inside ON says about the tissue below the surface: the section of a viewer, the strain in a tumour, where a
 * vessel has gone. All of it follows from a shape, so that motions, preload and large deformation are in it as they are in the shape.
 *
 * Strain   of small displacements, the symmetric part of the displacement gradient; under deformation LARGE and its kin, Green and
 *          Lagrange's strain (H + H^T + H^T H) / 2. It is counted from the organ as it was meshed: with preload ON, that of the
 *          preload is part of it.
 * Stress   Cauchy's, Pa, by the bundle's moduli, and under LARGE by its laws: the instantaneous one, without relaxation. With radial
 *          RESPONSE it is that of the corrected displacements, which do not balance the forces.
 * Tensors  xx yy zz xy yz xz along the axes of the organ's frame; xy is half of the shear angle.
 * Accuracy A node's value is the mean over the tetrahedra around it, and a place's lies between those of its nodes: right to the size of the
 *          mesh, less so at the surface and where a tool presses (docs/method.md, section 20). Half precision in the bundle makes noise in the
 *          pressure of nearly incompressible tissue.
 * Threads  palpate_scene_inside, _inside_at and _carry belong to the thread of palpate_scene_shape; any thread may call
 *          palpate_scene_locate. None of them allocates. */

/* A place of the tissue: a point of a tetrahedron. The library fills it, once; it stays valid for all scenes on the bundle. */
typedef struct palpate_inside_place {
  int32_t tetrahedron; /* 0 .. E-1; -1: none is as near as was asked                                              */
  int32_t reserved;    /* 0                                                                                       */
  double weight[4];    /* of its four nodes, that sum to 1; for a point outside of the mesh some are below 0      */
  double distance;     /* m, of the point from the tetrahedron; 0 inside                                          */
} palpate_inside_place;

/* Finds the place of each point: the tetrahedron that it lies in, or the nearest one where that is within `farthest` metres. points:
 * [count][3] m, in the organ's frame, on the shape as it was meshed; places: [count], all filled. Returns how many have no
 * tetrahedron, and -1 for a scene without inside, a NULL array, or a count or farthest below 0. A point that is not finite has none. Cost: about 4 us a point;
 * not for a loop with deadlines. */
PALPATE_API int32_t palpate_scene_locate(const palpate_scene* scene, const double* points, int32_t count,
                                         double farthest, palpate_inside_place* places);

/* The caller's arrays; each may be NULL. A row is a node or a place. */
typedef struct palpate_inside_out {
  uint32_t struct_bytes; /* sizeof(palpate_inside_out)                                                        */
  int32_t capacity;      /* in: rows of each array                                                            */
  int32_t count;         /* out: rows filled                                                                  */
  int32_t reserved;      /* 0                                                                                 */
  float* displacements;  /* default NULL; [capacity][3] m, from rest                                          */
  float* strains;        /* default NULL; [capacity][6] without unit                                          */
  float* stresses;       /* default NULL; [capacity][6] Pa                                                    */
  float* pressures;      /* default NULL; [capacity] Pa, above 0 under compression                            */
  float* von_mises;      /* default NULL; [capacity] Pa: the stress along one axis that distorts as much      */
  float* principal;      /* default NULL; [capacity][3] Pa, the principal stresses, largest first             */
} palpate_inside_out;
PALPATE_API void palpate_init_inside_out(palpate_inside_out* out, size_t struct_bytes);
static inline palpate_inside_out palpate_default_inside_out(void) {
  palpate_inside_out out;
  palpate_init_inside_out(&out, sizeof out);
  return out;
}

/* Strain and stress of a shape, kept in the scene until the next call, and filled for the nodes 0 .. N-1. shape: as
 * palpate_scene_shape filled it; this call reads its displacements and node_count, N. out may be NULL. A displacement that is not
 * finite counts as zero (BAD_INPUT). Under LARGE, a tetrahedron that the shape turns inside out has a stress without meaning
 * (UNSOLVED). A number beyond single precision becomes zero (UNSOLVED). A node where regions meet has the mean of theirs. Cost: two passes over the tetrahedra. */
PALPATE_API palpate_step_flags palpate_scene_inside(palpate_scene* scene, const palpate_shape_out* shape,
                                                    palpate_inside_out* out);
/* The same at places, of the shape of the last palpate_scene_inside (without one: BAD_INPUT). Beyond the mesh, strain and stress are those of
 * the tetrahedron, and the displacement goes on in a straight line. A place that palpate_scene_locate has not filled, or without tetrahedron, gets
 * zeros (BAD_INPUT). */
PALPATE_API palpate_step_flags palpate_scene_inside_at(palpate_scene* scene, const palpate_inside_place* places,
                                                       int32_t count, palpate_inside_out* out);

/* Carries points of the tissue along, such as the vertices of a tumour or a vessel: positions [count][3] m of places in a shape. It needs no
 * palpate_scene_inside. shape: as palpate_scene_shape filled it; this call reads its positions and node_count, N. Places as for
 * palpate_scene_inside_at: the point of one outside of the mesh moves with the nearest tetrahedron. Cost: four rows read for each place. */
PALPATE_API palpate_step_flags palpate_scene_carry(palpate_scene* scene, const palpate_shape_out* shape,
                                                   const palpate_inside_place* places, int32_t count, float* positions);

/* ---- queries ------------------------------------------------------------------------------------------------------ */

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

#endif /* PALPATE_H */
