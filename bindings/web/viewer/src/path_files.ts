// Reads paths: the CSV that palpate-run reads (path_csv, in metres).
import { along, boxOf, distance } from "./geometry";
import { TOOL_COUNT, TOUCH_HZ, type Path, type Vector } from "./messages";
import { brief, word } from "./words";

export const LONGEST_PATH = 600; // s

// With or without quotes. What Number() makes of an empty cell, 0, is no number here.
const beginsAsNumber = (cell: string) => /^\s*"?\s*([-+.\d]|(nan|inf|infinity)\s*"?\s*$)/i.test(cell);
const isNumber = (cell: string) => cell.trim() !== "" && Number.isFinite(Number(cell));

// Rows of a time (s) and further numbers, with '#' comments. The first line may be a heading: none of its cells begins as a number does.
export function rowsOfFile(text: string, columns: number): number[][] {
  const rows: number[][] = [];
  let lines = 0;
  text.split(/\r?\n/).forEach((line, index) => {
    const row = line.replace(/#.*/, "").trim();
    if (!row) return;
    const cells = row.split(","), numbers = cells.map(Number);
    ++lines;
    if (cells.length === columns && cells.every(isNumber)) {
      const last = rows.at(-1);
      if (last && !(numbers[0] > last[0])) throw new Error(word("path.time", { line: index + 1, last: last[0], found: numbers[0] }));
      rows.push(numbers);
    } else if (lines > 1 || cells.some(beginsAsNumber) || !/[^\s,"]/.test(row)) {
      throw new Error(word("path.row", { line: index + 1, count: columns, found: row }));
    }
  });
  if (!rows.length) throw new Error(word("path.empty"));
  return rows;
}

// Rows of time (s), x, y, z (m): linear between rows, as palpate-run plays them.
export function pathOfFile(text: string): Path {
  const rows = rowsOfFile(text, 4);
  const duration = rows.at(-1)![0];
  if (duration > LONGEST_PATH) throw new Error(word("path.long", { most: LONGEST_PATH, found: duration }));
  const steps = Math.floor(duration * TOUCH_HZ * (1 + 1e-9)) + 1;
  const path: Path = {
    steps, points: new Float64Array(3 * TOOL_COUNT * steps).fill(NaN), hold: new Uint8Array(TOOL_COUNT * steps),
  };
  const at = alongRows(rows);
  for (let step = 0; step < steps; ++step) path.points.set(at(step / TOUCH_HZ), 3 * TOOL_COUNT * step);
  return path;
}

// The position at times that grow from call to call. rows: s, x, y, z.
export function alongRows(rows: number[][]): (time: number) => Vector {
  let after = 0; // the first row that is later than the time asked last
  return (time) => {
    while (after < rows.length && rows[after][0] <= time) ++after;
    if (after === 0) return rows[0].slice(1) as Vector;
    if (after === rows.length) return rows.at(-1)!.slice(1) as Vector;
    const [t0, ...a] = rows[after - 1], [t1, ...b] = rows[after];
    const share = (time - t0) / (t1 - t0);
    return a.map((x, d) => x + share * (b[d] - x)) as Vector;
  };
}

// Throws an Error where the whole path is farther from the organ than the organ is large. organ: positions at rest, m.
export function checkPlaceOfPath({ points }: Path, organ: Float32Array) {
  const { low, high, diagonal: size } = boxOf(organ);
  let nearest = Infinity, nearestInMm = Infinity;
  const away = (at: number, unit: number) => Math.hypot(...low.map((least, d) => Math.max(0, least - unit * points[at + d], unit * points[at + d] - high[d])));
  for (let at = 0; at < points.length; at += 3) {
    if (Number.isNaN(points[at])) continue;
    nearest = Math.min(nearest, away(at, 1));
    nearestInMm = Math.min(nearestInMm, away(at, 1e-3));
  }
  if (nearest <= size) return;
  throw new Error(word(nearestInMm <= size ? "path.away.mm" : "path.away", { away: brief(nearest, 3) }));
}

// The step at which the path's tools are farthest, in sum, from where each of them came.
export function farthestStep({ points, steps }: Path): number {
  const row = 3 * TOOL_COUNT, from: (number[] | null)[] = Array(TOOL_COUNT).fill(null);
  let farthest = 0, most = -1;
  for (let step = 0; step < steps; ++step) {
    let sum = 0;
    for (let tool = 0; tool < TOOL_COUNT; ++tool) {
      const point = [...points.subarray(row * step + 3 * tool, row * step + 3 * tool + 3)];
      if (Number.isNaN(point[0])) continue;
      from[tool] ??= point;
      sum += distance(point, from[tool]!);
    }
    if (sum > most) [farthest, most] = [step, sum];
  }
  return farthest;
}

// The press that a replay plays before the user's first touch: the tool goes in, stays, and comes out. A pull: the tool comes to the
// surface, takes hold, and goes out.
export function demonstration(place: Vector, normal: Vector, depth = 0.012): Path {
  return moved(place, normal, [[0, 0.003], [0.15, 0], [1.1, -depth], [1.9, -depth], [2.4, 0.003]]);
}

// A press by which places are compared.
export const trialPress = (place: Vector, normal: Vector, depth: number): Path => moved(place, normal, [[0, 0.002], [0.1, 0], [0.4, -depth]]);

export function demonstrationOfPull(place: Vector, normal: Vector, height = 0.008): Path {
  const path = moved(place, normal, [[0, 0.002], [0.15, -3e-4], [1.1, height], [1.9, height]]);
  for (let step = 0; step < path.steps; ++step) path.hold[TOOL_COUNT * step] = 1;
  return path;
}

// keys: s, and m along the normal.
const moved = (place: Vector, normal: Vector, keys: [number, number][]) =>
  pathOfFile(keys.map(([time, height]) => [time, ...along(place, normal, height)].join(",")).join("\n"));

export function save(name: string, content: string | Blob) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(typeof content === "string" ? new Blob([content], { type: "text/plain" }) : content);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
