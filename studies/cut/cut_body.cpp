#include "studies/cut/cut_body.h"

#include <Eigen/CholmodSupport>
#include <algorithm>
#include <map>

namespace palpate {

CutChange OwnedChange::get() const {
  return {new_nodes.data(),
          moved.data(),
          removed.data(),
          static_cast<std::int32_t>(new_nodes.size()),
          static_cast<std::int32_t>(moved.size()),
          static_cast<std::int32_t>(removed.size())};
}

CutReference::CutReference(ElasticBody rest)
    : body_(rest),
      rest_(std::move(rest)),
      left_(body_.tetrahedra.size(), 1),
      share_(body_.nodes.size(), 1),
      below_(body_.triangles.size(), 0) {
  for (std::size_t n = 0; n < body_.nodes.size(); ++n) origin_.push_back(static_cast<std::int32_t>(n));
  std::map<std::array<std::int32_t, 3>, std::size_t> of_face;
  for (std::size_t e = 0; e < body_.tetrahedra.size(); ++e)
    for (std::size_t c = 0; c < 4; ++c) {
      const auto& t = body_.tetrahedra[e];
      std::array<std::int32_t, 3> face = {t[(c + 1) % 4], t[(c + 2) % 4], t[(c + 3) % 4]};
      std::ranges::sort(face);
      of_face[face] = e;
    }
  for (std::size_t t = 0; t < body_.triangles.size(); ++t) {
    std::array<std::int32_t, 3> face = body_.triangles[t];
    std::ranges::sort(face);
    below_[t] = of_face.at(face);
  }
}

void CutReference::apply(const OwnedChange& change) {
  for (const auto& made : change.new_nodes) {
    const auto from = static_cast<std::size_t>(made.from);
    body_.nodes.push_back(body_.nodes[from]);
    body_.fixed.push_back(body_.fixed[from]);
    origin_.push_back(origin_[from]);
    share_.push_back(0);
  }
  for (const auto& moved : change.moved)
    std::copy(moved.corners, moved.corners + 4, body_.tetrahedra[static_cast<std::size_t>(moved.tetrahedron)].begin());
  for (const auto& made : change.new_nodes) {
    const double goes = volume_at(made.node), stays = volume_at(made.from);
    double& of = share_[static_cast<std::size_t>(made.from)];
    share_[static_cast<std::size_t>(made.node)] = goes / (goes + stays) * of;
    of *= stays / (goes + stays);
  }
  for (const auto e : change.removed) {
    double before[4];
    const auto& corners = body_.tetrahedra[static_cast<std::size_t>(e)];
    for (std::size_t a = 0; a < 4; ++a) before[a] = volume_at(corners[a]);
    left_[static_cast<std::size_t>(e)] = 0;
    for (std::size_t a = 0; a < 4; ++a)
      share_[static_cast<std::size_t>(corners[a])] *= volume_at(corners[a]) / before[a];
  }
}

double CutReference::volume_at(std::int32_t node) const {
  double sum = 0;
  for (std::size_t e = 0; e < body_.tetrahedra.size(); ++e) {
    const auto& t = body_.tetrahedra[e];
    if (!left_[e] || std::ranges::find(t, node) == t.end()) continue;
    Eigen::Matrix3d edges;
    for (std::size_t v = 0; v < 3; ++v)
      for (std::size_t i = 0; i < 3; ++i)
        edges(static_cast<int>(i), static_cast<int>(v)) = position(t[v + 1])[i] - position(t[0])[i];
    sum += std::abs(edges.determinant()) / 6;
  }
  return sum;
}

Eigen::VectorXd CutReference::divided(const Eigen::VectorXd& load) const {
  Eigen::VectorXd all(3 * nodes());
  for (std::int32_t n = 0; n < nodes(); ++n)
    all.segment<3>(3 * n) =
        share_[static_cast<std::size_t>(n)] * load.segment<3>(3 * origin_[static_cast<std::size_t>(n)]);
  return all;
}

std::array<double, 3> CutReference::centre(std::size_t e) const {
  std::array<double, 3> sum{};
  for (const auto n : body_.tetrahedra[e])
    for (std::size_t i = 0; i < 3; ++i) sum[i] += body_.nodes[static_cast<std::size_t>(n)][i] / 4;
  return sum;
}

ElasticBody CutReference::now() const {
  ElasticBody result = body_;
  result.tetrahedra.clear(), result.region.clear();
  for (std::size_t e = 0; e < body_.tetrahedra.size(); ++e)
    if (left_[e]) result.tetrahedra.push_back(body_.tetrahedra[e]), result.region.push_back(body_.region[e]);
  for (std::size_t t = 0; t < body_.triangles.size(); ++t)
    for (auto& node : result.triangles[t])
      for (const auto corner : body_.tetrahedra[below_[t]])
        if (origin_[static_cast<std::size_t>(corner)] ==
            rest_.triangles[t][static_cast<std::size_t>(&node - result.triangles[t].data())])
          node = corner;
  for (auto& foundation : result.foundations)
    std::erase_if(foundation.triangles, [&](std::int32_t t) { return !left_[below_[static_cast<std::size_t>(t)]]; });
  if (rest_.springs.empty()) return result;
  const auto shares = shares_of_springs();
  for (auto& set : result.springs) {
    std::vector<Spring> divided;
    for (const Spring& spring : set.springs)
      for (const auto& [a, share_a] : shares[static_cast<std::size_t>(spring.a)]) {
        Spring part = spring;
        part.a = a;
        if (spring.b == Spring::kWorld) {
          part.stiffness = share_a * spring.stiffness;
          divided.push_back(part);
          continue;
        }
        for (const auto& [b, share_b] : shares[static_cast<std::size_t>(spring.b)]) {
          part.b = b, part.stiffness = share_a * share_b * spring.stiffness;
          divided.push_back(part);
        }
      }
    set.springs = divided;
  }
  return result;
}

// Of each node at rest: the nodes at its place with their shares.
std::vector<std::vector<std::pair<std::int32_t, double>>> CutReference::shares_of_springs() const {
  std::vector<char> has(rest_.nodes.size(), 0);
  for (const auto& set : rest_.springs)
    for (const Spring& spring : set.springs) {
      has[static_cast<std::size_t>(spring.a)] = 1;
      if (spring.b != Spring::kWorld) has[static_cast<std::size_t>(spring.b)] = 1;
    }
  std::vector<std::map<std::int32_t, double>> own(rest_.nodes.size()), any(rest_.nodes.size());
  for (std::size_t t = 0; t < rest_.triangles.size(); ++t) {
    const auto& rest = rest_.triangles[t];
    const bool all = std::ranges::all_of(rest, [&](std::int32_t n) { return has[static_cast<std::size_t>(n)] != 0; });
    const double area = area_of(rest_, {"", 0, 0, {static_cast<std::int32_t>(t)}});
    for (const auto corner : body_.tetrahedra[below_[t]]) {
      const auto at = origin_[static_cast<std::size_t>(corner)];
      if (std::ranges::find(rest, at) == rest.end()) continue;
      any[static_cast<std::size_t>(at)][corner] += area;
      if (all) own[static_cast<std::size_t>(at)][corner] += area;
    }
  }
  std::vector<std::vector<std::pair<std::int32_t, double>>> shares(rest_.nodes.size());
  for (std::size_t n = 0; n < rest_.nodes.size(); ++n) {
    const auto& areas = own[n].empty() ? any[n] : own[n];
    double sum = 0;
    for (const auto& [node, area] : areas) sum += area;
    for (const auto& [node, area] : areas) shares[n].emplace_back(node, area / sum);
    if (areas.empty()) shares[n].emplace_back(static_cast<std::int32_t>(n), 1);
  }
  return shares;
}

struct FactoredBody::Factor {
  Eigen::CholmodSupernodalLLT<Eigen::SparseMatrix<double>> of;
};

FactoredBody::FactoredBody(const ElasticBody& body, Element element) : factor_(std::make_unique<Factor>()) {
  const Discretisation discretisation = discretise(body, element);
  const BlockMatrix& k = discretisation.stiffness;
  const std::size_t dofs = 3 * body.nodes.size();
  row_.assign(dofs, -1);
  int rows = 0;
  for (std::size_t d = 0; d < dofs; ++d)
    if (!body.fixed[d / 3][d % 3]) row_[d] = rows++;
  std::vector<char> used(body.nodes.size(), 0);
  for (const auto& t : body.tetrahedra)
    for (const auto n : t) used[static_cast<std::size_t>(n)] = 1;
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t r = 0; r < static_cast<std::size_t>(k.rows); ++r)
    for (auto at = k.first[r]; at < k.first[r + 1]; ++at)
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j) {
          const int row = row_[3 * r + i],
                    column = row_[3 * static_cast<std::size_t>(k.column[static_cast<std::size_t>(at)]) + j];
          if (row >= 0 && column >= 0)
            entries.emplace_back(row, column, k.block[static_cast<std::size_t>(at)][3 * i + j]);
        }
  for (std::size_t d = 0; d < dofs; ++d)
    if (!used[d / 3] && row_[d] >= 0) entries.emplace_back(row_[d], row_[d], 1);
  Eigen::SparseMatrix<double> matrix(rows, rows);
  matrix.setFromTriplets(entries.begin(), entries.end());
  factor_->of.compute(matrix);
}

FactoredBody::~FactoredBody() = default;

bool FactoredBody::is_definite() const {
  return factor_->of.info() == Eigen::Success;
}

Eigen::MatrixXd FactoredBody::columns(const std::vector<std::int32_t>& nodes) const {
  const auto width = static_cast<Eigen::Index>(3 * nodes.size());
  const auto rows = static_cast<Eigen::Index>(std::count_if(row_.begin(), row_.end(), [](int r) { return r >= 0; }));
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(row_.size()), width);
  constexpr Eigen::Index batch = 96;
  for (Eigen::Index first = 0; first < width; first += batch) {
    const Eigen::Index count = std::min(batch, width - first);
    Eigen::MatrixXd force = Eigen::MatrixXd::Zero(rows, count);
    for (Eigen::Index c = 0; c < count; ++c) {
      const auto column = static_cast<std::size_t>(first + c);
      const int row = row_[3 * static_cast<std::size_t>(nodes[column / 3]) + column % 3];
      if (row >= 0) force(row, c) = 1;
    }
    const Eigen::MatrixXd solved = factor_->of.solve(force);
    for (std::size_t d = 0; d < row_.size(); ++d)
      if (row_[d] >= 0) result.block(static_cast<Eigen::Index>(d), first, 1, count) = solved.row(row_[d]);
  }
  return result;
}

Eigen::VectorXd FactoredBody::solve(const Eigen::VectorXd& force) const {
  Eigen::VectorXd free(std::count_if(row_.begin(), row_.end(), [](int r) { return r >= 0; }));
  for (std::size_t d = 0; d < row_.size(); ++d)
    if (row_[d] >= 0) free[row_[d]] = force[static_cast<Eigen::Index>(d)];
  const Eigen::VectorXd solved = factor_->of.solve(free);
  Eigen::VectorXd result = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(row_.size()));
  for (std::size_t d = 0; d < row_.size(); ++d)
    if (row_[d] >= 0) result[static_cast<Eigen::Index>(d)] = solved[row_[d]];
  return result;
}

namespace {

Eigen::MatrixXd stored_matrix(const FactoredBody& body, const std::vector<std::int32_t>& nodes) {
  const Eigen::MatrixXd all = body.columns(nodes);
  Eigen::MatrixXd matrix(all.cols(), all.cols());
  for (std::size_t k = 0; k < nodes.size(); ++k)
    matrix.middleRows(3 * static_cast<Eigen::Index>(k), 3) = all.middleRows(3 * nodes[k], 3);
  return 0.5 * (matrix + matrix.transpose());
}

Eigen::MatrixXd rounded(Eigen::MatrixXd matrix, bool single) {
  return single ? Eigen::MatrixXd(matrix.cast<float>().cast<double>()) : matrix;
}

std::vector<std::int32_t> index_of(const std::vector<std::int32_t>& nodes, std::int32_t all_nodes) {
  std::vector<std::int32_t> index(static_cast<std::size_t>(all_nodes), -1);
  for (std::size_t k = 0; k < nodes.size(); ++k)
    index[static_cast<std::size_t>(nodes[k])] = static_cast<std::int32_t>(k);
  return index;
}

}  // namespace

StoredPairs::StoredPairs(const FactoredBody& body, const std::vector<std::int32_t>& nodes, std::int32_t all_nodes,
                         bool single)
    : StoredPairs(stored_matrix(body, nodes), nodes, all_nodes, single) {}

StoredPairs::StoredPairs(Eigen::MatrixXd matrix, const std::vector<std::int32_t>& nodes, std::int32_t all_nodes,
                         bool single)
    : matrix_(rounded(std::move(matrix), single)), index_(index_of(nodes, all_nodes)) {}

bool StoredPairs::read(std::int32_t node, const std::int32_t* others, std::int32_t count, double* rows,
                       std::size_t stride) const {
  const std::int32_t own = index_[static_cast<std::size_t>(node)];
  if (own < 0) return false;
  for (std::int32_t k = 0; k < count; ++k) {
    const std::int32_t other = index_[static_cast<std::size_t>(others[k])];
    if (other < 0) return false;
    for (int i = 0; i < 3; ++i) {
      const double* const from = matrix_.data() +
                                 static_cast<std::size_t>(3 * own + i) * static_cast<std::size_t>(matrix_.rows()) +
                                 3 * static_cast<std::size_t>(other);
      for (int j = 0; j < 3; ++j)
        rows[static_cast<std::size_t>(i) * stride + static_cast<std::size_t>(3 * k + j)] = from[j];
    }
  }
  return true;
}

}  // namespace palpate
