#include "meshing/surface/improve_triangles.h"

#include <CGAL/boost/graph/Euler_operations.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "meshing/surface/nearest_point.h"
#include "meshing/surface/surface_mesh.h"

namespace palpate {
namespace {

constexpr double kLeastCosine = 0.77;  // cosine of the largest angle by which a triangle may turn in one step

using Halfedge = CgalMesh::Halfedge_index;
using Vertex = CgalMesh::Vertex_index;

double length(const Point& a) {
  return std::sqrt(dot(a, a));
}

Point normal(const Point& p, const Point& q, const Point& r) {
  const Point n = cross(q - p, r - p);
  const double size = length(n);
  return (size > 0 ? 1 / size : 0) * n;
}

double badness(const Point& p, const Point& q, const Point& r) {
  return 1 / std::max(radius_ratio(p, q, r), 1e-12);
}

class Improvement {
 public:
  Improvement(const TriangleSurface& surface, double good_ratio) : mesh_(to_cgal(surface)), good_ratio_(good_ratio) {}

  void flip_edges() {
    for (const auto edge : mesh_.edges()) {
      const Halfedge h = mesh_.halfedge(edge);
      if (flip_helps(h)) CGAL::Euler::flip_edge(h, mesh_);
    }
  }

  void move_vertices(const NearestPoint& onto) {
    for (const Vertex vertex : mesh_.vertices()) move(vertex, onto);
  }

  TriangleSurface surface() const { return from_cgal(mesh_); }

 private:
  Point at(Vertex v) const {
    const auto& p = mesh_.point(v);
    return {p.x(), p.y(), p.z()};
  }

  bool flip_helps(Halfedge h) const {
    const Halfedge back = mesh_.opposite(h);
    const Vertex a = mesh_.source(h), b = mesh_.target(h);
    const Vertex c = mesh_.target(mesh_.next(h)), d = mesh_.target(mesh_.next(back));
    if (c == d || mesh_.degree(a) <= 3 || mesh_.degree(b) <= 3 || mesh_.halfedge(c, d).is_valid()) return false;
    const Point p = at(a), q = at(b), r = at(c), s = at(d);
    if (std::min(radius_ratio(p, q, r), radius_ratio(q, p, s)) > good_ratio_) return false;
    // replace triangles a b c and b a d by d c a and c d b
    if (badness(s, r, p) + badness(r, s, q) > 0.999 * (badness(p, q, r) + badness(q, p, s))) return false;
    const Point before = normal(p, q, r), beyond = normal(q, p, s);
    for (const Point& after : {normal(s, r, p), normal(r, s, q)}) {
      if (dot(after, before) < kLeastCosine || dot(after, beyond) < kLeastCosine) return false;
    }
    return true;
  }

  void move(Vertex vertex, const NearestPoint& onto) {
    const Point here = at(vertex);
    // for each triangle at the vertex, the edge opposite the vertex, counter-clockwise from outside
    std::vector<std::array<Point, 2>> far_edges;
    for (const Halfedge h : mesh_.halfedges_around_target(mesh_.halfedge(vertex)))
      far_edges.push_back({at(mesh_.source(h)), at(mesh_.target(mesh_.next(h)))});

    Point target{}, outward{};
    double weights = 0, badness_here = 0, worst_ratio = 1;
    for (const auto& [p, q] : far_edges) {
      // triangle of p, here and q
      const Point side = q - p;
      const Point n = normal(p, here, q);
      const Point inward = cross(side, n);  // in the triangle's plane, from the opposite edge towards here
      const Point equilateral = 0.5 * (p + q) + 0.5 * std::sqrt(3.0) * inward;
      const double bad = badness(p, here, q);
      target = target + bad * bad * equilateral;
      weights += bad * bad;
      badness_here += bad;
      worst_ratio = std::min(worst_ratio, radius_ratio(p, here, q));
      outward = outward + cross(here - p, q - p);
    }
    if (worst_ratio > good_ratio_) return;
    outward = (1 / std::max(length(outward), 1e-300)) * outward;
    Point step = (1 / weights) * target - here;
    step = step - dot(step, outward) * outward;

    const Point foot = onto(here);
    for (const double share : {1.0, 0.5, 0.2}) {
      const Point along = onto(here + share * step) - foot;
      // a step much longer than wanted means that the nearest point lies on another part of the surface
      if (length(along) > 1.5 * share * length(step)) continue;
      if (!move_helps(far_edges, here, here + along, badness_here)) continue;
      mesh_.point(vertex) = {here[0] + along[0], here[1] + along[1], here[2] + along[2]};
      return;
    }
  }

  static bool move_helps(const std::vector<std::array<Point, 2>>& far_edges, const Point& here, const Point& there,
                         double badness_here) {
    double badness_there = 0;
    for (const auto& [p, q] : far_edges) {
      if (dot(normal(p, here, q), normal(p, there, q)) < kLeastCosine) return false;
      badness_there += badness(p, there, q);
    }
    return badness_there < 0.999 * badness_here;
  }

  CgalMesh mesh_;
  double good_ratio_;
};

}  // namespace

void improve_triangles(TriangleSurface& surface, const TriangleSurface& onto, double good_ratio, int passes) {
  const NearestPoint nearest(onto);
  Improvement improvement(surface, good_ratio);
  for (int pass = 0; pass < passes; ++pass) {
    improvement.flip_edges();
    improvement.move_vertices(nearest);
  }
  improvement.flip_edges();
  surface = improvement.surface();
}

}  // namespace palpate
