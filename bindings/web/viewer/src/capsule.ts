// Points on the skin of a capsule, a rod with round ends, as palpate-run has them (programs/player/tool_points.cpp).
import { acrossOf } from "./geometry";
import type { Vector } from "./messages";

export interface Capsule {
  radius: number;
  length: number; // between the centres of the caps
  axis: Vector; // of length 1
  samples: number;
}

const GOLDEN_ANGLE = Math.PI * (3 - Math.sqrt(5));

// In the capsule's unit; the origin is the centre of the first cap.
export function pointsOf(capsule: Capsule): Vector[] {
  const { radius, length, axis, samples } = capsule, [u, v] = acrossOf(axis);
  return Array.from({ length: samples }, (_, i) => {
    const height = -radius + ((length + 2 * radius) * i) / (samples - 1), beyond = height < 0 ? height : Math.max(0, height - length);
    const out = Math.sqrt(Math.max(0, radius * radius - beyond * beyond)), angle = GOLDEN_ANGLE * i;
    return axis.map((x, d) => height * x + out * (Math.cos(angle) * u[d] + Math.sin(angle) * v[d])) as Vector;
  });
}
