// A bundle's file is cut, extended, overwritten or replaced while it is mapped and scenes step. The step must raise a flag,
// wherever the file was cut, and the host program must survive.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "tests/support/bundle_forms.h"
#include "tests/support/file_bytes.h"
#include "tests/support/host_faults.h"
#include "tests/support/hostile_play.h"
#include "tests/support/test_files.h"

namespace palpate::tests {
namespace {

const BundleForm& form(int which) {
  static const std::vector<BundleForm> all = bundle_forms(testing::TempDir());
  return all[static_cast<std::size_t>(which)];
}

void write_file(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

SceneDef small_def() {
  SceneDef def;
  def.max_tools = 2, def.max_points = 4, def.max_contact_nodes = 24;
  return def;
}

// An open bundle file with a scene.
class PlayedFile {
 public:
  explicit PlayedFile(const std::string& name, int which = 0, palpate_file_access access = PALPATE_FILE_MAP_GUARDED)
      : path(scratch(name)) {
    write_file(path, form(which).bytes);
    palpate_bundle* opened = nullptr;
    palpate_error error = {};
    const palpate_bundle_options options = options_for(access);
    if (palpate_bundle_open_file(path.c_str(), &options, &opened, &error) != PALPATE_OK)
      throw std::runtime_error(error.text);
    bundle.reset(opened);
    const SceneDef def = small_def();
    palpate_scene* created = nullptr;
    if (palpate_scene_create(opened, &def, &created, &error) != PALPATE_OK) throw std::runtime_error(error.text);
    scene.reset(created);
    play = std::make_unique<HeldPlay>(created, def, palpate_bundle_describe(opened).node_count);
    node = palpate_bundle_touchable(opened)[3];
  }
  ~PlayedFile() { std::filesystem::remove(path); }

  // Steps touch and shape, returns their flags; a broken promise fails the test.
  palpate_step_flags step() {
    palpate_grip grip = palpate_default_grip();
    grip.kind = PALPATE_GRIP_NODE, grip.node = node, grip.displacement[2] = 1e-3;
    const palpate_tool tool = grip_tool(&grip);
    EXPECT_EQ(play->touch(&tool, 1, 1e-3), "");
    EXPECT_EQ(play->shape(play->contacts()), "");
    return play->flags();
  }
  palpate_step_flags step_afresh() {
    play->reset();
    return step();
  }

  std::filesystem::path path;
  BundlePointer bundle;
  ScenePointer scene;
  std::unique_ptr<HeldPlay> play;
  std::int32_t node = 0;
};

TEST(HostileFile, CutAnywhereWhileMappedIsFlaggedOrHasLostNothing) {
  const std::string& whole = form(0).bytes;
  std::size_t last = whole.size() - 1;
  while (whole[last] == 0) --last;
  std::vector<std::size_t> cuts = {0, 1, 4095, 4096, last, last - 1, last / 4096 * 4096};
  for (std::size_t n = 0; n < last; n += 1531) cuts.push_back(n);
  for (std::size_t n = whole.size() - whole.size() % 4096; n < last; n += 13) cuts.push_back(n);  // in the last page
  for (const std::size_t n : cuts) {
    PlayedFile file("cut.h5");
    ASSERT_EQ(file.step() & PALPATE_STEP_BUNDLE_LOST, 0u);
    ASSERT_EQ(truncate(file.path.c_str(), static_cast<off_t>(n)), 0);
    ASSERT_TRUE(file.step() & PALPATE_STEP_BUNDLE_LOST) << n << " of " << whole.size();
    ASSERT_TRUE(file.step_afresh() & PALPATE_STEP_BUNDLE_LOST) << n;
    palpate_error error = {};
    ASSERT_EQ(palpate_bundle_check(file.bundle.get(), &error), PALPATE_ERROR_TRUNCATED) << n;
    ASSERT_EQ(palpate_bundle_prefault(file.bundle.get(), 0, &error), PALPATE_ERROR_TRUNCATED) << n;
    palpate_scene* another = nullptr;
    const SceneDef def = small_def();
    ASSERT_EQ(palpate_scene_create(file.bundle.get(), &def, &another, &error), PALPATE_ERROR_TRUNCATED) << n;
    ASSERT_EQ(another, nullptr);
  }
  if (last + 1 < whole.size()) {  // cutting off zeros changes nothing: a page reads as zeros behind the end
    PlayedFile file("zeros.h5");
    ASSERT_EQ(truncate(file.path.c_str(), static_cast<off_t>(last + 1)), 0);
    EXPECT_EQ(file.step() & PALPATE_STEP_BUNDLE_LOST, 0u);
  }
}

TEST(HostileFile, ExtendedOrReplacedByRenamingIsPlayedOn) {
  PlayedFile file("extended.h5");
  std::ofstream(file.path, std::ios::binary | std::ios::app) << std::string(100000, 'x');
  EXPECT_EQ(file.step() & PALPATE_STEP_BUNDLE_LOST, 0u);
  write_file(scratch("other.h5"), form(1).bytes);
  std::filesystem::rename(scratch("other.h5"), file.path);
  EXPECT_EQ(file.step_afresh() & PALPATE_STEP_BUNDLE_LOST, 0u);
  std::filesystem::remove(file.path);
  EXPECT_EQ(file.step_afresh() & PALPATE_STEP_BUNDLE_LOST, 0u);
  EXPECT_EQ(palpate_bundle_check(file.bundle.get(), nullptr), PALPATE_OK);
}

TEST(HostileFile, WrittenOverInPlaceIsFlagged) {
  for (const int other : {1, 2, 3}) {
    PlayedFile file("over.h5");
    ASSERT_EQ(file.step() & PALPATE_STEP_BUNDLE_LOST, 0u);
    // As cp does: truncates the same file to zero and writes it anew.
    write_file(file.path, form(other).bytes);
    EXPECT_TRUE(file.step() & PALPATE_STEP_BUNDLE_LOST);
    EXPECT_TRUE(file.step_afresh() & PALPATE_STEP_BUNDLE_LOST);
  }
  PlayedFile file("same.h5");
  std::fstream same(file.path, std::ios::binary | std::ios::in | std::ios::out);
  same << form(0).bytes;  // the same bytes: nothing is lost
  same.close();
  EXPECT_EQ(file.step_afresh() & PALPATE_STEP_BUNDLE_LOST, 0u);
}

TEST(HostileFile, ThatIsLostLeavesOtherBundlesAlone) {
  PlayedFile lost("lost.h5"), kept("kept.h5", 3);
  ASSERT_EQ(truncate(lost.path.c_str(), 5000), 0);
  EXPECT_TRUE(lost.step_afresh() & PALPATE_STEP_BUNDLE_LOST);
  EXPECT_EQ(kept.step_afresh() & PALPATE_STEP_BUNDLE_LOST, 0u);
  EXPECT_EQ(palpate_bundle_check(kept.bundle.get(), nullptr), PALPATE_OK);
}

TEST(HostileFile, CutWhileScenesOnSeveralThreadsStepIsFlaggedInAll) {
  for (int round = 0; round < 8; ++round) {
    PlayedFile file("threads.h5"), other("other.h5", 5);
    std::vector<std::unique_ptr<HeldPlay>> plays;
    std::vector<ScenePointer> scenes;
    const SceneDef def = small_def();
    for (int t = 0; t < 3; ++t) {
      palpate_bundle* bundle = t == 2 ? other.bundle.get() : file.bundle.get();
      palpate_scene* created = nullptr;
      ASSERT_EQ(palpate_scene_create(bundle, &def, &created, nullptr), PALPATE_OK);
      scenes.emplace_back(created);
      plays.push_back(std::make_unique<HeldPlay>(created, def, palpate_bundle_describe(bundle).node_count));
    }
    std::atomic<bool> stop{false};
    std::atomic<int> stepped{0};
    std::string broken[3];
    std::atomic<palpate_step_flags> raised[3] = {};
    std::vector<std::thread> threads;
    for (int t = 0; t < 3; ++t)
      threads.emplace_back([&, t] {
        const std::int32_t* touchable = palpate_bundle_touchable(t == 2 ? other.bundle.get() : file.bundle.get());
        for (int s = 0; !stop.load() && broken[t].empty(); ++s) {
          palpate_grip grip = palpate_default_grip();
          grip.kind = PALPATE_GRIP_NODE, grip.node = touchable[(s + t) % 12], grip.displacement[1] = 1e-3;
          const palpate_tool tool = grip_tool(&grip);
          broken[t] = plays[t]->touch(&tool, 1, 1e-3);
          if (broken[t].empty()) broken[t] = plays[t]->shape(plays[t]->contacts());
          raised[t].store(plays[t]->flags());
          ++stepped;
        }
      });
    while (stepped < 30) std::this_thread::yield();
    EXPECT_EQ(truncate(file.path.c_str(), 4096 + 3000 * round), 0);
    const int before = stepped;
    const auto patience = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while ((stepped < before + 30 || !(raised[0] & raised[1] & PALPATE_STEP_BUNDLE_LOST)) &&
           std::chrono::steady_clock::now() < patience)
      std::this_thread::yield();
    stop = true;
    for (auto& thread : threads) thread.join();
    for (int t = 0; t < 3; ++t) EXPECT_EQ(broken[t], "") << t;
    EXPECT_TRUE(raised[0] & PALPATE_STEP_BUNDLE_LOST);
    EXPECT_TRUE(raised[1] & PALPATE_STEP_BUNDLE_LOST);
    EXPECT_FALSE(raised[2] & PALPATE_STEP_BUNDLE_LOST);
  }
}

// ---- hosts with their own signal handler ------------------------------------------------------------------------------

bool host_hears_its_fault() {
  return tests::host_hears_its_fault(scratch("theirs"));
}

// The handler of SIGBUS of this process now.
struct sigaction handler_now() {
  struct sigaction now = {};
  sigaction(SIGBUS, nullptr, &now);
  return now;
}
bool is_the_hosts(const struct sigaction& handler) {
  return (handler.sa_flags & SA_SIGINFO) && handler.sa_sigaction == on_fault;
}

TEST(HostileFile, LeavesTheHostItsOwnFaultsWhenItsHandlerCameFirst) {
  struct sigaction own = {}, before = {};
  own.sa_sigaction = on_fault, own.sa_flags = SA_SIGINFO;
  sigaction(SIGBUS, &own, &before);
  {
    PlayedFile file("first.h5");
    host_faults = 0;
    ASSERT_EQ(truncate(file.path.c_str(), 4096), 0);
    EXPECT_TRUE(file.step_afresh() & PALPATE_STEP_BUNDLE_LOST);
    EXPECT_EQ(host_faults, 0);
    EXPECT_TRUE(host_hears_its_fault());
  }
  EXPECT_TRUE(host_hears_its_fault()) << "after the bundle is closed as well";
  sigaction(SIGBUS, &before, nullptr);
}

TEST(HostileFile, PutsTheHostsHandlerBackWhenTheLastGuardedBundleIsClosed) {
  struct sigaction own = {}, before = {};
  own.sa_sigaction = on_fault, own.sa_flags = SA_SIGINFO;
  sigaction(SIGBUS, &own, &before);
  for (int round = 0; round < 2; ++round) {
    auto first = std::make_unique<PlayedFile>("one.h5"), second = std::make_unique<PlayedFile>("two.h5");
    EXPECT_FALSE(is_the_hosts(handler_now()));
    first.reset();
    EXPECT_FALSE(is_the_hosts(handler_now()));
    ASSERT_EQ(truncate(second->path.c_str(), 4096), 0);
    EXPECT_TRUE(second->step_afresh() & PALPATE_STEP_BUNDLE_LOST);
    second.reset();
    EXPECT_TRUE(is_the_hosts(handler_now()));
    EXPECT_TRUE(host_hears_its_fault());
  }
  sigaction(SIGBUS, &before, nullptr);
}

TEST(HostileFile, LeavesAHandlerAloneThatTheHostInstalledWhileABundleWasOpen) {
  struct sigaction own = {}, before = {};
  own.sa_sigaction = on_fault, own.sa_flags = SA_SIGINFO;
  {
    PlayedFile file("meanwhile.h5");
    sigaction(SIGBUS, &own, &before);
  }
  EXPECT_TRUE(is_the_hosts(handler_now()));
  EXPECT_TRUE(host_hears_its_fault());
  signal(SIGBUS, SIG_DFL);
}

// The default: a map without a guard. What the host loses, the host hears.
TEST(HostileFile, ThatIsMappedWithoutAGuardLeavesSignalsToTheHost) {
  struct sigaction own = {}, before = {};
  own.sa_sigaction = on_fault, own.sa_flags = SA_SIGINFO;
  sigaction(SIGBUS, &own, &before);
  {
    PlayedFile file("unguarded.h5", 0, PALPATE_FILE_MAP);
    EXPECT_TRUE(is_the_hosts(handler_now()));
    EXPECT_EQ(file.step() & PALPATE_STEP_BUNDLE_LOST, 0u);
    {
      PlayedFile guarded("guarded.h5");
      EXPECT_FALSE(is_the_hosts(handler_now()));
    }
    EXPECT_TRUE(is_the_hosts(handler_now())) << "with an unguarded bundle still open";
    host_faults = 0;
    ASSERT_EQ(truncate(file.path.c_str(), 4096), 0);
    EXPECT_TRUE(file.step_afresh() & PALPATE_STEP_BUNDLE_LOST) << "the host's handler maps zeros";
    EXPECT_GT(host_faults, 0);
    const int faults = host_faults;
    EXPECT_EQ(palpate_bundle_check(file.bundle.get(), nullptr), PALPATE_ERROR_TRUNCATED);
    EXPECT_EQ(host_faults, faults) << "the check reads the file and no map";
  }
  EXPECT_TRUE(is_the_hosts(handler_now()));
  sigaction(SIGBUS, &before, nullptr);
}

TEST(HostileFile, WrittenOverInPlaceIsFlaggedWithoutAGuardToo) {
  PlayedFile file("over_unguarded.h5", 0, PALPATE_FILE_MAP);
  ASSERT_EQ(file.step() & PALPATE_STEP_BUNDLE_LOST, 0u);
  std::string other = form(1).bytes;
  other.resize(std::max(other.size(), form(0).bytes.size()));
  const int descriptor = open(file.path.c_str(), O_WRONLY);  // not cut: what is mapped stays
  ASSERT_EQ(pwrite(descriptor, other.data(), other.size(), 0), static_cast<ssize_t>(other.size()));
  close(descriptor);
  EXPECT_TRUE(file.step() & PALPATE_STEP_BUNDLE_LOST);
}

// A file whose sections are copied: no map, no handler, nothing to lose.
TEST(HostileFile, ThatIsCopiedLeavesSignalsAloneAndCannotHarmAScene) {
  struct sigaction own = {}, before = {};
  own.sa_sigaction = on_fault, own.sa_flags = SA_SIGINFO;
  sigaction(SIGBUS, &own, &before);
  host_faults = 0;
  const auto path = scratch("copied.h5");
  const palpate_bundle_options options = options_for(PALPATE_FILE_COPY);
  const SceneDef def = small_def();
  const auto kept_on = [&](auto harm) {
    write_file(path, form(0).bytes);
    palpate_bundle* opened = nullptr;
    EXPECT_EQ(palpate_bundle_open_file(path.c_str(), &options, &opened, nullptr), PALPATE_OK);
    const BundlePointer bundle(opened);
    palpate_scene* created = nullptr;
    EXPECT_EQ(palpate_scene_create(opened, &def, &created, nullptr), PALPATE_OK);
    const ScenePointer scene(created);
    EXPECT_TRUE(is_the_hosts(handler_now()));
    EXPECT_EQ(file_bytes("/proc/self/maps").find(path.filename().string()), std::string::npos);
    HeldPlay play(created, def, palpate_bundle_describe(opened).node_count);
    palpate_grip grip = palpate_default_grip();
    grip.kind = PALPATE_GRIP_NODE, grip.node = palpate_bundle_touchable(opened)[3], grip.displacement[2] = 1e-3;
    const palpate_tool tool = grip_tool(&grip);
    const auto step = [&] {
      EXPECT_EQ(play.touch(&tool, 1, 1e-3), "");
      EXPECT_EQ(play.shape(play.contacts()), "");
      EXPECT_EQ(play.flags() & ~PALPATE_STEP_FORCE_LIMITED, 0u);
      const auto* bytes = reinterpret_cast<const char*>(palpate_contacts_node(play.contacts(), 0));
      return std::string(bytes, sizeof(palpate_contact_node));
    };
    const std::string good = step();
    harm();
    play.reset();
    EXPECT_EQ(step(), good);
    palpate_error error = {};
    EXPECT_NE(palpate_bundle_check(opened, &error), PALPATE_OK);
    SceneDef more = def;
    more.shape = PALPATE_SHAPE_VOLUME;  // needs a section that was not copied before
    palpate_scene* another = nullptr;
    EXPECT_EQ(palpate_scene_create(opened, &more, &another, &error), PALPATE_ERROR_TRUNCATED) << error.text;
    EXPECT_EQ(another, nullptr);
    EXPECT_EQ(step(), good);
  };
  kept_on([&] { ASSERT_EQ(truncate(path.c_str(), 0), 0); });
  kept_on([&] { ASSERT_EQ(truncate(path.c_str(), 5000), 0); });
  kept_on([&] { write_file(path, form(1).bytes); });
  EXPECT_EQ(host_faults, 0);
  std::filesystem::remove(path);
  sigaction(SIGBUS, &before, nullptr);
}

TEST(HostileFile, IsHeldAgainAfterTheHostHasPutItsHandlerInFrontAndOpenedAnother) {
  PlayedFile early("early.h5");
  struct sigaction own = {}, before = {};
  own.sa_sigaction = on_fault, own.sa_flags = SA_SIGINFO;
  sigaction(SIGBUS, &own, &before);  // replaces the runtime's handler: the host would now get the faults of `early`
  PlayedFile late("late.h5");        // opening a bundle puts the runtime's handler in front again
  host_faults = 0;
  ASSERT_EQ(truncate(early.path.c_str(), 4096), 0);
  ASSERT_EQ(truncate(late.path.c_str(), 4096), 0);
  EXPECT_TRUE(early.step_afresh() & PALPATE_STEP_BUNDLE_LOST);
  EXPECT_TRUE(late.step_afresh() & PALPATE_STEP_BUNDLE_LOST);
  EXPECT_EQ(host_faults, 0);
  EXPECT_TRUE(host_hears_its_fault());
  sigaction(SIGBUS, &before, nullptr);
}

struct sigaction behind_host = {};
void on_fault_of_nobody(int signal, siginfo_t* info, void* context) {
  behind_host.sa_sigaction(signal, info, context);
}

// The host installs its handler after the runtime's and passes unknown faults on to it. The next opening puts the runtime's
// handler in front again.
void fault_with_the_host_between_two_openings() {
  signal(SIGBUS, SIG_DFL);
  PlayedFile early("before_host.h5");
  struct sigaction own = {};
  own.sa_sigaction = on_fault_of_nobody, own.sa_flags = SA_SIGINFO;
  sigaction(SIGBUS, &own, &behind_host);
  PlayedFile late("after_host.h5");
  host_hears_its_fault();
}
TEST(HostileFile, EndsAFaultOfNobodyThatTheHostsHandlerHandsBack) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");  // a process of its own, without the handlers of other tests
  EXPECT_EXIT(fault_with_the_host_between_two_openings(), testing::KilledBySignal(SIGBUS), "");
}

// A fault that belongs to nobody: the default action ends the process, as it would without the runtime.
void fault_after_closing() {
  signal(SIGBUS, SIG_DFL);
  { PlayedFile file("closed.h5"); }
  host_hears_its_fault();
}
TEST(HostileFile, OnceClosedDoesNotHideFaultsInWhatIsMappedThereLater) {
  EXPECT_EXIT(fault_after_closing(), testing::KilledBySignal(SIGBUS), "");
}

}  // namespace
}  // namespace palpate::tests
