// The obstacles of a scene as they are drawn: their surfaces, seen from both sides, through which the organ shows.
import { BufferAttribute, BufferGeometry, DoubleSide, EdgesGeometry, Group, LineBasicMaterial, LineSegments, Mesh, MeshStandardMaterial } from "three";
import type { Pose } from "../../module/palpate.js";
import type { ObstacleMesh } from "./obstacle_mesh";

const COLOUR = "#d8c9a4", OPACITY = 0.5, RIM = "#6d6250";
const SHARP = 25; // degrees, from which an edge is drawn

export class ObstacleFigures {
  readonly group = new Group();
  private material = new MeshStandardMaterial({ color: COLOUR, opacity: OPACITY, transparent: true, side: DoubleSide, roughness: 0.6, depthWrite: false });
  private rim = new LineBasicMaterial({ color: RIM });
  private shown: ObstacleMesh[] = [];

  get count(): number {
    return this.group.children.length;
  }

  // Of each surface where it is; poses: none, nothing is drawn.
  move(surfaces: ObstacleMesh[], poses: Pose[]) {
    const meshes = surfaces.slice(0, poses.length);
    if (meshes.length !== this.shown.length || meshes.some((mesh, i) => mesh !== this.shown[i])) this.show(meshes);
    this.group.children.forEach((figure, i) => {
      const { position = [0, 0, 0], orientation = [1, 0, 0, 0] } = poses[i];
      figure.position.fromArray(Array.from(position));
      figure.quaternion.set(orientation[1], orientation[2], orientation[3], orientation[0]);
    });
  }

  private show(meshes: ObstacleMesh[]) {
    for (const figure of this.group.children) for (const part of figure.children as (Mesh | LineSegments)[]) part.geometry.dispose();
    this.group.clear();
    this.shown = meshes;
    for (const { positions, triangles } of meshes) {
      const geometry = new BufferGeometry(), figure = new Group();
      geometry.setAttribute("position", new BufferAttribute(positions, 3));
      geometry.setIndex(new BufferAttribute(triangles, 1));
      geometry.computeVertexNormals();
      figure.add(new Mesh(geometry, this.material), new LineSegments(new EdgesGeometry(geometry, SHARP), this.rim));
      this.group.add(figure);
    }
  }
}
