// The tools that the pointer holds, touch by touch: where each is, and where it met tissue.
import { distance } from "./geometry";
import { TOOL_COUNT, type ToolTarget, type Vector } from "./messages";
import type { RecordedTool } from "./recorder";
import { ToolMotion } from "./tool_motion";

export class HeldTools {
  private motions: (ToolMotion | null)[] = Array(TOOL_COUNT).fill(null);
  private fresh: boolean[] = Array(TOOL_COUNT).fill(false); // a new tool took this one's place: the old one is gone for one touch
  private met: (Vector | null)[] = Array(TOOL_COUNT).fill(null);

  get active(): boolean {
    return this.motions.some(Boolean);
  }

  // Of this touch; then moves each of them on.
  move(): RecordedTool[] {
    return this.motions.map((motion, index) => {
      if (!motion || this.fresh[index]) return (this.fresh[index] = false), null;
      const tool = { point: [...motion.point] as Vector, hold: motion.holds };
      if (!motion.step(this.met[index] !== null)) this.motions[index] = null;
      return tool;
    });
  }

  // After a touch. Returns whether a contact begins.
  meet(index: number, tool: RecordedTool, contacts: number): boolean {
    if (!tool || contacts === 0) return (this.met[index] = null), false;
    if (this.met[index]) return false;
    this.met[index] = tool.point;
    return true;
  }

  isIn(index: number): boolean {
    return this.met[index] !== null;
  }

  // m, from the point where the tool met tissue; 0 before that.
  depth(index: number, point: Vector): number {
    const from = this.met[index];
    return from ? distance(point, from) : 0;
  }

  // Returns whether there is a tool that moves.
  place(index: number, target: ToolTarget): boolean {
    const motion = this.motions[index];
    if (!motion && !target.down) return false;
    // A press elsewhere is a new tool, which begins at its own start.
    if (motion && distance(motion.target.start, target.start) === 0) motion.target = target;
    else if (target.down) {
      this.fresh[index] = motion !== null;
      this.motions[index] = new ToolMotion(target);
    }
    return true;
  }

  withdraw(index: number) {
    this.motions[index] = null;
  }

  forget() {
    this.motions.fill(null);
    this.fresh.fill(false);
    this.met.fill(null);
  }
}
