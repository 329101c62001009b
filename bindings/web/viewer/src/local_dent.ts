// How deep each vertex is dented: its displacement less the motion of the surface around it. A lobe that swings as a whole has no dent.
//
// The motion around a vertex is the linear function, in the plane of the surface, that fits best to the displacements of a ring of
// vertices on the same side of the organ; it contains every rigid motion of a flat ring. It is linear in the displacements, so that
// each ring becomes a list of weights, once.
import { acrossOf, dot } from "./geometry";
import type { Vector } from "./messages";

const FEWEST = 6; // vertices of a ring
const MOST = 40;

export class LocalDent {
  private first: Uint32Array; // [vertex + 1] of the lists
  private vertex: Uint32Array;
  private weight: Float32Array;

  // rest: [vertex][3] m; normals: [vertex][3], unit; radius: of the dent, m, inside which a vertex is not in the ring.
  // Cost: for each vertex those in its cell of the size of the ring and around.
  constructor(rest: Float32Array, normals: Float32Array, radius: number) {
    const count = rest.length / 3, grid = new Grid(rest, 2 * radius), vertices: number[] = [], weights: number[] = [];
    this.first = new Uint32Array(count + 1);
    for (let v = 0; v < count; ++v) {
      const ring = thinned(ringOf(v, rest, normals, radius, grid));
      const found = ring.length >= FEWEST ? weightsAt(v, ring, rest, normals) : [];
      if (found.length) vertices.push(...ring), weights.push(...found);
      this.first[v + 1] = vertices.length;
    }
    this.vertex = Uint32Array.from(vertices);
    this.weight = Float32Array.from(weights);
  }

  // displacements: [vertex][3] m; depths: [vertex] m, zero where too few vertices are around.
  depths(displacements: Float32Array, depths: Float32Array) {
    for (let v = 0; v < depths.length; ++v) depths[v] = this.depthAt(v, displacements);
  }

  // own: the vertex that has moved, where it is another one at the same place.
  depthAt(v: number, u: Float32Array, own = v): number {
    const { first, vertex, weight } = this;
    let x = u[3 * own], y = u[3 * own + 1], z = u[3 * own + 2];
    for (let i = first[v]; i < first[v + 1]; ++i) {
      const at = 3 * vertex[i], w = weight[i];
      x -= w * u[at], y -= w * u[at + 1], z -= w * u[at + 2];
    }
    return first[v] === first[v + 1] ? 0 : Math.hypot(x, y, z);
  }
}

class Grid {
  private cells = new Map<string, number[]>();
  constructor(private points: Float32Array, private size: number) {
    for (let v = 0; v < points.length / 3; ++v) {
      const key = this.cell(v).join();
      if (!this.cells.has(key)) this.cells.set(key, []);
      this.cells.get(key)!.push(v);
    }
  }
  *around(v: number) {
    const [i, j, k] = this.cell(v);
    for (let a = i - 1; a <= i + 1; ++a) for (let b = j - 1; b <= j + 1; ++b) for (let c = k - 1; c <= k + 1; ++c) yield* this.cells.get(`${a},${b},${c}`) ?? [];
  }
  private cell(v: number) {
    return [0, 1, 2].map((d) => Math.floor(this.points[3 * v + d] / this.size));
  }
}

// Vertices at one to two radii that face the same way.
function ringOf(v: number, rest: Float32Array, normals: Float32Array, radius: number, grid: Grid): number[] {
  const ring: number[] = [];
  for (const other of grid.around(v)) {
    let square = 0, facing = 0;
    for (let d = 0; d < 3; ++d) {
      square += (rest[3 * other + d] - rest[3 * v + d]) ** 2;
      facing += normals[3 * other + d] * normals[3 * v + d];
    }
    if (facing > 0.3 && square > radius * radius && square < 4 * radius * radius) ring.push(other);
  }
  return ring;
}

const thinned = (ring: number[]) => (ring.length <= MOST ? ring : Array.from({ length: MOST }, (_, i) => ring[Math.floor((i * ring.length) / MOST)]));

// The weights by which the ring's values give the linear fit at the vertex: the first row of (B^T B)^-1 B^T, where B has a row 1, a, b
// for each vertex of the ring, at a, b in the plane across the normal. None where the ring lies on a line.
function weightsAt(v: number, ring: number[], rest: Float32Array, normals: Float32Array): number[] {
  const [u, w] = acrossOf([...normals.subarray(3 * v, 3 * v + 3)] as Vector);
  const rows = ring.map((m) => {
    const away = [0, 1, 2].map((d) => rest[3 * m + d] - rest[3 * v + d]);
    return [1, dot(away, u), dot(away, w)];
  });
  const gram = [0, 1, 2].map((i) => [0, 1, 2].map((j) => rows.reduce((sum, row) => sum + row[i] * row[j], 0)));
  // The first column of the inverse, by minors.
  const minor = [gram[1][1] * gram[2][2] - gram[1][2] * gram[2][1], gram[1][2] * gram[2][0] - gram[1][0] * gram[2][2], gram[1][0] * gram[2][1] - gram[1][1] * gram[2][0]];
  const determinant = dot(gram[0], minor);
  if (!(determinant > 1e-9 * gram[0][0] * gram[1][1] * gram[2][2])) return [];
  return rows.map((row) => dot(row, minor) / determinant);
}
