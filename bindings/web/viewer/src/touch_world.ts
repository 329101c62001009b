// A world of the runtime that measures the time of its touches. The worker's loop steps it.
import type { Bundle, Pose, RenderMesh, Runtime, Tool, World, WorldOptions } from "../../module/palpate.js";
import type { PageEffects, Vector } from "./messages";
import { PAGE_RATES } from "./scene_reader";
import { BodySolves, shapeOf } from "./touch_scene";

export interface WorldPart {
  bundle: Bundle;
  effects: PageEffects;
  pose: Pose;
  mesh?: RenderMesh; // a finer mesh that follows the organ
}

export class TouchWorld {
  readonly world: World;
  touchMs = 0; // ms of all touches; the caller resets it
  private solves: BodySolves[];
  private frames: OrganFrame[];

  constructor(runtime: Runtime, parts: WorldPart[], options: WorldOptions, private rates = PAGE_RATES) {
    this.world = runtime.createWorld(parts.map(({ bundle, pose, mesh, effects: { fine, dent, inside, ...effects } }) => ({ bundle, pose, effects: { crossings: effects.shape !== "off" && !effects.cut, ...effects, renderMesh: mesh } })), options);
    this.solves = parts.map(({ effects }) => new BodySolves(effects, rates));
    this.frames = parts.map(({ pose }) => new OrganFrame(pose));
  }

  // A world that remembers nothing.
  reset() {
    this.world.reset();
    for (const solves of this.solves) solves.reset();
  }

  touch(tools: Tool[]): number {
    this.world.setTools(tools);
    const start = performance.now();
    const flags = this.world.touch(1 / this.rates.touch);
    this.touchMs += performance.now() - start;
    this.world.organs.forEach((organ, k) => this.solves[k].afterTouch(organ));
    return flags;
  }

  shape(): number {
    return this.world.organs.reduce((flags, organ) => flags | shapeOf(organ), 0);
  }

  // The surface of an organ in the last shape, in the world.
  fillPositions(organ: number, positions: Float32Array) {
    positions.set(this.world.organs[organ].positions);
    this.frames[organ].toWorld(positions);
  }

  force(tool: number): Vector {
    return [...this.world.force(tool)] as unknown as Vector;
  }

  destroy() {
    this.world.destroy();
  }
}

// Where an organ's frame is in the world.
export class OrganFrame {
  private turn: number[][] | null;
  private shift: ArrayLike<number> | null;

  constructor({ orientation, position }: Pose) {
    this.turn = orientation ? rotationOf(orientation) : null;
    this.shift = position ?? null;
  }

  // A vector of the world in the organ's frame.
  turnedToOrgan(v: Vector): Vector {
    const { turn } = this;
    return turn ? (v.map((_, d) => turn[0][d] * v[0] + turn[1][d] * v[1] + turn[2][d] * v[2]) as Vector) : v;
  }

  // points: [][3], in place.
  toWorld(points: Float32Array | number[]) {
    const { turn, shift } = this;
    for (let i = 0; (turn || shift) && i < points.length; i += 3) {
      const [x, y, z] = [points[i], points[i + 1], points[i + 2]];
      for (let d = 0; d < 3; ++d) points[i + d] = (turn ? turn[d][0] * x + turn[d][1] * y + turn[d][2] * z : [x, y, z][d]) + (shift ? shift[d] : 0);
    }
  }
}

function rotationOf(quaternion: ArrayLike<number>): number[][] {
  const [w, x, y, z] = Array.from(quaternion);
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
    [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
    [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
  ];
}
