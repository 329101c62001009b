// Runs that are killed, stopped or fail, and the run that resumes them: the bundle must have the same bytes as one made
// in one go. PALPATE_FAULT_INJECTOR is the path of the library made from fault_injector.c.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <random>

#include "tests/precompute/program_fixture.h"

namespace palpate::tests {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr int kBatches = 15;  // of 8 nodes each, of the box's 120 touchable nodes
const std::string kOptions = "--batch 24 ";

class Resume : public ProgramFixture {
 protected:
  void SetUp() override {
    ProgramFixture::SetUp();
    whole_ = made("whole.h5", kOptions);
  }

  // Runs the program with a fault of fault_injector.c. Returns the exit code, 137 for SIGKILL.
  int run_with(const std::string& fault, const std::string& options = kOptions, int ranks = 0) {
    const std::string set =
        "PALPATE_FAULT=" + fault + " LD_PRELOAD=" + PALPATE_FAULT_INJECTOR + " ASAN_OPTIONS=verify_asan_link_order=0 ";
    const std::string launch = ranks > 0 ? kLaunch + " -n " + std::to_string(ranks) + " env " + set : "exec env " + set;
    return execute("(" + launch + arguments("x.h5", options) + ")");
  }

  // Kills a run in the middle of writing the record of its k-th batch: k - 1 batches are safe.
  void kill_at_batch(int k, int ranks = 0) {
    constexpr int kWritesOfHeader = 2;
    std::filesystem::remove(folder_ / "x.h5");
    ASSERT_NE(run_with("torn:" + std::to_string(kWritesOfHeader + k) + ":.journal", kOptions, ranks), 0);
    ASSERT_TRUE(exists(".part") && exists(".journal") && !exists("")) << said_;
  }

  // Runs again, which must succeed. Returns how many batches it found done.
  int resume(const std::string& options = kOptions, int ranks = 0) {
    EXPECT_EQ(run("x.h5", "--json report.json " + options, ranks), 0) << said_;
    EXPECT_TRUE(exists("") && !exists(".part") && !exists(".part.new") && !exists(".journal"));
    const auto report = nlohmann::json::parse(file_bytes(folder_ / "report.json"), nullptr, false);
    return report.value("column_batches_of_earlier_runs", -1);
  }
  bool same() const { return file_bytes(folder_ / "x.h5") == whole_; }
  bool exists(const std::string& ending) const { return std::filesystem::exists(folder_ / ("x.h5" + ending)); }

  void keep_aside() {
    for (const char* ending : {".part", ".journal"})
      std::filesystem::copy_file(folder_ / ("x.h5" + std::string(ending)), folder_ / ("kept" + std::string(ending)));
  }
  void bring_back() {
    for (const char* ending : {".part", ".journal"})
      std::filesystem::copy_file(folder_ / ("kept" + std::string(ending)), folder_ / ("x.h5" + std::string(ending)),
                                 std::filesystem::copy_options::overwrite_existing);
  }

  std::string whole_;
};

TEST_F(Resume, RepeatsOnlyTheBlockThatWasNotSafe) {
  for (const int k : {2, 9, kBatches}) {
    kill_at_batch(k);
    EXPECT_EQ(resume(), k - 1);
    EXPECT_THAT(said_,
                HasSubstr("x.h5.part is resumed: " + std::to_string(k - 1) + " of 15 batches of columns are done"));
    EXPECT_TRUE(same());
  }
}

TEST_F(Resume, GivesTheSameBytesWhereverARunIsKilled) {
  // Kills at calls from the first to the last: layout, rows, records, seal, renaming, removal of the journal. Every 29th call: a prime, so that
  // the kills do not fall on the same call of each batch.
  int killed = 0;
  for (int n = 1; run_with("kill:" + std::to_string(n) + ":x.h5") != 0; n += n < 12 ? 3 : 29) {
    ++killed;
    resume();
    ASSERT_TRUE(same()) << "killed at call " << n;
    std::filesystem::remove(folder_ / "x.h5");
  }
  EXPECT_GT(killed, 8);
}

TEST_F(Resume, GivesTheSameBytesWhereverARunThatPacksIsKilled) {
  const std::string packing = kOptions + "--low-rank 1e-2 ";
  const std::string packed = made("packed.h5", packing);
  // One kill and its resumption take two seconds.
  int killed = 0;
  for (int n = 1; run_with("kill:" + std::to_string(n) + ":x.h5", packing) != 0; n += 71) {
    ++killed;
    resume(packing);
    ASSERT_TRUE(file_bytes(folder_ / "x.h5") == packed) << "killed at call " << n;
    std::filesystem::remove(folder_ / "x.h5");
  }
  EXPECT_GT(killed, 8);
}

TEST_F(Resume, GivesTheSameBytesWithCorridorsAndNoticesAnotherRadius) {
  const auto with_radius = [&](const char* radius) {
    write("bc.toml", kBoundary + "[[corridor]]\nname = \"biopsy\"\nfrom = [0, 20, 20]\nto = [30, 25, 20]\nradius = " +
                         radius + "\n");
  };
  with_radius("2");
  whole_ = made("whole.h5", kOptions);
  for (const int k : {1, 9}) {
    kill_at_batch(k);
    EXPECT_EQ(resume(), k - 1);
    EXPECT_TRUE(same()) << k;
  }
  kill_at_batch(9);
  with_radius("2.0000001");
  EXPECT_EQ(resume(), 0);
  EXPECT_THAT(said_, HasSubstr("anew: boundary_sha256"));
}

TEST_F(Resume, GivesTheSameBytesWhenKilledBetweenSealAndEnd) {
  // These are the last calls on each file: the renaming to the bundle and the removal of the journal.
  for (const char* fault : {"kill:5:x.h5.part", "kill:1:x.h5.part.new", "kill:6:.journal"}) {
    std::filesystem::remove(folder_ / "x.h5");
    run_with(fault);
    resume();
    ASSERT_TRUE(same()) << fault;
  }
}

TEST_F(Resume, DoesNotCareForTheNumberOfRanks) {
  kill_at_batch(4, 2);
  EXPECT_GE(resume(kOptions, 3), 3);
  EXPECT_TRUE(same());
  kill_at_batch(9);
  EXPECT_EQ(resume(kOptions, 2), 8);
  EXPECT_TRUE(same());
  kill_at_batch(4, 2);
  EXPECT_GE(resume(), 3);
  EXPECT_TRUE(same());
}

TEST_F(Resume, NeverTrustsWhatIsTorn) {
  kill_at_batch(12);
  keep_aside();
  std::mt19937 random(1);
  for (int damage = 0; damage < 8; ++damage) {
    bring_back();
    const auto file = folder_ / (damage % 2 ? "x.h5.journal" : "x.h5.part");
    const auto size = std::filesystem::file_size(file);
    const auto at = std::uniform_int_distribution<std::uint64_t>(0, size - 1)(random);
    if (damage % 4 < 2) {
      std::filesystem::resize_file(file, at);
    } else {
      std::fstream out(file, std::ios::in | std::ios::out | std::ios::binary);
      out.seekp(static_cast<std::streamoff>(at));
      out << "torn torn torn torn";
    }
    EXPECT_LE(resume(), 11);
    ASSERT_TRUE(same()) << file << (damage % 4 < 2 ? " cut" : " garbled") << " at " << at << " of " << size;
  }
  // Where only one of the two files is left, nothing can be resumed.
  bring_back();
  std::filesystem::remove(folder_ / "x.h5.part");
  EXPECT_EQ(resume(), 0);
  EXPECT_TRUE(same());
  bring_back();
  std::filesystem::remove(folder_ / "x.h5.journal");
  EXPECT_EQ(resume(), 0);
  EXPECT_THAT(said_, HasSubstr("anew: its journal"));
  EXPECT_TRUE(same());
}

TEST_F(Resume, BeginsAnewForOtherInputAndSaysWhy) {
  kill_at_batch(9);
  keep_aside();
  const auto anew = [&](const std::string& options, const std::string& why) {
    bring_back();
    EXPECT_EQ(resume(options), 0);
    EXPECT_THAT(said_, HasSubstr("x.h5.part is begun anew: " + why));
    EXPECT_FALSE(same());
  };
  anew("--batch 24 --tolerance 1e-8", "tolerance was 1e-09, is 1e-08");
  anew("--batch 48", "");
  anew("--batch 24 --memory 0.0001", "");
  anew("--batch 24 -- -ksp_type fcg", "");
  write("organ.toml", std::string(kOrgan).replace(kOrgan.find("5.4"), 3, "5.5"));
  anew(kOptions, "organ_sha256 was ");
  write("organ.toml", kOrgan);
  write("bc.toml", kBoundary + "# another comment\n");
  anew(kOptions, "boundary_sha256 was ");
  write("bc.toml", kBoundary);
  write_mesh(folder_ / "box.msh", box_mesh({6, 5, 4}, {60, 50, 41}, 0.15));
  anew(kOptions, "mesh_sha256 was ");
  EXPECT_TRUE(file_bytes(folder_ / "x.h5") == made("other.h5", kOptions));
}

// Voxels of 10 mm whose label 3 fills the layer of least or of largest x.
void write_labels(const std::filesystem::path& file, int layer) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream nrrd(file, std::ios::binary);
  nrrd << "NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes: 7 6 5\n"
          "space directions: (10,0,0) (0,10,0) (0,0,10)\nspace origin: (0,0,0)\nencoding: raw\n\n";
  for (int v = 0; v < 7 * 6 * 5; ++v) nrrd.put(static_cast<char>(v % 7 == layer ? 3 : 0));
}

// The images decide what is held along z alone, so that columns of both stiffnesses have the same places.
TEST_F(Resume, BeginsAnewWhereEitherOfTwoFilesOfOneNameIsAnother) {
  std::string boundary = "name = \"labels\"\n[[fixed]]\ndofs = \"xyz\"\nselect = { patch = \"x0\" }\n";
  for (const std::string folder : {"a", "b"})
    boundary +=
        "[[fixed]]\ndofs = \"z\"\nselect = { label = { labels = [3], image = \"" + folder + "/labels.nrrd\" } }\n";
  write("bc.toml", boundary);
  for (const std::string changed : {"a", "b"}) {
    write_labels(folder_ / "a/labels.nrrd", 0), write_labels(folder_ / "b/labels.nrrd", 0);
    kill_at_batch(9);
    write_labels(folder_ / changed / "labels.nrrd", 6);
    EXPECT_EQ(resume(), 0);
    EXPECT_THAT(said_, HasSubstr("anew: label_image_sha256 " + changed + "/labels.nrrd was "));
    EXPECT_TRUE(file_bytes(folder_ / "x.h5") == made("other.h5", kOptions));
  }
}

TEST_F(Resume, KeepsItsColumnsWhenOnlyTheMemoryIsAnother) {
  kill_at_batch(9);
  EXPECT_EQ(resume("--batch 24 --memory 3"), 8);
  EXPECT_TRUE(same());
}

TEST_F(Resume, LeavesTheOldBundleAloneUntilTheEnd) {
  write("x.h5", "the old bundle");
  EXPECT_NE(run_with("torn:11:.journal"), 0);
  EXPECT_EQ(file_bytes(folder_ / "x.h5"), "the old bundle");
  EXPECT_EQ(resume(), 8);
  EXPECT_TRUE(same());
}

TEST_F(Resume, KeepsWhatIsSafeWhenTheDiskIsFullOrFails) {
  // Where the file system can reserve space, a full disk is found before any column is solved.
  EXPECT_EQ(run_with("reserve:1:x.h5"), 1);
  EXPECT_THAT(said_, HasSubstr("free some space"));
  EXPECT_TRUE(nothing_left("x.h5"));
  // Where it cannot, a write fails later.
  EXPECT_EQ(run_with("full:15:.journal"), 1);
  EXPECT_THAT(said_, HasSubstr("No space left on device; 12 of 15 batches"));
  EXPECT_EQ(resume(), 12);
  EXPECT_TRUE(same());
  std::filesystem::remove(folder_ / "x.h5");
  EXPECT_EQ(run_with("full:7:.journal", kOptions, 2), 1);
  EXPECT_THAT(said_, HasSubstr("No space left on device; "));
  EXPECT_GE(resume(kOptions, 2), 4);
  EXPECT_TRUE(same());
  std::filesystem::remove(folder_ / "x.h5");
  // The last fdatasync of the part fails.
  EXPECT_EQ(run_with("eio:2:x.h5.part"), 1);
  EXPECT_THAT(said_, HasSubstr("Input/output error"));
  EXPECT_THAT(said_, HasSubstr("the same command resumes there"));
  resume();
  EXPECT_TRUE(same());
}

TEST_F(Resume, RefusesASecondRunOnTheSameOutput) {
  const pid_t first = start_slow("x.h5");
  EXPECT_EQ(run("x.h5"), 1);
  EXPECT_THAT(said_, HasSubstr("x.h5: another run"));
  EXPECT_TRUE(exists(".part") && exists(".journal"));
  EXPECT_EQ(run("y.h5", kOptions), 0) << said_;  // another output in the same folder is free
  EXPECT_EQ(stop(first, SIGKILL), SIGKILL);
  EXPECT_EQ(run("x.h5"), 0) << said_;  // the lock died with its process
}

TEST_F(Resume, WarnsWhereTheFileSystemHasNoLocks) {
  EXPECT_EQ(run_with("locks:1:.journal"), 0) << said_;
  EXPECT_THAT(said_, HasSubstr("warning: x.h5.journal: "));
  EXPECT_TRUE(same());
}

TEST_F(Resume, StopsAtASignalWithASentence) {
  for (const int signal : {SIGTERM, SIGINT, SIGHUP}) {
    ASSERT_EQ(stop(start_slow("x.h5", "--quiet"), signal), signal) << "it finished before it was stopped";
    EXPECT_THAT(file_bytes(folder_ / "slow.txt"),
                ::testing::MatchesRegex("warning: [^\n]*\n"  // that p1 locks at 0.45
                                        "palpate-precompute: [^\n]*SIG[A-Z]+[^\n]*x.h5.part[^\n]*\n"));
  }
}

TEST_F(Resume, SaysInOneSentenceThatAFolderCannotBeWritten) {
  std::filesystem::create_directory(folder_ / "locked");
  std::filesystem::permissions(folder_ / "locked", std::filesystem::perms(0555));
  std::filesystem::permissions(folder_, std::filesystem::perms(0777));
  const std::string as_nobody = ::geteuid() == 0 ? "setpriv --reuid=65534 --regid=65534 --clear-groups " : "";
  EXPECT_EQ(execute(as_nobody + arguments("locked/x.h5", kOptions)), 2);
  EXPECT_THAT(said_, HasSubstr("locked/x.h5: the folder locked "));
}

}  // namespace
}  // namespace palpate::tests
