// The lips of a cut as they are drawn: darker and redder than the surface, with a line where they meet it, by which one sees a cut that is closed.
import { BufferAttribute, BufferGeometry, Group, LineBasicMaterial, LineSegments, Mesh as Object3, MeshBasicMaterial, MeshStandardMaterial, Sphere, Vector3 } from "three";
import type { DrawnSurface, Mesh } from "./messages";

const COLOUR = "#7a1420", LINE = "#4a060d";

export class CutLips {
  readonly group = new Group();
  readonly wire: Object3<BufferGeometry, MeshBasicMaterial>;
  private lips: Object3<BufferGeometry, MeshStandardMaterial>;
  private line = new LineSegments(new BufferGeometry(), new LineBasicMaterial({ color: LINE }));

  constructor() {
    const geometry = new BufferGeometry();
    this.lips = new Object3(geometry, new MeshStandardMaterial({ color: COLOUR, roughness: 0.45, flatShading: true, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 }));
    this.wire = new Object3(geometry, new MeshBasicMaterial({ wireframe: true, transparent: true, opacity: 0.35, depthWrite: false }));
    this.group.add(this.lips, this.wire, this.line);
    for (const part of [this.lips, this.wire, this.line]) part.frustumCulled = false;
    this.group.visible = this.wire.visible = false;
  }

  // Triangles that are drawn.
  get count(): number {
    return this.group.visible ? this.lips.geometry.index!.count / 3 : 0;
  }

  // What a ray may meet.
  get picked() {
    return this.group.visible ? [this.lips] : [];
  }

  // surface: whose places the lips share.
  show(surface: BufferGeometry, { triangles, isLip }: DrawnSurface) {
    const lips = trianglesOf(triangles, isLip, 1), { geometry } = this.lips;
    geometry.setAttribute("position", surface.getAttribute("position"));
    geometry.setIndex(new BufferAttribute(lips, 1));
    geometry.boundingSphere = new Sphere(new Vector3(), Infinity);
    this.line.geometry.setAttribute("position", surface.getAttribute("position"));
    this.line.geometry.setIndex(new BufferAttribute(rimOf(lips, trianglesOf(triangles, isLip, 0)), 1));
    this.group.visible = true;
  }

  hide() {
    this.group.visible = false;
  }
}

// The surface of a mesh that is cut, without the lips, and where its nodes lie at rest.
export function cutOrgan({ positions }: Mesh, { triangles, isLip, made }: DrawnSurface): { triangles: Uint32Array; rest: Float32Array } {
  const rest = positions.slice();
  for (let i = 0; i < made.length; i += 2) rest.copyWithin(3 * made[i], 3 * made[i + 1], 3 * made[i + 1] + 3);
  return { triangles: trianglesOf(triangles, isLip, 0), rest };
}

// The corners of some triangles, one after the other.
export const cornersOf = (chosen: ArrayLike<number>, triangles: Uint32Array): Uint32Array =>
  Uint32Array.from(Array.from(chosen).flatMap((t) => [...triangles.subarray(3 * t, 3 * t + 3)]));

export function normalsOf(positions: Float32Array, triangles: Uint32Array): Float32Array {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(positions, 3));
  geometry.setIndex(new BufferAttribute(triangles, 1));
  geometry.computeVertexNormals();
  return geometry.getAttribute("normal").array as Float32Array;
}

const trianglesOf = (triangles: Uint32Array, isLip: Uint8Array, lip: 0 | 1) => triangles.filter((_, corner) => isLip[Math.floor(corner / 3)] === lip);

// The edges that both have, each once.
function rimOf(lips: Uint32Array, others: Uint32Array): Uint32Array {
  const far = 2 ** 26, key = (a: number, b: number) => Math.min(a, b) * far + Math.max(a, b), found: number[] = [], ofLips = new Set<number>();
  const each = (triangles: Uint32Array, act: (a: number, b: number) => void) => {
    for (let t = 0; t < triangles.length; t += 3) for (let c = 0; c < 3; ++c) act(triangles[t + c], triangles[t + ((c + 1) % 3)]);
  };
  each(lips, (a, b) => ofLips.add(key(a, b)));
  each(others, (a, b) => ofLips.has(key(a, b)) && found.push(a, b));
  return Uint32Array.from(found);
}
