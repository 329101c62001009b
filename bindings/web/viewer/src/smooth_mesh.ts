// A smoother mesh to draw: normals without the steps of the image's slices, and each triangle in four whose new vertices lie on a curve
// between the old ones. The vertices of the file stay where they are, and first.
import type { RenderMesh } from "../../module/palpate.js";
import { normalise } from "./geometry";

export interface DrawnMesh extends Required<RenderMesh> {
  triangles: Uint32Array;
  parents: Uint32Array; // [new vertex][2]: the vertices of the file at the ends of its edge; empty: there are none
}

const ROUNDS = 8; // of the mean over neighbours
const MOST_TRIANGLES = 40_000; // of a file; a finer one is smooth enough

export function smoothMesh({ positions, normals, triangles }: Omit<DrawnMesh, "parents">): DrawnMesh {
  const smooth = smoothNormals(normals, triangles);
  if (triangles.length / 3 > MOST_TRIANGLES) return { positions, normals: smooth, triangles, parents: new Uint32Array(0) };
  return split(positions, smooth, triangles);
}

// Each normal becomes the mean of its own and those at the other ends of its edges, several times.
function smoothNormals(normals: Float32Array, triangles: Uint32Array): Float32Array {
  let now = normals;
  for (let round = 0; round < ROUNDS; ++round) {
    const next = now.slice();
    for (let i = 0; i < triangles.length; ++i) {
      const from = 3 * triangles[i], to = 3 * triangles[i % 3 === 2 ? i - 2 : i + 1];
      for (let d = 0; d < 3; ++d) next[to + d] += now[from + d];
    }
    normalise(next);
    now = next;
  }
  return now;
}

// The middle of an edge lies on the cubic curve that leaves both ends across their normals (curved PN triangles, Vlachos and others 2001).
function split(positions: Float32Array, normals: Float32Array, triangles: Uint32Array): DrawnMesh {
  const count = positions.length / 3, parents: number[] = [], middle = new Map<number, number>();
  const middleOf = (a: number, b: number) => {
    const key = Math.min(a, b) * 2 ** 26 + Math.max(a, b);
    if (!middle.has(key)) middle.set(key, count + parents.push(a, b) / 2 - 1);
    return middle.get(key)!;
  };
  const finer = new Uint32Array(4 * triangles.length);
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = triangles.subarray(t, t + 3), ab = middleOf(a, b), bc = middleOf(b, c), ca = middleOf(c, a);
    finer.set([a, ab, ca, b, bc, ab, c, ca, bc, ab, bc, ca], 4 * t);
  }
  const places = new Float32Array(positions.length + 1.5 * parents.length), turned = new Float32Array(places.length);
  places.set(positions);
  turned.set(normals);
  for (let m = 0; m < parents.length / 2; ++m) {
    const a = 3 * parents[2 * m], b = 3 * parents[2 * m + 1], at = 3 * (count + m);
    let fromA = 0, fromB = 0;
    for (let d = 0; d < 3; ++d) {
      const way = positions[b + d] - positions[a + d];
      fromA += way * normals[a + d];
      fromB -= way * normals[b + d];
    }
    for (let d = 0; d < 3; ++d) {
      places[at + d] = (positions[a + d] + positions[b + d]) / 2 - (fromA * normals[a + d] + fromB * normals[b + d]) / 8;
      turned[at + d] = normals[a + d] + normals[b + d];
    }
  }
  normalise(turned, 3 * count);
  return { positions: places, normals: turned, triangles: finer, parents: Uint32Array.from(parents) };
}
