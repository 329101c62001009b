// PETSc preconditioner (PC) types for K (x) I: `-column_pc_type supernodal | supernodal_single | multigrid`, and any PETSc type for K.
#pragma once

#include <petscksp.h>

#include <string>

#include "precompute/solver/batch_preconditioner.h"

namespace palpate {

inline constexpr const char* kPcSupernodal = "supernodal";     // our factor (SupernodalFactorOf)
inline constexpr const char* kPcSingle = "supernodal_single";  // the same in single precision
inline constexpr const char* kPcMultigrid = "multigrid";       // our multigrid (BatchMultigrid)
inline constexpr const char* kPcPerColumn = "percolumn";       // a PETSc PC of K, for one column after another

// Registers them with PETSc; once, after PetscInitialize.
void register_batch_pcs();

// Gives pc its type: the user's -column_pc_type, else the given one. A PETSc type becomes the inner PC of kPcPerColumn. The
// operators of pc must be set, to the batch_matrix() of a ColumnOperator.
void set_batch_pc_type(PC pc, const std::string& type);

// Whether pc has one of these types, and what it applies, once it is set up.
bool is_batch_pc(PC pc);
BatchPreconditioner& batch_preconditioner_of(PC pc);

}  // namespace palpate
