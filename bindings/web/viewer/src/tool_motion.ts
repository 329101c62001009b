// Moves a tool between two messages of the pointer: it follows its target touch by touch, without jumps.
import { TOUCH_HZ, type ToolTarget, type Vector } from "./messages";

const FOLLOW = 1 - Math.exp(-1 / (0.012 * TOUCH_HZ)); // share of the remaining way per touch: the tool lags the pointer by 12 ms
const RETREAT = 1 - Math.exp(-1 / (0.05 * TOUCH_HZ));
const GONE = 2e-4; // m from its start: nearer than this the tool has withdrawn

export class ToolMotion {
  point: Vector;
  private grasped = false;

  constructor(public target: ToolTarget) {
    this.point = [...target.start];
  }

  get holds() {
    return this.target.grasp !== null && this.target.down;
  }

  // Moves the tool by one touch. meets: the tool was in contact in the last touch. Returns false when it has withdrawn; a tool that
  // pulls lets go and is gone at once.
  step(meets: boolean): boolean {
    const { point, target } = this;
    if (target.grasp && !target.down) return false;
    this.grasped ||= meets;
    const goal = !target.down ? target.start : target.grasp && !this.grasped ? target.grasp : target.point;
    const share = target.down ? FOLLOW : RETREAT;
    let left = 0;
    for (let d = 0; d < 3; ++d) {
      point[d] += share * (goal[d] - point[d]);
      left = Math.max(left, Math.abs(goal[d] - point[d]));
    }
    return target.down || left > GONE;
  }
}
