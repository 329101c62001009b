// Reads a scene file that palpate-run plays, such as the recording.toml that this page saves: effects, relaxation, and one or two tools of
// one point each with a path. What the page cannot play is refused with the key's name. Scenes with other tools: readOwn() of world_reader.ts.
import { parse, TomlError } from "smol-toml";
import { BRAIN_RELAXATION, DEFAULT_EFFECTS } from "./effects";
import { DEFORM_HZ, TOOL_COUNT, TOUCH_HZ, type PageEffects, type Path, type ToolShape, type Vector } from "./messages";
import { alongRows, LONGEST_PATH } from "./path_files";
import { word } from "./words";

const UNITS: Record<string, number> = { m: 1, cm: 1e-2, mm: 1e-3, um: 1e-6 };
const DISCS: [number, number] = [0.002, 0.012]; // m: those of the page's slider
const CHOICES: Record<string, string[]> = {
  collision: ["rest", "deformed"], contact: ["node", "triangle", "point", "patch"], law: ["sticking", "sliding", "unilateral", "coulomb"],
  force: ["linear", "response"], shape: ["surface", "volume"], radial: ["off", "response"], deformation: ["linear", "large", "large-beside", "large-renewed", "large-auto"], dent: ["off", "discs"],
};
const LEAST_RATE = 1e-6, MOST_RATE = 1e6; // Hz, of scene files (docs/files.md)
const TOP = ["name", "bundle", "unit", "csv_unit", "effects", "relaxation", "rate", "tool"];
const OF_TOOL = ["name", "points", "path", "hold", "disc_radius", "friction", "away"];

export interface PlayedScene {
  effects: PageEffects;
  tool: ToolShape;
  path: Path;
}

// The bundle's checksum, 16 hexadecimal digits, where the file is a record.
export const bundleOfScene = (text: string) => /^# bundle ([0-9a-f]{16})$/m.exec(text)?.[1] ?? null;

export type Table = Record<string, unknown>;

// Throws an Error that names the key. now: what the file does not hold.
export function readScene(text: string, now: { effects: PageEffects; tool: ToolShape }): PlayedScene {
  const scene = parsed(text), unit = unitOf(scene);
  if (Array.isArray(scene.organ)) throw new Error(word("scene.several-organs"));
  refuseOthers(word("scene.itself"), scene, TOP);
  const tools = (Array.isArray(scene.tool) ? scene.tool : []).map((tool, t) => readTool(table(tool, "tool"), `[[tool]] ${t + 1}`, unit));
  if (!tools.length) throw new Error(word("scene.no-tool"));
  const radii = tools.map((tool) => tool.discRadius), frictions = tools.map((tool) => tool.friction);
  if (new Set(radii).size > 1 || new Set(frictions).size > 1) throw new Error(word("scene.discs"));
  const [discRadius] = radii, effects = readEffects(table(scene.effects, "effects"), table(scene.relaxation, "relaxation"), discRadius > 0);
  if (effects.contact === "patch" && !(discRadius >= DISCS[0] && discRadius <= DISCS[1]))
    throw new Error(word("scene.disc", { least: 1000 * DISCS[0], most: 1000 * DISCS[1], found: 1000 * discRadius }));
  return {
    effects: { ...effects, fine: now.effects.fine && !effects.cut },
    tool: { discRadius: discRadius || now.tool.discRadius, friction: effects.law === "coulomb" ? frictions[0] : now.tool.friction }, path: pathOf(tools),
  };
}

// Metres in a unit of the file.
export function unitOf({ unit }: Table): number {
  const metres = UNITS[String(unit)];
  if (!metres) throw new Error(word("scene.unit", { found: shownAs(unit) }));
  return metres;
}

// Of a scene that plays at rates of its own.
export interface Rates {
  touch: number; // Hz
  deform: number; // Hz: solves of the body beside the touch
}
export const PAGE_RATES: Rates = { touch: TOUCH_HZ, deform: DEFORM_HZ };

export function ratesOf(scene: Table): Rates {
  const rate = table(scene.rate, "rate");
  refuseOthers("[rate]", rate, ["touch", "deform", "shape"]); // the page draws a shape for each picture
  const read = (key: keyof Rates, most: number) => {
    const value = rate[key] ?? Math.min(PAGE_RATES[key], most);
    if (typeof value !== "number" || !(value >= LEAST_RATE && value <= most)) throw new Error(word("scene.rate", { key, least: LEAST_RATE, most, found: shownAs(value) }));
    return value;
  };
  const touch = read("touch", MOST_RATE);
  return { touch, deform: read("deform", touch) };
}

export const playsAtPageRates = (scene: Table) => JSON.stringify(ratesOf(scene)) === JSON.stringify(PAGE_RATES);

export function parsed(text: string): Table {
  try {
    return parse(text) as Table;
  } catch (error) {
    if (error instanceof TomlError) throw new Error(word("scene.toml", { line: error.line, why: error.message.split("\n")[0].replace(/^Invalid TOML document: /, "") }));
    throw error;
  }
}

// more: choices that the page's own tools do not have.
export function readEffects(given: Table, relaxation: Table, hasDisc: boolean, more: Record<string, string[]> = {}): PageEffects {
  const effects: Table = { ...DEFAULT_EFFECTS, collision: "rest", contact: hasDisc ? "patch" : "point", preload: false, relaxation: [] };
  refuseOthers("[effects]", given, [...Object.keys(CHOICES), "preload", "crossings", "cut"]);
  for (const [effect, value] of Object.entries(given)) {
    const choices = CHOICES[effect] && [...CHOICES[effect], ...(more[effect] ?? [])];
    if (choices ? !choices.includes(String(value)) : typeof value !== "boolean")
      throw new Error(word("scene.effect", { effect, expected: choices ? choices.join(", ") : word("scene.true-false"), found: shownAs(value) }));
    effects[effect] = value;
  }
  if (relaxation.terms !== undefined) {
    const terms = relaxation.terms as number[][];
    if (!Array.isArray(terms) || !terms.every((term) => Array.isArray(term) && term.length === 2 && term.every(Number.isFinite)))
      throw new Error(word("scene.terms", { example: `[${BRAIN_RELAXATION[0].share}, ${BRAIN_RELAXATION[0].time}]`, found: shownAs(terms) }));
    effects.relaxation = terms.map(([share, time]) => ({ share, time }));
  }
  return effects as PageEffects;
}

interface SceneTool {
  slot: number; // the page's tool that the name asks for; -1: none
  hold: boolean;
  discRadius: number;
  friction: number;
  rows: number[][]; // s, x, y, z m
  away: [number, number][]; // s
}

function readTool(given: Table, where: string, unit: number): SceneTool {
  refuseOthers(where, given, OF_TOOL);
  const points = given.points as number[][] | undefined;
  if (points?.length !== 1 || !isRow(points[0], 3)) throw new Error(word("scene.points", { where, found: shownAs(points) }));
  const rows = pathRows(given.path, where);
  checkLength(rows, `${where} path`);
  const away = timeSpans(given.away, `${where} away`);
  const offset = points[0];
  return {
    slot: Number(/^tool (\d)\b/.exec(String(given.name))?.[1] ?? 0) - 1, hold: given.hold === true, away,
    discRadius: unit * Number(given.disc_radius ?? 0), friction: Number(given.friction ?? 0),
    rows: rows.map(([time, ...place]) => [time, ...place.map((x, d) => unit * (x + offset[d]))]),
  };
}

// Rows s, x, y, z of a tool's `path`, in the file's unit, or of its `turn`, in degrees.
export function pathRows(path: unknown, where: string, key = "path"): number[][] {
  const rows = path as number[][];
  if (!Array.isArray(rows) || !rows.length || !rows.every((row) => isRow(row, 4))) throw new Error(word("scene.path", { where, key, found: shownAs(rows) }));
  checkTimes(rows, `${where} ${key}`);
  return rows;
}

// As long as a recording may be.
function checkLength(rows: number[][], where: string) {
  if (rows.at(-1)![0] > LONGEST_PATH) throw new Error(word("scene.long", { where, most: LONGEST_PATH, found: rows.at(-1)![0] }));
}

// where: the key with its table.
export function checkTimes(rows: number[][], where: string) {
  const late = rows.findIndex((row, i) => i > 0 && !(row[0] > rows[i - 1][0]));
  if (late > 0) throw new Error(word("scene.late", { where, last: rows[late - 1][0], row: late + 1, found: rows[late][0] }));
}

// Rows from, until, s; none where the file has none. where: the key with its table.
export function timeSpans(given: unknown, where: string): [number, number][] {
  const spans = (given ?? []) as [number, number][];
  if (!Array.isArray(spans) || !spans.every((row) => isRow(row, 2))) throw new Error(word("scene.spans", { where, found: shownAs(spans) }));
  return spans;
}

// The page's tools, step by step. A tool of the scene takes the page's tool of its name, or else the first that is free while it is there.
function pathOf(tools: SceneTool[]): Path {
  const last = Math.max(...tools.map((tool) => tool.rows.at(-1)![0])), steps = Math.floor(last * TOUCH_HZ * (1 + 1e-9)) + 1;
  const path: Path = { steps, points: new Float64Array(3 * TOOL_COUNT * steps).fill(NaN), hold: new Uint8Array(TOOL_COUNT * steps) };
  for (const tool of tools) {
    const at = alongRows(tool.rows), there: [number, Vector][] = [];
    for (let step = 0; step < steps; ++step) {
      const time = step / TOUCH_HZ;
      if (!tool.away.some(([from, until]) => time >= from && time < until)) there.push([step, at(time)]);
    }
    const isFree = (slot: number) => there.every(([step]) => Number.isNaN(path.points[3 * (TOOL_COUNT * step + slot)]));
    const slot = [tool.slot, ...Array.from({ length: TOOL_COUNT }, (_, t) => t)].find((one) => one >= 0 && one < TOOL_COUNT && isFree(one));
    if (slot === undefined) throw new Error(word("scene.many-tools", { most: TOOL_COUNT }));
    for (const [step, point] of there) {
      path.points.set(point, 3 * (TOOL_COUNT * step + slot));
      path.hold[TOOL_COUNT * step + slot] = tool.hold ? 1 : 0;
    }
  }
  return path;
}

export function table(value: unknown, name: string): Table {
  if (value === undefined) return {};
  if (typeof value !== "object" || value === null || Array.isArray(value)) throw new Error(word("scene.table", { name, found: shownAs(value) }));
  return value as Table;
}

export function refuseOthers(where: string, given: Table, known: string[]) {
  const other = Object.keys(given).find((key) => !known.includes(key));
  if (other) throw new Error(word("scene.cannot", { where, key: other }));
}

export const isRow = (row: unknown, length: number): row is number[] => Array.isArray(row) && row.length === length && row.every((x) => typeof x === "number" && Number.isFinite(x));
export const shownAs = (value: unknown) => (value === undefined ? word("scene.nothing") : JSON.stringify(value, (_, x) => (typeof x === "bigint" ? Number(x) : x)).slice(0, 60));
