#include <array>
#include <memory>

#include "studies/paper/constrained_solve.h"
#include "studies/paper/paper_measurements.h"
#include "studies/peers/palpate_peer.h"
#include "studies/peers/peers.h"

namespace palpate::studies {
namespace {

// The exact answers, with or without the correction.
struct Truth {
  const Exact& linear;
  const Correction* correction;
  Answer at(const Eigen::Vector3d& displacement) const {
    Answer answer = linear.at(displacement);
    if (correction) correction->apply(displacement, answer);
    return answer;
  }
};

Json row(const char* name, const Measured& measured) {
  return {{"name", name},
          {"ms", 1e3 * measured.median()},
          {"ms_99", 1e3 * percentile(measured.seconds, .99)},
          {"error", percentile(measured.error, .5)},
          {"force_error", percentile(measured.force_error, .5)},
          {"moves", measured.seconds.size()}};
}

class Moves {
 public:
  Moves(const Push& push, const Correction& correction, const std::string& bundle, double seconds)
      : push_(push),
        bundle_(bundle),
        seconds_(seconds),
        exact_(push),
        system_(push),
        kept_(push, system_),
        correction_(correction) {}

  // One node is held move after move, with linear elasticity and with the correction. The two are measured one after the other
  // for each system, so that a change of the machine's load affects both.
  std::array<Json, 2> held() {
    std::array<Json, 2> rows = {Json::array(), Json::array()};
    const auto followed = [&](const char* name, const auto& tick) {
      for (const bool corrected : {false, true})
        rows[corrected].push_back(
            row(name, follow(push_, truth(corrected), seconds_, [&](const Eigen::Vector3d& d, Answer& answer) {
                  tick(d, answer);
                  if (corrected) correction_.apply(d, answer);
                })));
    };
    const auto solved = [&](const char* name, const char* preconditioner, bool from_last) {
      ConstrainedSolve solve(push_, push_.node, preconditioner, kTolerance);
      followed(name, [&](const auto& d, Answer& answer) { solve.move(d, from_last, answer); });
    };
    solved("cg jacobi, from zero", "jacobi", false);
    solved("cg jacobi, from the last move", "jacobi", true);
    solved("cg multigrid, from the last move", "gamg", true);
    kept_.hold(push_.node);
    followed("factor kept", [&](const auto& d, Answer& answer) { kept_.tick(d, answer); });
    for (const bool corrected : {false, true}) {
      SceneDef def = node_contact_scene();
      if (corrected) def.force = PALPATE_FORCE_RESPONSE, def.radial = PALPATE_RADIAL_RESPONSE;
      const auto [touch, frame] = played(def, truth(corrected));
      rows[corrected].push_back(row("touch and shape", frame));
      rows[corrected].push_back(row("touch", touch));
    }
    return rows;
  }

  // Another node in every move, so that no system can reuse the last move.
  Json changing() {
    PalpatePeer peer(bundle_, push_, node_contact_scene());
    Measured gradients, factor, frame;
    Answer answer, reference;
    reference.surface.resize(3 * push_.body.surface_count);
    const auto start = Clock::now();
    for (std::size_t turn = 0; turn < push_.displacements.size() && seconds_since(start) < 2 * seconds_; ++turn) {
      const std::int32_t node = push_.body.touchable[turn * 7919 % push_.body.touchable.size()];
      const auto& fixed = push_.body.fixed[static_cast<std::size_t>(node)];
      if (fixed[0] || fixed[1] || fixed[2]) continue;
      const Eigen::Vector3d d = push_.displacements[turn];
      auto begin = Clock::now();
      kept_.tick_at_new_node(node, d, reference);
      factor.add(seconds_since(begin), reference, reference);
      begin = Clock::now();
      ConstrainedSolve(push_, node, "jacobi", kTolerance).move(d, false, answer);
      gradients.add(seconds_since(begin), answer, reference);
      const double spent = peer.grip(node, d, answer);
      frame.add(spent, answer, reference);
    }
    Json rows = Json::array();
    rows.push_back(row("cg jacobi, from zero", gradients));
    rows.push_back(row("factor kept", factor));
    rows.push_back(row("touch and shape", frame));
    return rows;
  }

  // Whole touches: collision, contact and force. Their time limits the rate of a haptic loop.
  Json collision() {
    Json rows = Json::array();
    for (const auto& [name, model] :
         {std::pair("rest", PALPATE_COLLISION_REST), std::pair("deformed", PALPATE_COLLISION_DEFORMED)}) {
      SceneDef def = node_contact_scene();
      def.collision = model;
      rows.push_back(row(name, played(def, truth(false)).first));
    }
    return rows;
  }

 private:
  Truth truth(bool corrected) const { return {exact_, corrected ? &correction_ : nullptr}; }

  // Plays twice; the first play warms the caches and is not counted.
  std::pair<Measured, Measured> played(const SceneDef& def, const Truth& truth) const {
    PalpatePeer peer(bundle_, push_, def);
    std::pair<Measured, Measured> measured;
    for (int round = 0; round < 2; ++round) {
      measured = {};
      peer.play(measured.first, measured.second, truth);
    }
    return measured;
  }

  const Push& push_;
  std::string bundle_;
  double seconds_;
  Exact exact_;
  FreeSystem system_;
  KeptFactor kept_;
  const Correction& correction_;
};

}  // namespace

Json measure_moves(const Push& push, const Correction& correction, const std::string& bundle, double seconds) {
  Moves moves(push, correction, bundle, seconds);
  const auto [linear, corrected] = moves.held();
  return {{"tolerance", kTolerance},
          {"vertices", push.body.nodes.size()},
          {"tetrahedra", push.body.tetrahedra.size()},
          {"surface", push.body.surface_count},
          {"linear", linear},
          {"quasi_non_linear", corrected},
          {"changing", moves.changing()},
          {"collision", moves.collision()}};
}

}  // namespace palpate::studies
