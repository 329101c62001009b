// A scene of the runtime that measures the time of its touches and shapes. The worker's loop steps it.
import type { Bundle, RenderMesh, Scene, Tool } from "../../module/palpate.js";
import { TOOL_COUNT, TOUCH_HZ, type PageEffects, type ToolShape, type Vector } from "./messages";
import type { RecordedTool } from "./recorder";

const POINTS = 1;
const NODES_UNDER_DISC = 100; // as in palpate-run: enough for a disc on a fine mesh

export class TouchScene {
  readonly scene: Scene;
  touchMs = 0; // ms of all touches; the caller resets it

  // mesh: the finer mesh that effects.fine binds.
  constructor(bundle: Bundle, { fine, ...effects }: PageEffects, private tool: ToolShape, mesh: RenderMesh | null) {
    this.scene = bundle.createScene({
      ...effects, renderMesh: fine && mesh ? mesh : undefined, maxTools: TOOL_COUNT, maxPoints: TOOL_COUNT * POINTS,
      maxContactNodes: (effects.contact === "patch" ? NODES_UNDER_DISC : 3) * TOOL_COUNT * POINTS,
    });
    this.scene.setTools([]);
    this.scene.touch(1 / TOUCH_HZ);
    this.shape();
  }

  // The surface's nodes, and the finer mesh where one is bound.
  shape(): number {
    return this.scene.shape() | (this.scene.vertexCount ? this.scene.skin() : 0);
  }

  touch(tools: RecordedTool[]): number {
    this.scene.setTools(tools.map((tool): Tool =>
      tool ? { points: tool.point, hold: tool.hold, discRadius: this.tool.discRadius, friction: this.tool.friction } : {}));
    const start = performance.now();
    const flags = this.scene.touch(1 / TOUCH_HZ);
    this.touchMs += performance.now() - start;
    return flags;
  }

  force(tool: number): Vector {
    return [...this.scene.force(tool)] as unknown as Vector;
  }

  destroy() {
    this.scene.destroy();
  }
}
