// Records a touch step by step, from the arrival of the first tool to the departure of the last one.
import { TOOL_COUNT, TOUCH_HZ, type Recording, type Vector } from "./messages";

const MOST_STEPS = 60 * TOUCH_HZ;
export type RecordedTool = { point: Vector; hold: boolean } | null;

export class Recorder {
  steps = 0;
  private points = new Float64Array(0);
  private hold = new Uint8Array(0);

  clear() {
    this.steps = 0;
  }

  add(tools: RecordedTool[]) {
    if (this.steps === MOST_STEPS) return;
    if ((this.steps + 1) * TOOL_COUNT > this.hold.length) this.grow();
    for (let t = 0; t < TOOL_COUNT; ++t) {
      const at = this.steps * TOOL_COUNT + t, tool = tools[t];
      this.hold[at] = tool?.hold ? 1 : 0;
      for (let d = 0; d < 3; ++d) this.points[3 * at + d] = tool ? tool.point[d] : NaN;
    }
    ++this.steps;
  }

  take(): Recording {
    const end = this.steps * TOOL_COUNT;
    return { steps: this.steps, points: this.points.slice(0, 3 * end), hold: this.hold.slice(0, end) };
  }

  private grow() {
    const capacity = Math.max(4096, 2 * this.hold.length);
    const wider = <T extends Float64Array | Uint8Array>(to: T, from: T) => (to.set(from), to);
    this.hold = wider(new Uint8Array(capacity), this.hold);
    this.points = wider(new Float64Array(3 * capacity), this.points);
  }
}

// A tool's state at one step of a recording.
export function recordedTool(recording: Recording, step: number, tool: number): RecordedTool {
  const at = step * TOOL_COUNT + tool;
  const point = [...recording.points.subarray(3 * at, 3 * at + 3)] as Vector;
  return Number.isNaN(point[0]) ? null : { point, hold: recording.hold[at] === 1 };
}
