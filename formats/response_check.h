// Whether a stored response curve y(x) = sum c_k T_k(2 x / range - 1), P or Q, can correct a displacement or a force.
//
// A curve that falls would pull a tool in where it ought to resist, one that does not begin at zero would send a force without
// a contact, and one a thousand times too large or too small is in another unit. The runtime refuses to open such a
// bundle, and palpate-bundle verify tells why.
#pragma once

#include <cstddef>

namespace palpate::formats {

inline constexpr int kMostResponseCoefficients = 33;

enum class ResponseFault {
  none,
  count,       // fewer than 2 coefficients, or more than kMostResponseCoefficients
  not_finite,  // a coefficient, or a range that is not above zero
  origin,      // y(0) is not zero
  falls,       // y falls somewhere in 0 .. range, or is nowhere above zero
  scale        // y(x) / x is not within kLeastRatio .. kMostRatio
};

// Of y(x) / x: the measured answer over the linear one.
inline constexpr double kLeastRatio = 1e-3, kMostRatio = 1e3;

struct ResponseVerdict {
  ResponseFault fault = ResponseFault::none;
  double at = 0, value = 0;  // the argument x at which the fault was found, and y(x); by the fault y(x) / x
};

// coefficients: [count]. What rounding may do to the largest coefficient, 1e-9 of y(range), is no fault.
// Cost: a few milliseconds at most.
ResponseVerdict check_response(const double* coefficients, std::size_t count, double range);

// Writes what was found, what was expected and what to do, as one sentence without its subject. unit: of x and y.
void describe_response_fault(const ResponseVerdict& verdict, const char* unit, char* text, std::size_t bytes);

}  // namespace palpate::formats
