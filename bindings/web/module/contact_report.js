// palpate_contact_report and palpate_surface_hit in the module's memory -> plain objects.
import { reader } from "./struct.js";
/** @typedef {import("./palpate.js").Runtime} Runtime */
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
  const read = reader(runtime, "palpate_surface_hit", at);
  if (!read.integer("hit")) return undefined;
  return {
    triangle: read.integer("triangle"), barycentric: read.vector("barycentric"), point: read.vector("point"),
    normal: read.vector("normal"), distance: read.number("distance"),
  };
}

/** @param {Runtime} runtime @param {number} at @returns {Contact} */
function readContact(runtime, at) {
  const read = reader(runtime, "palpate_contact", at);
  return {
    toolId: read.integer("tool_id"), tool: read.integer("tool"), point: read.integer("point"),
    triangle: read.integer("triangle"), node: read.integer("node"), state: STATES[read.integer("state")],
    begun: read.whole("begun"), barycentric: read.vector("barycentric"),
    place: read.vector("place"), normal: read.vector("normal"), depth: read.number("depth"), gap: read.number("gap"),
    force: read.vector("force"), velocity: read.vector("velocity"), toolPoint: read.vector("tool_point"),
    discRadius: read.number("disc_radius"), discNormal: read.vector("disc_normal"), indentation: read.number("indentation"),
  };
}

/** @param {Runtime} runtime @param {number} at @returns {ContactEvent} */
function readEvent(runtime, at) {
  const read = reader(runtime, "palpate_contact_event", at);
  return {
    kind: EVENTS[read.integer("kind") - 1], toolId: read.integer("tool_id"), point: read.integer("point"),
    contact: read.integer("contact"), triangle: read.integer("triangle"), node: read.integer("node"),
    barycentric: read.vector("barycentric"), place: read.vector("place"),
  };
}
