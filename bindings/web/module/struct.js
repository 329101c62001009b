// Reads and writes the fields of a struct in the module's memory, by their names in palpate.h.
import { ARGUMENT, PalpateError } from "./heap.js";
/** @import { Runtime } from "./palpate.js" */
/** @typedef {{integer?: string[], unsigned?: string[], whole?: string[], number?: string[], vector?: string[]}} Fields  Names of fields by their kind. */

/** @type {Map<string, string>} */
const NAMES = new Map();
/** The name in JavaScript of a field: of rest_length restLength. @param {string} field @returns {string} */
export function nameOf(field) {
  let name = NAMES.get(field);
  if (name === undefined) NAMES.set(field, (name = field.replace(/_(\w)/g, (_, letter) => letter.toUpperCase())));
  return name;
}

/** @param {Runtime} runtime @param {string} struct @param {number} at */
export function reader(runtime, struct, at) {
  const { data } = runtime.heap, where = (/** @type {string} */ field) => at + runtime.field(`${struct}.${field}`);
  const read = {
    integer: (/** @type {string} */ field, i = 0) => data.getInt32(where(field) + 4 * i, true),
    unsigned: (/** @type {string} */ field) => data.getUint32(where(field), true),
    /** A count or an offset, exact up to 2^53. */
    whole: (/** @type {string} */ field) => Number(data.getBigUint64(where(field), true)),
    number: (/** @type {string} */ field) => data.getFloat64(where(field), true),
    vector: (/** @type {string} */ field, first = 0) => [0, 1, 2].map((d) => data.getFloat64(where(field) + 8 * (first + d), true)),
    /** An object of these fields. @param {Fields} fields @returns {any} */
    all(fields) {
      /** @type {Record<string, any>} */
      const found = {};
      for (const [kind, names] of Object.entries(fields)) for (const name of names) found[nameOf(name)] = read[/** @type {keyof Fields} */ (kind)](name);
      return found;
    },
  };
  return read;
}

/** A number that is left out keeps its default. @param {Runtime} runtime @param {string} struct @param {number} at */
export function writer(runtime, struct, at) {
  const where = (/** @type {string} */ field) => at + runtime.field(`${struct}.${field}`);
  const put = {
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
    /** These fields of an object that has them. @param {Record<string, any>} from @param {{integer?: string[], number?: string[]}} fields */
    all(from, { integer = [], number = [] }) {
      for (const name of integer) put.integer(name, from[nameOf(name)]);
      for (const name of number) put.number(name, from[nameOf(name)]);
    },
  };
  return put;
}
