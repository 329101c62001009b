// The memory that a job's control groups leave, from files that look like those of Slurm jobs, containers and desktops.
#include "precompute/solver/memory_left.h"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/test_files.h"

namespace palpate::tests {
namespace {

constexpr const char* kUnlimited1 = "9223372036854771712";  // what version 1 says for no limit

class MemoryLeft : public ::testing::Test {
 protected:
  void SetUp() override { write("proc/meminfo", "MemTotal: 64000000 kB\nMemAvailable: 32000000 kB\n"); }

  void write(const std::string& path, const std::string& text) {
    std::filesystem::create_directories((root_ / path).parent_path());
    std::ofstream(root_ / path) << text;
  }
  void group2(const std::string& path, const std::string& limit, const std::string& used) {
    write("sys/fs/cgroup" + path + "/memory.max", limit + "\n");
    write("sys/fs/cgroup" + path + "/memory.current", used + "\n");
  }
  void group1(const std::string& path, const std::string& limit, const std::string& used) {
    write("sys/fs/cgroup/memory" + path + "/memory.limit_in_bytes", limit + "\n");
    write("sys/fs/cgroup/memory" + path + "/memory.usage_in_bytes", used + "\n");
  }
  double left() const { return memory_left_bytes(0, 1, root_); }

  std::filesystem::path root_ = fresh_folder();
};

TEST_F(MemoryLeft, WithoutALimitFourFifthsOfWhatIsFreeAreLeft) {
  EXPECT_DOUBLE_EQ(left(), 0.8 * 32e6 * 1024);
  EXPECT_DOUBLE_EQ(memory_left_bytes(0, 4, root_), 0.2 * 32e6 * 1024);
  group2("", "max", "5000000000");
  EXPECT_DOUBLE_EQ(left(), 0.8 * 32e6 * 1024);
}

TEST_F(MemoryLeft, TheLimitOfASlurmJobOnVersion2Counts) {
  write("proc/self/cgroup", "0::/system.slice/slurmstepd.scope/job_7/step_0/user/task_0\n");
  group2("/system.slice/slurmstepd.scope/job_7/step_0/user/task_0", "max", "100000000");
  group2("/system.slice/slurmstepd.scope/job_7", "2000000000", "500000000");
  group2("/system.slice", "max", "900000000");
  EXPECT_DOUBLE_EQ(left(), 0.8 * 1.5e9);
}

TEST_F(MemoryLeft, TheLimitOfAVersion1ContainerCounts) {
  write("proc/self/cgroup", "11:cpu,cpuacct:/docker/f00\n9:memory:/docker/f00\n");
  group1("", kUnlimited1, "7000000000");
  group1("/docker/f00", "1000000000", "400000000");
  EXPECT_DOUBLE_EQ(left(), 0.8 * 0.6e9);
}

TEST_F(MemoryLeft, AVersion1ContainerThatSeesItsGroupAsTheRootCounts) {
  write("proc/self/cgroup", "9:memory:/docker/f00\n");  // a path of the host, absent inside
  group1("", "1000000000", "400000000");
  EXPECT_DOUBLE_EQ(left(), 0.8 * 0.6e9);
}

TEST_F(MemoryLeft, CachedFilesDoNotCountAsUsed) {
  group2("", "4000000000", "3500000000");
  write("sys/fs/cgroup/memory.stat", "anon 1000000000\ninactive_file 2500000000\n");
  EXPECT_DOUBLE_EQ(left(), 0.8 * 3e9);
}

TEST_F(MemoryLeft, AFullGroupLeavesNothing) {
  group2("", "1000000000", "1100000000");
  EXPECT_EQ(left(), 0);
}

TEST(OwnPeak, CountsWhatRanksShareOnceAlsoAfterItWasFreed) {
  // Two ranks with 2 GB of their own and 5 GB that they share, which they free before they pack.
  OwnPeak peak;
  EXPECT_DOUBLE_EQ(peak.after_stage(1, 0, 2), 1);    // assemble
  EXPECT_DOUBLE_EQ(peak.after_stage(7, 5, 2), 4.5);  // columns
  EXPECT_DOUBLE_EQ(peak.after_stage(7, 0, 2), 4.5);  // pack
  EXPECT_DOUBLE_EQ(peak.after_stage(8, 0, 2), 8);    // a stage that takes more than all before, and shares nothing
}

}  // namespace
}  // namespace palpate::tests
