// From where one sees each of several organs best.
import type { Mesh, Vector } from "./messages";

const CELLS = 24; // of a picture, in each direction
const TURN = 30; // degrees between two directions that are looked along
const HEIGHTS = [-30, -10, 10, 30, 50]; // degrees
const FRONT = 0.2; // what it counts that the direction is the front

// The direction, of those all around, in which the organ that is hidden most is hidden least by the others; directions near `front` are
// preferred. meshes: in one frame.
export function clearestDirection(meshes: Mesh[], front: Vector): Vector {
  const samples = meshes.map(samplesOf);
  let best = front, most = scoreOf(samples, front) + FRONT;
  for (const height of HEIGHTS)
    for (let azimuth = 0; azimuth < 360; azimuth += TURN) {
      const [a, h] = [azimuth, height].map((degrees) => (degrees * Math.PI) / 180), way: Vector = [Math.cos(a) * Math.cos(h), Math.sin(a) * Math.cos(h), Math.sin(h)];
      const score = scoreOf(samples, way) + FRONT * way.reduce((sum, x, d) => sum + x * front[d], 0);
      if (score > most) [best, most] = [way, score];
    }
  return best;
}

// The nodes and the middles of the triangles.
function samplesOf({ positions, triangles }: Mesh): Float32Array {
  const samples = new Float32Array(positions.length + triangles.length);
  samples.set(positions);
  for (let t = 0; t < triangles.length; t += 3)
    for (let d = 0; d < 3; ++d) samples[positions.length + t + d] = (positions[3 * triangles[t] + d] + positions[3 * triangles[t + 1] + d] + positions[3 * triangles[t + 2] + d]) / 3;
  return samples;
}

// The share of the cells of its own picture in which an organ is the nearest, of the organ that has the least.
function scoreOf(samples: Float32Array[], way: Vector): number {
  const length = Math.hypot(way[0], way[1]), right: Vector = [-way[1] / length, way[0] / length, 0];
  const up: Vector = [-way[2] * right[1], way[2] * right[0], way[0] * right[1] - way[1] * right[0]];
  const along = (points: Float32Array, i: number, axis: Vector) => points[i] * axis[0] + points[i + 1] * axis[1] + points[i + 2] * axis[2];
  const all = samples.flatMap((points) => Array.from({ length: points.length / 3 }, (_, i) => [along(points, 3 * i, right), along(points, 3 * i, up)]));
  const [left, low] = [0, 1].map((d) => all.reduce((least, one) => Math.min(least, one[d]), Infinity));
  const size = Math.max(...[0, 1].map((d) => all.reduce((largest, one) => Math.max(largest, one[d] - [left, low][d]), 0))) / CELLS || 1;
  const nearest = new Map<number, { depth: number; organ: number }>(), own = samples.map(() => new Set<number>());
  samples.forEach((points, organ) => {
    for (let i = 0; i < points.length; i += 3) {
      const cell = Math.floor((along(points, i, right) - left) / size) * (CELLS + 1) + Math.floor((along(points, i, up) - low) / size), depth = along(points, i, way);
      own[organ].add(cell);
      const before = nearest.get(cell);
      if (!before || depth > before.depth) nearest.set(cell, { depth, organ });
    }
  });
  return Math.min(...own.map((cells, organ) => [...cells].filter((cell) => nearest.get(cell)!.organ === organ).length / cells.size));
}
