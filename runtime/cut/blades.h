// The blades of a scene: lines of points that the host moves.
//
// Each point has two places in the tissue, which go along with it: `cut`, to where the mesh has been cut, and `edge`, where the edge is. The mesh is cut
// between the two. The edge of a blade without toughness is where the host has it. With toughness the tissue holds it: a row along the blade's
// direction d pushes with at most
//     limit = toughness . length of edge of the point,
// and one across the blade's plane keeps the edge in it. Where the row is at its limit, the edge goes on through the tissue by what the row misses, so
// that its work is toughness times the area that it sweeps. Along itself and backwards the edge moves freely, but for friction: the flanks behind a point
// rub with
//     friction force = 2 . friction . length of edge of the point . (how far it has come into the tissue, at most the blade's width),
// along the direction, forwards and backwards, and along the edge, each by itself (Tresca's law). It is the mechanism of a needle's tip and shaft
// (runtime/needles). The compliance of the point is that of the mesh and kUnresolved / (shear modulus . length) m/N beside it, so that rows of several
// points in one tetrahedron can all be met; the rows of cutting and of friction along the direction share it, so that both come to their limits together.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/base/vec3.h"
#include "runtime/contact/contact_id.h"
#include "runtime/contact/touch_step.h"
#include "runtime/cut/blade_search.h"
#include "runtime/cut/rest_mesh.h"
#include "runtime/include/palpate/palpate_cut.h"
#include "runtime/large/hyperelastic_body.h"

namespace palpate {

constexpr ContactSource kBladeSource{PALPATE_SOURCE_BLADE};

// The mesh as it is in a step.
struct PlacedMesh {
  const RestMesh* rest = nullptr;
  const std::int32_t* nodes = nullptr;       // [tetrahedra][4] of the corners
  const double* position = nullptr;          // [nodes][3] m
  const std::int32_t* scene_node = nullptr;  // [nodes] the node that it is in the touch
  Vec3 corner(std::int32_t c) const { return load3(position + 3 * static_cast<std::size_t>(nodes[c])); }
};

class Blades {
 public:
  static constexpr std::int32_t kRowsOfPoint = 3, kNodesOfPoint = 12;

  // can_hold: [nodes at rest] 1 where the compliance knows a node; body: the same mesh with its laws; both borrowed. points: of an edge that
  // tissue holds.
  void create(SceneMemory& memory, const std::uint8_t* can_hold, const HyperelasticBody* body, std::int32_t points);
  void forget();
  void set(std::int32_t blade, const palpate_blade& now);
  bool are_there() const;
  const palpate_blade_state& state(std::int32_t blade) const { return blades_[blade].state; }

  // A step, before its rows: edges go on by what the last step's rows missed, then come where the host has them. Cost: a walk through the mesh
  // for each point.
  void begin_step(const PlacedMesh& mesh, const OrganPose& organ);
  // The next blade in turn that has a line; -1: all have come in this step. The mesh is then cut along sweep(), until followed().
  std::int32_t next();
  BladeSweep sweep(std::int32_t blade, const PlacedMesh& mesh);
  void followed(std::int32_t blade);
  // Tetrahedra are gone: edges in them are in none.
  template <class IsGone>
  void leave(IsGone is_gone) {
    for (Blade& blade : blades_)
      for (Point& point : blade.points) {
        if (point.edge.tetrahedron >= 0 && is_gone(point.edge.tetrahedron)) point.edge.tetrahedron = -1;
        if (point.cut.tetrahedron >= 0 && is_gone(point.cut.tetrahedron)) point.cut.tetrahedron = -1;
      }
  }

  std::int32_t constraints() const;
  void request(TouchStep& step, const PlacedMesh& mesh);
  void take_reactions(const TouchStep& step, bool solved);

 private:
  // A place that goes along with a tetrahedron; -1: outside of the tissue, in the organ's frame.
  struct Place {
    std::int32_t tetrahedron, unused;  // in the place of padding, which a saved state would hold
    double weight[4];
    double at[3];  // m, when it was found
  };
  struct Row {
    double force, gives_way;          // N, of its first axis in the last step; m, of the tissue there beyond the mesh
    std::int32_t constraint, unused;  // of this step, -1: none
  };
  struct Point {
    double sent[3], now[3];  // m: in the world; in the organ's frame
    Place cut, edge;
    double length;    // m, of edge that it stands for
    double depth;     // m, that it has come into the tissue along the direction
    double friction;  // N, that rubbing may take in the last step and in this one; 0: none
    Row cuts, rubs,
        holds;  // along the direction: of cutting, of friction; across the blade, with friction along the edge
  };
  struct Blade {
    Point points[PALPATE_MAX_BLADE_POINTS];
    double sent_direction[3], direction[3], toughness, friction, width;
    std::int32_t count, given;    // points; of the host's line
    std::int32_t is_new, unused;  // 1: its points have no places yet
    palpate_blade_state state;
  };
  struct Frame {
    Vec3 direction, along, across;
  };
  bool is_felt(const Blade& blade) const { return blade.toughness > 0; }
  static Vec3 now(const Point& point) { return load3(point.now); }
  static Frame frame_of(const Blade& blade, std::int32_t i);
  static Vec3 position(const Place& place, const PlacedMesh& mesh);
  static Place locate(Vec3 p, std::int32_t begin, const PlacedMesh& mesh);
  static std::int32_t nearest_tetrahedron(Vec3 p, const PlacedMesh& mesh);
  bool can_hold(const Place& place, const PlacedMesh& mesh) const;
  void go_on(Blade& blade, std::int32_t i, const PlacedMesh& mesh);
  static void add_rows(TouchStep& step, Blade& blade, std::int32_t i, double shear, Vec3 way, RowWish* wish);
  static void divide_line(const palpate_blade& given, Blade& blade);
  static void measure(Blade& blade);

  const std::uint8_t* can_hold_ = nullptr;
  const HyperelasticBody* body_ = nullptr;
  std::int32_t points_ = 2;
  Blade blades_[PALPATE_MAX_BLADES] = {};
  std::int32_t turn_ = 0;
  int asked_ = 0;
  double line_[2][PALPATE_MAX_BLADE_POINTS][3] = {};
};

}  // namespace palpate
