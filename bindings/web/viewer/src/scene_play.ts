// The tools of a scene of several organs at each touch, as palpate-run moves them.
import type { Bundle, Grasp, Tool } from "../../module/palpate.js";
import { TOUCH_HZ, type Vector } from "./messages";
import { valueAt } from "./motion_clocks";
import { alongRows } from "./path_files";
import { nearestPlace, type SurfacePlace } from "./surface_places";
import { nodesFor } from "./touch_scene";
import { OrganFrame, type WorldPart } from "./touch_world";
import type { SceneGrasp, SceneTool, WorldScene } from "./world_scene";
import { word } from "./words";

const MOST_NODES = 3000, LEAST_OF_MANY = 1000, NODES_OF_DISC = 96; // as palpate-run has them (programs/player/played_organ.cpp)

interface PlayedTool {
  tool: SceneTool;
  at: (time: number) => Vector;
  grasp: Grasp | null;
}

export class ScenePlay {
  step = 0; // of the next touch
  readonly steps: number;
  readonly room: { maxTools: number; maxPoints: number }; // that each organ's scene needs
  readonly forces: Float64Array; // [step][tool][x y z] N, on the tool, of the touches until now
  private tools: PlayedTool[];

  // Throws an Error where a tool has no place on its organ.
  constructor(private scene: WorldScene, parts: WorldPart[]) {
    this.tools = scene.tools.map((tool) => playedTool(tool, scene.organs[tool.organ].name, parts[tool.organ]));
    this.steps = Math.floor(durationOf(scene) * TOUCH_HZ * (1 + 1e-9)) + 1;
    this.forces = new Float64Array(3 * scene.tools.length * this.steps);
    const points = scene.tools.reduce((sum, tool) => sum + tool.points.length, 0);
    this.room = { maxTools: scene.tools.length, maxPoints: scene.maxPoints ?? Math.max(1, points) };
  }

  // The effects of an organ in the world that plays the scene.
  partOf(part: WorldPart, organ: number): WorldPart {
    const { maxPoints } = this.room, grasps = this.scene.tools.filter((tool) => tool.organ === organ).flatMap(({ grasp }) => grasp ?? []);
    const held = grasps.reduce((sum, { opposite }) => sum + NODES_OF_DISC * (opposite ? 2 : 1), 0);
    const nodes = Math.min(MOST_NODES, Math.max(3 * maxPoints, Math.min(LEAST_OF_MANY, nodesFor(part.effects, maxPoints))) + held);
    return { ...part, effects: { ...part.effects, ...this.room, maxContactNodes: this.scene.maxContactNodes ?? nodes, grasps: grasps.length > 0 } };
  }

  get time(): number {
    return this.step / TOUCH_HZ;
  }
  get isDone(): boolean {
    return this.step >= this.steps;
  }

  // Where each tool is now; null: it is away.
  places(): (Vector | null)[] {
    const { time } = this;
    return this.tools.map(({ tool, at }) => (tool.away.some(([from, until]) => from <= time && time < until) ? null : at(time)));
  }

  // After a touch.
  note(forceOn: (tool: number) => Vector) {
    this.tools.forEach((_, t) => this.forces.set(forceOn(t), 3 * (this.tools.length * this.step + t)));
    ++this.step;
  }

  tool(index: number, place: Vector | null): Tool {
    const { tool, grasp } = this.tools[index], { discRadius, friction, hold, organ } = tool;
    const shape = { discRadius, friction, hold, organ, reference: tool.grasp ? (place ?? [0, 0, 0]) : undefined };
    if (!place) return shape;
    const closed = grasp && graspAt(tool.grasp!, grasp, place, this.time);
    return { ...shape, points: tool.points.flatMap((point) => place.map((x, d) => x + point[d])), ...(closed ? { grasp: closed } : {}) };
  }
}

// s, to the last row of a tool or a motion.
function durationOf({ tools, motions }: WorldScene): number {
  const ofTools = tools.flatMap(({ path, place, grasp }) => [path, place?.depth, grasp?.closing]);
  return Math.max(0, ...[...ofTools, ...motions.map(({ rows }) => rows)].map((rows) => rows?.at(-1)![0] ?? 0));
}

function playedTool(tool: SceneTool, organ: string, { bundle, pose }: WorldPart): PlayedTool {
  const at = (near: Vector) => placeOn(bundle, near, tool.name, organ), { grasp, place } = tool;
  const held: Grasp | null = grasp && {
    place: at(grasp.near), ...(grasp.opposite ? { opposite: at(grasp.opposite) } : {}), position: [0, 0, 0], radius: grasp.radius,
    friction: grasp.friction, clampForce: grasp.clampForce,
  };
  return { tool, at: alongRows(tool.path ?? pathInto(place!, at(place!.near), new OrganFrame(pose))), grasp: held };
}

// Along the normal of the place, in the world.
function pathInto({ depth }: { depth: number[][] }, { point, normal }: SurfacePlace, frame: OrganFrame): number[][] {
  return depth.map(([time, deep]) => {
    const place = point.map((x, d) => x - deep * normal[d]);
    frame.toWorld(place);
    return [time, ...place];
  });
}

function placeOn(bundle: Bundle, near: Vector, tool: string, organ: string): SurfacePlace {
  const place = nearestPlace(bundle, near), away = place ? Math.hypot(...place.point.map((x, d) => x - near[d])) : 0;
  if (!place || away > diagonalOf(bundle)) throw new Error(word(place ? "world.far" : "world.untouchable", { tool, organ, away: (1000 * away).toPrecision(3) }));
  return place;
}

function diagonalOf({ info, nodes }: Bundle): number {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < 3 * info.surfaceNodeCount; ++i) (low[i % 3] = Math.min(low[i % 3], nodes[i])), (high[i % 3] = Math.max(high[i % 3], nodes[i]));
  return Math.hypot(...low.map((x, d) => high[d] - x));
}

// The jaws at a time; null: they are open. id: which closing it is.
function graspAt({ closed, closing }: SceneGrasp, grasp: Grasp, position: Vector, time: number): Grasp | null {
  const id = closed.findIndex(([from, until]) => from <= time && time < until);
  if (closed.length && id < 0) return null;
  return { ...grasp, position, id: Math.max(0, id), ...(closing ? { closing: valueAt(closing, time) } : {}) };
}
