// A finer surface from a PLY file, for the runtime to move and the view to draw.
import { PLYLoader } from "three/addons/loaders/PLYLoader.js";
import type { RenderMesh } from "../../module/palpate.js";

export interface FineMesh extends Required<RenderMesh> {
  triangles: Uint32Array;
}

const UNITS = [1, 1e-2, 1e-3]; // m

// radius: of the organ, m, which tells the file's unit. Throws what is wrong with the file.
export function readFineMesh(bytes: ArrayBuffer, radius: number): FineMesh {
  const geometry = new PLYLoader().parse(bytes), index = geometry.getIndex();
  const position = geometry.getAttribute("position");
  if (!index?.count || !position?.count) throw new Error("it has no triangles");
  const triangles = Uint32Array.from(index.array);
  if (triangles.some((vertex) => vertex >= position.count)) throw new Error("a triangle has a vertex that is not there");
  geometry.computeVertexNormals();
  geometry.computeBoundingSphere();
  const off = (unit: number) => Math.abs(Math.log((unit * geometry.boundingSphere!.radius) / radius));
  const unit = UNITS.reduce((best, one) => (off(one) < off(best) ? one : best));
  return { positions: Float32Array.from(position.array, (x) => unit * x), normals: Float32Array.from(geometry.getAttribute("normal").array), triangles };
}
