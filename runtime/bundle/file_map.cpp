#include "runtime/bundle/file_map.h"

#if (defined(__unix__) && !defined(__EMSCRIPTEN__)) || defined(__APPLE__)

#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

namespace palpate {
namespace {

// One mapped range, as the signal handler sees it: written before the map is used, cleared after its last use. Atomics and no
// lock, because a handler may interrupt any code.
struct Watch {
  std::atomic<std::uintptr_t> begin{0}, end{0};
  std::atomic<std::atomic<bool>*> lost{nullptr};
};
constexpr int kMaxWatches = 4096;
Watch watches[kMaxWatches];
std::atomic<std::uintptr_t> page_bytes{4096};
// The handler that ours replaced last, and the one that it replaced first.
struct sigaction previous_action, first_action;
bool has_first_action = false;
int guarded_ranges = 0;  // mapped now
std::atomic_flag changing = ATOMIC_FLAG_INIT;

struct ChangeLock {  // taken while opening and closing, never in a step
  ChangeLock() {
    while (changing.test_and_set(std::memory_order_acquire)) usleep(50);
  }
  ~ChangeLock() { changing.clear(std::memory_order_release); }
};

bool replace_lost_page(std::uintptr_t address) {
  for (Watch& watch : watches) {
    const std::uintptr_t begin = watch.begin.load(), end = watch.end.load();
    if (begin == 0 || address < begin || address >= end) continue;
    const std::uintptr_t page = address / page_bytes.load() * page_bytes.load();
    void* at = reinterpret_cast<void*>(page);
    if (mmap(at, page_bytes.load(), PROT_READ, MAP_PRIVATE | MAP_FIXED | MAP_ANONYMOUS, -1, 0) != at) return false;
    if (std::atomic<bool>* lost = watch.lost.load()) lost->store(true);
    return true;
  }
  return false;
}

// The fault that is being forwarded: the context that the system passed for it, and the handler's stack frame. Another thread's
// fault may overwrite them; a fault that comes back is then forwarded once more, which is harmless.
std::atomic<const void*> forwarded_context{nullptr}, forwarded_frame{nullptr};

void forward(const struct sigaction& to, int signal, siginfo_t* info, void* context) {
  if (to.sa_flags & SA_SIGINFO) {
    to.sa_sigaction(signal, info, context);
  } else if (to.sa_handler != SIG_DFL && to.sa_handler != SIG_IGN) {
    to.sa_handler(signal);
  } else {
    // No other handler: restores the default action. Returning repeats the fault, which then ends the process.
    struct sigaction fallback = {};
    fallback.sa_handler = SIG_DFL;
    sigaction(signal, &fallback, nullptr);
  }
}

void on_bus_error(int signal, siginfo_t* info, void* context) {
  const int saved = errno;
  const bool ours = replace_lost_page(reinterpret_cast<std::uintptr_t>(info->si_addr));
  errno = saved;
  if (ours) return;
  // A host's handler may be installed after ours, then be replaced by ours again, and forward faults that it does not know to
  // ours. The same fault then comes back, from a frame further down the stack. Forwarding it to the host again would never end,
  // so it goes to the handler that was there first.
  const void* const frame = __builtin_frame_address(0);
  const bool comes_back = forwarded_context.load() == context && frame < forwarded_frame.load();
  if (comes_back) return forward(first_action, signal, info, context);
  forwarded_context.store(context), forwarded_frame.store(frame);
  forward(previous_action, signal, info, context);
  forwarded_context.store(nullptr);  // after the call, so that the compiler cannot drop this frame before it
}

bool is_ours(const struct sigaction& action) {
  return (action.sa_flags & SA_SIGINFO) && action.sa_sigaction == on_bus_error;
}

// Installs our handler once, and again if the host has installed its own since.
void install_handler() {
  struct sigaction current = {};
  sigaction(SIGBUS, nullptr, &current);
  if (is_ours(current)) return;
  previous_action = current;
  if (!has_first_action) first_action = current;
  has_first_action = true;
  struct sigaction ours = {};
  ours.sa_sigaction = on_bus_error;
  ours.sa_flags = SA_SIGINFO | SA_ONSTACK;
  sigemptyset(&ours.sa_mask);
  sigaction(SIGBUS, &ours, nullptr);
}

// Puts back the handler that ours replaced, unless the host has put another one in front meanwhile. first_action is forgotten
// only with it: else the host's handler may still pass faults on to ours.
void restore_handler() {
  struct sigaction current = {};
  sigaction(SIGBUS, nullptr, &current);
  if (!is_ours(current)) return;
  sigaction(SIGBUS, &previous_action, nullptr);
  has_first_action = previous_action.sa_sigaction != first_action.sa_sigaction;
}

// A library that is unloaded with bundles still open must not leave its handler behind.
__attribute__((destructor)) void restore_handler_at_unloading() {
  restore_handler();
}

Watch* free_watch() {
  for (Watch& watch : watches)
    if (watch.begin.load() == 0) return &watch;
  return nullptr;
}

}  // namespace

bool file_maps_are_supported() {
  return true;
}

int open_for_map(const char* path, std::uint64_t* file_bytes, const char** reason) {
  // O_NONBLOCK: opening a pipe must fail instead of waiting for a writer.
  const int descriptor = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) {
    *reason = errno == ENOENT   ? "it does not exist"
              : errno == EACCES ? "reading it is not permitted"
                                : "the system refused to open it";
    return -1;
  }
  struct stat status = {};
  if (fstat(descriptor, &status) != 0 || !S_ISREG(status.st_mode)) {
    *reason = "it is not a regular file";
    close(descriptor);
    return -1;
  }
  *file_bytes = static_cast<std::uint64_t>(status.st_size);
  return descriptor;
}

void close_file(int descriptor) {
  close(descriptor);
}

bool read_range(int descriptor, std::uint64_t offset, void* out, std::size_t count) {
  std::size_t done = 0;
  while (done < count) {
    const ssize_t got =
        pread(descriptor, static_cast<char*>(out) + done, count - done, static_cast<off_t>(offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    done += static_cast<std::size_t>(got);
  }
  return true;
}

bool map_range(int descriptor, std::uint64_t offset, std::uint64_t count, std::atomic<bool>* lost, FileMap* map) {
  const ChangeLock lock;
  Watch* watch = lost ? free_watch() : nullptr;
  if ((lost && !watch) || count == 0 || count > static_cast<std::size_t>(-1) / 2) return false;
  page_bytes.store(static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE)));
  const std::uint64_t first = offset / page_bytes.load() * page_bytes.load();
  map->bytes = static_cast<std::size_t>(offset - first + count);
  map->base = mmap(nullptr, map->bytes, PROT_READ, MAP_SHARED, descriptor, static_cast<off_t>(first));
  if (map->base == MAP_FAILED) {
    *map = FileMap{};
    return false;
  }
  map->data = static_cast<const unsigned char*>(map->base) + (offset - first);
  if (!lost) return true;
  watch->lost.store(lost);
  // Rounded up to whole pages: the last page may lie partly beyond the range.
  const std::uintptr_t whole = (map->bytes + page_bytes.load() - 1) / page_bytes.load() * page_bytes.load();
  watch->end.store(reinterpret_cast<std::uintptr_t>(map->base) + whole);
  watch->begin.store(reinterpret_cast<std::uintptr_t>(map->base));
  ++guarded_ranges;
  install_handler();  // before anybody reads the range
  return true;
}

void unmap(FileMap* map) {
  if (!map->base) return;
  const ChangeLock lock;
  for (Watch& watch : watches)
    if (watch.begin.load() == reinterpret_cast<std::uintptr_t>(map->base)) {
      watch.begin.store(0);
      watch.end.store(0);
      watch.lost.store(nullptr);
      if (--guarded_ranges == 0) restore_handler();
    }
  munmap(map->base, map->bytes);
  *map = FileMap{};
}

bool FileWitness::call(int descriptor, std::uint64_t file_bytes, std::uint64_t stamp_offset, std::uint64_t stamp,
                       std::atomic<bool>* lost) {
  // The last byte that is not zero, searched within the largest page size of any system.
  constexpr std::uint64_t kLargestPage = 65536;
  const std::uint64_t begin = file_bytes > kLargestPage ? file_bytes - kLargestPage : 0;
  FileMap tail;
  if (!map_range(descriptor, begin, file_bytes - begin, lost, &tail)) return false;
  std::uint64_t last = file_bytes - begin - 1;
  while (last > 0 && tail.data[last] == 0) --last;
  unmap(&tail);
  if (!map_range(descriptor, stamp_offset, sizeof stamp_was_, lost, &stamp_map_)) return false;
  if (!map_range(descriptor, begin + last, 1, lost, &last_map_)) {
    unmap(&stamp_map_);
    return false;
  }
  stamp_ = reinterpret_cast<const volatile std::uint64_t*>(stamp_map_.data);
  last_ = last_map_.data;
  stamp_was_ = stamp, last_was_ = *last_;
  return true;
}

void FileWitness::dismiss() {
  stamp_ = nullptr;
  unmap(&stamp_map_);
  unmap(&last_map_);
}

void read_pages(const FileMap& map) {
  const std::size_t page = page_bytes.load();
  for (std::size_t at = 0; at < map.bytes; at += page)
    static_cast<void>(*(static_cast<const volatile unsigned char*>(map.base) + at));
}

bool lock_pages(const FileMap& map, std::uint64_t* limit) {
  if (mlock(map.base, map.bytes) == 0) return true;
  struct rlimit allowed = {};
  getrlimit(RLIMIT_MEMLOCK, &allowed);
  *limit = allowed.rlim_cur;
  return false;
}

}  // namespace palpate

#else  // no POSIX maps: the host reads the file and uses palpate_bundle_open

namespace palpate {
bool file_maps_are_supported() {
  return false;
}
int open_for_map(const char*, std::uint64_t*, const char** reason) {
  *reason = "this platform has no file maps; read the bytes and use palpate_bundle_open";
  return -1;
}
void close_file(int) {}
bool read_range(int, std::uint64_t, void*, std::size_t) {
  return false;
}
bool map_range(int, std::uint64_t, std::uint64_t, std::atomic<bool>*, FileMap*) {
  return false;
}
void unmap(FileMap*) {}
bool FileWitness::call(int, std::uint64_t, std::uint64_t, std::uint64_t, std::atomic<bool>*) {
  return false;
}
void FileWitness::dismiss() {}
void read_pages(const FileMap&) {}
bool lock_pages(const FileMap&, std::uint64_t*) {
  return false;
}
}  // namespace palpate

#endif
