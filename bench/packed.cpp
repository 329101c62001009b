// Compares packed bundles with the f32 bundle that they were made from: bytes, stated error, and the times of touch and shape as
// ratios. The bundles take turns in every round, and each round has nodes of its own. Contacts are nodes beside one another, as below one
// tool, or nodes scattered over the whole organ, which share no block. Every page of the bundles is read once before, so that no time
// has a page fault in it: those of large bundles would hide what a shape costs.
//
//   packed_bench F32.h5 PACKED.h5 ...
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "runtime/base/vec3.h"
#include "runtime/bundle/bundle.h"
#include "runtime/include/palpate/palpate.h"

namespace {

constexpr int kContacts[] = {1, 3, 10, 30};
constexpr int kRounds = 150;
enum class Contacts { together, scattered };

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double median(std::vector<double> times) {
  std::nth_element(times.begin(), times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2), times.end());
  return times[times.size() / 2];
}

// One bundle with a scene of grips. Each turn grips other nodes, so that no column stays in the cache.
class Bench {
 public:
  explicit Bench(const char* file) : file_(file) {
    palpate_error error = {};
    palpate_scene_def def = palpate_default_scene_def();
    def.collision = PALPATE_COLLISION_OFF;
    def.force_limit = def.force_slew = 1e300;
    if (palpate_bundle_open_file(file, nullptr, &bundle_, &error) != PALPATE_OK ||
        palpate_scene_create(bundle_, &def, &scene_, &error) != PALPATE_OK) {
      std::fprintf(stderr, "packed_bench: %s: %s\n", file, error.text);
      std::exit(2);
    }
    for (const palpate::FileMap& map : bundle_->maps)
      for (std::size_t page = 0; page < map.bytes; page += 4096) read_ += map.data[page];
    contacts_.resize(palpate_contacts_bytes(scene_) / 8 + 1);
    u_.resize(3 * static_cast<std::size_t>(palpate_bundle_describe(bundle_).surface_node_count));
  }
  Bench(const Bench&) = delete;
  ~Bench() {
    palpate_scene_destroy(scene_);
    palpate_bundle_close(bundle_);
  }

  // Seconds of one touch with new nodes, and of its shape.
  void step(Contacts where, int contacts, int turn, double* touch, double* shape) {
    const std::vector<std::int32_t> nodes =
        where == Contacts::together ? together(contacts, turn) : scattered(contacts, turn);
    std::vector<palpate_grip> grips(nodes.size(), palpate_default_grip());
    for (std::size_t g = 0; g < grips.size(); ++g) {
      grips[g].kind = PALPATE_GRIP_NODE, grips[g].node = nodes[g];
      grips[g].displacement[2] = 1e-3 + 1e-5 * static_cast<double>(g);
    }
    palpate_tool tool = palpate_default_tool();
    tool.grips = grips.data(), tool.grip_count = static_cast<std::int32_t>(grips.size());
    auto* made = reinterpret_cast<palpate_contacts*>(contacts_.data());
    auto start = std::chrono::steady_clock::now();
    palpate_scene_touch(scene_, &tool, 1, 1e-3, made, contacts_.size() * sizeof contacts_[0]);
    *touch = seconds_since(start);
    palpate_shape_out out = palpate_default_shape_out();
    out.displacements = u_.data(), out.node_capacity = static_cast<std::int32_t>(u_.size() / 3);
    start = std::chrono::steady_clock::now();
    palpate_scene_shape(scene_, made, &out);
    *shape = seconds_since(start);
  }

  std::vector<std::int32_t> scattered(int contacts, int turn) const {
    const std::int64_t count = palpate_bundle_describe(bundle_).touchable_count;
    std::vector<std::int32_t> nodes;
    for (std::int64_t g = 0; g < contacts; ++g)
      nodes.push_back(palpate_bundle_touchable(bundle_)[(g * count / contacts + 7 * turn) % count]);
    return nodes;
  }
  // The touchable nodes nearest to one, which is another one in every turn.
  std::vector<std::int32_t> together(int contacts, int turn) const {
    const std::int64_t count = palpate_bundle_describe(bundle_).touchable_count;
    const std::int32_t* touchable = palpate_bundle_touchable(bundle_);
    const double* nodes = palpate_bundle_nodes(bundle_);
    const palpate::Vec3 middle = palpate::load3(nodes + 3 * touchable[turn * count / kRounds]);
    std::vector<std::int32_t> nearest(touchable, touchable + count);
    std::partial_sort(nearest.begin(), nearest.begin() + contacts, nearest.end(), [&](std::int32_t a, std::int32_t b) {
      return length(palpate::load3(nodes + 3 * a) - middle) < length(palpate::load3(nodes + 3 * b) - middle);
    });
    nearest.resize(static_cast<std::size_t>(contacts));
    return nearest;
  }

  // A number of the provenance; 0 if it is missing.
  double stated(const std::string& key) const {
    palpate_error ignored;
    const auto* entry = palpate::formats::find_section(bundle_->index, palpate::formats::SectionId::provenance);
    const char* text = palpate::section_as<char>(bundle_, palpate::formats::SectionId::provenance, &ignored);
    const std::string json(text, entry->bytes);
    const std::size_t at = json.find("\"" + key + "\":");
    return at == std::string::npos ? 0 : std::atof(json.c_str() + at + key.size() + 3);
  }
  double megabytes() const { return 1e-6 * static_cast<double>(bundle_->index.header.file_bytes); }
  const char* name() const {
    const char* folder = std::strrchr(file_, '/');
    return folder ? folder + 1 : file_;
  }

 private:
  const char* file_;
  palpate_bundle* bundle_ = nullptr;
  palpate_scene* scene_ = nullptr;
  std::vector<std::uint64_t> contacts_;
  std::vector<float> u_;
  unsigned read_ = 0;  // sum over the pages; without a use the compiler would leave out their reading
};

// Medians in us of every bundle for a number of contacts.
struct Times {
  std::vector<double> touch, shape;
};
Times measure(const std::vector<std::unique_ptr<Bench>>& benches, Contacts where, int contacts) {
  std::vector<std::vector<double>> touches(benches.size()), shapes(benches.size());
  for (int round = 0; round < kRounds; ++round)
    for (std::size_t b = 0; b < benches.size(); ++b) {
      double touch_seconds = 0, shape_seconds = 0;
      benches[b]->step(where, contacts, round, &touch_seconds, &shape_seconds);
      touches[b].push_back(1e6 * touch_seconds), shapes[b].push_back(1e6 * shape_seconds);
    }
  Times times;
  for (const auto& all : touches) times.touch.push_back(median(all));
  for (const auto& all : shapes) times.shape.push_back(median(all));
  return times;
}

void print(const std::vector<std::unique_ptr<Bench>>& benches, Contacts where) {
  std::printf("\n%-24s", where == Contacts::together ? "beside one another" : "scattered");
  std::vector<Times> columns;
  for (const int contacts : kContacts) {
    std::printf("   touch %-2d     shape %-2d   ", contacts, contacts);
    columns.push_back(measure(benches, where, contacts));
  }
  std::printf("   (us; ratio to the first)\n");
  for (std::size_t b = 0; b < benches.size(); ++b) {
    std::printf("%-24s", benches[b]->name());
    for (const Times& times : columns)
      std::printf(" %6.1f %5.2f %6.0f %5.2f", times.touch[b], times.touch[b] / times.touch[0], times.shape[b],
                  times.shape[b] / times.shape[0]);
    std::printf("\n");
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: packed_bench F32.h5 PACKED.h5 ...\n");
    return 2;
  }
  std::vector<std::unique_ptr<Bench>> benches;
  for (int i = 1; i < argc; ++i) benches.push_back(std::make_unique<Bench>(argv[i]));
  std::printf("%-24s %9s %9s %9s\n", "", "MB", "worst", "rms");
  for (const auto& bench : benches)
    std::printf("%-24s %9.1f %9.2g %9.2g\n", bench->name(), bench->megabytes(), bench->stated("pack_error_worst"),
                bench->stated("pack_error_rms"));
  for (const Contacts where : {Contacts::together, Contacts::scattered}) print(benches, where);
  return 0;
}
