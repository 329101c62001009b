// Effects as words and numbers -> palpate_scene_def in the module's memory; a pose as numbers -> palpate_pose.
import { ARGUMENT, PalpateError } from "./heap.js";
import { reader, writer } from "./struct.js";
/** @typedef {import("./palpate.js").Runtime} Runtime */
/** @typedef {import("./palpate.js").Effects} Effects */
/** @typedef {import("./palpate.js").RenderMesh} RenderMesh */
/** @typedef {import("./palpate.js").FineSurface} FineSurface */
/** @typedef {import("./palpate.js").Pose} Pose */

// The words of palpate.h's enums, in their order.
const WORDS = /** @type {const} */ ({
  collision: ["off", "rest", "deformed"],
  contact: ["node", "triangle", "point", "patch"],
  law: ["sticking", "sliding", "unilateral", "coulomb"],
  force: ["off", "linear", "response"],
  shape: ["off", "surface", "volume"],
  radial: ["off", "response"],
  deformation: ["linear", "large", "large-beside", "large-renewed"],
  queries: ["off", "on"],
  report: ["off", "contacts"],
  dent: ["off", "discs"],
});
const MAX_RELAXATION_TERMS = 8;

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

  /** A number of the definition, defaults included. @param {string} name */
  integer(name) {
    return reader(this.runtime, "palpate_scene_def", this.at).integer(name);
  }

  release() {
    for (const at of [this.at, ...this.#lent]) this.runtime.heap.release(at);
  }
}

/** @param {Runtime} runtime @param {number} def @param {Effects} effects */
function fillSceneDef(runtime, def, effects) {
  const put = writer(runtime, "palpate_scene_def", def);
  for (const [effect, words] of Object.entries(WORDS)) {
    const word = effects[/** @type {keyof typeof WORDS} */ (effect)];
    if (word === undefined) continue;
    const value = /** @type {readonly string[]} */ (words).indexOf(word);
    if (value < 0) throw new PalpateError(ARGUMENT, `${effect}: expected ${words.join(", ")}, found ${word}`);
    put.integer(effect, value);
  }
  fillRelaxation(runtime, def, effects.relaxation ?? []);
  const flag = (/** @type {boolean | undefined} */ on) => (on === undefined ? undefined : on ? 1 : 0);
  put.integer("preload", flag(effects.preload));
  put.integer("max_tools", effects.maxTools);
  put.integer("max_points", effects.maxPoints);
  put.integer("max_contact_nodes", effects.maxContactNodes);
  put.number("force_limit", effects.forceLimit);
  put.number("force_slew", effects.forceSlew);
  put.number("torque_limit", effects.torqueLimit);
  put.number("torque_slew", effects.torqueSlew);
  put.number("max_tool_speed", effects.maxToolSpeed);
  put.number("release_distance", effects.releaseDistance);
  put.integer("max_links", effects.maxLinks);
  put.integer("grasps", flag(effects.grasps));
  put.integer("motions", flag(effects.motions));
  put.integer("inside", flag(effects.inside));
  put.integer("needles", flag(effects.needles));
  put.integer("needle_places", effects.needlePlaces);
  if (effects.maxOperations !== undefined)
    runtime.heap.data.setBigInt64(def + runtime.field("palpate_scene_def.max_operations"), BigInt(effects.maxOperations), true);
}

/** @param {Runtime} runtime @param {number} def @param {{share: number, time: number}[]} terms */
function fillRelaxation(runtime, def, terms) {
  if (terms.length > MAX_RELAXATION_TERMS)
    throw new PalpateError(ARGUMENT, `relaxation: expected at most ${MAX_RELAXATION_TERMS} terms, found ${terms.length}`);
  const put = writer(runtime, "palpate_scene_def", def), { data } = runtime.heap;
  put.integer("relaxation.model", terms.length ? 1 : 0);
  put.integer("relaxation.terms", terms.length);
  const first = (/** @type {string} */ name) => def + runtime.field(`palpate_scene_def.relaxation.${name}`);
  terms.forEach(({ share, time }, i) => {
    data.setFloat64(first("share") + 8 * i, share, true);
    data.setFloat64(first("time") + 8 * i, time, true);
  });
}

/** @param {Runtime} runtime @param {number} at @param {Pose} pose */
export function fillPose(runtime, at, pose) {
  const put = writer(runtime, "palpate_pose", at);
  runtime.api.palpate_init_pose(at, runtime.field("palpate_pose"));
  if (pose.position) put.numbers("position", pose.position, 3);
  if (pose.orientation) put.numbers("orientation", pose.orientation, 4);
  if (pose.velocity) put.numbers("velocity", pose.velocity, 3);
  if (pose.angularVelocity) put.numbers("angular_velocity", pose.angularVelocity, 3);
}

// Copies the mesh into the module's memory for palpate_scene_create. Returns the memory, which the caller then releases.
/** @param {Runtime} runtime @param {number} def @param {RenderMesh} mesh @returns {number} */
function lendRenderMesh(runtime, def, { positions, normals }) {
  if (positions.length % 3 || (normals && normals.length !== positions.length))
    throw new PalpateError(ARGUMENT, `renderMesh: expected three numbers a vertex and as many in normals, found ${positions.length} and ${normals?.length}`);
  const { heap } = runtime, size = runtime.field("palpate_render_mesh"), at = heap.take(size + 24 + 8 * positions.length);
  const first = (at + size + 15) & ~15, second = first + 4 * positions.length;
  new Float32Array(heap.buffer, first, positions.length).set(positions);
  if (normals) new Float32Array(heap.buffer, second, normals.length).set(normals);
  const put = writer(runtime, "palpate_render_mesh", at);
  runtime.api.palpate_init_render_mesh(at, size);
  put.address("positions", first);
  put.address("normals", normals ? second : 0);
  put.integer("vertex_count", positions.length / 3);
  writer(runtime, "palpate_scene_def", def).address("render_mesh", at);
  return at;
}

// The same for the surface that tools meet.
/** @param {Runtime} runtime @param {number} def @param {FineSurface} surface @returns {number} */
function lendFineSurface(runtime, def, { positions, triangles }) {
  if (positions.length % 3 || triangles.length % 3)
    throw new PalpateError(ARGUMENT, `fineSurface: expected three numbers a vertex and three a triangle, found ${positions.length} and ${triangles.length}`);
  const { heap } = runtime, size = runtime.field("palpate_fine_surface");
  const at = heap.take(size + 24 + 4 * (positions.length + triangles.length));
  const first = (at + size + 15) & ~15, second = first + 4 * positions.length;
  new Float32Array(heap.buffer, first, positions.length).set(positions);
  new Int32Array(heap.buffer, second, triangles.length).set(triangles);
  const put = writer(runtime, "palpate_fine_surface", at);
  runtime.api.palpate_init_fine_surface(at, size);
  put.address("positions", first);
  put.address("triangles", second);
  put.integer("vertex_count", positions.length / 3);
  put.integer("triangle_count", triangles.length / 3);
  writer(runtime, "palpate_scene_def", def).address("fine_surface", at);
  return at;
}

