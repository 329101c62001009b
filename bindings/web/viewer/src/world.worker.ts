// The engine's thread of the page of several organs: opens a scene's bundles, touches all organs at a fixed rate, moves them by their
// motions, and computes their shapes when the page asks for a frame.
import { PalpateError, type Bundle, type Pose, type Runtime } from "../../module/palpate.js";
import { meshOf, provenanceOf } from "./bundle_mesh";
import { DEFAULT_TOOL } from "./effects";
import { answerOf, FrameCounts, openStream, startRuntime } from "./engine_thread";
import { lengthOf } from "./geometry";
import { HeldTools } from "./held_tools";
import { frameArrays, frameBytes, TOOL_COUNT, TOUCH_HZ, type ColourBy, type ToolFrame, type ToolTarget } from "./messages";
import { MotionClocks } from "./motion_clocks";
import type { RecordedTool } from "./recorder";
import { saidOf } from "./said";
import { SceneLinks } from "./scene_links";
import { OBSTACLE_NODES, SceneObstacles } from "./scene_obstacles";
import { SceneLoads } from "./scene_loads";
import { MOST_NODES, presentAt, ScenePlay } from "./scene_play";
import { SurfaceColours, surfaceOf } from "./surface_colours";
import { TouchLoop } from "./touch_loop";
import { nodesFor, PageTools, SCENE_TOOLS } from "./touch_scene";
import { OrganFrame, TouchWorld, type WorldPart } from "./touch_world";
import type { FromWorldWorker, OrganForces, ToWorldWorker, WorldFile, WorldFrame, WorldSettings } from "./world_messages";
import type { WorldScene } from "./world_scene";
import { useLanguage, word } from "./words";

const PAIRS = 200; // where organs touch one another and the scene's file says nothing else

const say = (message: FromWorldWorker, transfer: Transferable[] = []) => postMessage(message, { transfer });

// A scene that is open.
interface Opened {
  scene: WorldScene;
  bundles: Bundle[];
  parts: WorldPart[];
  clocks: MotionClocks;
  links: SceneLinks;
  obstacles: Pose[]; // at the begin of the scene
  surfaces: { colours: SurfaceColours; first: number; nodes: number }[]; // first: among the nodes of all organs
  nodes: number;
}

let runtime: Runtime | null = null;
let opened: Opened | null = null;
let world: TouchWorld | null = null;
let settings: WorldSettings;
let tools: PageTools;
let colourBy: ColourBy = "dent";

// ---- opening ---------------------------------------------------------------------------------------------------------

let openings = 0; // so far; an earlier one that is still under way is given up

async function open(scene: WorldScene, files: WorldFile[], of: number[], wanted: WorldSettings) {
  const bundles: Bundle[] = [], number = ++openings;
  try {
    runtime = await startRuntime();
    for (const file of files) {
      const bundle = await bundleOf(runtime, file);
      bundles.push(bundle);
      await named(file.name, async () => bundle.check());
    }
    if (number !== openings) return bundles.forEach((bundle) => bundle.close());
    const parts = scene.organs.map(({ effects, pose }, k) => ({ bundle: bundles[of[k]], effects, pose }));
    const next = openedScene(scene, bundles, parts), first = touchedWorld(next, wanted);
    close();
    opened = next;
    take(first, wanted);
    say({
      type: "opened", frame: String(provenanceOf(parts[0].bundle).frame), clocks: next.clocks.states,
      organs: scene.organs.map(({ name }, k) => ({ name, mesh: meshInWorld(parts[k]), nodes: parts[k].bundle.info.nodeCount })),
    });
  } catch (error) {
    for (const bundle of bundles) bundle.close();
    if (number !== openings) return;
    say({ type: "refused", what: "world", message: saidOf(error), byteOffset: error instanceof PalpateError || error instanceof NamedError ? error.byteOffset : 0 });
  }
}

function bundleOf(engine: Runtime, { name, source }: WorldFile): Promise<Bundle> {
  return named(name, async () => {
    if (typeof source !== "string") return engine.openBundle(new Uint8Array(source));
    const answer = await answerOf(source);
    if (!answer) throw new Error(word("world.absent"));
    return openStream(engine, answer, (done, total) => say({ type: "progress", name, done, total }));
  });
}

// Of a bundle that the runtime refuses, said in the page's language.
class NamedError extends Error {
  readonly byteOffset: number;
  constructor({ message, byteOffset }: PalpateError) {
    super(message);
    this.byteOffset = byteOffset;
  }
}

// The error's sentence, with the file's name in front.
async function named<Made>(name: string, make: () => Promise<Made>): Promise<Made> {
  try {
    return await make();
  } catch (error) {
    (error as Error).message = `${name}: ${saidOf(error)}`;
    throw error instanceof PalpateError ? new NamedError(error) : error;
  }
}

function openedScene(scene: WorldScene, bundles: Bundle[], parts: WorldPart[]): Opened {
  let nodes = 0;
  const surfaces = parts.map(({ bundle }) => {
    const { positions, triangles } = meshOf(bundle), surface = surfaceOf(positions, triangles), first = nodes;
    nodes += positions.length / 3;
    return { colours: new SurfaceColours(surface, surface.spacing), first, nodes: positions.length / 3 };
  });
  return { scene, bundles, parts, surfaces, nodes, clocks: new MotionClocks(scene, parts.map(({ bundle }) => bundle.motions)), links: new SceneLinks(scene, parts), obstacles: new SceneObstacles(scene).poses(0) };
}

function meshInWorld({ bundle, pose }: WorldPart) {
  const mesh = meshOf(bundle);
  new OrganFrame(pose).toWorld(mesh.positions);
  return mesh;
}

function close() {
  forget();
  world?.destroy();
  for (const bundle of opened?.bundles ?? []) bundle.close();
  world = opened = null;
}

// The world that the pointer touches. The scene's links, loads and obstacles hold its organs as they do at the begin of the scene.
function touchedWorld({ scene, parts, links }: Opened, { law, touch, friction }: WorldSettings): TouchWorld {
  const room = { maxTools: SCENE_TOOLS, maxPoints: SCENE_TOOLS }, loads = new SceneLoads(scene, parts), obstacles = new SceneObstacles(scene), obstacleNodes = scene.obstacleNodes ?? OBSTACLE_NODES;
  const organs = parts.map((part, k) => {
    const effects = { ...part.effects, law }, own = obstacles.of(k);
    return { ...part, effects: { ...effects, ...room, maxContactNodes: Math.min(MOST_NODES, nodesFor(effects, SCENE_TOOLS) + links.nodes(k) + (own.length ? obstacleNodes : 0)), obstacles: own, obstacleNodes, maxLinks: links.count(k), loads: loads.patches(k) } };
  });
  const options = { ...limitsOf(scene), maxPairs: touch ? scene.pairs || PAIRS : 0, friction: touch ? friction : 0, maxLinks: links.count(null) };
  const made = new TouchWorld(runtime!, organs, options);
  new SceneLinks(scene, parts).hold(made, 0);
  loads.hold(made, 0);
  return made;
}

const limitsOf = ({ forceLimit, forceSlew }: WorldScene) => ({ forceLimit, forceSlew });

// Takes the place of the world before.
function take(next: TouchWorld, wanted: WorldSettings) {
  forget();
  world?.destroy();
  world = next;
  settings = wanted;
  const hasDisc = opened!.parts.some(({ effects }) => effects.contact === "patch");
  tools = new PageTools(hasDisc ? wanted.discRadius : 0, wanted.law === "coulomb" ? DEFAULT_TOOL.friction : 0);
  touchNothing();
}

function change(wanted: WorldSettings) {
  if (!opened) return;
  try {
    take(touchedWorld(opened, wanted), wanted);
    say({ type: "accepted", settings });
  } catch (error) {
    say({ type: "refused", what: "settings", message: saidOf(error), byteOffset: 0 });
  }
}

// ---- the touch loop --------------------------------------------------------------------------------------------------

const held = new HeldTools();
const loop = new TouchLoop(() => world !== null && step());
let play: ScenePlay | null = null;
const counts = new FrameCounts();
let present: RecordedTool[] = Array(TOOL_COUNT).fill(null);

// Returns whether there are tools or motions.
function step(): boolean {
  if (play?.isDone) endPlay();
  if (play && !play.isDue()) return true;
  counts.addTouch(play ? touchOf(play) : touch());
  present.forEach((tool, index) => held.meet(index, tool, world!.world.contactCount(inRuntime(index))));
  return play !== null || present.some(Boolean) || held.active || opened!.clocks.play;
}

// The tool of the runtime that a tool of the page was in the last touch.
const inRuntime = (index: number) => (play ? index : tools.index(index));

// Of the pointer's tools.
function touch(): number {
  const sent = tools.all((present = held.move()));
  opened!.clocks.advance(1 / TOUCH_HZ);
  opened!.clocks.move(world!.world);
  return world!.touch(sent);
}

function touchOf(scene: ScenePlay): number {
  const places = scene.places();
  present = presentAt(places);
  return scene.touch(world!, opened!.clocks, places);
}

// The scene's tools in a world of their own, as palpate-run has it.
function beginPlay() {
  if (!opened) return;
  try {
    const next = new ScenePlay(opened.scene, opened.parts), own = next.makeWorld(runtime!);
    forget();
    world!.destroy();
    world = own;
    touchNothing(); // what the page shows until the first touch of the scene
    world.reset();
    play = next;
    loop.run();
  } catch (error) {
    say({ type: "refused", what: "play", message: saidOf(error), byteOffset: 0 });
  }
}

function endPlay() {
  const forces = play!.felt;
  change(settings); // the pointer's world again
  say({ type: "played", forces });
}

function place(index: number, target: ToolTarget) {
  if (!play && held.place(index, target)) loop.run();
}

function setMotion(name: string, plays: boolean, share?: number) {
  if (!opened || play) return;
  opened.clocks.set(name, plays, share);
  loop.run();
}

// Takes the tools away.
function forget() {
  held.forget();
  present = Array(TOOL_COUNT).fill(null);
  play = null;
  world?.reset();
}

// One touch without tools: the organs are where their motions have them.
function touchNothing() {
  if (!opened || !world) return;
  opened.clocks.move(world.world);
  counts.flags |= world.touch([]);
  counts.stale = true;
}

function reset() {
  if (play) return endPlay();
  forget();
  touchNothing();
}

// ---- frames ----------------------------------------------------------------------------------------------------------

function answerFrame(recycled: ArrayBuffer | null) {
  if (!world || !opened) return;
  const bytes = frameBytes(opened.nodes, 0, 0), buffer = recycled?.byteLength === bytes ? recycled : new ArrayBuffer(bytes), touched = world;
  const changed = counts.renewShape(() => touched.shape());
  fillFrame(buffer, opened, world);
  const frame: WorldFrame = {
    type: "frame", buffer, tools: present.map(toolFrame), organs: world.world.organStates.map(forcesOf), clocks: opened.clocks.states,
    playing: play && play.time, lasts: play?.lasts ?? 0, speed: play?.speed ?? 1, holds: play ? play.told(world) : opened.links.told(world), links: play ? play.drawnLinks(world) : opened.links.drawn(world), obstacles: play ? play.drawnObstacles : opened.obstacles, changed, ...counts.take(world, loop),
  };
  say(frame, [buffer]);
}

function fillFrame(buffer: ArrayBuffer, { surfaces, nodes }: Opened, { world: { organs } }: TouchWorld) {
  const out = frameArrays(buffer, nodes, 0, 0);
  surfaces.forEach(({ colours, first, nodes: own }, k) => {
    world!.fillPositions(k, out.positions.subarray(3 * first, 3 * (first + own)));
    colours.fill(colourBy, organs[k].displacements, settings.discRadius, out.lengths.subarray(first, first + own));
  });
}

function toolFrame(tool: RecordedTool, index: number): ToolFrame | null {
  if (!tool) return null;
  const of = inRuntime(index);
  const frame = { point: tool.point, force: world!.force(of), contacts: world!.world.contactCount(of), depth: held.depth(index, tool.point), normal: null };
  return play ? { ...frame, ...play.drawn(of, tool.point, world!) } : frame;
}

const forcesOf = ({ force, pressed }: { force: number[]; pressed: number[] }): OrganForces => ({ tools: lengthOf(force), organs: lengthOf(pressed) });

addEventListener("message", ({ data }: MessageEvent<ToWorldWorker>) => {
  if (data.type === "open") void open(data.scene, data.files, data.of, data.settings);
  if (data.type === "settings") change(data.settings);
  if (data.type === "tool") place(data.index, data.target);
  if (data.type === "withdraw") held.withdraw(data.index);
  if (data.type === "motion") setMotion(data.name, data.plays, data.share);
  if (data.type === "play") beginPlay();
  if (data.type === "frame") answerFrame(data.buffer);
  if (data.type === "reset") reset();
  if (data.type === "language") useLanguage(data.name);
  if (data.type === "colour") {
    colourBy = data.by;
    counts.stale = true;
  }
});
