// Tools as objects -> palpate_tool in the module's memory, with their points, grips, grasps, needles and forces.
import { fillGivenForce } from "./given_force.js";
import { fillGrasp } from "./links.js";
import { fillNeedle } from "./needles.js";
import { reader, writer } from "./struct.js";
/** @import { Runtime, Tool, Grip } from "./palpate.js" */

const GRIP_NODE = 1, GRIP_SURFACE_POINT = 2;

/** Puts a part in front of a tool's. @param {Runtime} runtime @param {number} tool @param {number} part */
function addPart(runtime, tool, part) {
  writer(runtime, "palpate_part", part).address("next", reader(runtime, "palpate_tool", tool).unsigned("parts"));
  writer(runtime, "palpate_tool", tool).address("parts", part);
}

// Room for the tools of a scene or a world. Setting them allocates nothing.
export class ToolMemory {
  count = 0;
  #pointsAt = 0;
  #gripsAt = 0;
  #graspsAt = 0;
  #needlesAt = 0;
  #forcesAt = 0;

  /** @param {Runtime} runtime @param {number} maxTools @param {number} maxPoints */
  constructor(runtime, maxTools, maxPoints) {
    this.runtime = runtime;
    this.maxTools = maxTools;
    this.maxPoints = maxPoints;
    const sizes = [runtime.field("palpate_tool"), 24 * maxPoints, runtime.field("palpate_grip") * maxPoints, runtime.field("palpate_grasp"),
      runtime.field("palpate_needle"), runtime.field("palpate_given_force")]
      .map((bytes) => (bytes * maxTools + 15) & ~15);
    this.at = runtime.heap.takeZeros(sizes.reduce((sum, bytes) => sum + bytes, 0));
    this.#pointsAt = this.at + sizes[0];
    this.#gripsAt = this.#pointsAt + sizes[1];
    this.#graspsAt = this.#gripsAt + sizes[2];
    this.#needlesAt = this.#graspsAt + sizes[3];
    this.#forcesAt = this.#needlesAt + sizes[4];
  }

  /** @param {Tool[]} tools */
  set(tools) {
    if (tools.length > this.maxTools) throw new RangeError(`${tools.length} tools; the scene was made for ${this.maxTools}`);
    tools.forEach((tool, index) => this.#setTool(index, tool));
    this.count = tools.length;
  }

  /** @param {number} index @param {Tool} tool */
  #setTool(index, tool) {
    const { runtime } = this;
    const points = tool.points ?? [], grips = tool.grips ?? [];
    if (points.length > 3 * this.maxPoints || grips.length > this.maxPoints)
      throw new RangeError(`a tool of ${points.length / 3} points and ${grips.length} grips; the scene was made for ${this.maxPoints}`);
    const at = this.at + index * runtime.field("palpate_tool"), put = writer(runtime, "palpate_tool", at);
    runtime.api.palpate_init_tool(at, runtime.field("palpate_tool"));
    const pointsAt = this.#pointsAt + index * this.maxPoints * 24;
    new Float64Array(runtime.heap.buffer, pointsAt, points.length).set(points);
    const gripSize = runtime.field("palpate_grip"), gripsAt = this.#gripsAt + index * this.maxPoints * gripSize;
    grips.forEach((grip, g) => this.#setGrip(gripsAt + g * gripSize, grip));
    put.integer("id", tool.id ?? -1);
    put.address("points", pointsAt);
    put.integer("point_count", points.length / 3);
    put.address("grips", gripsAt);
    put.integer("grip_count", grips.length);
    put.integer("hold", tool.hold ? 1 : 0);
    put.integer("organ", tool.organ ?? 0);
    put.number("disc_radius", tool.discRadius ?? 0);
    put.number("friction", tool.friction ?? 0);
    put.integer("has_torque", tool.reference ? 1 : 0);
    if (tool.reference) put.numbers("reference", tool.reference, 3);
    if (tool.grasp) {
      const graspAt = this.#graspsAt + index * runtime.field("palpate_grasp");
      fillGrasp(runtime, graspAt, tool.grasp);
      addPart(runtime, at, graspAt);
    }
    if (tool.needle) {
      const needleAt = this.#needlesAt + index * runtime.field("palpate_needle");
      fillNeedle(runtime, needleAt, tool.needle);
      addPart(runtime, at, needleAt);
    }
    if (tool.givenForce) {
      const forceAt = this.#forcesAt + index * runtime.field("palpate_given_force");
      fillGivenForce(runtime, forceAt, tool.givenForce);
      addPart(runtime, at, forceAt);
    }
  }

  /** @param {number} at @param {Grip} grip */
  #setGrip(at, grip) {
    const { runtime } = this, put = writer(runtime, "palpate_grip", at);
    if ((grip.node === undefined) === (grip.triangle === undefined))
      throw new RangeError("a grip needs either node, for a node, or triangle, for a point of a triangle");
    runtime.api.palpate_init_grip(at, runtime.field("palpate_grip"));
    put.integer("kind", grip.node === undefined ? GRIP_SURFACE_POINT : GRIP_NODE);
    put.integer("node", grip.node ?? -1);
    put.integer("triangle", grip.triangle ?? -1);
    put.numbers("barycentric", grip.barycentric ?? [0, 0, 0], 3);
    put.numbers("displacement", grip.displacement, 3);
    put.address("axes", grip.axes ?? 7);
  }

  release() {
    this.runtime.heap.release(this.at);
  }
}
