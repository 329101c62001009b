// The compliance in blocks, as palpate-bundle pack --low-rank stores it: C_nk in dense blocks near the diagonal and low
// rank elsewhere, each block once for both sides (C_kn = C_nk^T). T^u_nk = C_nk T^f_k.
#pragma once

#include <cstdint>

#include "formats/compliance_blocks.h"
#include "runtime/base/scene_memory.h"
#include "runtime/base/vec3.h"

namespace palpate {

// A node that carries a force.
struct LoadedColumn {
  std::int32_t place;
  Vec3 force;  // N
};

class Compliance {
 public:
  // What a bundle stores. Tables are copies that the reader's checks have passed; values stay in the bundle.
  struct Stored {
    const std::int32_t *nodes = nullptr, *cluster_ends = nullptr, *touchable = nullptr;
    const formats::StoredBlock* blocks = nullptr;
    const float* scale = nullptr;
    const void* values = nullptr;
    formats::ElementType type = formats::ElementType::f32;
    std::int32_t surface_nodes = 0, columns = 0, clusters = 0, block_count = 0;
  };
  enum class Outcome { made, no_memory, inconsistent };

  // inconsistent: a node stands at two places, a place holds the wrong kind of node, or two blocks share an entry.
  Outcome create(SceneMemory& memory, const Stored& stored, std::int32_t most_loaded);
  bool exists() const { return blocks_ != nullptr; }

  std::int32_t place_of_column(std::int32_t column) const { return place_of_column_[column]; }

  // C of a surface node and a column; zero where no block is stored. Cost: a search among the blocks of the column's
  // cluster, then 6 reads per rank.
  Mat3 block(std::int32_t node, std::int32_t column) const;

  // out[3 n + i] = displacement of surface node n under the loads, m; [Ns][3]. loads: at most most_loaded, reordered.
  // Cost: each block that holds a loaded node is read once.
  void field(LoadedColumn* loads, std::int32_t count, float* out);

  // For the plan: numbers read for one loaded node, a mean over the columns; the type they are stored in.
  std::uint64_t numbers_per_column() const { return numbers_per_column_; }
  formats::ElementType type() const { return stored_.type; }

 private:
  // One block as a cluster of loaded nodes sees it: the side it stands on, and the places of the other side.
  struct Side {
    std::int32_t block;
    std::int32_t transposed;  // the cluster stands among the rows
    std::int32_t other_begin, other_end;
  };

  Outcome place_nodes(SceneMemory& memory);
  Outcome list_sides(SceneMemory& memory);
  template <class Visit>
  void for_each_side(Visit visit) const;
  void measure();
  const void* run(std::uint64_t first) const {
    return static_cast<const unsigned char*>(stored_.values) + first * formats::element_bytes(stored_.type);
  }
  void apply(const Side& side, const LoadedColumn* loads, std::int32_t count);
  void apply_dense(const formats::ComplianceBlock& block, const LoadedColumn* loads, std::int32_t count);
  void apply_dense_transposed(const formats::ComplianceBlock& block, const LoadedColumn* loads, std::int32_t count);
  void apply_low_rank(const formats::ComplianceBlock& block, bool transposed, const LoadedColumn* loads,
                      std::int32_t count);

  Stored stored_;
  formats::ComplianceBlock* blocks_ = nullptr;
  std::int32_t* place_of_node_ = nullptr;     // [Ns]
  std::int32_t* place_of_column_ = nullptr;   // [S]
  std::int32_t* cluster_of_place_ = nullptr;  // [S]
  std::int32_t* first_side_ = nullptr;        // [touchable clusters + 1]
  Side* sides_ = nullptr;                     // of each touchable cluster in turn, by other_begin
  std::int32_t touchable_clusters_ = 0;
  const void** runs_ = nullptr;      // [most runs]
  float* coefficients_ = nullptr;    // [most runs]
  float* field_of_place_ = nullptr;  // [Ns][3]
  std::uint64_t numbers_per_column_ = 0;
};

}  // namespace palpate
