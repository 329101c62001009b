// Pressures on pieces of the surface of the hyperelastic body. Each acts along the present normal of its piece, on the present area: the force on
// each corner of a triangle is -P A / 3, with the triangle's area vector A.
//
// The volume that a piece sweeps from one state to another is that of the straight way between them, -sum over the triangles and their corners
// of du . (mean of A on the way) / 3, and the pressure's work is P times it. On a closed piece, or one whose rim is held, it is the change of
// the volume behind the piece, and the pressure has a potential. Where the rim moves, the volume depends on the way (Schweizerhof and Ramm 1984,
// Computers and Structures 18). So it is summed up from state to state, and a line search sees the work of the force itself.
//
// The pressure of row m of the offset is P = q + l + k (v - V). q is its amount, l a multiplier, and k (v - V) holds the volume V that the piece
// has swept since rest at v, where that is asked for. Multiplier and k are those of an augmented Lagrangian (Hestenes 1969, J. Optim. Theory
// Appl. 4), so that l holds the volume in the end, and the energy has k (v - V)^2 / 2 + l (v - V).
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/base/vec3.h"
#include "runtime/bundle/offset_rows.h"
#include "runtime/large/hyperelastic_body.h"

namespace palpate {

class SurfacePressures {
 public:
  // rows: those of an offset, whose pressures are here. new_nodes: that may split off, at most. place: of each node in vectors of the body. False
  // where memory ends.
  bool create(SceneMemory& memory, const OffsetRows& rows, const HyperelasticBody& body, std::int32_t new_nodes,
              const std::int32_t* place);
  // The mesh is cut (mesh_follower.h), by places: a triangle goes with the tetrahedron below it.
  void split(std::int32_t from, std::int32_t to, const std::int32_t* tetrahedra, std::int32_t count);
  void remove(std::int32_t tetrahedron);
  void forget_changes();
  void keep(SceneMemory& memory);

  std::int32_t count() const { return count_; }
  std::int32_t row(std::int32_t i) const { return of_[i].row; }  // of the offset

  // What holds pressure i at a volume.
  struct Held {
    double volume = 0;      // m^3, v
    double multiplier = 0;  // Pa, l
    double stiffness = 0;   // Pa/m^3, k; 0 where no volume is held
    double swept = 0;       // m^3, V of the state
  };
  // m^3, by which the volume of pressure i is short of the one at which it is held.
  double left(std::int32_t i) const { return held_[i].volume - held_[i].swept; }
  Held& held(std::int32_t i) { return held_[i]; }
  const Held& held(std::int32_t i) const { return held_[i]; }
  // Some volume is held, or a pressure has gone on from one that was.
  bool act() const;
  // Back to where begin_step() was; then take().
  void begin_step();
  void give_up();
  // Pa, P of the state. amounts: of the offset's rows.
  double pressure(std::int32_t i, const double* amounts) const { return pressure_at(i, amounts, held_[i].swept); }

  // The amounts of the offset's rows become others. offset(p): m, the displacement of place p from the mesh by the offset alone. The work of each amount
  // counts from there, as it does for the linear body.
  template <class Place>
  void count_from(Place offset) {
    for (std::int32_t n = 0; n < node_count_; ++n) trial_[n] = offset(node_[n]);
    for (std::int32_t i = 0; i < count_; ++i) of_[i].from = swept_between(i, base_, trial_);
  }
  // place(p): m, the displacement of place p from the mesh; at rest, and in the state.
  template <class Place>
  void rest_at(Place place) {
    for (std::int32_t n = 0; n < node_count_; ++n) base_[n] = now_[n] = place(node_[n]);
    for (std::int32_t i = 0; i < count_; ++i) held_[i] = {};
  }
  template <class Place>
  void take(Place place) {
    for (std::int32_t n = 0; n < node_count_; ++n) now_[n] = place(node_[n]);
  }

  // Of the state `at`, displacements by places, m: J, and f += its derivative, N. rows: places that move.
  double evaluate(const float* at, const double* amounts, std::int32_t rows, float* f);
  // The last evaluated state becomes the state.
  void accept();
  // f += factor dV/du of the state, of pressure i.
  void add_gradient(std::int32_t i, double factor, std::int32_t rows, float* f) const {
    add_areas(i, now_, -factor, rows, f);
  }
  // m^3: what the triangles of pressure i have swept since rest, each for itself.
  double gross(std::int32_t i) const;

 private:
  struct Piece {
    std::int32_t row = 0, first = 0, end = 0, unused = 0;  // its triangles
    double from = 0;                                       // m^3, from where the work of its amount counts
    double trial = 0;                                      // m^3, V of the last evaluated state
  };
  Vec3 place_of(std::int32_t n, const Vec3* moved) const { return rest_[n] + moved[n]; }
  Vec3 area(const std::int32_t* corner, const Vec3* moved) const;
  Vec3 mean_area(const std::int32_t* corner, const Vec3* from, const Vec3* to) const;
  double swept_by(const std::int32_t* corner, const Vec3* from, const Vec3* to) const;
  double swept_between(std::int32_t i, const Vec3* from, const Vec3* to) const;
  void add_areas(std::int32_t i, const Vec3* moved, double factor, std::int32_t rows, float* f) const;
  double pressure_at(std::int32_t i, const double* amounts, double swept) const {
    const Held& held = held_[i];
    return amounts[of_[i].row] + held.multiplier + held.stiffness * (held.volume - swept);
  }

  bool find_below(SceneMemory& memory, const HyperelasticBody& body, const std::int32_t* number);
  std::int32_t triangles() const { return count_ > 0 ? of_[count_ - 1].end : 0; }

  Piece* of_ = nullptr;                            // [count]
  Held *held_ = nullptr, *held_before_ = nullptr;  // [count]
  std::int32_t count_ = 0, node_count_ = 0;
  std::int32_t* corner_ = nullptr;  // [triangles][3] numbers of nodes here
  std::int32_t* node_ = nullptr;    // [node_count] their places
  // Where the mesh may be cut: [triangles] the tetrahedron; as corner_ was; node_count_ as it was.
  std::int32_t *below_ = nullptr, *uncut_ = nullptr, uncut_nodes_ = 0;
  Vec3* rest_ = nullptr;  // [node_count] m
  Vec3 *base_ = nullptr, *now_ = nullptr,
       *trial_ = nullptr;  // [node_count] m: displacements at rest, of the state, of the last evaluated one
};

}  // namespace palpate
