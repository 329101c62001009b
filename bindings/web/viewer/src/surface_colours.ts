// What colours the organ: the length of each vertex' displacement, or its dent (local_dent.ts).
import { cross, distance, lengthOf, normalise } from "./geometry";
import { LocalDent } from "./local_dent";
import type { ColourBy } from "./messages";

const RING = 3; // in radii of the tool's disc: beyond this distance the surface moves as a whole

export interface Surface {
  rest: Float32Array; // [vertex][3] m
  normals: Float32Array;
  parents?: Uint32Array; // of its last vertices, as in BoundMesh: their lengths are the means of those two
}

export class SurfaceColours {
  private dent: LocalDent | null = null; // made when it is first asked for
  private radius = 0; // of the dent

  // spacing: of the organ's mesh, m, which resolves no smaller dent.
  constructor(private surface: Surface, private spacing: number) {}

  // displacements: [vertex][3] m; lengths: [vertex] m. made: as DrawnSurface has it.
  fillCut(by: ColourBy, displacements: Float32Array, discRadius: number, lengths: Float32Array, made: Int32Array) {
    const { rest } = this.surface, u = made.length ? displacements.slice() : displacements;
    // A shape has the displacement of a new node from a place that is none of the organ.
    for (let i = 0; i < made.length; i += 2) for (let d = 0; d < 3; ++d) u[3 * made[i] + d] += rest[3 * made[i] + d] - rest[3 * made[i + 1] + d];
    this.fill(by, u, discRadius, lengths);
    if (by === "dent") for (let i = 0; i < made.length; i += 2) lengths[made[i]] = this.dent!.depthAt(made[i + 1], u, made[i]);
  }

  // displacements: [vertex][3] m; lengths: [vertex] m.
  fill(by: ColourBy, displacements: Float32Array, discRadius: number, lengths: Float32Array) {
    const { parents } = this.surface, own = lengths.length - (parents?.length ?? 0) / 2;
    this.fillOwn(by, displacements, discRadius, lengths.subarray(0, own));
    for (let v = own; v < lengths.length; ++v) lengths[v] = (lengths[parents![2 * (v - own)]] + lengths[parents![2 * (v - own) + 1]]) / 2;
  }

  private fillOwn(by: ColourBy, displacements: Float32Array, discRadius: number, lengths: Float32Array) {
    const u = displacements;
    if (by !== "dent") {
      for (let v = 0; v < lengths.length; ++v) lengths[v] = Math.hypot(u[3 * v], u[3 * v + 1], u[3 * v + 2]);
      return;
    }
    const radius = Math.max(RING * discRadius, this.spacing);
    if (radius !== this.radius) this.dent = new LocalDent(this.surface.rest.subarray(0, 3 * lengths.length), this.surface.normals, radius);
    this.radius = radius;
    this.dent!.depths(u, lengths);
  }
}

// The surface of a mesh with its vertices' normals, and the mean length of its edges.
export function surfaceOf(rest: Float32Array, triangles: ArrayLike<number>): Surface & { spacing: number } {
  const normals = new Float32Array(rest.length);
  let sum = 0;
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [triangles[t], triangles[t + 1], triangles[t + 2]].map((n) => rest.subarray(3 * n, 3 * n + 3));
    const u = [0, 1, 2].map((d) => b[d] - a[d]), v = [0, 1, 2].map((d) => c[d] - a[d]);
    const normal = cross(u, v);
    for (let i = 0; i < 3; ++i) for (let d = 0; d < 3; ++d) normals[3 * triangles[t + i] + d] += normal[d];
    sum += lengthOf(u) + lengthOf(v) + distance(u, v);
  }
  normalise(normals);
  return { rest, normals, spacing: sum / triangles.length };
}
