// Needles as objects -> palpate_needle in the module's memory, and their state back.
import { reader, writer } from "./struct.js";
/** @import { Runtime } from "./palpate.js" */
/** @import { SurfacePoint } from "./links.js" */
/** @typedef {{place: SurfacePoint, tip: ArrayLike<number>, direction: ArrayLike<number>, radius: number, friction?: number,
 *   cuttingForce?: number, punctureForce?: number, spacing?: number, id?: number}} Needle
 *  A straight, stiff needle, as palpate_needle. place: where it enters; tip: m, in the world; direction: of length 1, from the handle to the
 *  tip; radius, spacing: m; friction: N/m; forces: N. What is left out is the default of palpate.h. */
/** @typedef {{condition: "none" | "outside" | "presses" | "inside" | "cuts" | "stuck", places: number, slipping: number, force: number[],
 *   torque: number[], tipForce: number, shaftForce: number, depth: number, tipAtRest: number[]}} NeedleState
 *  A needle after a touch, as palpate_needle_state; force and torque in the world, tipAtRest in the organ's frame. */

// The words of palpate.h's enum, in their order.
const CONDITIONS = /** @type {const} */ (["none", "outside", "presses", "inside", "cuts", "stuck"]);
const NEEDLE = { integer: ["id"], number: ["radius", "friction", "cutting_force", "puncture_force", "spacing"] };
const STATE = {
  integer: ["condition", "places", "slipping"], vector: ["force", "torque", "tip_at_rest"], number: ["tip_force", "shaft_force", "depth"],
};

/** @param {Runtime} runtime @param {number} at @param {Needle} needle */
export function fillNeedle(runtime, at, needle) {
  const put = writer(runtime, "palpate_needle", at);
  runtime.api.palpate_init_needle(at, runtime.field("palpate_needle"));
  put.all(needle, NEEDLE);
  put.integer("triangle", needle.place.triangle);
  put.numbers("barycentric", needle.place.barycentric, 3);
  put.numbers("tip", needle.tip, 3);
  put.numbers("direction", needle.direction, 3);
}

/** @param {Runtime} runtime @param {number} at @returns {NeedleState} */
export function readNeedleState(runtime, at) {
  const state = reader(runtime, "palpate_needle_state", at).all(STATE);
  return { ...state, condition: CONDITIONS[state.condition] };
}
