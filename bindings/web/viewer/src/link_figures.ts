// The links of a scene as they are drawn: threads and springs as rods between their ends, thin where they are slack, clips as beads.
import { Color, CylinderGeometry, Group, InstancedMesh, Matrix4, MeshBasicMaterial, Quaternion, SphereGeometry, Vector3 } from "three";
import { MOST_LINKS_DRAWN, type DrawnLink } from "./messages";

const RADII = { thread: 0.0006, spring: 0.0012, clip: 0.0012 }, BEAD = 0.0014; // m
const SLACK = 0.6; // share of the radius
const COLOURS = { thread: new Color("#1d3f8f"), spring: new Color("#e8e2cf"), clip: new Color("#aab4ba") };
const UP = new Vector3(0, 1, 0);

export class LinkFigures {
  readonly group = new Group();
  readonly materials = [new MeshBasicMaterial(), new MeshBasicMaterial()];
  private rods = new InstancedMesh(new CylinderGeometry(1, 1, 1, 8), this.materials[0], MOST_LINKS_DRAWN);
  private beads = new InstancedMesh(new SphereGeometry(1, 12, 8), this.materials[1], 2 * MOST_LINKS_DRAWN);

  constructor() {
    this.group.add(this.rods, this.beads);
    for (const mesh of this.group.children as InstancedMesh[]) (mesh.frustumCulled = false), (mesh.count = 0);
  }

  get count(): number {
    return this.rods.count;
  }

  // Broken links are not drawn.
  move(links: DrawnLink[]) {
    const whole = links.filter(({ condition }) => condition !== "broken").slice(0, MOST_LINKS_DRAWN), turn = new Quaternion(), matrix = new Matrix4();
    this.rods.count = whole.length;
    this.beads.count = 2 * whole.length;
    whole.forEach(({ kind, ends, condition }, l) => {
      const [from, to] = ends.map((end) => new Vector3(...end)), along = to.clone().sub(from), length = along.length(), radius = RADII[kind] * (condition === "slack" ? SLACK : 1);
      turn.setFromUnitVectors(UP, length > 0 ? along.divideScalar(length) : UP);
      this.rods.setMatrixAt(l, matrix.compose(from.clone().add(to).multiplyScalar(0.5), turn, new Vector3(radius, Math.max(length, 1e-6), radius)));
      this.rods.setColorAt(l, COLOURS[kind]);
      [from, to].forEach((end, e) => {
        this.beads.setMatrixAt(2 * l + e, matrix.compose(end, turn, new Vector3().setScalar(BEAD)));
        this.beads.setColorAt(2 * l + e, COLOURS[kind]);
      });
    });
    for (const mesh of [this.rods, this.beads]) {
      mesh.instanceMatrix.needsUpdate = true;
      if (mesh.instanceColor) mesh.instanceColor.needsUpdate = true;
    }
  }
}
