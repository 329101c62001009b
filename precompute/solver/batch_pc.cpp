#include "precompute/solver/batch_pc.h"

#include <fmt/format.h>
#include <petsc/private/pcimpl.h>

#include <memory>
#include <utility>

#include "formats/errors.h"
#include "precompute/solver/batch_multigrid.h"
#include "precompute/solver/column_operator.h"
#include "precompute/solver/elimination.h"
#include "precompute/solver/per_column_pc.h"
#include "precompute/solver/petsc_session.h"
#include "precompute/solver/supernodal_factor.h"

namespace palpate {
namespace {

using Made = std::unique_ptr<BatchPreconditioner>;
using Maker = Made (*)(const ColumnOperator& op);

// What pc->data points to in a PC of our types.
struct Data {
  Maker make;
  Made made = nullptr;
};

Data& data_of(PC pc) {
  return *static_cast<Data*>(pc->data);
}

const WholeMatrix& whole_of(const ColumnOperator& op, const char* type) {
  if (!op.whole())
    throw InputError(fmt::format(
        "-column_pc_type {}: it needs the whole operator on each rank, and here a group of ranks divides it; use "
        "\"cholesky\" or \"gamg\", or --ranks-per-operator 1",
        type));
  return *op.whole();
}

template <class Number, int kBlock>
Made make_factor(const BlockMatrixOf<kBlock>& matrix, const WholeMatrix& k, int width) {
  return std::make_unique<SupernodalFactorOf<Number, kBlock>>(
      matrix, k.elimination ? k.elimination : std::make_shared<const Elimination>(analyse_elimination(matrix)), width,
      RowNames{k.node_of_row, k.coordinates}, k.machine);
}

template <class Number>
Made make_supernodal(const ColumnOperator& op) {
  const WholeMatrix& k = whole_of(op, sizeof(Number) == sizeof(float) ? kPcSingle : kPcSupernodal);
  return k.form ? make_factor<Number>(*k.form, k, op.width()) : make_factor<Number>(k.matrix, k, op.width());
}

Made make_multigrid(const ColumnOperator& op) {
  const WholeMatrix& k = whole_of(op, kPcMultigrid);
  return std::make_unique<BatchMultigrid>(k.matrix, k.coordinates, op.width());
}

// No exception may pass through PETSc's C code. So the operator keeps it, and the function that called PETSc throws it again.
template <class Work>
PetscErrorCode carried(PC pc, const Work& work) {
  ColumnOperator* op = operator_of(pc->pmat);
  if (!op)
    SETERRQ(PetscObjectComm(reinterpret_cast<PetscObject>(pc)), PETSC_ERR_SUP,
            "this preconditioner works on batches of columns (K (x) I) only");
  try {
    work(*op);
  } catch (...) {
    op->thrown = std::current_exception();
    return PETSC_ERR_LIB;
  }
  return 0;
}

PetscErrorCode set_up(PC pc) {
  return carried(pc, [&](ColumnOperator& op) { data_of(pc).made = data_of(pc).make(op); });
}

void clear_finished(const ColumnOperator& op, double* z) {
  const int width = op.width();
  for (int c = 0; c < width && c < static_cast<int>(op.finished.size()); ++c)
    if (op.finished[c])
      for (std::int64_t i = 0; i < op.own_dofs(); ++i) z[i * width + c] = 0;
}

PetscErrorCode apply(PC pc, Vec in, Vec out) {
  return carried(pc, [&](ColumnOperator& op) {
    BatchPreconditioner& m = *data_of(pc).made;
    PetscScalar* z = nullptr;
    check(VecGetArrayWrite(out, &z));
    const std::vector<Load>* loads = op.loads_of(in);
    if (!loads || !m.apply_to_loads(*loads, z)) {
      const PetscScalar* r = nullptr;
      check(VecGetArrayRead(in, &r));
      m.apply(r, z);
      check(VecRestoreArrayRead(in, &r));
    }
    clear_finished(op, z);
    check(VecRestoreArrayWrite(out, &z));
  });
}

PetscErrorCode view(PC pc, PetscViewer viewer) {
  PetscBool ascii = PETSC_FALSE;
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(viewer), PETSCVIEWERASCII, &ascii));
  const Data& data = data_of(pc);
  if (ascii && data.made) PetscCall(PetscViewerASCIIPrintf(viewer, "  %s\n", data.made->description().c_str()));
  return data.made ? view_inner_pc(*data.made, viewer) : 0;
}

PetscErrorCode reset(PC pc) {
  data_of(pc).made.reset();
  return 0;
}

PetscErrorCode destroy(PC pc) {
  delete &data_of(pc);
  pc->data = nullptr;
  return 0;
}

template <Maker make>
PetscErrorCode create(PC pc) {
  pc->data = new Data{make};
  pc->ops->setup = set_up;
  pc->ops->apply = apply;
  pc->ops->view = view;
  pc->ops->reset = reset;
  pc->ops->destroy = destroy;
  return 0;
}

bool is_ours(const std::string& type) {
  return type == kPcSupernodal || type == kPcSingle || type == kPcMultigrid;
}

}  // namespace

void register_batch_pcs() {
  check(PCRegister(kPcSupernodal, create<make_supernodal<double>>));
  check(PCRegister(kPcSingle, create<make_supernodal<float>>));
  check(PCRegister(kPcMultigrid, create<make_multigrid>));
  check(PCRegister(kPcPerColumn, create<make_per_column_pc>));
}

void set_batch_pc_type(PC pc, const std::string& type) {
  const std::string chosen = petsc_option_or("-column_pc_type", type.c_str());
  // The inner PC of kPcPerColumn has the prefix column_ itself.
  check(PCSetOptionsPrefix(pc, is_ours(chosen) ? "column_" : "batch_"));
  Mat k = nullptr;
  check(PCGetOperators(pc, nullptr, &k));
  operator_of(k)->per_column_type = chosen;
  check(PCSetType(pc, is_ours(chosen) ? chosen.c_str() : kPcPerColumn));
}

bool is_batch_pc(PC pc) {
  return pc->ops->apply == apply;
}

BatchPreconditioner& batch_preconditioner_of(PC pc) {
  return *data_of(pc).made;
}

}  // namespace palpate
