// Contact forces from imposed displacements: (H W H^T) r = d, f = H^T r, u~_j = (T^f_j)^-1 f_j; rows come and go.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/contact/contact_laws.h"
#include "runtime/contact/contact_set.h"
#include "runtime/contact/node_compliance.h"
#include "runtime/dense/updated_cholesky.h"

namespace palpate {

class ContactSolver {
 public:
  enum class Outcome { solved, regularised, unsolved };

  // Near-dependent rows (one node held twice, two places of a triangle a micron apart, more than three places in one)
  // make A = D H W H^T D, D such that the diagonal is one, singular. The factor is that of A + kShift, and its solution
  // is refined at most kMostSolves - 1 times (iterated Tikhonov): the part of the solution along an eigenvector of A
  // with eigenvalue e becomes (1 - (kShift / (e + kShift))^kMostSolves) / e of that of D d. This falls with e and never
  // exceeds kMostSolves / kShift, so
  //     |D^-1 r| <= kMostSolves / kShift |D d|:
  // the force of two conflicting targets grows monotonically as their gap closes and stays finite. Separated contacts
  // are met to (kShift / e)^2 or better, which is below what single precision stores.
  static constexpr double kShift = 1e-6;
  static constexpr int kMostSolves = 4;

  // lets_go: without() will be asked. Memory: 72 entries^2 + 16 (3 blocks)^2 bytes and less.
  bool create(SceneMemory& memory, std::int32_t entry_capacity, std::int32_t block_capacity, std::int32_t columns,
              bool lets_go);

  // force[e], modified[e]: per entry of the set, N and m. Blocks that the set has in common with the last one keep their
  // rows of the matrix and the factor. regularised: some targets conflict, residual() says by how much they are missed.
  // unsolved (numbers of the bundle are not finite, or rounded until A is not definite): outputs are zero.
  // Where a law forbids what the factor says, projected Gauss-Seidel goes on from the last step's forces.
  // Cost, in multiply-adds: 3 rows^2 or so, and rows^2 per sweep; per block that changed 9 (its entries + 1) nodes, and per row of it
  // rows^2 / 2 to come and up to rows^2 to leave; the tensors are read for new nodes alone.
  // Source: Cotin, Delingette and Ayache 1999, eqs 7-10, in the symmetric form W f = u*.
  Outcome solve(const Tensors& tensors, const ContactSet& set, Vec3* force, Vec3* modified);
  const ContactResidual& residual() const { return residual_; }

  // Of block p of the last set: what its rows carry, N, and how far the place missed its target, m, both in its frame.
  Vec3 reaction(std::int32_t p) const;
  Vec3 missed(const ContactSet& set, std::int32_t p) const {
    return palpate::missed(system(set.blocks, set.block_count), reaction_, p);
  }

  // modified[e] of the last set's entries as they would be if the contact (tool, point) were gone and the others kept their
  // targets and laws. False, and nothing written, where the last set has no such contact.
  // Cost, in multiply-adds: rows^2 per row of the contact; where a law decides, in place of that or beside it, ten sweeps.
  bool without(std::int32_t tool, std::int32_t point, Vec3* modified);

  void forget();

 private:
  static constexpr int kMostRowsOfAContact = 9;  // a triangle's
  using Rows = ContactRowsOfBlock;
  bool update(const Tensors& tensors, const ContactSet& set);
  void match(const ContactSet& set);
  bool same(const ContactSet& set, const ContactBlock& now, const ContactBlock& before) const;
  void keep(const ContactSet& set);
  void drop_rows();
  const Mat3* spread_of(const ContactSet& set, const ContactBlock& block);
  bool fill_rows(const ContactSet& set, std::int32_t p);
  bool append_rows(const std::int32_t* rows, std::int32_t count);
  std::int32_t take_row();
  double& entry(std::int32_t i, std::int32_t j) { return matrix_[static_cast<std::size_t>(i) * stride_ + j]; }

  ContactSystem system(const ContactBlock* blocks, std::int32_t count) const;
  Outcome solve_factored();
  void solve_laws(const ContactSystem& laws);
  static void spread_reactions(const ContactBlock* blocks, const Rows* rows, std::int32_t count,
                               const ContactEntry* entries, const double* reaction, Vec3* force);
  int rows_of(std::int32_t tool, std::int32_t point, std::int32_t row[kMostRowsOfAContact]) const;
  bool take_out(const std::int32_t* gone, int count, double* left);
  void hold_others_to_laws(std::int32_t tool, std::int32_t point, double* left);
  void measure_residual();

  NodeCompliance nodes_;
  UpdatedCholesky factor_;
  std::int32_t capacity_ = 0;        // rows
  std::size_t stride_ = 0;           // numbers per row of the matrix
  std::int32_t rows_end_ = 0;        // rows in use are below this
  std::int32_t free_row_ = 0;        // rows below this are in use
  double* matrix_ = nullptr;         // [rows][stride] H W H^T, m/N
  double* scale_ = nullptr;          // [rows] D; 0: the row is free
  double* shift_ = nullptr;          // [rows] of the scaled diagonal
  double* soft_ = nullptr;           // [rows] the same of the matrix, m/N
  double* target_ = nullptr;         // [rows] m
  double* reaction_ = nullptr;       // [rows] N
  double* last_ = nullptr;           // [rows] N, of the last step, where rows have stayed
  double* work_ = nullptr;           // [2][rows]
  double* removal_ = nullptr;        // [kMostRowsOfAContact][rows], where without() is asked
  std::int32_t* row_at_ = nullptr;   // [rows] row at each position of the factor
  std::int32_t* list_ = nullptr;     // [rows]
  std::int32_t* leaving_ = nullptr;  // [rows]
  std::int32_t leaving_count_ = 0;
  Mat3* spread_ = nullptr;  // [entries] H C of the block being filled

  Rows* rows_ = nullptr;       // [blocks] of the present set
  Rows* kept_rows_ = nullptr;  // [blocks] of the last one
  ContactEntry* kept_entry_ = nullptr;
  ContactBlock* kept_block_ = nullptr;
  std::int32_t kept_blocks_ = 0, kept_entries_ = 0;
  ContactResidual residual_;
};

}  // namespace palpate
