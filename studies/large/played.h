// Plays a move through the runtime: the touches of one scene, linear or large, with their times and what they reach.
#pragma once

#include <Eigen/Dense>
#include <palpate/palpate.hpp>
#include <vector>

#include "studies/large/moves.h"

namespace palpate::large {

struct Pace {
  double speed = 0.1;          // m/s; a touch each millisecond
  std::vector<double> depths;  // m, ascending: where the state is looked at
};

// The state at one depth.
struct Reached {
  Eigen::VectorXd force;                  // [3 discs] N, on the organ
  Eigen::VectorXd u;                      // [3 nodes] m; under linear deformation the nodes of the surface alone
  unsigned flags = 0;                     // of the touch and the shape that show it
  double residual = 0, least_volume = 1;  // of palpate_contacts
};

// Of touches and of shapes, us. thread: processor time of the thread alone, which other programs do not lengthen.
struct StepTimes {
  std::vector<double> touch, touch_thread, shape;
};

// The rows that hold the discs of a move: for each the mean displacement of nodes with these weights, which sum to 1; and the compliance
// between means and tools, m/N, [3 discs][3 discs]: what the mesh does not resolve, of each disc and between two.
struct HeldDiscs {
  struct Disc {
    std::vector<std::int32_t> nodes;
    std::vector<double> weights;
  };
  std::vector<Disc> discs;
  Eigen::MatrixXd compliance;
};

class Player {
 public:
  // bundle must outlive the player. deformation LARGE: shapes of all nodes.
  Player(const Bundle& bundle, palpate_deformation_model deformation, double radius);

  // Times are added to *times; the first touch, which finds the contact's rows, is left out.
  std::vector<Reached> play(const Move& move, const Pace& pace, StepTimes* times);

  // By three small displacements of each disc. For linear deformation.
  HeldDiscs hold(const std::vector<DiscMove>& discs);

  double create_ms() const { return create_ms_; }

 private:
  void look(Reached* reached, StepTimes* times);

  const Bundle& bundle_;
  double radius_, create_ms_ = 0;
  Scene scene_;
  Contacts contacts_;
  std::vector<float> u_;
};

}  // namespace palpate::large
