// A shaft that no mesh resolves, held by a block of gel: its stiffness on a coarse mesh and on one of half its edges, with what the needle adds
// for what the mesh does not resolve (runtime/needles/needle.h), and without.
#include <Eigen/Sparse>

#include "studies/coupled/coupled_rows.h"
#include "tests/precompute/support.h"

namespace palpate::tests {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;

constexpr double kYoung = 3000, kPoisson = 0.45;

void hold_bottom(ElasticBody& body) {
  hold(body, [](const auto& p) { return p[2] == 0 ? 7 : 0; });
}

// The rows and columns of k whose place is not -1, in these places.
Eigen::SparseMatrix<double> within(const BlockMatrix& k, const std::vector<int>& place, std::size_t count) {
  std::vector<Eigen::Triplet<double>> entries;
  for (std::int32_t row = 0; row < k.rows; ++row)
    for (auto at = k.first[row]; at < k.first[row + 1]; ++at)
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          if (const int a = place[3 * row + i], b = place[3 * k.column[at] + j]; a >= 0 && b >= 0)
            entries.emplace_back(a, b, k.block[at][3 * i + j]);
  Eigen::SparseMatrix<double> matrix(static_cast<Index>(count), static_cast<Index>(count));
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

// A cube of 60 mm that is held at its bottom.
class PiercedBlock {
 public:
  explicit PiercedBlock(int cells)
      : body_(body_of(box_mesh({cells, cells, cells}, {0.06, 0.06, 0.06}), {{kYoung, kPoisson, 0}})) {
    hold_bottom(body_);
    free_ = free_dofs(body_);
    std::vector<int> place(3 * body_.nodes.size(), -1);
    for (std::size_t i = 0; i < free_.size(); ++i) place[static_cast<std::size_t>(free_[i])] = static_cast<int>(i);
    const BlockMatrix k = assemble_stiffness(body_, Element::p1_anp);
    factor_.compute(within(k, place, free_.size()));
  }

  // N/m, by which a shaft that comes down from the top at x, y for 40 mm, and holds a place each 2.5 mm, resists where it
  // moves across itself (axis 0) and along itself (axis 2).
  double stiffness(double x, double y, int axis, bool with_unresolved, double radius) const {
    constexpr double kSpacing = 2.5e-3;
    std::vector<studies::Row> rows;
    for (int i = 0; i < 16; ++i) {
      const studies::PlaceInside place =
          studies::place_inside(body_.nodes, body_.tetrahedra, {x, y, 0.06 - kSpacing * (i + 0.5)});
      for (int d = 0; d < 3; ++d) {
        studies::Row& row = rows.emplace_back();
        for (int k = 0; k < 4; ++k) row.add(0, place.node[k], place.weight[k] * Vector3d::Unit(d));
        row.target = d == axis;
        if (with_unresolved)
          row.softness = (d == 2 ? studies::softness_along_shaft : studies::softness_across_shaft)(
              kYoung, kPoisson, place.edge, radius, kSpacing);
        else
          row.softness = 1e-6;  // several places in one tetrahedron contradict one another
      }
    }
    const studies::CoupledAnswer full = studies::solve_coupled(
        rows, {{[this](const MatrixXd& loads) { return under(loads); }, static_cast<Index>(3 * body_.nodes.size())}});
    double sum = 0;
    for (Index i = axis; i < full.force.size(); i += 3) sum += full.force[i];
    return sum;
  }

  // The mean over places that lie differently between the nodes.
  double mean_stiffness(int axis, bool with_unresolved, double radius = 0.5e-3) const {
    double sum = 0;
    for (const auto& [x, y] : {std::pair{0.030, 0.030}, {0.0312, 0.0295}, {0.0331, 0.0287}, {0.0287, 0.0322}})
      sum += stiffness(x, y, axis, with_unresolved, radius) / 4;
    return sum;
  }

 private:
  MatrixXd under(const MatrixXd& loads) const {
    const MatrixXd solved = factor_.solve(MatrixXd(loads(free_, Eigen::all)));
    MatrixXd u = MatrixXd::Zero(loads.rows(), loads.cols());
    u(free_, Eigen::all) = solved;
    return u;
  }

  ElasticBody body_;
  std::vector<Index> free_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor_;
};

// The same of a mesh that resolves the shaft, whose nodes are 0.5 mm apart there: those within the radius are held.
double resolved_stiffness(int axis, double radius) {
  const std::vector<double> aside = {0, .5, 1, 1.5, 2.2, 3.3, 5, 8, 13, 20, 30};  // mm from the axis
  std::vector<double> up = {0, 10, 16};
  for (int i = 16; i >= 0; --i) up.push_back(60 - 2.5 * i);
  const int n = static_cast<int>(aside.size()) - 1, levels = static_cast<int>(up.size()) - 1;
  TetrahedralMesh mesh = box_mesh({2 * n, 2 * n, levels}, {2.0 * n, 2.0 * n, 1.0 * levels});
  const auto at = [](const std::vector<double>& of, double i) {
    return std::copysign(1e-3 * of[static_cast<std::size_t>(std::lround(std::abs(i)))], i);
  };
  for (auto& p : mesh.nodes) p = {at(aside, p[0] - n), at(aside, p[1] - n), at(up, p[2])};
  ElasticBody body = body_of(mesh, {{kYoung, kPoisson, 0}});
  hold_bottom(body);
  const BlockMatrix k = assemble_stiffness(body, Element::p1_anp);
  Eigen::VectorXd u = Eigen::VectorXd::Zero(3 * k.rows);
  std::vector<int> free(3 * body.nodes.size(), -1), all(3 * body.nodes.size());
  int count = 0;
  for (std::size_t v = 0; v < body.nodes.size(); ++v) {
    const auto& p = body.nodes[v];
    const bool of_shaft = std::hypot(p[0], p[1]) < 1.001 * radius && p[2] > 0.0199;
    u[static_cast<Index>(3 * v) + axis] = of_shaft;
    for (std::size_t i = 3 * v; i < 3 * v + 3; ++i) {
      all[i] = static_cast<int>(i);
      if (!of_shaft && !body.fixed[v][i % 3]) free[i] = count++;
    }
  }
  const Eigen::SparseMatrix<double> whole = within(k, all, all.size()),
                                    inner = within(k, free, static_cast<std::size_t>(count));
  const Eigen::VectorXd force = whole * u;
  Eigen::VectorXd right(count);
  for (std::size_t i = 0; i < free.size(); ++i)
    if (free[i] >= 0) right[free[i]] = -force[static_cast<Index>(i)];
  Eigen::ConjugateGradient<Eigen::SparseMatrix<double>, Eigen::Lower | Eigen::Upper> solver;
  solver.setTolerance(1e-6);
  const Eigen::VectorXd inside = solver.compute(inner).solve(right), shaft = u;
  for (std::size_t i = 0; i < free.size(); ++i)
    if (free[i] >= 0) u[static_cast<Index>(i)] = inside[free[i]];
  return shaft.dot(whole * u);  // the force of the nodes that have moved by 1 along the axis
}

TEST(Shaft, IsAsStiffAsWhereAMeshResolvesIt) {
  const PiercedBlock coarse(6);
  for (const int axis : {0, 2}) {
    const double found = coarse.mean_stiffness(axis, true, 1e-3) / resolved_stiffness(axis, 1e-3) - 1;
    RecordProperty(axis == 0 ? "across" : "along", std::to_string(found));
    // The fine mesh has a shaft that is wider by its blur, some 0.1 mm, which is 2 to 3 % of the stiffness. Measured: 6 and 4.5 % below it.
    EXPECT_LT(std::abs(found), 0.08) << axis;
  }
}

TEST(Shaft, ThatNoMeshResolvesIsAsStiffOnAFineMeshAsOnACoarseOne) {
  const PiercedBlock coarse(6), fine(12);  // edges of 10 and 5 mm
  const auto apart = [&](int axis, bool with) {
    return std::abs(coarse.mean_stiffness(axis, with) / fine.mean_stiffness(axis, with) - 1);
  };
  const double across = apart(0, true), along = apart(2, true), without_across = apart(0, false),
               without_along = apart(2, false);
  RecordProperty("across", std::to_string(across));
  RecordProperty("along", std::to_string(along));
  RecordProperty("without_across", std::to_string(without_across));
  RecordProperty("without_along", std::to_string(without_along));
  // A shaft that moves along itself pulls at the surface too, which a coarse mesh shows worse: 3.5 % measured, across 0.5 %. Halving the edges
  // moves ln(R / r) by ln 2 of 1.8: without the compliance 25 % and 40 %.
  EXPECT_LT(across, 0.02);
  EXPECT_LT(along, 0.05);
  EXPECT_GT(without_across, 8 * across);
  EXPECT_GT(without_along, 6 * along);
}

}  // namespace
}  // namespace palpate::tests
