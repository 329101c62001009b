// Effects as words and numbers -> palpate_scene_def in the module's memory; a pose as numbers -> palpate_pose.
import { ARGUMENT, PalpateError } from "./heap.js";
import { fillObstacles } from "./obstacles.js";
import { nameOf, reader, writer } from "./struct.js";
/** @import { Runtime, Effects, RenderMesh, FineSurface, Pose } from "./palpate.js" */
/** @import { Obstacle } from "./obstacles.js" */

const CHOICE = 0, POINTER = 4; // of palpate_key_type
const MAX_RELAXATION_TERMS = 8, MAX_LOADS = 4;
// Effects whose arrays have keys of their own, by the first of these.
/** @type {Record<string, string>} */
const OF_ARRAYS = { relaxation: "relaxation.terms", loads: "loads.count", obstacles: "obstacles.count" };

/** @typedef {{at: number, words: string, type: number}} Key  A field of palpate_scene_def or of its parts; at: of its palpate_key. */
/** The keys of a definition by their names in JavaScript. @param {Runtime} runtime @returns {Map<string, Key>} */
export function readKeys(runtime) {
  const { api, heap } = runtime, from = (/** @type {number} */ at) => reader(runtime, "palpate_key", at);
  const ats = runtime.list((k) => api.palpate_scene_key(k), (at) => at);
  return new Map(ats.map((at) => [nameOf(heap.text(from(at).unsigned("name"))),
    { at, words: heap.text(from(at).unsigned("words")), type: from(at).integer("type") }]));
}

/** A palpate_scene_def with all parts in the module's memory, and the arrays that it lends. Release it when the scene is made. */
export class SceneDef {
  /** @type {number[]} */
  #taken = [];

  /** @param {Runtime} runtime @param {Effects} effects */
  constructor(runtime, effects) {
    const { api } = runtime, bytes = runtime.field("palpate_scene_def");
    this.runtime = runtime;
    this.effects = effects;
    this.at = this.#take(bytes);
    try {
      api.palpate_init_scene_def(this.at, bytes);
      api.palpate_add_all_parts(this.at, this.#take(api.palpate_all_parts_bytes()));
      this.#fill(effects);
      if (effects.relaxation) this.#fillRelaxation(effects.relaxation);
      if (effects.loads) this.#fillLoads(effects.loads);
      if (effects.obstacles?.length) this.#fillObstacles(effects.obstacles);
      if (effects.renderMesh) this.#lendRenderMesh(effects.renderMesh);
      if (effects.fineSurface) this.#lendFineSurface(effects.fineSurface);
    } catch (error) {
      this.release();
      throw error;
    }
  }

  /** A whole number of the definition, defaults included; 0 where the module does not have its effect. @param {string} name in JavaScript
   *  @returns {number} */
  integer(name) {
    return this.runtime.keys.has(name) ? this.runtime.api.palpate_key_number(this.#key(name).at, this.at) : 0;
  }

  release() {
    for (const at of this.#taken) this.runtime.heap.release(at);
  }

  /** @param {number} bytes @returns {number} */
  #take(bytes) {
    const at = this.runtime.heap.take(bytes);
    this.#taken.push(at);
    return at;
  }

  /** @param {string} name in JavaScript @returns {Key} */
  #key(name) {
    return /** @type {Key} */ (this.runtime.keys.get(name));
  }

  /** The part whose struct has that key. @param {string} name in JavaScript @returns {number} */
  #part(name) {
    const { runtime } = this, effect = reader(runtime, "palpate_key", this.#key(name).at).unsigned("effect");
    const part = (/** @type {number} */ at) => reader(runtime, "palpate_part", at);
    let at = reader(runtime, "palpate_scene_def", this.at).unsigned("parts");
    while (part(at).unsigned("effect") !== effect) at = part(at).unsigned("next");
    return at;
  }

  /** @param {Effects} effects */
  #fill(effects) {
    const absent = Object.keys(effects).find((name) => !this.runtime.keys.has(OF_ARRAYS[name] ?? name));
    if (absent) throw new PalpateError(ARGUMENT, `effects: this palpate.wasm has none of the name ${absent}`);
    for (const [name, { at, type, words }] of this.runtime.keys) {
      const value = /** @type {Record<string, any>} */ (effects)[name];
      if (value === undefined || type === POINTER) continue;
      const isWord = type === CHOICE && typeof value !== "boolean", index = words.split(", ").indexOf(value);
      if (isWord && index < 0) throw new PalpateError(ARGUMENT, `${name}: expected ${words}, found ${value}`);
      this.runtime.api.palpate_set_key(at, this.at, isWord ? index : Number(value));
    }
  }

  /** @param {{share: number, time: number}[]} terms */
  #fillRelaxation(terms) {
    if (terms.length > MAX_RELAXATION_TERMS)
      throw new PalpateError(ARGUMENT, `relaxation: expected at most ${MAX_RELAXATION_TERMS} terms, found ${terms.length}`);
    const { runtime } = this, { data } = runtime.heap, part = this.#part("relaxation.terms");
    const at = (/** @type {string} */ name) => part + runtime.field(`palpate_relaxation_def.${name}`);
    data.setInt32(at("terms"), terms.length, true);
    terms.forEach(({ share, time }, i) => {
      data.setFloat64(at("share") + 8 * i, share, true);
      data.setFloat64(at("time") + 8 * i, time, true);
    });
  }

  /** @param {{centre: ArrayLike<number>, radius: number}[]} patches */
  #fillLoads(patches) {
    if (patches.length > MAX_LOADS) throw new PalpateError(ARGUMENT, `loads: expected at most ${MAX_LOADS} patches, found ${patches.length}`);
    const { runtime } = this, { data } = runtime.heap, part = this.#part("loads.count");
    const at = (/** @type {string} */ name) => part + runtime.field(`palpate_loads_def.${name}`);
    data.setInt32(at("count"), patches.length, true);
    patches.forEach(({ centre, radius }, i) => {
      for (let d = 0; d < 3; ++d) data.setFloat64(at("centre") + 8 * (3 * i + d), centre[d], true);
      data.setFloat64(at("radius") + 8 * i, radius, true);
    });
  }

  /** @param {Obstacle[]} obstacles */
  #fillObstacles(obstacles) {
    const put = writer(this.runtime, "palpate_obstacles_def", this.#part("obstacles.count"));
    put.integer("count", obstacles.length);
    put.address("list", fillObstacles(this.runtime, obstacles, (bytes) => this.#take(bytes)));
  }

  // Copies two arrays into the module's memory and names them in a part, for palpate_scene_create.
  /** @param {"render_mesh" | "fine_surface"} effect @param {Float32Array} positions @param {string} name of the second array
   *  @param {Float32Array | Int32Array | undefined} second @param {Record<string, number>} counts */
  #lend(effect, positions, name, second, counts) {
    const { runtime } = this, { heap } = runtime;
    const first = this.#take(4 * (positions.length + (second?.length ?? 0)) + 1), next = first + 4 * positions.length;
    new Float32Array(heap.buffer, first, positions.length).set(positions);
    if (second) new (second instanceof Int32Array ? Int32Array : Float32Array)(heap.buffer, next, second.length).set(second);
    const put = writer(runtime, `palpate_${effect}`, this.#part(nameOf(effect)));
    put.address("positions", first);
    put.address(name, second ? next : 0);
    for (const [count, value] of Object.entries(counts)) put.integer(count, value);
  }

  /** @param {RenderMesh} mesh */
  #lendRenderMesh({ positions, normals }) {
    if (positions.length % 3 || (normals && normals.length !== positions.length))
      throw new PalpateError(ARGUMENT, `renderMesh: expected three numbers a vertex and as many in normals, found ${positions.length} and ${normals?.length}`);
    this.#lend("render_mesh", positions, "normals", normals, { vertex_count: positions.length / 3 });
  }

  /** @param {FineSurface} surface */
  #lendFineSurface({ positions, triangles }) {
    if (positions.length % 3 || triangles.length % 3)
      throw new PalpateError(ARGUMENT, `fineSurface: expected three numbers a vertex and three a triangle, found ${positions.length} and ${triangles.length}`);
    this.#lend("fine_surface", positions, "triangles", Int32Array.from(triangles), { vertex_count: positions.length / 3, triangle_count: triangles.length / 3 });
  }
}

/** @param {Runtime} runtime @param {number} at @param {Pose} pose */
export function fillPose(runtime, at, { position, orientation, velocity, angularVelocity }) {
  const put = writer(runtime, "palpate_pose", at);
  runtime.api.palpate_init_pose(at, runtime.field("palpate_pose"));
  for (const [name, numbers, count] of /** @type {const} */ ([["position", position, 3], ["orientation", orientation, 4], ["velocity", velocity, 3], ["angular_velocity", angularVelocity, 3]]))
    if (numbers) put.numbers(name, numbers, count);
}
