// Reads a finer surface from a PLY file. The runtime moves it and the view draws it.
import { PLYLoader } from "three/addons/loaders/PLYLoader.js";
import type { RenderMesh } from "../../module/palpate.js";

export interface FineMesh extends Required<RenderMesh> {
  triangles: Uint32Array;
}

const UNITS = [1, 1e-2, 1e-3]; // m

// radius: of the organ, m; the file's unit follows from it. Throws an Error that says what is wrong with the file.
export function readFineMesh(bytes: ArrayBuffer, radius: number): FineMesh {
  const geometry = new PLYLoader().parse(bytes), index = geometry.getIndex();
  const position = geometry.getAttribute("position");
  if (!index?.count || !position?.count) throw new Error("it has no triangles");
  const triangles = Uint32Array.from(index.array);
  if (triangles.some((vertex) => vertex >= position.count)) throw new Error("a triangle names a vertex that the file does not have");
  geometry.computeVertexNormals();
  geometry.computeBoundingSphere();
  const off = (unit: number) => Math.abs(Math.log((unit * geometry.boundingSphere!.radius) / radius));
  const unit = UNITS.reduce((best, one) => (off(one) < off(best) ? one : best));
  return { positions: Float32Array.from(position.array, (x) => unit * x), normals: Float32Array.from(geometry.getAttribute("normal").array), triangles };
}
