// Obstacles as objects -> palpate_obstacle in the module's memory, and their state back.
import { ARGUMENT, PalpateError } from "./heap.js";
import { reader, writer } from "./struct.js";
/** @import { Runtime } from "./palpate.js" */
/** @typedef {{kind: "rectangle" | "disc" | "mesh", size?: ArrayLike<number>, radius?: number, positions?: ArrayLike<number>, triangles?: ArrayLike<number>,
 *   friction?: number, depth?: number, position?: ArrayLike<number>, orientation?: ArrayLike<number>}} Obstacle
 *  A rigid surface that the organ does not enter, as palpate_obstacle: size: m, of a rectangle along x and y; radius: m, of a disc; both look along z, to
 *  the organ. positions [vertices][3] m and triangles [triangles][3], of a mesh, which creating the scene copies. position m, orientation w x y z: in the
 *  world, when the scene begins. depth: m; a node that is farther inside is not held. */
/** @typedef {{force: number[], torque: number[], position: number[], orientation: number[], deepest: number, nodes: number, slips: number}} ObstacleState
 *  An obstacle after a touch, as palpate_obstacle_state; in the world: the force and the torque on it. */

const KINDS = ["rectangle", "disc", "mesh"]; // of palpate_obstacle_kind, from 1 on
const STATE = { vector: ["force", "torque", "position"], number: ["deepest"], integer: ["nodes", "slips"] };

/** Writes them behind one another. @param {Runtime} runtime @param {Obstacle[]} obstacles @param {(bytes: number) => number} take memory
 *  @returns {number} the address of the first one */
export function fillObstacles(runtime, obstacles, take) {
  const size = runtime.field("palpate_obstacle"), first = take(obstacles.length * size);
  obstacles.forEach((obstacle, i) => {
    const at = first + i * size, put = writer(runtime, "palpate_obstacle", at), kind = KINDS.indexOf(obstacle.kind);
    if (kind < 0) throw new PalpateError(ARGUMENT, `obstacles: expected the kind ${KINDS.join(", ")}, found ${obstacle.kind}`);
    runtime.api.palpate_init_obstacle(at, size);
    put.integer("kind", kind + 1);
    if (obstacle.kind !== "mesh") put.numbers("size", obstacle.kind === "disc" ? [obstacle.radius ?? 0, 0] : obstacle.size, 2);
    put.all(obstacle, { number: ["friction", "depth"] });
    if (obstacle.position) put.numbers("position", obstacle.position, 3);
    if (obstacle.orientation) put.numbers("orientation", obstacle.orientation, 4);
    if (obstacle.kind !== "mesh") return;
    const { positions = [], triangles = [] } = obstacle;
    if (positions.length % 3 || triangles.length % 3)
      throw new PalpateError(ARGUMENT, `obstacles: expected three numbers a vertex and three a triangle, found ${positions.length} and ${triangles.length}`);
    const vertices = take(4 * (positions.length + triangles.length) + 1), corners = vertices + 4 * positions.length;
    new Float32Array(runtime.heap.buffer, vertices, positions.length).set(positions);
    new Int32Array(runtime.heap.buffer, corners, triangles.length).set(triangles);
    put.address("positions", vertices);
    put.address("triangles", corners);
    put.integer("vertex_count", positions.length / 3);
    put.integer("triangle_count", triangles.length / 3);
  });
  return first;
}

/** @param {Runtime} runtime @param {number} at @returns {ObstacleState} */
export function readObstacleState(runtime, at) {
  const orientation = at + runtime.field("palpate_obstacle_state.orientation");
  return { ...reader(runtime, "palpate_obstacle_state", at).all(STATE), orientation: [...new Float64Array(runtime.heap.buffer, orientation, 4)] };
}
