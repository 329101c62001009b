// Contacts that may release or slip: projected block Gauss-Seidel on the contact matrix. The blocks are the constraints.
//
// The system is (H W H^T + soft) r = d: r the reactions of the rows (N), d their targets (m), W the compliance between the
// contact nodes. A law forbids some reactions: a pull, or a tangential force beyond friction times the normal force.
#pragma once

#include <cstdint>

#include "runtime/contact/contact_constraints.h"
#include "runtime/contact/shared_nodes.h"

namespace palpate {

// Where the rows of one constraint stand in the system.
struct RowsOfConstraint {
  std::int32_t at[3];  // row of each axis of the frame; -1: not imposed, or it cannot move
};

// The contact system as the solver stores it. Rows that are not in use have a reaction of zero.
struct ContactSystem {
  const double* matrix = nullptr;  // [rows_end][stride] H W H^T, m/N, symmetric
  std::size_t stride = 0;
  std::int32_t rows_end = 0;
  const double* soft = nullptr;    // [rows_end] m/N, added to the diagonal
  const double* target = nullptr;  // [rows_end] m
  const double* most = nullptr;    // [rows_end] N, limit on the size of each reaction; nullptr: none
  const ContactConstraint* constraints = nullptr;
  const RowsOfConstraint* rows = nullptr;  // [constraint_count]
  std::int32_t constraint_count = 0;
  // The nodes of the constraints; products with the matrix go through them. nullptr: products are with the rows above.
  const SharedNodes* shared = nullptr;
  const Mat3* own = nullptr;  // [constraint_count] own_compliance() of each, where somebody has kept it
};

// By how much the constraints are missed, at the row that is missed most.
struct ContactResidual {
  double displacement = 0;  // m
  double force = 0;         // N: the same, divided by the row's own compliance
};

// The constraint's diagonal block of the system on its rows. A direction without a row gets the constraint's largest compliance,
// and its reaction stays zero.
Mat3 own_compliance(const ContactSystem& system, std::int32_t p);
// The same of all constraints; own: [constraint_count].
void find_own_compliances(const ContactSystem& system, Mat3* own);

// Solves a x = b for a symmetric positive definite a.
Vec3 solve3(const Mat3& a, Vec3 b);

// The numbers of constraint p's rows in an array over all rows; zero where it has no row.
Vec3 gather(const ContactSystem& system, const double* numbers, std::int32_t p);

// The limits on the reactions of constraint p, its own one among them; infinite where there are none. Of the tangential force of a contact with friction the
// smaller one of both rows counts.
Vec3 most_of(const ContactSystem& system, std::int32_t p);

// The largest tangential force of a contact with friction whose normal force is `normal`.
double most_friction(const ContactConstraint& constraint, double normal, Vec3 most);

// The reaction with its size cut to the limits, rows or tangential force.
Vec3 within_limits(const ContactConstraint& constraint, Vec3 r, Vec3 most);

// True where no contact pulls that may not, and no tangential force exceeds its friction.
bool obeys_laws(const ContactSystem& system, const double* reaction);

// One sweep of projected block Gauss-Seidel over reaction ([rows_end] N). It solves each constraint exactly with the reactions of
// all others held: a sticking one by its 3 x 3 system; a normal force that may not pull is cut at zero; a contact that would
// exceed its friction slips, with r_t = -mu r_n w_t / |w_t|, where w_t is the slip of the anchor past the tool; a reaction that would
// exceed its limit stays there. Returns the largest change of a reaction times its row's own compliance, m.
double sweep_contacts(const ContactSystem& system, double* reaction);

// product = (H W H^T + soft) r, [rows_end] m. Zero for rows that are not in use.
void find_product(const ContactSystem& system, const double* reaction, double* product);
// ahead = (H W H^T + soft) r - d, [rows_end] m: by how much the surface is ahead of the tools. Zero for rows that are not in use.
void find_ahead(const ContactSystem& system, const double* reaction, double* ahead);

// Multiply-adds of the three. A constraint's own 3 x 3 problem takes as long as hundreds of multiply-adds of long rows.
std::int64_t operations_of_sweep(const ContactSystem& system);
std::int64_t operations_of_product(const ContactSystem& system);

// m, by how much the laws miss constraint p; zero in all rows exactly where its law holds. A held row: by its displacement. A
// normal row that may release: by the smaller of its gap and its push. Friction: by the change that one step of the projection
// onto the forces that friction allows would make.
// own: own_compliance(); r, ahead: of its rows.
// most: limits on its reactions. A reaction at its limit misses nothing by what would make it larger.
Vec3 missed_by_law(const ContactConstraint& constraint, const Mat3& own, Vec3 r, Vec3 ahead, Vec3 most);

// By how much the laws are missed, where ahead belongs to the reactions.
ContactResidual law_residual(const ContactSystem& system, const double* reaction, const double* ahead);

// m, by how much the rows of constraint p miss their targets: achieved minus target, without the soft part.
Vec3 missed(const ContactSystem& system, const double* reaction, std::int32_t p);

}  // namespace palpate
