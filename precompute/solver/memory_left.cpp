#include "precompute/solver/memory_left.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <string>

namespace palpate {
namespace {

namespace fs = std::filesystem;

constexpr double kUnlimited = std::numeric_limits<double>::infinity();

// The number that follows key in a line that begins with key, such as 123 in "VmRSS:   123 kB"; otherwise if there is none.
double number_after(const fs::path& path, const std::string& key, double otherwise) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);)
    if (line.starts_with(key)) return std::strtod(line.c_str() + key.size(), nullptr);
  return otherwise;
}

// How one version of control groups names its files.
struct GroupFiles {
  const char *limit, *used, *reclaimable;
};
constexpr GroupFiles kVersion1 = {"memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file "};
constexpr GroupFiles kVersion2 = {"memory.max", "memory.current", "inactive_file "};

// What one control group leaves, in bytes. The kernel frees cached files before it refuses memory, so the memory that they
// use counts as free.
double left_in(const fs::path& group, const GroupFiles& files) {
  std::ifstream limit_file(group / files.limit), used_file(group / files.used);
  double limit = 0, used = 0;
  if (!(limit_file >> limit) || !(used_file >> used)) return kUnlimited;  // "max", or no such file
  used -= std::min(used, number_after(group / "memory.stat", files.reclaimable, 0));
  return std::max(0.0, limit - used);
}

// The least that the group, and each group that contains it, leaves: each of them may have a limit.
double left_in_all(const fs::path& mount, const std::string& group, const GroupFiles& files) {
  double least = left_in(mount, files);
  fs::path at = mount;
  for (const fs::path& part : fs::path(group).relative_path()) {
    at /= part;
    least = std::min(least, left_in(at, files));
  }
  return least;
}

// Lines of /proc/self/cgroup are ID:CONTROLLERS:PATH; version 2 has no controllers in its line.
double control_groups_leave(const fs::path& root) {
  const fs::path mounts = root / "sys/fs/cgroup";
  double least = std::min(left_in(mounts, kVersion2), left_in(mounts / "memory", kVersion1));
  std::ifstream groups(root / "proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    const auto first = line.find(':'), second = line.find(':', first + 1);
    if (first == std::string::npos || second == std::string::npos) continue;
    const std::string controllers = ',' + line.substr(first + 1, second - first - 1) + ',';
    const std::string group = line.substr(second + 1);
    if (controllers == ",,") {
      for (const fs::path& mount : {mounts, mounts / "unified"})
        least = std::min(least, left_in_all(mount, group, kVersion2));
    } else if (controllers.find(",memory,") != std::string::npos) {
      least = std::min(least, left_in_all(mounts / "memory", group, kVersion1));
    }
  }
  return least;
}

}  // namespace

double memory_left_bytes(double limit_gigabytes, int processes_here, const fs::path& root) {
  const int processes = std::max(1, processes_here);
  if (limit_gigabytes > 0) return std::max(0.0, 1e9 * limit_gigabytes / processes - resident_bytes());
  const double free = 1024 * number_after(root / "proc/meminfo", "MemAvailable:", 0);
  return 0.8 * std::min(free, control_groups_leave(root)) / processes;
}

double resident_bytes() {
  return 1024 * number_after("/proc/self/status", "VmRSS:", 0);
}
double shared_resident_bytes() {
  return 1024 * number_after("/proc/self/status", "RssShmem:", 0);
}
double peak_resident_bytes() {
  return 1024 * number_after("/proc/self/status", "VmHWM:", 0);
}

}  // namespace palpate
