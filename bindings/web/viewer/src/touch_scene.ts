// A scene of the runtime that measures the time of its touches and shapes. The worker's loop steps it.
import type { Blade, Bundle, RenderMesh, Scene, Tool } from "../../module/palpate.js";
import { TOOL_COUNT, TOUCH_HZ, type PageEffects, type ToolShape, type Vector } from "./messages";
import type { RecordedTool } from "./recorder";
import { nodesOfCut } from "./scene_blades";
import { PAGE_RATES } from "./scene_reader";

const NODES_UNDER_DISC = 100; // as in palpate-run: enough for a disc on a fine mesh

// The runtime's tools: each of the page's pushes or pulls, which for the runtime are two tools, since a tool of a scene file either
// holds or does not.
export const SCENE_TOOLS = 2 * TOOL_COUNT;
const sceneTool = (tool: number, hold: boolean) => 2 * tool + (hold ? 1 : 0);

export class PageTools {
  private pulls: boolean[] = Array(TOOL_COUNT).fill(false); // in the last touch

  constructor(private discRadius: number, private friction: number) {}

  // For the next touch.
  all(tools: RecordedTool[]): Tool[] {
    const all: Tool[] = Array.from({ length: SCENE_TOOLS }, () => ({}));
    tools.forEach((tool, t) => {
      if (!tool) return;
      this.pulls[t] = tool.hold;
      all[sceneTool(t, tool.hold)] = { points: tool.point, hold: tool.hold, discRadius: this.discRadius, friction: this.friction };
    });
    return all;
  }

  // The runtime's tool that a tool of the page was in the last touch.
  index(tool: number): number {
    return sceneTool(tool, this.pulls[tool]);
  }
}

export const nodesFor = (effects: PageEffects, points: number) => (effects.contact === "patch" ? NODES_UNDER_DISC : 3) * points;

// Under large-beside, large-renewed and large-auto: solves the body after the touches after which palpate-run does, at the page's rates the first touch and
// each tenth one after it.
export class BodySolves {
  private touches = 0; // since the scene was new
  private solves = 0;
  private isBeside: boolean;

  constructor({ deformation }: PageEffects, private rates = PAGE_RATES) {
    this.isBeside = deformation !== undefined && ["large-beside", "large-renewed", "large-auto"].includes(deformation);
  }

  reset() {
    this.touches = this.solves = 0;
  }

  afterTouch(scene: Scene) {
    if (!this.isBeside || this.touches++ < Math.ceil((this.solves * this.rates.touch) / this.rates.deform - 1e-9)) return;
    ++this.solves;
    scene.deform();
  }
}

const toolsFor = (effects: PageEffects, tool: ToolShape) => new PageTools(effects.contact === "patch" ? tool.discRadius : 0, effects.law === "coulomb" ? tool.friction : 0);

// The surface's nodes, the finer mesh where one is bound, and whether the surface crosses itself. Returns flags.
export const shapeOf = (scene: Scene) => scene.shape() | (scene.vertexCount ? scene.skin() : 0) | (scene.hasCrossings ? scene.crossings() : 0);

export class TouchScene {
  readonly scene: Scene;
  touchMs = 0; // ms of all touches; the caller resets it
  private tools: PageTools;
  private solves: BodySolves;

  // mesh: the finer mesh that effects.fine binds.
  constructor(bundle: Bundle, { fine, dent, inside, ...effects }: PageEffects, tool: ToolShape, mesh: RenderMesh | null) {
    this.tools = toolsFor(effects, tool);
    // A dent is that of a disc, in a finer mesh.
    const dents = dent === "discs" && fine && mesh && effects.contact === "patch";
    this.scene = bundle.createScene({
      ...effects, crossings: effects.shape !== "off" && !effects.cut, inside: inside && effects.shape === "volume", renderMesh: fine && mesh ? mesh : undefined, ...(dents ? { dent, report: "contacts" as const } : {}), maxTools: SCENE_TOOLS, maxPoints: SCENE_TOOLS,
      maxContactNodes: nodesFor(effects, SCENE_TOOLS) + (effects.cut ? nodesOfCut() : 0),
    });
    this.solves = new BodySolves(effects);
    this.scene.setTools([]);
    this.scene.touch(1 / TOUCH_HZ);
    this.shape();
  }

  // A scene that remembers nothing.
  reset() {
    this.scene.reset();
    this.solves.reset();
  }

  shape(): number {
    return shapeOf(this.scene);
  }

  // Other tools, in the scene as it is.
  useTool(effects: PageEffects, tool: ToolShape) {
    this.tools = toolsFor(effects, tool);
  }

  // Whether a part of a cut is still to come.
  get waits(): boolean {
    return (this.scene.cutState?.left ?? 0) > 0;
  }

  // blade: null: there is none.
  touch(tools: RecordedTool[], blade: Blade | null = null): number {
    this.scene.setTools(this.tools.all(tools));
    if (this.scene.canCut) this.scene.setBlade(0, blade);
    const start = performance.now();
    const flags = this.scene.touch(1 / TOUCH_HZ);
    this.touchMs += performance.now() - start;
    this.solves.afterTouch(this.scene);
    return flags;
  }

  force(tool: number): Vector {
    return [...this.scene.force(this.tools.index(tool))] as unknown as Vector;
  }

  contacts(tool: number): number {
    return this.scene.contactCount(this.tools.index(tool));
  }

  // Of the plane that the tool's disc is drawn in, after shape(); null where no dent is drawn.
  discNormal(tool: number): Vector | null {
    if (!this.scene.hasDents) return null;
    const index = this.tools.index(tool), { contacts } = this.scene.report, normals = this.scene.discNormals;
    const contact = contacts.findIndex((one) => one.tool === index), normal = [...normals.subarray(3 * contact, 3 * contact + 3)];
    return contact >= 0 && normal.length === 3 && normal.some(Boolean) ? (normal as Vector) : null;
  }

  destroy() {
    this.scene.destroy();
  }
}
