// A state of a played scene under large deformation against the converged solution of the same targets.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "programs/player/player.h"
#include "studies/hyperelastic/large_reference.h"

namespace palpate::played {

// Of one tool: N, its length by the runtime and the length of the difference.
struct ToolForce {
  double force = 0, missed = 0;
};

struct Compared {
  double time = 0;  // s
  palpate_step_flags flags = 0;
  std::string unsolved;         // why there is no converged solution; then the numbers below are zero
  double field = 0;             // relative, over the nodes of the surface, of what the supports do not carry along
  double moved = 0, worst = 0;  // m: the largest such displacement; the largest error of a node
  double residual = 0, least_volume = 1;
  std::vector<ToolForce> forces;  // [tool]
};

class Comparison {
 public:
  // player: of a scene with a hyperelastic body and a shape of all nodes; bundle: its file. Both must outlive this.
  // Errors: InputError for another scene, OperationError.
  Comparison(const Player& player, const std::filesystem::path& bundle);
  ~Comparison();

  // In the step of the shape: Newton's method at the places of the rows that hold, from the runtime's own state.
  Compared compare(const ShapeRecord& shape) const;

 private:
  struct Body;
  const Player& player_;
  std::unique_ptr<Body> body_;
  std::unique_ptr<LargeReference> reference_;
};

}  // namespace palpate::played
