// Curves of force against depth that are made up, of incompressible tissue: a cylinder between sliding plates, whose stretches are the same
// everywhere, and bodies of other shapes whose force is a closed form or an integral of one.
#pragma once

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <random>

#include "programs/fit/curve_fit.h"

namespace palpate::fit {

enum class Shape {
  compressed,  // a cylinder between plates
  squeezed,    // a block between plates and two walls
  sheared,     // a block; the shear is twice the strain
  twisted      // a cylinder; the torque, where the shear at its rim is twice the strain
};

struct Noise {
  Shape shape = Shape::compressed;
  int units = 8, depths = 10;
  double least_strain = 0.05, most_strain = 0.5;
  // Relative standard deviations: of the units' stiffness; of what is correlated along the curve of each unit; of the same of all units alike;
  // of each row.
  double of_units = 0, along_curves = 0, of_law = 0, of_rows = 0;
  double length = 0.3;  // of correlation, over the largest strain
  bool rough = false;   // the correlation is that of a continuous function without a slope, exp(-|x - y| / length)
  double of_zero = 0;   // of the depth's zero, over the largest strain, of all units alike
};

// Force over the undeformed area and over the shear modulus at a compression, for a law over a shear modulus of 1 Pa. The formulas of
// runtime/large's laws with J = 1, written anew.
inline double plate_stress(const LawForm& law, double strain) {
  const double l = 1 - strain, first = l * l + 2 / l - 3, shape = 1 / (l * l) - l;
  const double* c = law.constant;
  switch (law.kind) {
    case LawForm::Kind::neo_hookean:
      return shape;
    case LawForm::Kind::exponential:
      return shape * std::exp(c[0] * first);
    case LawForm::Kind::yeoh:
      return 2 * shape * (0.5 + 2 * c[0] * first + 3 * c[1] * first * first);
    case LawForm::Kind::ogden:
      break;
  }
  const auto term = [&](double shear, double a) {
    return 2 * shear / a * (std::pow(l, -a / 2 - 1) - std::pow(l, a - 1));
  };
  return term(1 - c[1], c[0]) + (c[1] > 0 ? term(c[1], c[2]) : 0);
}

// The same sheared by g: the derivative of the energy by g.
inline double shear_stress(const LawForm& law, double g) {
  const double* c = law.constant;
  switch (law.kind) {
    case LawForm::Kind::neo_hookean:
      return g;
    case LawForm::Kind::exponential:
      return g * std::exp(c[0] * g * g);
    case LawForm::Kind::yeoh:
      return 2 * g * (0.5 + 2 * c[0] * g * g + 3 * c[1] * g * g * g * g);
    case LawForm::Kind::ogden:
      break;
  }
  const double l = (g + std::sqrt(g * g + 4)) / 2;
  const auto term = [&](double shear, double a) {
    return 2 * shear / a * (std::pow(l, a) - std::pow(l, -a)) / (l + 1 / l);
  };
  return term(1 - c[1], c[0]) + (c[1] > 0 ? term(c[1], c[2]) : 0);
}

// Up to a factor of the body's size.
inline double stress_of(Shape shape, const LawForm& law, double strain) {
  const double l = 1 - strain;
  switch (shape) {
    case Shape::compressed:
      return plate_stress(law, strain);
    case Shape::squeezed:  // stretches l, 1 and 1 / l: those of a shear by 1 / l - l
      return shear_stress(law, 1 / l - l) * (1 + 1 / (l * l));
    case Shape::sheared:
      return shear_stress(law, 2 * strain);
    case Shape::twisted:
      break;
  }
  constexpr int kRings = 50;
  double torque = 0;
  for (int ring = 0; ring < kRings; ++ring) {
    const double r = (ring + 0.5) / kRings;
    torque += 3 * r * r / kRings * shear_stress(law, 2 * strain * r);
  }
  return torque;
}

// The force of a law over its shear modulus at the strains of the data.
inline ForceModel shape_model(const CurveData& data, Shape shape = Shape::compressed, double area = 7e-4) {
  return [strain = data.strain, shape, area](const std::vector<LawForm>& laws) {
    std::vector<Eigen::VectorXd> forces;
    for (const LawForm& law : laws) {
      auto& force = forces.emplace_back(static_cast<Eigen::Index>(strain.size()));
      for (std::size_t r = 0; r < strain.size(); ++r)
        force[static_cast<Eigen::Index>(r)] = area * stress_of(shape, law, strain[r]);
    }
    return forces;
  };
}

class MadeCurves {
 public:
  static constexpr double shear = 2138;  // Pa
  static constexpr double area = 7e-4;   // m^2

  MadeCurves(const LawFamily& family, const std::vector<double>& constants, const Noise& noise, unsigned seed = 7)
      : MadeCurves(law_of(family, constants), noise, seed) {}
  MadeCurves(const LawForm& law, const Noise& noise, unsigned seed) : shape_(noise.shape) {
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> normal;
    Eigen::VectorXd strain(noise.depths);
    for (int i = 0; i < noise.depths; ++i)
      strain[i] = noise.least_strain + (noise.most_strain - noise.least_strain) * i / (noise.depths - 1.0);
    Eigen::MatrixXd k(noise.depths, noise.depths);
    for (int i = 0; i < noise.depths; ++i)
      for (int j = 0; j < noise.depths; ++j) {
        const double apart = std::abs(strain[i] - strain[j]) / (noise.length * noise.most_strain);
        k(i, j) = std::exp(noise.rough ? -apart : -apart * apart / 2) + (i == j ? 1e-9 : 0);
      }
    const Eigen::MatrixXd root = k.llt().matrixL();
    const auto drawn = [&]() -> Eigen::VectorXd {
      Eigen::VectorXd x(noise.depths);
      for (double& value : x) value = normal(generator);
      return root * x;
    };
    const Eigen::VectorXd of_law = noise.of_law * drawn();
    // Drawn only where it is asked for: the other numbers stay.
    const double zero = noise.of_zero > 0 ? noise.of_zero * noise.most_strain * normal(generator) : 0;
    data_.units = noise.units;
    for (int u = 0; u < noise.units; ++u) {
      const double of_unit = noise.of_units * normal(generator);
      const Eigen::VectorXd along = noise.along_curves * drawn();
      for (int i = 0; i < noise.depths; ++i) {
        const double error = of_unit + of_law[i] + along[i] + noise.of_rows * normal(generator);
        data_.force.push_back(shear * area * stress_of(shape_, law, std::max(strain[i] + zero, 1e-3)) *
                              std::exp(error));
        data_.strain.push_back(strain[i]), data_.curve.push_back(u), data_.unit.push_back(u);
      }
    }
  }

  const CurveData& data() const { return data_; }
  ForceModel model() const { return shape_model(data_, shape_, area); }

 private:
  static LawForm law_of(const LawFamily& family, std::vector<double> constants) {
    const auto& held = family.held();
    const auto value = [&](const char* name) {
      const auto found = held.find(name);
      if (found != held.end()) return found->second;
      const double first = constants.front();
      constants.erase(constants.begin());
      return first;
    };
    switch (family.law()) {
      case FittedLaw::neo_hookean:
        return {};
      case FittedLaw::stiffening:
        return {value("b")};
      case FittedLaw::yeoh: {
        const double c2 = value("c2");
        return LawForm::yeoh(c2, value("c3"));
      }
      case FittedLaw::ogden:
        break;
    }
    const double exponent = value("exponent"), share = value("share");
    return LawForm::ogden(exponent, share, value("second_exponent"));
  }

  CurveData data_;
  Shape shape_;
};

// The share of made-up measurements whose 95 % interval holds the truth.
struct Coverage {
  double shear = 0;
  std::vector<double> constants;
  double median_width = 0;  // of the modulus's interval, its ends' logarithms
};

// made: MadeCurves of a seed. Without constants the modulus alone is judged. either_sign: so are constants up to their sign.
template <class Made>
Coverage coverage_of(const LawFamily& family, const std::vector<double>& constants, int repetitions, const Made& made,
                     bool either_sign = false) {
  Coverage held;
  held.constants.resize(constants.size());
  CurveOptions options;
  options.repetitions = 300;
  std::vector<double> widths;
  for (int r = 0; r < repetitions; ++r) {
    const MadeCurves curves = made(1000 + static_cast<unsigned>(r));
    const CurveFit fit = fit_curves(curves.data(), family, curves.model(), options, "made.csv");
    const auto holds = [&](const std::optional<Interval>& interval, double truth) {
      return interval && interval->low <= truth && truth <= interval->high ? 1.0 / repetitions : 0;
    };
    held.shear += holds(fit.shear.interval, MadeCurves::shear);
    if (fit.shear.interval) widths.push_back(std::log(fit.shear.interval->high / fit.shear.interval->low));
    for (std::size_t k = 0; k < constants.size(); ++k)
      held.constants[k] += std::max(holds(fit.constants[k].estimate.interval, constants[k]),
                                    either_sign ? holds(fit.constants[k].estimate.interval, -constants[k]) : 0);
  }
  std::sort(widths.begin(), widths.end());
  if (!widths.empty()) held.median_width = widths[widths.size() / 2];
  return held;
}

inline Coverage coverage(const LawFamily& family, const std::vector<double>& constants, const Noise& noise,
                         int repetitions) {
  // Sheared, a body of Ogden's law has the same force with the exponent of the other sign.
  const bool either_sign = family.law() == FittedLaw::ogden && noise.shape != Shape::compressed;
  return coverage_of(
      family, constants, repetitions, [&](unsigned seed) { return MadeCurves(family, constants, noise, seed); },
      either_sign);
}

}  // namespace palpate::fit
