// C_ab between the nodes under contact: each pair is read from the tensors once, when the later of the two is touched.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/bundle/tensors.h"
#include "runtime/contact/contact_set.h"

namespace palpate {

// C_kk: the inverse of T^f_k on its free dofs, zero on the others. False when T^f_k is not positive definite there.
bool self_compliance(const double force[9], Mat3* compliance);

class NodeCompliance {
 public:
  // capacity: nodes at a time; columns: of the tensors. Memory: 72 capacity^2 + 4 columns bytes.
  bool create(SceneMemory& memory, std::int32_t capacity, std::int32_t columns);

  // Holds exactly the nodes of the set. False when a number that was read is not finite: nothing is held then.
  // Cost: 9 numbers of the tensors, from three places, per new node and node held.
  bool hold(const Tensors& tensors, const ContactSet& set);
  void forget();

  std::int32_t slot_of_entry(std::int32_t e) const { return slot_of_entry_[e]; }
  // Slots in use are below this.
  std::int32_t slots() const { return slots_; }
  bool in_use(std::int32_t slot) const { return column_[slot] >= 0; }

  // C_ab, m/N: row of node a, column of node b. The row of blocks of a: at(a)[b].
  const Mat3* at(std::int32_t a) const { return matrix_ + static_cast<std::size_t>(a) * stride_; }
  const Mat3& self(std::int32_t a) const { return at(a)[a]; }

 private:
  bool read_new(const Tensors& tensors);
  bool read(const Tensors& tensors, std::int32_t a, const std::int32_t* earlier, std::int32_t count);
  bool is_new(std::int32_t slot) const { return taken_in_[slot] == round_; }
  void release(std::int32_t slot);

  Mat3* matrix_ = nullptr;                  // [capacity][stride]
  std::int32_t* column_ = nullptr;          // [capacity] of each slot, or -1
  std::int32_t* node_ = nullptr;            // [capacity]
  std::uint32_t* held_in_ = nullptr;        // [capacity] the last round that asked for it
  std::uint32_t* taken_in_ = nullptr;       // [capacity] the round in which it came
  std::int32_t* by_column_ = nullptr;       // [capacity] slots in use
  std::int32_t* new_ = nullptr;             // [capacity] those of them that are new
  std::int32_t* slot_of_column_ = nullptr;  // [columns] or -1
  std::int32_t* slot_of_entry_ = nullptr;   // [capacity]
  std::size_t stride_ = 0;
  std::int32_t slots_ = 0;
  std::uint32_t round_ = 0;
};

}  // namespace palpate
