#include "studies/coupled/coupled_rows.h"

namespace palpate::studies {

void Row::add(std::size_t body, std::int32_t node, const Eigen::Vector3d& weight) {
  for (int d = 0; d < 3; ++d)
    if (weight[d] != 0) terms.push_back({body, 3 * node + d, weight[d]});
}

Eigen::VectorXd solve_rows(const Eigen::MatrixXd& c, const Eigen::VectorXd& d, const std::vector<bool>& only_pushes) {
  std::vector<bool> holds(static_cast<std::size_t>(d.size()), true);
  const auto at = [](Eigen::Index i) { return static_cast<std::size_t>(i); };
  const double rounding = 1e-12 + 1e-12 * (d.size() ? d.cwiseAbs().maxCoeff() : 0);
  for (int turn = 0; turn < 1000; ++turn) {
    std::vector<Eigen::Index> held;
    for (Eigen::Index i = 0; i < d.size(); ++i)
      if (holds[at(i)]) held.push_back(i);
    const Eigen::VectorXd r = Eigen::MatrixXd(c(held, held)).ldlt().solve(Eigen::VectorXd(d(held)));
    Eigen::VectorXd all = Eigen::VectorXd::Zero(d.size());
    all(held) = r;
    const Eigen::VectorXd over = c * all - d;
    Eigen::Index pulls = -1, opens = -1;
    for (Eigen::Index i = 0; i < d.size(); ++i) {
      if (!only_pushes[at(i)]) continue;
      if (holds[at(i)] && all[i] < 0 && (pulls < 0 || all[i] < all[pulls])) pulls = i;
      if (!holds[at(i)] && over[i] < -rounding && (opens < 0 || over[i] < over[opens])) opens = i;
    }
    if (pulls < 0 && opens < 0) return all;
    if (pulls >= 0)
      holds[at(pulls)] = false;
    else
      holds[at(opens)] = true;
  }
  throw std::runtime_error("the reference for rows that only push found no answer in 1000 turns");
}

CoupledAnswer solve_coupled(const std::vector<Row>& rows, const std::vector<CoupledBody>& bodies) {
  const auto count = static_cast<Eigen::Index>(rows.size());
  Eigen::MatrixXd c = Eigen::MatrixXd::Zero(count, count);
  Eigen::VectorXd d(count);
  std::vector<bool> only_pushes;
  std::vector<Eigen::MatrixXd> under;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    Eigen::MatrixXd loads = Eigen::MatrixXd::Zero(bodies[b].dofs, count);
    for (Eigen::Index i = 0; i < count; ++i)
      for (const Row::Term& term : rows[static_cast<std::size_t>(i)].terms)
        if (term.body == b) loads(term.dof, i) += term.weight;
    under.push_back(bodies[b].under(loads));
    c += loads.transpose() * under.back();
  }
  for (Eigen::Index i = 0; i < count; ++i) {
    const Row& row = rows[static_cast<std::size_t>(i)];
    c(i, i) += row.softness, d[i] = row.target, only_pushes.push_back(row.only_pushes);
    for (const Row::Term& term : row.terms)
      if (const Eigen::VectorXd& moved = bodies[term.body].moved; moved.size() > 0)
        d[i] -= term.weight * moved[term.dof];
  }
  CoupledAnswer answer{solve_rows(0.5 * (c + c.transpose()), d, only_pushes), {}};
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    answer.u.push_back(under[b] * answer.force);
    if (bodies[b].moved.size() > 0) answer.u.back() += bodies[b].moved;
  }
  return answer;
}

double unresolved_by_mesh(double edge, double radius) {
  return std::max(0.25, std::log(0.3 * edge / radius));
}

double softness_across_shaft(double young, double poisson, double edge, double radius, double length) {
  const double shear = young / (2 * (1 + poisson));
  return (3 - 4 * poisson) / (8 * std::numbers::pi * (1 - poisson) * shear * length) * unresolved_by_mesh(edge, radius);
}

double softness_along_shaft(double young, double poisson, double edge, double radius, double length) {
  const double shear = young / (2 * (1 + poisson));
  return unresolved_by_mesh(edge, radius) / (2 * std::numbers::pi * shear * length);
}

}  // namespace palpate::studies
