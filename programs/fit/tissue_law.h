// The laws that can be fitted, each with the constants that it has beside the shear modulus.
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "runtime/large/hyperelastic_body.h"

namespace palpate::fit {

enum class FittedLaw { neo_hookean, stiffening, yeoh, ogden };

// Constants are counted without a unit: c2 and c3 of Yeoh's law as shares of the shear modulus.
struct LawConstant {
  struct Range {
    double low, high, start;
  };
  std::string name;
  std::vector<Range> ranges;  // what the law takes; a fit stays in the range where it begins
};

// A law with those of its constants that are fitted. The fit's coordinates are the constants themselves, but for c3 of Yeoh's law, which
// counts from the least c3 that c2 allows: so the range of each is an interval.
class LawFamily {
 public:
  // held: constants that keep a value, by name. Ogden's second term is fitted (share) where held has second_exponent.
  // Errors: InputError for names and values that the law does not take, and where more than two constants are left.
  LawFamily(FittedLaw law, const std::map<std::string, double>& held);

  FittedLaw law() const { return law_; }
  const char* name() const;  // as in organ.toml
  const std::vector<LawConstant>& fitted() const { return fitted_; }
  const std::map<std::string, double>& held() const { return held_; }  // with the defaults

  // The law over a shear modulus of 1 Pa.
  LawForm form(const Eigen::VectorXd& at) const;
  // [fitted] the constants themselves, and their derivatives by the coordinates.
  Eigen::VectorXd constants(const Eigen::VectorXd& at) const;
  Eigen::MatrixXd slopes(const Eigen::VectorXd& at) const;

 private:
  double value(const std::string& name, const Eigen::VectorXd& at) const;
  bool is_fitted(const std::string& name) const;

  FittedLaw law_;
  std::vector<LawConstant> fitted_;
  std::map<std::string, double> held_;
};

}  // namespace palpate::fit
