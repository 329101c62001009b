// The tools of a scene of several organs at each touch, as palpate-run moves them.
import type { Grasp } from "../../module/links.js";
import type { Needle } from "../../module/needles.js";
import type { Runtime, Tool } from "../../module/palpate.js";
import { TOOL_COUNT, TOUCH_HZ, type DrawnLink, type Hold, type ToolFrame, type Vector } from "./messages";
import { valueAt, type MotionClocks } from "./motion_clocks";
import { alongRows } from "./path_files";
import type { RecordedTool } from "./recorder";
import { SceneLinks } from "./scene_links";
import { placeOn, type SurfacePlace } from "./surface_places";
import { nodesFor } from "./touch_scene";
import { OrganFrame, TouchWorld, type WorldPart } from "./touch_world";
import type { SceneGrasp, SceneNeedle, SceneTool, WorldScene } from "./world_scene";

export const MOST_NODES = 3000; // of palpate.h
const LEAST_OF_MANY = 1000, NODES_OF_DISC = 96, NODES_OF_PLACE = 4; // as palpate-run has them (programs/player/played_organ.cpp)
const NEEDLE_PLACES = 32; // where the file says nothing else
const DRAWN_OUTSIDE = 0.05; // m of a needle's shaft, which is drawn as long as its way and this

interface PlayedTool {
  tool: SceneTool;
  at: (time: number) => Vector;
  grasp: Grasp | null;
  graspNormal: Vector | null; // of the surface at rest where the jaws take it, in the world
  needle: Needle | null;
  needleLength: number; // m, as it is drawn
  openAt: Vector; // m, from the tool's place to its open jaws
}

export class ScenePlay {
  step = 0; // of the next touch
  readonly steps: number;
  private room: { maxTools: number; maxPoints: number }; // that each organ's scene needs
  private forces: Float64Array; // [step][tool][x y z] N, on the tool, of the touches until now
  private tools: PlayedTool[];
  private links: SceneLinks;
  private needlePlaces: number;

  // Throws an Error where a tool or a link has no place on its organ.
  constructor(private scene: WorldScene, private parts: WorldPart[]) {
    this.links = new SceneLinks(scene, parts);
    this.needlePlaces = scene.needlePlaces ?? NEEDLE_PLACES;
    this.tools = scene.tools.map((tool) => playedTool(tool, scene.organs[tool.organ].name, parts[tool.organ]));
    this.steps = Math.floor(durationOf(scene) * TOUCH_HZ * (1 + 1e-9)) + 1;
    this.forces = new Float64Array(3 * scene.tools.length * this.steps);
    const points = scene.tools.reduce((sum, tool) => sum + tool.points.length, 0);
    this.room = { maxTools: scene.tools.length, maxPoints: scene.maxPoints ?? Math.max(1, points) };
  }

  // A world for the scene's tools alone, as palpate-run has it.
  makeWorld(runtime: Runtime): TouchWorld {
    const { pairs, friction, forceLimit, forceSlew } = this.scene, maxLinks = this.links.count(null);
    const made = new TouchWorld(runtime, this.parts.map((part, k) => this.partOf(part, k)), { forceLimit, forceSlew, maxPairs: pairs, friction, maxLinks });
    this.links.hold(made, 0);
    return made;
  }

  // The effects of an organ in that world.
  private partOf(part: WorldPart, organ: number): WorldPart {
    const { maxPoints } = this.room, grasps = this.scene.tools.filter((tool) => tool.organ === organ).flatMap(({ grasp }) => grasp ?? []);
    const held = grasps.reduce((sum, { opposite }) => sum + NODES_OF_DISC * (opposite ? 2 : 1), 0);
    const needles = this.scene.tools.filter((tool) => tool.organ === organ && tool.needle).length, pierced = NODES_OF_PLACE * (this.needlePlaces + 2) * needles;
    const nodes = Math.min(MOST_NODES, Math.max(3 * maxPoints, Math.min(LEAST_OF_MANY, nodesFor(part.effects, maxPoints))) + held + this.links.nodes(organ) + pierced);
    const holds = { maxLinks: this.links.count(organ), grasps: grasps.length > 0, needles: needles > 0, needlePlaces: this.needlePlaces };
    return { ...part, effects: { ...part.effects, ...this.room, maxContactNodes: this.scene.maxContactNodes ?? nodes, ...holds } };
  }

  // The next touch, of the tools at these places. Returns its flags.
  touch(world: TouchWorld, clocks: MotionClocks, places: (Vector | null)[]): number {
    clocks.goTo(this.time);
    clocks.move(world.world);
    this.links.hold(world, this.time);
    const flags = world.touch(places.map((place, t) => this.tool(t, place)));
    this.tools.forEach((_, t) => this.forces.set(world.force(t), 3 * (this.tools.length * this.step + t)));
    ++this.step;
    return flags;
  }

  // Of all tools, in the touches until now.
  get felt(): Float64Array {
    return this.forces.slice(0, 3 * this.tools.length * this.step);
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

  private tool(index: number, place: Vector | null): Tool {
    const { tool, grasp, needle } = this.tools[index], { discRadius, friction, hold, organ } = tool;
    const shape = { id: index, discRadius, friction, hold, organ, reference: grasp || needle ? (place ?? [0, 0, 0]) : undefined };
    if (!place) return shape;
    const closed = grasp && graspAt(tool.grasp!, grasp, place, this.time);
    return {
      ...shape, points: tool.points.flatMap((point) => place.map((x, d) => x + point[d])), ...(closed ? { grasp: closed } : {}),
      ...(needle ? { needle: { ...needle, tip: place } } : {}),
    };
  }

  // How a tool of the last touch is drawn, in place of a finger or a probe.
  drawn(index: number, place: Vector, { world }: TouchWorld): Partial<ToolFrame> {
    const { tool, grasp, graspNormal, needle, needleLength, openAt } = this.tools[index], organ = world.organs[tool.organ];
    if (needle) {
      return { depth: organ.needle(index)?.depth ?? 0, radius: needle.radius, body: { kind: "needle", axis: [...Array.from(needle.direction)] as Vector, length: needleLength } };
    }
    if (!grasp) return { radius: tool.discRadius };
    const state = organ.grasp(index), closed = state?.condition === "holds" || state?.condition === "slips";
    // The jaws are drawn where the tissue is that they hold, which need not be on the tool's path.
    if (closed) state!.place.forEach((x, d) => (openAt[d] = x - place[d]));
    return { point: place.map((x, d) => x + openAt[d]) as Vector, normal: graspNormal, radius: grasp.radius, body: { kind: "jaws", closed } };
  }

  // What holds tissue after the last touch.
  told(world: TouchWorld): Hold[] {
    const ofTools = this.tools.flatMap(({ tool: { name, organ: of, needle, grasp } }, t): Hold[] => {
      const organ = world.world.organs[of];
      if (needle) {
        const state = organ.needle(t);
        return [{ kind: "needle", name, condition: state?.condition ?? "outside", depth: state?.depth ?? 0, isFull: (state?.places ?? 0) >= this.needlePlaces }];
      }
      return grasp ? [{ kind: "grasp", name, condition: organ.grasp(t)?.condition ?? "open" }] : [];
    });
    return [...ofTools, ...this.links.told(world)];
  }

  drawnLinks(world: TouchWorld): DrawnLink[] {
    return this.links.drawn(world);
  }
}

// The tools for a frame, of which the page has two at the least.
export const presentAt = (places: (Vector | null)[]): RecordedTool[] =>
  Array.from({ length: Math.max(TOOL_COUNT, places.length) }, (_, t) => (places[t] ? { point: places[t], hold: false } : null));

// s, to the last row of a tool or a motion.
function durationOf({ tools, motions }: WorldScene): number {
  const ofTools = tools.flatMap(({ path, place, grasp }) => [path, place?.depth, grasp?.closing]);
  return Math.max(0, ...[...ofTools, ...motions.map(({ rows }) => rows)].map((rows) => rows?.at(-1)![0] ?? 0));
}

function playedTool(tool: SceneTool, organ: string, { bundle, pose }: WorldPart): PlayedTool {
  const at = (near: Vector) => placeOn(bundle, near, `[[tool]] ${tool.name}`, organ), { grasp, needle, place } = tool, frame = new OrganFrame(pose);
  const entry = needle && at(needle.entry), into = needle && (needle.direction ?? opposite(entry!.normal));
  const rows = tool.path ?? pathInto(place!, at(place!.near), into, frame), taken = grasp && at(grasp.near), first = grasp?.closed[0]?.[0] ?? 0;
  const held: Grasp | null = grasp && {
    place: taken!, ...(grasp.opposite ? { opposite: at(grasp.opposite) } : {}), position: [0, 0, 0], radius: grasp.radius,
    friction: grasp.friction, clampForce: grasp.clampForce,
  };
  const takenAt = taken && inWorld(taken.point, frame), from = alongRows(rows)(first);
  return {
    tool, at: alongRows(rows), grasp: held, graspNormal: taken && turnedIntoWorld(taken.normal, frame), openAt: (takenAt ? takenAt.map((x, d) => x - from[d]) : [0, 0, 0]) as Vector,
    needle: needle && neededBy(needle, entry!, turnedIntoWorld(into!, frame)),
    needleLength: Math.max(...rows.map(([, ...end]) => Math.hypot(...end.map((x, d) => x - rows[0][d + 1])))) + DRAWN_OUTSIDE,
  };
}

const neededBy = ({ radius, friction, punctureForce, cuttingForce, spacing }: SceneNeedle, place: SurfacePlace, direction: Vector): Needle =>
  ({ place, tip: [0, 0, 0], direction, radius, friction, punctureForce, cuttingForce, spacing });

const opposite = (normal: Vector) => normal.map((x) => -x) as Vector;

function inWorld(point: Vector, frame: OrganFrame): Vector {
  const moved = [...point];
  frame.toWorld(moved);
  return moved as Vector;
}
function turnedIntoWorld(direction: Vector, frame: OrganFrame): Vector {
  const origin = inWorld([0, 0, 0], frame);
  return inWorld(direction, frame).map((x, d) => x - origin[d]) as Vector;
}

// Along the normal of the place, or along a needle, in the world.
function pathInto({ depth }: { depth: number[][] }, { point, normal }: SurfacePlace, into: Vector | null, frame: OrganFrame): number[][] {
  const along = into ?? opposite(normal);
  return depth.map(([time, deep]) => {
    const place = point.map((x, d) => x + deep * along[d]);
    frame.toWorld(place);
    return [time, ...place];
  });
}

// The jaws at a time; null: they are open. id: which closing it is.
function graspAt({ closed, closing }: SceneGrasp, grasp: Grasp, position: Vector, time: number): Grasp | null {
  const id = closed.findIndex(([from, until]) => from <= time && time < until);
  if (closed.length && id < 0) return null;
  return { ...grasp, position, id: Math.max(0, id), ...(closing ? { closing: valueAt(closing, time) } : {}) };
}
