// The library as a host loads and unloads it: afterwards a SIGBUS must reach the host's own handler, and no code of the library.
#include <dlfcn.h>
#include <gtest/gtest.h>

#include "runtime/include/palpate/palpate.h"

#include "tests/support/bundle_forms.h"
#include "tests/support/host_faults.h"
#include "tests/support/test_files.h"

namespace palpate::tests {
namespace {

class Loaded {
 public:
  Loaded() : library_(dlopen(PALPATE_LIBRARY, RTLD_NOW | RTLD_LOCAL)) {
    if (!library_) throw std::runtime_error(dlerror());
  }
  // True where the library is gone from the process.
  bool unload() {
    dlclose(library_);
    return dlopen(PALPATE_LIBRARY, RTLD_NOW | RTLD_NOLOAD) == nullptr;
  }
  template <class Function>
  Function* find(const char* name) const {
    return reinterpret_cast<Function*>(dlsym(library_, name));
  }
  palpate_bundle* open_guarded(const char* path) const {
    palpate_bundle_options options;
    find<decltype(palpate_init_bundle_options)>("palpate_init_bundle_options")(&options, sizeof options);
    options.file_access = PALPATE_FILE_MAP_GUARDED;
    palpate_bundle* bundle = nullptr;
    find<decltype(palpate_bundle_open_file)>("palpate_bundle_open_file")(path, &options, &bundle, nullptr);
    return bundle;
  }

 private:
  void* library_;
};

class Unloading : public testing::Test {
 protected:
  void SetUp() override {
    struct sigaction own = {};
    own.sa_sigaction = on_fault, own.sa_flags = SA_SIGINFO;
    sigaction(SIGBUS, &own, &before_);
    std::ofstream(file_, std::ios::binary) << bundle_forms(testing::TempDir())[0].bytes;
    host_faults = 0;
  }
  void TearDown() override {
    sigaction(SIGBUS, &before_, nullptr);
    std::filesystem::remove(file_);
  }
  const std::string file_ = scratch("h5"), theirs_ = scratch("theirs");

 private:
  struct sigaction before_ = {};
};

TEST_F(Unloading, AfterAGuardedBundleWasClosedLeavesTheHostItsFaults) {
  Loaded library;
  palpate_bundle* bundle = library.open_guarded(file_.c_str());
  ASSERT_NE(bundle, nullptr);
  // While it is open, the library mends what its bundle loses, and no other fault.
  palpate_error error = {};
  ASSERT_EQ(truncate(file_.c_str(), 4096), 0);
  EXPECT_EQ(library.find<decltype(palpate_bundle_check)>("palpate_bundle_check")(bundle, &error),
            PALPATE_ERROR_TRUNCATED);
  EXPECT_EQ(host_faults, 0);
  EXPECT_TRUE(host_hears_its_fault(theirs_));
  library.find<decltype(palpate_bundle_close)>("palpate_bundle_close")(bundle);
  ASSERT_TRUE(library.unload());
  EXPECT_TRUE(host_hears_its_fault(theirs_));
  EXPECT_EQ(host_faults, 2);
}

TEST_F(Unloading, WithAGuardedBundleStillOpenLeavesTheHostItsFaults) {
  Loaded library;
  ASSERT_NE(library.open_guarded(file_.c_str()), nullptr);  // the host forgets to close it
  ASSERT_TRUE(library.unload());
  EXPECT_TRUE(host_hears_its_fault(theirs_));
}

}  // namespace
}  // namespace palpate::tests
