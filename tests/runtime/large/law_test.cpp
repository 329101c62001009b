// The laws of large deformation: energy, stress and tangent belong together, and agree with CalculiX.
#include <fmt/format.h>
#include <fmt/os.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <fstream>
#include <functional>
#include <sstream>

#include "runtime/large/tissue_law.h"
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

constexpr double kShear = 2000, kLambda = 16000, kBulk = kLambda + 2 * kShear / 3;
struct NamedLaw {
  const char* name;
  LawForm form = {};
  bool nodal = true;  // the isochoric part alone
  TissueLaw tissue() const { return {kShear, kBulk, form}; }
};
const NamedLaw kLaws[] = {{"compressible neo-Hookean", {}, false},
                          {"isochoric neo-Hookean"},
                          {"exponential", 1.7},
                          {"Yeoh", LawForm::yeoh(300, 0)},
                          {"Yeoh that softens first", LawForm::yeoh(-400, 200)},
                          {"Ogden", LawForm::ogden(4.5)},
                          {"Ogden, negative exponent", LawForm::ogden(-4.7)},
                          {"Ogden of two terms", LawForm::ogden(2, 0.2, -9)}};

// Energy of a unit volume and stress, with the pressure of what is averaged at nodes.
template <class Real>
struct Evaluated {
  Real energy, stress[3][3];
};
template <class Real>
Evaluated<Real> evaluated(const NamedLaw& law, const Deformation<Real>& d, double pressure = 0) {
  const TissueLaw tissue = law.tissue();
  const Law kind = law_of(tissue, law.nodal);
  const Real shear = static_cast<Real>(kShear), bulk = static_cast<Real>(bulk_of(tissue, kind));
  Real form[3];
  for (int i = 0; i < 3; ++i) form[i] = static_cast<Real>(law.form.constant[i]);
  Evaluated<Real> of;
  of.energy = evaluate_law<Real>(kind, law.nodal, d, {shear, bulk, form}, static_cast<Real>(pressure), of.stress);
  return of;
}
double energy(const NamedLaw& law, const Matrix3d& f) {
  return evaluated(law, deformed(f)).energy;
}
Matrix3d stress(const NamedLaw& law, const Matrix3d& f, double pressure = 0) {
  const Evaluated<double> of = evaluated(law, deformed(f), pressure);
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(of.stress[0]);
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
        const double slope = (energy(law, ahead) - energy(law, behind)) / (2 * h);
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
      const LawTangent tangent(law.tissue(), law.nodal, d, 0);
      constexpr double h = 1e-5;
      for (int i = 0; i < 9; ++i) {
        double change[3][3] = {}, expected[3][3];
        change[i / 3][i % 3] = 1;
        tangent.change(change, expected);
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
    EXPECT_LE(std::abs(energy(law, turn)), 1e-14 * kLambda) << law.name;  // rounding
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
    for (const NamedLaw& law : kLaws) {
      const Evaluated<double> wide = evaluated(law, d);
      const Evaluated<float> narrow = evaluated(law, single);
      double largest = 0, miss = 0;
      for (int i = 0; i < 9; ++i) {
        const double exact = wide.stress[i / 3][i % 3];
        largest = std::max(largest, std::abs(exact));
        miss = std::max(miss, std::abs(exact - static_cast<double>(narrow.stress[i / 3][i % 3])));
      }
      // A few dozen roundings of 6e-8 each.
      EXPECT_LE(miss, 3e-6 * largest) << law.name << " at a strain of " << size;
      EXPECT_NEAR(static_cast<double>(narrow.energy) / wide.energy, 1, 1e-5) << law.name << " at a strain of " << size;
    }
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

TEST(LargeLaw, RestsOfTheExponentialAndTheWideLogarithmAgreeWithTheMathematicalLibrary) {
  for (double x = -31.9; x <= 32; x += 0.37) {
    const auto of = exponential_rests(x);
    EXPECT_NEAR(of.of_one / std::expm1(x), 1, 1e-13) << x;
    EXPECT_NEAR(of.of_line / (std::expm1(x) - x), 1, 1e-13 + 1e-14 / std::abs(x)) << x;  // the library's own difference
    const auto narrow = exponential_rests(static_cast<float>(x));
    EXPECT_NEAR(static_cast<double>(narrow.of_one) / std::expm1(static_cast<double>(static_cast<float>(x))), 1, 1e-5)
        << x;
  }
  for (const double x : {1e-3, -1e-5, 1e-9})
    EXPECT_NEAR(exponential_rests(x).of_line / (x * x / 2 * (1 + x / 3)), 1, 1e-6);
  for (double y = 4.1e-4; y < 3000; y *= 1.13) {
    EXPECT_NEAR(logarithm_of_one_plus(y - 1), std::log(y), 1e-12) << y;
    const auto narrow = static_cast<float>(y - 1);
    EXPECT_NEAR(static_cast<double>(logarithm_of_one_plus(narrow)), std::log1p(static_cast<double>(narrow)), 4e-6) << y;
  }
}

// Near multiples of one stretch the axes are not determined, and the stress is.
TEST(LargeLaw, PrincipalAxesGiveTheStrainBackWhereStretchesAreEqualToo) {
  const auto check = [](const Matrix3d& f) {
    const Deformation<double> d = deformed(f);
    Deformation<float> single;
    for (int i = 0; i < 9; ++i) single.h[i / 3][i % 3] = static_cast<float>(d.h[i / 3][i % 3]);
    complete(single);
    const auto wide = principal_strains(d);
    const auto narrow = principal_strains(single);
    const Matrix3d strain = f.transpose() * f - Matrix3d::Identity();
    Matrix3d found = Matrix3d::Zero(), rough = found;
    for (int n = 0; n < 3; ++n) {
      Eigen::Vector3d axis, as_float;
      for (int i = 0; i < 3; ++i) axis[i] = wide.axis[i][n], as_float[i] = static_cast<double>(narrow.axis[i][n]);
      found += (wide.square[n] - 1) * axis * axis.transpose();
      rough += (static_cast<double>(narrow.square[n]) - 1) * as_float * as_float.transpose();
    }
    EXPECT_LE((found - strain).norm(), 1e-14 * strain.norm() + 1e-15) << f;
    EXPECT_LE((rough - strain).norm(), 3e-6 * strain.norm() + 6e-7) << f;  // 6e-7: square is kept as 1 + the strain
  };
  for (int n = 0; n < 200; ++n) check(some_deformation(n));
  for (const double apart : {0.0, 1e-14, 1e-9, 1e-5, 1e-2})
    for (int n = 0; n < 20; ++n) {
      const Eigen::Quaterniond turn = Eigen::Quaterniond(1, std::sin(n), std::cos(3 * n), std::sin(5 * n)).normalized();
      const Eigen::Vector3d stretches(1.3, 1.3 + apart, n % 2 ? 0.7 : 1.3 - apart);
      check(turn * stretches.asDiagonal() * turn.conjugate());
    }
}

TEST(LargeLaw, YeohWithoutFurtherConstantsIsNeoHookeanToTheBit) {
  for (int n = 0; n < 50; ++n) {
    const Deformation<double> d = deformed(some_deformation(n));
    if (d.j < -0.9) continue;
    const auto neo = evaluated(kLaws[1], d), yeoh = evaluated({"", LawForm::yeoh(0, 0)}, d);
    EXPECT_EQ(yeoh.energy, neo.energy);
    EXPECT_EQ(Matrix3d::Map(yeoh.stress[0]), Matrix3d::Map(neo.stress[0]));
  }
}

TEST(LargeLaw, OgdenOfTheExponentTwoIsNeoHookean) {
  for (const LawForm& form : {LawForm::ogden(2), LawForm::ogden(2, 0.4, 2)})
    for (int n = 0; n < 50; ++n) {
      const Matrix3d f = some_deformation(n);
      if (f.determinant() < 0.1) continue;
      EXPECT_NEAR(energy({"", form}, f) / energy(kLaws[1], f), 1, 1e-12) << n;
      EXPECT_LE((stress({"", form}, f) - stress(kLaws[1], f)).norm(), 1e-12 * stress(kLaws[1], f).norm()) << n;
    }
}

// The derivative of the energy along a stretch, of an incompressible tissue: stretches s, then two that follow from it. Yeoh: dW/dx dx/ds;
// Ogden: sum of 2 mu / a (l^a - 1) dl / l, both by hand.
struct Stretching {
  const char* name;
  Eigen::Vector3d (*stretches)(double);
  Eigen::Vector3d logarithms;  // d ln l / d ln s
};
const Stretching kStretchings[] = {
    {"uniaxial", [](double s) { return Eigen::Vector3d(s, 1 / std::sqrt(s), 1 / std::sqrt(s)); }, {1, -0.5, -0.5}},
    {"biaxial", [](double s) { return Eigen::Vector3d(s, s, 1 / (s * s)); }, {1, 1, -2}},
    {"pure shear", [](double s) { return Eigen::Vector3d(s, 1, 1 / s); }, {1, 0, -1}}};

TEST(LargeLaw, UniaxialBiaxialAndShearHaveTheClosedFormsOfTheLaws) {
  for (const NamedLaw& law : kLaws)
    for (const Stretching& way : kStretchings)
      for (const double s : {0.5, 0.8, 1.1, 1.6, 2.2}) {
        const Eigen::Vector3d l = way.stretches(s);
        const double* const c = law.form.constant;
        const double x = l.squaredNorm() - 3, dx = 2 * l.cwiseAbs2().dot(way.logarithms) / s;
        double expected = kShear / 2 * dx;
        if (law.form.kind == LawForm::Kind::exponential) expected *= std::exp(c[0] * x);
        if (law.form.kind == LawForm::Kind::yeoh) expected += (2 * c[0] * x + 3 * c[1] * x * x) * dx;
        if (law.form.kind == LawForm::Kind::ogden) {
          const auto term = [&](double mu, double a) {
            return 2 * mu / a * l.array().pow(a).matrix().dot(way.logarithms) / s;
          };
          expected = term(kShear * (1 - c[1]), c[0]) + term(kShear * c[1], c[2]);
        }
        // The pressure does no work, as the volume stays.
        const double found = stress(law, l.asDiagonal()).diagonal().dot(l.cwiseProduct(way.logarithms)) / s;
        EXPECT_NEAR(found, expected, 1e-11 * std::abs(expected)) << law.name << ", " << way.name << " " << s;
      }
}

TEST(LargeLaw, SimpleShearHasTheClosedFormsOfTheLaws) {
  for (const double g : {0.1, 0.8, 1.5}) {
    Matrix3d f = Matrix3d::Identity();
    f(0, 1) = g;
    EXPECT_NEAR(stress({"", LawForm::yeoh(-400, 200)}, f)(0, 1) / (g * (kShear - 1600 * g * g + 1200 * g * g * g * g)),
                1, 1e-12);
    // The stretches are s and 1 / s with g = s - 1 / s, and dW/dg = dW/ds / (1 + 1 / s^2).
    const double s = g / 2 + std::sqrt(1 + g * g / 4), a = 4.5;
    const double ogden = 2 * kShear / a * (std::pow(s, a) - std::pow(s, -a)) / (s + 1 / s);
    EXPECT_NEAR(stress({"", LawForm::ogden(a)}, f)(0, 1) / ogden, 1, 1e-12);
  }
}

// Second derivatives along a (x) n: above zero wherever the volume stays near that of rest, at the ends of what the laws take.
TEST(LargeLaw, AtTheEndsOfTheirConstantsTheLawsStayElliptic) {
  const double c3 = 300, least_c2 = -std::sqrt(5.0 / 3 * kShear / 2 * c3);
  const NamedLaw at_the_ends[] = {{"Yeoh", LawForm::yeoh(0.999 * least_c2, c3)},
                                  {"Ogden 1.5", LawForm::ogden(1.5)},
                                  {"Ogden -3", LawForm::ogden(-3)},
                                  {"Ogden, both", LawForm::ogden(1.5, 0.5, -3)},
                                  {"Ogden 20", LawForm::ogden(20)}};
  const auto some = [](int n) { return Eigen::Vector3d(std::sin(1.7 * n), std::cos(2.9 * n), std::sin(4.1 * n + 1)); };
  const auto least_of = [&](const NamedLaw& law) {
    double least = INFINITY;
    for (int n = 0; n < 4000; ++n) {
      Matrix3d f = Matrix3d::Identity() + 0.9 * (n % 8 + 1) / 8 * (some_deformation(n) - Matrix3d::Identity()) / 0.35;
      if (f.determinant() < 0.01) continue;
      f /= std::cbrt(f.determinant());
      const Eigen::Vector3d normal = some(n).normalized();
      // The volume stays: a is at right angles to F^-T n.
      const Eigen::Vector3d across = (f.inverse().transpose() * normal).normalized();
      Eigen::Vector3d a = n % 2 ? Eigen::Vector3d(f * normal) : some(n + 7);
      a -= a.dot(across) * across;
      if (a.norm() < 1e-3) continue;
      const Matrix3d step = a.normalized() * normal.transpose();
      double change[3][3], result[3][3], curve = 0;
      for (int i = 0; i < 9; ++i) change[i / 3][i % 3] = step(i / 3, i % 3);
      const Deformation<double> d = deformed(f);
      LawTangent(law.tissue(), true, d, 0).change(change, result);
      for (int i = 0; i < 9; ++i) curve += change[i / 3][i % 3] * result[i / 3][i % 3];
      least = std::min(least, curve);
    }
    return least;
  };
  for (const NamedLaw& law : at_the_ends) EXPECT_GT(least_of(law), 0) << law.name;
  // Beyond, they are not: the limit of Yeoh's law is no margin.
  EXPECT_FALSE(formats::yeoh_law_takes(kShear, 1.5 * least_c2, c3));
  EXPECT_LT(least_of({"Yeoh, beyond", LawForm::yeoh(1.5 * least_c2, c3)}), 0);
}

// Constants and strains that no tissue has give finite numbers, or an infinite energy, which no step takes.
TEST(LargeLaw, ExtremeConstantsStayFiniteInSinglePrecision) {
  const NamedLaw laws[] = {{"exponential", 32},
                           {"Yeoh", LawForm::yeoh(-1e4, 2e7)},
                           {"Ogden", LawForm::ogden(50)},
                           {"Ogden, negative", LawForm::ogden(-50, 0.5, 50)}};
  for (const NamedLaw& law : laws)
    for (const double size : {0.3, 1.0, 3.0, 10.0, 40.0, 100.0}) {
      for (const auto& way : {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(1, 1, 0)}) {
        Deformation<float> d;
        for (int i = 0; i < 9; ++i) d.h[i / 3][i % 3] = i % 4 == 0 ? static_cast<float>(size * way[i / 4]) : 0;
        complete(d);
        const auto of = evaluated(law, d);
        EXPECT_GT(of.energy, 0) << law.name << size;
        for (int i = 0; i < 9; ++i) EXPECT_TRUE(std::isfinite(of.stress[i / 3][i % 3])) << law.name << size;
        EXPECT_EQ(std::isinf(of.energy), size > 60 && law.form.kind == LawForm::Kind::ogden) << law.name << size;
      }
    }
}

// Node 4 of one tetrahedron is pulled by a force, the other three are held: CalculiX's displacement must be the one at which our
// inner force equals that force.
void balance_one_tetrahedron(const LawForm& form, const std::function<std::string(const TissueLaw&)>& words) {
  TetrahedralMesh mesh;
  mesh.nodes = {{0, 0, 0}, {0.02, 0.001, 0}, {0.002, 0.018, 0.001}, {0.004, 0.003, 0.017}};
  mesh.tetrahedra = {{0, 1, 2, 3}}, mesh.region = {0}, mesh.region_names = {"one"};
  ElasticBody elastic = body_of(mesh, {{5400, 0.45, 0}});
  const std::array<double, 3> tip = mesh.nodes[3];
  hold(elastic, [&](const auto& p) { return p == tip ? 0 : 7; });
  const LargeBody body(elastic, true, {form});
  const bool is_neo_hookean = form.kind == LawForm::Kind::neo_hookean;
  const TissueLaw law = body.get().laws[0];
  for (const Eigen::Vector3d& force : {Eigen::Vector3d(0.1, -0.05, 0.2), Eigen::Vector3d(0.05, 0.02, -0.25)}) {
    const auto folder = fresh_folder();
    {
      auto out = fmt::output_file((folder / "one.inp").string());
      accuracy::write_calculix_model(out, elastic, accuracy::linear_model(elastic, [&](const Material&) {
                                       return "*HYPERELASTIC, " + words(law);
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
    // CalculiX prints seven digits of the displacement. Where a law is steep, the force changes by a larger share than the displacement.
    const double steepness =
        Eigen::MatrixXd(reference.tangent(u)).bottomRightCorner<3, 3>().norm() * u.norm() / force.norm();
    EXPECT_LE((inner.tail<3>() - force).norm(), 1e-6 * (is_neo_hookean ? 1 : std::max(1.0, steepness)) * force.norm())
        << "force " << force.transpose() << ", steepness " << steepness;
  }
}

TEST(LargeLaw, OneTetrahedronBalancesTheForceThatCalculixPutsOnIt) {
  balance_one_tetrahedron({}, [](const TissueLaw& law) {
    return fmt::format("NEO HOOKE\n{:.12e},{:.12e}\n", law.shear / 2, 2 / law.bulk);
  });
}

// CalculiX divides by the D of its higher powers of J - 1: 1e20 leaves them out.
TEST(LargeLaw, OneTetrahedronOfYeohsLawBalancesTheForceOfCalculix) {
  for (const auto& [c2, c3] : {std::pair{200.0, 100.0}, {-200.0, 150.0}})
    balance_one_tetrahedron(LawForm::yeoh(c2, c3), [c2 = c2, c3 = c3](const TissueLaw& law) {
      return fmt::format("YEOH\n{:.12e},{:.12e},{:.12e},{:.12e},1e20,1e20\n", law.shear / 2, c2, c3, 2 / law.bulk);
    });
}

TEST(LargeLaw, OneTetrahedronOfOgdensLawBalancesTheForceOfCalculix) {
  for (const double a : {4.5, -4.7})
    balance_one_tetrahedron(LawForm::ogden(a), [a](const TissueLaw& law) {
      return fmt::format("OGDEN, N=1\n{:.12e},{:.12e},{:.12e}\n", law.shear, a, 2 / law.bulk);
    });
  balance_one_tetrahedron(LawForm::ogden(2, 0.2, 9), [](const TissueLaw& law) {
    return fmt::format("OGDEN, N=2\n{:.12e},2.,{:.12e},9.,{:.12e},1e20\n", 0.8 * law.shear, 0.2 * law.shear,
                       2 / law.bulk);
  });
}

// St. Venant-Kirchhoff, the linear law on Green's strain E: P = F (lambda tr E I + 2 mu E). No scene offers it: see below.
Matrix3d saint_venant_kirchhoff_stress(const Matrix3d& f) {
  const Matrix3d strain = (f.transpose() * f - Matrix3d::Identity()) / 2;
  return f * (kLambda * strain.trace() * Matrix3d::Identity() + 2 * kShear * strain);
}

// The stress with what the isochoric laws leave out, kappa/2 (J - 1)^2 with kappa of the same Lame constants.
Matrix3d whole_stress(const NamedLaw& law, const Matrix3d& f) {
  return stress(law, f, law.nodal ? kBulk * (f.determinant() - 1) : 0);
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
