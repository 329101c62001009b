// The tools of a scene of several organs at each touch, as palpate-run moves them.
import type { Pose, Runtime } from "../../module/palpate.js";
import { TOOL_COUNT, TOUCH_HZ, type DrawnLink, type Hold, type ToolFrame, type Vector } from "./messages";
import type { MotionClocks } from "./motion_clocks";
import type { RecordedTool } from "./recorder";
import { nodesOfCut, SceneBlades } from "./scene_blades";
import { SceneLinks } from "./scene_links";
import { LONGEST_PATH } from "./path_files";
import { OBSTACLE_NODES, SceneObstacles } from "./scene_obstacles";
import { SceneLoads } from "./scene_loads";
import { PlayedTool } from "./scene_tool";
import { nodesFor } from "./touch_scene";
import { TouchWorld, type WorldPart } from "./touch_world";
import { durationOf } from "./world_reader";
import type { WorldScene } from "./world_scene";

export const MOST_NODES = 3000; // of palpate.h
const LEAST_OF_MANY = 1000, NODES_OF_DISC = 96, NODES_OF_PLACE = 4; // as palpate-run has them (programs/player/played_organ.cpp)
const FAST = 20; // s: a scene of more than LONGEST_PATH plays in this time
const NEEDLE_PLACES = 32; // where the file says nothing else

export class ScenePlay {
  step = 0; // of the next touch
  private pace: number; // touches of the scene for each of the page
  private owed = 0; // part of a touch that is not yet due
  readonly steps: number;
  private room: { maxTools: number; maxPoints: number }; // that each organ's scene needs
  private forces: Float64Array; // [step][tool][x y z] N, on the tool, of the touches until now
  private tools: PlayedTool[];
  private links: SceneLinks;
  private loads: SceneLoads;
  private obstacles: SceneObstacles;
  private blades: SceneBlades;
  private needlePlaces: number;

  // Throws an Error where a tool or a link has no place on its organ.
  constructor(private scene: WorldScene, private parts: WorldPart[]) {
    this.links = new SceneLinks(scene, parts);
    this.loads = new SceneLoads(scene, parts);
    this.obstacles = new SceneObstacles(scene);
    this.blades = new SceneBlades(scene);
    this.needlePlaces = scene.needlePlaces ?? NEEDLE_PLACES;
    this.tools = scene.tools.map((tool, t) => new PlayedTool(tool, t, scene.organs[tool.organ].name, parts[tool.organ]));
    const duration = durationOf(scene), { touch } = scene.rates;
    this.steps = Math.floor(duration * touch * (1 + 1e-9)) + 1;
    this.pace = Math.min(1, (duration > LONGEST_PATH ? duration / FAST : 1) * (touch / TOUCH_HZ));
    this.forces = new Float64Array(3 * scene.tools.length * this.steps);
    const points = this.tools.reduce((sum, tool) => sum + tool.pointsAndGrips, 0);
    this.room = { maxTools: scene.tools.length, maxPoints: scene.maxPoints ?? Math.max(1, points) };
  }

  // A world for the scene's tools alone, as palpate-run has it.
  makeWorld(runtime: Runtime): TouchWorld {
    const { pairs, friction, forceLimit, forceSlew } = this.scene, maxLinks = this.links.count(null);
    const made = new TouchWorld(runtime, this.parts.map((part, k) => this.partOf(part, k)), { forceLimit, forceSlew, maxPairs: pairs, friction, maxLinks }, this.scene.rates);
    this.links.hold(made, 0);
    return made;
  }

  // The effects of an organ in that world.
  private partOf(part: WorldPart, organ: number): WorldPart {
    const { maxPoints } = this.room, grasps = this.scene.tools.filter((tool) => tool.organ === organ).flatMap(({ grasp }) => grasp ?? []);
    const held = grasps.reduce((sum, { opposite }) => sum + NODES_OF_DISC * (opposite ? 2 : 1), 0);
    const needles = this.scene.tools.filter((tool) => tool.organ === organ && tool.needle).length, pierced = NODES_OF_PLACE * (this.needlePlaces + 2) * needles;
    const obstacles = this.obstacles.of(organ);
    const nodes = Math.min(MOST_NODES, Math.max(3 * maxPoints, Math.min(LEAST_OF_MANY, nodesFor(part.effects, maxPoints))) + held + this.links.nodes(organ) + pierced + (obstacles.length ? this.obstacleNodes : 0) + (part.effects.cut ? nodesOfCut(this.scene.cutPoints, this.scene.cutLips) : 0));
    const holds = { maxLinks: this.links.count(organ), loads: this.loads.patches(organ), obstacles, obstacleNodes: this.obstacleNodes, grasps: grasps.length > 0, needles: needles > 0, needlePlaces: this.needlePlaces };
    return { ...part, effects: { ...part.effects, ...this.room, maxContactNodes: this.scene.maxContactNodes ?? nodes, ...holds } };
  }

  private get obstacleNodes(): number {
    return this.scene.obstacleNodes ?? OBSTACLE_NODES;
  }

  // Whether a touch of the scene is due at a touch of the page, of which there are TOUCH_HZ a second.
  isDue(): boolean {
    this.owed += this.pace;
    if (this.step > 0 && this.owed < 1) return false;
    this.owed = Math.max(0, this.owed - 1);
    return true;
  }

  // How many times as fast as in life the scene plays.
  get speed(): number {
    return (this.pace * TOUCH_HZ) / this.scene.rates.touch;
  }

  // The next touch, of the tools at these places. Returns its flags.
  touch(world: TouchWorld, clocks: MotionClocks, places: (Vector | null)[]): number {
    clocks.goTo(this.time);
    clocks.move(world.world);
    this.links.hold(world, this.time);
    this.loads.hold(world, this.time);
    this.obstacles.hold(world, this.time);
    this.blades.hold(world, this.time);
    const flags = world.touch(places.map((place, t) => this.tools[t].sent(place, this.time)));
    this.tools.forEach((_, t) => this.forces.set(world.force(t), 3 * (this.tools.length * this.step + t)));
    ++this.step;
    return flags;
  }

  // Of all tools, in the touches until now.
  get felt(): Float64Array {
    return this.forces.slice(0, 3 * this.tools.length * this.step);
  }

  get time(): number {
    return this.step / this.scene.rates.touch;
  }
  // s of the whole scene.
  get lasts(): number {
    return (this.steps - 1) / this.scene.rates.touch;
  }
  get isDone(): boolean {
    return this.step >= this.steps;
  }

  // Where each tool is now; null: it is away.
  places(): (Vector | null)[] {
    const { time } = this;
    return this.tools.map((tool) => (tool.isAway(time) ? null : tool.at(time)));
  }

  // How a tool of the last touch is drawn, in place of a finger or a probe.
  drawn(index: number, place: Vector, { world }: TouchWorld): Partial<ToolFrame> {
    return this.tools[index].drawn(place, world);
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

  // Where the obstacles are now.
  get drawnObstacles(): Pose[] {
    return this.obstacles.poses(this.time);
  }

  // Of the blades that are there, from heel to tip.
  get edges(): Vector[][] {
    return this.blades.edges;
  }

  drawnLinks(world: TouchWorld): DrawnLink[] {
    return this.links.drawn(world);
  }
}

// The tools for a frame, of which the page has two at the least.
export const presentAt = (places: (Vector | null)[]): RecordedTool[] =>
  Array.from({ length: Math.max(TOOL_COUNT, places.length) }, (_, t) => (places[t] ? { point: places[t], hold: false } : null));
