#include "studies/validation/against_calculix.h"

#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "formats/errors.h"
#include "studies/accuracy/calculix.h"
#include "studies/accuracy/calculix_push.h"
#include "studies/bodies/bodies.h"
#include "studies/hyperelastic/large_reference.h"
#include "studies/timing/timing.h"
#include "studies/validation/shapes.h"
#include "studies/validation/solved_body.h"

namespace palpate::validation {
namespace {

// CalculiX prints seven digits.
constexpr double kPrinted = 1e-6;
// p2-p0 averages the dilatation over a cell and C3D10 does not. The two elements are equal only without a bulk modulus, as nu
// goes to -1. At this nu the bulk modulus is 2 (1 + nu) / (3 (1 - 2 nu)) = 2e-7 of the shear modulus.
constexpr double kNoBulk = -0.999999;
// CalculiX integrates with four points, which is exact only for cells with straight edges; Palpate uses fourteen.
constexpr double kCurved = 1e-3;

int hold_bottom_and_side(const Point& p) {
  return p[0] == 0 ? 7 : p[2] == 0 ? 4 : 0;
}

TetrahedralMesh box(int n) {
  return box_mesh({n, n, n}, {0.10, 0.08, 0.06}, 0.2);
}

// Every seventh tetrahedron has the second material.
ElasticBody speckled_box(int n, const Material& second) {
  TetrahedralMesh mesh = box(n);
  mesh.region_names = {"soft", "stiff"};
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) mesh.region[t] = t % 7 == 0;
  return held_body(mesh, {{5400, 0.45, 0}, second}, hold_bottom_and_side);
}

ElasticBody sphere(int n, double poisson) {
  return held_body(shell_octant(1, 2, n), {{1000, poisson, 0}}, across_symmetry_planes);
}
ElasticBody cylinder(int n, double poisson) {
  return held_body(cylinder_mesh(0.015, 0.013, n, n), {{3000, poisson, 0}},
                   [](const Point& p) { return p[2] == 0 ? 7 : 0; });
}

// A traction on the surface around the last touchable node, out to 0.3 of the body's size; none on held dofs.
std::vector<double> spread_force(const DiscreteBody& discrete) {
  Vector3d low = Vector3d::Constant(INFINITY), high = -low;
  for (const auto& p : discrete.body.nodes)
    low = low.cwiseMin(Vector3d(p.data())), high = high.cwiseMax(Vector3d(p.data()));
  const Vector3d centre(discrete.body.nodes[static_cast<std::size_t>(discrete.body.touchable.back())].data());
  auto load = traction_load(
      discrete, [&](const Point& p) { return (Vector3d(p.data()) - centre).norm() < 0.3 * (high - low).norm(); },
      [](const Vector3d&, const Vector3d&) { return Vector3d(30, -20, 50); });
  for (std::size_t i = 0; i < load.size(); ++i)
    if (discrete.discretisation.fixed[i / 3][i % 3]) load[i] = 0;
  return load;
}

}  // namespace

std::vector<CalculixMesh> built_in_meshes() {
  std::vector<CalculixMesh> meshes;
  const auto add = [&](std::string name, Element element, std::string poisson, double bound, auto body) {
    meshes.push_back({std::move(name), element, std::move(poisson), bound, body});
  };
  for (const auto& [n, poisson] : {std::pair{4, 0.3}, {8, 0.45}, {8, 0.4999}, {16, 0.45}})
    add(fmt::format("distorted box, {0} x {0} x {0} cells", n), Element::p1, fmt::format("{:g}", poisson), kPrinted,
        [n, poisson] {
          return held_body(box(n), {{5400, poisson, 0}}, hold_bottom_and_side);
        });
  add("box of two materials, contrast 11", Element::p1, "0.45, 0.3", kPrinted, [] {
    return speckled_box(6, {60000, 0.3, 0});
  });
  add("box of two materials, contrast 1e6", Element::p1, "0.45, 0.3", kPrinted, [] {
    return speckled_box(6, {5.4e9, 0.3, 0});
  });
  add("thick sphere, an octant", Element::p1, "0.49", kPrinted, [] { return sphere(12, 0.49); });
  add("cylinder of brain", Element::p1, "0.45", kPrinted, [] { return cylinder(8, 0.45); });
  add("elliptic plate", Element::p1, "0.3", kPrinted, [] {
    return held_body(elliptic_plate(6), {{210e9, 0.3, 0}}, [](const Point& p) { return p[0] == 0 ? 7 : 0; });
  });
  add("about a flat punch, thin cells", Element::p1, "0.45", kPrinted, [] {
    return held_body(indented_quarter(0.005, 5, TowardsEdge::squared), {{3000, 0.45, 0}},
                     [](const Point& p) { return p[2] > 0.0249 ? 7 : 0; });
  });
  add("distorted box, 6 x 6 x 6 cells, no bulk modulus", Element::p2_p0, "-1", kPrinted, [] {
    return held_body(box(6), {{5400, kNoBulk, 0}}, hold_bottom_and_side);
  });
  add("cylinder of brain, curved, no bulk modulus", Element::p2_p0, "-1", kCurved, [] { return cylinder(4, kNoBulk); });
  for (const int n : {4, 8})
    add(fmt::format("distorted box, {0} x {0} x {0} cells, other dilatation", n), Element::p2_p0, "0.3",
        n == 4 ? 0.1 : 0.03, [n] {
          return held_body(box(n), {{5400, 0.3, 0}}, hold_bottom_and_side);
        });
  return meshes;
}

CalculixMesh organ_mesh(const std::string& name, const accuracy::StudyOptions& folders) {
  const auto first = name.find('/'), second = name.find('/', first + 1);
  if (first == std::string::npos || second == std::string::npos)
    throw InputError(fmt::format("{}: expected ORGAN/BC/RESOLUTION, for example liver/right-side/1700", name));
  accuracy::StudyOptions options = folders;
  options.organ = name.substr(0, first), options.boundary = name.substr(first + 1, second - first - 1);
  options.resolutions = {name.substr(second + 1)};
  const auto organ = std::make_shared<accuracy::OrganCase>(options);
  return {name, Element::p1, "of the organ", kPrinted, [organ] { return organ->body(organ->resolutions().front()); }};
}

namespace {

constexpr double kDisc = 0.010, kPushStep = 0.005;  // m
// The law that stiffens is split as CalculiX's NEO HOOKE; b x is far below the printed digits.
constexpr double kNoStiffening = 1e-8;

std::vector<CalculixMesh> pushed(const CalculixMesh& mesh) {
  std::vector<CalculixMesh> all;
  for (const double depth : {10.0, 20.0, 30.0}) {
    all.push_back(mesh);
    all.back().name += fmt::format(", large strain, {:g} mm", depth);
    all.back().push_mm = depth, all.back().form = kNoStiffening;
  }
  return all;
}

// CalculiX divides by the D of its higher powers of J - 1: 1e20 leaves them out.
std::string law_words(const LawForm& form, const Material& material) {
  if (form.kind == LawForm::Kind::exponential) return accuracy::neo_hookean_words(material.poisson)(material);
  const double shear = material.young / (2 * (1 + material.poisson)), *const c = form.constant,
               d = 6 * (1 - 2 * material.poisson) / material.young;  // 2 / kappa
  if (form.kind == LawForm::Kind::yeoh)
    return fmt::format("*HYPERELASTIC, YEOH\n{:.12e},{:.12e},{:.12e},{:.12e},1e20,1e20\n", shear / 2, c[0], c[1], d);
  return fmt::format("*HYPERELASTIC, OGDEN, N=2\n{:.12e},{:.12e},{:.12e},{:.12e},{:.12e},1e20\n", shear * (1 - c[1]),
                     c[0], shear * c[1], c[2], d);
}

// The nodes of the disc follow the push; everything else is in balance.
Eigen::VectorXd push_body(const ElasticBody& elastic, const LawForm& form, const accuracy::DeepPush& push, double depth,
                          Vec3* force) {
  const LargeBody body(elastic, false, std::vector<LawForm>(elastic.materials.size(), form));
  const LargeReference reference(body.get());
  const auto count = static_cast<Eigen::Index>(3 * push.nodes.size());
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(count, reference.dofs());
  Eigen::VectorXd way(count), u = Eigen::VectorXd::Zero(reference.dofs()), lambda;
  for (Eigen::Index i = 0; i < count; ++i)
    rows(i, 3 * push.nodes[static_cast<std::size_t>(i / 3)] + i % 3) = 1, way[i] = push.inward[static_cast<int>(i % 3)];
  const int steps = static_cast<int>(std::ceil(depth / kPushStep - 1e-9));
  for (int s = 1; s <= steps; ++s)
    lambda = reference.solve(rows, depth * s / steps * way, &u, s < steps ? 1e-3 : 1e-11);
  for (Eigen::Index i = 0; i < count; ++i) (*force)[static_cast<int>(i % 3)] += lambda[i];
  return u;
}

Agreement compare_push(const CalculixMesh& mesh, const std::filesystem::path& scratch) {
  const ElasticBody body = mesh.body();
  const auto push = accuracy::push_at(body, accuracy::choose_sites(body, kDisc, 1, 1).touch.at(0), kDisc);
  const double depth = 1e-3 * mesh.push_mm;
  std::vector<double> depths;
  for (double d = 0.01; d < depth + 1e-9; d += 0.01) depths.push_back(d);
  const auto begun = studies::processor_seconds();
  Vec3 force;
  const Eigen::VectorXd ours = push_body(body, mesh.form, push, depth, &force);
  const double seconds = studies::processor_seconds() - begun;
  const auto asked = studies::Clock::now();
  const auto words = [&](const Material& material) { return law_words(mesh.form, material); };
  const auto theirs = accuracy::push_by_calculix(scratch, body, push, depths, words, true);
  const double calculix_seconds = studies::seconds_since(asked);
  if (theirs.states.size() < depths.size())
    throw OperationError(fmt::format("{}: CalculiX found no solution: {}", mesh.name, theirs.ended));
  const accuracy::PushedState& there = theirs.states.back();
  double largest = 0, worst = 0;
  for (std::size_t n = 0; n < there.u.size(); ++n) {
    const Vec3 u = load3(ours.data() + 3 * n);
    largest = std::max(largest, length(u)), worst = std::max(worst, length(u - there.u[n]));
  }
  const double force_off = length(force - there.force) / length(force);
  return {body.nodes.size(), body.nodes.size(), body.tetrahedra.size(), std::max(worst / largest, force_off), 0,
          seconds,           calculix_seconds};
}

}  // namespace

std::vector<CalculixMesh> pushed_blocks() {
  const CalculixMesh block = {"block of 120 x 120 x 80 mm", Element::p1, "0.45", kPrinted, [] {
                                return held_body(box_mesh({8, 8, 6}, {0.12, 0.12, 0.08}, 0.15), {{5400, 0.45, 0}},
                                                 [](const Point& p) { return p[2] == 0 ? 7 : 0; });
                              }};
  std::vector<CalculixMesh> all = pushed(block);
  for (const auto& [law, form] : {std::pair("Yeoh", LawForm::yeoh(-200, 300)), {"Ogden", LawForm::ogden(2, 0.3, -6)}}) {
    all.push_back(block);
    all.back().name += fmt::format(", {}, large strain, 20 mm", law);
    all.back().push_mm = 20, all.back().form = form;
  }
  return all;
}

std::vector<CalculixMesh> pushed_organ(const std::string& name, const accuracy::StudyOptions& folders) {
  return pushed(organ_mesh(name, folders));
}

Agreement compare_with_calculix(const CalculixMesh& mesh, const std::filesystem::path& scratch) {
  if (mesh.compare) return mesh.compare(scratch);
  if (mesh.push_mm > 0) return compare_push(mesh, scratch);
  const DiscreteBody discrete = discretise_body(mesh.body(), mesh.element);
  const std::vector<double> load = spread_force(discrete);
  const Answer ours = solve(discrete, load);
  const accuracy::CalculixModel model = {discrete.discretisation.coordinates, discrete.discretisation.fixed,
                                         discrete.cells, accuracy::elastic_words};
  const auto theirs = accuracy::solve_by_calculix(scratch, discrete.body, model, load);
  double largest = 0, worst = 0;
  for (std::size_t n = 0; n < discrete.node_count(); ++n) {
    largest = std::max(largest, ours.at(n).norm());
    worst = std::max(worst, (ours.at(n) - Vector3d(theirs.u[n].data())).norm());
  }
  return {discrete.body.nodes.size(), discrete.node_count(), discrete.cells.size(), worst / largest,
          discrete.seconds,           ours.seconds,          theirs.seconds};
}

}  // namespace palpate::validation
