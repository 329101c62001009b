// An organ in a canvas, with an engine of its own: a bundle, its finer surface, effects, and tools that the pointer moves. What is
// around the canvas belongs to its owner (Compare, <palpate-viewer>).
import type { BundleInfo } from "../../module/palpate.js";
import { DEFAULT_EFFECTS, DEFAULT_TOOL, isAvailable } from "./effects";
import { EngineStart, type WayToStart } from "./engine_start";
import { readFineMesh, type FineMesh } from "./fine_mesh";
import type { Quality } from "./quality";
import { frameArrays, frameBytes, type Frame, type FromWorker, type Mesh, type PageEffects, type ToolShape, type ToWorker } from "./messages";
import { OrganView, type Shape } from "./organ_view";
import { ToolPointer, type PointerOptions } from "./tool_pointer";

export interface LiveEvents {
  opening: () => void; // another bundle: what was shown of the one before no longer fits
  opened: (bundle: Extract<FromWorker, { type: "opened" }>) => void; // and its finer surface is bound
  accepted: () => void; // other effects or another tool
  refused: (why: Extract<FromWorker, { type: "refused" }>) => void; // refused effects are already taken back
  progress: (done: number, total: number) => void; // bytes
  framed: (frame: Frame) => void;
}

export class LiveOrgan {
  readonly view: OrganView;
  readonly pointer: ToolPointer;
  mesh: Mesh | null = null;
  info: BundleInfo | null = null;
  bytes = 0;
  effects: PageEffects = DEFAULT_EFFECTS;
  tool: ToolShape = DEFAULT_TOOL;
  frame: Frame | null = null; // the newest
  shape: Shape | null = null; // of the newest frame
  private engine: EngineStart;
  private fine: FineMesh | null = null;
  private accepted: { effects: PageEffects; tool: ToolShape } = { effects: DEFAULT_EFFECTS, tool: DEFAULT_TOOL };
  private buffer: ArrayBuffer | null = null;
  private waiting = false; // for a frame
  private answers = new Map<string, (message: FromWorker) => void>();

  // surface: the bytes of a PLY file for each bundle that is opened; null: there is none. A file of another organ is left out.
  // start: the effects of a bundle that is opened, with the finer surface or without. otherWays: to start the engine where its file cannot be
  // a worker of the page. Throws where there is no WebGL.
  constructor(canvas: HTMLCanvasElement, pointer: Omit<PointerOptions, "followsDeformed">, private surface: () => Promise<ArrayBuffer | null>,
              private start: (own: PageEffects) => PageEffects, private events: LiveEvents, otherWays: WayToStart[] = []) {
    this.view = new OrganView(canvas);
    this.view.outlinesRest = true;
    this.pointer = new ToolPointer(canvas, this.view, { ...pointer, followsDeformed: () => this.effects.collision === "deformed" });
    const own: WayToStart = () => new Worker(new URL("./engine.worker.ts", import.meta.url), { type: "module" });
    this.engine = new EngineStart([own, ...otherWays], (message) => this.heard(message), (message) => events.refused({ type: "refused", name: "", what: "runtime", message, byteOffset: 0 }));
  }

  // Ends the engine; nothing else may be called afterwards.
  close() {
    this.engine.close();
    this.view.close();
  }

  tell(message: ToWorker, transfer: Transferable[] = []) {
    this.engine.tell(message, transfer);
  }

  // Of the sentences that the engine says.
  speak(language: string) {
    this.tell({ type: "language", name: language });
  }

  // For the messages with an answer of their own.
  ask(message: ToWorker, type: FromWorker["type"]): Promise<FromWorker> {
    return new Promise((done) => {
      this.answers.set(type, done);
      this.tell(message);
    });
  }

  isAvailable(effect: string): boolean {
    return effect !== "cut" && isAvailable(effect, this.info!, this.fine !== null); // there is no scalpel
  }

  change(effects: PageEffects, tool = this.tool) {
    this.effects = effects;
    this.tool = tool;
    const { fine } = this;
    if (this.mesh) this.tell({ type: "effects", effects, tool, mesh: fine ? { positions: fine.positions, normals: fine.normals, parents: fine.parents } : null });
  }

  // Once per drawn frame.
  askFrame() {
    this.pointer.tick((this.frame?.tools ?? []).map((tool) => tool && tool.point));
    if (this.waiting || !this.mesh) return;
    this.waiting = true;
    this.tell({ type: "frame", buffer: this.buffer }, this.buffer ? [this.buffer] : []);
    this.buffer = null;
  }

  shapeOf(buffer: ArrayBuffer, inside: number, vertices: number): Shape {
    const { fine, ...shape } = frameArrays(buffer, this.info!.surfaceNodeCount, inside, vertices);
    return { ...shape, fine: vertices ? fine : null };
  }

  private heard(message: FromWorker) {
    this.answers.get(message.type)?.(message);
    if (message.type === "frame") return this.take(message);
    if (message.type === "progress") return this.events.progress(message.done, message.total);
    if (message.type === "opened") return void this.open(message);
    if (message.type === "accepted") return this.accept(message);
    if (message.type === "refused") this.refuse(message);
  }

  private async open(opened: Extract<FromWorker, { type: "opened" }>) {
    const { mesh, info, provenance, bytes } = opened;
    Object.assign(this, { mesh, info, bytes, effects: DEFAULT_EFFECTS, fine: null, shape: null, frame: null, buffer: null, waiting: false });
    this.events.opening();
    this.pointer.forget();
    this.view.open(mesh, String(provenance.frame));
    this.fine = fineMesh(await this.surface(), mesh, this.view.quality);
    this.view.openFine(this.fine);
    this.change(this.start({ ...DEFAULT_EFFECTS, fine: this.fine !== null }));
    this.events.opened(opened);
  }

  private accept({ effects, tool }: { effects: PageEffects; tool: ToolShape }) {
    this.accepted = { effects, tool };
    this.events.accepted();
  }

  private refuse(why: Extract<FromWorker, { type: "refused" }>) {
    if (why.what === "effects") Object.assign(this, this.accepted);
    this.events.refused(why);
  }

  private take(frame: Frame) {
    this.waiting = false;
    const { inside, vertices, buffer } = frame, nodes = this.info!.surfaceNodeCount;
    if (buffer.byteLength !== frameBytes(nodes, inside, vertices) || (vertices && 3 * vertices !== this.fine?.positions.length)) return; // of another bundle
    if (frame.changed || !this.shape) this.shape = this.shapeOf(buffer.slice(0), inside, vertices);
    this.buffer = buffer;
    this.frame = frame;
    this.events.framed(frame);
  }
}

// null where the file is not of this organ.
function fineMesh(bytes: ArrayBuffer | null, mesh: Mesh, quality: Quality): FineMesh | null {
  try {
    return bytes && readFineMesh(bytes, mesh, quality);
  } catch {
    return null;
  }
}
