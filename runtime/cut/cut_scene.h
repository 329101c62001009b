// The organ of a scene that is cut: in each step blades cut the mesh, the surface follows, and the body's compliance follows within the work of the step.
#pragma once

#include <cstdint>

#include "runtime/contact/row_source.h"
#include "runtime/contact/touch_step.h"
#include "runtime/cut/blades.h"
#include "runtime/cut/cut_log.h"
#include "runtime/cut/cut_mesh.h"
#include "runtime/cut/cut_target.h"
#include "runtime/cut/divided_surface.h"
#include "runtime/cut/lips.h"
#include "runtime/cut/loose_pieces.h"
#include "runtime/cut/scene_surface.h"

namespace palpate {

class CutScene final : public RowSource {
 public:
  // All borrowed.
  struct Source {
    SceneSurface::Touched touched;
    CutTarget* target = nullptr;
    CutBody body;
    const HyperelasticBody* tissue = nullptr;       // the same
    const std::uint8_t* can_hold = nullptr;         // [body's nodes] 1: the compliance knows the node
    double* rest = nullptr;                         // [Ns][3] m: TouchedSurface::rest, in which new nodes get places
    std::int32_t surface_nodes = 0;                 // Ns
    std::int32_t first_reserve = 0, new_nodes = 0;  // the scene's node of the first new one; new ones at most
    std::int32_t blade_points = 0;                  // of an edge that tissue holds
    std::int32_t rank = 0;                          // at most
    Operations operations = 0;                      // of a step, at most, for the compliance
  };
  // The sentence of what is wrong with the body; nullptr: nothing, unless the memory has failed.
  const char* create(SceneMemory& memory, const Source& source);
  SceneSurface& surface() { return surface_; }
  const DividedSurface& divided() const { return divided_; }
  // What its lips are made of, with rows for so many pairs.
  Lips::Source lips(std::int32_t most) const;
  // palpate_scene_cut_nodes().
  std::int32_t write_nodes(std::int32_t* nodes, std::int32_t most) const;
  const CutMesh& mesh() const { return mesh_; }

  // Of palpate_cut.h, checked.
  void set_blade(std::int32_t blade, const palpate_blade& now) { blades_.set(blade, now); }
  const palpate_blade_state& blade_state(std::int32_t blade) const { return blades_.state(blade); }
  void remove_tissue(const double* centre, double radius, double held, double needed);
  const palpate_cut_state& state() const { return told_; }

  void begin_step(TouchStep& step) override;
  std::int32_t begin(TouchStep&) override { return blades_.constraints(); }
  void request(TouchStep& step) override { blades_.request(step, placed()); }
  void take_reactions(TouchStep& step, bool solved) override { blades_.take_reactions(step, solved); }
  void forget_rest() override;
  void restored() override;

  // That a step may count on top of all else.
  double most_operations() const;

 private:
  struct Removal {
    double centre[3], radius;  // m, in the world; radius 0: none is asked for
    double held, needed;       // s
  };
  PlacedMesh placed() const { return {&mesh_.state().rest(), mesh_.nodes_of(0), position_, node_}; }
  TouchState& touch() const { return *source_.touched.touch; }
  static double cost_of(CutLog::Unit::Kind kind, std::int32_t rank, int foundations);
  double cost_of(const CutLog::Unit& unit, std::int32_t rank) const;
  void follow(double* left);
  void go_on(CutRebase& rebase, double left);
  static CutChange change_of(const CutLog::Unit& unit);
  static bool give(const CutLog::Unit& unit, CutCompliance& to);
  CutOutcome take(const CutLog::Unit& unit, bool replayed);
  bool change_mesh();
  void place_nodes();
  void take_change();
  double area_of_cut(std::int32_t triangle) const;
  void log_change();
  std::int32_t made_nodes() const { return source_.body.node_count + source_.target->new_nodes(); }
  void add_node(std::int32_t n);
  void tell_state();

  Source source_ = {};
  CutMesh mesh_;
  CutLog log_;
  Blades blades_;
  LoosePieces loose_;
  SceneSurface surface_;
  DividedSurface divided_;
  std::int32_t* number_ = nullptr;  // [body's nodes and new ones] the scene's node
  // The same, where nodes that the compliance does not have yet are those from which they come; and m, [][3], where they are.
  std::int32_t* node_ = nullptr;
  double* position_ = nullptr;
  double* reserve_ = nullptr;  // [new nodes][3] m: places at rest of the nodes in reserve
  Removal removal_ = {};
  double* held_ = nullptr;  // [tetrahedra] s, in balls of removals that take time
  palpate_cut_state told_ = {};
};

}  // namespace palpate
