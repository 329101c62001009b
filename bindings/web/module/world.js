// A world: several organs and the tools that touch them, stepped together, as palpate_world.h has it.
import { fillWorldLink, readLinkState } from "./links.js";
import { Scene } from "./scene.js";
import { fillPose, SceneDef } from "./scene_def.js";
import { reader, writer } from "./struct.js";
import { ToolMemory } from "./tool_memory.js";
import { ToolStates } from "./tool_states.js";
/** @import { Runtime, Bundle, Effects, Pose, Tool } from "./palpate.js" */
/** @import { TouchedContacts } from "./scene.js" */
/** @import { WorldLink, LinkState } from "./links.js" */
/** @typedef {{bundle: Bundle, effects?: Effects, pose?: Pose}} Organ
 *  Several organs may have one bundle. maxTools and maxPoints of all organs of a world must be the same. */
/** @typedef {{maxPairs?: number, maxLinks?: number, friction?: number, forceLimit?: number, forceSlew?: number, torqueLimit?: number, torqueSlew?: number}} WorldOptions
 *  maxPairs: places at most where organs are held apart; left out: they pass through one another. Above 0 it needs collision "deformed"
 *  of all organs. maxLinks: links of the world at most (setLinks). friction: Coulomb's coefficient between organs. The limits are of each tool, all organs together. */
/** @typedef {{flags: number, nearTools: number, force: number[], torque: number[], pressed: number[]}} OrganState
 *  An organ after a touch, as palpate_world_organ_state: in the world, N and N m; force: by all tools; pressed: by all other organs. */
/** @typedef {{organs: number[], node: number, triangle: number, barycentric: number[], place: number[], normal: number[], force: number[],
 *   pressure: number, gap: number, overlap: number}} Pair
 *  A place where two organs touch or may touch, as palpate_world_pair: a vertex of organs[0] and a place on organs[1]; in the world. */

const ORGAN_STATE = { unsigned: ["flags"], integer: ["near_tools"], vector: ["force", "torque", "pressed"] };
const PAIR = { integer: ["node", "triangle"], vector: ["barycentric", "place", "normal", "force"], number: ["pressure", "gap", "overlap"] };
const OPTIONS = { integer: ["max_pairs", "max_links"], number: ["friction", "force_limit", "force_slew", "torque_limit", "torque_slew"] };

export class World extends ToolStates {
  #tools;
  #contactsAt = 0;
  #contactsBytes = 0;
  #linksAt = 0;
  /** @type {TouchedContacts[]} */
  #contacts;

  /** Runtime.createWorld makes worlds. @param {Runtime} runtime @param {Organ[]} organs @param {WorldOptions} options */
  constructor(runtime, organs, options) {
    super(runtime, "palpate_world_tool_state", "palpate_world_contacts");
    /** @type {SceneDef[]} */
    const defs = [];
    this.#contacts = organs.map(() => ({ at: 0, touched: false }));
    try {
      for (const { effects = {} } of organs) defs.push(new SceneDef(runtime, effects));
      this.pointer = createWorld(runtime, organs, defs, options);
      /** One for each organ: its shape, skin, queries, links, motions, report and pose, and the forces of that organ on the tools. Its tools,
       *  touch(), save(), restore() and destroy() are the world's. */
      this.organs = organs.map(({ bundle }, k) => new Scene(bundle, defs[k], runtime.api.palpate_world_scene(this.pointer, k) >>> 0, this.#contacts[k]));
      this.#tools = new ToolMemory(runtime, defs[0].integer("maxTools"), defs[0].integer("maxPoints"));
    } finally {
      for (const def of defs) def.release();
    }
    this.#contactsBytes = runtime.api.palpate_world_contacts_bytes(this.pointer) >>> 0;
    this.#contactsAt = runtime.heap.takeZeros(this.#contactsBytes);
    this.maxLinks = options.maxLinks ?? 0;
    this.#linksAt = runtime.heap.takeZeros(Math.max(1, this.maxLinks) * runtime.field("palpate_world_link"));
    for (const contacts of this.#contacts) contacts.at = this.#contactsAt;
  }

  /** Sets the tools for the next touch, in the world. The grips, the grasp and the needle of a tool hold the organ that it names.
   *  @param {Tool[]} tools known by their id, or by their order */
  setTools(tools) {
    this.#tools.set(tools);
  }

  /** Gives the world its links between organs, as Scene.setLinks gives a scene its own. @param {WorldLink[]} links */
  setLinks(links) {
    const { runtime } = this, size = runtime.field("palpate_world_link");
    if (links.length > this.maxLinks) throw new RangeError(`${links.length} links; the world was made for ${this.maxLinks}`);
    links.forEach((link, i) => fillWorldLink(runtime, this.#linksAt + i * size, link));
    runtime.check((error) => runtime.api.palpate_world_set_links(this.pointer, this.#linksAt, links.length, error));
  }
  /** The links of the world after the last touch(), in their order: copies. @returns {LinkState[]} */
  get links() {
    return this.runtime.list((link) => this.runtime.api.palpate_world_link_state(this.pointer, link), (at) => readLinkState(this.runtime, at));
  }

  /** The touch step of all organs. @param {number} dt s since the last touch @returns {number} flag bits of all organs together, 0: full trust */
  touch(dt) {
    const { runtime } = this, { at, count } = this.#tools;
    const flags = runtime.api.palpate_world_touch(this.pointer, at, count, dt, this.#contactsAt, this.#contactsBytes) >>> 0;
    this.#contacts.forEach((contacts, k) => {
      contacts.at = this.#contactsAt + runtime.heap.u32(this.#stateAt(k) + runtime.field("palpate_world_organ_state.contacts_offset"));
      contacts.touched = true;
    });
    return flags;
  }

  /** @protected */
  contactsAddress() {
    return this.#contactsAt;
  }

  /** The organs after the last touch(): copies. @returns {OrganState[]} */
  get organStates() {
    return this.organs.map((_, k) => reader(this.runtime, "palpate_world_organ_state", this.#stateAt(k)).all(ORGAN_STATE));
  }

  /** The places where organs touch or may touch after the last touch(): copies. @returns {Pair[]} */
  get pairs() {
    const head = this.#head, first = this.#contactsAt + head.whole("pairs_offset"), size = head.integer("pair_bytes");
    return Array.from({ length: head.integer("pair_count") }, (_, i) => {
      const read = reader(this.runtime, "palpate_world_pair", first + i * size);
      return { organs: [read.integer("organ"), read.integer("organ", 1)], ...read.all(PAIR) };
    });
  }

  /** view: what the last touch() found, as plain bytes. */
  get contactBytes() {
    return new Uint8Array(this.runtime.heap.buffer, this.#contactsAt, this.#head.whole("used_bytes"));
  }

  /** What the touches have left in all organs, as Scene.save. @returns {Uint8Array} a copy */
  save() {
    const { api } = this.runtime;
    return this.runtime.savedState(api.palpate_world_state_bytes(this.pointer) >>> 0, (at, bytes, error) => api.palpate_world_save(this.pointer, at, bytes, error));
  }

  /** As Scene.restore; a state that is refused leaves all organs as they were. @param {Uint8Array} state */
  restore(state) {
    this.runtime.restoreState(state, (at, bytes, error) => this.runtime.api.palpate_world_restore(this.pointer, at, bytes, error));
    this.#forgetContacts();
  }

  /** Forgets contacts, last positions and forces of all organs. */
  reset() {
    this.runtime.api.palpate_world_reset(this.pointer);
    this.#forgetContacts();
  }

  /** The same for one tool alone. @param {number} id */
  resetTool(id) {
    this.runtime.api.palpate_world_reset_tool(this.pointer, id);
  }

  /** Its organs' scenes go with it; the bundles stay. */
  destroy() {
    for (const organ of this.organs) organ.releaseMemory();
    this.runtime.api.palpate_world_destroy(this.pointer);
    this.#tools.release();
    this.runtime.heap.release(this.#linksAt);
    this.runtime.heap.release(this.#contactsAt);
  }

  #forgetContacts() {
    for (const contacts of this.#contacts) contacts.touched = false;
  }
  get #head() {
    return reader(this.runtime, "palpate_world_contacts", this.#contactsAt);
  }
  /** @param {number} organ */
  #stateAt(organ) {
    return this.#contactsAt + this.#head.integer("organs_offset") + organ * this.runtime.field("palpate_world_organ_state");
  }
}

/** @param {Runtime} runtime @param {Organ[]} organs @param {SceneDef[]} defs @param {WorldOptions} options @returns {number} the pointer */
function createWorld(runtime, organs, defs, options) {
  const { api, heap } = runtime, size = runtime.field("palpate_world_organ"), poseSize = runtime.field("palpate_pose");
  const def = heap.take(runtime.field("palpate_world_def") + organs.length * (size + poseSize) + 32);
  const first = (def + runtime.field("palpate_world_def") + 15) & ~15, firstPose = (first + organs.length * size + 15) & ~15;
  try {
    organs.forEach(({ bundle, pose = {} }, k) => {
      const at = first + k * size, put = writer(runtime, "palpate_world_organ", at);
      api.palpate_init_world_organ(at, size);
      fillPose(runtime, firstPose + k * poseSize, pose);
      put.address("bundle", bundle.pointer);
      put.address("def", defs[k].at);
      put.address("pose", firstPose + k * poseSize);
    });
    const put = writer(runtime, "palpate_world_def", def);
    api.palpate_init_world_def(def, runtime.field("palpate_world_def"));
    put.address("organs", first);
    put.integer("organ_count", organs.length);
    put.all(options, OPTIONS);
    return runtime.open((out, error) => api.palpate_world_create(def, out, error));
  } finally {
    heap.release(def);
  }
}
