// Strain and stress inside: against closed forms, the stiffness of the precomputation, and the hyperelastic reference; places; carried
// points; what is refused; and that a scene without it does not pay.
#include <Eigen/Dense>
#include <Eigen/Sparse>
#include <atomic>
#include <thread>

#include "precompute/elements/discretisation.h"
#include "runtime/inside/inside_field.h"
#include "studies/bodies/bodies.h"
#include "studies/hyperelastic/large_body.h"
#include "studies/hyperelastic/large_reference.h"
#include "studies/validation/shapes.h"
#include "tests/runtime/asked_scene.h"
#include "tests/runtime/large/large_scene.h"

namespace palpate::tests {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using ::testing::HasSubstr;

constexpr double kYoung = 5400, kPoisson = 0.45;

SceneDef inside_def() {
  return unlimited_def(PALPATE_SHAPE_VOLUME, PALPATE_INSIDE_ON);
}

template <class Number>
Matrix3d matrix_of(const Number* t) {
  Matrix3d m;
  m << t[0], t[3], t[5], t[3], t[1], t[4], t[5], t[4], t[2];
  return m;
}

Matrix3d hooke(const Matrix3d& strain, double young = kYoung, double poisson = kPoisson) {
  const double mu = young / (2 * (1 + poisson)), lambda = 2 * mu * poisson / (1 - 2 * poisson);
  return 2 * mu * strain + lambda * strain.trace() * Matrix3d::Identity();
}

// All arrays of an answer.
struct Answer {
  explicit Answer(std::size_t rows)
      : u(3 * rows, NAN),
        strain(6 * rows, NAN),
        stress(6 * rows, NAN),
        pressure(rows, NAN),
        von_mises(rows, NAN),
        principal(3 * rows, NAN) {
    out.capacity = static_cast<std::int32_t>(rows);
    out.displacements = u.data(), out.strains = strain.data(), out.stresses = stress.data();
    out.pressures = pressure.data(), out.von_mises = von_mises.data(), out.principal = principal.data();
  }
  Answer(const Answer&) = delete;
  std::vector<float> u, strain, stress, pressure, von_mises, principal;
  palpate_inside_out out = palpate_default_inside_out();
};

// A scene and a shape of it, which a test may fill with any displacement field.
struct Shaped {
  Shaped(const TouchedBody& on, const SceneDef& def = inside_def())
      : body(on),
        nodes(static_cast<std::int32_t>(on.body.mesh.nodes.size())),
        scene(on.scene(def)),
        u(3 * static_cast<std::size_t>(nodes)),
        x(u),
        shape(shape_out(u.data(), x.data(), nodes)) {
    shape.node_count = nodes;
  }
  template <class Field>
  void fill(Field field) {
    for (std::int32_t n = 0; n < nodes; ++n) {
      const Vector3d at = body.node(n), moved = field(at);
      for (int d = 0; d < 3; ++d) {
        u[3 * n + d] = static_cast<float>(moved[d]);
        x[3 * n + d] = static_cast<float>(at[d] + moved[d]);
      }
    }
  }
  std::vector<palpate_inside_place> places(const std::vector<Vector3d>& points, double farthest = 0,
                                           std::int32_t* missing = nullptr) const {
    std::vector<palpate_inside_place> found(points.size());
    const std::int32_t without = palpate_scene_locate(scene.get(), points[0].data(),
                                                      static_cast<std::int32_t>(points.size()), farthest, found.data());
    if (missing) *missing = without;
    return found;
  }

  const TouchedBody& body;
  std::int32_t nodes;
  ScenePointer scene;
  std::vector<float> u, x;
  palpate_shape_out shape;
};

const TouchedBox& box() {
  static const TouchedBox shared;
  return shared;
}

// Points strewn through the box of 60 x 50 x 40 mm, by a fixed rule.
std::vector<Vector3d> strewn(int count, double beyond = 0) {
  std::vector<Vector3d> points;
  const Vector3d size(0.06, 0.05, 0.04);
  for (int i = 1; i <= count; ++i) {
    const Vector3d share(std::fmod(0.7548776662 * i, 1), std::fmod(0.5698402910 * i, 1),
                         std::fmod(0.3819660113 * i, 1));
    points.push_back((size + 2 * beyond * Vector3d::Ones()).cwiseProduct(share) - beyond * Vector3d::Ones());
  }
  return points;
}

// ---- values ------------------------------------------------------------------------------------------------------------

TEST(Inside, ALinearFieldHasItsStrainAndHookesStressAtEveryNodeAndPlace) {
  Shaped shaped(box());
  Matrix3d gradient;
  gradient << 0.02, -0.01, 0.005, 0.03, -0.015, 0.01, -0.02, 0.004, 0.01;
  const Vector3d shift(0.001, -0.002, 0.003);
  shaped.fill([&](const Vector3d& p) -> Vector3d { return gradient * p + shift; });
  const Matrix3d strain = 0.5 * (gradient + gradient.transpose()), stress = hooke(strain);
  const auto expect = [&](const Answer& answer, std::int32_t row, const Vector3d& displacement) {
    const auto r = static_cast<std::size_t>(row);
    // Displacements of 5 mm in single precision differ over a tetrahedron of 13 mm by 4e-8; Poisson's ratio makes it ten times as much.
    ASSERT_LT((matrix_of(&answer.strain[6 * r]) - strain).norm(), 2e-7) << row;
    ASSERT_LT((matrix_of(&answer.stress[6 * r]) - stress).norm(), 2e-5 * stress.norm()) << row;
    ASSERT_NEAR(answer.pressure[r], -stress.trace() / 3, 2e-5 * stress.norm());
    const Matrix3d deviator = stress - stress.trace() / 3 * Matrix3d::Identity();
    ASSERT_NEAR(answer.von_mises[r], std::sqrt(1.5) * deviator.norm(), 2e-5 * stress.norm());
    const Vector3d principal = Eigen::SelfAdjointEigenSolver<Matrix3d>(stress).eigenvalues().reverse();
    for (std::size_t d = 0; d < 3; ++d) {
      ASSERT_NEAR(answer.principal[3 * r + d], principal[static_cast<Eigen::Index>(d)], 2e-5 * stress.norm());
      ASSERT_NEAR(answer.u[3 * r + d], displacement[static_cast<Eigen::Index>(d)], 1e-9);
    }
  };
  Answer field(static_cast<std::size_t>(shaped.nodes));
  ASSERT_EQ(palpate_scene_inside(shaped.scene.get(), &shaped.shape, &field.out), 0u);
  ASSERT_EQ(field.out.count, shaped.nodes);
  for (std::int32_t n = 0; n < shaped.nodes; ++n) expect(field, n, gradient * shaped.body.node(n) + shift);
  const std::vector<Vector3d> points = strewn(300);
  const auto places = shaped.places(points);
  Answer at(places.size());
  ASSERT_EQ(palpate_scene_inside_at(shaped.scene.get(), places.data(), 300, &at.out), 0u);
  ASSERT_EQ(at.out.count, 300);
  for (std::int32_t i = 0; i < 300; ++i) expect(at, i, gradient * points[i] + shift);
}

TEST(Inside, APulledBlockHasYoungsModulusTimesItsStrainAndNothingAcross) {
  // Held across its faces x = 0, y = 0, z = 0, and pulled at its face x = 60 mm, it stretches alike everywhere.
  DenseBody dense = dense_box({});
  for (std::size_t n = 0; n < dense.body.mesh.nodes.size(); ++n)
    for (std::size_t d = 0; d < 3; ++d) dense.fixed[3 * n + d] = dense.body.mesh.nodes[n][d] == 0;
  const TouchedBody block(dense);
  Shaped shaped(block, with(inside_def(), PALPATE_CONTACT_NODE, PALPATE_COLLISION_OFF));
  constexpr double pull = 0.0012;
  std::vector<palpate_grip> grips;
  for (const std::int32_t node : block.touchable)
    if (block.node(node)[0] > 0.0599) grips.push_back(grip_at_node(node, {pull, 0, 0}, 1));
  const palpate_tool tool = grip_tool(grips.data(), static_cast<std::int32_t>(grips.size()));
  Contacts contacts(shaped.scene.get());
  ASSERT_EQ(palpate_scene_touch(shaped.scene.get(), &tool, 1, 1e-3, contacts.get(), contacts.bytes()), 0u);
  ASSERT_EQ(palpate_scene_shape(shaped.scene.get(), contacts.get(), &shaped.shape), 0u);
  Answer field(static_cast<std::size_t>(shaped.nodes));
  ASSERT_EQ(palpate_scene_inside(shaped.scene.get(), &shaped.shape, &field.out), 0u);
  const double strain = pull / 0.06, stress = kYoung * strain;
  double force = 0;
  for (int n = 0; n < contacts->node_count; ++n) force += contacts.nodes()[n].force[0];
  EXPECT_NEAR(force, stress * 0.05 * 0.04, 1e-4 * force);
  for (std::size_t n = 0; n < static_cast<std::size_t>(shaped.nodes); ++n) {
    // Tensors in single precision, which the sum over 16 nodes and Poisson's ratio make ten times as coarse.
    const Matrix3d expected = Vector3d(stress, 0, 0).asDiagonal();
    ASSERT_LT((matrix_of(&field.stress[6 * n]) - expected).norm(), 1e-4 * stress) << n;
    ASSERT_LT((matrix_of(&field.strain[6 * n]).diagonal() - strain * Vector3d(1, -kPoisson, -kPoisson)).norm(),
              1e-5 * strain);
    ASSERT_NEAR(field.von_mises[n], stress, 1e-4 * stress);
    ASSERT_NEAR(field.pressure[n], -stress / 3, 1e-4 * stress);
    ASSERT_NEAR(field.principal[3 * n], stress, 1e-4 * stress);
    ASSERT_NEAR(field.principal[3 * n + 2], 0, 1e-4 * stress);
  }
}

ElasticBody two_materials(double poisson) {
  TetrahedralMesh mesh = box_mesh({4, 3, 3}, {0.10, 0.08, 0.06}, 0.2);
  mesh.region_names = {"soft", "stiff"};
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) mesh.region[t] = t % 5 == 0;
  return body_of(mesh, {{5400, poisson, 0}, {60000, 0.3, 0}});
}

struct Field {
  Field(const HyperelasticBody& body, bool large) : memory(palpate_allocator{}) {
    if (!inside.create(memory, body, large, nullptr)) throw std::bad_alloc();
  }
  ~Field() { memory.release_all(); }
  Field(const Field&) = delete;
  SceneMemory memory;
  InsideField inside;
};

// The forces of the stresses of all tetrahedra on the nodes, N. nominal: turns Cauchy's stress into that of the shape at rest.
VectorXd forces_of(const InsideField& inside, const HyperelasticBody& body, const VectorXd& u, bool large) {
  VectorXd forces = VectorXd::Zero(u.size());
  for (std::int32_t e = 0; e < body.tetrahedron_count; ++e) {
    double g[3][3];
    const double volume = shape_gradients(body, e, g);
    const std::int32_t* corner = body.tetrahedra + 4 * e;
    Matrix3d f = Matrix3d::Identity();
    for (int a = 0; a < 3; ++a)
      f += (u.segment<3>(3 * corner[a + 1]) - u.segment<3>(3 * corner[0])) *
           Eigen::Map<const Vector3d>(g[a]).transpose();
    const Matrix3d cauchy = matrix_of(inside.in_tetrahedron(e).stress);
    const Matrix3d stress = large ? Matrix3d(f.determinant() * cauchy * f.inverse().transpose()) : cauchy;
    for (int a = 0; a < 3; ++a) {
      const Vector3d force = volume * stress * Eigen::Map<const Vector3d>(g[a]);
      forces.segment<3>(3 * corner[a + 1]) += force, forces.segment<3>(3 * corner[0]) -= force;
    }
  }
  return forces;
}

Eigen::VectorXf some_displacement(std::int32_t nodes, double size) {
  Eigen::VectorXf u(3 * nodes);
  for (Eigen::Index i = 0; i < u.size(); ++i)
    u[i] = static_cast<float>(size * std::sin(12.9 * static_cast<double>(i) + 0.4));
  return u;
}

TEST(Inside, TheStressOfTheTetrahedraBalancesTheForcesOfThePrecomputationsStiffness) {
  for (const double poisson : {0.3, 0.49})
    for (const Element element : {Element::p1, Element::p1_anp, Element::p1_ang}) {
      const ElasticBody elastic = two_materials(poisson);
      const LargeBody body(elastic, element);
      Field field(body.get(), false);
      const Eigen::VectorXf u = some_displacement(body.get().node_count, 0.001);
      ASSERT_EQ(field.inside.compute(u.data()), 0u);
      const VectorXd exact = u.cast<double>();
      const std::vector<double> expected =
          multiply(discretise(elastic, element).stiffness, {exact.data(), exact.data() + exact.size()});
      const VectorXd forces = forces_of(field.inside, body.get(), exact, false);
      const Eigen::Map<const VectorXd> stated(expected.data(), static_cast<Eigen::Index>(expected.size()));
      // Rounding of a sum of some 24 tetrahedra.
      EXPECT_LT((forces - stated).norm(), 1e-12 * stated.norm()) << poisson << name_of(element);
    }
}

TEST(Inside, UnderLargeDeformationTheStressBalancesTheForcesOfTheEnergy) {
  for (const bool nodal : {false, true})
    for (const LawForm& form : {LawForm(), LawForm(2.5), LawForm::yeoh(-3000, 9000), LawForm::ogden(-5, 0.3, 12)}) {
      const LargeBody body(two_materials(0.45), nodal, {0, form});
      const LargeReference reference(body.get());
      Field field(body.get(), true);
      const Eigen::VectorXf u = some_displacement(body.get().node_count, 0.002);
      ASSERT_EQ(field.inside.compute(u.data()), 0u);
      VectorXd expected;
      double least = 0;
      reference.energy(u.cast<double>(), &expected, &least);
      EXPECT_LT(least, 0.8) << "not a large strain";
      const VectorXd forces = forces_of(field.inside, body.get(), u.cast<double>(), true);
      EXPECT_LT((forces - expected).norm(), 1e-11 * expected.norm())
          << nodal << form.constant[0];  // rounding, as above
    }
}

TEST(Inside, ATurnedBodyUnderLargeDeformationHasNoStrainAndALinearOneHas) {
  const LargeBody body(two_materials(0.45), true);
  const Matrix3d turn(Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()));
  std::vector<float> u;
  for (std::int32_t n = 0; n < body.get().node_count; ++n) {
    const Vector3d p(body.elastic().nodes[n].data()), moved = turn * p - p;
    for (int d = 0; d < 3; ++d) u.push_back(static_cast<float>(moved[d]));
  }
  Field large(body.get(), true), linear(body.get(), false);
  ASSERT_EQ(large.inside.compute(u.data()), 0u);
  ASSERT_EQ(linear.inside.compute(u.data()), 0u);
  // Displacements of 5 cm in single precision, 4e-9, over tetrahedra of 10 mm.
  EXPECT_LT(matrix_of(large.inside.at_node(20).strain).norm(), 2e-6);
  EXPECT_GT(matrix_of(linear.inside.at_node(20).strain).norm(), 0.1);
}

TEST(Inside, AFlattenedTetrahedronIsFlagged) {
  const LargeBody body(two_materials(0.45), true);
  Field field(body.get(), true);
  EXPECT_EQ(field.inside.compute(some_displacement(body.get().node_count, 0.05).data()), PALPATE_STEP_UNSOLVED);
  for (std::int32_t n = 0; n < body.get().node_count; ++n)
    for (const double s : field.inside.at_node(n).stress) ASSERT_TRUE(std::isfinite(s));
}

TEST(Inside, AThickSphereUnderPressureHasLamesStress) {
  constexpr double a = 0.02, b = 0.04, pressure = 300, poisson = 0.49;
  ElasticBody body = body_of(validation::shell_octant(a, b, 12), {{5400, poisson, 0}});
  hold(body, [](const auto& p) {
    return (std::abs(p[0]) < 1e-9 ? 1 : 0) | (std::abs(p[1]) < 1e-9 ? 2 : 0) | (std::abs(p[2]) < 1e-9 ? 4 : 0);
  });
  VectorXd load = VectorXd::Zero(static_cast<Eigen::Index>(3 * body.nodes.size()));
  const auto place = [&](std::int32_t n) { return Vector3d(body.nodes[n].data()); };
  for (const auto& t : body.triangles) {
    if (place(t[0]).norm() > 1.001 * a || place(t[1]).norm() > 1.001 * a || place(t[2]).norm() > 1.001 * a) continue;
    const Vector3d third = pressure / 6 * (place(t[1]) - place(t[0])).cross(place(t[2]) - place(t[0]));
    for (const std::int32_t n : t) load.segment<3>(3 * n) -= third;
  }
  const LargeBody seen(body, true);
  // The stiffness at rest is that of the precomputation; what the planes hold gets a stiff spring.
  LargeReference::Sparse stiffness = LargeReference(seen.get()).tangent(VectorXd::Zero(load.size()));
  for (Eigen::Index i = 0; i < load.size(); ++i)
    if (body.fixed[i / 3][i % 3]) stiffness.coeffRef(i, i) += 1e9;
  const VectorXd u = Eigen::SimplicialLDLT<LargeReference::Sparse>(stiffness).solve(load);
  const std::vector<float> single(u.begin(), u.end());
  Field field(seen.get(), false);
  ASSERT_EQ(field.inside.compute(single.data()), 0u);
  // Lame: sigma_r = k (1 - b^3 / r^3), sigma_t = k (1 + b^3 / (2 r^3)) with k = p a^3 / (b^3 - a^3). The mean stress is k everywhere.
  const double k = pressure * a * a * a / (b * b * b - a * a * a);
  double worst_pressure = 0, worst_radial = 0, worst_across = 0, worst_raw = 0;
  for (std::int32_t n = 0; n < seen.get().node_count; ++n) {
    const Vector3d p = place(n);
    const double r = p.norm(), cube = b * b * b / (r * r * r);
    const bool inner = r > 1.15 * a && r < 0.92 * b && p.minCoeff() > 0.003;
    if (!inner) continue;
    const Matrix3d stress = matrix_of(field.inside.at_node(n).stress);
    const Vector3d out = p.normalized(), along = out.unitOrthogonal();
    worst_pressure = std::max(worst_pressure, std::abs(stress.trace() / 3 - k));
    worst_radial = std::max(worst_radial, std::abs(out.dot(stress * out) - k * (1 - cube)));
    worst_across = std::max(worst_across, std::abs(along.dot(stress * along) - k * (1 + cube / 2)));
  }
  for (std::int32_t e = 0; e < seen.get().tetrahedron_count; ++e) {
    const std::int32_t* c = seen.get().tetrahedra + 4 * e;
    const Vector3d p = 0.25 * (place(c[0]) + place(c[1]) + place(c[2]) + place(c[3]));
    if (p.norm() < 1.15 * a || p.norm() > 0.92 * b || p.minCoeff() < 0.003) continue;
    const Matrix3d strain = matrix_of(field.inside.in_tetrahedron(e).strain);
    worst_raw = std::max(worst_raw, std::abs(5400 / (3 * (1 - 2 * poisson)) * strain.trace() - k));
  }
  // Twelve cells along each edge. Means over tetrahedra err by the square of their size, as h / r = 1 / 12 and the third power in r make
  // it; the pressure at the boundary layers is left out above.
  EXPECT_LT(worst_radial, 0.035 * pressure);
  EXPECT_LT(worst_across, 0.03 * pressure);
  EXPECT_LT(worst_pressure, 0.015 * pressure);
  EXPECT_GT(worst_raw, 5 * worst_pressure) << "single tetrahedra are as good: why average?";
}

TEST(Inside, StressJumpsWhereRegionsMeetAndStrainDoesNot) {
  // The part with x above 40 mm is ten times as stiff, to the 2 mm by which inner nodes leave that plane; the field is linear.
  TouchedBody halves(dense_box({}), [](BundleParts& parts) {
    const auto nodes = parts.get<double>(formats::SectionId::nodes);
    const auto tetrahedra = parts.get<std::int32_t>(formats::SectionId::tetrahedra);
    std::vector<std::int32_t> region;
    for (std::size_t e = 0; e < tetrahedra.size() / 4; ++e) {
      double x = 0;
      for (std::size_t c = 0; c < 4; ++c) x += nodes[3 * tetrahedra[4 * e + c]] / 4;
      region.push_back(x > 0.04);
    }
    parts.set(formats::SectionId::region, {region.size()}, region);
    parts.set(formats::SectionId::young, {2}, std::vector<double>{kYoung, 10 * kYoung});
    parts.set(formats::SectionId::poisson, {2}, std::vector<double>{kPoisson, kPoisson});
    parts.set_text(formats::SectionId::region_names, "soft\nstiff\n");
  });
  Shaped shaped(halves);
  shaped.fill([](const Vector3d& p) { return Vector3d(0.02 * p[0], 0, 0); });
  ASSERT_EQ(palpate_scene_inside(shaped.scene.get(), &shaped.shape, nullptr), 0u);
  const Matrix3d strain = Vector3d(0.02, 0, 0).asDiagonal(), soft = hooke(strain);
  const auto places = shaped.places({{0.037, 0.02, 0.02}, {0.043, 0.02, 0.02}});
  Answer at(2);
  ASSERT_EQ(palpate_scene_inside_at(shaped.scene.get(), places.data(), 2, &at.out), 0u);
  EXPECT_LT((matrix_of(&at.stress[0]) - soft).norm(), 1e-4 * soft.norm());
  EXPECT_LT((matrix_of(&at.stress[6]) - 10 * soft).norm(), 1e-4 * 10 * soft.norm());
  EXPECT_LT((matrix_of(&at.strain[0]) - strain).norm(), 1e-6);
  EXPECT_LT((matrix_of(&at.strain[6]) - strain).norm(), 1e-6);
}

TEST(Inside, TheStrainOfThePreloadIsPartOfTheStrain) {
  const TouchedBody loaded(dense_box({}), [](BundleParts& parts) {
    const auto nodes = parts.get<double>(formats::SectionId::nodes);
    std::vector<double> sag(nodes.size());
    for (std::size_t n = 0; n < nodes.size(); n += 3) sag[n + 2] = -0.01 * nodes[n + 2];
    parts.set(formats::SectionId::preload_displacement, {nodes.size() / 3, 3}, sag);
  });
  Shaped shaped(loaded, with(inside_def(), PALPATE_PRELOAD_ON));
  shaped.fill([](const Vector3d& p) { return Vector3d(0.02 * p[0], 0, 0); });
  Answer field(static_cast<std::size_t>(shaped.nodes));
  ASSERT_EQ(palpate_scene_inside(shaped.scene.get(), &shaped.shape, &field.out), 0u);
  const Matrix3d strain = Vector3d(0.02, 0, -0.01).asDiagonal();
  EXPECT_LT((matrix_of(&field.strain[6 * 7]) - strain).norm(), 1e-6);
  EXPECT_NEAR(field.u[3 * 7], 0.02 * loaded.node(7)[0], 1e-9) << "displacements count from rest";
}

TEST(StressMeasures, PrincipalValuesAreTheEigenvaluesWhereTheyMeetToo) {
  std::vector<Matrix3d> tensors = {
      Matrix3d::Zero(), 3 * Matrix3d::Identity(), Matrix3d(Vector3d(2, 2, -1).asDiagonal()),
      Matrix3d(Vector3d(2, -1, -1).asDiagonal()), Matrix3d(Vector3d(1e5, 1e5 + 1e-3, 1e5).asDiagonal())};
  for (int i = 0; i < 200; ++i) {
    Matrix3d m;
    for (int j = 0; j < 9; ++j) m(j / 3, j % 3) = std::sin(7.1 * i + 3.3 * j);
    tensors.push_back(m + m.transpose());
  }
  for (const Matrix3d& m : tensors) {
    const double t[6] = {m(0, 0), m(1, 1), m(2, 2), m(0, 1), m(1, 2), m(0, 2)};
    double values[3];
    principal_of(t, values);
    const Vector3d expected = Eigen::SelfAdjointEigenSolver<Matrix3d>(m).eigenvalues().reverse();
    const Matrix3d deviator = m - m.trace() / 3 * Matrix3d::Identity();
    for (int d = 0; d < 3; ++d)
      EXPECT_NEAR(values[d], expected[d], 2e-7 * deviator.norm() + 1e-12 * m.norm()) << m;  // as the header states
    EXPECT_GE(values[0], values[1]);
    EXPECT_GE(values[1], values[2]);
    EXPECT_NEAR(von_mises_of(t), std::sqrt(1.5) * deviator.norm(), 1e-12 * (1 + m.norm()));
  }
}

// ---- places ------------------------------------------------------------------------------------------------------------

TEST(InsidePlaces, AreWhereThePointsAre) {
  const Shaped shaped(box());
  const std::vector<Vector3d> points = strewn(1000);
  std::int32_t missing = -1;
  const auto places = shaped.places(points, 0, &missing);
  EXPECT_EQ(missing, 0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    Vector3d sum = Vector3d::Zero();
    for (std::size_t c = 0; c < 4; ++c) {
      ASSERT_GE(places[i].weight[c], -1e-9);
      const auto& t = box().body.mesh.tetrahedra[places[i].tetrahedron];
      sum += places[i].weight[c] * box().node(t[c]);
    }
    ASSERT_LT((sum - points[i]).norm(), 1e-15);
    ASSERT_EQ(places[i].distance, 0);
  }
}

TEST(InsidePlaces, OutsideHaveTheDistanceOfTheMeshAndNoTetrahedronBeyondTheFarthest) {
  const Shaped shaped(box());
  const std::vector<Vector3d> points = strewn(1000, 0.02);
  constexpr double farthest = 0.005;
  std::int32_t missing = -1, expected = 0;
  const auto places = shaped.places(points, farthest, &missing);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vector3d clamped = points[i].cwiseMax(Vector3d::Zero()).cwiseMin(Vector3d(0.06, 0.05, 0.04));
    const double distance = (points[i] - clamped).norm();
    expected += distance > farthest;
    ASSERT_EQ(places[i].tetrahedron<0, distance> farthest) << i;
    if (places[i].tetrahedron < 0) continue;
    ASSERT_NEAR(places[i].distance, distance, 1e-12);
  }
  EXPECT_EQ(missing, expected);
  EXPECT_GT(missing, 100);
  const std::vector<Vector3d> hostile = {{NAN, 0, 0}, {0, INFINITY, 0}, {1e300, 0, 0}, {0.01, 0.01, 0.01}};
  EXPECT_EQ((shaped.places(hostile, INFINITY, &missing)[3].tetrahedron >= 0), true);
  EXPECT_EQ(missing, 3);
}

TEST(InsidePlaces, CarriedPointsMoveAsTheVolumeDoesAndThoseJustOutsideGoOnInAStraightLine) {
  Shaped shaped(box());
  palpate_grip grip = grip_at_node(box().touchable[20], {-0.003, 0.001, 0.002});
  const palpate_tool tool = grip_tool(&grip);
  Contacts contacts(shaped.scene.get());
  ASSERT_EQ(palpate_scene_touch(shaped.scene.get(), &tool, 1, 1e-3, contacts.get(), contacts.bytes()), 0u);
  ASSERT_EQ(palpate_scene_shape(shaped.scene.get(), contacts.get(), &shaped.shape), 0u);
  const std::vector<Vector3d> points = strewn(200);
  const auto places = shaped.places(points);
  std::vector<float> moved(600, NAN);
  ASSERT_EQ(palpate_scene_carry(shaped.scene.get(), &shaped.shape, places.data(), 200, moved.data()), 0u);
  double farthest = 0;
  for (std::size_t i = 0; i < 200; ++i) {
    Vector3d expected = Vector3d::Zero();
    const auto& t = box().body.mesh.tetrahedra[places[i].tetrahedron];
    for (std::size_t c = 0; c < 4; ++c)
      expected += places[i].weight[c] * Eigen::Map<const Eigen::Vector3f>(&shaped.x[3 * t[c]]).cast<double>();
    const Vector3d found = Eigen::Map<const Eigen::Vector3f>(&moved[3 * i]).cast<double>();
    ASSERT_LT((found - expected).norm(), 1e-8);
    farthest = std::max(farthest, (found - points[i]).norm());
  }
  EXPECT_GT(farthest, 1e-4) << "nothing moved";
  // An affine motion takes points outside along exactly.
  Matrix3d gradient;
  gradient << 0.1, 0.2, 0, -0.3, 0.1, 0.05, 0, 0.1, -0.2;
  shaped.fill([&](const Vector3d& p) -> Vector3d { return gradient * p; });
  const std::vector<Vector3d> outside = {{0.062, 0.02, 0.02}, {-0.001, -0.002, 0.01}};
  const auto beside = shaped.places(outside, 0.003);
  ASSERT_EQ(palpate_scene_carry(shaped.scene.get(), &shaped.shape, beside.data(), 2, moved.data()), 0u);
  for (std::size_t i = 0; i < 2; ++i)
    EXPECT_LT(
        (Eigen::Map<const Eigen::Vector3f>(&moved[3 * i]).cast<double>() - outside[i] - gradient * outside[i]).norm(),
        1e-7);
}

TEST(InsidePlaces, OutsideHaveTheStressOfTheirTetrahedronAndNoneBeyondIt) {
  Shaped shaped(box());
  shaped.fill([](const Vector3d& p) { return Vector3d(p[0] * p[0], p[0] * p[1], 0); });
  ASSERT_EQ(palpate_scene_inside(shaped.scene.get(), &shaped.shape, nullptr), 0u);
  auto places = shaped.places({{0.068, 0.021, 0.017}, {0.03, -0.006, 0.012}}, 0.01);
  std::vector<palpate_inside_place> within = places;
  for (palpate_inside_place& place : within) {
    double sum = 0;
    for (double& w : place.weight) sum += w = std::max(w, 0.0);
    EXPECT_GT(sum, 1.1) << "not outside";
    for (double& w : place.weight) w /= sum;
  }
  Answer outside(2), inside(2);
  ASSERT_EQ(palpate_scene_inside_at(shaped.scene.get(), places.data(), 2, &outside.out), 0u);
  ASSERT_EQ(palpate_scene_inside_at(shaped.scene.get(), within.data(), 2, &inside.out), 0u);
  EXPECT_EQ(outside.stress, inside.stress);
  EXPECT_NE(outside.u, inside.u) << "displacements go on in a straight line";
}

// ---- the contract --------------------------------------------------------------------------------------------------------

TEST(Inside, BadInputIsFlaggedAndAnsweredWithNumbers) {
  Shaped shaped(box());
  palpate_scene* const scene = shaped.scene.get();
  const auto places = shaped.places(strewn(4));
  Answer at(4);
  EXPECT_EQ(palpate_scene_inside_at(scene, places.data(), 4, &at.out), PALPATE_STEP_BAD_INPUT) << "no field yet";
  shaped.u[5] = NAN, shaped.u[7] = INFINITY;
  Answer field(static_cast<std::size_t>(shaped.nodes));
  EXPECT_EQ(palpate_scene_inside(scene, &shaped.shape, &field.out), PALPATE_STEP_BAD_INPUT);
  for (const float s : field.stress) ASSERT_TRUE(std::isfinite(s));
  auto wrong = places;
  wrong[0].tetrahedron = INT32_MAX, wrong[1].tetrahedron = -1, wrong[2].weight[1] = NAN;
  EXPECT_EQ(palpate_scene_inside_at(scene, wrong.data(), 4, &at.out), PALPATE_STEP_BAD_INPUT);
  for (std::size_t i = 0; i < 18; ++i) EXPECT_EQ(at.stress[i], 0);
  std::vector<float> moved(12, NAN);
  EXPECT_EQ(palpate_scene_carry(scene, &shaped.shape, wrong.data(), 4, moved.data()), PALPATE_STEP_BAD_INPUT);
  for (std::size_t i = 0; i < 9; ++i) EXPECT_EQ(moved[i], 0);
  at.out.capacity = 2;
  EXPECT_EQ(palpate_scene_inside_at(scene, places.data(), 4, &at.out), 0u);
  EXPECT_EQ(at.out.count, 2);
  palpate_shape_out few = shaped.shape;
  few.node_count = shaped.nodes - 1;
  EXPECT_EQ(palpate_scene_inside(scene, &few, nullptr), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(palpate_scene_carry(scene, &few, places.data(), 4, moved.data()), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(palpate_scene_inside(nullptr, &shaped.shape, nullptr), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(palpate_scene_inside(scene, nullptr, nullptr), PALPATE_STEP_BAD_INPUT);
  const double point[3] = {0.01, 0.01, 0.01};
  palpate_inside_place place;
  EXPECT_EQ(palpate_scene_locate(scene, point, 1, -1, &place), -1);
  EXPECT_EQ(palpate_scene_locate(scene, point, 1, NAN, &place), -1);
  EXPECT_EQ(palpate_scene_locate(scene, nullptr, 1, 0, &place), -1);
  // A scene without inside.
  const ScenePointer plain = box().scene(SceneDef());
  EXPECT_EQ(palpate_scene_locate(plain.get(), point, 1, 0, &place), -1);
  EXPECT_EQ(palpate_scene_inside(plain.get(), &shaped.shape, nullptr), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(palpate_scene_inside_at(plain.get(), places.data(), 4, &at.out), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(palpate_scene_carry(plain.get(), &shaped.shape, places.data(), 4, moved.data()), PALPATE_STEP_BAD_INPUT);
}

std::string refusal(const TouchedBody& on, SceneDef def, palpate_status status) {
  const palpate_error error = refusal_of(on, def);
  EXPECT_EQ(error.status, status) << error.text;
  return error.text;
}

TEST(Inside, IsRefusedWhereItCannotBeRight) {
  EXPECT_THAT(refusal(box(), with(inside_def(), PALPATE_SHAPE_SURFACE), PALPATE_ERROR_ARGUMENT),
              HasSubstr("shape VOLUME"));
  const auto changed = [](const std::function<void(BundleParts&)>& change) {
    return TouchedBody(dense_box({}), change);
  };
  using formats::SectionId;
  EXPECT_THAT(refusal(changed([](BundleParts& parts) {
                        parts.provenance.replace(parts.provenance.find("\"p1\""), 4, "\"p2-p0\"");
                      }),
                      inside_def(), PALPATE_ERROR_EFFECT),
              HasSubstr("found p2-p0"));
  const TouchedBody without(dense_box({.interior = false}));
  EXPECT_THAT(refusal(without, inside_def(), PALPATE_ERROR_EFFECT), HasSubstr("tensors/displacement_interior"));
  SceneDef bare = inside_def();
  bare.contact = PALPATE_CONTACT_NODE;  // a patch would ask for the moduli first
  for (const double poisson : {0.5, -1.0, double{NAN}})
    EXPECT_THAT(
        refusal(changed([&](BundleParts& parts) { parts.set(SectionId::poisson, {1}, std::vector<double>{poisson}); }),
                bare, PALPATE_ERROR_CONTENT),
        HasSubstr("material/young"));
  // Two corners exchanged, and a flat tetrahedron.
  for (const bool flat : {false, true}) {
    const TouchedBody damaged = changed([&](BundleParts& parts) {
      auto t = parts.get<std::int32_t>(SectionId::tetrahedra);
      if (!flat) std::swap(t[4], t[5]);
      if (flat) t[5] = t[4];
      parts.set(SectionId::tetrahedra, {t.size() / 4, 4}, t);
    });
    EXPECT_THAT(refusal(damaged, bare, PALPATE_ERROR_CONTENT), HasSubstr("mesh/tetrahedra")) << flat;
  }
  // A node or a region that does not exist, in a file: the bytes in memory were checked when they were opened.
  const auto refused = [&](const auto& change) -> std::string {
    const auto file = scratch_file("damaged.h5");
    BundleParts parts = dense_bundle(dense_box({}));
    change(parts);
    write_bundle(file, parts);
    palpate_bundle* bundle = nullptr;
    palpate_scene* scene = nullptr;
    palpate_error error = {};
    if (palpate_bundle_open_file(file.c_str(), nullptr, &bundle, &error) == PALPATE_OK)
      palpate_scene_create(bundle, &bare, &scene, &error);
    EXPECT_EQ(scene, nullptr);
    palpate_bundle_close(bundle);
    std::filesystem::remove(file);
    EXPECT_EQ(error.status, PALPATE_ERROR_CONTENT);
    return error.text;
  };
  EXPECT_THAT(refused([](BundleParts& parts) {
                auto t = parts.get<std::int32_t>(SectionId::tetrahedra);
                t[5] = 1'000'000;
                parts.set(SectionId::tetrahedra, {t.size() / 4, 4}, t);
              }),
              HasSubstr("mesh/tetrahedra"));
  EXPECT_THAT(refused([](BundleParts& parts) {
                auto region = parts.get<std::int32_t>(SectionId::region);
                region[3] = 7;
                parts.set(SectionId::region, {region.size()}, region);
              }),
              HasSubstr("mesh/region"));
}

TEST(Inside, OffTakesNoMemoryMapsNoTetrahedraAndHasNoPass) {
  SceneDef on = inside_def(), off = on;
  off.inside.inside = PALPATE_INSIDE_OFF;
  const auto text = [](const SceneDef& def) { return plan_text(box().scene(def).get()); };
  EXPECT_EQ(text(off).find("mesh/tetrahedra"), std::string::npos);
  EXPECT_EQ(text(off).find("inside"), std::string::npos);
  EXPECT_THAT(text(on), HasSubstr("create tetrahedra of the inside [mesh/nodes mesh/tetrahedra mesh/region "
                                  "material/young material/poisson provenance]\n"));
  EXPECT_THAT(text(on), HasSubstr("shape inside: strain and stress []\n"));
  const std::size_t tetrahedra = box().body.mesh.tetrahedra.size(), nodes = box().body.mesh.nodes.size();
  const std::size_t taken = bytes_of(on, box()) - bytes_of(off, box());
  EXPECT_LT(taken, 220 * tetrahedra + 320 * nodes);  // as inside_field.h states
  // The plan states it.
  const ScenePointer scene = box().scene(on);
  std::uint64_t planned = 0;
  for (const palpate_plan_pass& pass : plan_of(scene.get()))
    if (std::string(pass.name) == "tetrahedra of the inside") planned = pass.memory_bytes;
  EXPECT_EQ(planned, taken);
}

TEST(Inside, PlacesAreFoundInOtherThreadsWhileAFieldIsComputed) {
  Shaped shaped(box());
  shaped.fill([](const Vector3d& p) { return Vector3d(0.02 * p[0], 0, 0); });
  const auto points = strewn(500);
  const auto expected = shaped.places(points, 0);
  std::atomic<bool> done{false}, same{true};
  const auto find = [&] {
    do {
      const auto found = shaped.places(points, 0);
      for (std::size_t i = 0; i < points.size(); ++i)
        if (found[i].tetrahedron != expected[i].tetrahedron) same = false;
    } while (!done);
  };
  std::thread first(find), second(find);
  for (int i = 0; i < 200; ++i) palpate_scene_inside(shaped.scene.get(), &shaped.shape, nullptr);
  done = true;
  first.join(), second.join();
  EXPECT_TRUE(same);
}

TEST(Inside, AScenesLargeDeformationHasGreenAndLagrangesStrain) {
  const TouchedBody body = large_body(true);
  SceneDef def = with(large_def(PALPATE_CONTACT_NODE), PALPATE_SHAPE_VOLUME, PALPATE_INSIDE_ON);
  Shaped shaped(body, def);
  Matrix3d gradient;
  gradient << 0.3, 0.2, 0, -0.1, 0.1, 0.05, 0, 0.1, -0.2;
  shaped.fill([&](const Vector3d& p) -> Vector3d { return gradient * p; });
  Answer field(static_cast<std::size_t>(shaped.nodes));
  ASSERT_EQ(palpate_scene_inside(shaped.scene.get(), &shaped.shape, &field.out), 0u);
  const Matrix3d f = Matrix3d::Identity() + gradient, b = f * f.transpose();
  const Matrix3d strain = 0.5 * (f.transpose() * f - Matrix3d::Identity());
  // Isochoric neo-Hookean: sigma = mu J^(-5/3) dev b + kappa (J - 1).
  const double mu = kYoung / (2 * (1 + kPoisson)), kappa = kYoung / (3 * (1 - 2 * kPoisson)), j = f.determinant();
  const Matrix3d stress =
      mu * std::pow(j, -5.0 / 3) * (b - b.trace() / 3 * Matrix3d::Identity()) + kappa * (j - 1) * Matrix3d::Identity();
  for (std::size_t n = 0; n < static_cast<std::size_t>(shaped.nodes); ++n) {
    ASSERT_LT((matrix_of(&field.strain[6 * n]) - strain).norm(), 1e-6 * strain.norm());
    ASSERT_LT((matrix_of(&field.stress[6 * n]) - stress).norm(), 1e-5 * stress.norm());
  }
}

}  // namespace
}  // namespace palpate::tests
