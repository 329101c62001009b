// The surfaces of several organs as one mesh to draw and to pick on: the nodes of one organ after those of the other.
import { organTissue } from "./colours";
import { boxOf } from "./geometry";
import type { Mesh } from "./messages";
import type { Hit } from "./organ_view";
import type { OpenedOrgan } from "./world_messages";

export class JoinedOrgans {
  readonly mesh: Mesh;
  readonly colours: Float32Array; // [node][3] linear light, of each organ its own
  private first: number[] = []; // node of each organ
  private radii: number[];

  constructor(organs: OpenedOrgan[]) {
    let nodes = 0;
    for (const { mesh } of organs) (this.first.push(nodes), (nodes += mesh.positions.length / 3));
    const joined = <Numbers extends Float32Array | Uint32Array | Int32Array>(make: (count: number) => Numbers, of: (mesh: Mesh) => Numbers, byNode: boolean): Numbers => {
      const parts = organs.map(({ mesh }) => of(mesh)), all = make(parts.reduce((sum, part) => sum + part.length, 0));
      let at = 0;
      parts.forEach((part, k) => {
        all.set(byNode ? part.map((node) => node + this.first[k]) : part, at);
        at += part.length;
      });
      return all;
    };
    const integers = (count: number) => new Int32Array(count);
    this.mesh = {
      positions: joined((count) => new Float32Array(count), (mesh) => mesh.positions as Float32Array, false),
      triangles: joined((count) => new Uint32Array(count), (mesh) => mesh.triangles as Uint32Array, true),
      fixed: joined(integers, (mesh) => mesh.fixed as Int32Array, true), touchable: joined(integers, (mesh) => mesh.touchable as Int32Array, true),
      soft: integers(0), stiffness: new Float64Array(0), tetrahedra: new Uint32Array(0), region: integers(0),
    };
    this.colours = new Float32Array(3 * nodes);
    organs.forEach(({ mesh }, k) => {
      const tissue = organTissue(k);
      for (let i = 0; i < mesh.positions.length; ++i) this.colours[3 * this.first[k] + i] = tissue[i % 3];
    });
    this.radii = organs.map(({ mesh }) => boxOf(mesh.positions).diagonal / 2);
  }

  organAt({ nodes }: Hit): number {
    return this.organOf(nodes[0]);
  }

  // The triangles of those organs alone.
  trianglesOf(isShown: (organ: number) => boolean): Uint32Array {
    const shown = this.first.map((_, organ) => isShown(organ)), { triangles } = this.mesh;
    return triangles.filter((_, i) => shown[this.organOf(triangles[i - (i % 3)])]);
  }

  private organOf(node: number): number {
    return this.first.filter((first) => first <= node).length - 1;
  }

  radiusAt(hit: Hit): number {
    return this.radii[this.organAt(hit)];
  }
}
