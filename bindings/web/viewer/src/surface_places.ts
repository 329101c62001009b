// Places on an organ's touchable surface by the point that they are near to, as palpate-run finds them (programs/player/tool_places.cpp).
import { Triangle, Vector3 } from "three";
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

// null where no triangle has three touchable nodes. near: m, in the organ's frame. within: links end on the whole surface.
export function nearestPlace({ info, nodes, triangles, touchable }: Pick<Bundle, "info" | "nodes" | "triangles" | "touchable">, near: Vector, within: "touchable" | "surface" = "touchable"): SurfacePlace | null {
  const canTouch = new Uint8Array(info.surfaceNodeCount), p = new Vector3(...near), on = new Vector3(), triangle = new Triangle();
  if (within === "surface") canTouch.fill(1);
  else for (const node of touchable) canTouch[node] = 1;
  const corner = (node: number, into: Vector3) => into.set(nodes[3 * node], nodes[3 * node + 1], nodes[3 * node + 2]);
  const setTriangle = (t: number) => [triangle.a, triangle.b, triangle.c].forEach((into, c) => corner(triangles[3 * t + c], into));
  let best = -1, least = Infinity;
  for (let t = 0; t < info.triangleCount; ++t) {
    if (![0, 1, 2].every((c) => canTouch[triangles[3 * t + c]])) continue;
    setTriangle(t);
    const away = triangle.closestPointToPoint(p, on).distanceToSquared(p);
    if (away < least) [best, least] = [t, away];
  }
  if (best < 0) return null;
  setTriangle(best);
  triangle.closestPointToPoint(p, on);
  const weights = triangle.getBarycoord(on, new Vector3())!.toArray() as Vector;
  return { point: on.toArray() as Vector, normal: normalAt(best, weights, triangles, nodes), triangle: best, barycentric: weights };
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
  const pointOf = (node: number) => [...nodes.subarray(3 * node, 3 * node + 3)] as Vector, along = (v: Vector) => v.reduce((sum, x, d) => sum + x * direction[d], 0);
  for (const allowed of [inside, canTouch]) {
    const candidates = [...touchable].filter((node) => allowed[node]);
    if (!candidates.length) continue;
    const most = Math.max(...candidates.map((node) => along(pointOf(node)))), level = SAME_LEVEL * diagonalOf(bundle);
    const places = candidates.filter((node) => along(pointOf(node)) >= most - level).map((node) => ({ point: pointOf(node), normal: normalAtNode(node, triangles, nodes) }));
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

function normalAtNode(node: number, triangles: Int32Array, nodes: Float64Array): Vector {
  const at = Math.floor(triangles.indexOf(node) / 3), corners = [...triangles.subarray(3 * at, 3 * at + 3)];
  return normalAt(at, corners.map((corner) => (corner === node ? 1 : 0)) as Vector, triangles, nodes);
}

// The weighted normals of the triangle's corners, each as long as twice the area around it.
function normalAt(at: number, weights: Vector, triangles: Int32Array, nodes: Float64Array): Vector {
  const corners = [...triangles.subarray(3 * at, 3 * at + 3)], normal = new Vector3(), u = new Vector3(), v = new Vector3();
  const edge = (from: number, to: number, into: Vector3) => into.set(nodes[3 * to] - nodes[3 * from], nodes[3 * to + 1] - nodes[3 * from + 1], nodes[3 * to + 2] - nodes[3 * from + 2]);
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = triangles.subarray(t, t + 3), share = corners.reduce((sum, corner, i) => sum + (corner === a || corner === b || corner === c ? weights[i] : 0), 0);
    if (share) normal.addScaledVector(edge(a, b, u).cross(edge(a, c, v)), share);
  }
  return normal.normalize().toArray() as Vector;
}
