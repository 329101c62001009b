// Where the deformed surface crosses itself (palpate_crossings_out and its palpate_crossing), in the module's memory.
import { reader, writer } from "./struct.js";
/** @import { Runtime } from "./palpate.js" */
/** @typedef {{triangle: number[], place: number[], rest: number[][]}} Crossing  Two triangles that cross, as palpate_crossing: where they do now
 *  and where that is of each at rest, m. */

// Of how many crossings the places are told, at most.
const CAPACITY = 16;

export class Crossings {
  #at = 0;

  /** @param {Runtime} runtime */
  constructor(runtime) {
    const { api, heap } = runtime, bytes = (runtime.field("palpate_crossings_out") + 15) & ~15;
    this.runtime = runtime;
    this.#at = heap.takeZeros(bytes + CAPACITY * runtime.field("palpate_crossing"));
    api.palpate_init_crossings_out(this.#at, runtime.field("palpate_crossings_out"));
    const put = writer(runtime, "palpate_crossings_out", this.#at);
    put.integer("capacity", CAPACITY);
    put.address("crossings", this.#at + bytes);
  }

  /** The address of the palpate_crossings_out. */
  get at() {
    return this.#at;
  }
  /** checks that have come to their end; pairs of triangles that cross in the last one, and the places of the first of them
   *  @returns {{checks: number, pairs: number, places: Crossing[]}} */
  get found() {
    const { runtime } = this, out = reader(runtime, "palpate_crossings_out", this.#at), size = runtime.field("palpate_crossing");
    const first = runtime.heap.u32(this.#at + runtime.field("palpate_crossings_out.crossings"));
    return {
      checks: out.whole("checks"), pairs: out.integer("pairs"),
      places: Array.from({ length: out.integer("count") }, (_, i) => {
        const one = reader(runtime, "palpate_crossing", first + i * size);
        return { triangle: [one.integer("triangle"), one.integer("triangle", 1)], place: one.vector("place"), rest: [one.vector("rest"), one.vector("rest", 3)] };
      }),
    };
  }
  release() {
    this.runtime.heap.release(this.#at);
    this.#at = 0;
  }
}
