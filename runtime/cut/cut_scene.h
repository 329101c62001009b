// The organ of a scene that is cut: in each step blades cut the mesh, the surface follows, and the body's compliance follows within the work of the step.
#pragma once

#include <cstdint>

#include "runtime/contact/row_source.h"
#include "runtime/contact/touch_step.h"
#include "runtime/cut/blades.h"
#include "runtime/cut/cut_log.h"
#include "runtime/cut/cut_mesh.h"
#include "runtime/cut/cut_organ.h"
#include "runtime/cut/loose_pieces.h"
#include "runtime/cut/scene_surface.h"

namespace palpate {

class CutScene final : public RowSource {
 public:
  // All borrowed.
  struct Source {
    TouchState* touch;
    CutOrgan* organ;
    CutBody body;
    const std::uint8_t* can_hold;  // [body's nodes] 1: the compliance knows the node
    const std::int32_t* node;      // [body's nodes and new ones] the scene's node
    double* rest;                  // [Ns][3] m: TouchedSurface::rest
    std::int32_t surface_nodes;    // Ns
    std::int32_t new_nodes, rank;  // at most
    Operations operations;         // of a step, at most, for the compliance
  };
  // The sentence of what is wrong with the body; nullptr: nothing, unless the memory has failed.
  const char* create(SceneMemory& memory, const Source& source);
  SceneSurface& surface() { return surface_; }
  // [Ns][3] m: TouchedSurface::rest, in which new nodes get places.
  void place_at_rest(double* rest) { source_.rest = rest; }

  // Of palpate_cut.h, checked.
  void set_blade(std::int32_t blade, const palpate_blade& now) { blades_.set(blade, now); }
  const palpate_blade_state& blade_state(std::int32_t blade) const { return blades_.state(blade); }
  void remove_tissue(const double* centre, double radius);
  const palpate_cut_state& state() const { return told_; }

  void begin_step(TouchStep& step) override;
  std::int32_t begin(TouchStep&) override { return blades_.constraints(); }
  void request(TouchStep& step) override { blades_.request(step, placed()); }
  void take_reactions(TouchStep& step, bool solved) override { blades_.take_reactions(step, solved); }
  void forget_rest() override;
  // After a state has been restored.
  void restored();

  // That a step may count on top of all else.
  double most_operations() const;

 private:
  struct Removal {
    double centre[3], radius;  // m, in the world; radius 0: none is asked for
  };
  PlacedMesh placed() const { return {&mesh_.state().rest(), mesh_.nodes_of(0), position_, source_.node}; }
  static double cost_of(CutLog::Unit::Kind kind, std::int32_t rank);
  void follow(double* left);
  bool take(const CutLog::Unit& unit);
  bool change_mesh(const TouchState& touch);
  void place_nodes(const TouchState& touch);
  void take_change(TouchState& touch);
  double area_of_cut(std::int32_t triangle) const;
  void log_change();
  void add_node(TouchState& touch, std::int32_t n);
  void tell();

  Source source_ = {};
  CutMesh mesh_;
  CutLog log_;
  Blades blades_;
  LoosePieces loose_;
  SceneSurface surface_;
  double* position_ = nullptr;  // [body's nodes and new ones][3] m, of the mesh's nodes as they are
  Removal removal_ = {};
  palpate_cut_state told_ = {};
};

}  // namespace palpate
