// The scalpel that the pointer holds, touch by touch: its edge follows the pointer without jumps, and goes when it has come to where it was let go.
import type { Blade } from "../../module/palpate.js";
import { cross, distance, lengthOf, middleOf, unit } from "./geometry";
import { TOUCH_HZ, type Edge, type Vector } from "./messages";

const FOLLOW = 1 - Math.exp(-1 / (0.012 * TOUCH_HZ)); // share of the remaining way per touch: the edge lags the pointer by 12 ms
const ARRIVED = 1e-4; // m
const LEAST_WAY = 1e-6; // m in a touch, that says where the edge looks

export class HeldBlade {
  edge: Edge | null = null; // in the last touch; null: there is no blade
  private begin: Edge | null = null; // where the pointer went down: a busy thread may learn of several places before its next touch
  private target: Edge | null = null;
  private toughness = 0; // J/m^2
  private direction: Vector | null = null; // where the edge looks
  private isLetGo = false;

  get active(): boolean {
    return this.target !== null;
  }

  // edge: where it goes; null: it is let go.
  place(edge: Edge | null, toughness: number) {
    if (edge) {
      if (this.isLetGo) this.forget(); // another drag: the edge does not go on from where the last one ended
      this.begin ??= edge;
      this.target = edge;
    }
    this.isLetGo = edge === null;
    this.toughness = toughness;
  }

  // For the next touch; null: there is no blade. waits: what it has passed is not cut yet.
  move(waits: boolean): Blade | null {
    const { target, edge } = this;
    if (!target || (edge && this.isLetGo && !waits && this.left < ARRIVED)) {
      this.forget();
      return null;
    }
    this.edge = edge ? (edge.map((point, p) => point.map((x, d) => x + FOLLOW * (target[p][d] - x))) as Edge) : this.begin!;
    if (edge) this.look(edge, this.edge);
    const { direction, toughness } = this;
    return { points: this.edge.flat(), ...(direction && toughness > 0 ? { direction, toughness } : {}) };
  }

  forget() {
    this.edge = this.begin = this.target = this.direction = null;
  }

  // m, to the target.
  private get left(): number {
    return Math.max(...this.edge!.map((point, p) => distance(point, this.target![p])));
  }

  // Across the edge, along its way.
  private look(before: Edge, now: Edge) {
    const from = middleOf(before), way = middleOf(now).map((x, d) => x - from[d]) as Vector, axis = unit(now[1].map((x, d) => x - now[0][d]) as Vector);
    const across = cross(axis, cross(way, axis));
    if (lengthOf(across) > LEAST_WAY) this.direction = unit(across);
  }
}
