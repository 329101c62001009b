// Vectors, and what points have in common. points: [point][3].
import { Box3 } from "three";
import type { Vector } from "./messages";

export const lengthOf = (v: ArrayLike<number>) => Math.hypot(v[0], v[1], v[2]);
export const distance = (a: ArrayLike<number>, b: ArrayLike<number>) => Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
export const along = (from: Vector, direction: Vector, by: number) => from.map((x, d) => x + by * direction[d]) as Vector;
export const dot = (a: ArrayLike<number>, b: ArrayLike<number>) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a: ArrayLike<number>, b: ArrayLike<number>): Vector => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const unit = (a: Vector) => a.map((x) => x / (lengthOf(a) || 1)) as Vector;

// Two unit vectors that are orthogonal to the axis, which has length 1, and to each other.
export function acrossOf(axis: Vector): [Vector, Vector] {
  const sizes = axis.map(Math.abs), smallest = sizes.indexOf(Math.min(...sizes));
  const u = unit(cross(axis, [0, 1, 2].map((d) => (d === smallest ? 1 : 0))));
  return [u, cross(axis, u)];
}

export function boxOf(points: ArrayLike<number>): { low: Vector; high: Vector; diagonal: number } {
  const { min, max } = new Box3().setFromArray(points);
  return { low: min.toArray(), high: max.toArray(), diagonal: min.distanceTo(max) };
}

// Among `points`, of the one that lies nearest.
export function nearestIndex(place: ArrayLike<number>, points: ArrayLike<number>): number {
  const [x, y, z] = [place[0], place[1], place[2]];
  let least = Infinity, nearest = 0;
  for (let n = 0; n < points.length; n += 3) {
    const square = (points[n] - x) ** 2 + (points[n + 1] - y) ** 2 + (points[n + 2] - z) ** 2;
    if (square < least) [least, nearest] = [square, n / 3];
  }
  return nearest;
}

// Each becomes of length 1.
export function normalise(vectors: Float32Array, from = 0) {
  for (let at = from; at < vectors.length; at += 3) {
    const length = Math.hypot(vectors[at], vectors[at + 1], vectors[at + 2]) || 1;
    for (let d = 0; d < 3; ++d) vectors[at + d] /= length;
  }
}

// The largest length of vectors, [][x y z].
export function largestOf(vectors: ArrayLike<number>): number {
  let most = 0;
  for (let i = 0; i < vectors.length; i += 3) most = Math.max(most, Math.hypot(vectors[i], vectors[i + 1], vectors[i + 2]));
  return most;
}

export const middleOf = (points: Vector[]): Vector => [0, 1, 2].map((d) => points.reduce((sum, point) => sum + point[d], 0) / points.length) as Vector;
