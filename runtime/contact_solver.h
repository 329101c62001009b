// Contact forces from imposed displacements: (H W H^T) r = d, f = H^T r, u~_j = (T^f_j)^-1 f_j.
#pragma once

#include <cstdint>

#include "runtime/contact_set.h"
#include "runtime/scene_memory.h"
#include "runtime/tensors.h"

namespace palpate {

// C_kk: the inverse of T^f_k on its free dofs, zero on the others. False when T^f_k is not positive definite there.
bool self_compliance(const double force[9], Mat3* compliance);

class ContactSolver {
 public:
  enum class Outcome { solved, regularised, unsolved };

  // Least eigenvalue that the contact system, scaled to a unit diagonal, is given. Near-dependent rows (one node held
  // twice, two places of a triangle a micron apart, more than three places in one) would send it to zero.
  //
  // With A = D H W H^T D (unit diagonal) the solver adds g = max(0, kLeastEigenvalue - 1 / trace(A^-1)) to the
  // diagonal. 1 / trace(A^-1) never exceeds the least eigenvalue of A, so that of A + g is at least kLeastEigenvalue,
  // and therefore
  //     |D^-1 r| <= |D d| / kLeastEigenvalue:
  // the force of two conflicting targets grows monotonically as their gap closes and stays finite. Well separated
  // contacts have g = 0 and are not changed.
  static constexpr double kLeastEigenvalue = 1e-6;

  bool create(SceneMemory& memory, std::int32_t entry_capacity);

  // force[e], modified[e]: per entry of the set, N and m. The factor is kept while the set's structure stays the same.
  // unsolved (numbers of the bundle are not finite): outputs are zero.
  // Cost: rows^2 multiply-adds; when the structure changed, 9 reads per pair of entries and rows^3/6 more.
  // Source: Cotin, Delingette and Ayache 1999, eqs 7-10, in the symmetric form of DESIGN section 4.
  Outcome solve(const Tensors& tensors, const ContactSet& set, Vec3* force, Vec3* modified);

  void forget() { kept_blocks_ = -1; }

 private:
  bool structure_is_kept(const ContactSet& set) const;
  void keep_structure(const ContactSet& set);
  Outcome factorise(const Tensors& tensors, const ContactSet& set);
  bool assemble(const Tensors& tensors, const ContactSet& set);
  Mat3 block_compliance(const Tensors& tensors, const ContactSet& set, int p, int q) const;
  Mat3 node_compliance(const Tensors& tensors, const ContactEntry& a, int a_index, const ContactEntry& b,
                       int b_index) const;

  std::int32_t capacity_ = 0;       // entries
  double* matrix_ = nullptr;        // [rows][rows] A
  double* factor_ = nullptr;        // [rows][rows] U of A + g = U^T U, upper part of each row
  double* scale_ = nullptr;         // [rows] D; 0 for a row that cannot move
  double* right_ = nullptr;         // [rows]
  Mat3* self_ = nullptr;            // [entries] C_kk
  std::int32_t* row_of_ = nullptr;  // [blocks][3] or -1
  std::int32_t rows_ = 0;

  ContactEntry* kept_entry_ = nullptr;
  ContactBlock* kept_block_ = nullptr;
  std::int32_t kept_entries_ = -1, kept_blocks_ = -1;
  Outcome kept_outcome_ = Outcome::solved;
};

}  // namespace palpate
