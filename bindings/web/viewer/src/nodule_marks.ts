// Draws the map of past presses, paler where the tissue is stiffer, and what the task of the nodule reveals: the nodules as balls that show
// through the surface, the place that was named, and the point above the nodule, joined by a line.
import { BufferGeometry, type ColorRepresentation, Group, Line, LineBasicMaterial, Mesh, MeshBasicMaterial, SphereGeometry, Vector3 } from "three";
import { organColourOf } from "./colours";
import type { Answer, TaskPress } from "./nodule_task";
import type { Nodule } from "./nodules";

const PIN = 0.0022; // m, radius

export class NoduleMarks {
  readonly group = new Group();
  private nodule = new MeshBasicMaterial({ transparent: true, opacity: 0.55, depthTest: false });
  private right = new MeshBasicMaterial({ depthTest: false, transparent: true });
  private named = new MeshBasicMaterial({ depthTest: false, transparent: true });
  private line = new LineBasicMaterial({ depthTest: false, transparent: true });
  private ball = new SphereGeometry(1, 32, 20);

  show(nodules: Nodule[], answer: Answer | null, presses: TaskPress[]) {
    for (const child of this.group.children) if (child instanceof Line) child.geometry.dispose();
    this.group.clear();
    const found = presses.flatMap(({ found: one }) => (one ? [one.here / (one.healthy ?? 1)] : [])), [least, most] = [Math.min(...found), Math.max(...found)];
    for (const { place, found: one } of presses) {
      if (!one) continue;
      const share = most > least ? (one.here / (one.healthy ?? 1) - least) / (most - least) : 0;
      this.add(new Vector3(...place), PIN, new MeshBasicMaterial({ color: organColourOf(share), depthTest: false, transparent: true }));
    }
    for (const { centre, radius } of nodules) this.add(new Vector3(...centre), radius, this.nodule);
    if (!answer) return;
    const named = new Vector3(...answer.place), right = new Vector3(...answer.nodule.above);
    this.add(named, PIN, this.named);
    this.add(right, PIN, this.right);
    const line = new Line(new BufferGeometry().setFromPoints([named, right]), this.line);
    line.renderOrder = 3;
    this.group.add(line);
  }

  dress(nodule: ColorRepresentation, named: ColorRepresentation) {
    this.nodule.color.set(nodule);
    this.right.color.set(nodule);
    this.named.color.set(named);
    this.line.color.set(named);
  }

  private add(at: Vector3, radius: number, material: MeshBasicMaterial) {
    const mesh = new Mesh(this.ball, material);
    mesh.position.copy(at);
    mesh.scale.setScalar(radius);
    mesh.renderOrder = material === this.nodule ? 2 : 4;
    this.group.add(mesh);
  }
}
