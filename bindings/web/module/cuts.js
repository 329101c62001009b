// Blades as objects -> palpate_blade in the module's memory; their state, what was cut and the surface of what is left back.
import { ARGUMENT, PalpateError } from "./heap.js";
import { reader, writer } from "./struct.js";
/** @import { Runtime } from "./palpate.js" */
/** @typedef {{points: ArrayLike<number>, direction?: ArrayLike<number>, toughness?: number, friction?: number, width?: number}} Blade
 *  A blade, as palpate_blade: points [2 .. 16][3] m, in the world, along its edge. toughness: J/m^2, of tissue that holds the edge and pushes it back;
 *  above 0, direction says where the edge looks, of length 1. friction: Pa, on the flanks, which reach width m behind the edge. */
/** @typedef {{force: number[], torque: number[], work: number, frictionWork: number, area: number, inTissue: number, cuts: number}} BladeState
 *  A blade after a touch, as palpate_blade_state; in the world: the force and the torque on it. */
/** @typedef {{surface: number, area: number, faces: number, removed: number, nodes: number, pieces: number, waiting: number, left: number, rank: number,
 *   isFull: boolean, rebased: number, rebasing: boolean}} CutState
 *  What has been cut, as palpate_cut_state. surface: goes up where the surface has changed. */
/** @typedef {{triangles: Int32Array, isLip: Uint8Array, nodes: Int32Array}} CutSurface  [count][3] nodes of a shape, and for each triangle whether a cut made it.
 *  nodes: [count][2] the nodes that cuts have made, each with the bundle's that it comes from, at whose place it lies at rest. */

const MOST_POINTS = 16; // PALPATE_MAX_BLADE_POINTS
const BLADE_STATE = { vector: ["force", "torque"], number: ["work", "friction_work", "area"], integer: ["in_tissue", "cuts"] };
const CUT_STATE = { whole: ["surface"], number: ["area"], integer: ["faces", "removed", "nodes", "pieces", "waiting", "left", "rank", "rebased"] };

/** Bytes of a blade with its points. @param {Runtime} runtime */
export const bladeBytes = (runtime) => runtime.field("palpate_blade") + 24 * MOST_POINTS;

/** @param {Runtime} runtime @param {number} at of bladeBytes @param {Blade | null} blade null: it is withdrawn */
export function fillBlade(runtime, at, blade) {
  const size = runtime.field("palpate_blade"), put = writer(runtime, "palpate_blade", at), points = at + size;
  runtime.api.palpate_init_blade(at, size);
  if (!blade) return;
  const { length } = blade.points;
  if (length % 3 || length < 6 || length > 3 * MOST_POINTS)
    throw new PalpateError(ARGUMENT, `points: expected three numbers for each of 2 to ${MOST_POINTS} points, found ${length}`);
  new Float64Array(runtime.heap.buffer, points, length).set(blade.points);
  put.address("points", points);
  put.integer("point_count", length / 3);
  if (blade.direction) put.numbers("direction", blade.direction, 3);
  put.number("toughness", blade.toughness);
  put.number("friction", blade.friction);
  put.number("width", blade.width);
}

/** @param {Runtime} runtime @param {number} at @returns {BladeState} */
export const readBladeState = (runtime, at) => reader(runtime, "palpate_blade_state", at).all(BLADE_STATE);

/** @param {Runtime} runtime @param {number} at @returns {CutState} */
export function readCutState(runtime, at) {
  const from = reader(runtime, "palpate_cut_state", at);
  return { ...from.all(CUT_STATE), isFull: from.integer("is_full") !== 0, rebasing: from.integer("rebasing") !== 0 };
}

/** @param {Runtime} runtime @param {number} scene @returns {CutSurface} copies */
export function readCutSurface({ api, heap }, scene) {
  const count = api.palpate_scene_cut_surface(scene, 0, 0, 0), at = heap.take(13 * count + 1);
  api.palpate_scene_cut_surface(scene, at, at + 12 * count, count);
  const found = { triangles: new Int32Array(heap.buffer, at, 3 * count).slice(), isLip: new Uint8Array(heap.buffer, at + 12 * count, count).slice() };
  heap.release(at);
  return { ...found, nodes: readCutNodes({ api, heap }, scene) };
}

/** @param {Pick<Runtime, "api" | "heap">} runtime @param {number} scene @returns {Int32Array} a copy */
function readCutNodes({ api, heap }, scene) {
  const count = api.palpate_scene_cut_nodes(scene, 0, 0), at = heap.take(8 * count + 1);
  api.palpate_scene_cut_nodes(scene, at, count);
  const nodes = new Int32Array(heap.buffer, at, 2 * count).slice();
  heap.release(at);
  return nodes;
}
