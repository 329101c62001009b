// The compliance of a cut body against its stiffness assembled and factored anew.
#include "runtime/cut/cut_compliance.h"

#include <gtest/gtest.h>

#include <random>

#include "runtime/cut/cut_large.h"
#include "studies/bodies/bodies.h"
#include "studies/cut/cut_body.h"
#include "studies/hyperelastic/large_body.h"

namespace palpate::tests {
namespace {

std::vector<std::int32_t> all_of(std::int32_t count) {
  std::vector<std::int32_t> nodes(static_cast<std::size_t>(count));
  for (std::int32_t n = 0; n < count; ++n) nodes[static_cast<std::size_t>(n)] = n;
  return nodes;
}

// A box of two tissues that is held at x = 0, with a single dof held elsewhere.
ElasticBody two_tissues(std::array<int, 3> cells, double poisson, double jitter = 0.15) {
  TetrahedralMesh mesh = box_mesh(cells, {0.01 * cells[0], 0.01 * cells[1], 0.01 * cells[2]}, jitter);
  mesh.region_names = {"soft", "stiff"};
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) mesh.region[t] = t % 7 == 0;
  ElasticBody body = body_of(mesh, {{5000, poisson, 0}, {20000, 0.3, 0}});
  const double end = 0.01 * cells[0];
  hold(body, [&](const auto& p) { return p[0] == 0 ? 7 : p[0] == end && p[1] == 0 ? 2 : 0; });
  return body;
}

struct Cut {
  Cut(const ElasticBody& rest, Element of, CutCapacity capacity, bool single = false,
      std::vector<std::int32_t> columns = {})
      : element(of),
        large(rest, of),
        body(rest),
        foundation(foundation_of_triangles(rest)),
        uncut(rest, of),
        pairs(uncut, columns.empty() ? all_of(body.nodes()) : columns, body.nodes(), single) {
    made = compliance.create(memory, large.get(), pairs, capacity, surface());
    response.resize(2, std::vector<double>(compliance.response_numbers()));
  }
  ~Cut() { memory.release_all(); }
  SupportedSurface surface() const {
    const auto& triangles = body.rest().triangles;
    return {triangles.empty() ? nullptr : triangles[0].data(), foundation.empty() ? nullptr : foundation[0].data(),
            static_cast<std::int32_t>(triangles.size())};
  }
  CutResult apply(const OwnedChange& change) {
    const CutResult result = compliance.apply(change.get());
    if (result.outcome == CutOutcome::made) body.apply(change);
    return result;
  }
  // C' between nodes as the compliance answers, [3 nodes][3 nodes].
  Eigen::MatrixXd answer(const std::vector<std::int32_t>& nodes) {
    const auto count = static_cast<Eigen::Index>(nodes.size());
    std::vector<std::vector<double>> responses(nodes.size(), std::vector<double>(compliance.response_numbers()));
    for (std::size_t k = 0; k < nodes.size(); ++k) EXPECT_TRUE(compliance.find_response(nodes[k], responses[k].data()));
    Eigen::MatrixXd c(3 * count, 3 * count);
    for (Eigen::Index a = 0; a < count; ++a)
      for (Eigen::Index b = 0; b < count; ++b) {
        const auto i = static_cast<std::size_t>(a), j = static_cast<std::size_t>(b);
        Mat3 block;
        EXPECT_TRUE(compliance.between(nodes[i], responses[i].data(), nodes[j], responses[j].data(), &block));
        for (int r = 0; r < 3; ++r)
          for (int s = 0; s < 3; ++s) c(3 * a + r, 3 * b + s) = block.m[r][s];
      }
    return c;
  }
  Eigen::MatrixXd truth(const std::vector<std::int32_t>& nodes) const {
    const FactoredBody now(body.now(), element);
    EXPECT_TRUE(now.is_definite());
    const Eigen::MatrixXd columns = now.columns(nodes);
    Eigen::MatrixXd c(columns.cols(), columns.cols());
    for (std::size_t k = 0; k < nodes.size(); ++k)
      c.middleRows(3 * static_cast<Eigen::Index>(k), 3) = columns.middleRows(3 * nodes[k], 3);
    return c;
  }
  // Largest error of the compliance between some nodes, and of the force that holds the first of them displaced, relative.
  std::pair<double, double> errors(const std::vector<std::int32_t>& nodes) {
    const Eigen::MatrixXd is = answer(nodes), right = truth(nodes);
    const Eigen::Matrix3d held = is.topLeftCorner<3, 3>(), right_held = right.topLeftCorner<3, 3>();
    const Eigen::Vector3d way(0.3, 0.5, -1);
    const Eigen::Vector3d force = held.fullPivLu().solve(way), right_force = right_held.fullPivLu().solve(way);
    return {(is - right).norm() / right.norm(), (force - right_force).norm() / right_force.norm()};
  }

  Element element;
  LargeBody large;
  CutReference body;
  std::vector<std::array<double, 2>> foundation;
  FactoredBody uncut;
  StoredPairs pairs;
  SceneMemory memory{palpate_allocator{}};
  CutCompliance compliance;
  std::vector<std::vector<double>> response;
  bool made = false;
};

constexpr Element kElements[] = {Element::p1, Element::p1_anp, Element::p1_ang};

// The parts that a change takes away or adds are those that the precomputation assembles.
TEST(CutCompliance, ThePartsOfTheStiffnessAreThatOfThePrecomputation) {
  for (const Element element : kElements) {
    const ElasticBody body = two_tissues({4, 3, 3}, 0.45);
    const LargeBody large(body, element);
    SceneMemory memory{palpate_allocator{}};
    CutTissue tissue;
    NodeGradients site;
    ASSERT_TRUE(tissue.create(memory, large.get(), 0));
    ASSERT_TRUE(site.create(memory, tissue.largest_star()));
    const auto dofs = 3 * static_cast<Eigen::Index>(body.nodes.size());
    Eigen::MatrixXd k = Eigen::MatrixXd::Zero(dofs, dofs);
    const auto add = [&](double stiffness, int mode, const std::int32_t* nodes, const Vec3* gradients, int count) {
      Eigen::VectorXd part = Eigen::VectorXd::Zero(dofs);
      for (int a = 0; a < count; ++a)
        for (int i = 0; i < 3; ++i) part[3 * nodes[a] + i] += strain_mode(mode, gradients[a])[i];
      k += stiffness * part * part.transpose();
    };
    for (std::int32_t e = 0; e < tissue.tetrahedra(); ++e) {
      Vec3 g[4];
      const double volume = tissue.gradients(e, g);
      for (int m = 0; m < kStrainModes; ++m)
        add(volume * tissue.own_stiffness(tissue.region(e), m), m, tissue.corners(e), g, 4);
    }
    for (std::int32_t n = 0; n < tissue.nodes(); ++n)
      for (std::int32_t region = 0; region < 2 && tissue.site_modes() > 0; ++region) {
        tissue.find_site(n, region, site, [](std::int32_t) { return true; });
        for (int m = 0; m < tissue.site_modes() && site.count > 0; ++m)
          add(tissue.site_stiffness(region, m) / site.volume, m, site.node, site.gradient, site.count);
      }
    const BlockMatrix right = discretise(body, element).stiffness;
    double largest = 0;
    for (std::int32_t r = 0; r < right.rows; ++r)
      for (auto at = right.first[static_cast<std::size_t>(r)]; at < right.first[static_cast<std::size_t>(r) + 1]; ++at)
        for (int i = 0; i < 9; ++i) {
          double& value = k(3 * r + i / 3, 3 * right.column[static_cast<std::size_t>(at)] + i % 3);
          const double expected = right.block[static_cast<std::size_t>(at)][static_cast<std::size_t>(i)];
          largest = std::max(largest, std::abs(expected));
          value -= expected;
        }
    EXPECT_LT(k.cwiseAbs().maxCoeff(), 1e-12 * largest);
    memory.release_all();
  }
}

// A node splits along a plane through it.
template <class Random>
OwnedChange random_split(const CutReference& body, Random& random) {
  const auto node = static_cast<std::int32_t>(random() % static_cast<unsigned>(body.nodes()));
  double normal[3];
  for (double& x : normal) x = static_cast<double>(random() % 2001) / 1000 - 1;
  return body.split(node, [&](std::size_t e) {
    double side = 0;
    for (std::size_t i = 0; i < 3; ++i) side += normal[i] * (body.centre(e)[i] - body.position(node)[i]);
    return side > 0;
  });
}

TEST(CutCompliance, ARandomChangeIsThatOfTheStiffness) {
  for (const Element element : kElements) {
    Cut cut(two_tissues({4, 3, 3}, 0.45), element, {200, 60, 1500});
    ASSERT_TRUE(cut.made);
    std::mt19937 random(7);
    int splits = 0, removals = 0;
    for (int step = 0; step < 40; ++step) {
      OwnedChange change;
      if (random() % 2) {
        change = random_split(cut.body, random);
        if (change.new_nodes.empty()) continue;
      } else {
        const auto e = static_cast<std::int32_t>(random() % cut.body.corners().size());
        if (!cut.body.is_left(static_cast<std::size_t>(e))) continue;
        change.removed.push_back(e);
      }
      const CutResult result = cut.apply(change);
      if (result.outcome == CutOutcome::loose) continue;
      ASSERT_EQ(result.outcome, CutOutcome::made);
      (change.removed.empty() ? splits : removals)++;
      std::vector<std::int32_t> nodes = {70, 20, 41};
      for (std::int32_t n = cut.body.rest().surface_count; n < cut.body.nodes(); n += 9) nodes.push_back(n);
      const auto [compliance, force] = cut.errors(nodes);
      ASSERT_LT(compliance, 1e-9) << "step " << step << " element " << static_cast<int>(element) << " splits " << splits
                                  << " removed " << removals;
      ASSERT_LT(force, 1e-9);
    }
    EXPECT_GT(splits, 8);
    EXPECT_GT(removals, 8);
  }
}

// Foundations below two sides, of which one triangle may have two; springs to the world, along an axis and to other nodes; nothing is fixed but two dofs.
ElasticBody supported(std::array<int, 3> cells, bool springs) {
  ElasticBody body = two_tissues(cells, 0.45);
  const auto on = [&](std::size_t axis, double at) {
    std::vector<std::int32_t> found;
    for (std::size_t t = 0; t < body.triangles.size(); ++t)
      if (std::ranges::all_of(body.triangles[t], [&](std::int32_t n) {
            return std::abs(body.nodes[static_cast<std::size_t>(n)][axis] - at) < 1e-9;
          }))
        found.push_back(static_cast<std::int32_t>(t));
    return found;
  };
  const double top = 0.01 * cells[2];
  std::vector<std::int32_t> half = on(2, 0);
  half.resize(half.size() / 2);
  body.foundations = {{"below", 4e5, 1e5, on(2, 0)}, {"half", 3e5, 0, half}, {"side", 2e5, 3e5, on(1, 0)}};
  if (!springs) return body;
  SpringSet world{"above", {}}, ties{"ties", {}};
  for (std::size_t n = 0; n < body.nodes.size(); ++n) {
    const auto& p = body.nodes[n];
    if (std::abs(p[2] - top) > 1e-9 || p[0] < 0.015) continue;
    world.springs.push_back({static_cast<std::int32_t>(n), Spring::kWorld, 20 + static_cast<double>(n % 5)});
    if (n % 2) world.springs.back().axis = {0.6, 0, 0.8};
    if (n % 3 == 0 && n > 4)
      ties.springs.push_back({static_cast<std::int32_t>(n), static_cast<std::int32_t>(n) - 4, 15, {0, 0.8, 0.6}});
  }
  body.springs = {world, ties};
  return body;
}

TEST(CutCompliance, AFoundationFollowsTheTrianglesThatItIsBelow) {
  for (const Element element : kElements) {
    Cut cut(supported({4, 3, 3}, false), element, {200, 60, 1500});
    ASSERT_TRUE(cut.made);
    std::mt19937 random(17);
    int splits = 0, removals = 0;
    for (int step = 0; step < 60; ++step) {
      OwnedChange change;
      if (random() % 2) {
        change = random_split(cut.body, random);
        if (change.new_nodes.empty()) continue;
      } else {
        const auto e = static_cast<std::int32_t>(random() % cut.body.corners().size());
        if (!cut.body.is_left(static_cast<std::size_t>(e))) continue;
        change.removed.push_back(e);
      }
      const CutResult result = cut.apply(change);
      if (result.outcome == CutOutcome::loose) continue;
      ASSERT_EQ(result.outcome, CutOutcome::made);
      (change.removed.empty() ? splits : removals)++;
      std::vector<std::int32_t> nodes = {70, 20, 41};
      for (std::int32_t n = cut.body.rest().surface_count; n < cut.body.nodes(); n += 9) nodes.push_back(n);
      const auto [compliance, force] = cut.errors(nodes);
      ASSERT_LT(compliance, 1e-9) << "step " << step << " element " << static_cast<int>(element);
      ASSERT_LT(force, 1e-9);
    }
    EXPECT_GT(splits, 8);
    EXPECT_GT(removals, 8);
  }
}

TEST(CutCompliance, SpringsAreDividedByTheAreaOfTheTrianglesAtTheirNodes) {
  for (const Element element : kElements) {
    Cut cut(supported({4, 3, 3}, true), element, {200, 60, 1500});
    ASSERT_TRUE(cut.made);
    std::mt19937 random(29);
    int splits = 0;
    for (int step = 0; step < 50; ++step) {
      const OwnedChange change = random_split(cut.body, random);
      if (change.new_nodes.empty()) continue;
      const CutResult result = cut.apply(change);
      if (result.outcome == CutOutcome::loose) continue;
      ASSERT_EQ(result.outcome, CutOutcome::made);
      ++splits;
      std::vector<std::int32_t> nodes = {70, 20, 41};
      for (std::int32_t n = cut.body.rest().surface_count; n < cut.body.nodes(); n += 9) nodes.push_back(n);
      const auto [compliance, force] = cut.errors(nodes);
      ASSERT_LT(compliance, 1e-9) << "step " << step << " element " << static_cast<int>(element);
      ASSERT_LT(force, 1e-9);
    }
    EXPECT_GT(splits, 20);
  }
}

// A body under large deformation that notes what holds it.
struct NotedSupports final : MeshFollower {
  void take_supports(const Support* supports, std::int32_t count) override { taken.assign(supports, supports + count); }
  std::vector<Support> taken;

  // 2 J, of displacements u, m: [nodes].
  double twice_energy(const std::vector<Vec3>& u) const {
    double sum = 0;
    for (const Support& s : taken)
      sum += (s.node == s.other ? 1 : 2) *
             dot(u[static_cast<std::size_t>(s.node)], s.block * u[static_cast<std::size_t>(s.other)]);
    return sum;
  }
};

TEST(CutLarge, SupportsAreThoseOfTheBodyThatIsLeft) {
  Cut cut(supported({4, 3, 3}, true), Element::p1, {200, 60, 1500});
  NotedSupports noted;
  CutLarge::Parts parts;
  parts.body = &cut.large.get(), parts.pairs = &cut.pairs, parts.follower = &noted;
  parts.supports = {cut.body.rest().triangles[0].data(), cut.foundation[0].data(),
                    static_cast<std::int32_t>(cut.body.rest().triangles.size())};
  parts.surface_nodes = cut.body.nodes() + 60, parts.first_reserve = cut.body.nodes();
  parts.capacity = {200, 60, 1500};
  CutLarge large;
  ASSERT_TRUE(large.create(cut.memory, parts, nullptr));
  std::mt19937 random(31);
  std::vector<Vec3> u(static_cast<std::size_t>(parts.surface_nodes));
  for (Vec3& at : u)
    for (int i = 0; i < 3; ++i) at[i] = static_cast<double>(random() % 2001) / 1000 - 1;
  int splits = 0;
  for (int step = 0; step < 50; ++step) {
    const OwnedChange change = random_split(cut.body, random);
    if (change.new_nodes.empty() || large.take_change(change.get(), false).outcome != CutOutcome::made) continue;
    cut.body.apply(change), ++splits;
    large.end_changes(false);
    const LargeBody left(cut.body.now(), Element::p1);
    NotedSupports right;
    for (std::int32_t p = 0; p < left.get().support_count; ++p) {
      const std::int32_t* const nodes = left.get().support_nodes + 2 * p;
      right.taken.push_back({nodes[0], nodes[1], {}});
      for (int i = 0; i < 9; ++i) right.taken.back().block.m[i / 3][i % 3] = left.get().support_stiffness[9 * p + i];
    }
    ASSERT_NEAR(noted.twice_energy(u) / right.twice_energy(u), 1, 1e-12) << "step " << step;
  }
  EXPECT_GT(splits, 20);
  // However often a node is grounded, no part is lost.
  const double before = noted.twice_energy(u);
  for (int k = 0; k < 2000; ++k) ASSERT_EQ(large.ground(40, 3, false), CutOutcome::made);
  large.end_changes(false);
  EXPECT_NEAR((noted.twice_energy(u) - before) / (6000 * dot(u[40], u[40])), 1, 1e-9);
}

// The tetrahedra beyond a plane get copies of a node on it.
OwnedChange split_along(const CutReference& body, std::int32_t node, int axis) {
  const auto along = static_cast<std::size_t>(axis);
  return body.split(node, [&](std::size_t e) { return body.centre(e)[along] > body.position(node)[along]; });
}

// Nodes on a plane, from the largest x to the smallest, that are not held.
std::vector<std::int32_t> nodes_of_plane(const ElasticBody& body, int axis, double at) {
  std::vector<std::int32_t> nodes;
  for (std::size_t n = 0; n < body.nodes.size(); ++n)
    if (std::abs(body.nodes[n][static_cast<std::size_t>(axis)] - at) < 1e-9 && !body.fixed[n][0])
      nodes.push_back(static_cast<std::int32_t>(n));
  std::sort(nodes.begin(), nodes.end(), [&](std::int32_t a, std::int32_t b) {
    const auto &p = body.nodes[static_cast<std::size_t>(a)], &q = body.nodes[static_cast<std::size_t>(b)];
    return std::pair(-p[0], a) < std::pair(-q[0], b);
  });
  return nodes;
}

std::vector<std::int32_t> nearest_tetrahedra(const CutReference& body, const std::array<double, 3>& at,
                                             std::size_t count) {
  std::vector<std::pair<double, std::int32_t>> found;
  for (std::size_t e = 0; e < body.corners().size(); ++e) {
    const auto c = body.centre(e);
    found.emplace_back(std::hypot(c[0] - at[0], c[1] - at[1], c[2] - at[2]), static_cast<std::int32_t>(e));
  }
  std::sort(found.begin(), found.end());
  std::vector<std::int32_t> result;
  for (std::size_t k = 0; k < count; ++k) result.push_back(found[k].second);
  return result;
}

// Old and new nodes, every `step`-th.
std::vector<std::int32_t> some_nodes(const CutReference& body, std::int32_t step) {
  std::vector<std::int32_t> nodes;
  for (std::int32_t n = body.nodes() - 1; n >= 0; n -= step) {
    bool used = false;
    for (std::size_t e = 0; e < body.corners().size() && !used; ++e)
      used = body.is_left(e) && std::ranges::find(body.corners()[e], n) != body.corners()[e].end();
    if (used) nodes.push_back(n);
  }
  return nodes;
}

// A plate of two layers that is cut between them.
ElasticBody plate(int width) {
  return two_tissues({width, width, 2}, 0.45, 0);
}

TEST(CutCompliance, IsExactAfterUpToThreeHundredSplitNodes) {
  for (const Element element : {Element::p1, Element::p1_anp}) {
    Cut cut(plate(18), element, {1083, 300, element == Element::p1 ? 930 : 2100});
    ASSERT_TRUE(cut.made);
    const std::vector<std::int32_t> nodes = nodes_of_plane(cut.body.rest(), 2, 0.01);
    ASSERT_GE(nodes.size(), 300u);
    for (std::size_t done = 0; done < 300;) {
      ASSERT_EQ(cut.apply(split_along(cut.body, nodes[done], 2)).outcome, CutOutcome::made);
      if (++done != 1 && done != 10 && done != 100 && done != 300) continue;
      const auto [compliance, force] = cut.errors(some_nodes(cut.body, 97));
      // Rounding grows with the rank; the limit that the method has to keep is 1e-4.
      EXPECT_LT(compliance, 1e-8) << done;
      EXPECT_LT(force, 1e-8) << done;
    }
    // Three a node, and two for each region that a plane divides there.
    EXPECT_LE(cut.compliance.rank(), element == Element::p1 ? 900 : 7 * 300);
  }
}

TEST(CutCompliance, IsExactAfterUpToAHundredRemovedTetrahedraAndWithSplitNodes) {
  for (const Element element : {Element::p1, Element::p1_anp})
    for (const bool mixed : {false, true}) {
      Cut cut(two_tissues({8, 6, 6}, 0.45), element, {441, 40, 900});
      ASSERT_TRUE(cut.made);
      const auto tetrahedra = nearest_tetrahedra(cut.body, {0.05, 0.03, 0.055}, 100);
      std::vector<std::int32_t> plane = nodes_of_plane(cut.body.rest(), 1, 0.06);
      for (std::size_t done = 0; done < 100;) {
        OwnedChange change;
        change.removed = {tetrahedra[done]};
        ASSERT_EQ(cut.apply(change).outcome, CutOutcome::made);
        if (mixed && done % 5 == 0) {
          const std::int32_t node = plane[done / 5];
          const OwnedChange split =
              cut.body.split(node, [&](std::size_t e) { return cut.body.centre(e)[2] > cut.body.position(node)[2]; });
          if (!split.new_nodes.empty()) {
            ASSERT_EQ(cut.apply(split).outcome, CutOutcome::made);
          }
        }
        if (++done != 1 && done != 10 && done != 100) continue;
        const auto [compliance, force] = cut.errors(some_nodes(cut.body, 31));
        EXPECT_LT(compliance, 1e-8) << done;
        EXPECT_LT(force, 1e-8) << done;
      }
    }
}

TEST(CutCompliance, OfOneCutIsTheSameInAnyOrder) {
  for (const Element element : kElements) {
    std::vector<Eigen::MatrixXd> found;
    for (const unsigned seed : {1u, 2u, 3u}) {
      Cut cut(two_tissues({5, 4, 4}, 0.4, 0), element, {150, 30, 1200});
      ASSERT_TRUE(cut.made);
      const auto burnt = nearest_tetrahedra(cut.body, {0.045, 0.01, 0.03}, 12);
      struct Step {
        std::int32_t node, tetrahedron;
      };
      std::vector<Step> steps;
      for (const auto n : nodes_of_plane(cut.body.rest(), 2, 0.02)) steps.push_back({n, -1});
      for (const auto e : burnt) steps.push_back({-1, e});
      std::mt19937 random(seed);
      std::shuffle(steps.begin(), steps.end(), random);
      for (const Step& step : steps) {
        OwnedChange change;
        if (step.node >= 0)
          change = split_along(cut.body, step.node, 2);
        else
          change.removed = {step.tetrahedron};
        ASSERT_EQ(cut.apply(change).outcome, CutOutcome::made);
      }
      found.push_back(cut.answer({140, 137, 88, 60, 7}));
    }
    for (const auto& other : found) EXPECT_LT((other - found[0]).norm(), 1e-9 * found[0].norm());
  }
}

TEST(CutCompliance, AForceGivesTheFieldOfTheCutBodyAtAllNodes) {
  Cut cut(two_tissues({6, 4, 4}, 0.45), Element::p1_anp, {175, 30, 600});
  for (const auto n : nodes_of_plane(cut.body.rest(), 2, 0.02)) {
    if (cut.body.position(n)[0] < 0.03) continue;
    const OwnedChange change = split_along(cut.body, n, 2);
    if (!change.new_nodes.empty()) {
      ASSERT_EQ(cut.apply(change).outcome, CutOutcome::made);
    }
  }
  const std::int32_t all = cut.body.nodes(), rest = static_cast<std::int32_t>(cut.body.rest().nodes.size());
  ASSERT_GT(all, rest + 10);
  const std::vector<std::pair<std::int32_t, Vec3>> forces = {{all - 1, {0.2, -0.1, 0.5}}, {100, {0.1, 0.3, 0}}};
  Eigen::VectorXd load = Eigen::VectorXd::Zero(3 * all), folded = Eigen::VectorXd::Zero(3 * rest);
  cut.compliance.begin_forces();
  for (const auto& [node, force] : forces) {
    ASSERT_TRUE(cut.compliance.find_response(node, cut.response[0].data()));
    cut.compliance.add_force(cut.response[0].data(), force);
    for (int i = 0; i < 3; ++i) {
      load[3 * node + i] += force[i];
      folded[3 * cut.compliance.tissue().origin(node) + i] += force[i];
    }
  }
  cut.compliance.end_forces();
  for (std::int32_t s = 0; s < cut.compliance.slots(); ++s)
    for (int i = 0; i < 3; ++i) folded[3 * cut.compliance.node_of_slot(s) + i] += cut.compliance.pseudo_force(s)[i];
  const Eigen::VectorXd field = cut.uncut.solve(folded);
  const Eigen::VectorXd right = FactoredBody(cut.body.now(), cut.element).solve(load);
  for (std::int32_t n = 0; n < all; ++n)
    for (int i = 0; i < 3; ++i) {
      const double is = field[3 * cut.compliance.tissue().origin(n) + i] + cut.compliance.jump(n)[i];
      EXPECT_NEAR(is, right[3 * n + i], 1e-9 * right.cwiseAbs().maxCoeff()) << n;
    }
}

TEST(CutCompliance, APieceThatWouldComeLooseIsToldAndGroundedFirst) {
  for (const Element element : {Element::p1, Element::p1_anp})
    for (const bool single : {false, true}) {
      CutCapacity capacity{63, 12, 400};
      if (single) capacity.least_share = 2e-3;
      Cut cut(two_tissues({6, 2, 2}, 0.4, 0), element, capacity, single);
      const auto section = nodes_of_plane(cut.body.rest(), 0, 0.03);
      ASSERT_EQ(section.size(), 9u);
      std::size_t done = 0;
      CutResult result;
      for (; done < section.size(); ++done) {
        result = cut.apply(split_along(cut.body, section[done], 0));
        if (result.outcome != CutOutcome::made) break;
      }
      ASSERT_EQ(result.outcome, CutOutcome::loose);
      EXPECT_EQ(done, 7u);  // one of the last two nodes would be left, with two dofs at the end: not enough
      EXPECT_LT(result.least_share, single ? 2e-3 : 1e-10);
      // It has changed nothing: the body still hangs on two nodes and the dofs held at its end, and answers as it should.
      const auto nodes = some_nodes(cut.body, 5);
      EXPECT_LT(cut.errors(nodes).first, single ? 0.02 : 1e-8);
      if (single) continue;
      ElasticBody grounded = cut.body.rest();
      SpringSet springs{"held", {}};
      for (const auto& p : {std::array{0.06, 0.0, 0.0}, {0.06, 0.02, 0.0}, {0.06, 0.0, 0.02}}) {
        const auto at = std::ranges::find(grounded.nodes, p, [](const auto& q) {
          return std::array{std::round(q[0] * 1e6) / 1e6, std::round(q[1] * 1e6) / 1e6, std::round(q[2] * 1e6) / 1e6};
        });
        ASSERT_NE(at, grounded.nodes.end());
        const auto node = static_cast<std::int32_t>(at - grounded.nodes.begin());
        springs.springs.push_back({node, Spring::kWorld, 30});
        ASSERT_EQ(cut.compliance.ground(node, 30), CutOutcome::made);
      }
      for (; done < section.size(); ++done)
        ASSERT_EQ(cut.apply(split_along(cut.body, section[done], 0)).outcome, CutOutcome::made);
      ElasticBody now = cut.body.now();
      now.springs.push_back(springs);
      const Eigen::MatrixXd columns = FactoredBody(now, element).columns(nodes);
      const Eigen::MatrixXd is = cut.answer(nodes);
      for (std::size_t k = 0; k < nodes.size(); ++k) {
        const auto row = 3 * static_cast<Eigen::Index>(k);
        EXPECT_LT((is.middleRows(row, 3) - columns.middleRows(3 * nodes[k], 3)).norm(), 1e-7 * is.norm());
      }
    }
}

// Three tetrahedra in a row, held at one end.
TEST(CutCompliance, ATetrahedronThatIsNotRemovedLeavesNothingBehind) {
  ElasticBody body;
  body.nodes = {{0, 0, 0}, {0.01, 0, 0}, {0, 0.01, 0}, {0, 0, 0.01}, {0.01, 0.01, 0.01}, {0.02, 0.01, 0}};
  body.tetrahedra = {{0, 1, 2, 3}, {1, 2, 3, 4}, {1, 4, 2, 5}};
  for (auto& t : body.tetrahedra) {
    Eigen::Matrix3d edges;
    for (int a = 0; a < 3; ++a)
      for (int i = 0; i < 3; ++i)
        edges(a, i) =
            body.nodes[static_cast<std::size_t>(t[static_cast<std::size_t>(a) + 1])][static_cast<std::size_t>(i)] -
            body.nodes[static_cast<std::size_t>(t[0])][static_cast<std::size_t>(i)];
    if (edges.determinant() < 0) std::swap(t[2], t[3]);
  }
  body.region = {0, 0, 0}, body.materials = {{5000, 0.4, 0}}, body.fixed.resize(6), body.surface_count = 6;
  for (const std::size_t n : {0, 2, 3}) body.fixed[n] = {1, 1, 1};
  for (const Element element : kElements) {
    Cut cut(body, element, {6, 0, 100});
    ASSERT_TRUE(cut.made);
    const std::vector<std::int32_t> nodes = {1, 4, 5};
    const Eigen::MatrixXd before = cut.answer(nodes);
    EXPECT_LT((before - cut.truth(nodes)).norm(), 1e-9 * before.norm());
    // Node 5 hangs on the last tetrahedron alone, with too little room for its columns after it was grounded.
    Cut small(body, element, {6, 0, 5});
    const Eigen::MatrixXd whole = small.answer(nodes);
    const std::int32_t last = 2;
    EXPECT_EQ(small.compliance.apply({nullptr, nullptr, &last, 0, 0, 1}).outcome, CutOutcome::full);
    // Rounding, times how much stiffer the grounded node was for a while: 3e-11.
    EXPECT_LT((small.answer(nodes) - whole).norm(), 1e-9 * whole.norm());
  }
}

TEST(CutCompliance, ChangesThatDoNotFitAreNotMade) {
  const std::vector<std::int32_t> few = [] {
    std::vector<std::int32_t> nodes;
    for (std::int32_t n = 0; n < 140; ++n) nodes.push_back(n);
    return nodes;
  }();
  Cut cut(two_tissues({4, 4, 4}, 0.4), Element::p1, {125, 2, 30});
  const std::vector<std::int32_t> plane = nodes_of_plane(cut.body.rest(), 2, 0.02);
  const auto nodes = std::vector<std::int32_t>{3, 60, 100};
  const Eigen::MatrixXd before = cut.answer(nodes);
  OwnedChange wrong = split_along(cut.body, plane[0], 2);
  wrong.new_nodes[0].node += 1;
  EXPECT_EQ(cut.compliance.apply(wrong.get()).outcome, CutOutcome::wrong);
  wrong = split_along(cut.body, plane[0], 2);
  wrong.new_nodes[0].from = plane[1];
  EXPECT_EQ(cut.compliance.apply(wrong.get()).outcome, CutOutcome::wrong);
  const std::int32_t none = 100000;
  EXPECT_EQ(cut.compliance.apply({nullptr, nullptr, &none, 0, 0, 1}).outcome, CutOutcome::wrong);
  EXPECT_EQ((cut.answer(nodes) - before).norm(), 0);

  ASSERT_EQ(cut.apply(split_along(cut.body, plane[0], 2)).outcome, CutOutcome::made);
  ASSERT_EQ(cut.apply(split_along(cut.body, plane[1], 2)).outcome, CutOutcome::made);
  const Eigen::MatrixXd made = cut.answer(nodes);
  EXPECT_EQ(cut.apply(split_along(cut.body, plane[2], 2)).outcome, CutOutcome::full);
  OwnedChange removal;
  for (std::int32_t e = 0; e < 384; e += 40) removal.removed.push_back(e);
  const CutResult result = cut.compliance.apply(removal.get());
  EXPECT_EQ(result.outcome, CutOutcome::full);
  ASSERT_LT(result.removed, 10);
  for (std::int32_t k = 0; k < result.removed; ++k) {
    OwnedChange one;
    one.removed = {removal.removed[static_cast<std::size_t>(k)]};
    cut.body.apply(one);
  }
  EXPECT_LT(cut.errors(nodes).first, 1e-9);  // of what was made

  Cut partly(two_tissues({4, 4, 4}, 0.4), Element::p1, {125, 2, 300}, false, {0, 1, 2, 3});
  EXPECT_EQ(partly.apply(split_along(partly.body, plane[0], 2)).outcome, CutOutcome::no_column);
}

// Another one begins at rank 0 as the first one is, with the compliance of the cut body between all nodes.
TEST(CutCompliance, GoesOnFromARebasedCompliance) {
  for (const Element element : kElements) {
    const CutCapacity capacity = {180, 30, 700};
    Cut cut(two_tissues({5, 4, 4}, 0.4, 0), element, capacity);
    const auto plane = nodes_of_plane(cut.body.rest(), 2, 0.02);
    const std::size_t third = plane.size() / 3;
    CutCompliance next;
    ASSERT_TRUE(next.create(cut.memory, cut.large.get(), cut.pairs, capacity, cut.surface()));
    std::vector<std::unique_ptr<StoredPairs>> pairs;
    for (std::size_t k = 0; k < plane.size(); ++k) {
      if (k > 0 && k % third == 0) {
        const std::vector<std::int32_t> nodes = all_of(cut.body.nodes());
        pairs.push_back(std::make_unique<StoredPairs>(cut.answer(nodes), nodes, cut.body.nodes(), false));
        next.begin_from(cut.compliance, *pairs.back());
        std::swap(cut.compliance, next);
        EXPECT_EQ(cut.compliance.rank(), 0);
      }
      ASSERT_EQ(cut.apply(split_along(cut.body, plane[k], 2)).outcome, CutOutcome::made);
    }
    EXPECT_EQ(pairs.size(), 3u);
    EXPECT_LT(cut.errors(some_nodes(cut.body, 11)).first, 1e-9);
    cut.compliance.forget();
    EXPECT_EQ(cut.compliance.tissue().base_nodes(), cut.compliance.tissue().rest_nodes());
  }
}

// Rows of a bundle for some nodes: fields of unit displacements of surface nodes, fields of unit forces of nodes inside.
TEST(CutCompliance, ReadsTheTensorsOfABundle) {
  const ElasticBody body = two_tissues({4, 4, 4}, 0.4);
  const FactoredBody factored(body, Element::p1_anp);
  const auto surface = static_cast<std::size_t>(body.surface_count), inside = body.nodes.size() - surface;
  std::vector<std::int32_t> corridor_nodes, column_of_node(body.nodes.size(), -1);
  for (std::size_t n = surface; n < body.nodes.size(); ++n) corridor_nodes.push_back(static_cast<std::int32_t>(n));
  const Eigen::MatrixXd c = factored.columns(all_of(static_cast<std::int32_t>(body.nodes.size())));
  std::vector<double> rows(body.touchable.size() * 9 * surface), stiffness(9 * body.touchable.size());
  std::vector<float> corridor_rows(inside * 9 * surface), between(inside * 9 * inside);
  for (std::size_t k = 0; k < body.touchable.size(); ++k) {
    const auto at = 3 * static_cast<Eigen::Index>(body.touchable[k]);
    column_of_node[static_cast<std::size_t>(body.touchable[k])] = static_cast<std::int32_t>(k);
    Eigen::Matrix3d own = c.block<3, 3>(at, at);
    for (int i = 0; i < 3; ++i)
      if (own(i, i) == 0) own(i, i) = 1;
    Eigen::Matrix3d t = own.inverse();
    for (int i = 0; i < 3; ++i)
      if (c(at + i, at + i) == 0) t(i, i) = 0;
    const Eigen::MatrixXd field = c.block(0, at, c.rows(), 3) * t;
    for (int i = 0; i < 9; ++i) stiffness[9 * k + static_cast<std::size_t>(i)] = t(i / 3, i % 3);
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t d = 0; d < 3 * surface; ++d)
        rows[(3 * k + j) * 3 * surface + d] = field(static_cast<Eigen::Index>(d), static_cast<Eigen::Index>(j));
  }
  for (std::size_t k = 0; k < inside; ++k) {
    column_of_node[surface + k] = static_cast<std::int32_t>(body.touchable.size() + k);
    for (std::size_t j = 0; j < 3; ++j) {
      const auto column = static_cast<Eigen::Index>(3 * (surface + k) + j);
      for (std::size_t d = 0; d < 3 * surface; ++d)
        corridor_rows[(3 * k + j) * 3 * surface + d] = static_cast<float>(c(static_cast<Eigen::Index>(d), column));
      for (std::size_t d = 0; d < 3 * inside; ++d)
        between[(3 * k + j) * 3 * inside + d] =
            static_cast<float>(c(static_cast<Eigen::Index>(3 * surface + d), column));
    }
  }
  Corridor corridor;
  corridor.count = static_cast<std::int32_t>(inside), corridor.nodes = corridor_nodes.data();
  corridor.compliance = between.data(), corridor.node_of_column = body.touchable.data();
  corridor.surface = {corridor_rows.data(), formats::ElementType::f32, nullptr, body.surface_count};
  Tensors tensors;
  tensors.surface = {rows.data(), formats::ElementType::f64, nullptr, body.surface_count};
  tensors.stiffness = stiffness.data(), tensors.surface_nodes = body.surface_count;
  tensors.columns = static_cast<std::int32_t>(body.touchable.size()), tensors.corridor = &corridor;
  const TensorPairs pairs(tensors, column_of_node.data());
  std::vector<std::int32_t> known;
  for (std::size_t n = 0; n < body.nodes.size(); ++n)
    if (column_of_node[n] >= 0) known.push_back(static_cast<std::int32_t>(n));
  std::vector<double> read(9 * known.size());
  for (std::size_t at = 0; at < known.size(); at += 5) {
    const std::int32_t node = known[at];
    ASSERT_TRUE(pairs.read(node, known.data(), static_cast<std::int32_t>(known.size()), read.data(), 3 * known.size()));
    for (std::size_t k = 0; k < known.size(); ++k)
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          ASSERT_NEAR(read[static_cast<std::size_t>(i) * 3 * known.size() + 3 * k + static_cast<std::size_t>(j)],
                      c(3 * node + i, 3 * known[k] + j), 2e-7 * c.cwiseAbs().maxCoeff())  // single precision inside
              << node << ' ' << known[k];
  }
  const std::int32_t held = 0;
  ASSERT_LT(column_of_node[0], 0);
  EXPECT_FALSE(pairs.read(known[0], &held, 1, read.data(), 3));
}

// Two arms of height h and length a, which forces at their ends draw apart. Modified beam theory of an elastic isotropic body (ISO 15024;
// Hashemi, Kinloch and Williams 1990): an opening of 8 F (a + chi h)^3 / (E b h^3), chi for shear and for the rotation at the root.
TEST(CutCompliance, ADoubleCantileverBeamThatIsCutOpensAsBeamTheorySays) {
  constexpr int height = 8, length = 9 * height;  // cells, of an arm
  constexpr double cell = 0.0005, young = 1e6, h = height * cell, b = cell;
  const TetrahedralMesh mesh = box_mesh({length, 1, 2 * height}, {length * cell, b, 2 * h}, 0);
  const ElasticBody beam = held_body(mesh, {{young, 0, 0}}, [](const auto& p) { return p[0] == 0 ? 7 : 0; });
  const double gamma = 1.18 * 2, part = gamma / (1 + gamma), chi = std::sqrt(2.0 / 11 * (3 - 2 * part * part));
  const std::vector<std::int32_t> plane = nodes_of_plane(beam, 2, h);
  std::vector<std::int32_t> columns, ends;
  for (std::size_t n = 0; n < beam.nodes.size(); ++n) {
    const auto& p = beam.nodes[n];
    const double from_plane = std::abs(p[2] - h);
    const bool is_end = std::abs(p[0] - length * cell) < 1e-9 && std::abs(from_plane - h / 2) < 1e-9;
    // What a split node of the averaging element couples: two cells around it.
    if (is_end || (from_plane < 2.5 * cell && p[0] > 3 * h)) columns.push_back(static_cast<std::int32_t>(n));
    if (is_end) ends.push_back(static_cast<std::int32_t>(n));
  }
  ASSERT_EQ(ends.size(), 4u);
  std::sort(ends.begin(), ends.end(), [&](std::int32_t l, std::int32_t r) {
    return beam.nodes[static_cast<std::size_t>(l)][2] < beam.nodes[static_cast<std::size_t>(r)][2];
  });
  for (const Element element : {Element::p1, Element::p1_anp}) {
    Cut cut(beam, element, {500, 100, 700}, false, columns);
    // Opening of the ends per unit force on each arm.
    const auto opening = [&] {
      Eigen::VectorXd force = Eigen::VectorXd::Zero(12);
      for (Eigen::Index k = 0; k < 4; ++k) force[3 * k + 2] = k < 2 ? -0.5 : 0.5;
      return force.dot(cut.answer(ends) * force);
    };
    std::vector<double> at, is;
    std::size_t done = 0;
    for (const double in_heights : {3.5, 4.5, 5.5}) {
      const double a = in_heights * h;
      // The nodes where the cut ends are not split.
      while (beam.nodes[static_cast<std::size_t>(plane[done])][0] > length * cell - a + 1e-9)
        ASSERT_EQ(cut.apply(split_along(cut.body, plane[done++], 2)).outcome, CutOutcome::made);
      at.push_back(a), is.push_back(opening());
      // What eight elements across an arm leave: p1 is stiffer than p1-anp.
      EXPECT_NEAR(is.back() / (8 * std::pow(a + chi * h, 3) / (young * b * h * h * h)), 1, 0.05) << a;
    }
    for (std::size_t k = 1; k < at.size(); ++k) {
      // Energy release rate for a unit force, J/m^2: half the change of the opening, for each area that was cut.
      const double rate = (is[k] - is[k - 1]) / (at[k] - at[k - 1]) / (2 * b);
      const double arm = (at[k] + at[k - 1]) / 2 + chi * h;
      EXPECT_NEAR(rate / (12 * arm * arm / (young * b * b * h * h * h)), 1, 0.05) << at[k];
    }
  }
}

}  // namespace
}  // namespace palpate::tests
