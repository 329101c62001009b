// Times and rates that the page shows.
import type { Times } from "./messages";
import { word } from "./words";

const KEPT = 100; // frames

// Milliseconds of the page's own work per frame (the shape into the mesh, normals, colours, drawing), and frames per second, of the last two seconds.
export class FrameClock {
  times: { start: number; ms: number }[] = [];
  add(start: number, end: number) {
    this.times.push({ start, ms: end - start });
    while (this.times.length > 2 && start - this.times[0].start > 2000) this.times.shift();
  }
  get median() {
    const sorted = this.times.map((t) => t.ms).sort((a, b) => a - b);
    return sorted[sorted.length >> 1] ?? 0;
  }
  get rate() {
    const first = this.times[0], last = this.times.at(-1);
    return first && last && last.start > first.start ? ((this.times.length - 1) * 1000) / (last.start - first.start) : 0;
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
