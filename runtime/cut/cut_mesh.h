// The mesh that a blade cuts: which faces between tetrahedra are cut, which tetrahedra are removed, and the nodes and the surface that follow.
//
// A blade cuts faces as they are, the nearest ones to its path: no tetrahedron is divided and no node moves. A face that the blade has met is cut
// when the surface that results is closed, oriented and manifold; until then it is pending. Where a cut stays unfinished although the blade has
// passed, another face near it is cut in its place (CutFinish). All that a step changed stands in change().
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/cut/blade_search.h"
#include "runtime/cut/cut_finish.h"
#include "runtime/cut/cut_state.h"
#include "runtime/cut/cut_surface.h"
#include "runtime/cut/cut_trial.h"
#include "runtime/cut/mesh_pieces.h"
#include "runtime/cut/rest_mesh.h"

namespace palpate {

// What the last step changed. Numbers, valid until the next step.
struct CutMeshChange {
  struct List {
    std::int32_t* items = nullptr;
    std::int32_t count = 0;
    const std::int32_t* begin() const { return items; }
    const std::int32_t* end() const { return items + count; }
    std::int32_t operator[](std::int32_t i) const { return items[i]; }
    void add(std::int32_t item) { items[count++] = item; }
  };
  std::int32_t first_node = 0, end_node = 0;  // new nodes; CutMesh::from() says from which each comes
  List tetrahedra;                            // that have another node at a corner, ascending by the time of the change
  List before;                                // [tetrahedra][4]: the nodes that they had
  List removed_tetrahedra;                    //
  List lost_nodes;                            // that no tetrahedron has any more
  std::int32_t first_triangle = 0, end_triangle = 0;  // new ones
  List removed_triangles;                             //
  List renamed_triangles;                             // older ones that have another node now
  std::int32_t first_piece = 0, end_piece = 0;        // severed in this step
  std::int32_t cut_faces = 0;                         // by the blade in this step
  bool full = false;  // the reserve of nodes ended: what was left of this step is pending
};

// Of the tetrahedra in a ball: how long each has been in balls, and how long it has to be before it goes.
struct BallTime {
  double* of = nullptr;  // [tetrahedra] s
  double held = 0, needed = 0;
};

class CutMesh {
 public:
  // reserve: new nodes at most. The sentence of what is wrong; nullptr: nothing. Nothing is allocated afterwards. The body is borrowed.
  const char* create(SceneMemory& memory, const CutBody& body, std::int32_t reserve);

  // The blade moves; positions [nodes()][3] of the nodes as they are now, m. Where `to` is `from`, cuts that the blade has passed are finished and
  // nothing is met. Points that are not finite: nothing is done. Cost: the nodes, the tetrahedra near the sweep and the faces that wait there.
  const CutMeshChange& blade(const BladeSweep& sweep, const double* positions);
  // The faces between tetrahedra, as if a blade had met them.
  const CutMeshChange& cut(const std::int32_t* faces, std::int32_t count);
  // Removes tetrahedra, the first ones rather than the last: those whose removal leaves a manifold surface.
  const CutMeshChange& remove(const std::int32_t* tetrahedra, std::int32_t count);
  // Removes those whose centroid lies in the ball, from its centre on.
  // time: those go that have been in balls for as long as they need, this one's `held` with it.
  const CutMeshChange& remove_ball(const double centre[3], double radius, const double* positions,
                                   const BallTime& time = {});
  const CutMeshChange& change() const { return change_; }
  // Back to the body at rest; its change() is none.
  void forget();

  // The nodes at rest and the new ones.
  std::int32_t nodes() const { return node_count_; }
  // The node from which a new one was split, and the node at rest where both began.
  std::int32_t from(std::int32_t node) const { return from_[node]; }
  std::int32_t at_rest(std::int32_t node) const { return at_rest_[node]; }
  const std::int32_t* nodes_of(std::int32_t tetrahedron) const { return nodes_ + 4 * tetrahedron; }
  bool is_removed(std::int32_t tetrahedron) const { return state_.gone(tetrahedron); }
  const CutState& state() const { return state_; }
  const CutSurface& surface() const { return surface_; }
  const MeshPieces& pieces() const { return pieces_; }
  // Faces that the blade has met and that wait. Cost: none.
  std::int32_t pending() const { return pending_count_; }
  // The operations that were counted since create(): corners that trials and tetrahedra that searches of pieces have visited.
  std::int64_t work() const { return trial_.work() + pieces_.work(); }

 private:
  void begin_change();
  void meet(std::int32_t face);
  void cut_met();
  void cut_pending_near(std::int32_t tetrahedron, std::uint32_t begin);
  void cut_cluster(std::int32_t face);
  void cut_tried(std::int32_t count);
  bool is_attached(const std::int32_t* faces, std::int32_t count) const;
  void begin_nodes();
  void add_nodes(std::int32_t tetrahedron, std::int32_t except);
  bool divide();
  template <class Visit>
  void each_new_part(std::int32_t node, const Visit& visit);
  void split_node(std::int32_t node);
  void change_node(std::int32_t corner, std::int32_t node);
  void finish_passed(const BladeSweep& sweep, const double* positions);
  void forget_pending();
  bool has_severed();
  void take_away(std::int32_t tetrahedron);
  void lose_nodes(const std::int32_t* tetrahedra, std::int32_t count);
  const CutMeshChange& end_change();

  RestMesh rest_;
  CutState state_;
  CutTrial trial_;
  CutFinish finish_;
  CutSurface surface_;
  MeshPieces pieces_;
  BladeSearch search_;
  CutMeshChange change_;
  std::int32_t* nodes_ = nullptr;                      // [tetrahedra][4]
  std::int32_t *from_ = nullptr, *at_rest_ = nullptr;  // [nodes at rest + reserve]
  std::uint32_t* order_ =
      nullptr;  // [tetrahedra][4]: the number that a pending face had among all that were met, by its lower side
  std::int32_t* pending_ = nullptr;  // [2 tetrahedra]: lower sides
  std::int32_t node_count_ = 0, capacity_ = 0, pending_count_ = 0;
  std::uint32_t met_before_ = 0;
  // Of one step.
  struct Work {
    std::int32_t* met = nullptr;      // [2 tetrahedra]: lower sides; tetrahedra in a ball
    std::int32_t* part = nullptr;     // [2 tetrahedra]: faces that are cut together
    std::int32_t* around = nullptr;   // [nodes at rest]: that are divided together
    double* nearness = nullptr;       // [tetrahedra]
    std::uint32_t* kept = nullptr;    // by node: the pass in which a component has kept it
    std::uint32_t* listed = nullptr;  // by node at rest: the pass in which it is `around`
    std::int32_t* place = nullptr;    // [tetrahedra]: where each stands in change_.tetrahedra, if it does
    std::uint32_t pass = 0;
    std::int32_t met_count = 0, around_count = 0;
  } work_;
};

}  // namespace palpate
