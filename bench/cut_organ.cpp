// The linear organ that is cut: what a change, a new contact node and a step cost at a rank, in microseconds, and as a ratio to the same of the
// uncut organ.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "runtime/contact/touch.h"
#include "runtime/cut/cut_field.h"
#include "runtime/cut/cut_rebase.h"
#include "runtime/cut/cut_response.h"
#include "studies/bodies/bodies.h"
#include "studies/cut/cut_body.h"
#include "studies/hyperelastic/large_body.h"

namespace palpate {
namespace {

using Clock = std::chrono::steady_clock;
double since(Clock::time_point begin) {
  return 1e6 * std::chrono::duration<double>(Clock::now() - begin).count();
}
double median(std::vector<double> of) {
  std::sort(of.begin(), of.end());
  return of.empty() ? 0 : of[of.size() / 2];
}
double mean(const std::vector<double>& of) {
  double sum = 0;
  for (const double x : of) sum += x;
  return of.empty() ? 0 : sum / static_cast<double>(of.size());
}
template <class Run>
double time_of(int times, Run run) {
  std::vector<double> all;
  for (int k = 0; k < times; ++k) {
    const auto begin = Clock::now();
    run(k);
    all.push_back(since(begin));
  }
  return median(all);
}

// The tensors of a body all of whose nodes are surface nodes, in single precision.
struct StoredTensors {
  StoredTensors(const ElasticBody& body, const FactoredBody& factored, std::int32_t mesh_nodes) {
    const std::size_t nodes = body.nodes.size();
    for (std::int32_t n = 0; n < mesh_nodes; ++n)
      if (!body.fixed[static_cast<std::size_t>(n)][0]) touchable.push_back(n);
    const Eigen::MatrixXd c = factored.columns(touchable);
    numbers.resize(touchable.size() * 9 * nodes);
    for (std::size_t k = 0; k < touchable.size(); ++k) {
      const Eigen::Matrix3d self = c.block<3, 3>(3 * touchable[k], static_cast<Eigen::Index>(3 * k)),
                            f = self.inverse();
      const Eigen::MatrixXd field = c.middleCols(static_cast<Eigen::Index>(3 * k), 3) * f;
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) stiffness.push_back(0.5 * (f(i, j) + f(j, i)));
      for (std::size_t j = 0; j < 3; ++j)
        for (std::size_t i = 0; i < 3 * nodes; ++i)
          numbers[(3 * k + j) * 3 * nodes + i] =
              static_cast<float>(field(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)));
    }
    tensors.surface.numbers = numbers.data(), tensors.surface.nodes = static_cast<std::int32_t>(nodes);
    tensors.stiffness = stiffness.data(), tensors.surface_nodes = static_cast<std::int32_t>(nodes);
    tensors.columns = static_cast<std::int32_t>(touchable.size());
  }
  std::vector<std::int32_t> touchable;
  std::vector<float> numbers;
  std::vector<double> stiffness;
  Tensors tensors;
};

struct Organ {
  Organ(const ElasticBody& body, Element element, std::int32_t mesh_nodes, std::int32_t patterns)
      : large(body, element), uncut(body, element), stored(body, uncut, mesh_nodes), cut(body) {
    const auto count = static_cast<std::int32_t>(body.nodes.size());
    for (std::int32_t n = 0; n < mesh_nodes; ++n) listed.push_back(n);
    pairs = std::make_unique<StoredPairs>(uncut, listed, count);
    compliance.create(memory, large.get(), *pairs, {count, count - mesh_nodes, patterns});
    CutResponse::Source source;
    PatternFields::Source& of = source.of;
    of.compliance = source.compliance = &compliance, of.tensors = &stored.tensors;
    of.touchable = stored.touchable.data();
    of.rest_nodes = of.surface_nodes = count, of.first_reserve = mesh_nodes;
    source.responses = 192;
    response.create(memory, source);
    offset.change_body(&response);
    offset.create(memory, 64);
    ContactSolver::Limits limits;
    limits.of.nodes = 192, limits.of.constraints = 64,
    limits.of.columns = limits.of.columns_of_surface = stored.tensors.columns;
    limits.of.surface_nodes = count, limits.of.offset = &offset, limits.of.predicts = true;
    solver.create(memory, limits);
    field.create(memory, &stored.tensors, &response, &offset, &solver, {192, 64});
    CutRebase::Parts parts;
    parts.body = &large.get(), parts.pairs = pairs.get(), parts.compliance = &compliance, parts.response = &response;
    parts.field = &field, parts.offset = &offset, parts.at = patterns / 2, parts.most_slots = count;
    parts.capacity = {count, count - mesh_nodes, patterns};
    rebase.create(memory, parts), rebase.take_loads(memory);
    work.create(kUnlimitedOperations);
    if (memory.failed()) std::abort();
  }
  // Contacts of `each` nodes, of nodes from `first` on; the field follows.
  void step(std::int32_t contacts, std::int32_t each, std::int32_t first, double way) {
    ContactConstraints set;
    nodes.assign(static_cast<std::size_t>(contacts * each), {}),
        constraints.assign(static_cast<std::size_t>(contacts), {});
    targets.assign(static_cast<std::size_t>(contacts), {0, 0, way});
    for (std::int32_t c = 0; c < contacts; ++c) {
      ContactConstraint& constraint = constraints[static_cast<std::size_t>(c)];
      constraint.id.contact = {ContactSource::tool, c, 0};
      constraint.first_node = c * each, constraint.node_count = each, constraint.axes = 7;
      for (std::int32_t e = 0; e < each; ++e) {
        const std::int32_t column = (first + 37 * c + e) % stored.tensors.columns;
        nodes[static_cast<std::size_t>(c * each + e)] = {stored.touchable[static_cast<std::size_t>(column)], column,
                                                         constraint.id.contact, 0, 1.0 / each};
      }
    }
    set.nodes = nodes.data(), set.constraints = constraints.data(), set.target = targets.data();
    set.node_count = contacts * each, set.constraint_count = contacts;
    force.assign(nodes.size(), {}), modified.assign(nodes.size(), {});
    const auto begin = Clock::now();
    work.begin();
    solver.solve(stored.tensors, set, force.data(), modified.data(), &work);
    solve_us = since(begin);
    Operations done = 0;
    const auto begin_field = Clock::now();
    field.set(set, force.data(), true, &done);
    field_us = since(begin_field);
  }

  LargeBody large;
  FactoredBody uncut;
  StoredTensors stored;
  CutReference cut;
  std::vector<std::int32_t> listed;
  std::unique_ptr<StoredPairs> pairs;
  SceneMemory memory{palpate_allocator{}};
  CutCompliance compliance;
  CutResponse response;
  Offset offset;
  ContactSolver solver;
  CutField field;
  CutRebase rebase;
  StepWork work;
  std::vector<ContactNode> nodes;
  std::vector<ContactConstraint> constraints;
  std::vector<Vec3> targets, force, modified;
  double solve_us = 0, field_us = 0;
};

void measure(Organ& organ, const char* what) {
  std::vector<double> field[2];
  constexpr std::int32_t kContacts[2] = {1, 4};
  for (int kind = 0; kind < 2; ++kind)
    for (int k = 0; k < 60; ++k) {
      organ.step(kContacts[kind], 12, 11, 0.001 + 1e-5 * k);
      if (k > 0) field[kind].push_back(organ.field_us);
    }
  // One contact node more than in the step before, beside twelve.
  std::vector<double> come;
  for (int k = 0; k < 60; ++k) {
    organ.step(12, 1, 11, 0.001);
    const double without = organ.solve_us;
    organ.step(13, 1, 11, 0.001);
    come.push_back(organ.solve_us - without);
  }
  int next = 0;
  const double response = time_of(
      40, [&](int) { organ.response.find_response(organ.stored.touchable[static_cast<std::size_t>(300 + next++)]); });
  std::printf(
      "%s, rank %d: response of a node %.1f us; a thirteenth contact node in the solve %.1f us; field of one contact "
      "of "
      "12 nodes %.0f us, of four %.0f us\n",
      what, organ.response.rank(), response, median(come), median(field[0]), median(field[1]));
}

void run(Element element, const char* name) {
  ElasticBody body = body_of(box_mesh({12, 11, 6}, {0.12, 0.11, 0.06}, 0), {{5000, 0.45, 0}});
  hold(body, [](const auto& p) { return p[0] == 0 ? 7 : 0; });
  const auto mesh_nodes = static_cast<std::int32_t>(body.nodes.size());
  for (int r = 0; r < 130; ++r) body.nodes.push_back({-1, 0, 0}), body.fixed.push_back({1, 1, 1});
  body.surface_count = static_cast<std::int32_t>(body.nodes.size());
  std::printf("%s: %d surface nodes\n", name, static_cast<int>(body.nodes.size()));
  {
    Organ organ(body, element, mesh_nodes, 700);
    measure(organ, "  uncut");
    std::vector<std::int32_t> plane;
    for (std::int32_t n = 0; n < mesh_nodes; ++n)
      if (std::abs(body.nodes[static_cast<std::size_t>(n)][2] - 0.03) < 1e-9 &&
          !body.fixed[static_cast<std::size_t>(n)][0])
        plane.push_back(n);
    std::sort(plane.begin(), plane.end(), [&](std::int32_t a, std::int32_t b) {
      return body.nodes[static_cast<std::size_t>(a)][0] > body.nodes[static_cast<std::size_t>(b)][0];
    });
    std::vector<double> apply, z;
    bool at_hundred = false;
    for (const std::int32_t n : plane) {
      const OwnedChange change =
          organ.cut.split(n, [&](std::size_t e) { return organ.cut.centre(e)[2] < organ.cut.position(n)[2]; });
      auto begin = Clock::now();
      if (organ.compliance.apply(change.get()).outcome != CutOutcome::made) break;
      apply.push_back(since(begin));
      begin = Clock::now();
      organ.response.take_change(false);
      z.push_back(since(begin));
      organ.cut.apply(change);
      if (organ.response.rank() >= 100 && !at_hundred) {
        at_hundred = true;
        measure(organ, "  split");
      }
      if (organ.response.rank() >= 390) break;
    }
    measure(organ, "  split");
    const std::int32_t rank = organ.response.rank();
    std::vector<double> tiles;
    const auto all = Clock::now();
    for (organ.rebase.begin(0); organ.rebase.fills();) {
      const auto begin = Clock::now();
      organ.rebase.fill_tile();
      tiles.push_back(since(begin));
    }
    organ.rebase.finish(false);
    const double took = 1e-3 * since(all);
    std::printf("  re-basing at rank %d: %d tiles, %.0f us each, %.0f ms in all\n", rank,
                static_cast<int>(tiles.size()), median(tiles), took);
    measure(organ, "  re-based");
    const std::size_t last = apply.size() > 10 ? apply.size() - 10 : 0;
    std::printf("  a split node: compliance %.0f us, Z %.0f us\n",
                median({apply.begin() + static_cast<std::ptrdiff_t>(last), apply.end()}),
                median({z.begin() + static_cast<std::ptrdiff_t>(last), z.end()}));
  }
  Organ organ(body, element, mesh_nodes, 700);
  std::vector<double> apply, z;
  bool at_hundred = false;
  for (std::int32_t e = 200; organ.response.rank() < 390; ++e) {
    OwnedChange change;
    change.removed = {e};
    auto begin = Clock::now();
    if (organ.compliance.apply(change.get()).outcome != CutOutcome::made) continue;
    apply.push_back(since(begin));
    begin = Clock::now();
    organ.response.take_change(false);
    z.push_back(since(begin));
    if (organ.response.rank() >= 100 && !at_hundred) {
      at_hundred = true;
      std::printf("  a removed tetrahedron at rank %d: compliance %.0f us, Z %.0f us\n", organ.response.rank(),
                  median(apply), median(z));
    }
  }
  const std::size_t last = apply.size() > 30 ? apply.size() - 30 : 0;
  std::printf("  a removed tetrahedron at rank %d: compliance %.0f us, Z %.0f us (mean %.0f us)\n",
              organ.response.rank(), median({apply.begin() + static_cast<std::ptrdiff_t>(last), apply.end()}),
              median({z.begin() + static_cast<std::ptrdiff_t>(last), z.end()}),
              mean({z.begin() + static_cast<std::ptrdiff_t>(last), z.end()}));
}

}  // namespace
}  // namespace palpate

int main() {
  palpate::run(palpate::Element::p1, "p1");
  palpate::run(palpate::Element::p1_anp, "p1-anp");
}
