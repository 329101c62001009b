// A state of a played scene under large deformation against the converged solution of the same targets.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "programs/player/player.h"
#include "studies/hyperelastic/large_reference.h"
#include "studies/played/left_body.h"

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
  std::int32_t split_nodes = 0, removed = 0;  // of the mesh, by cuts
  std::vector<ToolForce> forces;              // [tool]
};

class Comparison {
 public:
  // player: of a scene with a hyperelastic body and a shape of all nodes; bundle: its file. Both must outlive this. Where the organ is cut, its supports
  // are rigid.
  // Errors: InputError for another scene, OperationError.
  Comparison(const Player& player, const std::filesystem::path& bundle);
  ~Comparison();

  // In the step of the shape: Newton's method at the places of the rows that hold and the forces of those that slide or cut, from the runtime's own
  // state, on the mesh that is left.
  Compared compare(const ShapeRecord& shape);

 private:
  struct Body;
  const char* follow_cut(Compared* compared);
  const Player& player_;
  std::unique_ptr<Body> body_;
  std::unique_ptr<LeftBody> left_;  // nullptr: nothing is cut
  std::uint64_t surface_ = 0;       // palpate_cut_state.surface of left_
  std::unique_ptr<LargeReference> reference_;
};

}  // namespace palpate::played
