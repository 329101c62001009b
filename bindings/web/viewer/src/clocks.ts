// Times and rates that the page shows.
import type { TouchFrame, Times } from "./messages";
import { word } from "./words";

const KEPT = 100; // frames

// Milliseconds of the page's own work per frame (the shape into the mesh, normals, colours, drawing), and frames per second, of the last frames
// that were drawn. At rest none is drawn: a pause is no slow frame.
export class FrameClock {
  private times: { ms: number; after: number | null }[] = []; // after: ms since the frame before; null: after a pause
  private last: number | null = null; // start of the frame before

  add(start: number, end: number) {
    this.times.push({ ms: end - start, after: this.last === null ? null : start - this.last });
    if (this.times.length > KEPT) this.times.shift();
    this.last = start;
  }
  pause() {
    this.last = null;
  }
  get median() {
    const sorted = this.times.map((t) => t.ms).sort((a, b) => a - b);
    return sorted[sorted.length >> 1] ?? 0;
  }
  get rate() {
    const apart = this.times.flatMap(({ after }) => after ?? []), sum = apart.reduce((all, ms) => all + ms, 0);
    return sum > 0 ? (1000 * apart.length) / sum : 0;
  }
}

// The median of the last values, and where the middle 80 % of them lie.
export class Spread implements Times {
  private values: number[] = [];
  constructor(private kept = KEPT) {}
  add(value: number) {
    this.values.push(value);
    if (this.values.length > this.kept) this.values.shift();
  }
  get median() {
    return this.at(0.5);
  }
  get low() {
    return this.at(0.1);
  }
  get high() {
    return this.at(0.9);
  }
  private at(share: number): number {
    const sorted = [...this.values].sort((a, b) => a - b);
    return sorted[Math.floor(share * (sorted.length - 1))] ?? 0;
  }
}

const SHORTEST = 400; // ms, over which a rate is measured
const PACE_KEPT = 3000; // ms, over which the pace of what plays is measured
const KEEPS_UP = 0.95; // from this share on what plays has its own pace

// Touches per second, of the last second in which there were any.
export class TouchRate {
  private frames: { at: number; touches: number }[] = [];
  add(touches: number, now: number) {
    if (!touches) return void (this.frames = []);
    this.frames.push({ at: now, touches });
    while (this.frames.length > 2 && now - this.frames[0].at > 1000) this.frames.shift();
  }
  get words() {
    const first = this.frames[0], last = this.frames.at(-1);
    if (!first || !last || last.at - first.at < SHORTEST) return word("times.measuring");
    const hertz = (1000 * this.frames.slice(1).reduce((sum, { touches }) => sum + touches, 0)) / (last.at - first.at);
    return `${hertz.toFixed(0)} Hz`;
  }
}

// How fast something plays that leaves no touch out: the share of the touches that were due which the loop has made, over the last seconds.
export class Pace {
  private frames: Pick<TouchFrame, "at" | "lost" | "made">[] = [];

  // plays: else the next frame is the first one.
  add({ at, lost, made }: Pick<TouchFrame, "at" | "lost" | "made">, plays: boolean) {
    if (!plays) return void (this.frames = []);
    this.frames.push({ at, lost, made });
    while (this.frames.length > 2 && at - this.frames[0].at > PACE_KEPT) this.frames.shift();
  }

  // 1: it keeps up, or it has not been measured yet.
  get share(): number {
    const first = this.frames[0], last = this.frames.at(-1);
    if (!first || !last || last.at - first.at < SHORTEST) return 1;
    const sum = (of: "lost" | "made") => this.frames.slice(1).reduce((all, frame) => all + frame[of], 0), made = Math.max(1, sum("made")); // of a touch that takes longer than the window too
    const share = made / (made + sum("lost"));
    return share < KEEPS_UP ? share : 1;
  }
}
