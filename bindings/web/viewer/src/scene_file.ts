// A recording as two files: a scene with the path of each tool, which palpate-run plays, and the forces that palpate-run writes for it,
// both to the byte. The scene is a record of palpate-run too (programs/player/record.h): palpate-run --replay compares its results.
import xxhash from "xxhash-wasm";
import * as steps from "../../module/flags.js";
import type { Bundle, Scene, Tool } from "../../module/palpate.js";
import { BodySolves, nodesFor } from "./touch_scene";
import { DEFORM_HZ, TOOL_COUNT, TOUCH_HZ, type Recording, type Vector } from "./messages";

const SHAPE_HZ = 60;

export interface RecordingFiles {
  scene: string;
  forces: string;
  difference: number; // N, the largest between these forces and those that were felt
}

// A tool of the scene: the pushes, or the pulls, of one of the page's tools.
interface SceneTool {
  name: string;
  tool: number; // the page's
  hold: boolean;
  steps: number[]; // at which it is there
}

// bundleName: as the scene names it. Cost: the touches of the recording, and a shape for each sixtieth of a second.
export async function filesOf(bundle: Bundle, bundleName: string, recording: Recording): Promise<RecordingFiles> {
  const { create64 } = await xxhash(), tools = sceneTools(recording), scene = createScene(bundle, recording, tools.length);
  const contacts = create64(), shapes = create64(), steps = 1 + Math.max(...tools.map((tool) => tool.steps.at(-1)!));
  const rows = ["time_s,tool,x_m,y_m,z_m,force_x_N,force_y_N,force_z_N,raw_x_N,raw_y_N,raw_z_N,contacts,flags,flag_names,torque_x_Nm,torque_y_Nm,torque_z_Nm"];
  const paths = tools.map((tool) => new PathOf(recording, tool)), solves = new BodySolves(recording.effects);
  let difference = 0, frame = 0;
  for (let step = 0; step < steps; ++step) {
    scene.setTools(tools.map((tool, t): Tool => ({ points: paths[t].isThere(step) ? paths[t].at(step) : [], ...shapeOf(recording, tool) })));
    scene.touch(1 / TOUCH_HZ);
    contacts.update(scene.contactBytes);
    tools.forEach((tool, t) => {
      const force = [...scene.force(t)], flags = scene.toolFlags(t), felt = [...paths[t].at(step), ...force, ...scene.forceRaw(t), scene.contactCount(t), flags];
      rows.push([cell(step / TOUCH_HZ), tool.name, ...felt.map(cell), flagNames(flags), ...[...scene.torque(t)].map(cell)].join(","));
      if (!paths[t].isThere(step)) return;
      const from = 3 * (TOOL_COUNT * step + tool.tool);
      force.forEach((newton, d) => (difference = Math.max(difference, Math.abs(newton - recording.forces[from + d]))));
    });
    solves.afterTouch(scene);
    if (step < Math.ceil((frame * TOUCH_HZ) / SHAPE_HZ - 1e-9)) continue;
    ++frame;
    scene.shape();
    for (const { buffer, byteOffset, byteLength } of [scene.displacements, scene.positions]) shapes.update(new Uint8Array(buffer, byteOffset, byteLength));
  }
  scene.destroy();
  const head = `# palpate-run record 1\n# bundle ${hex(bundle.info.identity)}\n# output ${hex(contacts.digest())} ${hex(shapes.digest())}\n`;
  const text = sceneText(recording, tools, paths, bundleName, steps);
  return { scene: `${head}# record ${hex(create64().update(head).update(text).digest())}\n${text}`, forces: rows.join("\n") + "\n", difference };
}

function sceneTools({ steps, points, hold }: Recording): SceneTool[] {
  const tools: SceneTool[] = [];
  for (let tool = 0; tool < TOOL_COUNT; ++tool)
    for (const holds of [false, true]) {
      const there = [];
      for (let step = 0, at = tool; step < steps; ++step, at += TOOL_COUNT)
        if (!Number.isNaN(points[3 * at]) && (hold[at] === 1) === holds) there.push(step);
      if (there.length) tools.push({ name: `tool ${tool + 1}${holds ? " pulls" : ""}`, tool, hold: holds, steps: there });
    }
  return tools;
}

// The tool's position at each step, as palpate-run has it: where the tool is away, on a straight line.
class PathOf {
  private next = 0; // the first step of the tool's that is later than the step asked last
  constructor(private recording: Recording, private tool: SceneTool) {}

  isThere(step: number): boolean {
    const { steps } = this.tool;
    if (steps[this.next - 1] > step) this.next = 0;
    while (steps[this.next] <= step) ++this.next;
    return steps[this.next - 1] === step;
  }

  at(step: number): Vector {
    const { steps } = this.tool, there = this.isThere(step), before = steps[this.next - 1], after = steps[this.next];
    if (there || after === undefined) return this.recorded(before);
    if (before === undefined) return this.recorded(after);
    const a = this.recorded(before), b = this.recorded(after), start = before / TOUCH_HZ;
    const share = (step / TOUCH_HZ - start) / (after / TOUCH_HZ - start);
    return a.map((x, d) => x + share * (b[d] - x)) as Vector;
  }

  // [from, until) s, of the scene's steps.
  away(steps: number): [number, number][] {
    const away: [number, number][] = [];
    let from = 0;
    for (const step of [...this.tool.steps, steps]) {
      if (step > from) away.push([from / TOUCH_HZ, step / TOUCH_HZ]);
      from = step + 1;
    }
    return away;
  }

  private recorded(step: number): Vector {
    const at = 3 * (TOOL_COUNT * step + this.tool.tool);
    return [...this.recording.points.subarray(at, at + 3)] as Vector;
  }
}

// With the limits that palpate-run gives a scene of so many points.
function createScene(bundle: Bundle, { effects: { fine, dent, inside, cut, ...effects } }: Recording, tools: number): Scene {
  return bundle.createScene({
    ...effects, maxTools: tools, maxPoints: tools, maxContactNodes: nodesFor(effects, tools),
  });
}

function shapeOf({ effects, tool: { discRadius, friction } }: Recording, { hold }: SceneTool): Tool {
  return { hold, discRadius: effects.contact === "patch" ? discRadius : 0, friction: effects.law === "coulomb" ? friction : 0 };
}

function sceneText(recording: Recording, tools: SceneTool[], paths: PathOf[], bundleName: string, steps: number): string {
  const { relaxation, fine, dent, inside, cut, ...effects } = recording.effects, lines = [];
  lines.push(`name = "recording"`, `bundle = ${JSON.stringify(bundleName)}`, `unit = "m"`, "", "[effects]");
  for (const [effect, value] of Object.entries(effects)) lines.push(`${effect} = ${JSON.stringify(value)}`);
  lines.push("", "[rate]", `touch = ${TOUCH_HZ}`, `shape = ${SHAPE_HZ}`, `deform = ${DEFORM_HZ}`);
  if (relaxation?.length) lines.push("", "[relaxation]", `terms = [${relaxation.map(({ share, time }) => `[${share}, ${time}]`).join(", ")}]`, `source = "the viewer"`);
  tools.forEach((tool, t) => {
    const { discRadius, friction } = shapeOf(recording, tool), away = paths[t].away(steps);
    lines.push("", "[[tool]]", `name = "${tool.name}"`, "points = [[0, 0, 0]]", `hold = ${tool.hold}`);
    if (discRadius) lines.push(`disc_radius = ${discRadius}`);
    if (friction) lines.push(`friction = ${friction}`);
    if (away.length) lines.push(`away = [${away.map((row) => `[${row.join(", ")}]`).join(", ")}]`);
    lines.push("path = [");
    for (const step of tool.steps) lines.push(`  [${[step / TOUCH_HZ, ...paths[t].at(step)].map(tomlNumber).join(", ")}],`);
    lines.push("]");
  });
  return lines.join("\n") + "\n";
}

const tomlNumber = (x: number) => (Object.is(x, -0) ? "-0.0" : String(x));
const hex = (word: bigint) => word.toString(16).padStart(16, "0");

// A number of a CSV file as palpate-run writes it: nine significant digits, an exponent where C writes one, no -0.
function cell(x: number): string {
  const [digits, power] = x.toExponential(8).split("e"), exponent = Number(power);
  if (x === 0 || (exponent >= -4 && exponent < 9)) return String(Number(x.toPrecision(9)) + 0);
  return `${Number(digits)}e${exponent < 0 ? "-" : "+"}${String(Math.abs(exponent)).padStart(2, "0")}`;
}

const FLAGS = Object.entries(steps).filter(([name]) => name.startsWith("STEP_")).sort(([, a], [, b]) => a - b);
const flagNames = (flags: number) => FLAGS.filter(([, bit]) => flags & bit).map(([name]) => name.slice("STEP_".length)).join(" ");
