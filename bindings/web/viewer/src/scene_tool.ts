// One tool of a scene: where it is at each time, how it is turned, and what it holds, as palpate-run moves it (programs/player/played_tools.cpp).
import { Quaternion, Vector3 } from "three";
import type { Grasp } from "../../module/links.js";
import type { Needle } from "../../module/needles.js";
import type { Bundle, Grip, Tool, World } from "../../module/palpate.js";
import type { ToolFrame, Vector } from "./messages";
import { valueAt } from "./motion_clocks";
import { alongRows } from "./path_files";
import { farthestPlace, placeOn, type SurfacePlace } from "./surface_places";
import { OrganFrame, type WorldPart } from "./touch_world";
import type { SceneGrasp, SceneGrip, SceneNeedle, ScenePlace, SceneTool, Side } from "./world_scene";
import { word } from "./words";

const DRAWN_OUTSIDE = 0.05; // m of a needle's shaft, which is drawn as long as its way and this

type OnOrgan = Pick<SurfacePlace, "point" | "normal">;

export class PlayedTool {
  readonly at: (time: number) => Vector;
  private rows: number[][]; // s, x, y, z m
  private turnAt: (time: number) => Vector; // degrees
  private turn = new Quaternion(); // of the last touch
  private grips: Grip[];
  private taken: SurfacePlace | null; // where the jaws take the tissue
  private held: Grasp | null;
  private needle: Needle | null;
  private needleLength: number; // m, as it is drawn
  private openAt: Vector; // m, from the tool's place to its open jaws
  private frame: OrganFrame;

  // Throws an Error where the tool has no place on its organ.
  constructor(readonly tool: SceneTool, private index: number, organ: string, { bundle, pose }: WorldPart) {
    const what = `[[tool]] ${tool.name}`, on = (near: Vector) => placeOn(bundle, near, what, organ), { grasp, needle, place } = tool;
    this.frame = new OrganFrame(pose);
    const own = place && scenePlaceOn(bundle, place, what, organ), entry = needle && on(needle.entry ?? own!.point);
    const into = needle && (needle.direction ?? opposite(entry!.normal));
    this.rows = tool.path ?? pathInto(place!, own!, into, this.frame);
    this.at = alongRows(this.rows);
    this.turnAt = alongRows(tool.turn ?? [[0, 0, 0, 0]]);
    this.grips = tool.grips.flatMap((grip) => nodesOf(grip, bundle, what).map((node) => ({ node, axes: grip.axes, displacement: [0, 0, 0] })));
    this.taken = grasp && on(grasp.near);
    this.held = grasp && graspOf(grasp, this.taken!, grasp.opposite && on(grasp.opposite));
    const takenAt = this.taken && inWorld(this.taken.point, this.frame), from = alongRows(this.rows)(grasp?.closed[0]?.[0] ?? 0);
    this.openAt = (takenAt ? takenAt.map((x, d) => x - from[d]) : [0, 0, 0]) as Vector;
    this.needle = needle && needleOf(needle, entry!, turnedIntoWorld(into!, this.frame));
    this.needleLength = Math.max(...this.rows.map(([, ...end]) => Math.hypot(...end.map((x, d) => x - this.rows[0][d + 1])))) + DRAWN_OUTSIDE;
  }

  get pointsAndGrips(): number {
    return this.tool.points.length + this.grips.length;
  }

  isAway(time: number): boolean {
    return this.tool.away.some(([from, until]) => from <= time && time < until);
  }

  // For a touch. place: where it is; null: it is away.
  sent(place: Vector | null, time: number): Tool {
    const { discRadius, friction, hold, organ, points, grasp } = this.tool;
    const shape = { id: this.index, discRadius, friction, hold, organ, reference: this.held || this.needle ? (place ?? [0, 0, 0]) : undefined };
    this.turnTo(time);
    if (!place) return shape;
    const closed = this.held && graspAt(grasp!, this.held, place, this.turn, time);
    return {
      ...shape, points: points.flatMap((point) => this.turned(point).map((x, d) => place[d] + x)), grips: this.movedGrips(place), ...(closed ? { grasp: closed } : {}),
      ...(this.needle ? { needle: { ...this.needle, tip: place, direction: this.turned(this.needle.direction as Vector) } } : {}),
    };
  }

  // How the tool of the last touch is drawn, in place of a finger or a probe.
  drawn(place: Vector, world: World): Partial<ToolFrame> {
    const { held, needle, needleLength, openAt } = this, organ = world.organs[this.tool.organ];
    if (needle) {
      return { depth: organ.needle(this.index)?.depth ?? 0, radius: needle.radius, body: { kind: "needle", axis: this.turned(needle.direction as Vector), length: needleLength } };
    }
    if (!held) return { radius: this.tool.discRadius };
    const state = organ.grasp(this.index), closed = state?.condition === "holds" || state?.condition === "slips";
    // The jaws are drawn where the tissue is that they hold, which need not be on the tool's path.
    if (closed) state!.place.forEach((x, d) => (openAt[d] = x - place[d]));
    const normal = this.turned(turnedIntoWorld(this.taken!.normal, this.frame));
    return { point: place.map((x, d) => x + openAt[d]) as Vector, normal, radius: held.radius, body: { kind: "jaws", closed } };
  }

  private turnTo(time: number) {
    if (!this.tool.turn) return;
    const axis = new Vector3(...this.turnAt(time)), degrees = axis.length();
    this.turn.setFromAxisAngle(axis.normalize(), (degrees * Math.PI) / 180);
  }

  private turned(v: Vector): Vector {
    return this.tool.turn ? (new Vector3(...v).applyQuaternion(this.turn).toArray() as Vector) : v;
  }

  private movedGrips(place: Vector): Grip[] {
    const way = this.frame.turnedToOrgan(place.map((x, d) => x - this.rows[0][d + 1]) as Vector);
    return this.grips.map((grip) => ({ ...grip, displacement: way }));
  }
}

// The direction in the frame's axes; LPS: x to the left, y to the back, z to the head. RAS: x to the right, y to the front.
function directionOf(side: Side, frame: string): Vector {
  const turned = frame === "RAS" ? -1 : 1;
  const directions: Record<Side, Vector> = {
    foremost: [0, -turned, 0], hindmost: [0, turned, 0], leftmost: [turned, 0, 0], rightmost: [-turned, 0, 0], uppermost: [0, 0, 1], lowest: [0, 0, -1],
  };
  return directions[side];
}

// Where `near` or `at` is on an organ. Throws an Error where there is no such place. what: the part of the scene that asks, for the Error.
export function scenePlaceOn(bundle: Bundle, { near, at }: Pick<ScenePlace, "near" | "at">, what: string, organ: string): OnOrgan {
  if (near) return placeOn(bundle, near, what, organ);
  const { frame } = JSON.parse(bundle.provenance) as { frame?: string };
  if (frame !== "LPS" && frame !== "RAS") throw new Error(word("world.frame", { what: `${what} at`, found: frame ?? "" }));
  const place = farthestPlace(bundle, directionOf(at!, frame));
  if (!place) throw new Error(word("world.untouchable", { what, organ, away: "" }));
  return place;
}

// The touchable nodes that a grip holds.
function nodesOf({ nearest, box }: SceneGrip, { nodes, touchable }: Bundle, what: string): number[] {
  const placeOfNode = (node: number) => nodes.subarray(3 * node, 3 * node + 3), away = (node: number) => Math.hypot(...placeOfNode(node).map((x, d) => x - nearest![d]));
  const all = [...touchable];
  const found = box ? all.filter((node) => placeOfNode(node).every((x, d) => box[0][d] <= x && x <= box[1][d])) : all.length ? [all.reduce((best, node) => (away(node) < away(best) ? node : best))] : [];
  if (!found.length) throw new Error(word("world.no-nodes", { what: `${what} grip` }));
  return found;
}

const graspOf = ({ radius, friction, clampForce }: SceneGrasp, place: SurfacePlace, other: SurfacePlace | null): Grasp =>
  ({ place, ...(other ? { opposite: other } : {}), position: [0, 0, 0], radius, friction, clampForce });

const needleOf = ({ radius, friction, punctureForce, cuttingForce, spacing }: SceneNeedle, place: SurfacePlace, direction: Vector): Needle =>
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
function pathInto({ depth }: ScenePlace, { point, normal }: OnOrgan, into: Vector | null, frame: OrganFrame): number[][] {
  const along = into ?? opposite(normal);
  return depth.map(([time, deep]) => {
    const place = point.map((x, d) => x + deep * along[d]);
    frame.toWorld(place);
    return [time, ...place];
  });
}

// The jaws at a time; null: they are open. id: which closing it is.
function graspAt({ closed, closing }: SceneGrasp, grasp: Grasp, position: Vector, { w, x, y, z }: Quaternion, time: number): Grasp | null {
  const id = closed.findIndex(([from, until]) => from <= time && time < until);
  if (closed.length && id < 0) return null;
  return { ...grasp, position, orientation: [w, x, y, z], id: Math.max(0, id), ...(closing ? { closing: valueAt(closing, time) } : {}) };
}
