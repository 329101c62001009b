// The compliance stored in blocks, as `palpate-bundle pack --low-rank` writes it: dense blocks near the diagonal, low-rank blocks
// elsewhere. Each block is stored once for both of its sides, because C_kn = C_nk^T. It stands for the displacement rows:
// T^u_nk = C_nk T^f_k.
//
// Surface nodes are sorted into clusters; the index of a node in that order is its slot. A block covers a range of slots as rows
// and another range as columns.
#pragma once

#include <cstdint>

#include "formats/compliance_blocks.h"
#include "runtime/base/scene_memory.h"
#include "runtime/base/vec3.h"
#include "runtime/dense/loaded_runs.h"

namespace palpate {

// A force on the node of a tensor column.
struct LoadedColumn {
  std::int32_t slot;
  Vec3 force;  // N
};

class Compliance {
 public:
  // The stored tables, as checked copies, and the stored numbers, which stay in the bundle.
  struct Stored {
    const std::int32_t *nodes = nullptr, *cluster_ends = nullptr, *touchable = nullptr;
    const formats::StoredBlock* blocks = nullptr;
    const float* scale = nullptr;
    const void* values = nullptr;
    formats::ElementType type = formats::ElementType::f32;
    std::int32_t surface_nodes = 0, columns = 0, clusters = 0, block_count = 0;
  };
  enum class Outcome { made, no_memory, inconsistent };

  // most_loaded: forces that field() may be given. inconsistent: a node has two slots, a slot holds the wrong kind of node, or two
  // blocks cover the same entry.
  Outcome create(SceneMemory& memory, const Stored& stored, std::int32_t most_loaded);
  bool exists() const { return blocks_ != nullptr; }

  std::int32_t slot_of_column(std::int32_t column) const { return slot_of_column_[column]; }

  // C_nk (m/N) of a surface node and a column's node; zero where no block covers both. Cost: a search among the blocks of
  // the column's cluster, then 6 reads per rank.
  Mat3 entry(std::int32_t node, std::int32_t column) const;

  // of_slots: [Ns][3] m, displacement of every surface node under the loads, in the order of the slots. The order of loads changes.
  // Cost: each block that covers a loaded node is read once.
  void field(LoadedColumn* loads, std::int32_t count, float* of_slots);

  // out: [count][3], what a field has at surface nodes first .. first + count - 1. Reads a number behind the field's last, and does not
  // use it.
  void at_nodes(const float* of_slots, std::int32_t first, std::int32_t count, float* out) const;

  // For the plan: stored numbers that field() reads for one loaded node, averaged over the columns; and their type.
  std::uint64_t numbers_per_column() const { return numbers_per_column_; }
  formats::ElementType type() const { return stored_.type; }

 private:
  // One block as seen from a cluster of loaded nodes: on which of its sides the cluster stands, and the slots of the other side.
  struct Side {
    std::int32_t block;
    std::int32_t transposed;  // 1: the cluster is among the block's rows
    std::int32_t other_begin, other_end;
  };

  Loads sorted(LoadedColumn* loads, std::int32_t count);
  void apply_blocks(const Loads& loads);
  int end_of_cluster(const Loads& loads, int first) const;
  Outcome assign_slots(SceneMemory& memory);
  Outcome list_sides(SceneMemory& memory);
  template <class Visit>
  void for_each_side(Visit visit) const;
  void measure();
  const void* run(std::uint64_t first) const {
    return static_cast<const unsigned char*>(stored_.values) + first * formats::element_bytes(stored_.type);
  }
  Loads covered(const Side& side, const Loads& loads, int first, int next) const;
  void apply(const Side& side, const Loads& loads);
  void apply_dense(const formats::ComplianceBlock& block, const Loads& loads);
  void apply_dense_transposed(const formats::ComplianceBlock& block, const Loads& loads);
  void apply_low_rank(const formats::ComplianceBlock& block, bool transposed, const Loads& loads);

  Stored stored_;
  formats::ComplianceBlock* blocks_ = nullptr;
  std::int32_t* slot_of_node_ = nullptr;     // [Ns]
  std::int32_t* slot_of_column_ = nullptr;   // [S]
  std::int32_t* cluster_of_slot_ = nullptr;  // [S]
  std::int32_t* first_side_ = nullptr;       // [touchable clusters + 1]
  Side* sides_ = nullptr;                    // sorted by touchable cluster, then by other_begin
  std::int32_t touchable_clusters_ = 0;
  std::int32_t* loaded_slot_ = nullptr;  // [most loaded]
  float* loaded_force_ = nullptr;        // [most loaded][3]
  const void** runs_ = nullptr;          // [most runs]
  float* coefficients_ = nullptr;        // [most runs]
  float* field_of_slot_ = nullptr;       // [Ns][3], of the field that is being made
  std::uint64_t numbers_per_column_ = 0;
};

}  // namespace palpate
