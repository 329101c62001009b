// Terms of a relaxation in one expression.
#pragma once

#include <initializer_list>

#include "runtime/include/palpate/palpate_relaxation.h"

namespace palpate {

struct RelaxationTerm {
  double share, time;  // of the force, s
};

inline palpate_relaxation_def relaxation_of(std::initializer_list<RelaxationTerm> terms) {
  palpate_relaxation_def relaxation = palpate_default_relaxation_def();
  for (const RelaxationTerm& term : terms) {
    relaxation.share[relaxation.terms] = term.share;
    relaxation.time[relaxation.terms++] = term.time;
  }
  return relaxation;
}

// Swine brain: Miller and Chinzei 1997.
inline palpate_relaxation_def brain() {
  return relaxation_of({{0.45, 0.5}, {0.365, 50}});
}

}  // namespace palpate
