// Records a touch step by step, from the arrival of the first tool to the departure of the last one: tools and forces.
import { TOOL_COUNT, TOUCH_HZ, type Path, type PageEffects, type Recording, type ToolShape, type Vector } from "./messages";

export const MOST_STEPS = 3600 * TOUCH_HZ; // an hour, 350 MB
export type RecordedTool = { point: Vector; hold: boolean } | null;

export class Recorder {
  steps = 0;
  private points = new Float64Array(0);
  private forces = new Float64Array(0);
  private hold = new Uint8Array(0);

  clear() {
    this.steps = 0;
  }

  // forces: [tool], N.
  add(tools: RecordedTool[], forces: Vector[]) {
    if (this.steps === MOST_STEPS) return;
    if ((this.steps + 1) * TOOL_COUNT > this.hold.length) this.grow();
    for (let t = 0; t < TOOL_COUNT; ++t) {
      const at = this.steps * TOOL_COUNT + t, tool = tools[t];
      this.hold[at] = tool?.hold ? 1 : 0;
      this.points.set(tool ? tool.point : [NaN, NaN, NaN], 3 * at);
      this.forces.set(forces[t], 3 * at);
    }
    ++this.steps;
  }

  take(effects: PageEffects, tool: ToolShape): Recording {
    const end = this.steps * TOOL_COUNT;
    return { steps: this.steps, points: this.points.slice(0, 3 * end), forces: this.forces.slice(0, 3 * end), hold: this.hold.slice(0, end), effects, tool };
  }

  private grow() {
    const capacity = Math.max(4096, 2 * this.hold.length);
    const wider = <T extends Float64Array | Uint8Array>(to: T, from: T) => (to.set(from), to);
    this.hold = wider(new Uint8Array(capacity), this.hold);
    this.points = wider(new Float64Array(3 * capacity), this.points);
    this.forces = wider(new Float64Array(3 * capacity), this.forces);
  }
}

// A tool's state at one step of a path.
export function recordedTool(path: Path, step: number, tool: number): RecordedTool {
  const at = step * TOOL_COUNT + tool;
  const point = [...path.points.subarray(3 * at, 3 * at + 3)] as Vector;
  return Number.isNaN(point[0]) ? null : { point, hold: path.hold[at] === 1 };
}
