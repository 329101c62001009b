// Places on an organ's touchable surface by the point that they are near to, as palpate-run finds them (programs/player/tool_places.cpp), with the
// same sums in the same order: under large deformation a last digit that differs can grow to thousandths of the force, where a solve ends one step
// earlier.
import type { Bundle } from "../../module/palpate.js";
import { boxOf, distance } from "./geometry";
import type { Vector } from "./messages";
import { word } from "./words";

export interface SurfacePlace {
  point: Vector;
  normal: Vector; // unit, outwards
  triangle: number;
  barycentric: Vector;
}

const minus = (a: Vector, b: Vector): Vector => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const dot = (a: Vector, b: Vector) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a: Vector, b: Vector): Vector => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const weighted = ([a, b, c]: Vector[], weights: Vector) => a.map((_, d) => weights[0] * a[d] + weights[1] * b[d] + weights[2] * c[d]) as Vector;
const pointOf = (node: number, nodes: Float64Array): Vector => [nodes[3 * node], nodes[3 * node + 1], nodes[3 * node + 2]];

// The barycentric coordinates of the point of a triangle that is nearest to p: Ericson 2005, Real-Time Collision Detection, section 5.1.5.
function nearestInTriangle(p: Vector, [a, b, c]: Vector[]): Vector {
  const ab = minus(b, a), ac = minus(c, a), ap = minus(p, a), bp = minus(p, b), cp = minus(p, c);
  const d1 = dot(ab, ap), d2 = dot(ac, ap), d3 = dot(ab, bp), d4 = dot(ac, bp), d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d1 <= 0 && d2 <= 0) return [1, 0, 0];
  if (d3 >= 0 && d4 <= d3) return [0, 1, 0];
  if (d6 >= 0 && d5 <= d6) return [0, 0, 1];
  const vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return [1 - d1 / (d1 - d3), d1 / (d1 - d3), 0];
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return [1 - d2 / (d2 - d6), 0, d2 / (d2 - d6)];
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const w = (d4 - d3) / (d4 - d3 + (d5 - d6));
    return [0, 1 - w, w];
  }
  const sum = va + vb + vc;
  return [va / sum, vb / sum, vc / sum];
}

// null where no triangle has three touchable nodes. near: m, in the organ's frame. within: links end on the whole surface.
export function nearestPlace({ info, nodes, triangles, touchable }: Pick<Bundle, "info" | "nodes" | "triangles" | "touchable">, near: Vector, within: "touchable" | "surface" = "touchable"): SurfacePlace | null {
  const canTouch = new Uint8Array(info.surfaceNodeCount);
  if (within === "surface") canTouch.fill(1);
  else for (const node of touchable) canTouch[node] = 1;
  const cornersOf = (t: number) => [0, 1, 2].map((c) => pointOf(triangles[3 * t + c], nodes));
  let best = -1, least = Infinity, barycentric: Vector = [1, 0, 0];
  for (let t = 0; t < info.triangleCount; ++t) {
    if (![0, 1, 2].every((c) => canTouch[triangles[3 * t + c]])) continue;
    const corners = cornersOf(t), weights = nearestInTriangle(near, corners), away = minus(weighted(corners, weights), near), square = dot(away, away);
    if (square < least) [best, least, barycentric] = [t, square, weights];
  }
  if (best < 0) return null;
  return { point: weighted(cornersOf(best), barycentric), normal: normalAt(best, barycentric, triangles, nodes), triangle: best, barycentric };
}

const SAME_LEVEL = 1e-6; // of the diagonal

// The touchable node that lies farthest along a direction, away from the end of the touchable surface where there is such a node; null where
// nothing is touchable. Of nodes that lie equally far, as on a flat face, the one whose normal points best along the direction.
export function farthestPlace(bundle: Bundle, direction: Vector): Omit<SurfacePlace, "triangle" | "barycentric"> | null {
  const { info, nodes, triangles, touchable } = bundle, canTouch = new Uint8Array(info.surfaceNodeCount), inside = new Uint8Array(info.surfaceNodeCount);
  for (const node of touchable) canTouch[node] = inside[node] = 1;
  for (let t = 0; t < triangles.length; t += 3) {
    const corners = triangles.subarray(t, t + 3);
    if (corners.some((node) => !canTouch[node])) corners.forEach((node) => (inside[node] = 0));
  }
  const along = (v: Vector) => v.reduce((sum, x, d) => sum + x * direction[d], 0);
  for (const allowed of [inside, canTouch]) {
    const candidates = [...touchable].filter((node) => allowed[node]);
    if (!candidates.length) continue;
    const most = Math.max(...candidates.map((node) => along(pointOf(node, nodes)))), level = SAME_LEVEL * diagonalOf(bundle);
    const places = candidates.filter((node) => along(pointOf(node, nodes)) >= most - level).map((node) => ({ point: pointOf(node, nodes), normal: normalAtNode(node, triangles, nodes) }));
    return places.reduce((best, place) => (along(place.normal) > along(best.normal) ? place : best));
  }
  return null;
}

// As nearestPlace(); throws an Error where the place is farther away than the organ is large. what: the part of the scene that asks, for the Error.
export function placeOn(bundle: Bundle, near: Vector, what: string, organ: string, within: "touchable" | "surface" = "touchable"): SurfacePlace {
  const place = nearestPlace(bundle, near, within), away = place ? distance(place.point, near) : 0;
  if (!place || away > diagonalOf(bundle)) throw new Error(word(place ? "world.far" : "world.untouchable", { what, organ, away: (1000 * away).toPrecision(3) }));
  return place;
}

const diagonalOf = ({ info, nodes }: Bundle) => boxOf(nodes.subarray(0, 3 * info.surfaceNodeCount)).diagonal;

// As long as twice the area around the node.
function areaNormal(node: number, triangles: Int32Array, nodes: Float64Array): Vector {
  const sum: Vector = [0, 0, 0];
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = triangles.subarray(t, t + 3);
    if (a !== node && b !== node && c !== node) continue;
    const from = pointOf(a, nodes), normal = cross(minus(pointOf(b, nodes), from), minus(pointOf(c, nodes), from));
    for (let d = 0; d < 3; ++d) sum[d] += normal[d];
  }
  return sum;
}

function unit(normal: Vector): Vector {
  const length = Math.sqrt(dot(normal, normal));
  return normal.map((x) => x / (length > 0 ? length : 1)) as Vector;
}

const normalAtNode = (node: number, triangles: Int32Array, nodes: Float64Array) => unit(areaNormal(node, triangles, nodes));

// The weighted normals of the triangle's corners.
const normalAt = (at: number, weights: Vector, triangles: Int32Array, nodes: Float64Array) =>
  unit(weighted([0, 1, 2].map((c) => areaNormal(triangles[3 * at + c], triangles, nodes)), weights));
