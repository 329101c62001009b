// Links and grasps as objects -> palpate_link and palpate_grasp in the module's memory, and their states back.
import { ARGUMENT, PalpateError } from "./heap.js";
import { reader, writer } from "./struct.js";
/** @import { Runtime } from "./palpate.js" */
/** @typedef {{triangle: number, barycentric: ArrayLike<number>}} SurfacePoint
 *  A point of a triangle, by the weights of its vertices, as a SurfaceHit has it. */
/** @typedef {SurfacePoint | {world: ArrayLike<number>}} LinkEnd
 *  A point of the surface, which moves with the tissue, or one that stands in the world, m. */
/** @typedef {{kind: "thread" | "spring" | "clip", ends: LinkEnd[], restLength?: number, stiffness?: number, breakingForce?: number,
 *   radius?: number, runsOn?: boolean, id?: number}} Link
 *  A suture, clip, ligament or spring, as palpate_link; two ends. restLength, radius: m; stiffness: N/m; breakingForce: N. What is left
 *  out is the default of palpate.h. */
/** @typedef {Omit<Link, "ends"> & {ends: ((SurfacePoint & {organ: number}) | {world: ArrayLike<number>})[]}} WorldLink
 *  A link of a world, as palpate_world_link: each end on a surface names its organ, by its index in the world's organs. */
/** @typedef {{place: SurfacePoint, opposite?: SurfacePoint, position: ArrayLike<number>, orientation?: ArrayLike<number>, radius: number,
 *   closing?: number, friction?: number, clampForce?: number, id?: number}} Grasp
 *  Jaws that hold tissue, as palpate_grasp. position, orientation: of the tool in the world, m and a quaternion w x y z. */
/** @typedef {{id: number, condition: "slack" | "taut" | "broken", broken: number, restLength: number, length: number, tension: number,
 *   force: number[], ends: number[][]}} LinkState  A link after a touch, as palpate_link_state; in the organ's frame, that of a world in the
 *  world. */
/** @typedef {{condition: "open" | "holds" | "slips" | "let-go", force: number[], torque: number[], place: number[], slipped: number,
 *   frictionLimit: number}} GraspState  A grasp after a touch, as palpate_grasp_state; in the world. */

// The words of palpate.h's enums, in their order.
const KINDS = ["thread", "spring", "clip"]; // from 1 on
const LINK_CONDITIONS = /** @type {const} */ (["slack", "taut", "broken"]);
const GRASP_CONDITIONS = /** @type {const} */ (["open", "holds", "slips", "let-go"]);
const END_SURFACE_POINT = 1, END_WORLD = 2;
const LINK = { integer: ["id", "runs_on"], number: ["rest_length", "stiffness", "breaking_force", "radius"] };
const GRASP = { integer: ["id"], number: ["radius", "closing", "friction", "clamp_force"] };
const LINK_STATE = { integer: ["id", "condition"], whole: ["broken"], number: ["rest_length", "length", "tension"], vector: ["force"] };
const GRASP_STATE = { integer: ["condition"], vector: ["force", "torque", "place"], number: ["slipped", "friction_limit"] };

/** @param {Runtime} runtime @param {number} at @param {Link} link */
export function fillLink(runtime, at, link) {
  fill(runtime, "palpate_link", runtime.api.palpate_init_link, at, link);
}

/** @param {Runtime} runtime @param {number} at @param {WorldLink} link */
export function fillWorldLink(runtime, at, link) {
  fill(runtime, "palpate_world_link", runtime.api.palpate_init_world_link, at, link);
  const put = writer(runtime, "palpate_world_link", at);
  link.ends.forEach((end, e) => put.integer("organ", "world" in end ? -1 : end.organ, e));
}

/** What both kinds of link have. @param {Runtime} runtime @param {string} struct @param {Function} init @param {number} at @param {Link} link */
function fill(runtime, struct, init, at, link) {
  const put = writer(runtime, struct, at), kind = KINDS.indexOf(link.kind) + 1;
  if (kind === 0) throw new PalpateError(ARGUMENT, `link: expected a kind ${KINDS.join(", ")}, found ${link.kind}`);
  if (link.ends?.length !== 2) throw new PalpateError(ARGUMENT, `link: expected two ends, found ${link.ends?.length}`);
  init(at, runtime.field(struct));
  put.integer("kind", kind);
  link.ends.forEach((end, e) => fillEnd(runtime, at + runtime.field(`${struct}.ends`) + e * runtime.field("palpate_link_end"), end));
  put.all(link, LINK);
}

/** @param {Runtime} runtime @param {number} at @param {LinkEnd} end */
function fillEnd(runtime, at, end) {
  const put = writer(runtime, "palpate_link_end", at);
  if ("world" in end) {
    put.integer("kind", END_WORLD);
    put.numbers("point", end.world, 3);
  } else {
    put.integer("kind", END_SURFACE_POINT);
    put.integer("triangle", end.triangle);
    put.numbers("barycentric", end.barycentric, 3);
  }
}

/** @param {Runtime} runtime @param {number} at @param {Grasp} grasp */
export function fillGrasp(runtime, at, grasp) {
  const put = writer(runtime, "palpate_grasp", at);
  runtime.api.palpate_init_grasp(at, runtime.field("palpate_grasp"));
  put.all(grasp, GRASP);
  put.integer("triangle", grasp.place.triangle);
  put.numbers("barycentric", grasp.place.barycentric, 3);
  if (grasp.opposite) {
    put.integer("opposite_triangle", grasp.opposite.triangle);
    put.numbers("opposite_barycentric", grasp.opposite.barycentric, 3);
  }
  put.numbers("position", grasp.position, 3);
  if (grasp.orientation) put.numbers("orientation", grasp.orientation, 4);
}

/** @param {Runtime} runtime @param {number} at @returns {LinkState} */
export function readLinkState(runtime, at) {
  const read = reader(runtime, "palpate_link_state", at), state = read.all(LINK_STATE);
  return { ...state, condition: LINK_CONDITIONS[state.condition], ends: [read.vector("ends"), read.vector("ends", 3)] };
}

/** @param {Runtime} runtime @param {number} at @returns {GraspState} */
export function readGraspState(runtime, at) {
  const state = reader(runtime, "palpate_grasp_state", at).all(GRASP_STATE);
  return { ...state, condition: GRASP_CONDITIONS[state.condition] };
}
