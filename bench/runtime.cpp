// Time of touch and shape on a given bundle for 1 to 100 contact nodes, and of queries. The time of shape is also
// given relative to a plain read of the same bytes from memory in the same run.
//
//   runtime_bench BUNDLE.h5 [--operations=N] [Google Benchmark options]    N: max_operations of the scenes, in place of the default
//   runtime_bench BUNDLE.h5 --worst-steps[=1000000]      instead: the worst steps of hostile scenes (worst_step.h)
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <string>
#include <vector>

#include <palpate/palpate.hpp>
#include "bench/worst_step.h"
#include "runtime/base/vec3.h"
#include "runtime/bundle/bundle.h"
#include "studies/timing/timing.h"

namespace {

using palpate::studies::Clock, palpate::studies::percentile, palpate::studies::seconds_since;

palpate::Bundle bundle;
std::int32_t most_operations = 0;  // 0: the default

palpate::Scene make_scene(palpate::SceneDef def) {
  palpate_error error = {};
  def.force_limit = def.force_slew = 1e300;
  def.max_points = std::max(def.max_points, 128);  // grips count as points, and the default is 64
  if (most_operations > 0) def.max_operations = most_operations;
  palpate::Scene scene = palpate::Scene::create(bundle, def, &error);
  if (scene) return scene;
  std::fprintf(stderr, "runtime_bench: %s\n", error.text);
  std::exit(2);
}

// `count` grips spread over the touchable nodes. Another `turn` grips other nodes, so that no column stays in the cache.
std::vector<palpate_grip> grips(int count, int turn) {
  const palpate_bundle_info info = bundle.describe();
  const std::int32_t* touchable = bundle.touchable();
  std::vector<palpate_grip> list(static_cast<std::size_t>(count));
  for (int g = 0; g < count; ++g) {
    list[g] = palpate_default_grip();
    const std::int64_t at =
        (static_cast<std::int64_t>(g) * info.touchable_count / count + 37 * turn) % info.touchable_count;
    list[g].kind = PALPATE_GRIP_NODE, list[g].node = touchable[at];
    list[g].displacement[2] = 1e-3 + 1e-5 * g;
  }
  return list;
}

double median(const std::vector<double>& values) {
  return percentile(values, 0.5);
}

palpate_tool holding(const std::vector<palpate_grip>& grips) {
  palpate_tool tool = palpate_default_tool();
  tool.grips = grips.data(), tool.grip_count = static_cast<std::int32_t>(grips.size());
  return tool;
}

// The share of the steps that put work off: they did less than they were asked.
class Deferred {
 public:
  void count(palpate_step_flags flags) { ++steps_, deferred_ += (flags & PALPATE_STEP_WORK_DEFERRED) != 0; }
  void tell(benchmark::State& state) const { state.counters["deferred"] = steps_ > 0 ? deferred_ / steps_ : 0; }

 private:
  double steps_ = 0, deferred_ = 0;
};

void spread(benchmark::internal::Benchmark* b) {
  for (const int count : {1, 2, 4, 10, 30, 60, 100}) b->Arg(count);
}

// A scene without collision, and what a touch with grips writes.
class Gripped {
 public:
  explicit Gripped(palpate::SceneDef def = palpate::SceneDef()) : scene_(make_scene(free(def))) {}
  palpate_step_flags touch(const palpate_tool& tool) { return scene_.touch(&tool, 1, 1e-3, contacts_); }
  palpate_step_flags shape(palpate_shape_out& out) { return scene_.shape(contacts_, out); }

 private:
  static palpate::SceneDef free(palpate::SceneDef def) {
    def.collision = PALPATE_COLLISION_OFF;
    return def;
  }
  palpate::Scene scene_;
  palpate::Contacts contacts_ = scene_.make_contacts();
};

// The same state.range(0) nodes are held in every step, as by a tool in contact, so that the runtime keeps its factor.
void touch_held(benchmark::State& state) {
  Gripped gripped;
  auto list = grips(static_cast<int>(state.range(0)), 0);
  const palpate_tool tool = holding(list);
  Deferred deferred;
  for (auto _ : state) {
    list[0].displacement[0] += 1e-9;
    deferred.count(gripped.touch(tool));
  }
  deferred.tell(state);
}
BENCHMARK(touch_held)->Apply(spread)->Unit(benchmark::kMicrosecond);

// Other nodes in every step: the runtime reads and factors the contact matrix anew.
void touch_changing(benchmark::State& state) {
  Gripped gripped;
  std::vector<std::vector<palpate_grip>> lists;
  for (int turn = 0; turn < 50; ++turn) lists.push_back(grips(static_cast<int>(state.range(0)), turn));
  std::size_t turn = 0;
  Deferred deferred;
  for (auto _ : state) deferred.count(gripped.touch(holding(lists[turn++ % lists.size()])));
  deferred.tell(state);
}
BENCHMARK(touch_changing)->Apply(spread)->Unit(benchmark::kMicrosecond);

// Nodes beside one another, as below one tool, or scattered; others in each step. The touch, and as shape_us the shape after it, both
// medians: they compare the forms of a bundle.
void touch_and_shape(benchmark::State& state) {
  const bool scattered = state.range(0) != 0;
  const std::int32_t surface_nodes = bundle.describe().surface_node_count;
  const auto touchable = grips(bundle.describe().touchable_count, 0);
  const auto place = [](const palpate_grip& grip) { return palpate::load3(bundle.nodes() + 3 * grip.node); };
  Gripped gripped;
  palpate_bundle_prefault(bundle.get(), 0, nullptr);  // no time has a page fault in it
  std::vector<float> u(3 * static_cast<std::size_t>(surface_nodes));
  palpate_shape_out out = palpate_default_shape_out();
  out.displacements = u.data(), out.node_capacity = surface_nodes;
  std::vector<double> touches, shapes;
  for (auto _ : state) {
    const int count = static_cast<int>(state.range(1)), turn = static_cast<int>(touches.size());
    auto list = scattered ? grips(count, turn) : touchable;
    if (!scattered) {
      const auto middle = place(touchable[37u * static_cast<std::size_t>(turn) % touchable.size()]);
      std::partial_sort(list.begin(), list.begin() + count, list.end(),
                        [&](const palpate_grip& a, const palpate_grip& b) {
                          return length(place(a) - middle) < length(place(b) - middle);
                        });
      list.resize(static_cast<std::size_t>(count));
      for (int g = 0; g < count; ++g) list[g].displacement[2] = 1e-3 + 1e-5 * g;
    }
    const auto start = Clock::now();
    gripped.touch(holding(list));
    touches.push_back(seconds_since(start));
    const auto touched = Clock::now();
    benchmark::DoNotOptimize(gripped.shape(out));
    shapes.push_back(seconds_since(touched));
    state.SetIterationTime(touches.back() + shapes.back());
  }
  state.counters["touch_us"] = 1e6 * median(touches), state.counters["shape_us"] = 1e6 * median(shapes);
}
BENCHMARK(touch_and_shape)->ArgsProduct({{0, 1}, {1, 3, 10, 30}})->UseManualTime()->Unit(benchmark::kMicrosecond);

// A moving area contact: of `count` neighbouring nodes, three leave and three come in every step.
void touch_moving(benchmark::State& state) {
  palpate::SceneDef def;
  def.max_points = 400, def.max_contact_nodes = 400;
  Gripped gripped(def);
  const int count = static_cast<int>(state.range(0)), touchable = bundle.describe().touchable_count;
  std::vector<palpate_grip> window(static_cast<std::size_t>(count));
  int first = 0;
  Deferred deferred;
  for (auto _ : state) {
    for (int g = 0; g < count; ++g) {
      window[g] = palpate_default_grip();
      // Grip g keeps its node for count / 3 steps.
      const int turns = (first - g + 3 * touchable) / count;
      window[g].kind = PALPATE_GRIP_NODE;
      window[g].node = bundle.touchable()[(g + turns * count) % touchable];
      window[g].axes = 7, window[g].displacement[2] = 1e-3 + 1e-5 * g;
    }
    first += 3;
    const auto start = Clock::now();
    deferred.count(gripped.touch(holding(window)));
    state.SetIterationTime(seconds_since(start));
  }
  deferred.tell(state);
}
BENCHMARK(touch_moving)->Arg(4)->Arg(30)->Arg(100)->Arg(200)->UseManualTime()->Unit(benchmark::kMicrosecond);

// A point near the node inside one of its triangles, and the triangle's outward unit normal.
struct Place {
  double at[3], outward[3];
};
Place place_near(std::int32_t node) {
  const double* nodes = bundle.nodes();
  const std::int32_t* t = bundle.triangles();
  while (t[0] != node && t[1] != node && t[2] != node) t += 3;
  Place place = {};
  double length = 0;
  for (int d = 0; d < 3; ++d) {
    const int e = (d + 1) % 3, f = (d + 2) % 3;
    const double *a = nodes + 3 * t[0], *b = nodes + 3 * t[1], *c = nodes + 3 * t[2];
    place.at[d] = .1 * (a[d] + b[d] + c[d]) / 3 + .9 * nodes[3 * node + d];
    place.outward[d] = (b[e] - a[e]) * (c[f] - a[f]) - (b[f] - a[f]) * (c[e] - a[e]);
    length += place.outward[d] * place.outward[d];
  }
  for (double& x : place.outward) x /= std::sqrt(length);
  return place;
}

// Tool points that go in and out of the surface along its normal, each at its own node: collision, contact, force. The median is
// over the ticks in which most points are in contact.
void touch_colliding(benchmark::State& state) {
  palpate::SceneDef def;
  def.collision = static_cast<palpate_collision>(state.range(0));
  def.contact = PALPATE_CONTACT_NODE;
  palpate::Scene scene = make_scene(def);
  palpate::Contacts contacts = scene.make_contacts();
  std::vector<Place> places;
  for (const palpate_grip& grip : grips(static_cast<int>(state.range(1)), 0)) places.push_back(place_near(grip.node));
  std::vector<double> points(3 * places.size());
  std::vector<double> seconds;
  std::int64_t in_contact = 0;
  int step = 0;
  for (auto _ : state) {
    state.PauseTiming();
    const double height = 0.001 - 1e-5 * std::abs(step++ % 800 - 400);  // 1 mm above to 3 mm below, 10 mm/s
    for (std::size_t p = 0; p < places.size(); ++p)
      for (int d = 0; d < 3; ++d) points[3 * p + d] = places[p].at[d] + height * places[p].outward[d];
    palpate_tool tool = palpate_default_tool();
    tool.points = points.data(), tool.point_count = static_cast<std::int32_t>(places.size());
    state.ResumeTiming();
    const auto start = Clock::now();
    benchmark::DoNotOptimize(scene.touch(&tool, 1, 1e-3, contacts));
    const double spent = seconds_since(start);
    if (2 * contacts->node_count > state.range(1)) seconds.push_back(spent);
    in_contact += contacts->node_count;
  }
  state.counters["nodes"] = static_cast<double>(in_contact) / static_cast<double>(state.iterations());
  if (!seconds.empty()) state.counters["median_us"] = median(seconds) * 1e6;
}
void collide(benchmark::internal::Benchmark* b) {
  for (const int collision : {PALPATE_COLLISION_REST, PALPATE_COLLISION_DEFORMED})
    for (const int points : {1, 4, 30, 100}) b->Args({collision, points});
}
BENCHMARK(touch_colliding)->Apply(collide)->Unit(benchmark::kMicrosecond);

// The bundle's surface, each triangle halved twice along its edges, with bumps of 0.1 mm: 16 times the triangles.
struct FineSurface {
  std::vector<float> positions;
  std::vector<std::int32_t> triangles;
  palpate_fine_surface view = palpate_default_fine_surface();

  FineSurface() {
    const palpate_bundle_info info = bundle.describe();
    const double* nodes = bundle.nodes();
    std::vector<double> place(nodes, nodes + 3 * static_cast<std::size_t>(info.surface_node_count));
    triangles.assign(bundle.triangles(), bundle.triangles() + 3 * info.triangle_count);
    for (int round = 0; round < 2; ++round) halve(place);
    for (std::size_t i = 0; i < place.size(); ++i)
      positions.push_back(static_cast<float>(place[i] + 1e-4 * std::sin(7.3 * static_cast<double>(i / 3 + i % 3))));
    view.positions = positions.data(), view.vertex_count = static_cast<std::int32_t>(positions.size() / 3);
    view.triangles = triangles.data(), view.triangle_count = static_cast<std::int32_t>(triangles.size() / 3);
  }
  void halve(std::vector<double>& place) {
    std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> middle_of;
    const auto middle = [&](std::int32_t a, std::int32_t b) {
      const auto [found, fresh] = middle_of.emplace(std::minmax(a, b), static_cast<std::int32_t>(place.size() / 3));
      for (int d = 0; fresh && d < 3; ++d) place.push_back(0.5 * (place[3 * a + d] + place[3 * b + d]));
      return found->second;
    };
    std::vector<std::int32_t> finer;
    for (std::size_t t = 0; t < triangles.size(); t += 3) {
      const std::int32_t a = triangles[t], b = triangles[t + 1], c = triangles[t + 2], ab = middle(a, b),
                         bc = middle(b, c), ca = middle(c, a);
      for (const std::int32_t v : {a, ab, ca, b, bc, ab, c, ca, bc, ab, bc, ca}) finer.push_back(v);
    }
    triangles = finer;
  }
};

// Discs of 5 mm radius that are drawn over the deformed surface by 0.1 mm in a step, 3 mm deep, without friction: on the mesh's own
// triangles, and on a fine surface.
void touch_drawn(benchmark::State& state) {
  static const FineSurface fine;
  palpate::SceneDef def;
  def.collision = PALPATE_COLLISION_DEFORMED, def.law = PALPATE_LAW_UNILATERAL, def.max_contact_nodes = 1024;
  if (state.range(0) != 0) def.fine_surface = fine.view;
  palpate::Scene scene = make_scene(def);
  palpate::Contacts contacts = scene.make_contacts();
  std::vector<Place> places;
  for (const palpate_grip& grip : grips(static_cast<int>(state.range(1)), 0)) places.push_back(place_near(grip.node));
  std::vector<double> points(3 * places.size()), seconds;
  std::int64_t in_contact = 0;
  int step = 0;
  for (auto _ : state) {
    state.PauseTiming();
    const double height = std::max(-0.003, 0.002 - 1e-4 * step), turn = 0.02 * step;
    ++step;
    for (std::size_t p = 0; p < places.size(); ++p) {
      const double* n = places[p].outward;
      const double beside = 0.005 * std::sin(turn), along[3] = {n[1], -n[0], 0};
      for (int d = 0; d < 3; ++d) points[3 * p + d] = places[p].at[d] + height * n[d] + beside * along[d];
    }
    palpate_tool tool = palpate_default_tool();
    tool.points = points.data(), tool.point_count = static_cast<std::int32_t>(places.size()), tool.disc_radius = 0.005;
    state.ResumeTiming();
    const auto start = Clock::now();
    benchmark::DoNotOptimize(scene.touch(&tool, 1, 1e-3, contacts));
    const double spent = seconds_since(start);
    in_contact += contacts.tool(0).contact_count;
    if (contacts.tool(0).contact_count > 0) seconds.push_back(spent);
  }
  state.counters["contacts"] = static_cast<double>(in_contact) / static_cast<double>(state.iterations());
  if (seconds.empty()) return;
  state.counters["median_us"] = median(seconds) * 1e6;
  state.counters["us_99"] = percentile(seconds, 0.99) * 1e6;
}
BENCHMARK(touch_drawn)->ArgsProduct({{0, 1}, {1, 4, 16}})->Unit(benchmark::kMicrosecond);

// Reads every float once in a plain loop.
float read_run(const float* run, std::size_t count) {
  float sum[16] = {};
  for (std::size_t i = 0; i + 16 <= count; i += 16)
    for (int lane = 0; lane < 16; ++lane) sum[lane] += run[i + lane];
  return sum[0] + sum[7] + sum[15];
}

// Superposition, in turns with a plain read of the same columns. Before each of the two the contacts move to other nodes, so that
// the bytes are in the cache only if the whole store fits there.
void shape_against_read(benchmark::State& state) {
  palpate_error error = {};
  const auto id = palpate::formats::SectionId::displacement_surface;
  const auto* entry = palpate::formats::find_section(bundle.get()->index, id);
  if (!entry) return state.SkipWithError("compares with reading rows; touch_and_shape measures blocks");
  const float* rows = palpate::section_as<float>(bundle.get(), id, &error);
  const std::size_t per_node =
      entry->bytes / 4 / entry->shape[0];  // of a node's three columns, in words whatever their form
  palpate::SceneDef def;
  def.collision = PALPATE_COLLISION_OFF;
  palpate::Scene scene = make_scene(def);
  const std::int32_t nodes = bundle.describe().surface_node_count;
  std::vector<float> u(3 * static_cast<std::size_t>(nodes));
  palpate_shape_out out = palpate_default_shape_out();
  out.displacements = u.data(), out.node_capacity = nodes;
  // Enough turns that half of them read more than the caches hold, if the store is that large.
  const int turns = std::max(40, static_cast<int>(1000 / state.range(0)));
  std::vector<palpate::Contacts> contacts(static_cast<std::size_t>(turns), scene.make_contacts());
  for (int turn = 0; turn < turns; ++turn) {
    const auto list = grips(static_cast<int>(state.range(0)), turn);
    const palpate_tool tool = holding(list);
    scene.touch(&tool, 1, 1e-3, contacts[turn]);
  }
  std::vector<double> shape_seconds, read_seconds;
  int turn = 0;
  float sum = 0;
  for (auto _ : state) {
    auto start = Clock::now();
    benchmark::DoNotOptimize(scene.shape(contacts[turn], out));
    const double spent = seconds_since(start);
    shape_seconds.push_back(spent);
    state.SetIterationTime(spent);
    const palpate::Contacts& other = contacts[(turn + turns / 2) % turns];
    start = Clock::now();
    for (int e = 0; e < other->node_count; ++e)
      sum += read_run(rows + static_cast<std::size_t>(other.node(e).column) * per_node, per_node);
    read_seconds.push_back(seconds_since(start));
    turn = (turn + 1) % turns;
  }
  benchmark::DoNotOptimize(sum);
  // Medians, because on a shared machine the scheduler dominates the mean.
  const double shape = median(shape_seconds), read = median(read_seconds);
  state.counters["median_us"] = shape * 1e6;
  state.counters["GB_per_s"] = static_cast<double>(state.range(0)) * 4.0 * static_cast<double>(per_node) / shape * 1e-9;
  state.counters["time_over_read"] = shape / read;
}

BENCHMARK(shape_against_read)->Apply(spread)->UseManualTime()->Unit(benchmark::kMicrosecond);

// A call of palpate_scene_crossings, over the time of the shape that it checks. A check of the whole surface takes calls_a_check such calls.
void crossings_against_shape(benchmark::State& state) {
  palpate::SceneDef def;
  def.crossings.crossings = PALPATE_CROSSINGS_ON, def.crossings.crossings_calls = 1;
  palpate::Scene scene = make_scene(def);
  const palpate_bundle_info info = bundle.describe();
  palpate::Contacts contacts = scene.make_contacts();
  palpate_grip grip = palpate_default_grip();
  grip.kind = PALPATE_GRIP_NODE, grip.node = bundle.touchable()[info.touchable_count / 3];
  grip.displacement[2] = 0.003;
  palpate_tool tool = palpate_default_tool();
  tool.grips = &grip, tool.grip_count = 1;
  scene.touch(&tool, 1, 1e-3, contacts);
  std::vector<float> positions(3 * static_cast<std::size_t>(info.surface_node_count));
  palpate_shape_out shape = palpate_default_shape_out();
  shape.positions = positions.data(), shape.node_capacity = info.surface_node_count;
  palpate_crossings_out found = palpate_default_crossings_out();
  std::vector<double> call_seconds, shape_seconds;
  std::int64_t calls = 0;
  for (auto _ : state) {
    auto start = Clock::now();
    scene.shape(contacts, shape);
    shape_seconds.push_back(seconds_since(start));
    start = Clock::now();
    scene.crossings(shape, &found);
    call_seconds.push_back(seconds_since(start)), ++calls;
    state.SetIterationTime(call_seconds.back());
  }
  state.counters["median_us"] = median(call_seconds) * 1e6;
  state.counters["worst_us"] = *std::max_element(call_seconds.begin(), call_seconds.end()) * 1e6;
  state.counters["time_over_shape"] = median(call_seconds) / median(shape_seconds);
  state.counters["calls_a_check"] =
      static_cast<double>(calls) / static_cast<double>(std::max<std::uint64_t>(1, found.checks));
  state.counters["pairs"] = found.pairs;
}

BENCHMARK(crossings_against_shape)->UseManualTime()->Unit(benchmark::kMicrosecond);

// Rays, nearest points and signed distances at random places around the organ, half of them inside its box: at rest (0); under two
// pressed discs (1); under contacts that differ in every query (2).
enum class Query { ray, closest, distance };
template <Query kind>
void query(benchmark::State& state) {
  palpate::SceneDef def;
  def.queries.queries = PALPATE_QUERIES_ON;
  palpate::Scene scene = make_scene(def);
  const palpate_bundle_info info = bundle.describe();
  const double* node = bundle.nodes();
  double low[3], high[3];
  for (int d = 0; d < 3; ++d) low[d] = high[d] = node[d];
  for (std::int32_t n = 0; n < info.surface_node_count; ++n)
    for (int d = 0; d < 3; ++d)
      low[d] = std::min(low[d], node[3 * n + d]), high[d] = std::max(high[d], node[3 * n + d]);

  palpate_tool tools[2] = {palpate_default_tool(), palpate_default_tool()};
  std::vector<palpate::Contacts> contacts(2, scene.make_contacts());
  for (std::size_t c = 0; c < 2; ++c) {
    palpate_grip grip[2];
    for (int g = 0; g < 2; ++g) {
      const std::int32_t k = bundle.touchable()[info.touchable_count / 3 * (g + 1)];
      const std::int32_t* t = bundle.triangles();
      while (t[0] != k && t[1] != k && t[2] != k) t += 3;
      grip[g] = palpate_default_grip();
      grip[g].kind = PALPATE_GRIP_SURFACE_POINT;
      grip[g].triangle = static_cast<std::int32_t>((t - bundle.triangles()) / 3);
      grip[g].barycentric[0] = grip[g].barycentric[1] = 0.25, grip[g].barycentric[2] = 0.5;
      for (int d = 0; d < 3; ++d) grip[g].displacement[d] = 0.003 + 1e-5 * static_cast<double>(c);
      tools[g].grips = grip + g, tools[g].grip_count = 1, tools[g].disc_radius = 0.005;
    }
    scene.touch(tools, 2, 1e-3, contacts[c]);
  }

  std::uint32_t random = 1;
  const auto next = [&] { return (random = random * 1664525u + 1013904223u) / 4294967296.0; };
  palpate_surface_hit hit = palpate_default_surface_hit();
  double distance = 0;
  std::int64_t hits = 0, turn = 0;
  for (auto _ : state) {
    double p[3], along[3];
    for (int d = 0; d < 3; ++d) {
      p[d] = low[d] + (1.5 * next() - 0.25) * (high[d] - low[d]);
      along[d] = 0.5 * (low[d] + high[d]) + (next() - 0.5) * (high[d] - low[d]) - p[d];
    }
    const palpate_contacts* of = state.range(0) == 0 ? nullptr : contacts[state.range(0) == 2 ? turn++ % 2 : 0].get();
    if (kind == Query::ray) palpate_scene_cast_ray(scene.get(), of, p, along, INFINITY, &hit);
    if (kind == Query::closest) palpate_scene_closest_point(scene.get(), of, p, INFINITY, &hit);
    if (kind == Query::distance) palpate_scene_signed_distance(scene.get(), of, p, &distance);
    hits += hit.hit;
  }
  state.counters["hit"] = static_cast<double>(hits) / static_cast<double>(state.iterations());
}
BENCHMARK(query<Query::ray>)->Arg(0)->Arg(1)->Arg(2)->Unit(benchmark::kMicrosecond);
BENCHMARK(query<Query::closest>)->Arg(0)->Arg(1)->Arg(2)->Unit(benchmark::kMicrosecond);
BENCHMARK(query<Query::distance>)->Arg(0)->Arg(1)->Arg(2)->Unit(benchmark::kMicrosecond);

}  // namespace

int main(int argc, char** argv) {
  palpate_error error = {};
  if (argc < 2 || std::strncmp(argv[1], "--", 2) == 0) {
    std::fprintf(stderr,
                 "usage: runtime_bench BUNDLE.h5 [--worst-steps[=N] | [--operations=N] Google Benchmark options]\n");
    return 2;
  }
  bundle = palpate::Bundle::open_file(argv[1], &error);
  if (!bundle) {
    std::fprintf(stderr, "runtime_bench: %s: %s\n", argv[1], error.text);
    return 2;
  }
  argv[1] = argv[0];
  --argc, ++argv;
  const palpate_bundle_info info = bundle.describe();
  std::printf("%d nodes, %d on the surface, %d touchable\n", info.node_count, info.surface_node_count,
              info.touchable_count);
  constexpr std::size_t kOption = sizeof "--worst-steps" - 1;
  if (argc == 2 && std::strncmp(argv[1], "--worst-steps", kOption) == 0) {
    const long steps = argv[1][kOption] == '=' ? std::atol(argv[1] + kOption + 1) : 1000000;
    if (steps < 1) return std::fprintf(stderr, "runtime_bench: expected --worst-steps=N with N of 1 or more\n"), 2;
    report_worst_steps(bundle.get(), steps);
    return 0;
  }
  if (argc > 1 && std::strncmp(argv[1], "--operations=", 13) == 0) {
    most_operations = std::atoi(argv[1] + 13);
    if (most_operations < 1)
      return std::fprintf(stderr, "runtime_bench: expected --operations=N with N of 1 or more\n"), 2;
    argv[1] = argv[0];
    --argc, ++argv;
  }
  benchmark::AddCustomContext("vertices", std::to_string(info.node_count));
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
