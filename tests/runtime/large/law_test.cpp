// The laws of large deformation: energy, stress and tangent belong together, and agree with CalculiX.
#include <fmt/format.h>
#include <fmt/os.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <fstream>
#include <sstream>

#include "runtime/large/exponential_law.h"
#include "runtime/large/neo_hookean.h"
#include "studies/accuracy/calculix.h"
#include "studies/bodies/bodies.h"
#include "studies/hyperelastic/large_body.h"
#include "studies/hyperelastic/large_reference.h"
#include "tests/support/test_files.h"

namespace palpate::tests {
namespace {

using Eigen::Matrix3d;
using Eigen::VectorXd;

Deformation<double> deformed(const Matrix3d& f) {
  Deformation<double> d;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) d.h[i][k] = f(i, k) - (i == k);
  complete(d);
  return d;
}

struct NamedLaw {
  const char* name;
  LawValue<double> (*value)(const Deformation<double>&);
  LawSecond (*second)(const Deformation<double>&);
};
constexpr double kShear = 2000, kLambda = 16000, kStiffening = 1.7;
const NamedLaw kLaws[] = {
    {"compressible neo-Hookean",
     [](const Deformation<double>& d) { return compressible_neo_hookean(d, kShear, kLambda); },
     [](const Deformation<double>& d) { return compressible_neo_hookean_second(d, kShear, kLambda); }},
    {"isochoric neo-Hookean", [](const Deformation<double>& d) { return isochoric_neo_hookean(d, kShear); },
     [](const Deformation<double>& d) { return isochoric_neo_hookean_second(d, kShear); }},
    {"exponential", [](const Deformation<double>& d) { return exponential_law(d, kShear, kStiffening); },
     [](const Deformation<double>& d) { return exponential_law_second(d, kShear, kStiffening); }}};

Matrix3d stress(const NamedLaw& law, const Matrix3d& f) {
  const Deformation<double> d = deformed(f);
  double p[3][3];
  stress_of(d, law.value(d), 0.0, p);
  Matrix3d result;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) result(i, k) = p[i][k];
  return result;
}

Matrix3d some_deformation(int number) {
  Matrix3d f = Matrix3d::Identity();
  for (int i = 0; i < 9; ++i) f(i / 3, i % 3) += 0.35 * std::sin(7.3 * number + 2.1 * i);
  return f;
}

TEST(LargeLaw, StressIsTheDerivativeOfTheEnergy) {
  for (const NamedLaw& law : kLaws)
    for (int n = 0; n < 20; ++n) {
      const Matrix3d f = some_deformation(n);
      if (f.determinant() < 0.1) continue;
      const Matrix3d p = stress(law, f);
      constexpr double h = 1e-5;
      for (int i = 0; i < 9; ++i) {
        Matrix3d ahead = f, behind = f;
        ahead(i / 3, i % 3) += h, behind(i / 3, i % 3) -= h;
        const double slope = (law.value(deformed(ahead)).energy - law.value(deformed(behind)).energy) / (2 * h);
        // Central differences: h^2 times the third derivative, 1e-10 of the stress times a few hundred; rounding 1e-16 / h.
        EXPECT_NEAR(slope, p(i / 3, i % 3), 1e-6 * (p.norm() + kShear)) << law.name << " " << n;
      }
    }
}

TEST(LargeLaw, TangentIsTheDerivativeOfTheStress) {
  for (const NamedLaw& law : kLaws)
    for (int n = 0; n < 20; ++n) {
      const Matrix3d f = some_deformation(n);
      if (f.determinant() < 0.1) continue;
      const Deformation<double> d = deformed(f);
      constexpr double h = 1e-5;
      for (int i = 0; i < 9; ++i) {
        double change[3][3] = {}, expected[3][3];
        change[i / 3][i % 3] = 1;
        stress_change(d, law.value(d), law.second(d), 0, change, expected);
        Matrix3d ahead = f, behind = f;
        ahead(i / 3, i % 3) += h, behind(i / 3, i % 3) -= h;
        const Matrix3d slope = (stress(law, ahead) - stress(law, behind)) / (2 * h);
        double size = 0, miss = 0;
        for (int k = 0; k < 9; ++k) {
          size = std::max(size, std::abs(expected[k / 3][k % 3]));
          miss = std::max(miss, std::abs(expected[k / 3][k % 3] - slope(k / 3, k % 3)));
        }
        EXPECT_LE(miss, 1e-6 * (size + kShear)) << law.name << " " << n;  // as above
      }
    }
}

TEST(LargeLaw, ARotationHasNeitherEnergyNorStress) {
  const Matrix3d turn = (Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, 3).normalized())).toRotationMatrix();
  for (const NamedLaw& law : kLaws) {
    EXPECT_LE(std::abs(law.value(deformed(turn)).energy), 1e-14 * kLambda) << law.name;  // rounding
    EXPECT_LE(stress(law, turn).norm(), 1e-13 * kLambda) << law.name;
  }
}

// The reason for computing with H: at a strain of 1e-4 single precision would otherwise keep three digits of the stress.
TEST(LargeLaw, SmallStrainsKeepTheirDigitsInSinglePrecision) {
  for (double size = 1e-6; size < 0.3; size *= 10) {
    Matrix3d f = Matrix3d::Identity();
    for (int i = 0; i < 9; ++i) f(i / 3, i % 3) += size * std::sin(2.1 * i);
    Deformation<double> d = deformed(f);
    Deformation<float> single;
    for (int i = 0; i < 9; ++i) {
      single.h[i / 3][i % 3] = static_cast<float>(d.h[i / 3][i % 3]);
      d.h[i / 3][i % 3] = static_cast<double>(single.h[i / 3][i % 3]);
    }
    complete(d), complete(single);
    const auto compare = [&](const char* name, const LawValue<double>& wide, const LawValue<float>& narrow) {
      double exact[3][3];
      float p[3][3];
      stress_of(d, wide, 0.0, exact);
      stress_of(single, narrow, 0.0f, p);
      double largest = 0, miss = 0;
      for (int i = 0; i < 9; ++i) {
        largest = std::max(largest, std::abs(exact[i / 3][i % 3]));
        miss = std::max(miss, std::abs(exact[i / 3][i % 3] - static_cast<double>(p[i / 3][i % 3])));
      }
      // A few dozen roundings of 6e-8 each.
      EXPECT_LE(miss, 3e-6 * largest) << name << " at a strain of " << size;
      EXPECT_NEAR(static_cast<double>(narrow.energy) / wide.energy, 1, 1e-5) << name << " at a strain of " << size;
    };
    compare("compressible", compressible_neo_hookean(d, kShear, kLambda),
            compressible_neo_hookean(single, 2000.0f, 16000.0f));
    compare("isochoric", isochoric_neo_hookean(d, kShear), isochoric_neo_hookean(single, 2000.0f));
    compare("exponential", exponential_law(d, kShear, kStiffening), exponential_law(single, 2000.0f, 1.7f));
  }
}

TEST(LargeLaw, ElementaryFunctionsAgreeWithTheMathematicalLibrary) {
  for (double j = -0.975; j < 30; j += 0.0517) {
    EXPECT_NEAR(1 + cube_root_of_one_plus(j), std::cbrt(1 + j), 4e-15 * std::cbrt(1 + j))
        << j;  // rounding of j near -1
    EXPECT_NEAR(minus_logarithm_of_one_plus(j), j - std::log1p(j), 2e-13 * std::abs(j)) << j;
    const auto f = static_cast<float>(j);
    EXPECT_NEAR(1 + static_cast<double>(cube_root_of_one_plus(f)), std::cbrt(1.0 + static_cast<double>(f)),
                5e-7 * std::cbrt(1 + j))
        << j;
    EXPECT_NEAR(static_cast<double>(minus_logarithm_of_one_plus(f)),
                static_cast<double>(f) - std::log1p(static_cast<double>(f)), 3e-6 * std::abs(j))
        << j;
  }
  for (double x = 0.37; x <= 32; x += 0.37) {
    EXPECT_NEAR(exponential_minus_one(x) / std::expm1(x), 1, 1e-13) << x;
    // 64 times the rounding of the Taylor polynomial.
    const auto f = static_cast<float>(x);
    EXPECT_NEAR(static_cast<double>(exponential_minus_one(f)) / std::expm1(static_cast<double>(f)), 1, 1e-5) << x;
  }
}

// Node 4 of one tetrahedron is pulled by a force, the other three are held: CalculiX's displacement must be the one at which our
// inner force equals that force.
TEST(LargeLaw, OneTetrahedronBalancesTheForceThatCalculixPutsOnIt) {
  TetrahedralMesh mesh;
  mesh.nodes = {{0, 0, 0}, {0.02, 0.001, 0}, {0.002, 0.018, 0.001}, {0.004, 0.003, 0.017}};
  mesh.tetrahedra = {{0, 1, 2, 3}}, mesh.region = {0}, mesh.region_names = {"one"};
  ElasticBody elastic = body_of(mesh, {{5400, 0.45, 0}});
  const std::array<double, 3> tip = mesh.nodes[3];
  hold(elastic, [&](const auto& p) { return p == tip ? 0 : 7; });
  const LargeBody body(elastic, true);
  const TissueLaw law = body.get().laws[0];
  for (const Eigen::Vector3d& force : {Eigen::Vector3d(0.1, -0.05, 0.2), Eigen::Vector3d(0.05, 0.02, -0.25)}) {
    const auto folder = fresh_folder();
    {
      auto out = fmt::output_file((folder / "one.inp").string());
      accuracy::write_calculix_model(out, elastic, accuracy::linear_model(elastic, [&](const Material&) {
                                       return fmt::format("*HYPERELASTIC, NEO HOOKE\n{:.12e},{:.12e}\n", law.shear / 2,
                                                          2 / law.bulk);
                                     }));
      out.print("*STEP, NLGEOM, INC=500\n*STATIC\n0.1,1.,1e-5,1.\n*CONTROLS, PARAMETERS=FIELD\n1e-10,1e-10\n*CLOAD\n");
      for (int i = 0; i < 3; ++i) out.print("4,{},{:.12e}\n", i + 1, force[i]);
      out.print("*NODE PRINT, NSET=ALL, FREQUENCY=1000\nU\n*END STEP\n");
    }
    accuracy::run_calculix(folder, "one");
    VectorXd u = VectorXd::Constant(12, NAN);
    std::ifstream in(folder / "one.dat");
    for (std::string line; std::getline(in, line);) {
      std::istringstream cells(line);
      int n = 0;
      Eigen::Vector3d v;
      if (cells >> n >> v[0] >> v[1] >> v[2] && n >= 1 && n <= 4) u.segment<3>(3 * n - 3) = v;
    }
    VectorXd inner;
    const LargeReference reference(body.get());
    ASSERT_TRUE(std::isfinite(reference.energy(u, &inner)));
    EXPECT_GT(u.tail<3>().norm(), 0.004) << "not a large strain";
    // CalculiX prints seven digits.
    EXPECT_LE((inner.tail<3>() - force).norm(), 1e-6 * force.norm()) << "force " << force.transpose();
  }
}

// St. Venant-Kirchhoff, the linear law on Green's strain E: P = F (lambda tr E I + 2 mu E). No scene offers it: see below.
Matrix3d saint_venant_kirchhoff_stress(const Matrix3d& f) {
  const Matrix3d strain = (f.transpose() * f - Matrix3d::Identity()) / 2;
  return f * (kLambda * strain.trace() * Matrix3d::Identity() + 2 * kShear * strain);
}

// The stress with what the isochoric laws leave out, kappa/2 (J - 1)^2 with kappa of the same Lame constants.
Matrix3d whole_stress(const NamedLaw& law, const Matrix3d& f) {
  const Deformation<double> d = deformed(f);
  const bool compressible = &law == &kLaws[0];
  double p[3][3];
  stress_of(d, law.value(d), compressible ? 0.0 : (kLambda + 2 * kShear / 3) * d.j, p);
  Matrix3d result;
  for (int i = 0; i < 9; ++i) result(i / 3, i % 3) = p[i / 3][i % 3];
  return result;
}

TEST(LargeLaw, SmallStrainsHaveTheStressOfStVenantKirchhoff) {
  for (const NamedLaw& law : kLaws)
    for (int n = 0; n < 20; ++n) {
      const Matrix3d f = Matrix3d::Identity() + 1e-5 * (some_deformation(n) - Matrix3d::Identity());
      const Matrix3d expected = saint_venant_kirchhoff_stress(f);
      // The laws differ in the second power of the strain, 1e-5 of the stress times lambda / mu.
      EXPECT_LE((whole_stress(law, f) - expected).norm(), 2e-4 * expected.norm()) << law.name << " " << n;
    }
}

// Why scenes have none of it: pressed flat, its resistance falls to zero; that of the laws grows.
TEST(LargeLaw, PressedFlatTheLawsResistWhereStVenantKirchhoffCollapses) {
  const auto pressed = [](double stretch) { return Matrix3d(Eigen::Vector3d(stretch, 1, 1).asDiagonal()); };
  EXPECT_LT(-saint_venant_kirchhoff_stress(pressed(0.1))(0, 0),
            -0.3 * saint_venant_kirchhoff_stress(pressed(0.577))(0, 0));
  for (const NamedLaw& law : kLaws) {
    double before = 0;
    for (double stretch = 0.95; stretch > 0.03; stretch -= 0.05) {
      const double resistance = -whole_stress(law, pressed(stretch))(0, 0);
      EXPECT_GT(resistance, before) << law.name << " at " << stretch;
      before = resistance;
    }
  }
}

}  // namespace
}  // namespace palpate::tests
