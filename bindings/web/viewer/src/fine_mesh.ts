// Reads a finer surface from a PLY file. The runtime moves it and the view draws it.
import { BufferAttribute, BufferGeometry } from "three";
import { PLYLoader } from "three/addons/loaders/PLYLoader.js";
import { boxOf, distance, nearestIndex } from "./geometry";
import type { Quality } from "./quality";
import { smoothMesh, type DrawnMesh } from "./smooth_mesh";
import { surfaceOf } from "./surface_colours";
import { brief, word } from "./words";

export type FineMesh = DrawnMesh;

const UNITS: [metres: number, name: string][] = [[1, "m"], [1e-2, "cm"], [1e-3, "mm"]];
const CHECKED = 2000; // vertices whose distance from the organ is computed
const FARTHEST = 2; // mean edges of the organ's mesh between a vertex and the nearest node

// organ: its surface at rest, m; the file's unit is the one in which both have the same size. Throws an Error that says what is wrong
// with the file. In high quality each of its triangles becomes four. Cost: CHECKED times the organ's nodes.
export function readFineMesh(bytes: ArrayBuffer, organ: { positions: Float32Array; triangles: Uint32Array }, quality: Quality): FineMesh {
  const geometry = parsed(bytes), position = geometry.getAttribute("position") as BufferAttribute, triangles = Uint32Array.from(geometry.getIndex()!.array);
  const beyond = triangles.findIndex((vertex) => vertex >= position.count);
  if (beyond >= 0) throw new Error(word("fine.triangle", { triangle: Math.floor(beyond / 3), vertex: triangles[beyond], last: position.count - 1 }));
  geometry.computeVertexNormals();
  const size = boxOf(position.array).diagonal, wanted = boxOf(organ.positions).diagonal;
  const off = ([unit]: [number, string]) => Math.abs(Math.log((unit * size) / wanted));
  const [unit, name] = UNITS.reduce((best, one) => (off(one) < off(best) ? one : best));
  const positions = Float32Array.from(position.array, (x) => unit * x);
  checkPlace(positions, position, name, organ);
  const mesh = { positions, normals: Float32Array.from(geometry.getAttribute("normal").array), triangles };
  return quality === "high" ? smoothMesh(mesh) : { ...mesh, parents: new Uint32Array(0) };
}

function parsed(bytes: ArrayBuffer): BufferGeometry {
  const head = new TextDecoder("latin1").decode(bytes.slice(0, 4096));
  const count = (element: string) => Number(new RegExp(`^element ${element} (\\d+)`, "m").exec(head)?.[1] ?? 0);
  const vertices = count("vertex"), faces = count("face");
  if (!/^ply\s/.test(head) || !head.includes("end_header")) throw new Error(word("fine.no-ply"));
  if (!vertices || !faces) throw new Error(word("fine.no-triangles"));
  const cut = () => new Error(word("fine.cut", { vertices, faces }));
  let geometry: BufferGeometry;
  try {
    geometry = new PLYLoader().parse(bytes);
  } catch {
    throw cut(); // the loader read beyond the end
  }
  const position = geometry.getAttribute("position"), index = geometry.getIndex();
  if (position?.count !== vertices || (index?.count ?? 0) < 3 * faces) throw cut();
  const bad = position.array.findIndex((x) => !Number.isFinite(x));
  if (bad >= 0) throw new Error(word("fine.no-number", { vertex: Math.floor(bad / 3) }));
  return geometry;
}

// The surface of another organ, or one in another frame, lies elsewhere.
function checkPlace(positions: Float32Array, file: BufferAttribute, unit: string, { positions: nodes, triangles }: { positions: Float32Array; triangles: Uint32Array }) {
  const count = positions.length / 3, allowed = FARTHEST * surfaceOf(nodes, triangles).spacing;
  let worst = 0, farthest = 0;
  for (let v = 0; v < count; v += Math.ceil(count / CHECKED)) {
    const vertex = positions.subarray(3 * v, 3 * v + 3), away = distance(vertex, nodes.subarray(3 * nearestIndex(vertex, nodes)));
    if (away > farthest) [worst, farthest] = [v, away];
  }
  if (farthest <= allowed) return;
  const at = [file.getX(worst), file.getY(worst), file.getZ(worst)].map((x) => Number(x.toPrecision(5))).join(", ");
  throw new Error(word("fine.away", { vertex: worst, at, unit, distance: brief(1000 * farthest, 3), allowed: brief(1000 * allowed, 3) }));
}
