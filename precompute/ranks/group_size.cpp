#include "precompute/ranks/group_size.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "formats/errors.h"

namespace palpate {
namespace {

// Constants of the memory estimate, fitted to livers of 20,000 and 100,000 vertices (bench/distributed.cpp,
// bench/multigrid.cpp); what those runs do not determine is taken from the plan for one rank.
constexpr double kColumnsPerDof = 32 * 10 * 8;  // bytes: ten batches of 32 columns
constexpr double kAveragingFill = 4.3;          // 3 x 3 blocks of K with p1-anp over those with p1
constexpr double kFactorPerNumber = 26;         // bytes of MUMPS's factor, over all ranks of a group

double blocks_of(const ElasticBody& body, Element element) {
  // Nodes and twice the edges; Euler's formula counts the edges of a solid without holes.
  const double edges = static_cast<double>(body.nodes.size() + body.tetrahedra.size()) +
                       0.5 * static_cast<double>(body.triangles.size());
  return (static_cast<double>(body.nodes.size()) + 2 * edges) * (element == Element::p1 ? 1 : kAveragingFill);
}

}  // namespace

GroupChoice choose_group(const ElasticBody& body, Element element, double available_bytes, int ranks, int asked) {
  if (element == Element::p2_p0 && asked > 1)
    throw InputError(fmt::format(
        "--ranks-per-operator {}: expected an organ of linear elements (p1, p1-anp), found p2-p0; use 1", asked));
  if (element == Element::p2_p0) return {};
  const double nodes = static_cast<double>(body.nodes.size()), fill = element == Element::p1 ? 1 : 3.2;
  const double columns = kColumnsPerDof * 3 * nodes;
  const double levels = kMultigridBytesPerBlock * blocks_of(body, element) + columns;
  // With nested dissection the factor of a solid grows as n^1.52, measured from 1,700 to 95,000 vertices.
  const double factor = kFactorPerNumber * 33.8e6 * std::pow(nodes / 20000, 1.52) * fill + columns;
  GroupChoice choice;
  choice.ranks_per_operator = asked > 0 ? asked : ranks;
  if (asked == 0)
    for (int size = ranks; size > 0; --size)
      if (ranks % size == 0 && levels / size <= available_bytes) choice.ranks_per_operator = size;
  choice.factor_bytes = factor / choice.ranks_per_operator;
  choice.gamg_bytes = levels / choice.ranks_per_operator;
  choice.factor = choice.factor_bytes <= available_bytes;
  return choice;
}

SolverPlan plan_of_group(const GroupChoice& choice, std::int64_t columns, double available_bytes, double bundle_bytes) {
  const auto widest = static_cast<int>(std::min<std::int64_t>(96, columns));
  SolverPlan plan;
  plan.ranks_per_operator = choice.ranks_per_operator;
  plan.cholesky = choice.factor;
  plan.why = fmt::format("each operator is divided among {} ranks: {}", choice.ranks_per_operator,
                         choice.factor ? "a distributed factor" : "algebraic multigrid, since a factor would not fit");
  plan.factor.width = widest;
  plan.factor.bytes = choice.factor_bytes;
  plan.multigrid.width = std::min(widest, 32);
  plan.multigrid.bytes = choice.gamg_bytes;
  plan.columns = columns;
  plan.available_bytes = available_bytes;
  plan.bundle_bytes = bundle_bytes;
  return plan;
}

}  // namespace palpate
