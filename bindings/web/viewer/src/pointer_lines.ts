// A line from each tool that one holds to the pointer that holds it.
import { BufferAttribute, BufferGeometry, Color, Group, Line, LineDashedMaterial, type Vector3 } from "three";
import { TOOL_COUNT } from "./messages";

const DASH = 0.003; // m

export class PointerLines {
  readonly group = new Group();
  private material = new LineDashedMaterial({ dashSize: DASH, gapSize: 0.6 * DASH, depthTest: false, transparent: true, opacity: 0.7 });
  private lines = Array.from({ length: TOOL_COUNT }, () => {
    const line = new Line(new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(6), 3)), this.material);
    line.frustumCulled = line.visible = false;
    line.renderOrder = 4;
    return line;
  });

  constructor() {
    this.group.add(...this.lines);
  }

  dress(ink: string) {
    this.material.color = new Color(ink);
  }

  // ends: m; null: no pointer holds the tool.
  move(ends: ({ from: Vector3; to: Vector3 } | null)[]) {
    this.lines.forEach((line, t) => {
      const end = ends[t];
      line.visible = !!end;
      if (!end) return;
      const place = line.geometry.getAttribute("position") as BufferAttribute;
      place.setXYZ(0, ...end.from.toArray());
      place.setXYZ(1, ...end.to.toArray());
      place.needsUpdate = true;
      line.computeLineDistances();
    });
  }
}
