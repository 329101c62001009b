// inside_bench BUNDLE.h5: what strain and stress inside cost, in bytes and in time, against the shape that they follow from. The bundle
// has the displacement of its interior nodes (`interior = true` in the boundary file). inside_bench BUNDLE.h5 OTHER.h5: how far the measures
// under a press differ between two bundles of one organ, such as one of f32 rows and one of f16 rows.
#include <palpate/palpate.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <vector>

namespace {

constexpr int kRounds = 200;
constexpr std::int32_t kPoints = 10'000;

// Median time of a call, us.
template <class Call>
double time_of(Call call) {
  std::vector<double> us;
  for (int i = 0; i < kRounds; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    call();
    us.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count());
  }
  std::nth_element(us.begin(), us.begin() + kRounds / 2, us.end());
  return us[kRounds / 2];
}

int fail(const palpate_error& error) {
  std::fprintf(stderr, "inside_bench: %s\n", error.text);
  return 2;
}

// Places strewn over the box of the nodes, those within the organ alone.
std::vector<palpate_inside_place> places_in(const palpate_scene* scene, const palpate_bundle* bundle,
                                            double* locate_us) {
  const palpate_bundle_info info = palpate_bundle_describe(bundle);
  const double* nodes = palpate_bundle_nodes(bundle);
  double low[3], high[3];
  for (int d = 0; d < 3; ++d) low[d] = high[d] = nodes[d];
  for (std::int32_t n = 0; n < 3 * info.node_count; ++n)
    low[n % 3] = std::min(low[n % 3], nodes[n]), high[n % 3] = std::max(high[n % 3], nodes[n]);
  std::vector<double> points;
  const double step[3] = {0.8191725134, 0.6710436067, 0.5497004779};
  for (int i = 0; i < 3 * kPoints; ++i)
    for (int d = 0; d < 3; ++d) points.push_back(low[d] + std::fmod(step[d] * i, 1) * (high[d] - low[d]));
  std::vector<palpate_inside_place> all(points.size() / 3), inside;
  palpate_scene_locate(scene, points.data(), static_cast<std::int32_t>(all.size()), 0, all.data());
  points.clear();
  for (const palpate_inside_place& place : all) {
    if (place.tetrahedron < 0 || inside.size() == static_cast<std::size_t>(kPoints)) continue;
    inside.push_back(place);
    const std::int32_t* corner = palpate_bundle_tetrahedra(bundle) + 4 * static_cast<std::ptrdiff_t>(place.tetrahedron);
    for (int d = 0; d < 3; ++d) {
      double sum = 0;
      for (int a = 0; a < 4; ++a) sum += place.weight[a] * nodes[3 * static_cast<std::ptrdiff_t>(corner[a]) + d];
      points.push_back(sum);
    }
  }
  all.resize(inside.size());
  const auto count = static_cast<std::int32_t>(inside.size());
  *locate_us = time_of([&] { palpate_scene_locate(scene, points.data(), count, 1e-6, all.data()); }) / count;
  return inside;
}

// Pressure and von Mises' stress of all nodes where one touchable node is held 2 mm along z.
struct Pressed {
  std::vector<float> pressures, von_mises;
};
bool press(const char* file, Pressed* pressed, palpate_error* error) {
  palpate_bundle* bundle = nullptr;
  if (palpate_bundle_open_file(file, nullptr, &bundle, error) != PALPATE_OK) return false;
  palpate_scene_def def = palpate_default_scene_def();
  def.collision = PALPATE_COLLISION_OFF, def.contact = PALPATE_CONTACT_NODE;
  def.shape = PALPATE_SHAPE_VOLUME, def.inside = PALPATE_INSIDE_ON;
  palpate_scene* scene = nullptr;
  const bool made = palpate_scene_create(bundle, &def, &scene, error) == PALPATE_OK;
  if (made) {
    const palpate_bundle_info info = palpate_bundle_describe(bundle);
    palpate_grip grip = palpate_default_grip();
    grip.kind = PALPATE_GRIP_NODE, grip.node = palpate_bundle_touchable(bundle)[info.touchable_count / 2];
    grip.displacement[2] = -0.002;
    palpate_tool tool = palpate_default_tool();
    tool.grips = &grip, tool.grip_count = 1;
    std::vector<std::uint64_t> held(palpate_contacts_bytes(scene) / 8 + 1);
    auto* contacts = reinterpret_cast<palpate_contacts*>(held.data());
    palpate_scene_touch(scene, &tool, 1, 1e-3, contacts, 8 * held.size());
    const auto nodes = static_cast<std::size_t>(info.node_count);
    std::vector<float> u(3 * nodes), x(u);
    pressed->pressures.resize(nodes), pressed->von_mises.resize(nodes);
    palpate_shape_out shape = palpate_default_shape_out();
    shape.displacements = u.data(), shape.positions = x.data(), shape.node_capacity = info.node_count;
    palpate_scene_shape(scene, contacts, &shape);
    palpate_inside_out out = palpate_default_inside_out();
    out.capacity = info.node_count, out.pressures = pressed->pressures.data();
    out.von_mises = pressed->von_mises.data();
    palpate_scene_inside(scene, &shape, &out);
    palpate_scene_destroy(scene);
  }
  palpate_bundle_close(bundle);
  return made;
}

void tell_difference(const char* name, const std::vector<float>& one, const std::vector<float>& other) {
  std::vector<float> size, apart;
  for (std::size_t n = 0; n < one.size(); ++n)
    size.push_back(std::abs(one[n])), apart.push_back(std::abs(one[n] - other[n]));
  std::sort(size.begin(), size.end()), std::sort(apart.begin(), apart.end());
  std::printf("%-18s median %.3g Pa, largest %.4g Pa; differs by a median of %.3g Pa, by %.3g Pa at the most\n", name,
              static_cast<double>(size[size.size() / 2]), static_cast<double>(size.back()),
              static_cast<double>(apart[apart.size() / 2]), static_cast<double>(apart.back()));
}

int compare(const char* first, const char* second) {
  palpate_error error = {};
  Pressed one, other;
  if (!press(first, &one, &error) || !press(second, &other, &error)) return fail(error);
  if (one.pressures.size() != other.pressures.size()) {
    std::fprintf(stderr, "inside_bench: the bundles are of two meshes\n");
    return 2;
  }
  tell_difference("pressure", one.pressures, other.pressures);
  tell_difference("von Mises", one.von_mises, other.von_mises);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 3) return compare(argv[1], argv[2]);
  if (argc != 2) {
    std::fprintf(stderr, "inside_bench BUNDLE.h5 [OTHER.h5]\n");
    return 2;
  }
  palpate_error error = {};
  palpate_bundle* bundle = nullptr;
  if (palpate_bundle_open_file(argv[1], nullptr, &bundle, &error) != PALPATE_OK) return fail(error);
  palpate_scene_def def = palpate_default_scene_def();
  def.collision = PALPATE_COLLISION_OFF, def.contact = PALPATE_CONTACT_NODE;
  def.shape = PALPATE_SHAPE_VOLUME, def.inside = PALPATE_INSIDE_ON;
  palpate_scene* scene = nullptr;
  const auto begin = std::chrono::steady_clock::now();
  if (palpate_scene_create(bundle, &def, &scene, &error) != PALPATE_OK) return fail(error);
  const double create_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  const palpate_bundle_info info = palpate_bundle_describe(bundle);
  std::uint64_t memory = 0, mapped = 0;
  for (std::int32_t p = 0; const palpate_plan_pass* pass = palpate_scene_plan(scene, p); ++p)
    if (pass->name[0] == 't') memory = pass->memory_bytes, mapped = pass->mapped_bytes;  // "tetrahedra of the inside"
  std::printf("%d vertices, %d of them on the surface, %d tetrahedra\n", info.node_count, info.surface_node_count,
              info.tetrahedron_count);
  std::printf("create            %8.1f ms  with the rest of the scene\n", create_ms);
  std::printf("memory            %8.1f kB  of the scene, %.0f bytes a tetrahedron; %.1f kB read from the bundle\n",
              1e-3 * static_cast<double>(memory), static_cast<double>(memory) / info.tetrahedron_count,
              1e-3 * static_cast<double>(mapped));

  // Twelve nodes are held, as a disc holds them.
  std::vector<palpate_grip> grips;
  for (int i = 0; i < 12; ++i) {
    palpate_grip grip = palpate_default_grip();
    grip.kind = PALPATE_GRIP_NODE, grip.node = palpate_bundle_touchable(bundle)[i * (info.touchable_count / 12)];
    grip.displacement[2] = -0.002;
    grips.push_back(grip);
  }
  palpate_tool tool = palpate_default_tool();
  tool.grips = grips.data(), tool.grip_count = 12;
  std::vector<std::uint64_t> held(palpate_contacts_bytes(scene) / 8 + 1);
  auto* contacts = reinterpret_cast<palpate_contacts*>(held.data());
  palpate_scene_touch(scene, &tool, 1, 1e-3, contacts, 8 * held.size());
  const auto nodes = static_cast<std::size_t>(info.node_count);
  std::vector<float> u(3 * nodes), x(u), strain(6 * nodes), stress(strain), principal(u), measures(2 * nodes);
  palpate_shape_out shape = palpate_default_shape_out();
  shape.displacements = u.data(), shape.positions = x.data(), shape.node_capacity = info.node_count;
  const double shape_us = time_of([&] { palpate_scene_shape(scene, contacts, &shape); });
  palpate_inside_out out = palpate_default_inside_out();
  out.capacity = info.node_count;
  const double kept_us = time_of([&] { palpate_scene_inside(scene, &shape, nullptr); });
  out.strains = strain.data(), out.stresses = stress.data(), out.principal = principal.data();
  out.von_mises = measures.data(), out.pressures = measures.data() + nodes;
  const double field_us = time_of([&] { palpate_scene_inside(scene, &shape, &out); });
  std::printf("shape             %8.1f us  12 nodes under contact, all vertices: the reference\n", shape_us);
  std::printf("inside            %8.1f us  %.2f of the shape; kept, nothing written\n", kept_us, kept_us / shape_us);
  std::printf("inside, all       %8.1f us  %.2f of the shape; strain, stress, pressure, von Mises, principal\n",
              field_us, field_us / shape_us);
  double locate_us = 0;
  const auto places = places_in(scene, bundle, &locate_us);
  const auto count = static_cast<std::int32_t>(places.size());
  std::vector<float> at(6 * places.size()), moved(3 * places.size());
  palpate_inside_out there = palpate_default_inside_out();
  there.capacity = count, there.stresses = at.data();
  const double at_us = time_of([&] { palpate_scene_inside_at(scene, places.data(), count, &there); }) / count;
  const double carry_us =
      time_of([&] { palpate_scene_carry(scene, &shape, places.data(), count, moved.data()); }) / count;
  std::printf("locate            %8.3f us  a point, of %d within the organ\n", locate_us, count);
  std::printf("inside_at         %8.3f us  a place: stress\n", at_us);
  std::printf("carry             %8.3f us  a place\n", carry_us);
  palpate_scene_destroy(scene);
  palpate_bundle_close(bundle);
  return 0;
}
