#include "studies/validation/judge.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace palpate::validation {
namespace {

constexpr double kExact =
    1e-5;  // a smaller bound stands for rounding, printed digits or f32, and is checked on every mesh
constexpr double kRounding = 1e-9;  // rounding dominates smaller errors, so that they show no order

std::optional<double> order_of(const std::vector<int>& levels, const std::vector<double>& errors, double logarithms) {
  const std::size_t n = errors.size();
  if (n < 2 || !(errors[n - 1] > kRounding)) return {};
  double ratio = errors[n - 2] / errors[n - 1];
  ratio *= std::pow(std::log(levels[n - 1]) / std::log(levels[n - 2]), logarithms);
  return std::log(ratio) / std::log(static_cast<double>(levels[n - 1]) / levels[n - 2]);
}

std::string why_not(const Expectation& expectation, const Verdict& verdict, bool finest_planned) {
  if (!std::isfinite(verdict.error)) return "the error is not a number";
  const bool exact = expectation.bound <= kExact;
  if ((finest_planned || exact) && verdict.error > expectation.bound)
    return fmt::format("error {:.3g}, above {:.3g}", verdict.error, expectation.bound);
  if (!expectation.order) return "";
  if (!verdict.order) return "no order: one mesh";
  if (!finest_planned) return *verdict.order > 0 ? "" : "the error does not fall";
  const auto [least, most] = *expectation.order;
  if (*verdict.order < least - kOrderTolerance || *verdict.order > most + kOrderTolerance)
    return fmt::format("order {:.2f}, theory {:.3g}{}", *verdict.order, least,
                       most > least ? fmt::format(" to {:.3g}", most) : "");
  return "";
}

}  // namespace

Verdict judge(const Expectation& expectation, const std::vector<int>& levels, const std::vector<double>& errors,
              bool finest_planned) {
  Verdict verdict;
  verdict.error = errors.back();
  if (expectation.bound <= kExact)  // on every mesh
    for (const double error : errors) verdict.error = std::isnan(error) ? error : std::max(verdict.error, error);
  else
    verdict.order = order_of(levels, errors, expectation.logarithms);
  verdict.judged = !expectation.locks && (!std::isnan(expectation.bound) || expectation.order);
  verdict.sentence = expectation.locks ? "locks: shown, not judged" : why_not(expectation, verdict, finest_planned);
  verdict.holds = expectation.locks || verdict.sentence.empty();
  return verdict;
}

}  // namespace palpate::validation
