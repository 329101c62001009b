// Difficult meshes: extreme scales, far from the origin, slivers, needles, caps, sizes that differ by four decades.
#include "tests/stability/extended_precision.h"
#include "tests/stability/solved_columns.h"
#include "tests/stability/stability_case.h"

namespace palpate::tests {
namespace {

TEST(StabilityMesh, FromMicrometresToKilometres) {
  StabilityCase attack(
      "A threshold in metres or newtons somewhere in mesh, support or solver would show at one end of the scale.");
  for (const Element element : kElements) {
    double worst = 0;
    const auto at = [&](double size) {
      const TetrahedralMesh mesh = box_mesh({4, 3, 3}, {6 * size, 5 * size, 4 * size}, 0.15);
      return tensors_of(held_body(mesh, {{5400, 0.45, 0}}), element, 5400 * size);
    };
    const std::vector<double> expected = at(0.01);
    for (const double size : {1e-9, 1e-6, 1.0, 1e3}) worst = std::max(worst, off(at(size), expected));
    attack.hold("tensors at 1 nm to 1 km against 10 mm, " + std::string(name_of(element)), worst, 1e-9,
                "both solved to 1e-12 and a condition of some hundred");
  }
}

TEST(StabilityMesh, FarFromTheOrigin) {
  StabilityCase attack(
      "At 1e7 m a coordinate has nine digits left below a metre: volumes computed from products of coordinates would "
      "lose all digits.");
  // Coordinates are binary fractions, so that the shifted body is the same to the last bit.
  for (const Element element : kElements) {
    const auto at = [&](double away) {
      TetrahedralMesh mesh = box_mesh({4, 4, 4}, {0.0625, 0.0625, 0.03125});
      for (auto& p : mesh.nodes)
        for (double& x : p) x += away;
      return tensors_of(held_body(mesh, {{5400, 0.45, 0}}), element, 1);
    };
    attack.hold("tensors at 1e7 m against those at the origin, " + std::string(name_of(element)), off(at(1e7), at(0)),
                1e-9, "differences of coordinates are exact");
  }
}

TEST(StabilityMesh, TheSameIterationsAtEveryScale) {
  StabilityCase attack(
      "A tolerance or a threshold in metres would let the solver stop early, or go on, in another unit of length.");
  for (const bool cholesky : {true, false}) {
    int most = 0;
    const auto iterations = [&](double size) {
      return solve(held_body(box_mesh({8, 8, 8}, {size, size, size}, 0.15), {{5400, 0.45, 0}}), Element::p1_anp,
                   cholesky)
          .iterations;
    };
    const int expected = iterations(0.1);
    for (const double size : {1e-6, 1e-3, 1.0, 1e3}) most = std::max(most, std::abs(iterations(size) - expected));
    attack.hold(std::string("iterations at 1 um to 1 km against ") + std::to_string(expected) + " at 10 cm, " +
                    (cholesky ? "factor" : "multigrid"),
                most, 0, "the same system in another unit");
  }
}

// Error of a node's tensor relative to extended precision, divided by the error that rounding explains: some 2.2e-16 of an
// element's edge over its least height, plus the solver's tolerance of 1e-9.
struct Off {
  double error = 0, over_rounding = 0, residual_over_rounding = 0;
};
Off off_from_extended(const ElasticBody& body, Element element, double height_over_edge, std::int32_t node) {
  const NodeTensor tensor = solve_node_tensors(body, element, std::vector{node}, 1e-9)[0];
  const double error = off(tensor.displacement, in_extended_precision(body, element, node));
  const double rounding = 2.2e-16 / height_over_edge + 1e-9;
  return {error, error / rounding, tensor.residual / rounding};
}
std::int32_t middle_touchable(const ElasticBody& body) {
  return body.touchable[body.touchable.size() / 2];
}
// The worst of several meshes.
struct WorstOff {
  double error = 0, residual = 0;
  void see(const Off& found) {
    error = std::max(error, found.over_rounding), residual = std::max(residual, found.residual_over_rounding);
  }
};
void hold_against_extended(StabilityCase& attack, const std::string& of, const WorstOff& worst) {
  attack.hold("error of a tensor" + of + ", over 2.2e-16 / height + 1e-9", worst.error, 10,
              "each element's stiffness is rounded by some 2.2e-16 of its edge over its height, and energy follows in "
              "proportion; the tolerance 1e-9; ten for the condition of the rest");
  attack.hold(
      "true residual" + of + ", over the same", worst.residual, 100,
      "what double precision allows of a column: epsilon |K| |x| / |b|, with |K| some tens of times one element's "
      "edge over its height");
}

TEST(StabilityMesh, Slivers) {
  StabilityCase attack(
      "The stiffness of an almost flat tetrahedron grows as the reciprocal of its height: its volume loses digits, K "
      "its condition and the tensors their accuracy, or the factorisation fails.");
  for (const Element element : kElements) {
    WorstOff worst;
    for (const double degrees : {1e1, 1e0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8}) {
      const double height = std::tan(degrees * 3.14159265358979 / 180);
      TetrahedralMesh mesh = box_mesh({2, 2, 2}, {2, 2, 2});
      for (auto& p : mesh.nodes)
        if (p == Point{1, 1, 1}) p[0] = 2 - height;
      const ElasticBody body = held_body(mesh, {{5400, 0.45, 0}});
      const Off found = off_from_extended(body, element, height, middle_touchable(body));
      attack.point("error against sliver angle", name_of(element), degrees, found.error);
      worst.see(found);
    }
    hold_against_extended(attack, std::string(" from 10 to 1e-8 degrees, ") + name_of(element), worst);
  }
}

// A box with planes of nodes at these coordinates along each axis.
TetrahedralMesh graded_box(const std::array<std::vector<double>, 3>& at) {
  const auto cells = [&](std::size_t d) { return static_cast<int>(at[d].size()) - 1; };
  TetrahedralMesh mesh = box_mesh({cells(0), cells(1), cells(2)}, {1.0 * cells(0), 1.0 * cells(1), 1.0 * cells(2)});
  for (auto& p : mesh.nodes)
    for (std::size_t d = 0; d < 3; ++d) p[d] = at[d][std::lround(p[d])];
  return mesh;
}

TEST(StabilityMesh, Needles) {
  StabilityCase attack(
      "Where two thin layers of the mesh cross, tetrahedra are long and thin in two directions, and their gradients "
      "differ by decades within one element.");
  for (const Element element : kElements) {
    WorstOff worst;
    for (const double thin : {1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6}) {
      const ElasticBody body =
          held_body(graded_box({{{0, 1, 2}, {0, 1, 1 + thin, 2}, {0, 1, 1 + thin, 2}}}), {{5400, 0.45, 0}});
      worst.see(off_from_extended(body, element, thin, middle_touchable(body)));
    }
    hold_against_extended(attack, std::string(" with needles of 1 : 10 to 1 : 1e6, ") + name_of(element), worst);
  }
}

TEST(StabilityMesh, Caps) {
  StabilityCase attack(
      "A node just above the middle of a face makes a flat tetrahedron (a cap) without short edges or sharp angles in "
      "its faces: checks of edges do not find it.");
  for (const Element element : kElements) {
    WorstOff worst;
    for (const double height : {1e-2, 1e-4, 1e-6, 1e-8, 1e-10}) {
      TetrahedralMesh mesh = box_mesh({2, 2, 2}, {2, 2, 2});
      // A tetrahedron around the middle is split in four by a node next to its face of corners 0 to 2.
      const auto whole = mesh.tetrahedra[mesh.tetrahedra.size() / 2];
      Point p{};
      for (std::size_t d = 0; d < 3; ++d) {
        for (std::size_t v = 0; v < 3; ++v) p[d] += mesh.nodes[whole[v]][d] / 3;
        p[d] += height * (mesh.nodes[whole[3]][d] - p[d]);
      }
      const auto added = static_cast<std::int32_t>(mesh.nodes.size());
      mesh.nodes.push_back(p);
      for (std::size_t v = 0; v < 4; ++v) {
        auto part = whole;
        part[v] = added;
        if (v == 0)
          mesh.tetrahedra[mesh.tetrahedra.size() / 2] = part;
        else
          mesh.tetrahedra.push_back(part), mesh.region.push_back(0);
      }
      const ElasticBody body = held_body(mesh, {{5400, 0.45, 0}});
      worst.see(off_from_extended(body, element, height, middle_touchable(body)));
    }
    hold_against_extended(attack, std::string(" with a cap of height 1e-2 to 1e-10, ") + name_of(element), worst);
  }
}

TEST(StabilityMesh, ElementSizesOverFourDecades) {
  StabilityCase attack(
      "Elements of 0.1 mm beside elements of a metre: entries of K differ by four decades, and small entries must not "
      "be taken for rounding.");
  const std::vector<double> at = {0, 1e-4, 1e-3, 1e-2, 1e-1, 1};
  for (const Element element : {Element::p1, Element::p1_anp}) {
    const ElasticBody body = held_body(graded_box({{at, at, at}}), {{5400, 0.45, 0}});
    WorstOff worst;
    // At the large end, and where the smallest elements meet beside the face that is held.
    for (const Point& place : {Point{1, 1, 1}, Point{1, 1e-2, 0}, Point{1e-4, 0, 0}}) {
      const auto node =
          static_cast<std::int32_t>(std::find(body.nodes.begin(), body.nodes.end(), place) - body.nodes.begin());
      worst.see(off_from_extended(body, element, 1e-4, node));
    }
    hold_against_extended(attack, std::string(" in a box graded from 1e-4 to 1, ") + name_of(element), worst);
  }
}

}  // namespace
}  // namespace palpate::tests
