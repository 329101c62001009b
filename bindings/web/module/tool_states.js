// What a touch found of each tool: palpate_tool_state, or palpate_world_tool_state of a world.
import { reader } from "./struct.js";
/** @import { Runtime } from "./palpate.js" */

export class ToolStates {
  #struct;

  /** @param {Runtime} runtime @param {string} struct of a tool's state @param {string} head of what stands before the first one */
  constructor(runtime, struct, head) {
    this.runtime = runtime;
    this.#struct = struct;
    this.headBytes = runtime.field(head);
  }

  /** The address of the last touch's contacts. @protected @returns {number} */
  contactsAddress() {
    return 0;
  }
  /** view [3] N: force on the tool, within the limits; of a world, of all organs together. @param {number} tool */
  force(tool) {
    return this.#vector(tool, "force");
  }
  /** view [3] N: force on the tool before those limits. @param {number} tool */
  forceRaw(tool) {
    return this.#vector(tool, "force_raw");
  }
  /** view [3] N m: torque on the tool about its reference, within the limits. @param {number} tool */
  torque(tool) {
    return this.#vector(tool, "torque");
  }
  /** view [3] N m: torque on the tool before those limits. @param {number} tool */
  torqueRaw(tool) {
    return this.#vector(tool, "torque_raw");
  }
  /** The number of a tool's contacts. @param {number} tool @returns {number} */
  contactCount(tool) {
    return reader(this.runtime, this.#struct, this.#at(tool)).integer("contact_count");
  }
  /** The flag bits of a tool. @param {number} tool @returns {number} */
  toolFlags(tool) {
    return reader(this.runtime, this.#struct, this.#at(tool)).unsigned("flags");
  }
  /** @param {number} tool */
  #at(tool) {
    return this.contactsAddress() + this.headBytes + tool * this.runtime.field(this.#struct);
  }
  /** @param {number} tool @param {"force" | "force_raw" | "torque" | "torque_raw"} name */
  #vector(tool, name) {
    return new Float64Array(this.runtime.heap.buffer, this.#at(tool) + this.runtime.field(`${this.#struct}.${name}`), 3);
  }
}
