#include "programs/fit/tissue_law.h"

#include <fmt/format.h>

#include <algorithm>

#include "formats/errors.h"
#include "formats/tissue_laws.h"

namespace palpate::fit {
namespace {

constexpr double kMostStiffening = 300;  // b: with it a strain of 10 % multiplies the stress by 20
constexpr double kMostShare = 100;       // c2 and c3 over the shear modulus
constexpr double kAboveLeast = 1e-6;     // of c3 above the least one, as the law asks for more than that
constexpr std::size_t kMostFitted = 2;

// The least c3 / mu with which Yeoh's law resists every shear: 3 c2^2 = 5 (mu / 2) c3, where c2 is below 0.
double least_c3(double c2) {
  return c2 < 0 ? 1.2 * c2 * c2 * (1 + kAboveLeast) + kAboveLeast : 0;
}

struct KnownConstant {
  LawConstant constant;
  double by_default = NAN;  // held at it where it is not asked for
};

std::vector<KnownConstant> constants_of(FittedLaw law) {
  switch (law) {
    case FittedLaw::neo_hookean:
      return {};
    case FittedLaw::stiffening:
      return {{{"b", {{0, kMostStiffening, 1}}}}};
    case FittedLaw::yeoh:
      return {{{"c2", {{-kMostShare, kMostShare, 0}}}}, {{"c3", {{0, kMostShare, 0.01}}}}};
    case FittedLaw::ogden:
      break;
  }
  // As formats::ogden_law_takes has them.
  const std::vector<LawConstant::Range> exponents = {{1.5, formats::kMostExponent, 3},
                                                     {-formats::kMostExponent, -3, -4}};
  return {{{"exponent", exponents}}, {{"share", {{0, 0.999, 0.2}}}, 0}, {{"second_exponent", exponents}, -3}};
}

}  // namespace

LawFamily::LawFamily(FittedLaw law, const std::map<std::string, double>& held) : law_(law), held_(held) {
  const std::vector<KnownConstant> known = constants_of(law);
  std::string names;
  for (const KnownConstant& one : known) names += (names.empty() ? "" : ", ") + one.constant.name;
  for (const auto& [key, value] : held) {
    const auto found = std::find_if(known.begin(), known.end(), [&](const auto& k) { return k.constant.name == key; });
    if (found == known.end())
      throw InputError(fmt::format("--hold: expected a constant of the law {} ({}), found {}", name(),
                                   names.empty() ? "it has none beside its modulus" : names, key));
    const auto& ranges = found->constant.ranges;
    if (std::none_of(ranges.begin(), ranges.end(), [&](const auto& r) { return value >= r.low && value <= r.high; })) {
      std::string limits;
      for (const auto& r : ranges) limits += fmt::format("{}{:g} to {:g}", limits.empty() ? "" : " or ", r.low, r.high);
      throw InputError(fmt::format("--hold: expected {} from {}, found {:g}", key, limits, value));
    }
  }
  const bool two_terms = held.count("second_exponent") > 0;
  for (const KnownConstant& one : known) {
    const std::string& key = one.constant.name;
    if (held_.count(key)) continue;
    if (std::isnan(one.by_default) || (key == "share" && two_terms))
      fitted_.push_back(one.constant);
    else
      held_[key] = one.by_default;
  }
  if (fitted_.size() > kMostFitted)
    throw InputError(fmt::format("--large {}: expected at most {} constants to fit beside the modulus, found {}",
                                 name(), kMostFitted, fitted_.size()));
  if (law == FittedLaw::yeoh && held_.count("c3") && !held_.count("c2")) {
    const double most = std::sqrt(held_["c3"] / 1.2);
    fitted_[0].ranges[0].low = -most * (1 - kAboveLeast);
  }
  if (law == FittedLaw::yeoh && held_.size() == 2 && !formats::yeoh_law_takes(1, held_["c2"], held_["c3"]))
    throw InputError(
        fmt::format("--hold: the law yeoh takes c2 below 0 together with c3 above 1.2 c2^2 alone, both over the "
                    "shear modulus; found c2 {:g} and c3 {:g}",
                    held_["c2"], held_["c3"]));
}

const char* LawFamily::name() const {
  switch (law_) {
    case FittedLaw::neo_hookean:
      return "neo-hookean";
    case FittedLaw::stiffening:
      return "stiffening";
    case FittedLaw::yeoh:
      return "yeoh";
    case FittedLaw::ogden:
      break;
  }
  return "ogden";
}

bool LawFamily::is_fitted(const std::string& key) const {
  return std::any_of(fitted_.begin(), fitted_.end(), [&](const LawConstant& c) { return c.name == key; });
}

double LawFamily::value(const std::string& key, const Eigen::VectorXd& at) const {
  for (std::size_t k = 0; k < fitted_.size(); ++k)
    if (fitted_[k].name == key) {
      const double own = at[static_cast<Eigen::Index>(k)];
      if (key == "c3") return own + least_c3(value("c2", at));
      return own;
    }
  return held_.at(key);
}

LawForm LawFamily::form(const Eigen::VectorXd& at) const {
  switch (law_) {
    case FittedLaw::neo_hookean:
      return {};
    case FittedLaw::stiffening:
      return {value("b", at)};
    case FittedLaw::yeoh:
      return LawForm::yeoh(value("c2", at), value("c3", at));
    case FittedLaw::ogden:
      break;
  }
  return LawForm::ogden(value("exponent", at), value("share", at), value("second_exponent", at));
}

Eigen::VectorXd LawFamily::constants(const Eigen::VectorXd& at) const {
  Eigen::VectorXd result(at.size());
  for (Eigen::Index k = 0; k < at.size(); ++k) result[k] = value(fitted_[static_cast<std::size_t>(k)].name, at);
  return result;
}

Eigen::MatrixXd LawFamily::slopes(const Eigen::VectorXd& at) const {
  Eigen::MatrixXd result = Eigen::MatrixXd::Identity(at.size(), at.size());
  if (law_ == FittedLaw::yeoh && is_fitted("c2") && is_fitted("c3") && at[0] < 0) result(1, 0) = 2.4 * at[0];
  return result;
}

}  // namespace palpate::fit
