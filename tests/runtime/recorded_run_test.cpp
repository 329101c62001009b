// A recorded run hashes the same in every build (unoptimised, optimised, for this machine's instructions, by another
// compiler, without run-time dispatch), on any number of threads, whatever the mathematics library chooses for the
// processor, from every form of a bundle. Bundle and path are written once, here, so that all builds read the same bytes.
#include <cmath>
#include <cstdio>
#include <set>
#include <sstream>

#include "formats/tissue_laws.h"
#include "tests/runtime/recorded_input.h"
#include "tests/runtime/touched_box.h"
#include "tests/support/box_corridor.h"
#include "tests/support/packed_bundle.h"

namespace palpate::tests {
namespace {

std::vector<std::string> builds() {
  const char* const others = std::getenv("PALPATE_RECORDED_BUILDS");  // of `make -f Makefile.data test-release`
  std::istringstream names(others ? others : PALPATE_RECORDED_BUILDS);
  return {std::istream_iterator<std::string>(names), {}};
}

std::string output_of(const std::string& build, const std::filesystem::path& bundle, const std::filesystem::path& path,
                      int threads = 2, const std::string& environment = "") {
  const std::string command = environment + " '" + PALPATE_RECORDED_RUN + build + "' '" + bundle.string() + "' '" +
                              path.string() + "' " + std::to_string(threads);
  std::string output;
  std::FILE* pipe = popen(command.c_str(), "r");
  if (!pipe) return {};
  for (char buffer[4096]; const std::size_t count = std::fread(buffer, 1, sizeof buffer, pipe);)
    output.append(buffer, count);
  return pclose(pipe) == 0 ? output : "failed: " + output;
}

class RecordedRun : public testing::Test {
 protected:
  void SetUp() override {
    write_recorded_bundle(bundle_);
    write_path(path_, recorded_path());
  }
  void TearDown() override {
    std::filesystem::remove(bundle_);
    std::filesystem::remove(path_);
  }
  const std::filesystem::path bundle_ = scratch_file("bundle.h5"), path_ = scratch_file("path");
};

constexpr int kScenes = 38;

TEST_F(RecordedRun, HashesTheSameInEveryBuild) {
  ASSERT_GE(builds().size(), 3u);
  const std::string expected = output_of("configured", bundle_, path_);
  ASSERT_EQ(std::count(expected.begin(), expected.end(), '\n'), kScenes) << expected;
  for (const auto& build : builds()) EXPECT_EQ(output_of(build, bundle_, path_), expected) << build;
}

#ifdef PALPATE_RECORDED_STATIC
// An effect that is off changes no bit: a build without the effects' code gives the same hashes.
TEST_F(RecordedRun, HashesTheSameInABuildWithoutTheEffectsThatItLeavesOff) {
  const std::string whole = output_of("configured", bundle_, path_);
  std::istringstream lines(output_of("without_effects", bundle_, path_));
  std::set<std::string> found;
  for (std::string line; std::getline(lines, line); found.insert(line))
    EXPECT_NE(whole.find(line + '\n'), std::string::npos) << line;
  EXPECT_EQ(found.size(), 2u);  // a node and a point, sticking, against the surface at rest
}
#endif

TEST_F(RecordedRun, HashesTheSameFromEveryFormOfABundleInEveryBuild) {
  auto path = recorded_path();
  path.resize(80);  // each form is a run of its own
  write_path(path_, path);
  std::set<std::string> different;
  for (const auto& [name, form] : kPackedForms) {
    write_recorded_bundle(bundle_, form);
    const std::string expected = output_of("configured", bundle_, path_);
    ASSERT_EQ(std::count(expected.begin(), expected.end(), '\n'), kScenes) << name << expected;
    for (const auto& build : builds()) EXPECT_EQ(output_of(build, bundle_, path_), expected) << name << ", " << build;
    different.insert(expected);
  }
  EXPECT_EQ(different.size(), std::size(kPackedForms));  // each form holds other numbers
}

// A bundle that can be cut has the scenes that are cut, and lacks what the linear ones above need.
TEST_F(RecordedRun, HashesTheSameInEveryBuildWhereTheOrganIsCut) {
  write_bundle(bundle_, cut_box({.cells = {6, 5, 4}}, 120));
  const std::string expected = output_of("configured", bundle_, path_);
  std::istringstream lines(expected);
  int cut = 0;
  for (std::string line; std::getline(lines, line);) cut += line.find("organ 4") != std::string::npos;
  EXPECT_EQ(cut, 2) << expected;
  for (const auto& build : builds()) EXPECT_EQ(output_of(build, bundle_, path_), expected) << build;
}

// Those of Yeoh and Ogden; the scenes above have the neo-Hookean one.
TEST_F(RecordedRun, HashesTheSameWithEachLawOfLargeStrainInEveryBuild) {
  auto path = recorded_path();
  path.resize(80);
  write_path(path_, path);
  std::set<std::string> different;
  for (const std::vector<double>& law : {std::vector<double>{1, -300, 400, 0}, {2, 4.5, 0.2, -5}}) {
    write_recorded_bundle(bundle_, [&](BundleParts& parts) {
      parts.set(formats::SectionId::large_stiffening, {1}, std::vector<double>{formats::kNoStiffening});
      parts.set(formats::SectionId::large_law, {1, formats::kLawNumbers}, law);
    });
    const std::string expected = output_of("configured", bundle_, path_);
    ASSERT_EQ(std::count(expected.begin(), expected.end(), '\n'), kScenes) << law[0] << expected;
    for (const auto& build : builds()) EXPECT_EQ(output_of(build, bundle_, path_), expected) << law[0] << ", " << build;
    different.insert(expected);
  }
  EXPECT_EQ(different.size(), 2u);
}

TEST_F(RecordedRun, HashesTheSameOnAnyNumberOfThreads) {
  const std::string expected = output_of("configured", bundle_, path_, 1);
  for (const int threads : {2, 5}) EXPECT_EQ(output_of("configured", bundle_, path_, threads), expected) << threads;
}

#ifdef __GLIBC__
// glibc chooses functions by the processor, and some of them differ in the last digit.
TEST_F(RecordedRun, HashesTheSameWhateverTheMathematicsLibraryPicks) {
  EXPECT_EQ(output_of("configured", bundle_, path_, 2, "GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F"),
            output_of("configured", bundle_, path_));
}
#endif

TEST_F(RecordedRun, MeetsContactsCorrectionsConflictsSlipsAndLimits) {
  std::istringstream lines(output_of("configured", bundle_, path_));
  unsigned flags = 0;
  int scenes = 0;
  for (std::string line; std::getline(lines, line); ++scenes) {
    int law = 0;
    long contact_nodes = 0, slips = 0;
    unsigned scene_flags = 0;
    ASSERT_EQ(std::sscanf(line.c_str(), "collision %*d contact %*d law %d %*[^:]: contact_nodes %ld slips %ld flags %u",
                          &law, &contact_nodes, &slips, &scene_flags),
              4)
        << line;
    // More than the grip and the two pinching points alone, of which a sliding one on a node may lose its contact for a while.
    EXPECT_GT(contact_nodes, 2.9 * 400) << line;
    EXPECT_EQ(slips > 0, law == PALPATE_LAW_COULOMB) << line;
    flags |= scene_flags;
  }
  EXPECT_EQ(scenes, kScenes);
  for (const unsigned flag : {PALPATE_STEP_REGULARISED, PALPATE_STEP_RESPONSE_RANGE, PALPATE_STEP_FORCE_LIMITED})
    EXPECT_TRUE(flags & flag) << flag;
  EXPECT_FALSE(flags & (PALPATE_STEP_BAD_INPUT | PALPATE_STEP_CONTACTS_DROPPED | PALPATE_STEP_UNSOLVED)) << flags;
}

TEST_F(RecordedRun, HashesOtherwiseWhenOneStepDiffersByOneBit) {
  const std::string before = output_of("configured", bundle_, path_);
  auto path = recorded_path();
  double& x = path[70].press[1][0];  // inside the organ
  x = std::nextafter(x, 1.0);
  write_path(path_, path);
  EXPECT_NE(output_of("configured", bundle_, path_), before);
}

}  // namespace
}  // namespace palpate::tests
