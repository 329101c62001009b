#include "precompute/solver/batch_vector.h"

#include <petsc/private/vecimpl.h>

#include <algorithm>
#include <cmath>
#include <new>
#include <numeric>

#include "precompute/elements/column_buffer.h"
#include "precompute/solver/petsc_session.h"

namespace palpate {
namespace {

constexpr const char* kRecordName = "palpate_batch_record";

enum class Content { numbers, zero, loads, product, residual };

// What a batch vector is recorded as. A vector that is recorded as K x or b - K x names x as its source, and x names it as its
// dependent; a vector has at most one dependent.
struct Record {
  BatchSpace& space;
  _VecOps sequential;  // VECSEQ's operations
  Content content = Content::zero;
  std::vector<Load> loads = {};
  Vec source = nullptr, dependent = nullptr;
  ColumnBuffer memory = nullptr;

  explicit Record(BatchSpace& s, const _VecOps& ops) : space(s), sequential(ops) {}
};

Record* record_of(Vec vector) {
  PetscObject container = nullptr;
  void* record = nullptr;
  if (PetscObjectQuery(reinterpret_cast<PetscObject>(vector), kRecordName, &container) || !container) return nullptr;
  PetscContainerGetPointer(reinterpret_cast<PetscContainer>(container), &record);
  return static_cast<Record*>(record);
}

double*& array_of(Vec vector) {
  return *static_cast<double**>(vector->data);  // VECSEQ's data begins with it
}

void separate_from_source(Record& r) {
  if (r.source) record_of(r.source)->dependent = nullptr;
  r.source = nullptr;
}

void add_loads(const std::vector<Load>& loads, double sign, int width, double* values) {
  for (const Load& load : loads) values[load.dof * width + load.column] += sign * load.value;
}

double* memory_of(Vec vector, Record& r) {
  double*& values = array_of(vector);
  if (values) return values;
  r.memory = make_column_buffer(r.space.dofs(), r.space.width);
  return values = r.memory.get();
}

// Writes the numbers of a vector that is only recorded as something.
void compute(Vec vector, Record& r) {
  if (r.content == Content::numbers) return;
  const std::int64_t size = r.space.dofs() * r.space.width;
  double* values = memory_of(vector, r);
  if (r.content == Content::zero || r.content == Content::loads) std::fill_n(values, size, 0.0);
  if (r.content == Content::loads) add_loads(r.loads, 1, r.space.width, values);
  if (r.content == Content::product || r.content == Content::residual) {
    Record& x = *record_of(r.source);
    compute(r.source, x);
    multiply_batch(r.space.matrix, array_of(r.source), values, r.space.width);
    if (r.content == Content::residual) {
      for (std::int64_t i = 0; i < size; ++i) values[i] = -values[i];
      add_loads(r.loads, 1, r.space.width, values);
    }
    separate_from_source(r);
  }
  r.content = Content::numbers;
}

// To be called before the vector changes: a product that was recorded from it must be computed from its old numbers.
void begin_change(Record& r) {
  if (r.dependent) compute(r.dependent, *record_of(r.dependent));
  separate_from_source(r);
}

template <class Work>
PetscErrorCode guarded(const Work& work) {  // no exception may pass through PETSc's C code
  try {
    work();
  } catch (const std::bad_alloc&) {
    return PetscError(PETSC_COMM_SELF, __LINE__, "batch_vector", __FILE__, PETSC_ERR_MEM, PETSC_ERROR_INITIAL,
                      "out of memory for a batch of columns");
  }
  return 0;
}

PetscErrorCode get_array(Vec vector, PetscScalar** values) {
  return guarded([&] {
    Record& r = *record_of(vector);
    if (r.dependent) compute(r.dependent, *record_of(r.dependent));
    compute(vector, r);
    *values = array_of(vector);
  });
}
PetscErrorCode get_array_read(Vec vector, const PetscScalar** values) {
  return guarded([&] {
    compute(vector, *record_of(vector));
    *values = array_of(vector);
  });
}
PetscErrorCode get_array_write(Vec vector, PetscScalar** values) {
  return guarded([&] {
    Record& r = *record_of(vector);
    begin_change(r);
    *values = memory_of(vector, r);
    r.content = Content::numbers;
  });
}
PetscErrorCode restore_array(Vec, PetscScalar**) {
  return 0;
}
PetscErrorCode restore_array_read(Vec, const PetscScalar**) {
  return 0;
}

PetscErrorCode set(Vec vector, PetscScalar value) {
  Record& r = *record_of(vector);
  if (value != 0) return r.sequential.set(vector, value);
  return guarded([&] {
    begin_change(r);
    r.content = Content::zero;
  });
}

PetscErrorCode copy(Vec from, Vec to) {
  Record &x = *record_of(from), &y = *record_of(to);
  if (x.content != Content::zero && x.content != Content::loads) return x.sequential.copy(from, to);
  return guarded([&] {
    begin_change(y);
    y.loads = x.loads;
    y.content = x.content;
  });
}

// y = x + alpha y. For alpha = -1, y recorded as K x and x as loads, the result is recorded as b - K x.
PetscErrorCode aypx(Vec y, PetscScalar alpha, Vec x) {
  Record &to = *record_of(y), &from = *record_of(x);
  if (alpha != -1 || to.content != Content::product || from.content != Content::loads)
    return to.sequential.aypx(y, alpha, x);
  to.loads = from.loads;
  to.content = Content::residual;
  return 0;
}

std::vector<double> norms_of(Vec vector, Record& r) {
  if (r.content == Content::residual) return residual_norms(r.space.matrix, r.loads, array_of(r.source), r.space.width);
  if (r.content == Content::product) return residual_norms(r.space.matrix, {}, array_of(r.source), r.space.width);
  if (r.content == Content::numbers) return column_norms(array_of(vector), r.space.dofs(), r.space.width);
  std::vector<double> sum(static_cast<std::size_t>(r.space.width), 0.0);
  if (r.content == Content::loads)
    for (const Load& load : r.loads)
      sum[load.column] += load.value * load.value;  // at most one load for each dof and column
  for (double& s : sum) s = std::sqrt(s);
  return sum;
}

PetscErrorCode norm(Vec vector, NormType type, PetscReal* result) {
  Record& r = *record_of(vector);
  if (type != NORM_2 && type != NORM_FROBENIUS) return r.sequential.norm(vector, type, result);
  return guarded([&] {
    if (r.source) compute(r.source, *record_of(r.source));
    r.space.norms = norms_of(vector, r);
    r.space.norm =
        std::sqrt(std::inner_product(r.space.norms.begin(), r.space.norms.end(), r.space.norms.begin(), 0.0));
    *result = r.space.norm;
  });
}

PetscErrorCode duplicate(Vec vector, Vec* result) {
  return guarded([&] { *result = create_batch_vector(record_of(vector)->space); });
}

PetscErrorCode destroy(Vec vector) {
  Record& r = *record_of(vector);
  if (r.dependent) {
    Record& dependent = *record_of(r.dependent);
    dependent.source = nullptr;
    dependent.content = Content::zero;  // x ends before anybody has read K x
  }
  separate_from_source(r);
  return r.sequential.destroy(vector);
}

PetscErrorCode delete_record(void* record) {
  delete static_cast<Record*>(record);
  return 0;
}

void replace_operations(_VecOps& ops) {
  ops.getarray = get_array;
  ops.getarrayread = get_array_read;
  ops.getarraywrite = get_array_write;
  ops.restorearray = restore_array;
  ops.restorearrayread = restore_array_read;
  ops.restorearraywrite = restore_array;
  ops.set = set;
  ops.copy = copy;
  ops.aypx = aypx;
  ops.norm = norm;
  ops.norm_local = nullptr;
  ops.duplicate = duplicate;
  ops.destroy = destroy;
}

void changed(Vec vector) {  // PETSc keeps the norms of a vector until it is told that the vector has changed
  check(PetscObjectStateIncrease(reinterpret_cast<PetscObject>(vector)));
}

}  // namespace

Vec create_batch_vector(BatchSpace& space) {
  Vec vector = nullptr;
  PetscContainer container = nullptr;
  check(VecCreateSeqWithArray(PETSC_COMM_SELF, 1, static_cast<PetscInt>(space.dofs() * space.width), nullptr, &vector));
  check(PetscContainerCreate(PETSC_COMM_SELF, &container));
  check(PetscContainerSetPointer(container, new Record(space, *vector->ops)));
  check(PetscContainerSetUserDestroy(container, delete_record));
  check(
      PetscObjectCompose(reinterpret_cast<PetscObject>(vector), kRecordName, reinterpret_cast<PetscObject>(container)));
  check(PetscContainerDestroy(&container));
  replace_operations(*vector->ops);
  vector->petscnative = PETSC_FALSE;  // else PETSc reads the array without calling getarray
  return vector;
}

void hold_loads(Vec b, std::span<const Load> loads) {
  Record& r = *record_of(b);
  begin_change(r);
  r.loads.assign(loads.begin(), loads.end());
  r.content = Content::loads;
  changed(b);
}

const std::vector<Load>* loads_of(Vec vector) {
  const Record* r = record_of(vector);
  return r && r->content == Content::loads ? &r->loads : nullptr;
}

PetscErrorCode hold_product(Vec product, Vec x) {
  return guarded([&] {
    Record &y = *record_of(product), &from = *record_of(x);
    begin_change(y);
    if (from.dependent) compute(from.dependent, *record_of(from.dependent));
    from.dependent = product;
    y.source = x;
    y.content = Content::product;
    changed(product);
  });
}

void forget_products_of(Vec x) {
  Record& from = *record_of(x);
  if (!from.dependent) return;
  Record& product = *record_of(from.dependent);
  product.content = Content::zero;
  changed(from.dependent);
  separate_from_source(product);
}

}  // namespace palpate
