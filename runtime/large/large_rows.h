// The rows of contacts on the hyperelastic body in the metric of the method: their responses Y = K^-1 W^T, and C = W Y + L.
#pragma once

#include <cstddef>
#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/contact/row_matrix.h"
#include "runtime/large/body_metric.h"
#include "runtime/large/hyperelastic_energy.h"
#include "runtime/large/node_columns.h"

namespace palpate {

// One row of W: the weighted mean displacement of some nodes along a direction.
struct LargeRow {
  std::int32_t first, count;  // of its nodes and weights
  double direction[3];
  double target;         // m
  std::int32_t group;    // first row of those that have the same nodes and weights: three at most, one after the other
  std::int32_t unused;   // in the place of padding, which a saved state would hold
  double compliance[3];  // m/N, of L between this row and rows group, group + 1, group + 2
};
// More nodes that a row holds, along a direction of their own.
struct LargeJoin {
  std::int32_t row;  // alone in its group
  std::int32_t first, count;
  std::int32_t unused;  // in the place of padding
  double direction[3];
};
struct LargeContacts {
  const LargeRow* rows = nullptr;
  const std::int32_t* nodes = nullptr;  // of the body
  const double* weights = nullptr;
  std::int32_t row_count = 0;
  const double* start = nullptr;  // [row_count] N, the force of each row in the last step; nullptr: not known
  // [row_count][beside_stride] m/N, L between rows of different groups, symmetric; nullptr: there is none
  const double* beside = nullptr;
  std::size_t beside_stride = 0;
  const LargeJoin* joins = nullptr;  // [join_count], ascending by row
  std::int32_t join_count = 0;
};

// A move of the body and of the rows' own compliance, with its images.
struct BodyMove {
  float *move = nullptr, *of_metric = nullptr,
        *of_tangent = nullptr;  // [length] m; N, the metric and the tangent times the move
  double* local = nullptr;      // [most rows] N
  bool create(SceneMemory& memory, std::size_t length, std::int32_t rows);
  void keep(SceneMemory& memory, std::size_t length, std::int32_t rows);
};

class LargeRows {
 public:
  // energy, metric: borrowed.
  bool create(SceneMemory& memory, const HyperelasticEnergy* energy, const BodyMetric* metric, std::int32_t most_rows,
              std::int32_t most_nodes);
  void keep(SceneMemory& memory);
  // Completes a restored state. Cost: three solves for each row's nodes.
  void restored();
  void forget();

  // Takes the rows of a step. *local: [most()] N, s of each row: of nodes and weights that were there in the last step it stays, with
  // other_local in its place; others begin with contacts.start.
  struct Changed {
    bool spots, rows;  // nodes or weights; these or directions or L
  };
  Changed take(const LargeContacts& contacts, double** local, double** other_local);
  // After take(), where it says so: the responses of nodes and weights that are new, three solves each, or three for each corner that is not known
  // (node_columns.h); C. False where a number is not finite.
  void find_new_responses();
  bool fill_compliance();
  // After the metric has changed; after it has become that of another body.
  void find_all_responses();
  void find_other_responses();

  std::int32_t most() const { return most_rows_; }
  std::int32_t count() const { return state_.count; }
  const LargeRow& row(std::int32_t r) const { return now_.row[r]; }
  const RowMatrix& compliance() const { return compliance_; }  // [count][count] m/N, C
  bool has_beside() const { return state_.has_beside != 0; }
  double beside(std::int32_t i, std::int32_t j) const {
    return beside_[static_cast<std::size_t>(i) * stride_ + static_cast<std::size_t>(j)];
  }

  // Whether a row is held; else it has no force, or one that is given.
  std::uint8_t* holds() { return holds_; }
  const std::uint8_t* holds() const { return holds_; }
  bool holds(std::int32_t r) const { return holds_[r] != 0; }
  double work_of_applied(const float* move) const;  // J
  double* applied() { return applied_; }            // [most()] N, of rows that do not hold
  const double* applied() const { return applied_; }
  // Factors C of the rows that hold. False where a number is not finite.
  bool factor();
  // x <- C^-1 x, of the rows that hold; of the others as they are.
  void solve(double* x) const;
  // L a, of the rows that hold and by these alone; and b L a.
  void compliance_times(const double* a, double* out) const;
  double times_compliance(const double* a, const double* b) const;

  // The largest ratio, over the places of all rows, of the compliance of a place in the metric to that at rest; both are traces of W Y, m/N. At least 1.
  double most_softening() const;

  // m, W field of a row. field += W^T force; field += factor Y force, the same with Y at rest. out: Y^T force.
  double on_row(std::int32_t r, const float* field) const;
  void add_rows(const double* force, float* field) const;
  void add_responses(const double* force, double factor, float* field) const;
  void add_rest_responses(const double* force, double factor, float* field) const;
  void responses_times(const float* force, double* out) const;
  // Takes out of a move what moves rows that hold: p -= Y C^-1 (W p + L local), local -= C^-1 (..), of_metric -= W^T C^-1 (..). of_metric: N,
  // the metric times p.
  void project(float* p, double* local, float* of_metric);

  // As LargeSolver says.
  void response_at(const double* force, std::int32_t first, std::int32_t end, std::int32_t node, double out[3]) const;
  double response_bound(const double* force, std::int32_t first, std::int32_t end) const;
  void response_on_rows(const double* force, double* out) const;
  double spot_response_bound(std::int32_t r, const double* force) const;
  // m/N, in x, y and z: of the nodes of a row, or of its join number `part` - 1, by a force on those of another one. out: [3][3].
  void between(std::int32_t r, std::int32_t part, std::int32_t k, std::int32_t other_part, double* out) const;
  std::int64_t response_id(std::int32_t r) const {
    const std::int32_t slot = spot_of(r).slot;
    return (static_cast<std::int64_t>(slot) << 32) + generation_[slot];
  }
  // Since the last call.
  std::int32_t take_solves() {
    const std::int32_t solves = solves_;
    return solves_ = 0, solves;
  }

 private:
  // The nodes and weights that the rows of a group share, and where their responses are. A row that holds others too has their spots behind it.
  struct Spot {
    std::int32_t first, count;  // of its nodes and weights
    std::int32_t row, rows;     // its rows
    std::int32_t slot;          // of its three columns of Y
    std::int32_t joined;        // 1: along its own direction
    double direction[3];
  };
  // Rows and spots of a step, with places in place of nodes.
  struct Taken {
    LargeRow* row = nullptr;        // [most_rows]
    Spot* spots = nullptr;          // [most_spots]
    std::int32_t* place = nullptr;  // [most_nodes]
    double* weight = nullptr;       // [most_nodes]
  };
  struct State {
    std::int32_t count = 0, spot_count = 0, has_beside = 0, unused = 0;
  };
  bool take_spots(const LargeContacts& contacts, const double* local, double* other_local);
  bool take_rows(const LargeContacts& contacts, bool changed);
  bool take_beside(const LargeContacts& contacts);
  void take_spot(const LargeContacts& contacts, const Spot& of, std::int32_t* entries, const double* local,
                 double* other_local, bool* changed);
  bool same_spot(const LargeContacts& contacts, const Spot& now, const Spot& before) const;
  const double* along(const Spot& spot, std::int32_t r) const {
    return spot.joined ? spot.direction : now_.row[r].direction;
  }
  // each(number of the spot, direction) of all spots of a row.
  template <class Each>
  void for_spots(std::int32_t r, Each each) const {
    std::int32_t i = row_spot_[r];
    do {
      each(i, along(now_.spots[i], r));
    } while (++i < state_.spot_count && now_.spots[i].joined);
  }
  static constexpr int kSpotsAtOnce = BodyMetric::kMostVectors / 3;
  void find_responses(const Spot* const* spots, int count);
  void load(const Spot& spot, int axis, float* y) const;
  void sum_responses(const Spot* const* spots, int count);
  // Spots without responses yet, kSpotsAtOnce of each kind at most.
  struct Waiting {
    const Spot* spots[kSpotsAtOnce];
    int count = 0;
  };
  struct WaitingSpots {
    Waiting standing, sliding;
  };
  void wait_for_responses(const Spot& spot, WaitingSpots& waiting);
  void find_waiting_responses(WaitingSpots& waiting);
  void measure_longest(const Spot& spot);
  void measure_spots();
  void on_spot(const Spot& spot, const float* field, double sum[3]) const;
  template <class Column>
  void add_columns_of(const double* force, double factor, float* field, Column column) const;
  float* response(const Spot& spot, int axis) const {
    return responses_ + static_cast<std::size_t>(3 * spot.slot + axis) * energy_->length();
  }
  float* rest_response(const Spot& spot, int axis) const {
    return rest_responses_ ? rest_responses_ + static_cast<std::size_t>(3 * spot.slot + axis) * energy_->length()
                           : response(spot, axis);
  }
  double between_spots(std::int32_t i, std::int32_t j) const {
    const auto at = static_cast<std::size_t>(i), to = static_cast<std::size_t>(j);
    return 0.5 * (between_spots_[at * stride_ + to] + between_spots_[to * stride_ + at]);
  }
  const Spot& spot_of(std::int32_t r) const { return now_.spots[row_spot_[r]]; }

  const HyperelasticEnergy* energy_ = nullptr;
  const BodyMetric* metric_ = nullptr;
  std::int32_t most_rows_ = 0, most_spots_ = 0, most_nodes_ = 0, next_count_ = 0;  // of next_'s spots
  std::size_t stride_ = 0;  // numbers from one row of the matrices to the next
  State state_;
  Taken now_, next_;
  std::int32_t* row_spot_ = nullptr;  // [most_rows]
  bool* slot_used_ = nullptr;         // [most_spots]
  float *responses_ = nullptr,
        *rest_responses_ = nullptr;     // [most_spots][3][length] columns of Y along x, y and z; of K at rest
  std::int32_t* generation_ = nullptr;  // [most_spots] counts what was in the slot
  double* largest_response_ = nullptr;  // [most_spots][3] m/N, the longest displacement of a node
  double* between_spots_ = nullptr;     // [most_rows][stride] W Y along x, y and z of the spots
  RowMatrix compliance_;
  double* beside_ = nullptr;       // [most_rows][stride] L between rows of different groups
  double* contact_ = nullptr;      // [most_rows][stride] Cholesky factor of C, of the rows that hold
  std::uint8_t* holds_ = nullptr;  // [most_rows]
  double* applied_ = nullptr;      // [most_rows] N
  double* work_ = nullptr;         // [most_rows]
  NodeColumns columns_;
  std::int32_t solves_ = 0;
};

}  // namespace palpate
