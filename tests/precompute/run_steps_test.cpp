// The steps of palpate-precompute that need no whole run. PetscSession, in support.h, starts MPI.
#include <mpi.h>

#include "precompute/run/solve_columns.h"
#include "tests/precompute/support.h"

#undef MPI_Allreduce  // a macro of PETSc, around the function

namespace {

MPI_Datatype last_type = MPI_DATATYPE_NULL;  // of the last call of MPI_Allreduce in this program

}  // namespace

// In the place of the library's, which it calls.
extern "C" int MPI_Allreduce(const void* from, void* to, int count, MPI_Datatype type, MPI_Op op, MPI_Comm ranks) {
  last_type = type;
  return PMPI_Allreduce(from, to, count, type, op, ranks);
}

namespace palpate::tests {
namespace {

// The MPI standard defines MPI_MAX for integers and floating-point numbers; MPI_CHAR is for text (MPI 4.0, 6.9.2). Open
// MPI takes it all the same, others refuse it.
TEST(RunSteps, RanksAgreeOnSafeBatchesByAnIntegerType) {
  Ranks ranks(MPI_COMM_WORLD);
  EXPECT_EQ(agree_on_safe_batches({1, 0, 1}, ranks), (SafeBatches{1, 0, 1}));
  EXPECT_NE(last_type, MPI_CHAR);
  EXPECT_EQ(last_type, MPI_UINT8_T);
}

}  // namespace
}  // namespace palpate::tests
