#include "formats/response_check.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace palpate::formats {
namespace {

constexpr int kMost = kMostResponseCoefficients;
constexpr double kRounding = 1e-9;  // of the value at the end of the range

// sum c_k T_k(t), by Clenshaw's recurrence.
double value_of(const double* c, int count, double t) {
  double b1 = 0, b2 = 0;
  for (int k = count - 1; k >= 1; --k) {
    const double b0 = c[k] + 2 * t * b1 - b2;
    b2 = b1, b1 = b0;
  }
  return count > 0 ? c[0] + t * b1 - b2 : 0;
}

// The coefficients of the derivative by t: [count - 1].
void differentiate(const double* c, int count, double* out) {
  for (int k = count - 1; k >= 1; --k) out[k - 1] = (k + 1 < count - 1 ? out[k + 1] : 0) + 2.0 * k * c[k];
  if (count > 1) out[0] /= 2;
}

// Where sum c_k T_k changes its sign in (-1, 1), ascending; turns: [turn_count] where it turns, ascending, so that it changes its
// sign at most once between two of them. found: [turn_count + 1]. Returns their number.
int sign_changes(const double* c, int count, const double* turns, int turn_count, double* found) {
  int changes = 0;
  double from = -1;
  for (int i = 0; i <= turn_count; ++i) {
    const double to = i < turn_count ? turns[i] : 1;
    const bool rises = value_of(c, count, from) < 0;
    if (rises != (value_of(c, count, to) < 0)) {
      double low = from, high = to;
      for (double middle = (low + high) / 2; low < middle && middle < high; middle = (low + high) / 2)
        (rises == (value_of(c, count, middle) < 0) ? low : high) = middle;
      found[changes++] = high;
    }
    from = to;
  }
  return changes;
}

// Where the polynomial turns, ascending: the sign changes of its derivative, found from those of the derivative's derivative, and
// so on down from a constant. turns: [count]. Returns their number.
int turning_points(const double* c, int count, double* turns) {
  double derivative[kMost][kMost] = {};  // [d]: of order d + 1
  for (int d = 0; d + 1 < count; ++d) differentiate(d == 0 ? c : derivative[d - 1], count - d, derivative[d]);
  double found[kMost] = {};
  int turn_count = 0;
  for (int d = count - 2; d >= 0; --d) {
    turn_count = sign_changes(derivative[d], count - 1 - d, turns, turn_count, found);
    std::copy(found, found + turn_count, turns);
  }
  return turn_count;
}

}  // namespace

ResponseVerdict check_response(const double* c, std::size_t coefficient_count, double range) {
  if (coefficient_count < 2 || coefficient_count > kMost)
    return {ResponseFault::count, static_cast<double>(coefficient_count), 0};
  const int count = static_cast<int>(coefficient_count);
  if (!(range > 0) || !std::isfinite(range)) return {ResponseFault::not_finite, range, 0};
  for (int k = 0; k < count; ++k)
    if (!std::isfinite(c[k])) return {ResponseFault::not_finite, static_cast<double>(k), c[k]};

  const auto argument = [&](double t) { return range * (t + 1) / 2; };
  const double end = value_of(c, count, 1), rounding = kRounding * std::fabs(end);
  if (const double origin = value_of(c, count, -1); std::fabs(origin) > rounding)
    return {ResponseFault::origin, 0, origin};
  if (!(end > 0)) return {ResponseFault::falls, range, end};

  double turns[kMost] = {};
  int turn_count = turning_points(c, count, turns);
  turns[turn_count++] = 1;
  double before = 0;
  for (int i = 0; i < turn_count; ++i) {
    const double now = value_of(c, count, turns[i]);
    if (now < before - rounding) return {ResponseFault::falls, argument(turns[i]), now};
    before = std::max(before, now);
  }

  // A rising polynomial of degree 32 has no peak of y / x that is narrower than the spacing of these places.
  constexpr int kPlaces = 256;
  for (int i = 1; i <= kPlaces; ++i) {
    const double t = 2.0 * i / kPlaces - 1, ratio = value_of(c, count, t) / argument(t);
    if (ratio > kMostRatio || (i == kPlaces && ratio < kLeastRatio)) return {ResponseFault::scale, argument(t), ratio};
  }
  return {};
}

void describe_response_fault(const ResponseVerdict& verdict, const char* unit, char* text, std::size_t bytes) {
  switch (verdict.fault) {
    case ResponseFault::none:
      std::snprintf(text, bytes, "rises from 0");
      break;
    case ResponseFault::count:
      std::snprintf(text, bytes, "has %g coefficients; expected 2 to %d; rebuild the bundle", verdict.at, kMost);
      break;
    case ResponseFault::not_finite:
      std::snprintf(text, bytes, "has a coefficient or range that is not finite, or a range of 0; rebuild the bundle");
      break;
    case ResponseFault::origin:
      std::snprintf(text, bytes, "is %g %s at 0; expected 0, no answer without a load; rebuild the bundle",
                    verdict.value, unit);
      break;
    case ResponseFault::falls:
      std::snprintf(
          text, bytes,
          "falls to %g %s at %g %s; expected one that rises over its whole range; measure the curve again and "
          "rebuild the bundle",
          verdict.value, unit, verdict.at, unit);
      break;
    case ResponseFault::scale:
      std::snprintf(text, bytes,
                    "answers %g times the linear answer at %g %s; expected %g to %g times; check the units of the "
                    "measured curve and rebuild the bundle",
                    verdict.value, verdict.at, unit, kLeastRatio, kMostRatio);
      break;
  }
}

}  // namespace palpate::formats
