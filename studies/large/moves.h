// What the discs of the study do: at each place they push, pull, drag, push at an angle, push in pairs and pinch.
#pragma once

#include <string>
#include <vector>

#include "studies/accuracy/sites.h"

namespace palpate::large {

struct DiscMove {
  Vec3 at;   // m, a point of space; on each mesh the closest point of its surface
  Vec3 way;  // displacement for a unit of depth
};
struct Move {
  std::string name;  // "push", "pull", "drag", "oblique", "pair", "pinch"
  std::size_t place;
  std::vector<DiscMove> discs;
};

// A pair is two discs kPairDistance radii apart. A pinch is two discs on opposite sides of the body, which come towards one another:
// at kPinchDepth they have closed three fifths of the distance where that is short. Where the body is thicker than kThickest,
// there is no pinch, and where a second disc would come near held nodes, neither a pair nor a pinch.
inline constexpr double kPairDistance = 3.5, kPinchDepth = 0.030, kThickest = 0.070;
std::vector<Move> plan_moves(const ElasticBody& finest, const accuracy::StudySites& sites);

}  // namespace palpate::large
