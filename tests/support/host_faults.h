// A host with its own handler of SIGBUS and a mapped file of its own that is cut.
#pragma once

#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

namespace palpate::tests {

inline std::atomic<int> host_faults{0};

inline void on_fault(int, siginfo_t* info, void*) {
  ++host_faults;  // repairs the fault, or the instruction would fault again for ever
  void* page = reinterpret_cast<void*>(reinterpret_cast<std::uintptr_t>(info->si_addr) / 4096 * 4096);
  mmap(page, 4096, PROT_READ, MAP_PRIVATE | MAP_FIXED | MAP_ANONYMOUS, -1, 0);
}

// Maps a file of the host, truncates it and reads it. True if the host's handler was called once more.
inline bool host_hears_its_fault(const std::filesystem::path& path) {
  std::ofstream(path) << std::string(8192, 'x');
  const int descriptor = open(path.c_str(), O_RDONLY);
  auto* map = static_cast<const volatile char*>(mmap(nullptr, 8192, PROT_READ, MAP_SHARED, descriptor, 0));
  const int before = host_faults;
  const bool is_cut = truncate(path.c_str(), 0) == 0;
  const char read = map[5000];
  munmap(const_cast<char*>(map), 8192);
  close(descriptor);
  std::filesystem::remove(path);
  return is_cut && read == 0 && host_faults == before + 1;
}

}  // namespace palpate::tests
