// Fine surfaces for bodies of tests: a sphere around a coarse ball, and a body's own surface with finer triangles and bumps.
#pragma once

#include <Eigen/Dense>
#include <map>

#include "runtime/fine_surface/fine_surface.h"
#include "tests/support/closed_surfaces.h"
#include "tests/support/deformed_truth.h"
#include "tests/support/tiny_bundle.h"
#include "tests/support/tools.h"

namespace palpate::tests {

// A fine surface as a host has it.
struct FineHost {
  std::vector<float> positions;
  std::vector<std::int32_t> triangles;

  void add(const Eigen::Vector3d& p);
  std::int32_t vertices() const { return static_cast<std::int32_t>(positions.size() / 3); }
  Eigen::Vector3d vertex(std::int32_t v) const;
  palpate_fine_surface view() const;
  // As the reference for collision takes a surface.
  SurfaceFirst surface() const;
};

// The body's surface, each triangle halved along its edges `splits` times, each vertex moved along its normal by up to `bump` (m)
// to either side.
FineHost fine_of(const SurfaceFirst& body, int splits, double bump);

// A ball of 30 mm radius: 42 surface nodes on its sphere, whose triangles lie up to 3 mm inside it, and a node in its middle. The
// lower part is held.
inline constexpr double kBallRadius = 0.03;
DenseBody coarse_ball();
FineHost fine_sphere(int splits);

// The fine surface of a host, bound to a body as a scene binds it, with the body's displacements for its vertices'.
class BoundFine {
 public:
  BoundFine(const FineHost& host, const SurfaceFirst& body);
  BoundFine(const BoundFine&) = delete;
  ~BoundFine();
  const FineSurface& operator*() const { return fine_; }
  const FineSurface* operator->() const { return &fine_; }

  // [vertices][3] m, of displacements of the body's surface nodes.
  std::vector<float> moved_by(const std::vector<float>& displacement) const;

 private:
  SceneMemory memory_, scratch_;
  std::vector<double> nodes_;
  std::vector<std::int32_t> triangles_;
  FineSurface fine_;
};

}  // namespace palpate::tests
