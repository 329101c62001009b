// palpate_contact_report and palpate_surface_hit in the module's memory -> plain objects.
import { reader } from "./struct.js";
/** @import { Runtime } from "./palpate.js" */
/** @typedef {"sticks" | "slips" | "frictionless" | "released"} ContactState */
/** @typedef {"begin" | "end" | "slip-start" | "stick-start" | "link-taut" | "link-slack" | "link-broke" |
 *   "grasp-closed" | "grasp-slips" | "grasp-holds" | "grasp-let-go" | "grasp-opened"} ContactEventKind */
/** @typedef {{toolId: number, tool: number, point: number, triangle: number, node: number, state: ContactState, begun: number,
 *   barycentric: number[], place: number[], normal: number[], depth: number, gap: number, force: number[], velocity: number[],
 *   toolPoint: number[], discRadius: number, discNormal: number[], indentation: number}} Contact
 *  A contact of a step, as palpate_contact: places, directions and forces are in the organ's frame; begun: the step in which the
 *  contact began. toolId, point and begun together name the contact. */
/** @typedef {{kind: ContactEventKind, toolId: number, point: number, contact: number, triangle: number, node: number,
 *   barycentric: number[], place: number[]}} ContactEvent
 *  What began or ended in a step, as palpate_contact_event; contact: its index among the contacts, -1 where it has ended. */
/** @typedef {{step: number, contacts: Contact[], events: ContactEvent[]}} ContactReport */
/** @typedef {{triangle: number, barycentric: number[], point: number[], normal: number[], distance: number}} SurfaceHit
 *  A point of the surface, m, as palpate_surface_hit. triangle and barycentric fit a Grip. */

// The words of palpate.h's enums, in their order.
const STATES = /** @type {const} */ (["sticks", "slips", "frictionless", "released"]);
const EVENTS = /** @type {const} */ (["begin", "end", "slip-start", "stick-start", "link-taut", "link-slack", "link-broke",
  "grasp-closed", "grasp-slips", "grasp-holds", "grasp-let-go", "grasp-opened"]);
const HIT = { integer: ["hit", "triangle"], vector: ["barycentric", "point", "normal"], number: ["distance"] };
const CONTACT = {
  integer: ["tool_id", "tool", "point", "triangle", "node", "state"], whole: ["begun"], number: ["depth", "gap", "disc_radius", "indentation"],
  vector: ["barycentric", "place", "normal", "force", "velocity", "tool_point", "disc_normal"],
};
const EVENT = { integer: ["kind", "tool_id", "point", "contact", "triangle", "node"], vector: ["barycentric", "place"] };

/** @param {Runtime} runtime @param {number} at @returns {ContactReport} */
export function readReport(runtime, at) {
  const read = reader(runtime, "palpate_contact_report", at), head = read.integer;
  const list = (/** @type {number} */ first, /** @type {number} */ bytes, /** @type {number} */ count) =>
    Array.from({ length: count }, (_, i) => first + i * bytes);
  return {
    step: read.whole("step"),
    contacts: list(at + head("struct_bytes"), head("contact_bytes"), head("contact_count")).map((contact) => readContact(runtime, contact)),
    events: list(at + head("events_offset"), head("event_bytes"), head("event_count")).map((event) => readEvent(runtime, event)),
  };
}

/** @param {Runtime} runtime @param {number} at @returns {SurfaceHit | undefined} */
export function readHit(runtime, at) {
  const { hit, ...found } = reader(runtime, "palpate_surface_hit", at).all(HIT);
  return hit ? found : undefined;
}

/** @param {Runtime} runtime @param {number} at @returns {Contact} */
function readContact(runtime, at) {
  const contact = reader(runtime, "palpate_contact", at).all(CONTACT);
  return { ...contact, state: STATES[contact.state] };
}

/** @param {Runtime} runtime @param {number} at @returns {ContactEvent} */
function readEvent(runtime, at) {
  const event = reader(runtime, "palpate_contact_event", at).all(EVENT);
  return { ...event, kind: EVENTS[event.kind - 1] };
}
