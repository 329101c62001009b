// Every pair of effects, played; and the page that says what was found.
#pragma once

#include <string>
#include <vector>

namespace palpate::tests {

// Bounds of the classes that the page tells (pairs.cpp says where they come from); beyond the last one the pair is wrong.
inline constexpr double kClasses[] = {1e-5, 1e-3, 3e-2}, kWorst = kClasses[2];

struct PairFound {
  const char* effects[2];
  bool alternatives = false;  // two values of one effect
  std::string refusal;        // why there is no such scene: the key of a reason; empty: there is
  double error = 0;           // the referee's largest
  std::string faults;         // what is wrong, sentence by sentence; empty: nothing
};

// first: the number of one effect; the pairs of it with itself and with all effects before it.
std::vector<PairFound> play_pairs_of(std::size_t first);

// A scene of many: what is wrong in it. names: as in the list of effects().
std::string faults_of_crowd(const std::vector<const char*>& names);

// docs/effects.md.
std::string page_of(const std::vector<std::vector<PairFound>>& found);

}  // namespace palpate::tests
