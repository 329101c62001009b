/* palpate_bundle.h - a tensor bundle: opening it, and what it holds; versions and errors.
 *
 *     palpate_bundle* bundle = NULL;
 *     palpate_error error = {0};
 *     if (palpate_bundle_open_file("organ.h5", NULL, &bundle, &error) == PALPATE_OK) {
 *       palpate_bundle_info info = palpate_bundle_describe(bundle);
 *       printf("%d nodes, of these %d of the surface\n", (int)info.node_count, (int)info.surface_node_count);
 *     }
 *     palpate_bundle_close(bundle);
 *
 * palpate.h includes this header and says what its words mean.
 */
#ifndef PALPATE_BUNDLE_H
#define PALPATE_BUNDLE_H

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

#define PALPATE_API_VERSION 3
#define PALPATE_VERSION_MAJOR 0
#define PALPATE_VERSION_MINOR 1
#define PALPATE_VERSION_PATCH 0

/* The version of the library that is linked at run time, "0.1.0"; the macros above are those of this header.
 * numbers: [4] PALPATE_API_VERSION, major, minor and patch of the library; may be NULL. */
PALPATE_API const char* palpate_version(int32_t* numbers);

typedef struct palpate_bundle palpate_bundle; /* constant: the precomputed tensors of one organ */

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
  int32_t has_interior;       /* 1: PALPATE_SHAPE_VOLUME is possible with every deformation;
                                 0: with PALPATE_DEFORMATION_LARGE alone                  */
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
/* JSON of *byte_count bytes without a zero at the end: organ, element, sources of the bundle (formats/BUNDLE.md). */
PALPATE_API const char* palpate_bundle_provenance(const palpate_bundle* bundle, size_t* byte_count);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_BUNDLE_H */
