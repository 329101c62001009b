// Effects as words and numbers -> palpate_scene_def in the module's memory; a pose as numbers -> palpate_pose.
import { ARGUMENT, PalpateError } from "./heap.js";
import { nameOf, reader, writer } from "./struct.js";
/** @import { Runtime, Effects, RenderMesh, FineSurface, Pose } from "./palpate.js" */

const CHOICE = 0, POINTER = 4; // of palpate_key_type
const MAX_RELAXATION_TERMS = 8;

/** @typedef {{at: number, words: string, offset: number, type: number}} Key  A field of palpate_scene_def; at: of its palpate_key. */
/** The keys of palpate_scene_def by their names in JavaScript. @param {Runtime} runtime @returns {Map<string, Key>} */
export function readKeys(runtime) {
  const { api, heap } = runtime, from = (/** @type {number} */ at) => reader(runtime, "palpate_key", at);
  const ats = runtime.list((k) => api.palpate_scene_key(k), (at) => at);
  return new Map(ats.map((at) => [nameOf(heap.text(from(at).unsigned("name"))),
    { at, words: heap.text(from(at).unsigned("words")), offset: from(at).integer("offset"), type: from(at).integer("type") }]));
}

/** A palpate_scene_def in the module's memory, with the meshes that it lends. Release it when the scene is made. */
export class SceneDef {
  /** @type {number[]} */
  #lent = [];

  /** @param {Runtime} runtime @param {Effects} effects */
  constructor(runtime, effects) {
    this.runtime = runtime;
    this.effects = effects;
    this.at = runtime.heap.take(runtime.field("palpate_scene_def"));
    try {
      runtime.api.palpate_init_scene_def(this.at, runtime.field("palpate_scene_def"));
      fillSceneDef(runtime, this.at, effects);
      if (effects.renderMesh) this.#lent.push(lendRenderMesh(runtime, this.at, effects.renderMesh));
      if (effects.fineSurface) this.#lent.push(lendFineSurface(runtime, this.at, effects.fineSurface));
    } catch (error) {
      this.release();
      throw error;
    }
  }

  /** A whole number of the definition, defaults included. @param {string} name in JavaScript */
  integer(name) {
    return this.runtime.heap.i32(this.at + keyOf(this.runtime, name).offset);
  }

  release() {
    for (const at of [this.at, ...this.#lent]) this.runtime.heap.release(at);
  }
}

/** @param {Runtime} runtime @param {string} name in JavaScript @returns {Key} */
const keyOf = (runtime, name) => /** @type {Key} */ (runtime.keys.get(name));

/** @param {Runtime} runtime @param {number} def @param {Effects} effects */
function fillSceneDef(runtime, def, effects) {
  for (const [name, { at, type, words }] of runtime.keys) {
    const value = /** @type {Record<string, any>} */ (effects)[name];
    if (value === undefined || type === POINTER) continue;
    const isWord = type === CHOICE && typeof value !== "boolean", index = words.split(", ").indexOf(value);
    if (isWord && index < 0) throw new PalpateError(ARGUMENT, `${name}: expected ${words}, found ${value}`);
    runtime.api.palpate_set_key(at, def, isWord ? index : Number(value));
  }
  fillRelaxation(runtime, def, effects.relaxation ?? []);
}

/** @param {Runtime} runtime @param {number} def @param {{share: number, time: number}[]} terms */
function fillRelaxation(runtime, def, terms) {
  if (terms.length > MAX_RELAXATION_TERMS)
    throw new PalpateError(ARGUMENT, `relaxation: expected at most ${MAX_RELAXATION_TERMS} terms, found ${terms.length}`);
  const { data } = runtime.heap, at = (/** @type {string} */ name) => def + keyOf(runtime, `relaxation.${name}`).offset;
  data.setInt32(at("model"), terms.length ? 1 : 0, true);
  data.setInt32(at("terms"), terms.length, true);
  terms.forEach(({ share, time }, i) => {
    data.setFloat64(at("share") + 8 * i, share, true);
    data.setFloat64(at("time") + 8 * i, time, true);
  });
}

/** @param {Runtime} runtime @param {number} at @param {Pose} pose */
export function fillPose(runtime, at, { position, orientation, velocity, angularVelocity }) {
  const put = writer(runtime, "palpate_pose", at);
  runtime.api.palpate_init_pose(at, runtime.field("palpate_pose"));
  for (const [name, numbers, count] of /** @type {const} */ ([["position", position, 3], ["orientation", orientation, 4], ["velocity", velocity, 3], ["angular_velocity", angularVelocity, 3]]))
    if (numbers) put.numbers(name, numbers, count);
}

// Copies two arrays and a struct that names them into the module's memory, for palpate_scene_create. Returns the memory, which the caller
// then releases.
/** @param {Runtime} runtime @param {number} def @param {"render_mesh" | "fine_surface"} effect @param {Float32Array} positions
 *  @param {string} name of the second array @param {Float32Array | Int32Array | undefined} second @param {Record<string, number>} counts */
function lend(runtime, def, effect, positions, name, second, counts) {
  const { heap } = runtime, struct = `palpate_${effect}`, size = runtime.field(struct);
  const at = heap.take(size + 24 + 4 * (positions.length + (second?.length ?? 0))), first = (at + size + 15) & ~15, next = first + 4 * positions.length;
  new Float32Array(heap.buffer, first, positions.length).set(positions);
  if (second) new (second instanceof Int32Array ? Int32Array : Float32Array)(heap.buffer, next, second.length).set(second);
  const put = writer(runtime, struct, at);
  runtime.api[`palpate_init_${effect}`](at, size);
  put.address("positions", first);
  put.address(name, second ? next : 0);
  for (const [count, value] of Object.entries(counts)) put.integer(count, value);
  heap.data.setUint32(def + keyOf(runtime, nameOf(effect)).offset, at, true);
  return at;
}

/** @param {Runtime} runtime @param {number} def @param {RenderMesh} mesh @returns {number} */
function lendRenderMesh(runtime, def, { positions, normals }) {
  if (positions.length % 3 || (normals && normals.length !== positions.length))
    throw new PalpateError(ARGUMENT, `renderMesh: expected three numbers a vertex and as many in normals, found ${positions.length} and ${normals?.length}`);
  return lend(runtime, def, "render_mesh", positions, "normals", normals, { vertex_count: positions.length / 3 });
}

/** @param {Runtime} runtime @param {number} def @param {FineSurface} surface @returns {number} */
function lendFineSurface(runtime, def, { positions, triangles }) {
  if (positions.length % 3 || triangles.length % 3)
    throw new PalpateError(ARGUMENT, `fineSurface: expected three numbers a vertex and three a triangle, found ${positions.length} and ${triangles.length}`);
  return lend(runtime, def, "fine_surface", positions, "triangles", Int32Array.from(triangles), { vertex_count: positions.length / 3, triangle_count: triangles.length / 3 });
}
