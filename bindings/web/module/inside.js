// Strain and stress inside an organ (palpate_inside_out) and places of its tissue (palpate_inside_place) in the module's memory.
import { reader, writer } from "./struct.js";
/** @import { Runtime } from "./palpate.js" */
/** @typedef {{tetrahedron: number, weight: number[], distance: number}} Place  A point of the tissue, as palpate_inside_place: its tetrahedron,
 *  -1 where none is as near as was asked; its weights of the four nodes; m, its distance from the tetrahedron. */

// Numbers of a row of each array.
const WIDTHS = /** @type {const} */ ({ displacements: 3, strains: 6, stresses: 6, pressures: 1, von_mises: 1, principal: 3 });
/** @typedef {keyof typeof WIDTHS} Measure */
const ALL = /** @type {Measure[]} */ (Object.keys(WIDTHS));

/** Strain and stress of rows, which are nodes or places: views of the module's memory. Tensors are xx yy zz xy yz xz along the axes of
 *  the organ's frame. */
export class Measures {
  #at = 0;
  /** @type {Record<string, number>} */
  #first = {};

  /** @param {Runtime} runtime @param {number} rows @param {readonly Measure[]} measures those that are filled */
  constructor(runtime, rows, measures = ALL) {
    const { api, heap } = runtime, size = (runtime.field("palpate_inside_out") + 15) & ~15;
    this.runtime = runtime;
    this.rows = rows;
    let bytes = size;
    for (const measure of measures) bytes += 4 * WIDTHS[measure] * rows;
    this.#at = heap.takeZeros(bytes);
    api.palpate_init_inside_out(this.#at, runtime.field("palpate_inside_out"));
    const put = writer(runtime, "palpate_inside_out", this.#at);
    put.integer("capacity", rows);
    let at = this.#at + size;
    for (const measure of measures) {
      put.address(measure, at);
      this.#first[measure] = at;
      at += 4 * WIDTHS[measure] * rows;
    }
  }

  /** The address of the palpate_inside_out. */
  get at() {
    return this.#at;
  }
  /** view [rows][3] m from rest */
  get displacements() {
    return this.#view("displacements");
  }
  /** view [rows][6] without unit */
  get strains() {
    return this.#view("strains");
  }
  /** view [rows][6] Pa */
  get stresses() {
    return this.#view("stresses");
  }
  /** view [rows] Pa, above 0 under compression */
  get pressures() {
    return this.#view("pressures");
  }
  /** view [rows] Pa */
  get vonMises() {
    return this.#view("von_mises");
  }
  /** view [rows][3] Pa, the principal stresses, largest first */
  get principal() {
    return this.#view("principal");
  }
  /** @param {Measure} measure */
  #view(measure) {
    const first = this.#first[measure];
    return new Float32Array(this.runtime.heap.buffer, first ?? 0, first === undefined ? 0 : WIDTHS[measure] * this.rows);
  }

  release() {
    this.runtime.heap.release(this.#at);
  }
}

/** Places that Scene.locate has found, and what Scene.insideAt and Scene.carry say of them. They fit all scenes on the bundle; release()
 *  gives their memory back. */
export class Places {
  #positionsAt = 0;

  /** @param {Runtime} runtime @param {number} count */
  constructor(runtime, count) {
    const size = runtime.field("palpate_inside_place");
    this.runtime = runtime;
    this.count = count;
    /** the address of the palpate_inside_place */
    this.at = runtime.heap.takeZeros((size + 12) * count + 16);
    this.#positionsAt = this.at + size * count;
    /** how many have no tetrahedron */
    this.missing = 0;
    this.measures = new Measures(runtime, count);
  }

  /** Of one of them: a copy. @param {number} i @returns {Place} */
  place(i) {
    const read = reader(this.runtime, "palpate_inside_place", this.at + i * this.runtime.field("palpate_inside_place"));
    return { tetrahedron: read.integer("tetrahedron"), weight: [...read.vector("weight"), read.vector("weight", 1)[2]], distance: read.number("distance") };
  }
  /** view [count][3] m, of the last Scene.carry */
  get positions() {
    return new Float32Array(this.runtime.heap.buffer, this.#positionsAt, 3 * this.count);
  }

  release() {
    this.measures.release();
    this.runtime.heap.release(this.at);
  }
}
