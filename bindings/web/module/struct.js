// Reads and writes the fields of a struct in the module's memory, by their names in palpate.h.
import { ARGUMENT, PalpateError } from "./heap.js";
/** @typedef {import("./palpate.js").Runtime} Runtime */

/** @param {Runtime} runtime @param {string} struct @param {number} at */
export function reader(runtime, struct, at) {
  const { data } = runtime.heap, where = (/** @type {string} */ field) => at + runtime.field(`${struct}.${field}`);
  return {
    integer: (/** @type {string} */ field, i = 0) => data.getInt32(where(field) + 4 * i, true),
    unsigned: (/** @type {string} */ field) => data.getUint32(where(field), true),
    /** A count or an offset, exact up to 2^53. */
    whole: (/** @type {string} */ field) => Number(data.getBigUint64(where(field), true)),
    number: (/** @type {string} */ field) => data.getFloat64(where(field), true),
    vector: (/** @type {string} */ field, first = 0) => [0, 1, 2].map((d) => data.getFloat64(where(field) + 8 * (first + d), true)),
  };
}

/** A number that is left out keeps its default. @param {Runtime} runtime @param {string} struct @param {number} at */
export function writer(runtime, struct, at) {
  const where = (/** @type {string} */ field) => at + runtime.field(`${struct}.${field}`);
  return {
    address: (/** @type {string} */ field, /** @type {number} */ value) => runtime.heap.data.setUint32(where(field), value, true),
    integer: (/** @type {string} */ field, /** @type {number | undefined} */ value, i = 0) => {
      if (value !== undefined) runtime.heap.data.setInt32(where(field) + 4 * i, value, true);
    },
    number: (/** @type {string} */ field, /** @type {number | undefined} */ value) => {
      if (value !== undefined) runtime.heap.data.setFloat64(where(field), value, true);
    },
    numbers: (/** @type {string} */ field, /** @type {ArrayLike<number> | undefined} */ values, /** @type {number} */ count) => {
      if (values?.length !== count) throw new PalpateError(ARGUMENT, `${field}: expected ${count} numbers, found ${values?.length}`);
      for (let i = 0; i < count; ++i) runtime.heap.data.setFloat64(where(field) + 8 * i, values[i], true);
    },
  };
}
