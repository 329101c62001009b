// The compliance of a cut body: the stored one of the uncut body, plus a matrix of low rank that follows each change of the mesh.
//
// A new node j begins tied to the node n that it splits from, so that it has n's column; splitting frees the jump u_j - u_n. A change of the
// stiffness of the tied body is K + G S G^T, with few columns G on the nodes of the tetrahedra and sites that change. Then
//     C' = C + Z M Z^T,    Z = C P + J
// P: the patterns of cut_basis.h, forces on nodes of C; J: their jumps. Each change adds patterns or uses those that are there:
//     x = Z^T G,  y = [coordinates of G] + M x,  T = G^T C' G,  M <- M - y S (I + T S)^-1 y^T
// and a split node, whose jump w has the stiffness N and pulls the others by B w:
//     y = [three new patterns e_j - B] - M Z^T B,  M <- M + y (N - B^T C' B)^-1 y^T.
// So the cut is a set of pseudo-forces P M Z^T f on nodes at rest and of jumps. Section 24 of docs/method.md.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/base/vec3.h"
#include "runtime/cut/cut_basis.h"
#include "runtime/cut/cut_change.h"
#include "runtime/cut/cut_supports.h"
#include "runtime/cut/cut_tissue.h"
#include "runtime/cut/force_columns.h"
#include "runtime/cut/small_update.h"

namespace palpate {

struct CutCapacity {
  std::int32_t nodes = 0;      // at rest, on which the cut acts
  std::int32_t new_nodes = 0;  // of all changes
  std::int32_t patterns =
      0;  // rank of what is added: 3 a split node of p1, 5 of p1-anp; 12 a removed tetrahedron and less where they touch
  // A change that leaves less than this share of a motion's stiffness is not made: the body would fall apart. What a compliance in single
  // precision cannot tell from nothing is about 1e-3.
  double least_share = 1e-9;
};

enum class CutOutcome {
  made,
  full,       // no room for its nodes, patterns or new nodes
  loose,      // a node or a piece would hang on nothing: ground() it first
  no_column,  // the compliance of a node is not known
  wrong       // the change does not fit the mesh
};

// What was made of a change: its new nodes in their order, then its removed tetrahedra, until one could not be.
struct CutResult {
  CutOutcome outcome = CutOutcome::made;
  std::int32_t new_nodes = 0, removed = 0;
  double least_share = 1;  // the smallest of all that were tried
};

class CutCompliance {
 public:
  // body, source, surface: borrowed. surface: what tells how supports follow a cut; without it they stay with the nodes that keep their numbers.
  // Memory: about 72 nodes^2 + 8 patterns^2 bytes.
  bool create(SceneMemory& memory, const HyperelasticBody& body, const PairCompliance& source,
              const CutCapacity& capacity, const SupportedSurface& surface = {});

  // Back to the uncut body.
  void forget();
  // Of the same body, with the same capacities: at rank 0, as `now` is. source, borrowed: the compliance of what `now` is, between all nodes that it has.
  // Cost: copies of the mesh.
  void begin_from(const CutCompliance& now, const PairCompliance& source);

  // Cost of a split node or a removed tetrahedron, rank r and k columns (3; 6 of p1, 10 of p1-anp, and 9 for each foundation of what is removed):
  // 2 k r^2 multiply-adds, k r times the nodes of a pattern, and the reads of the nodes that are new.
  CutResult apply(const CutChange& change);
  // A stiffness, N/m, to the world for a node: for a piece that is to stay where it is, on three nodes before it comes loose.
  CutOutcome ground(std::int32_t node, double stiffness);

  const CutTissue& tissue() const { return tissue_; }
  const CutSupports& supports() const { return supports_; }
  std::int32_t rank() const { return basis_.count(); }
  // A pattern stays as it is and keeps its number; each change may add some behind the others, also one that is not made.
  const CutBasis& basis() const { return basis_; }
  // Numbers of a row over all patterns, of which those beyond rank() are zero in M.
  std::size_t stride() const { return stride_; }
  // M, [rank()][stride()], symmetric.
  const double* matrix() const { return matrix_; }
  // M x of some rows, [columns][stride()] each; columns: at most kMostColumns. The rows of x are zero from rank() to padded_row() of it, and
  // so are those of the product.
  void multiply(const double* x, int columns, double* product) const;
  // Numbers of a response; changes with no change of the mesh.
  std::size_t response_numbers() const { return 6 * stride_; }
  // Goes up by one with each change: responses that were found before are then those of another body.
  std::int32_t version() const { return version_; }

  // Z of a node and M Z, of three axes each. False where a pair is not known. Cost: reads of the slots' pairs, 3 rank^2 multiply-adds.
  bool find_response(std::int32_t node, double* response);
  // What the cut adds to the displacement of node a per unit force on node b, m/N.
  Mat3 added(const double* response_a, const double* response_b) const;
  // All of it: C_ab of the uncut body, and what the cut adds. False where the pair is not known.
  bool between(std::int32_t a, const double* response_a, std::int32_t b, const double* response_b, Mat3* c) const;

  // The cut's part under forces: begin, add_force for each, end. Then the field of the cut body is that of the uncut one under the same forces,
  // each at its node's origin, and pseudo-forces at the slots' nodes; a new node is displaced by its jump besides.
  void begin_forces();
  void add_force(const double* response, Vec3 force);
  void end_forces();
  std::int32_t slots() const { return slots_.count(); }
  std::int32_t most_slots() const { return capacity_.nodes; }
  std::int32_t node_of_slot(std::int32_t slot) const { return slots_.nodes()[slot]; }
  Vec3 pseudo_force(std::int32_t slot) const { return pseudo_force_[slot]; }
  // The first of three patterns that are unit forces on a node of the base; -1: there are none. Nodes of removed tetrahedra have them.
  std::int32_t nodal_pattern(std::int32_t of_base) const {
    const std::int32_t slot = slots_.find(of_base);
    return slot < 0 ? -1 : basis_.find_nodal(slot);
  }
  // m, of a new node against its origin; zero of other nodes.
  Vec3 jump(std::int32_t node) const;

 private:
  struct Unit;  // how a part of a change ended
  void forget_patterns(const PairCompliance& source);
  Unit split(const CutChange& change, const CutChange::NewNode& made);
  Unit free_jump(const CutChange& change, const CutChange::NewNode& made);
  LoadShare share_of_loads(std::int32_t node) const;
  Unit split_site(std::int32_t node, std::int32_t from, std::int32_t region);
  Unit remove(std::int32_t tetrahedron);
  void lose_loads(std::int32_t tetrahedron);
  Unit take_away(std::int32_t tetrahedron);
  Unit change_foundation(std::int32_t tetrahedron, int opposite, double factor);
  Unit ground_node(std::int32_t node, double stiffness);
  Unit take_slots();
  Unit add_stiffness(const SmallMatrix& s);
  Unit coordinates_of_node(std::int32_t node, Vec3 force, int column);
  Unit coordinates_of_site(std::int32_t node, std::int32_t region, int column);
  Unit new_site_patterns(const NodeGradients& site, std::int32_t* first);
  void collect_jumps(const CutChange& change, std::int32_t from, double springs, SmallMatrix* own);
  void add_site_jumps(std::int32_t node, std::int32_t region, SmallMatrix* own);
  void add_support_jumps(const CutChange& change, std::int32_t from, double springs, SmallMatrix* own);
  void begin_coordinates(int columns);
  void measure(SmallMatrix* t);
  void add_to_matrix(const SmallMatrix& x, int columns, double sign);
  bool find_patterns(std::int32_t node, double* field, double* weighed, double* z) const;
  template <class Visit>
  void for_each_jump(std::int32_t node, Visit visit) const;
  double* row(double* of, int j) const { return of + static_cast<std::size_t>(j) * stride_; }

  const PairCompliance* uncut_ = nullptr;
  CutTissue tissue_;
  CutSupports supports_;
  CutSlots slots_;
  CutBasis basis_;
  CutSites sites_;
  ForceColumns columns_;
  NodeGradients site_, part_;
  CutCapacity capacity_;
  double* matrix_ = nullptr;  // [patterns][stride] M
  std::size_t stride_ = 0;
  std::int32_t version_ = 0;
  Vec3* pseudo_force_ = nullptr;  // [slots]
  Vec3* jump_ = nullptr;          // [new nodes] against the node that each comes from
  double* weight_ = nullptr;      // [stride] M Z^T f of the forces
  struct Scratch {
    double *field = nullptr, *x = nullptr, *y = nullptr, *product = nullptr, *coefficient = nullptr, *weighed = nullptr;
    const double** source = nullptr;
    Vec3* jump_weight = nullptr;    // [new nodes][kMostColumns]
    Vec3* slot_gradient = nullptr;  // [slots]
    std::uint8_t* moved = nullptr;  // [tetrahedra] 1 + the corner that goes to the new node, 0: none
    std::int32_t* slot = nullptr;   // [patch]
  } scratch_;
};

struct CutCompliance::Unit {
  CutOutcome outcome = CutOutcome::made;
  double least_share = 1;
  explicit operator bool() const { return outcome == CutOutcome::made; }
};

}  // namespace palpate
