// Rows divided among ranks: each row belongs to one rank, the pieces are compact, and the rows that a rank assembles equal those
// of the whole body.
#include "precompute/ranks/row_partition.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "precompute/elements/discretisation.h"
#include "tests/precompute/support.h"

namespace palpate::tests {
namespace {

ElasticBody bar() {
  TetrahedralMesh mesh = box_mesh({15, 5, 4}, {0.15, 0.05, 0.04}, 0.15);
  mesh.region_names.push_back("stiff");
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) mesh.region[t] = t % 7 == 0;
  ElasticBody body = body_of(mesh, {{5400, 0.45, 0}, {54000, 0.3, 0}});
  hold(body, [](const auto& p) { return p[0] < 1e-9 ? 7 : p[1] < 1e-9 ? 2 : 0; });
  return body;
}

// With a foundation under the whole bar and springs from one end of it to the other and to the world.
ElasticBody supported_bar() {
  ElasticBody body = bar();
  body.foundations = {{"under", 4e4, 1e4, {}}};
  for (std::size_t t = 0; t < body.triangles.size(); ++t) {
    const auto& nodes = body.triangles[t];
    if (std::all_of(nodes.begin(), nodes.end(), [&](auto n) { return body.nodes[n][2] == 0; }))
      body.foundations[0].triangles.push_back(static_cast<std::int32_t>(t));
  }
  const auto last = body.surface_count - 1;
  body.springs = {
      {"across", {{7, last, 30, {0.6, 0, 0.8}}, {20, last - 5, 40, {0, 0, 0}}, {last, Spring::kWorld, 50}}}};
  return body;
}

TEST(RowPartition, EveryFreeNodeHasOneRowAndTheSharesAreEven) {
  const ElasticBody body = bar();
  for (const int ranks : {1, 2, 3, 4, 7}) {
    const RowPartition partition = partition_rows(body.nodes, body.fixed, ranks);
    ASSERT_EQ(partition.first_row.size(), static_cast<std::size_t>(ranks) + 1);
    const auto rows = static_cast<std::int32_t>(partition.node_of_row.size());
    EXPECT_EQ(partition.first_row.front(), 0);
    EXPECT_EQ(partition.first_row.back(), rows);
    for (int r = 0; r < ranks; ++r) {
      const auto share = partition.first_row[r + 1] - partition.first_row[r];
      EXPECT_NEAR(share, static_cast<double>(rows) / ranks, 3) << r << " of " << ranks;
    }
    std::int32_t seen = 0;
    for (std::size_t n = 0; n < body.nodes.size(); ++n) {
      const auto& f = body.fixed[n];
      ASSERT_EQ(partition.row_of_node[n] < 0, f[0] && f[1] && f[2]);
      if (partition.row_of_node[n] < 0) continue;
      EXPECT_EQ(partition.node_of_row[partition.row_of_node[n]], static_cast<std::int32_t>(n));
      ++seen;
    }
    EXPECT_EQ(seen, rows);
  }
}

TEST(RowPartition, TwoRanksPartTheBarAcrossItsLength) {
  const ElasticBody body = bar();
  const RowPartition partition = partition_rows(body.nodes, body.fixed, 2);
  double left = 0, right = 1;
  for (std::size_t row = 0; row < partition.node_of_row.size(); ++row) {
    const double x = body.nodes[partition.node_of_row[row]][0];
    if (static_cast<std::int32_t>(row) < partition.first_row[1])
      left = std::max(left, x);
    else
      right = std::min(right, x);
  }
  EXPECT_LE(left, right);
}

TEST(RowPartition, MoreRanksThanRowsLeavesSomeEmpty) {
  ElasticBody body = body_of(box_mesh({1, 1, 1}, {1, 1, 1}), {{5400, 0.45, 0}});
  hold(body, [](const auto& p) { return p[2] < 0.5 ? 7 : p[0] < 0.5 ? 7 : 0; });
  const RowPartition partition = partition_rows(body.nodes, body.fixed, 4);
  EXPECT_EQ(partition.node_of_row.size(), 2u);
  EXPECT_TRUE(std::is_sorted(partition.first_row.begin(), partition.first_row.end()));
}

class OwnRows : public ::testing::TestWithParam<Element> {};

TEST_P(OwnRows, AreThoseOfTheWholeBodyToTheLastBit) {
  const ElasticBody body = supported_bar();
  ASSERT_GT(body.foundations[0].triangles.size(), 100u);
  const auto assemble = [](const ElasticBody& part) { return discretise(part, GetParam()).stiffness; };
  const BlockMatrix whole = assemble(body);
  for (const int ranks : {2, 3}) {
    const RowPartition partition = partition_rows(body.nodes, body.fixed, ranks);
    for (int r = 0; r < ranks; ++r) {
      const BlockMatrix own = assemble_own_rows(body, partition, r, assemble);
      ASSERT_EQ(own.rows, partition.first_row[r + 1] - partition.first_row[r]);
      for (std::int32_t row = 0; row < own.rows; ++row) {
        const auto node = partition.node_of_row[partition.first_row[r] + row];
        std::int64_t expected = 0;
        for (auto at = whole.first[node]; at < whole.first[node + 1]; ++at)
          expected += partition.row_of_node[whole.column[at]] >= 0;
        ASSERT_EQ(own.first[row + 1] - own.first[row], expected);
        for (auto at = own.first[row]; at < own.first[row + 1]; ++at) {
          ASSERT_TRUE(at == own.first[row] || own.column[at - 1] < own.column[at]);
          ASSERT_EQ(own.block[at], whole.block[index_of_block(whole, node, partition.node_of_row[own.column[at]])]);
        }
      }
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Elements, OwnRows, ::testing::Values(Element::p1, Element::p1_anp));

}  // namespace
}  // namespace palpate::tests
