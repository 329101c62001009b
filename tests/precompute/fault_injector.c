/* LD_PRELOAD: fails or kills a process at a chosen call on files whose name holds a given text.
 *
 * PALPATE_FAULT="WHAT:N:TEXT", N counted from 1 among the calls that WHAT looks at:
 *   kill    at the N-th write, sync, resize, rename or removal: SIGKILL in its place
 *   torn    at the N-th write: half of its bytes, then SIGKILL
 *   full    from the N-th write on: ENOSPC, on a file system that cannot reserve space
 *   reserve at the N-th reservation of space: ENOSPC
 *   eio     at the N-th sync: EIO
 *   locks   every lock: ENOLCK
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <pthread.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>
#include <unistd.h>

static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
static char what[16], text[64];
static long chosen, count;

static int wanted(const char* kind) {
  static int read_once;
  if (!read_once) {
    const char* fault = getenv("PALPATE_FAULT");
    if (!fault || sscanf(fault, "%15[^:]:%ld:%63s", what, &chosen, text) != 3) what[0] = 0;
    read_once = 1;
  }
  return strcmp(what, kind) == 0;
}

static int named(const char* path) {
  return path && strstr(path, text) != NULL;
}

static int open_file(int descriptor) {
  char link[64], path[PATH_MAX];
  snprintf(link, sizeof link, "/proc/self/fd/%d", descriptor);
  const ssize_t length = readlink(link, path, sizeof path - 1);
  if (length < 0) return 0;
  path[length] = 0;
  return named(path);
}

/* Whether this is the chosen call, or a later one. */
static int reached(int later_too) {
  pthread_mutex_lock(&mutex);
  const long now = ++count;
  pthread_mutex_unlock(&mutex);
  return now == chosen || (later_too && now > chosen);
}

static void die(void) {
  kill(getpid(), SIGKILL);
  for (;;) pause();
}

#define REAL(result, name, ...)       \
  static result (*real)(__VA_ARGS__); \
  if (!real) real = (result(*)(__VA_ARGS__))dlsym(RTLD_NEXT, name)

static ssize_t faulty_pwrite(ssize_t (*real)(int, const void*, size_t, off_t), int file, const void* bytes, size_t size,
                             off_t offset) {
  if (wanted("kill") && open_file(file) && reached(0)) die();
  if (wanted("torn") && open_file(file) && reached(0)) {
    real(file, bytes, size / 2, offset);
    die();
  }
  if (wanted("full") && open_file(file) && reached(1)) {
    errno = ENOSPC;
    return -1;
  }
  return real(file, bytes, size, offset);
}

ssize_t pwrite(int file, const void* bytes, size_t size, off_t offset) {
  REAL(ssize_t, "pwrite", int, const void*, size_t, off_t);
  return faulty_pwrite(real, file, bytes, size, offset);
}
ssize_t pwrite64(int file, const void* bytes, size_t size, off_t offset) {
  REAL(ssize_t, "pwrite64", int, const void*, size_t, off_t);
  return faulty_pwrite(real, file, bytes, size, offset);
}

static int faulty_sync(int (*real)(int), int file) {
  if (wanted("kill") && open_file(file) && reached(0)) die();
  if (wanted("eio") && open_file(file) && reached(0)) {
    errno = EIO;
    return -1;
  }
  return real(file);
}
int fdatasync(int file) {
  REAL(int, "fdatasync", int);
  return faulty_sync(real, file);
}
int fsync(int file) {
  REAL(int, "fsync", int);
  return faulty_sync(real, file);
}

static int faulty_resize(int (*real)(int, off_t), int file, off_t size) {
  if (wanted("kill") && open_file(file) && reached(0)) die();
  return real(file, size);
}
int ftruncate(int file, off_t size) {
  REAL(int, "ftruncate", int, off_t);
  return faulty_resize(real, file, size);
}
int ftruncate64(int file, off_t size) {
  REAL(int, "ftruncate64", int, off_t);
  return faulty_resize(real, file, size);
}

static int faulty_reserve(int (*real)(int, int, off_t, off_t), int file, int mode, off_t offset, off_t size) {
  if (wanted("full") && open_file(file)) {
    errno = EOPNOTSUPP;
    return -1;
  }
  if (wanted("reserve") && open_file(file) && reached(0)) {
    errno = ENOSPC;
    return -1;
  }
  return real(file, mode, offset, size);
}
int fallocate(int file, int mode, off_t offset, off_t size) {
  REAL(int, "fallocate", int, int, off_t, off_t);
  return faulty_reserve(real, file, mode, offset, size);
}
int fallocate64(int file, int mode, off_t offset, off_t size) {
  REAL(int, "fallocate64", int, int, off_t, off_t);
  return faulty_reserve(real, file, mode, offset, size);
}

int rename(const char* from, const char* to) {
  REAL(int, "rename", const char*, const char*);
  if (wanted("kill") && named(from) && reached(0)) die();
  return real(from, to);
}

int remove(const char* path) {
  REAL(int, "remove", const char*);
  if (wanted("kill") && named(path) && reached(0)) die();
  return real(path);
}
int unlink(const char* path) {
  REAL(int, "unlink", const char*);
  if (wanted("kill") && named(path) && reached(0)) die();
  return real(path);
}

static int faulty_fcntl(int (*real)(int, int, ...), int file, int command, void* argument) {
  if (wanted("locks") && command == F_OFD_SETLK && open_file(file)) {
    errno = ENOLCK;
    return -1;
  }
  return real(file, command, argument);
}
int fcntl(int file, int command, ...) {
  static int (*real)(int, int, ...);
  if (!real) real = (int (*)(int, int, ...))dlsym(RTLD_NEXT, "fcntl");
  va_list list;
  va_start(list, command);
  void* argument = va_arg(list, void*);
  va_end(list);
  return faulty_fcntl(real, file, command, argument);
}
int fcntl64(int file, int command, ...) {
  static int (*real)(int, int, ...);
  if (!real) real = (int (*)(int, int, ...))dlsym(RTLD_NEXT, "fcntl64");
  va_list list;
  va_start(list, command);
  void* argument = va_arg(list, void*);
  va_end(list);
  return faulty_fcntl(real, file, command, argument);
}
