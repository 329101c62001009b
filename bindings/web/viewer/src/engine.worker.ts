// The engine's thread: opens bundles, touches at a fixed rate, and computes a shape when the page asks for a frame.
import { hasSimd, PalpateError, type Bundle, type Runtime, type Scene } from "../../module/palpate.js";
import { meshOf, provenanceOf } from "./bundle_mesh";
import { COST_NAMES, measureCost, solvesBody } from "./costs";
import { DeviceLink } from "./device_link";
import { BRAIN_RELAXATION, DEFAULT_EFFECTS, DEFAULT_TOOL, isAvailable } from "./effects";
import {
  frameArrays, frameBytes, TOOL_COUNT, TOUCH_HZ, type BoundMesh, type ColourBy, type Cost, type FieldOf, type Frame, type FromWorker, type PageEffects, type Path, type Recording, type SavedFile,
  type Edge, type Sample, type ToWorker, type ToolFrame, type ToolTarget, type ToolShape, type Vector,
} from "./messages";
import { CutWatch, cutFigures } from "./cut_watch";
import { answerOf, DownloadError, FrameCounts, openStream, startRuntime } from "./engine_thread";
import { HeldBlade } from "./held_blade";
import { HeldTools } from "./held_tools";
import { MotionClocks } from "./motion_clocks";
import { nodulesOf } from "./nodules";
import { filesOf } from "./scene_file";
import { Recorder, recordedTool, type RecordedTool } from "./recorder";
import { saidOf } from "./said";
import { SurfaceColours, surfaceOf } from "./surface_colours";
import { presentAt, ScenePlay } from "./scene_play";
import { TouchLoop } from "./touch_loop";
import { TouchScene } from "./touch_scene";
import type { TouchWorld } from "./touch_world";
import type { WorldScene } from "./world_scene";
import { playTrial } from "./trial";
import { useLanguage } from "./words";

const NONE: Int32Array = new Int32Array(0);
const SAMPLE_EVERY = 4; // touches per point of the plot

const say = (message: FromWorker, transfer: Transferable[] = []) => postMessage(message, { transfer });

let runtime: Runtime | null = null;
let bundle: Bundle | null = null;
let bundleName = "";
let scene: TouchScene | null = null;
let effects: PageEffects = DEFAULT_EFFECTS;
let fineMesh: BoundMesh | null = null;
let toolShape = DEFAULT_TOOL;
let colourBy: ColourBy = "dent";
let fieldOf: FieldOf = "none"; // of the section
let field: Frame["field"] = null; // of the newest shape
let spacing = 0; // of the bundle's surface, m
let colours: SurfaceColours | null = null; // of the bundle's surface
let fineColours: SurfaceColours | null = null;

const held = new HeldTools();
const scalpel = new HeldBlade();
const cuts = new CutWatch();
const recorder = new Recorder();
let lastRecording: Recording | null = null;
let replay: { path: Path; step: number; touched: boolean } | null = null;

// ---- bundles ---------------------------------------------------------------------------------------------------------

async function fetchBundle(url: string) {
  let answer: Response | null;
  try {
    answer = await answerOf(url);
  } catch (error) {
    return say({ type: "refused", name: url, what: "download", message: (error as Error).message, byteOffset: 0 });
  }
  if (!answer) return say({ type: "refused", name: url, what: "absent", message: "", byteOffset: 0 });
  await opening(url, (engine) => openStream(engine, answer, (done, total) => say({ type: "progress", done, total })));
}

async function opening(name: string, open: (engine: Runtime) => Promise<Bundle>) {
  let opened: Bundle | null = null;
  try {
    opened = await open((runtime = await startRuntime()));
    opened.check();
    const first = new TouchScene(opened, DEFAULT_EFFECTS, DEFAULT_TOOL, null);
    close();
    bundle = opened;
    bundleName = name.slice(name.lastIndexOf("/") + 1);
    scene = first;
    effects = DEFAULT_EFFECTS;
    toolShape = DEFAULT_TOOL;
    fineMesh = null;
    cuts.forget();
    counts.stale = true;
    const mesh = meshOf(opened), surface = surfaceOf(mesh.positions.slice(), mesh.triangles);
    spacing = surface.spacing;
    colours = new SurfaceColours(surface, spacing);
    say({ type: "opened", name, mesh, nodules: nodulesOf(opened), info: opened.info, provenance: provenanceOf(opened), bytes: opened.byteCount, simd: hasSimd() });
  } catch (error) {
    opened?.close();
    const message = saidOf(error);
    if (error instanceof PalpateError) say({ type: "refused", name, what: "bundle", message, byteOffset: error.byteOffset });
    else say({ type: "refused", name, what: error instanceof DownloadError ? "download" : "runtime", message, byteOffset: 0 });
  }
}

function close() {
  forget();
  lastRecording = null;
  interruptMeasuring();
  costs = [];
  scene?.destroy();
  bundle?.close();
  scene = bundle = null;
}

function changeEffects(wanted: PageEffects, tool: ToolShape, mesh: typeof fineMesh) {
  if (!bundle) return;
  if (scene && wanted.cut && mesh === fineMesh && same(wanted, effects)) return changeTool(tool);
  try {
    const changed = new TouchScene(bundle, wanted, tool, mesh);
    forget();
    scene?.destroy();
    scene = changed;
    costs = [];
    effects = wanted;
    toolShape = tool;
    if (mesh && mesh !== fineMesh) fineColours = new SurfaceColours({ rest: mesh.positions, normals: mesh.normals, parents: mesh.parents }, spacing);
    fineMesh = mesh;
    counts.stale = true;
    say({ type: "accepted", effects, tool });
  } catch (error) {
    say({ type: "refused", name: "", what: "effects", message: saidOf(error), byteOffset: 0 });
  }
}

const same = (a: PageEffects, b: PageEffects) => JSON.stringify(a) === JSON.stringify(b);

// In the scene as it is, so that what was cut stays cut.
function changeTool(tool: ToolShape) {
  held.forget();
  scene!.useTool(effects, (toolShape = tool));
  loop.run();
  say({ type: "accepted", effects, tool });
}

// ---- the touch loop --------------------------------------------------------------------------------------------------

const loop = new TouchLoop(() => scene !== null && step(), () => link?.send((index) => scene!.force(index)));
const counts = new FrameCounts();
let samples: Sample[] = [];
let present: RecordedTool[] = Array(TOOL_COUNT).fill(null);
let contacts = 0; // begun so far
const contactOf: number[] = Array(TOOL_COUNT).fill(0);

// Returns whether there are tools.
function step(): boolean {
  if (own) return stepOf(own);
  present = replay ? replayedTools() : held.move();
  const active = replay !== null || present.some(Boolean) || held.active || scalpel.active, records = active && !effects.cut;
  // A recording begins with a scene that remembers nothing, so that playing it again gives the same forces. Such a scene is whole: where the organ
  // can be cut, nothing is recorded.
  if (records && !recorder.steps) scene!.reset();
  counts.addTouch(scene!.touch(present, scalpel.move(scene!.waits)));
  present.forEach(note);
  if (records) recorder.add(present, present.map((_, tool) => scene!.force(tool)));
  if (!active && loop.quiet === 0) endRecording();
  return active;
}

function replayedTools(): RecordedTool[] {
  const { path } = replay!;
  if (replay!.step === path.steps) {
    scene!.shape();
    endRecording();
    const { touched } = replay!;
    say({ type: "replayed", positions: scene!.scene.positions.slice(), fine: scene!.scene.skinPositions.slice(), touched, nearest: touched ? 0 : nearestOf(path) });
    replay = null;
    return Array(TOOL_COUNT).fill(null);
  }
  const tools = present.map((_, tool) => recordedTool(path, replay!.step, tool));
  ++replay!.step;
  return tools;
}

// The least distance between the path's tools and the organ's nodes at rest, m, at 500 touches of the path.
function nearestOf({ points, steps }: Path): number {
  const { nodes, info } = bundle!;
  let least = Infinity;
  for (let step = 0; step < steps; step += Math.ceil(steps / 500))
    for (let p = 3 * TOOL_COUNT * step; p < 3 * TOOL_COUNT * (step + 1); p += 3)
      for (let n = 0; n < 3 * info.surfaceNodeCount; n += 3)
        least = Math.min(least, Math.hypot(points[p] - nodes[n], points[p + 1] - nodes[n + 1], points[p + 2] - nodes[n + 2]) || Infinity);
  return least;
}

function note(tool: RecordedTool, index: number) {
  if (held.meet(index, tool, scene!.contacts(index))) {
    contactOf[index] = ++contacts;
    if (replay) replay.touched = true;
  }
  if (tool && held.isIn(index) && loop.steps % SAMPLE_EVERY === 0)
    samples.push({ tool: index, contact: contactOf[index], depth: held.depth(index, tool.point), force: Math.hypot(...scene!.force(index)) });
}

function place(index: number, target: ToolTarget) {
  interruptMeasuring(); // a device's tools come without a message
  if (!replay && !own && held.place(index, target)) loop.run();
}

function placeBlade(edge: Edge | null, toughness: number) {
  if (replay || own || !scene?.scene.canCut) return;
  scalpel.place(edge, toughness);
  loop.run();
}

// ---- scenes whose tools hold or pierce the organ ---------------------------------------------------------------------

interface OwnScene {
  play: ScenePlay;
  world: TouchWorld; // of the one organ
  clocks: MotionClocks;
}
let own: OwnScene | null = null; // that plays now, beside the page's scene

function playScene(of: WorldScene) {
  if (!bundle) return;
  try {
    const { shape, fine } = effects, isCut = of.blades.length > 0; // which neither the interior nor a finer mesh follows
    const part = { bundle, pose: {}, effects: { ...of.organs[0].effects, shape: isCut ? "surface" : shape } as PageEffects, mesh: (fine && !isCut && fineMesh) || undefined };
    const play = new ScenePlay(of, [part]), clocks = new MotionClocks(of, [bundle.motions]), world = play.makeWorld(runtime!);
    forget();
    clocks.move(world.world);
    world.touch([]); // what the page shows until the first touch of the scene
    world.reset();
    own = { play, world, clocks };
    for (const tool of contactOf.keys()) contactOf[tool] = ++contacts;
    loop.run();
  } catch (error) {
    say({ type: "refused", name: "", what: "scene", message: saidOf(error), byteOffset: 0 });
  }
}

function stepOf({ play, world, clocks }: OwnScene): boolean {
  if (play.isDone) {
    say({ type: "played", forces: play.felt });
    forget();
    return true;
  }
  if (!play.isDue()) return true;
  const places = play.places();
  present = presentAt(places);
  counts.addTouch(play.touch(world, clocks, places));
  present.forEach((tool, index) => {
    held.meet(index, tool, world.world.contactCount(index));
    if (!tool || index >= TOOL_COUNT || loop.steps % SAMPLE_EVERY) return;
    const { depth, force } = toolFrame(tool, index)!;
    if (depth > 0) samples.push({ tool: index, contact: contactOf[index], depth, force: Math.hypot(...force) });
  });
  return true;
}

// ---- devices ---------------------------------------------------------------------------------------------------------

let link: DeviceLink | null = null;
const starts: (Vector | null)[] = Array(TOOL_COUNT).fill(null); // where a device's tool came in

function connect(port: number | null) {
  link?.close();
  link = port === null ? null : new DeviceLink(port, {
    move: (index, point) => place(index, { start: (starts[index] ??= point), point, grasp: null, down: true }),
    leave: (index) => ((starts[index] = null), held.withdraw(index)),
    changed: (state, tools) => say({ type: "linked", state, tools }),
  });
}

function withdraw(index: number) {
  held.withdraw(index);
  if (!held.active) recorder.clear();
}

function play(path: Path | null) {
  const chosen = path ?? newestRecording();
  if (!scene || !chosen?.steps) return;
  forget();
  replay = { path: chosen, step: 0, touched: false };
  loop.run();
}

// ---- recordings ------------------------------------------------------------------------------------------------------

// The touch that goes on now, or else the last one.
const newestRecording = () => (recorder.steps ? recorder.take(effects, toolShape) : lastRecording);

function endRecording() {
  lastRecording = newestRecording();
  recorder.clear();
}

async function save(as: SavedFile) {
  const recording = newestRecording();
  if (!bundle || !recording) return;
  const files = await filesOf(bundle, bundleName, recording);
  say({ type: "saved", as, text: files[as], difference: files.difference });
}

// Plays a path in a scene of its own; what the page touches stays as it is.
function tryPath(path: Path) {
  if (!bundle) return;
  const trial = new TouchScene(bundle, effects, toolShape, fineMesh), nodes = bundle.info.surfaceNodeCount;
  const inside = trial.scene.nodeCount - nodes, vertices = trial.scene.vertexCount, buffer = new ArrayBuffer(frameBytes(nodes, inside, vertices));
  const felt = playTrial(trial, path, TOOL_COUNT, () => fillFrame(buffer, nodes, trial.scene));
  trial.destroy();
  say({ type: "tried", trial: { ...felt, shape: { buffer, inside, vertices } } }, [buffer]);
}

// Takes the tools away. What was recorded until now stays.
function forget() {
  endRecording();
  held.forget();
  scalpel.forget();
  present = Array(TOOL_COUNT).fill(null);
  replay = null;
  own?.world.destroy();
  own = null;
  samples = [];
  scene?.reset();
  scene?.scene.setTools([]);
  if (scene) scene.scene.touch(1 / TOUCH_HZ);
  counts.stale = true;
}

// ---- frames ----------------------------------------------------------------------------------------------------------

function answerFrame(recycled: ArrayBuffer | null) {
  if (!scene || !bundle) return;
  const touched = own?.world ?? scene, organ = own ? own.world.world.organs[0] : scene.scene;
  const nodes = bundle.info.surfaceNodeCount, inside = organ.nodeCount - nodes, vertices = organ.vertexCount;
  const bytes = frameBytes(nodes, inside, vertices);
  const buffer = recycled?.byteLength === bytes ? recycled : new ArrayBuffer(bytes);
  const changed = counts.renewShape(() => {
    const flags = touched.shape();
    field = fieldInside(organ);
    return flags;
  });
  const surface = cuts.news(organ), edges = own ? own.play.edges : scalpel.edge ? [scalpel.edge] : [];
  fillFrame(buffer, nodes, organ, cuts.made);
  const frame: Frame = {
    type: "frame", buffer, field: changed ? field : null, inside, vertices, tools: present.map(toolFrame), samples, changed, ...counts.take(touched, loop),
    replaying: replay !== null || own !== null, playing: own && own.play.time, lasts: own?.play.lasts ?? 0, speed: own?.play.speed ?? 1, holds: own ? own.play.told(own.world) : [], links: own ? own.play.drawnLinks(own.world) : [], obstacles: own?.play.drawnObstacles ?? [],
    cut: cutFigures(organ, edges), ...(surface === undefined ? {} : { surface }),
    engineBytes: runtime!.heap.bytes.byteLength, recordedSteps: recorder.steps || (lastRecording?.steps ?? 0),
  };
  samples = [];
  say(frame, [buffer]);
}

// A stress needs a scene with the effect `inside`, which comes and goes a message later than the list of the section.
function fieldInside(organ: Scene): Frame["field"] {
  if (fieldOf === "none" || organ.nodeCount === bundle!.info.surfaceNodeCount) return null;
  if (fieldOf === "displacement") {
    const u = organ.displacements;
    return { of: fieldOf, values: Float32Array.from({ length: organ.nodeCount }, (_, n) => Math.hypot(u[3 * n], u[3 * n + 1], u[3 * n + 2])) };
  }
  if (!organ.hasField) return null;
  counts.flags |= organ.inside();
  return { of: fieldOf, values: (fieldOf === "pressure" ? organ.field.pressures : organ.field.vonMises).slice() };
}

// made: the nodes that cuts have made, as DrawnSurface has them.
function fillFrame(buffer: ArrayBuffer, nodes: number, { positions, displacements, nodeCount, vertexCount, skinPositions, skinNormals }: Scene, made = NONE) {
  const out = frameArrays(buffer, nodes, nodeCount - nodes, vertexCount);
  out.positions.set(positions.subarray(0, 3 * nodes));
  out.inside.set(positions.subarray(3 * nodes));
  if (!vertexCount) return colours!.fillCut(colourBy, displacements, toolShape.discRadius, out.lengths, made);
  out.fine.positions.set(skinPositions);
  out.fine.normals.set(skinNormals);
  const moved = skinPositions.map((x, i) => x - fineMesh!.positions[i]);
  fineColours!.fill(colourBy, moved, toolShape.discRadius, out.fine.lengths);
}

function toolFrame(tool: RecordedTool, index: number): ToolFrame | null {
  if (!tool) return null;
  if (own) {
    const { play, world } = own, frame = { point: tool.point, force: world.force(index), contacts: world.world.contactCount(index), depth: held.depth(index, tool.point), normal: null };
    return { ...frame, ...play.drawn(index, tool.point, world) };
  }
  return { point: tool.point, force: scene!.force(index), contacts: scene!.contacts(index), depth: held.depth(index, tool.point), normal: scene!.discNormal(index) };
}

// ---- what effects cost -----------------------------------------------------------------------------------------------

const SLICE = 8; // ms of measuring, between which messages are heard
let costs: Cost[] = []; // of the present effects
let measuring: Generator<void, void> | null = null;

function measure(place: Vector, normal: Vector, large: boolean) {
  if (!bundle || loop.isRunning) return sayCosts(0, true);
  const of = { bundle, effects, tool: toolShape, mesh: fineMesh, relaxation: BRAIN_RELAXATION, place, normal }, { info } = bundle;
  const missing = COST_NAMES.filter((effect) => isAvailable(effect, info, fineMesh !== null) && (large || !solvesBody(effect, effects)) && !costs.some((cost) => cost.effect === effect));
  measuring?.return();
  measuring = (function* () {
    for (const [index, effect] of missing.entries()) {
      sayCosts(missing.length - index, false);
      const cost = yield* measureCost(effect, of);
      if (cost) costs.push(cost);
    }
    sayCosts(0, false);
  })();
  measureOn(measuring);
}

function measureOn(run: typeof measuring) {
  if (!run || run !== measuring) return;
  const until = performance.now() + SLICE;
  while (performance.now() < until) if (run.next().done) return void (measuring = null);
  setTimeout(() => measureOn(run), 0);
}

// Before a touch, and before what changes the scene or closes the bundle. The costs that are known are kept.
function interruptMeasuring() {
  if (!measuring) return;
  measuring.return();
  measuring = null;
  sayCosts(0, true);
}

const sayCosts = (left: number, interrupted: boolean) => say({ type: "costs", costs, left, interrupted });

const KEEPS_MEASURING: ToWorker["type"][] = ["frame", "colour", "field", "measure", "path", "withdraw", "language"];

addEventListener("message", ({ data }: MessageEvent<ToWorker>) => {
  if (!KEEPS_MEASURING.includes(data.type)) interruptMeasuring();
  if (data.type === "fetch") void fetchBundle(data.url);
  if (data.type === "open") void opening(data.name, async (engine) => engine.openBundle(new Uint8Array(data.bytes)));
  if (data.type === "effects") changeEffects(data.effects, data.tool, data.mesh === undefined ? fineMesh : data.mesh);
  if (data.type === "tool" && !link?.owns(data.index)) place(data.index, data.target);
  if (data.type === "blade") placeBlade(data.edge, data.toughness);
  if (data.type === "link") connect(data.port);
  if (data.type === "withdraw") withdraw(data.index);
  if (data.type === "frame") answerFrame(data.buffer);
  if (data.type === "replay") play(data.path);
  if (data.type === "scene") playScene(data.scene);
  if (data.type === "save") void save(data.as);
  if (data.type === "path") say({ type: "path", path: newestRecording() });
  if (data.type === "try") tryPath(data.path);
  if (data.type === "measure") measure(data.place, data.normal, data.large);
  if (data.type === "colour") {
    colourBy = data.by;
    counts.stale = true;
  }
  if (data.type === "field") {
    fieldOf = data.of;
    counts.stale = true;
  }
  if (data.type === "reset") forget();
  if (data.type === "language") useLanguage(data.name);
});
say({ type: "started" });
