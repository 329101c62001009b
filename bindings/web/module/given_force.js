// Forces that tools press with as objects -> palpate_given_force in the module's memory, and their state back.
import { reader, writer } from "./struct.js";
/** @import { Runtime } from "./palpate.js" */
/** @typedef {{force: ArrayLike<number>, speed?: number}} GivenForce
 *  The force with which a tool presses the organ, as palpate_given_force: N, in the world; speed: m/s, of the tool at most. */
/** @typedef {{condition: "free" | "carried" | "part" | "moves", displacement: number[], force: number[], missed: number[]}} GivenForceState
 *  Where such a tool stands after a touch, as palpate_given_force_state; in the world. */

// The words of palpate_force_control.h's enum, in their order.
const CONDITIONS = /** @type {const} */ (["free", "carried", "part", "moves"]);
const STATE = { integer: ["condition"], vector: ["displacement", "force", "missed"], number: [] };

/** @param {Runtime} runtime @param {number} at @param {GivenForce} given */
export function fillGivenForce(runtime, at, given) {
  const put = writer(runtime, "palpate_given_force", at);
  runtime.api.palpate_init_given_force(at, runtime.field("palpate_given_force"));
  put.numbers("force", given.force, 3);
  if (given.speed !== undefined) put.number("speed", given.speed);
}

/** @param {Runtime} runtime @param {number} at @returns {GivenForceState} */
export function readGivenForceState(runtime, at) {
  const state = reader(runtime, "palpate_given_force_state", at).all(STATE);
  return { ...state, condition: CONDITIONS[state.condition] };
}
