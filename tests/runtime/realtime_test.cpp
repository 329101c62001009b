// A step makes no allocation, lock, system call or page fault, with every effect: loops with deadlines need that.
#include <dlfcn.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <pthread.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstddef>

#include "tests/runtime/played_box.h"
#include "tests/support/fine_body.h"
#include "tests/support/guarded_device.h"
#include "tests/support/packed_bundle.h"

// Every allocation and every lock of this program is counted while a step runs. Sanitizers bring their own malloc and
// make system calls of their own; then there is nothing to count.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kCounts = false;
#else
constexpr bool kCounts = true;
#endif
namespace {
thread_local bool counting = false;
thread_local long allocations = 0, locks = 0;
}  // namespace
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);
void* malloc(std::size_t bytes) {
  allocations += counting;
  return __libc_malloc(bytes);
}
void* calloc(std::size_t count, std::size_t bytes) {
  allocations += counting;
  return __libc_calloc(count, bytes);
}
void* realloc(void* memory, std::size_t bytes) {
  allocations += counting;
  return __libc_realloc(memory, bytes);
}
void* aligned_alloc(std::size_t alignment, std::size_t bytes) {
  allocations += counting;
  return __libc_memalign(alignment, bytes);
}
void free(void* memory) {
  allocations += counting;
  __libc_free(memory);
}
int pthread_mutex_lock(pthread_mutex_t* mutex) noexcept {
  static const auto real = reinterpret_cast<int (*)(pthread_mutex_t*)>(dlsym(RTLD_NEXT, "pthread_mutex_lock"));
  locks += counting;
  return real(mutex);
}
}
#endif

namespace palpate::tests {
namespace {

void add_every_section(BundleParts& parts) {
  add_everything(parts);
  add_large_deformation(parts);
}

// A bundle file with all sections, so large that its tensors fill many pages.
class FileBox {
 public:
  // in_blocks: stores the surface as a compliance in half-precision blocks.
  explicit FileBox(bool in_blocks = false, palpate_file_access access = PALPATE_FILE_MAP)
      : box(kForm, add_every_section), access_(access) {
    BundleParts parts = tiny_bundle(kForm);
    add_every_section(parts);
    if (in_blocks) store_in_blocks(parts, {formats::ElementType::f16, 1e-3});
    file_ = scratch_file(in_blocks ? "blocks.h5" : "bundle.h5");
    write_bundle(file_, parts);
    open();
  }
  ~FileBox() { std::filesystem::remove(file_); }
  // A new open, so that nothing is mapped yet.
  void open() {
    palpate_bundle* opened = nullptr;
    palpate_error error = {};
    const palpate_bundle_options options = options_for(access_);
    if (palpate_bundle_open_file(file_.c_str(), &options, &opened, &error) != PALPATE_OK)
      throw std::runtime_error(error.text);
    bundle.reset(opened);
  }
  ScenePointer scene(const SceneDef& def) const {
    palpate_scene* created = nullptr;
    palpate_error error = {};
    if (palpate_scene_create(bundle.get(), &def, &created, &error) != PALPATE_OK) throw std::runtime_error(error.text);
    return ScenePointer(created);
  }
  TouchedBox box;
  BundlePointer bundle;

 private:
  static constexpr TinyBox kForm = {{5, 4, 4}, {0.06, 0.05, 0.04}};
  palpate_file_access access_;
  std::filesystem::path file_;
};

// Vertices beside the box, with normals.
constexpr int kVertices = 3;
const palpate_render_mesh& vertices() {
  static const float positions[3 * kVertices] = {0.02f, 0.02f, 0.041f, 0.061f, 0.03f, 0.02f, 0.03f, 0.02f, 0.039f};
  static const float normals[3 * kVertices] = {0, 0, 1, 1, 0, 0, 0, 0, 1};
  static const palpate_render_mesh mesh = render_mesh(positions, normals, kVertices);
  return mesh;
}

// The box's surface with finer triangles.
const palpate_fine_surface& fine_surface() {
  static const FineHost host = fine_of(dense_box({.cells = {5, 4, 4}, .size = {0.06, 0.05, 0.04}}).body, 1, 0.0003);
  static const palpate_fine_surface view = host.view();
  return view;
}

// Every value of every effect, each collision with each contact model; the others are all on, or all off.
std::vector<SceneDef> every_effect() {
  std::vector<SceneDef> all;
  for (const auto collision : {PALPATE_COLLISION_OFF, PALPATE_COLLISION_REST, PALPATE_COLLISION_DEFORMED})
    for (const auto contact :
         {PALPATE_CONTACT_NODE, PALPATE_CONTACT_TRIANGLE, PALPATE_CONTACT_POINT, PALPATE_CONTACT_PATCH})
      for (const bool on : {false, true}) {
        SceneDef def;
        def.collision = collision, def.contact = contact;
        def.law = !on                                   ? PALPATE_LAW_STICKING
                  : contact == PALPATE_CONTACT_NODE     ? PALPATE_LAW_SLIDING
                  : contact == PALPATE_CONTACT_TRIANGLE ? PALPATE_LAW_UNILATERAL
                                                        : PALPATE_LAW_COULOMB;
        if (on) {
          def.shape = PALPATE_SHAPE_VOLUME, def.radial = PALPATE_RADIAL_RESPONSE;
          def.force = PALPATE_FORCE_RESPONSE, def.preload = PALPATE_PRELOAD_ON;
          def.render_mesh = vertices(), def.queries.queries = PALPATE_QUERIES_ON;
          def.report.report = PALPATE_REPORT_CONTACTS;
          def.fine_surface = fine_surface();
          def.links.max_links = 4, def.grasps.grasps = contact == PALPATE_CONTACT_PATCH;
          def.inside.inside = PALPATE_INSIDE_ON;
          def.dent.dent = contact == PALPATE_CONTACT_PATCH ? PALPATE_DENT_DISCS : PALPATE_DENT_OFF;
        }
        all.push_back(def);
        const bool deforms = contact == PALPATE_CONTACT_NODE
                                 ? collision == PALPATE_COLLISION_OFF
                                 : contact == PALPATE_CONTACT_PATCH && collision == PALPATE_COLLISION_REST;
        if (on ? collision != PALPATE_COLLISION_DEFORMED : !deforms) continue;
        def.large.deformation = PALPATE_DEFORMATION_LARGE;
        def.force = PALPATE_FORCE_LINEAR, def.radial = PALPATE_RADIAL_OFF;
        all.push_back(def);
        def.large.deformation = PALPATE_DEFORMATION_LARGE_BESIDE;
        all.push_back(def);
      }
  return all;
}

constexpr int kSteps = 400;  // the tool comes, slides, and goes three times

// A scene with all arrays that its steps need, so that run() does nothing but steps.
struct Running {
  Running(const FileBox& from, const SceneDef& def)
      : scene(from.scene(def)),
        contacts(scene.get()),
        u(static_cast<std::size_t>(from.box.dofs())),
        out(shape_out(u.data(), nullptr, static_cast<std::int32_t>(from.box.dofs() / 3))),
        skinned(def.render_mesh.positions != nullptr),
        queries(def.queries.queries != PALPATE_QUERIES_OFF),
        links(def.links.max_links > 0),
        grasps(def.grasps.grasps != 0),
        inside(def.inside.inside != PALPATE_INSIDE_OFF),
        patch(def.contact == PALPATE_CONTACT_PATCH),
        box(from.box) {
    out.positions = x.data();
    strained.capacity = out.node_capacity;
    strained.strains = tensors[0].data(), strained.stresses = tensors[1].data();
    strained.principal = principal.data(), strained.von_mises = measures[0].data();
    strained.pressures = measures[1].data();
    const double points[6] = {0.01, 0.02, 0.02, 0.05, 0.02, 0.01};
    if (inside) palpate_scene_locate(scene.get(), points, 2, 0.01, places);
  }

  // Runs both halves, and saves and restores the state now and then. Each touchable node is held at some time, so that each tensor
  // column is read.
  void run(int steps) {
    contact_steps = 0;
    palpate_pose pose = palpate_default_pose();
    pose.angular_velocity[2] = 0.05;
    palpate_scene_set_pose(scene.get(), &pose, nullptr);
    play(box, scene.get(), contacts, steps, [&](palpate_step_flags) {
      contact_steps += palpate_contacts_tool(contacts, 0)->contact_count > 0;
      palpate_scene_deform(scene.get());
      palpate_scene_shape(scene.get(), contacts.get(), &out);
      skin.report = palpate_scene_report(scene.get());
      if (skinned) palpate_scene_skin(scene.get(), &out, &skin);
      if (inside) look_inside();
      if (queries) ask();
      if (links) tighten();
      device.step(device.force, palpate_contacts_tool(contacts, 0)->force_raw, contacts->step);
      if (contacts->step % 50 != 20) return;
      restored += palpate_scene_save(scene.get(), state.data(), 8 * state.size(), nullptr) == PALPATE_OK &&
                  palpate_scene_restore(scene.get(), state.data(), 8 * state.size(), nullptr) == PALPATE_OK;
    });
    for (const std::int32_t node : box.touchable) {
      const palpate_grip grip = grip_at_node(node, {0.001, 0, 0});
      palpate_tool tool = grip_tool(&grip);
      palpate_grasp grasp = palpate_default_grasp();
      grasp.triangle = box.far_triangle(2), grasp.barycentric[0] = 1, grasp.radius = 0.006;
      grasp.position[0] = 1e-4 * node, grasp.friction = 0.1, grasp.clamp_force = 1;
      tool.parts = grasps ? &grasp.part : nullptr;
      palpate_scene_touch(scene.get(), &tool, 1, 1e-3, contacts.get(), contacts.bytes());
      if (grasps) slips += palpate_scene_grasp_state(scene.get(), 0)->condition == PALPATE_GRASP_SLIPS;
      palpate_scene_shape(scene.get(), contacts.get(), &out);
    }
  }

  // A thread that becomes shorter in each step, one that is slack, a clip and a spring to the world.
  void tighten() {
    palpate_link all[4];
    for (int i = 0; i < 4; ++i) {
      palpate_link& link = all[i] = palpate_default_link();
      link.kind = i < 2 ? PALPATE_LINK_THREAD : i == 2 ? PALPATE_LINK_CLIP : PALPATE_LINK_SPRING;
      for (int e = 0; e < 2; ++e) {
        link.ends[e].kind = PALPATE_END_SURFACE_POINT, link.ends[e].triangle = box.far_triangle(3 * i + 2 * e);
        link.ends[e].barycentric[0] = 1;
      }
      if (i == 3) link.ends[1].kind = PALPATE_END_WORLD, link.ends[1].point[0] = 0.07, link.stiffness = 1;
      link.radius = patch ? 0.003 : 0;
    }
    all[0].rest_length = 0.01 / (1 + 0.01 * static_cast<double>(contacts->step)), all[1].rest_length = 1;
    palpate_scene_set_links(scene.get(), all, 4, nullptr);
    taut += palpate_scene_link_state(scene.get(), 0)->condition == PALPATE_LINK_TAUT;
  }

  void look_inside() {
    palpate_scene_inside(scene.get(), &out, &strained);
    palpate_inside_out at = strained;
    at.capacity = 2;
    float moved_places[6];
    looked += palpate_scene_inside_at(scene.get(), places, 2, &at) == 0 && at.count == 2 &&
              palpate_scene_carry(scene.get(), &out, places, 2, moved_places) == 0;
  }

  void ask() {
    const double place[3] = {0.08, 0.03, 0.05}, along[3] = {-1, 0, -0.3};
    palpate_surface_hit hit = palpate_default_surface_hit();
    double distance = 0;
    const palpate_contacts* surfaces[2] = {nullptr, contacts.get()};
    for (const palpate_contacts* of : surfaces) {
      palpate_scene_cast_ray(scene.get(), of, place, along, INFINITY, &hit);
      palpate_scene_closest_point(scene.get(), of, place, INFINITY, &hit);
      palpate_scene_signed_distance(scene.get(), of, place, &distance);
    }
    palpate_shape_out drawn = out;
    drawn.positions = out.displacements;  // any finite places
    palpate_scene_normals(scene.get(), &drawn, normals.data(), out.node_count);
    answered += hit.hit && distance > 0;
  }

  ScenePointer scene;
  Contacts contacts;
  std::vector<float> u, normals = u;
  palpate_shape_out out;
  bool skinned, queries = false, links = false, grasps = false, inside = false, patch = false;
  std::vector<float> x = u, principal = u,
                     tensors[2] = {std::vector<float>(2 * u.size()), std::vector<float>(2 * u.size())},
                     measures[2] = {u, u};
  palpate_inside_out strained = palpate_default_inside_out();
  palpate_inside_place places[2];
  int looked = 0;
  int taut = 0, slips = 0;
  int answered = 0;
  float moved[2][3 * kVertices];
  palpate_skin_out skin = skin_out(moved[0], moved[1], kVertices);
  GuardedDevice device;
  const TouchedBox& box;
  std::vector<std::uint64_t> state = std::vector<std::uint64_t>(500'000);
  int contact_steps = 0, restored = 0;
};

TEST(Step, AllocatesAndLocksNothing) {
  if (!kCounts) GTEST_SKIP() << "a sanitizer's malloc is not counted";
  const FileBox rows, blocks(true);
  for (const FileBox* file : {&rows, &blocks})
    for (const SceneDef& def : every_effect()) {
      Running running(*file, def);
      allocations = locks = 0;
      counting = true;
      running.run(kSteps);
      counting = false;
      EXPECT_EQ(allocations, 0);
      EXPECT_EQ(locks, 0);
      EXPECT_TRUE(def.collision == PALPATE_COLLISION_OFF || running.contact_steps > kSteps / 50);
      EXPECT_TRUE(def.queries.queries == PALPATE_QUERIES_OFF || running.answered == kSteps);
      EXPECT_TRUE(def.inside.inside == PALPATE_INSIDE_OFF || running.looked == kSteps);
      EXPECT_TRUE(def.links.max_links == 0 || running.taut > kSteps / 10);
      EXPECT_TRUE(def.grasps.grasps == 0 || running.slips > 0);
      EXPECT_EQ(running.restored, kSteps / 50);
    }
  allocations = locks = 0;
  pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
  counting = true;
  std::free(std::malloc(1));
  pthread_mutex_lock(&mutex);
  counting = false;
  pthread_mutex_unlock(&mutex);
  EXPECT_EQ(allocations, 2) << "the counter does not count";
  EXPECT_EQ(locks, 1) << "the counter does not count";
}

// From here on this process may only end: any other system call ends it with the call's number (of all but the largest,
// which come back as 255).
void forbid_system_calls() {
  struct sigaction action = {};
  action.sa_flags = SA_SIGINFO;
  action.sa_sigaction = [](int, siginfo_t* info, void*) { _exit(info->si_syscall < 255 ? info->si_syscall : 255); };
  sigaction(SIGSYS, &action, nullptr);
  sock_filter filter[] = {
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_exit_group, 0, 1),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_TRAP),
  };
  const sock_fprog program = {std::size(filter), filter};
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 || prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) != 0)
    _exit(254);
}

// The exit code of a child process that ran `work` under that rule; 0: it made no system call.
template <class Work>
int in_child_without_system_calls(const Work& work) {
  const pid_t child = fork();
  if (child == 0) {
    forbid_system_calls();
    work();
    _exit(0);
  }
  int status = 0;
  EXPECT_EQ(waitpid(child, &status, 0), child);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
}

TEST(Step, MakesNoSystemCall) {
  if (!kCounts) GTEST_SKIP() << "a sanitizer makes system calls of its own";
  if (in_child_without_system_calls([] {}) == 254) GTEST_SKIP() << "this system has no seccomp filters";
  EXPECT_EQ(in_child_without_system_calls([] { getppid(); }), SYS_getppid) << "the filter does not filter";
  const FileBox rows, blocks(true);
  for (const FileBox* file : {&rows, &blocks})
    for (const SceneDef& def : every_effect()) {
      Running running(*file, def);
      EXPECT_EQ(in_child_without_system_calls([&] { running.run(kSteps); }), 0)
          << "collision " << def.collision << ", contact " << def.contact;
    }
}

long page_faults() {
  rusage usage = {};
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_minflt + usage.ru_majflt;
}

TEST(Step, TakesNoPageFaultOncePrefaulted) {
  if (!kCounts) GTEST_SKIP() << "a sanitizer's shadow takes page faults of its own";
  FileBox file, copied(false, PALPATE_FILE_COPY);
  for (const SceneDef& def : every_effect()) {
    // The system may move a page at any time, but hardly in three runs: one run of three without page faults is enough.
    long least = 1000;
    for (int attempt = 0; attempt < 3 && least > 0; ++attempt) {
      file.open();
      Running running(file, def);
      palpate_error error = {};
      EXPECT_EQ(palpate_bundle_prefault(file.bundle.get(), 0, &error), PALPATE_OK) << error.text;
      running.run(0);  // the caller's own pages: stack, arrays, code
      play(file.box, running.scene.get(), running.contacts, 100, [](palpate_step_flags) {});
      const long before = page_faults();
      running.run(kSteps);
      least = std::min(least, page_faults() - before);
    }
    EXPECT_EQ(least, 0) << "collision " << def.collision << ", contact " << def.contact;
  }
  copied.open();
  Running warm(copied, SceneDef());
  warm.run(0);
  play(copied.box, warm.scene.get(), warm.contacts, 100, [](palpate_step_flags) {});
  long before = page_faults();
  warm.run(kSteps);
  EXPECT_EQ(page_faults() - before, 0) << "a copy is in memory without prefault";
  file.open();
  Running cold(file, SceneDef());
  before = page_faults();
  cold.run(0);
  EXPECT_GT(page_faults() - before, 0) << "without prefault the first steps bring the pages in, and this would show it";
}

std::uint64_t locked_bytes() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.rfind("VmLck:", 0) == 0) return 1024 * std::stoull(line.substr(6));
  return 0;
}

TEST(Prefault, LocksWhatIsMappedUntilTheBundleIsClosed) {
  FileBox file;
  palpate_error error = {};
  EXPECT_EQ(palpate_bundle_prefault(nullptr, 1, &error), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(palpate_bundle_prefault(file.bundle.get(), 0, &error), PALPATE_OK) << "no section is mapped yet";
  const std::uint64_t before = locked_bytes();
  {
    Running running(file, SceneDef());
    const palpate_status status = palpate_bundle_prefault(file.bundle.get(), 1, &error);
    if (status == PALPATE_ERROR_LOCK) GTEST_SKIP() << error.text;
    ASSERT_EQ(status, PALPATE_OK) << error.text;
    const std::size_t tensors = 36 * file.box.touchable.size() * static_cast<std::size_t>(file.box.body.surface_nodes);
    EXPECT_GE(locked_bytes() - before, tensors);
  }
  file.open();
  EXPECT_EQ(locked_bytes(), before);
  EXPECT_EQ(palpate_bundle_prefault(file.box.bundle(), 1, &error), PALPATE_OK) << "the host's bytes are left alone";
}

TEST(Prefault, SaysWhenTheSystemDoesNotLockAndTheSceneWorksOn) {
  const FileBox file;
  Running running(file, SceneDef());
  const pid_t child = fork();
  if (child == 0) {  // nobody, who may lock nothing
    const rlimit none = {0, 0};
    if (setrlimit(RLIMIT_MEMLOCK, &none) != 0 || (geteuid() == 0 && setuid(65534) != 0)) _exit(9);
    palpate_error error = {};
    if (palpate_bundle_prefault(file.bundle.get(), 1, &error) != PALPATE_ERROR_LOCK) _exit(1);
    if (error.status != PALPATE_ERROR_LOCK || !std::strstr(error.text, "RLIMIT_MEMLOCK")) _exit(2);
    if (palpate_bundle_prefault(file.bundle.get(), 0, &error) != PALPATE_OK) _exit(3);
    running.run(200);
    _exit(running.contact_steps > 0 ? 0 : 4);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace palpate::tests
