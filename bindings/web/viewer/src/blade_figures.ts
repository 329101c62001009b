// Blades as they are drawn: a thin rod along each edge, and a handle that leans away from the line of sight, along which one may hold it.
import { CylinderGeometry, Group, Mesh as Object3, MeshStandardMaterial, type PerspectiveCamera, Quaternion, Vector3 } from "three";
import type { Vector } from "./messages";

const EDGE = 0.0005, HANDLE = 0.0013, LENGTH = 0.045; // m
const UP = new Vector3(0, 1, 0);

export class BladeFigures {
  readonly group = new Group();
  private steel = new MeshStandardMaterial({ color: "#c9d0d4", roughness: 0.35, metalness: 0.4 });
  private grip = new MeshStandardMaterial({ color: "#2f3a44", roughness: 0.6 });
  private rod = new CylinderGeometry(1, 1, 1, 10);

  get count(): number {
    return this.group.children.length;
  }

  // edges: from heel to tip.
  move(edges: Vector[][], camera: PerspectiveCamera) {
    const there = edges.filter((edge) => edge.length > 1).map((edge) => edge.map((point) => new Vector3(...point)));
    const rods = there.reduce((sum, edge) => sum + edge.length, 0);
    while (this.count > rods) this.group.remove(this.group.children[this.count - 1]);
    while (this.count < rods) this.group.add(new Object3(this.rod, this.steel));
    let next = 0;
    for (const edge of there) {
      edge.slice(1).forEach((to, p) => this.lay(next++, edge[p], to, EDGE, this.steel));
      this.lay(next++, edge[0], handleOf(edge, camera), HANDLE, this.grip);
    }
  }

  private lay(index: number, from: Vector3, to: Vector3, radius: number, material: MeshStandardMaterial) {
    const rod = this.group.children[index] as Object3, along = to.clone().sub(from), length = along.length();
    rod.material = material;
    rod.position.copy(from).add(to).multiplyScalar(0.5);
    rod.quaternion.copy(length > 0 ? new Quaternion().setFromUnitVectors(UP, along.divideScalar(length)) : new Quaternion());
    rod.scale.set(radius, Math.max(length, 1e-6), radius);
  }
}

// The end of the handle: on from the heel, to the right and up in the picture.
function handleOf([heel, next]: Vector3[], camera: PerspectiveCamera): Vector3 {
  const right = new Vector3(), up = new Vector3(), back = heel.clone().sub(next).normalize();
  camera.matrixWorld.extractBasis(right, up, new Vector3());
  return back.multiplyScalar(0.8).addScaledVector(right, 0.6).addScaledVector(up, 0.6).normalize().multiplyScalar(LENGTH).add(heel);
}
