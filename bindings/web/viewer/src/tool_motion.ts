// A tool between two words of the pointer: it follows its target without jumps, touch by touch.
import { TOUCH_HZ, type ToolTarget, type Vector } from "./messages";

const FOLLOW = 1 - Math.exp(-1 / (0.012 * TOUCH_HZ)); // of the way per touch: 12 ms behind the pointer
const RETREAT = 1 - Math.exp(-1 / (0.05 * TOUCH_HZ));
const GONE = 2e-4; // m from its start: it has withdrawn

export class ToolMotion {
  point: Vector;

  constructor(public target: ToolTarget) {
    this.point = [...target.start];
  }

  // Moves on by one touch. False: the tool has withdrawn and is gone.
  step(): boolean {
    const { point, target } = this;
    const goal = target.down ? target.point : target.start;
    const share = target.down ? FOLLOW : RETREAT;
    let left = 0;
    for (let d = 0; d < 3; ++d) {
      point[d] += share * (goal[d] - point[d]);
      left = Math.max(left, Math.abs(goal[d] - point[d]));
    }
    return target.down || left > GONE;
  }
}
