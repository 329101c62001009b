// What effects cost in a scene that leaves them off. Compares steps of the runtime with steps of a build without any effect
// that can be off, in turns in one process.
//
//   effects_off_bench BUNDLE.h5 [rounds]
#include <dlfcn.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "runtime/include/palpate/palpate_complete.h"
#include "studies/timing/timing.h"

namespace {

// One build of the runtime. Both builds export the same names, so each is loaded as a module of its own.
struct Runtime {
  explicit Runtime(const std::string& file) : library(dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL)) {
    if (!library) {
      std::fprintf(stderr, "effects_off_bench: %s\n", dlerror());
      std::exit(2);
    }
#define PALPATE_LOAD(name) name = reinterpret_cast<decltype(name)>(dlsym(library, "palpate_" #name))
    PALPATE_LOAD(bundle_open_file);
    PALPATE_LOAD(bundle_fill_info);
    PALPATE_LOAD(bundle_touchable);
    PALPATE_LOAD(bundle_nodes);
    PALPATE_LOAD(bundle_triangles);
    PALPATE_LOAD(init_scene_def);
    PALPATE_LOAD(init_grip);
    PALPATE_LOAD(init_tool);
    PALPATE_LOAD(init_shape_out);
    PALPATE_LOAD(scene_create);
    PALPATE_LOAD(contacts_bytes);
    PALPATE_LOAD(scene_touch);
    PALPATE_LOAD(scene_shape);
#undef PALPATE_LOAD
  }
  void* library;
  decltype(&palpate_bundle_open_file) bundle_open_file;
  decltype(&palpate_bundle_fill_info) bundle_fill_info;
  decltype(&palpate_bundle_touchable) bundle_touchable;
  decltype(&palpate_bundle_nodes) bundle_nodes;
  decltype(&palpate_bundle_triangles) bundle_triangles;
  decltype(&palpate_init_scene_def) init_scene_def;
  decltype(&palpate_init_grip) init_grip;
  decltype(&palpate_init_tool) init_tool;
  decltype(&palpate_init_shape_out) init_shape_out;
  decltype(&palpate_scene_create) scene_create;
  decltype(&palpate_contacts_bytes) contacts_bytes;
  decltype(&palpate_scene_touch) scene_touch;
  decltype(&palpate_scene_shape) scene_shape;
};

// One scene with every possible effect off, and its output. Grips hold nodes, and a tool point goes in and out.
class Played {
 public:
  Played(const Runtime& runtime, const char* file, int grips) : runtime_(runtime) {
    palpate_error error = {};
    palpate_bundle* bundle = nullptr;
    if (runtime.bundle_open_file(file, nullptr, &bundle, &error) != PALPATE_OK) fail(error);
    palpate_scene_def def = {};
    runtime.init_scene_def(&def, sizeof def);
    def.contact = PALPATE_CONTACT_POINT;
    def.force_limit = def.force_slew = 1e300, def.max_points = 256, def.max_contact_nodes = 600;
    if (runtime.scene_create(bundle, &def, &scene_, &error) != PALPATE_OK) fail(error);
    memory_.resize(runtime.contacts_bytes(scene_) / 8 + 1);
    palpate_bundle_info info;
    runtime.bundle_fill_info(bundle, &info, sizeof info);
    u_.resize(3 * static_cast<std::size_t>(info.surface_node_count));
    const std::int32_t* touchable = runtime.bundle_touchable(bundle);
    for (int g = 0; g < grips; ++g) {
      palpate_grip grip;
      runtime.init_grip(&grip, sizeof grip);
      grip.kind = PALPATE_GRIP_NODE;
      grip.node = touchable[static_cast<std::int64_t>(g) * info.touchable_count / grips];
      grip.displacement[2] = 1e-3;
      grips_.push_back(grip);
    }
    // The tool point moves along the normal of a triangle in the middle of the list.
    const std::int32_t* t = runtime.bundle_triangles(bundle) + 3 * (info.triangle_count / 2);
    const double* n = runtime.bundle_nodes(bundle);
    double a[3], b[3];
    for (int d = 0; d < 3; ++d) {
      place_[d] = (n[3 * t[0] + d] + n[3 * t[1] + d] + n[3 * t[2] + d]) / 3;
      a[d] = n[3 * t[1] + d] - n[3 * t[0] + d], b[d] = n[3 * t[2] + d] - n[3 * t[0] + d];
    }
    for (int d = 0; d < 3; ++d) out_[d] = a[(d + 1) % 3] * b[(d + 2) % 3] - a[(d + 2) % 3] * b[(d + 1) % 3];
    double length = 0;
    for (const double x : out_) length += x * x;
    for (double& x : out_) x /= __builtin_sqrt(length);
  }

  void touch() {
    const double height = 1e-3 - 1e-5 * std::abs(step_++ % 800 - 400);
    double point[3];
    for (int d = 0; d < 3; ++d) point[d] = place_[d] + height * out_[d];
    grips_[0].displacement[0] += 1e-9;
    palpate_tool tool;
    runtime_.init_tool(&tool, sizeof tool);
    tool.points = point, tool.point_count = 1;
    tool.grips = grips_.data(), tool.grip_count = static_cast<std::int32_t>(grips_.size());
    runtime_.scene_touch(scene_, &tool, 1, 1e-3, contacts(), memory_.size() * sizeof memory_[0]);
  }
  void shape() {
    palpate_shape_out out;
    runtime_.init_shape_out(&out, sizeof out);
    out.displacements = u_.data(), out.node_capacity = static_cast<std::int32_t>(u_.size() / 3);
    runtime_.scene_shape(scene_, contacts(), &out);
  }
  palpate_contacts* contacts() { return reinterpret_cast<palpate_contacts*>(memory_.data()); }
  bool operator==(Played& other) {
    return u_ == other.u_ && contacts()->used_bytes == other.contacts()->used_bytes &&
           std::equal(memory_.begin(), memory_.begin() + contacts()->used_bytes / 8, other.memory_.begin());
  }

 private:
  [[noreturn]] static void fail(const palpate_error& error) {
    std::fprintf(stderr, "effects_off_bench: %s\n", error.text);
    std::exit(2);
  }
  const Runtime& runtime_;
  palpate_scene* scene_ = nullptr;
  std::vector<std::uint64_t> memory_;
  std::vector<float> u_;
  std::vector<palpate_grip> grips_;
  double place_[3], out_[3];
  int step_ = 0;
};

double median(const std::vector<double>& values) {
  return palpate::studies::percentile(values, 0.5);
}

template <class Step>
double seconds(int steps, const Step& step) {
  const auto start = palpate::studies::Clock::now();
  for (int s = 0; s < steps; ++s) step();
  return palpate::studies::seconds_since(start);
}

// Two scenes, one of each build. The address of a scene's memory changes its time by some per cent, so there are many pairs,
// and the two builds take turns in being created first.
struct Pair {
  Pair(const Runtime& whole_build, const Runtime& without_build, const char* file, int grips, bool whole_first) {
    if (whole_first) whole = std::make_unique<Played>(whole_build, file, grips);
    without = std::make_unique<Played>(without_build, file, grips);
    if (!whole) whole = std::make_unique<Played>(whole_build, file, grips);
  }
  std::unique_ptr<Played> whole, without;
};

// Median over the rounds of (time of the full runtime / time of the build without effects). In each round both are timed; they
// take turns in going first.
template <class Step>
void compare(const char* name, std::vector<Pair>& pairs, int rounds, int steps, const Step& step) {
  std::vector<double> ratio, time;
  for (int r = 0; r < rounds; ++r) {
    const Pair& pair = pairs[static_cast<std::size_t>(r) % pairs.size()];
    double a = 0, b = 0;
    const auto first = [&] { a = seconds(steps, [&] { step(*pair.whole); }); };
    const auto second = [&] { b = seconds(steps, [&] { step(*pair.without); }); };
    if (r / pairs.size() % 2)
      first(), second();
    else
      second(), first();
    ratio.push_back(a / b), time.push_back(b / steps);
  }
  std::printf("%-6s %8.3f us without, as it is over that %.4f\n", name, 1e6 * median(time), median(ratio));
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: effects_off_bench BUNDLE.h5 [rounds]\n");
    return 2;
  }
  const int rounds = argc > 2 ? std::atoi(argv[2]) : 4001;
  const Runtime whole(PALPATE_WHOLE), without(PALPATE_WITHOUT);
  for (const int grips : {1, 4, 30}) {
    std::vector<Pair> pairs;
    for (int p = 0; p < 40; ++p) pairs.emplace_back(whole, without, argv[1], grips, p % 2 == 0);
    std::printf("%d contacts\n", grips + 1);
    compare("touch", pairs, rounds, grips > 10 ? 30 : 200, [](Played& p) { p.touch(); });
    compare("shape", pairs, rounds, grips > 10 ? 10 : 50, [](Played& p) { p.shape(); });
    for (Pair& pair : pairs)
      if (!(*pair.whole == *pair.without)) {
        std::fprintf(stderr, "effects_off_bench: the two builds give other numbers\n");
        return 3;
      }
  }
}
