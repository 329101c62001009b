// Bundles in every form give the forces and shapes of f32 rows, within the error of the form; damaged bundles are refused.
#include <sstream>

#include "formats/errors.h"
#include "tests/runtime/touched_box.h"
#include "tests/support/box_corridor.h"
#include "tests/support/packed_bundle.h"

namespace palpate::tests {
namespace {

using formats::ElementType;
using formats::SectionId;

// A bar long enough for separate clusters of 32 nodes. One node is fixed along x alone, the face x = 0 in all directions.
const TinyBox kLong = {.cells = {14, 3, 3}, .size = {0.28, 0.06, 0.06}, .single_dof = true};

using Store = std::function<void(BundleParts&)>;
struct Form {
  const char* name;
  double error;  // relative, of a column
  Store store;
};
Store in_blocks(
    ElementType type, std::optional<double> error, const Store& before = [](BundleParts&) {}) {
  return [=](BundleParts& parts) { before(parts), store_in_blocks(parts, {type, error}); };
}

// f16: half a unit in the last of 11 bits; f32 blocks: a C_kk of condition 10 rounded, times T^f. Low rank as asked for,
// plus rounding of U and V.
const Form kForms[] = {
    {"f64 rows", 1e-7, store_as_f64},
    {"f16 rows", 5e-4, store_as_f16},
    {"f32 blocks, all dense", 1e-6, in_blocks(ElementType::f32, {})},
    {"f32 blocks, 1e-4", 1.1e-4, in_blocks(ElementType::f32, 1e-4)},
    {"f16 blocks, 1e-3", 3e-3, in_blocks(ElementType::f16, 1e-3)},
};

const TouchedBox& rows() {
  static const TouchedBox box(kLong);
  return box;
}
const TouchedBox& in_form(std::size_t f) {
  static std::map<std::size_t, std::unique_ptr<TouchedBox>> boxes;
  auto& box = boxes[f];
  if (!box) box = std::make_unique<TouchedBox>(kLong, kForms[f].store);
  return *box;
}

double relative(const std::vector<float>& a, const std::vector<float>& b) {
  double difference = 0, size = 0;
  for (std::size_t i = 0; i < a.size(); ++i) difference += std::pow(a[i] - b[i], 2), size += std::pow(b[i], 2);
  return std::sqrt(difference / size);
}

SceneDef gripped(palpate_shape_model shape) {
  return unlimited_def(PALPATE_COLLISION_OFF, PALPATE_CONTACT_NODE, shape);
}

struct Felt {
  std::vector<float> u, strain, stress;  // strain, stress: of each node, where the scene looks inside
  Eigen::Vector3d force;
  palpate_step_flags flags;
};
Felt felt(const TouchedBox& box, const SceneDef& def, const std::vector<palpate_grip>& grips) {
  TouchedScene scene(box, def);
  const palpate_tool tool = tool_of(grips);
  Felt found;
  found.flags = scene.touch({tool});
  found.force = Eigen::Vector3d(scene.tool().force);
  const auto nodes =
      static_cast<std::int32_t>(def.shape == PALPATE_SHAPE_VOLUME ? box.dofs() / 3 : box.body.surface_nodes);
  palpate_step_flags raised = 0;
  found.u = displacements(scene.get(), scene.contacts.get(), nodes, &raised);
  found.flags |= raised;
  if (def.inside.inside == PALPATE_INSIDE_OFF) return found;
  palpate_shape_out shape = shape_out(found.u.data(), nullptr, nodes);
  shape.node_count = nodes;
  found.strain.resize(2 * found.u.size()), found.stress.resize(2 * found.u.size());
  palpate_inside_out inside = palpate_default_inside_out();
  inside.capacity = nodes, inside.strains = found.strain.data(), inside.stresses = found.stress.data();
  found.flags |= palpate_scene_inside(scene.get(), &shape, &inside);
  return found;
}

TEST(PackedBundle, HasBlocksOfLowRankInTheseTests) {
  BundleParts parts = tiny_bundle(kLong);
  const PackedCompliance packed = store_in_blocks(parts, {ElementType::f32, 1e-4});
  EXPECT_GT(packed.low_rank_blocks, 4u);
  EXPECT_GT(packed.dense_blocks, 5u);
}

TEST(PackedBundle, GivesEachColumnWithinTheErrorOfItsForm) {
  for (std::size_t f = 0; f < std::size(kForms); ++f)
    for (std::size_t k = 0; k < rows().touchable.size(); k += 7)
      for (int j = 0; j < 3; ++j) {
        if (rows().fixed[3 * (rows().touchable[k]) + j]) continue;
        const auto grip = grip_at_node(rows().touchable[k], 0.001 * Eigen::Vector3d::Unit(j));
        const auto def = gripped(PALPATE_SHAPE_SURFACE);
        const Felt expected = felt(rows(), def, {grip}), found = felt(in_form(f), def, {grip});
        EXPECT_EQ(found.flags, expected.flags);
        EXPECT_LE(relative(found.u, expected.u), kForms[f].error) << kForms[f].name << " column " << k << " " << j;
        // T^f is the same double in every form.
        EXPECT_LE((found.force - expected.force).norm(), 1e-12 * expected.force.norm()) << kForms[f].name;
      }
}

// What a force moves far away on a long strip that is held along its side is less than the error that was asked for.
TEST(PackedBundle, PacksBlocksThatAreWithinTheErrorBeforeTheFirstRank) {
  constexpr std::int32_t kNodes = 256;
  ComplianceSource strip;
  strip.surface_nodes = kNodes;
  const auto c = [](std::int32_t n, std::int32_t k) { return std::exp(-2.0 * std::abs(n - k)); };
  for (std::int32_t n = 0; n < kNodes; ++n) {
    strip.position.insert(strip.position.end(), {0.001 * n, 0, 0});
    strip.touchable.push_back(n);
    for (int i = 0; i < 9; ++i) strip.stiffness.push_back(i % 4 == 0);
  }
  strip.compliance = [&](std::size_t k, std::span<const std::int32_t> nodes, double* out) {
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t n = 0; n < nodes.size(); ++n)
        for (std::size_t i = 0; i < 3; ++i)
          out[(j * nodes.size() + n) * 3 + i] = i == j ? c(nodes[n], static_cast<std::int32_t>(k)) : 0;
  };
  constexpr double kError = 1e-2;
  const PackedCompliance packed = pack_compliance(strip, {ElementType::f32, kError});
  EXPECT_GT(packed.low_rank_blocks, 2u);
  std::vector<double> missed(kNodes), size(kNodes);
  for (std::int32_t n = 0; n < kNodes; ++n)
    for (std::int32_t k = 0; k < kNodes; ++k) size[k] += std::pow(c(n, k), 2), missed[k] += std::pow(c(n, k), 2);
  std::uint64_t first = 0;
  for (std::size_t b = 0; b < packed.scale.size(); ++b) {
    formats::StoredBlock stored;
    std::memcpy(&stored, &packed.blocks[5 * b], sizeof stored);
    const formats::ComplianceBlock block =
        formats::placed_block(stored, packed.cluster_ends.data(), first, packed.scale[b]);
    first += block.numbers();
    for (std::int32_t r = 0; r < block.rows; ++r)
      for (std::int32_t k = 0; k < block.columns; ++k) {
        double entry[9];
        block.entry(ElementType::f32, packed.values.data(), r, k, entry);
        const std::int32_t row = packed.nodes[block.row + r], column = packed.nodes[block.column + k];
        const double right = c(row, column), change = std::pow(entry[0] - right, 2) - std::pow(right, 2);
        missed[column] += change;
        if (!block.diagonal()) missed[row] += change;
      }
  }
  for (std::int32_t k = 0; k < kNodes; ++k) EXPECT_LE(std::sqrt(std::max(0.0, missed[k]) / size[k]), kError) << k;
}

// Surface and interior each have a type of their own; f16 rows have a scale, and rows of another type have none.
TEST(PackedBundle, GivesTheInteriorInItsOwnTypeBesideASurfaceInAnyOther) {
  const Form forms[] = {
      {"f16 beside f32 rows", 5e-4, store_interior_as_f16},
      {"f16 beside f32 blocks", 5e-4, in_blocks(ElementType::f32, 1e-4, store_interior_as_f16)},
      {"f16 beside f16 blocks", 5e-4, in_blocks(ElementType::f16, 1e-3, store_interior_as_f16)},
      {"f32 beside f16 rows", 1e-6,
       [](BundleParts& p) {
         const auto interior = p.sections.at(SectionId::displacement_interior);
         store_as_f16(p), p.sections.insert_or_assign(SectionId::displacement_interior, interior);
       }},
  };
  SceneDef def = with(gripped(PALPATE_SHAPE_VOLUME), PALPATE_INSIDE_ON);
  const std::vector<palpate_grip> grips = {grip_at_node(rows().touchable[40], {0.001, -0.002, 0.003})};
  const Felt expected = felt(rows(), def, grips);
  const auto relative_inside = [](const std::vector<float>& found, const std::vector<float>& right,
                                  std::ptrdiff_t each) {
    const auto inside = each * static_cast<std::ptrdiff_t>(rows().body.surface_nodes);
    return relative({found.begin() + inside, found.end()}, {right.begin() + inside, right.end()});
  };
  for (const Form& form : forms) {
    const Felt found = felt(TouchedBox(kLong, form.store), def, grips);
    ASSERT_EQ(found.u.size(), expected.u.size());
    ASSERT_EQ(found.flags, expected.flags);
    EXPECT_LE(relative_inside(found.u, expected.u, 3), form.error) << form.name;
    // In each form some of a tetrahedron's nodes have 11 bits. The displacement falls by its size over 60 mm, and nodes are 20 mm apart: its
    // differences have several times its error; the volume's part of the stress has 10 times that of the shear.
    EXPECT_LE(relative_inside(found.strain, expected.strain, 6), 20 * 5e-4) << form.name;
    EXPECT_LE(relative_inside(found.stress, expected.stress, 6), 80 * 5e-4) << form.name;
  }
}

TEST(PackedBundle, FillsAShortArrayAsFarAsItGoes) {
  const auto def = gripped(PALPATE_SHAPE_SURFACE);
  const std::vector<palpate_grip> grips = {grip_at_node(rows().touchable[5], {0.001, -0.002, 0.003})};
  for (std::size_t f = 0; f < std::size(kForms); ++f) {
    TouchedScene scene(in_form(f), def);
    ASSERT_EQ(scene.hold(grips), 0u);
    const std::vector<float> whole = scene.shape();
    for (const std::int32_t capacity : {1, 2, 7, in_form(f).body.surface_nodes}) {
      const auto filled = 3 * static_cast<std::ptrdiff_t>(capacity);
      std::vector<float> u(static_cast<std::size_t>(filled) + 3, 9);
      palpate_shape_out out = shape_out(u.data(), nullptr, capacity);
      EXPECT_EQ(palpate_scene_shape(scene.get(), scene.contacts.get(), &out), 0u);
      EXPECT_TRUE(std::equal(u.begin(), u.begin() + filled, whole.begin())) << kForms[f].name << ", " << capacity;
      EXPECT_EQ(std::count(u.begin() + filled, u.end(), 9.0f), 3) << kForms[f].name << ", " << capacity;
    }
  }
}

TEST(PackedBundle, GivesSeveralContactsAsTheConditionOfTheirSystemAllows) {
  std::vector<palpate_grip> grips;
  const Eigen::MatrixXd c = dense_compliance(dense_box(kLong));
  std::vector<Eigen::Index> held;
  for (std::size_t g = 0; g < 6; ++g) {
    const std::int32_t node = rows().touchable[g * (rows().touchable.size() - 2) / 6];
    grips.push_back(grip_at_node(node, {0.001, 0.0005 * static_cast<double>(g), -0.0003}));
    for (int d = 0; d < 3; ++d) held.push_back(3 * node + d);
  }
  const Eigen::MatrixXd w = c(held, held);
  const Eigen::VectorXd values = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(w).eigenvalues();
  const double condition = values.maxCoeff() / values.minCoeff();
  for (std::size_t f = 0; f < std::size(kForms); ++f) {
    const auto def = gripped(PALPATE_SHAPE_VOLUME);
    const Felt expected = felt(rows(), def, grips), found = felt(in_form(f), def, grips);
    // |dr| / |r| <= cond(W) |dW| / |W|; columns are |W| at most, each off by the form's error: sqrt(6) for their number.
    const double bound = 2.5 * condition * kForms[f].error;
    EXPECT_LE((found.force - expected.force).norm(), bound * expected.force.norm()) << kForms[f].name;
    EXPECT_LE(relative(found.u, expected.u), bound) << kForms[f].name;
  }
}

TEST(PackedBundle, FollowsCollisionsAndCorrectsToolByTool) {
  const auto with_curves = [](BundleParts& parts) {
    parts.set(SectionId::response_radial, {2}, std::vector<double>{0.5, 0.5});
    parts.set(SectionId::response_range, {2}, std::vector<double>{1, 1});
  };
  const TouchedBox plain(kLong, with_curves);
  const TouchedBox packed(kLong, in_blocks(ElementType::f32, {}, with_curves));
  SceneDef def = unlimited_def(PALPATE_COLLISION_DEFORMED, PALPATE_RADIAL_RESPONSE);
  const std::int32_t triangle = plain.far_triangle(3);
  const Eigen::Vector3d place = plain.place(triangle, {.3, .3, .4}), out = plain.outward(triangle);
  TouchedScene a(plain, def), b(packed, def);
  for (int s = 0; s < 60; ++s) {
    const Eigen::Vector3d p = place + 0.002 * std::cos(0.1 * s) * out;
    const palpate_grip grip = grip_at_node(plain.touchable[40], {0, 0, 0.001});
    const palpate_tool tools[2] = {point_tool(p.data()), grip_tool(&grip)};
    a.touch(tools);
    b.touch(tools);
    ASSERT_EQ(a.tool().contact_count, b.tool().contact_count) << s;
    EXPECT_LE((Eigen::Vector3d(a.tool().force) - Eigen::Vector3d(b.tool().force)).norm(), 1e-5) << s;
    const auto nodes = plain.body.surface_nodes;
    // 1e-7 for rounding, times a condition of some hundreds for three neighbouring nodes.
    EXPECT_LE(
        relative(displacements(b.get(), b.contacts.get(), nodes), displacements(a.get(), a.contacts.get(), nodes)),
        1e-4)
        << s;
  }
}

// Two discs on the far face: one is pressed and dragged until it slips, the other comes down beside it. Collision follows the
// deformed surface. A disc's local compliance is not in the tensors, so it is the same in every form.
TEST(PackedBundle, FeelsDiscsThatStickAndSlipInEveryForm) {
  SceneDef def = unlimited_def(PALPATE_COLLISION_DEFORMED, PALPATE_LAW_COULOMB);
  const Eigen::Vector3d out = Eigen::Vector3d::UnitX(), place(0.28, 0.0221, 0.0312);
  for (std::size_t f = 0; f < std::size(kForms); ++f) {
    TouchedScene plain(rows(), def), packed(in_form(f), def);
    double largest = 0, off = 0;
    int slips = 0;
    for (int s = 0; s < 120; ++s) {
      Eigen::Vector3d p[2] = {place + 1e-4 * out, place + 1e-4 * out + Eigen::Vector3d(0, 0.013, 0)};
      p[0] += -5e-5 * std::min(s, 40) * out + 5e-5 * std::max(0, s - 40) * Eigen::Vector3d(0, 0, -1);
      p[1] += -2e-5 * s * out;
      const palpate_tool tools[2] = {point_tool(p[0].data(), 1, 0.004, 0.3), point_tool(p[1].data(), 1, 0.007, 0.3)};
      plain.touch(tools);
      packed.touch(tools);
      slips += plain.tool().slip_count;
      for (int t = 0; t < 2; ++t) {
        ASSERT_EQ(packed.tool(t).contact_count, plain.tool(t).contact_count) << kForms[f].name << " " << s;
        const Eigen::Vector3d expected(plain.tool(t).force_raw), found(packed.tool(t).force_raw);
        largest = std::max(largest, expected.norm()), off = std::max(off, (found - expected).norm());
      }
    }
    EXPECT_GT(slips, 10);
    // The form's error of the compliance, times the condition of two discs that share nodes, some ten.
    EXPECT_LE(off, 10 * kForms[f].error * largest) << kForms[f].name;
  }
}

TEST(PackedBundle, PlansWhatItMaps) {
  for (std::size_t f = 0; f < std::size(kForms); ++f) {
    const auto def = gripped(PALPATE_SHAPE_VOLUME);
    const ScenePointer scene = in_form(f).scene(def);
    BundleParts parts = tiny_bundle(kLong);
    kForms[f].store(parts);
    for (const palpate_plan_pass& pass : plan_of(scene.get())) {
      std::istringstream names(pass.sections);
      std::uint64_t bytes = 0;
      for (std::string name; names >> name;) {
        bool found = false;
        for (const auto& [id, part] : parts.sections)
          if (formats::describe_section(id)->path == name) found = true, bytes += part.bytes.size();
        EXPECT_TRUE(found) << kForms[f].name << ": " << name;
      }
      EXPECT_EQ(pass.mapped_bytes, bytes) << kForms[f].name << ": " << pass.name;
    }
  }
}

// ---- damage ---------------------------------------------------------------------------------------------------------

const BundleParts& packed_parts() {
  static const BundleParts parts = [] {
    BundleParts made = tiny_bundle(kLong);
    store_in_blocks(made, {ElementType::f32, 1e-4});
    return made;
  }();
  return parts;
}

// Opens the bundle and makes a scene; plays a step where that succeeds.
palpate_status status_of(const BundleParts& parts) {
  AlignedBytes bytes(bundle_bytes(parts));
  palpate_bundle* opened = nullptr;
  palpate_error error = {};
  palpate_status status = palpate_bundle_open(bytes.data(), bytes.size(), nullptr, &opened, &error);
  const BundlePointer bundle(opened);
  palpate_scene* created = nullptr;
  const SceneDef def = gripped(PALPATE_SHAPE_SURFACE);
  if (status == PALPATE_OK) status = palpate_scene_create(opened, &def, &created, &error);
  const ScenePointer scene(created);
  EXPECT_EQ(status == PALPATE_OK, error.text[0] == '\0') << error.text;
  if (!scene) return status;
  Contacts contacts(scene.get());
  std::vector<palpate_grip> grips;
  const palpate_bundle_info info = palpate_bundle_describe(opened);
  for (int g = 0; g < 8; ++g)
    grips.push_back(grip_at_node(palpate_bundle_touchable(opened)[g * info.touchable_count / 8], {1e-3, 0, 0}));
  const palpate_tool tool = tool_of(grips);
  palpate_scene_touch(scene.get(), &tool, 1, 1e-3, contacts.get(), contacts.bytes());
  displacements(scene.get(), contacts.get(), info.surface_node_count);
  return status;
}

template <class Number>
palpate_status changed(SectionId id, const std::function<void(std::vector<Number>&)>& change) {
  BundleParts parts = packed_parts();
  auto numbers = parts.get<Number>(id);
  change(numbers);
  parts.set(id, parts.sections.at(id).shape, numbers);
  return status_of(parts);
}

TEST(PackedBundle, IsRefusedWhenItsTablesDoNotHold) {
  using Integers = std::vector<std::int32_t>;
  EXPECT_EQ(status_of(packed_parts()), PALPATE_OK);
  const auto nodes = [](auto change) { return changed<std::int32_t>(SectionId::compliance_nodes, change); };
  EXPECT_EQ(nodes([](Integers& x) { x[3] = static_cast<std::int32_t>(x.size()); }), PALPATE_ERROR_CONTENT);
  EXPECT_EQ(nodes([](Integers& x) { x[3] = -1; }), PALPATE_ERROR_CONTENT);
  EXPECT_EQ(nodes([](Integers& x) { x[3] = x[4]; }), PALPATE_ERROR_CONTENT);                     // twice
  EXPECT_EQ(nodes([](Integers& x) { std::swap(x.front(), x.back()); }), PALPATE_ERROR_CONTENT);  // not touchable

  const auto clusters = [](auto change) { return changed<std::int32_t>(SectionId::compliance_clusters, change); };
  EXPECT_EQ(clusters([](Integers& x) { x[0] = 0; }), PALPATE_ERROR_CONTENT);
  EXPECT_EQ(clusters([](Integers& x) { x[1] = x[0]; }), PALPATE_ERROR_CONTENT);
  EXPECT_EQ(clusters([](Integers& x) { x.back() += 1; }), PALPATE_ERROR_CONTENT);
  EXPECT_EQ(clusters([](Integers& x) { x.back() = INT32_MAX; }), PALPATE_ERROR_CONTENT);
  const auto columns = static_cast<std::int32_t>(packed_parts().sections.at(SectionId::touchable).shape[0]);
  EXPECT_EQ(clusters([&](Integers& x) { *std::find(x.begin(), x.end(), columns) -= 1; }), PALPATE_ERROR_CONTENT);

  const auto blocks = [](auto change) { return changed<std::int32_t>(SectionId::compliance_blocks, change); };
  for (const std::int32_t value : {-1, INT32_MAX, INT32_MIN, 1000})
    for (std::size_t i = 0; i < 5; ++i)
      EXPECT_EQ(blocks([&](Integers& x) { x[i] = value; }), PALPATE_ERROR_CONTENT) << i << " " << value;
  EXPECT_EQ(blocks([](Integers& x) { x[4] += 1; }), PALPATE_ERROR_CONTENT);
  // Two dense blocks of one size that cover the same clusters.
  EXPECT_NE(blocks([](Integers& x) { std::copy_n(x.begin(), 5, x.begin() + 5); }), PALPATE_OK);

  for (const float value : {0.0f, -1.0f, NAN, INFINITY, 1e38f})
    EXPECT_EQ(changed<float>(SectionId::compliance_scale, [&](std::vector<float>& x) { x[1] = value; }),
              PALPATE_ERROR_CONTENT);
}

TEST(PackedBundle, IsRefusedWhenItHoldsTwoStoresOrHalfOfOne) {
  for (const auto id : {SectionId::compliance_nodes, SectionId::compliance_clusters, SectionId::compliance_blocks,
                        SectionId::compliance_values, SectionId::compliance_scale}) {
    BundleParts parts = packed_parts();
    parts.sections.erase(id);
    EXPECT_THROW(bundle_bytes(parts), OperationError);  // the writer seals nothing that the reader would refuse
  }
  BundleParts both = packed_parts();
  const BundleParts plain = tiny_bundle(kLong);
  both.sections[SectionId::displacement_surface] = plain.sections.at(SectionId::displacement_surface);
  EXPECT_THROW(bundle_bytes(both), OperationError);
  BundleParts halves = plain;
  store_as_f16(halves);
  halves.sections.erase(SectionId::displacement_scale);
  EXPECT_THROW(bundle_bytes(halves), OperationError);
}

TEST(PackedBundle, WithHostileScalesOfRowsIsRefused) {
  for (const float value : {0.0f, -1.0f, NAN, INFINITY}) {
    BundleParts parts = tiny_bundle(kLong);
    store_as_f16(parts);
    auto scale = parts.get<float>(SectionId::displacement_scale);
    scale[5] = value;
    parts.set(SectionId::displacement_scale, {scale.size() / 3, 3}, scale);
    EXPECT_EQ(status_of(parts), PALPATE_ERROR_CONTENT);
  }
}

TEST(Half, IsConvertedExactlyAndRoundedToTheNearest) {
  for (std::uint32_t h = 0; h < 0x10000; ++h) {
    const float value = formats::float_of_half(static_cast<std::uint16_t>(h));
    if (std::isnan(value)) continue;
    const std::uint32_t exponent = h >> 10 & 31, mantissa = h & 1023;
    const double expected = exponent == 31  ? INFINITY
                            : exponent == 0 ? std::ldexp(mantissa, -24)
                                            : std::ldexp(1024 + mantissa, static_cast<int>(exponent) - 25);
    ASSERT_EQ(std::fabs(value), expected) << h;
    ASSERT_EQ(std::signbit(value), (h & 0x8000u) != 0) << h;
    ASSERT_EQ(formats::half_of(value), h);
    if (exponent == 31) continue;
    const float next = formats::float_of_half(static_cast<std::uint16_t>(h + 1));
    if (!std::isfinite(next) || mantissa == 1023) continue;
    const double middle = 0.5 * (static_cast<double>(value) + next);
    ASSERT_EQ(formats::half_of(middle), h + (h & 1)) << "ties to even";
    ASSERT_EQ(formats::half_of(std::nextafter(middle, value)), h);
    ASSERT_EQ(formats::half_of(std::nextafter(middle, next)), h + 1);
  }
}

}  // namespace
}  // namespace palpate::tests
