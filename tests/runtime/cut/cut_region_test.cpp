// A bundle with a region that may be cut, from palpate-precompute to the compliance of the cut body.
#include "runtime/cut/cut_region.h"

#include <gtest/gtest.h>

#include <limits>
#include <map>
#include <set>

#include "precompute/elements/elastic_body.h"
#include "runtime/cut/cut_compliance.h"
#include "runtime/cut/cut_mesh.h"
#include "studies/cut/cut_body.h"
#include "tests/runtime/cut/precomputed_block.h"
#include "tests/support/open_bundle.h"

namespace palpate::tests {
namespace {

using formats::SectionId;

// A region that was read, with the columns of its bundle.
struct ReadRegion {
  explicit ReadRegion(const std::string& file) {
    palpate_bundle* opened = nullptr;
    EXPECT_EQ(palpate_bundle_open_file(file.c_str(), nullptr, &opened, &error), PALPATE_OK) << error.text;
    read(opened);
  }
  explicit ReadRegion(palpate_bundle* opened) { read(opened); }
  ~ReadRegion() { memory.release_all(); }

  void read(palpate_bundle* opened) {
    bundle.reset(opened);
    if (!opened) return;
    const SectionReader reader(*opened, memory, &error);
    tensors.surface_nodes = reader.surface_nodes(), tensors.columns = reader.columns();
    status = reader.map_rows(SectionId::displacement_surface, &tensors.surface);
    if (status == PALPATE_OK) status = reader.map(SectionId::force, &tensors.stiffness);
    if (status == PALPATE_OK)
      status = reader.copy_indices(SectionId::touchable, static_cast<std::size_t>(reader.columns()),
                                   &formats::IndexedSections::touchable, &touchable);
    if (status == PALPATE_OK) status = read_cut_region(reader, tensors, touchable, &region);
  }

  palpate_error error{};
  palpate_status status = PALPATE_OK;
  BundlePointer bundle;
  SceneMemory memory{palpate_allocator{}};
  Tensors tensors;
  const std::int32_t* touchable = nullptr;
  CutRegion region;
};

// A blade's cuts through the mesh, and the same changes in the compliance and in a reference that is factored anew.
struct CutPlay {
  CutPlay(const Inputs& inputs, const std::string& bundle)
      : of(bundle), element(inputs.element), pairs(of.tensors, of.region.pairs), reference(inputs.body()) {
    EXPECT_EQ(of.status, PALPATE_OK) << of.error.text;
    EXPECT_EQ(mesh.create(memory, of.region.mesh, 400), nullptr);
    EXPECT_TRUE(
        compliance.create(memory, of.region.body, pairs, {of.region.node_count, 400, 3000}, of.region.supports));
  }
  ~CutPlay() { memory.release_all(); }

  // Faces between tetrahedra whose centres lie on two sides of a plane, from the largest x on; their nodes may be divided.
  std::vector<std::int32_t> faces_of_plane(int axis, double at) const {
    std::vector<std::pair<double, std::int32_t>> found;
    std::map<std::set<std::int32_t>, std::int32_t> met;
    const std::int32_t* const corners = of.region.body.tetrahedra;
    for (std::int32_t face = 0; face < 4 * of.region.body.tetrahedron_count; ++face) {
      std::set<std::int32_t> nodes;
      for (std::int32_t c = face / 4 * 4; c < face / 4 * 4 + 4; ++c)
        if (c != face) nodes.insert(corners[c]);
      const auto [other, is_first] = met.emplace(nodes, face);
      if (is_first) continue;
      const auto a = reference.centre(static_cast<std::size_t>(face / 4)),
                 b = reference.centre(static_cast<std::size_t>(other->second / 4));
      const auto d = static_cast<std::size_t>(axis);
      if ((a[d] < at) == (b[d] < at)) continue;
      if (std::ranges::all_of(nodes, [&](std::int32_t n) { return of.region.may_divide[n] != 0; }))
        found.emplace_back(-a[0], other->second);
    }
    std::ranges::sort(found);
    std::vector<std::int32_t> faces;
    for (const auto& [x, face] : found) faces.push_back(face);
    return faces;
  }

  CutOutcome follow(const CutMeshChange& change) {
    OwnedChange made;
    for (std::int32_t n = change.first_node; n < change.end_node; ++n) made.new_nodes.push_back({n, mesh.from(n)});
    for (const std::int32_t e : change.tetrahedra) {
      const std::int32_t* const now = mesh.nodes_of(e);
      made.moved.push_back({e, {now[0], now[1], now[2], now[3]}});
    }
    made.removed.assign(change.removed_tetrahedra.begin(), change.removed_tetrahedra.end());
    removed += change.removed_tetrahedra.count;
    const CutResult result = compliance.apply(made.get());
    reference.apply(made);
    return result.outcome;
  }
  std::int32_t new_nodes() const { return mesh.nodes() - of.region.body.node_count; }

  void cut(const std::vector<std::int32_t>& faces, std::int32_t most_new) {
    for (std::size_t first = 0; first < faces.size() && new_nodes() < most_new; first += 6) {
      const auto count = static_cast<std::int32_t>(std::min<std::size_t>(6, faces.size() - first));
      ASSERT_EQ(follow(mesh.cut(faces.data() + first, count)), CutOutcome::made);
    }
  }
  void burn(const std::array<double, 3>& at, int count) {
    std::vector<std::pair<double, std::int32_t>> near;
    for (std::int32_t e = 0; e < of.region.body.tetrahedron_count; ++e) {
      const auto c = reference.centre(static_cast<std::size_t>(e));
      if (of.region.may_remove(e)) near.emplace_back(std::hypot(c[0] - at[0], c[1] - at[1], c[2] - at[2]), e);
    }
    std::ranges::sort(near);
    for (std::size_t k = 0; k < near.size() && removed < count; ++k)
      ASSERT_EQ(follow(mesh.remove(&near[k].second, 1)), CutOutcome::made);
  }

  // [3 rows][3 columns] of C'.
  Eigen::MatrixXd answer(const std::vector<std::int32_t>& rows, const std::vector<std::int32_t>& columns) {
    const auto responses = [&](const std::vector<std::int32_t>& nodes) {
      std::vector<std::vector<double>> found(nodes.size(), std::vector<double>(compliance.response_numbers()));
      for (std::size_t k = 0; k < nodes.size(); ++k) EXPECT_TRUE(compliance.find_response(nodes[k], found[k].data()));
      return found;
    };
    const auto of_rows = responses(rows), of_columns = responses(columns);
    Eigen::MatrixXd c(3 * rows.size(), 3 * columns.size());
    for (std::size_t a = 0; a < rows.size(); ++a)
      for (std::size_t b = 0; b < columns.size(); ++b) {
        Mat3 block;
        EXPECT_TRUE(compliance.between(rows[a], of_rows[a].data(), columns[b], of_columns[b].data(), &block));
        for (std::size_t i = 0; i < 9; ++i)
          c(static_cast<Eigen::Index>(3 * a + i / 3), static_cast<Eigen::Index>(3 * b + i % 3)) = block.m[i / 3][i % 3];
      }
    return c;
  }

  ReadRegion of;
  Element element;
  RegionPairs pairs;
  CutReference reference;
  SceneMemory memory{palpate_allocator{}};
  CutMesh mesh;
  CutCompliance compliance;
  int removed = 0;
};

Eigen::MatrixXd rows_of(const Eigen::MatrixXd& columns, const std::vector<std::int32_t>& nodes) {
  Eigen::MatrixXd c(3 * nodes.size(), columns.cols());
  for (std::size_t k = 0; k < nodes.size(); ++k)
    c.middleRows(3 * static_cast<Eigen::Index>(k), 3) = columns.middleRows(3 * nodes[k], 3);
  return c;
}

// Nodes that still have tetrahedra, every `step`-th: new ones, those of the region, and touchable ones outside of it.
struct Groups {
  Groups(const CutPlay& play, std::size_t step) {
    std::set<std::int32_t> used;
    for (std::int32_t e = 0; e < play.of.region.body.tetrahedron_count; ++e)
      if (!play.mesh.is_removed(e)) used.insert(play.mesh.nodes_of(e), play.mesh.nodes_of(e) + 4);
    std::size_t i = 0;
    for (const std::int32_t n : used) {
      const std::int32_t rest = play.of.region.body.node_count;
      if (i++ % step || (n < rest && play.of.region.pairs.column[n] < 0)) continue;
      (n >= rest ? lips : play.of.region.pairs.place[n] >= 0 ? region : outside).push_back(n);
    }
  }
  std::vector<std::int32_t> lips, region, outside;
};

struct Case {
  Element element;
  const char* store;
};
class CutBundle : public testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(Elements, CutBundle,
                         testing::Values(Case{Element::p1, "f32"}, Case{Element::p1_anp, "f32"},
                                         Case{Element::p1_anp, "f64"}, Case{Element::p1_ang, "f32"}),
                         [](const auto& one) {
                           std::string name = name_of(one.param.element);
                           std::erase(name, '-');
                           return name + "_" + one.param.store;
                         });

TEST_P(CutBundle, GivesTheComplianceOfTheCutBody) {
  const Inputs inputs(GetParam().element, {16, 10, 8}, "{ half_space = { point = [34, 0, 0], normal = [-1, 0, 0] } }",
                      Inputs::kBelowAll);
  CutPlay play(inputs, inputs.precompute(std::string("--store ") + GetParam().store));
  play.cut(play.faces_of_plane(1, 0.025), 70);
  play.cut(play.faces_of_plane(2, 0.02), 100);
  play.burn({0.055, 0.0125, 0.04}, 20);
  play.burn({0.055, 0.0375, 0.0}, 30);  // of the foundation as well
  ASSERT_GE(play.new_nodes(), 100);
  ASSERT_EQ(play.removed, 30);
  const Groups groups(play, 11);
  ASSERT_GT(groups.lips.size(), 5u);
  ASSERT_GT(groups.region.size(), 20u);
  ASSERT_GT(groups.outside.size(), 10u);
  const FactoredBody now(play.reference.now(), inputs.element);
  ASSERT_TRUE(now.is_definite());
  const auto error = [&](const std::vector<std::int32_t>& rows, const std::vector<std::int32_t>& columns) {
    const Eigen::MatrixXd right = rows_of(now.columns(columns), rows);
    return (play.answer(rows, columns) - right).norm() / right.norm();
  };
  // In double precision the columns differ by their residuals alone; f32 adds 6e-8 of each number that is read, and a jump is told from
  // differences of such numbers. Asked: 1e-4.
  const double lips = error(groups.lips, groups.lips), across = error(groups.lips, groups.outside),
               outside = error(groups.outside, groups.outside), region = error(groups.region, groups.region);
  EXPECT_LT(lips, 1e-9);
  EXPECT_LT(region, 1e-9);
  EXPECT_LT(across, 1e-5);
  EXPECT_LT(outside, 1e-5);
  // The force that holds a lip, and one that holds a node outside, displaced.
  const Eigen::Vector3d way(0.3, 0.5, -1);
  for (const std::int32_t node : {groups.lips[0], groups.outside[0]}) {
    const Eigen::Matrix3d is = play.answer({node}, {node}), right = rows_of(now.columns({node}), {node});
    const Eigen::Vector3d force = is.fullPivLu().solve(way), expected = right.fullPivLu().solve(way);
    EXPECT_LT((force - expected).norm(), 1e-5 * expected.norm()) << node;
  }
}

TEST(CutRegion, MayBeDividedWhereAllOnWhichACutActsHasColumns) {
  for (const Element element : {Element::p1, Element::p1_anp}) {
    const Inputs inputs(element, {6, 3, 3});
    const ReadRegion read(inputs.precompute(""));
    ASSERT_EQ(read.status, PALPATE_OK) << read.error.text;
    const CutRegion& region = read.region;
    const ElasticBody body = inputs.body();
    ASSERT_EQ(static_cast<std::size_t>(region.node_count), body.cut_nodes.size());
    ASSERT_LT(body.cut_nodes.size(), body.nodes.size());
    for (std::int32_t n = 0; n < region.body.node_count; ++n) {
      // 16 mm are more than the distance of two nodes along x, and less than that of three.
      const double x = body.nodes[static_cast<std::size_t>(n)][0];
      if (x >= 0.034) {
        EXPECT_EQ(region.may_divide[n], 1) << n;
      }
      if (x < 0.01) {
        EXPECT_EQ(region.may_divide[n], 0) << n;
      }
      EXPECT_EQ(region.mesh.held[n], body.fixed[static_cast<std::size_t>(n)][0]) << n;
    }
    ASSERT_NE(region.mesh.support, nullptr);
    const auto foundation = foundation_of_triangles(body);
    double held = 0, right = 0;
    for (std::size_t t = 0; t < body.triangles.size(); ++t) {
      held += region.mesh.support[t].m[2][2];
      right += foundation[t][0] * area_of(body, {"", 0, 0, {static_cast<std::int32_t>(t)}});
    }
    EXPECT_NEAR(held, right, 1e-12 * right);
    EXPECT_GT(right, 0);
    EXPECT_GT(region.body.support_count, 0) << "soft supports are stored without large deformation, too";
    EXPECT_EQ(region.body.nodal_dilatation, element != Element::p1);
  }
}

TEST(CutRegion, ReadsAPairInDoublePrecisionOrFromTheTensorsAndTellsWhatIsNoNumber) {
  const Inputs inputs(Element::p1, {6, 3, 3});
  const ReadRegion read(inputs.precompute(""));
  ASSERT_EQ(read.status, PALPATE_OK) << read.error.text;
  const CutRegion& region = read.region;
  const FactoredBody uncut(inputs.body(), Element::p1);
  const std::int32_t all = region.body.node_count;
  const RegionPairs pairs(read.tensors, region.pairs);
  std::vector<std::int32_t> nodes;
  for (std::int32_t n = 0; n < all; ++n)
    if (region.pairs.column[n] >= 0 || region.pairs.place[n] >= 0 || region.mesh.held[n] == 1) nodes.push_back(n);
  const Eigen::MatrixXd right = rows_of(uncut.columns(nodes), nodes);
  const std::size_t stride = 3 * nodes.size();
  std::vector<double> rows(3 * stride);
  double within = 0, others = 0;
  for (std::size_t a = 0; a < nodes.size(); ++a) {
    ASSERT_TRUE(pairs.read(nodes[a], nodes.data(), static_cast<std::int32_t>(nodes.size()), rows.data(), stride));
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < stride; ++j) {
        const bool of_region = region.pairs.place[nodes[a]] >= 0 && region.pairs.place[nodes[j / 3]] >= 0;
        double& worst = of_region ? within : others;
        worst = std::max(worst, std::abs(rows[i * stride + j] -
                                         right(static_cast<Eigen::Index>(3 * a + i), static_cast<Eigen::Index>(j))));
      }
  }
  EXPECT_LT(within, 1e-11 * right.cwiseAbs().maxCoeff());
  EXPECT_LT(others, 1e-6 * right.cwiseAbs().maxCoeff());
  EXPECT_GT(others, within) << "these are in single precision";

  RegionPairs::Source broken = region.pairs;
  const auto count = static_cast<std::size_t>(region.node_count);
  std::vector<double> blocks(broken.blocks, broken.blocks + 9 * count * (count + 1) / 2);
  blocks[4] = std::numeric_limits<double>::quiet_NaN();
  broken.blocks = blocks.data();
  const std::int32_t node = region.nodes[0];
  EXPECT_FALSE(RegionPairs(read.tensors, broken).read(node, &node, 1, rows.data(), 3));
}

}  // namespace
}  // namespace palpate::tests
