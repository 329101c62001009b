// Finds the nodules of a bundle: pieces of a stiffer material that lie wholly inside, so that nobody sees them.
import { Vector3 } from "three";
import type { Bundle } from "../../module/palpate.js";
import { distance } from "./geometry";
import type { Vector } from "./messages";
import { nearestPlace } from "./surface_places";

const STIFFER = 1.5; // times the material around

export interface Nodule {
  centre: Vector; // of its volume, m
  radius: number; // of the ball of its volume, m
  stiffer: number; // times the material around
  above: Vector; // the touchable point of the surface that is nearest to the centre, at rest, m
}

const LARGE = 0.015; // m, radius from which a larger nodule is no easier to find
// How hard a nodule is to find by touch: the deeper, the smaller and the softer, the harder.
export function levelOf(nodule: Pick<Nodule, "centre" | "above" | "radius" | "stiffer"> | null): "easy" | "medium" | "hard" {
  if (!nodule) return "hard";
  const felt = (1 - 1 / nodule.stiffer) * Math.min(1, nodule.radius / distance(nodule.centre, nodule.above)) ** 2 * Math.min(1, nodule.radius / LARGE);
  return felt > 0.3 ? "easy" : felt > 0.15 ? "medium" : "hard";
}

type Body = Pick<Bundle, "info" | "nodes" | "triangles" | "tetrahedra" | "touchable" | "region" | "young">;

export function nodulesOf(body: Body): Nodule[] {
  const volumes = volumesOf(body), around = largestRegion(body, volumes);
  const isStiff = (t: number) => body.young[body.region[t]] > STIFFER * body.young[around];
  return pieces(body, Array.from(volumes.keys()).filter(isStiff))
    .filter((piece) => piece.every((t) => body.tetrahedra.subarray(4 * t, 4 * t + 4).every((node) => node >= body.info.surfaceNodeCount)))
    .map((piece) => noduleOf(body, volumes, piece, around));
}

function volumesOf({ nodes, tetrahedra }: Body): Float64Array {
  const corner = (at: number) => new Vector3().fromArray(nodes, 3 * tetrahedra[at]);
  return Float64Array.from({ length: tetrahedra.length / 4 }, (_, t) => {
    const origin = corner(4 * t), [a, b, c] = [1, 2, 3].map((i) => corner(4 * t + i).sub(origin));
    return a.dot(b.cross(c)) / 6;
  });
}

function largestRegion({ region, young }: Body, volumes: Float64Array): number {
  const sums = new Float64Array(young.length);
  volumes.forEach((volume, t) => (sums[region[t]] += volume));
  return sums.indexOf(Math.max(...sums));
}

// Tetrahedra that share nodes, piece by piece.
function pieces({ tetrahedra, info }: Body, chosen: number[]): number[][] {
  const parent = Int32Array.from({ length: info.nodeCount }, (_, node) => node);
  const root = (node: number) => {
    while (parent[node] !== node) node = parent[node] = parent[parent[node]];
    return node;
  };
  for (const t of chosen) for (let i = 1; i < 4; ++i) parent[root(tetrahedra[4 * t + i])] = root(tetrahedra[4 * t]);
  const found = new Map<number, number[]>();
  for (const t of chosen) {
    const of = root(tetrahedra[4 * t]);
    found.set(of, [...(found.get(of) ?? []), t]);
  }
  return [...found.values()];
}

function noduleOf(body: Body, volumes: Float64Array, piece: number[], around: number): Nodule {
  const centre = new Vector3(), corner = new Vector3();
  let volume = 0, young = 0;
  for (const t of piece) {
    volume += volumes[t];
    young += volumes[t] * body.young[body.region[t]];
    for (let i = 0; i < 4; ++i) centre.addScaledVector(corner.fromArray(body.nodes, 3 * body.tetrahedra[4 * t + i]), volumes[t] / 4);
  }
  centre.divideScalar(volume);
  return { centre: centre.toArray(), radius: Math.cbrt((3 * volume) / (4 * Math.PI)), stiffer: young / volume / body.young[around], above: nearestPlace(body, centre.toArray())?.point ?? [0, 0, 0] };
}
