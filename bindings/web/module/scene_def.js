// Effects as words and numbers -> palpate_scene_def in the module's memory.
import { ARGUMENT, PalpateError } from "./heap.js";
/** @typedef {import("./palpate.js").Runtime} Runtime */
/** @typedef {import("./palpate.js").Effects} Effects */
/** @typedef {import("./palpate.js").RenderMesh} RenderMesh */
/** @typedef {import("./palpate.js").FineSurface} FineSurface */

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

/** @param {Runtime} runtime @param {number} def @param {Effects} effects */
export function fillSceneDef(runtime, def, effects) {
  const { data } = runtime.heap;
  const field = (/** @type {string} */ name) => def + runtime.field(`palpate_scene_def.${name}`);
  for (const [effect, words] of Object.entries(WORDS)) {
    const word = effects[/** @type {keyof typeof WORDS} */ (effect)];
    if (word === undefined) continue;
    const value = /** @type {readonly string[]} */ (words).indexOf(word);
    if (value < 0) throw new PalpateError(ARGUMENT, `${effect}: expected ${words.join(", ")}, found ${word}`);
    data.setInt32(field(effect), value, true);
  }
  if (effects.preload !== undefined) data.setInt32(field("preload"), effects.preload ? 1 : 0, true);
  const terms = effects.relaxation ?? [];
  if (terms.length > MAX_RELAXATION_TERMS)
    throw new PalpateError(ARGUMENT, `relaxation: expected at most ${MAX_RELAXATION_TERMS} terms, found ${terms.length}`);
  data.setInt32(field("relaxation.model"), terms.length ? 1 : 0, true);
  data.setInt32(field("relaxation.terms"), terms.length, true);
  terms.forEach(({ share, time }, i) => {
    data.setFloat64(field("relaxation.share") + 8 * i, share, true);
    data.setFloat64(field("relaxation.time") + 8 * i, time, true);
  });
  if (effects.maxTools !== undefined) data.setInt32(field("max_tools"), effects.maxTools, true);
  if (effects.maxPoints !== undefined) data.setInt32(field("max_points"), effects.maxPoints, true);
  if (effects.maxContactNodes !== undefined) data.setInt32(field("max_contact_nodes"), effects.maxContactNodes, true);
  if (effects.forceLimit !== undefined) data.setFloat64(field("force_limit"), effects.forceLimit, true);
  if (effects.forceSlew !== undefined) data.setFloat64(field("force_slew"), effects.forceSlew, true);
  if (effects.torqueLimit !== undefined) data.setFloat64(field("torque_limit"), effects.torqueLimit, true);
  if (effects.torqueSlew !== undefined) data.setFloat64(field("torque_slew"), effects.torqueSlew, true);
  if (effects.maxToolSpeed !== undefined) data.setFloat64(field("max_tool_speed"), effects.maxToolSpeed, true);
  if (effects.releaseDistance !== undefined) data.setFloat64(field("release_distance"), effects.releaseDistance, true);
  if (effects.maxLinks !== undefined) data.setInt32(field("max_links"), effects.maxLinks, true);
  if (effects.grasps !== undefined) data.setInt32(field("grasps"), effects.grasps ? 1 : 0, true);
  if (effects.maxOperations !== undefined) data.setBigInt64(field("max_operations"), BigInt(effects.maxOperations), true);
}

// Copies the mesh into the module's memory for palpate_scene_create. Returns the memory, which the caller then releases.
/** @param {Runtime} runtime @param {number} def @param {RenderMesh} mesh @returns {number} */
export function lendRenderMesh(runtime, def, { positions, normals }) {
  if (positions.length % 3 || (normals && normals.length !== positions.length))
    throw new PalpateError(ARGUMENT, `renderMesh: expected three numbers a vertex and as many in normals, found ${positions.length} and ${normals?.length}`);
  const { heap } = runtime, size = runtime.field("palpate_render_mesh"), at = heap.take(size + 24 + 8 * positions.length);
  const first = (at + size + 15) & ~15, second = first + 4 * positions.length;
  new Float32Array(heap.buffer, first, positions.length).set(positions);
  if (normals) new Float32Array(heap.buffer, second, normals.length).set(normals);
  const put = (/** @type {string} */ name, /** @type {number} */ value) =>
    heap.data.setUint32(at + runtime.field(`palpate_render_mesh.${name}`), value, true);
  runtime.api.palpate_init_render_mesh(at, size);
  put("positions", first);
  put("normals", normals ? second : 0);
  put("vertex_count", positions.length / 3);
  heap.data.setUint32(def + runtime.field("palpate_scene_def.render_mesh"), at, true);
  return at;
}

// The same for the surface that tools meet.
/** @param {Runtime} runtime @param {number} def @param {FineSurface} surface @returns {number} */
export function lendFineSurface(runtime, def, { positions, triangles }) {
  if (positions.length % 3 || triangles.length % 3)
    throw new PalpateError(ARGUMENT, `fineSurface: expected three numbers a vertex and three a triangle, found ${positions.length} and ${triangles.length}`);
  const { heap } = runtime, size = runtime.field("palpate_fine_surface");
  const at = heap.take(size + 24 + 4 * (positions.length + triangles.length));
  const first = (at + size + 15) & ~15, second = first + 4 * positions.length;
  new Float32Array(heap.buffer, first, positions.length).set(positions);
  new Int32Array(heap.buffer, second, triangles.length).set(triangles);
  const put = (/** @type {string} */ name, /** @type {number} */ value) =>
    heap.data.setUint32(at + runtime.field(`palpate_fine_surface.${name}`), value, true);
  runtime.api.palpate_init_fine_surface(at, size);
  put("positions", first);
  put("triangles", second);
  put("vertex_count", positions.length / 3);
  put("triangle_count", triangles.length / 3);
  heap.data.setUint32(def + runtime.field("palpate_scene_def.fine_surface"), at, true);
  return at;
}

