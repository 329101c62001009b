// One of the two sides of Compare: an engine of its own, a bundle, effects, and the organ drawn as both sides' camera sees it.
import type { BundleInfo } from "../../module/palpate.js";
import { DEFAULT_EFFECTS, DEFAULT_TOOL, flagWords, isAvailable } from "./effects";
import { EffectsPanel } from "./effects_panel";
import { readFineMesh, type FineMesh } from "./fine_mesh";
import { effectsOfWords } from "./links";
import { frameArrays, frameBytes, type Frame, type FromWorker, type Mesh, type PageEffects, type Path, type ToolFrame, type ToolShape, type ToolTarget, type ToWorker, type Trial } from "./messages";
import { OrganView, type Shape } from "./organ_view";
import { ToolPointer } from "./tool_pointer";
import { forceLabels, TOOL_COLOURS } from "./tool_readout";

export interface SideEvents {
  opened: () => void;
  changed: () => void; // the effects: what was tried before is of others
  send: (index: number, target: ToolTarget) => void;
  withdraw: (index: number) => void;
  leads: () => void; // this side's camera is the one that the user turns
}

export class CompareSide {
  readonly view: OrganView;
  readonly pointer: ToolPointer;
  readonly canvas: HTMLCanvasElement;
  mesh: Mesh | null = null;
  info: BundleInfo | null = null;
  bytes = 0;
  effects: PageEffects = DEFAULT_EFFECTS;
  trial: { of: Trial; shape: Shape } | null = null; // shown when no tool is there
  frame: Frame | null = null; // the newest
  private worker = new Worker(new URL("./engine.worker.ts", import.meta.url), { type: "module" });
  private panel: EffectsPanel;
  private fine: FineMesh | null = null;
  private tool: ToolShape = DEFAULT_TOOL;
  private accepted: { effects: PageEffects; tool: ToolShape } = { effects: DEFAULT_EFFECTS, tool: DEFAULT_TOOL };
  private live: Shape | null = null;
  private buffer: ArrayBuffer | null = null;
  private waiting = false; // for a frame
  private answers = new Map<string, (message: FromWorker) => void>();
  private others: string[] = []; // addresses to try where the server does not have the bundle
  private wanted: string; // the words of the effects that the page's address asks for

  // renderMesh: the bytes of the finer surface; null: there is none.
  constructor(private root: HTMLElement, private letter: "A" | "B", words: string, private renderMesh: Promise<ArrayBuffer | null>, private events: SideEvents) {
    this.wanted = words;
    this.canvas = this.part("canvas");
    this.canvas.setAttribute("aria-label", `Organ ${letter} in three dimensions. Arrow keys turn both organs, plus and minus come nearer.`);
    this.part("h2").textContent = letter;
    this.part("h2").className = letter.toLowerCase();
    this.view = new OrganView(this.canvas);
    this.view.show({ colour: true, mesh: false, fixed: false, touchable: false, soft: false });
    this.pointer = new ToolPointer(this.canvas, this.view, {
      pulls: () => false, keeps: () => false, followsDeformed: () => this.effects.collision === "deformed",
      send: events.send, withdraw: events.withdraw, pressed: () => {},
    });
    this.panel = new EffectsPanel(this.part(".effects"), (effects) => this.change(effects));
    for (const type of ["pointerdown", "wheel", "focus"]) this.canvas.addEventListener(type, () => events.leads(), { capture: true, passive: true });
    const input = this.part<HTMLInputElement>("input[type=file]");
    this.part(".open").addEventListener("click", () => input.click());
    input.addEventListener("change", () => void (input.files?.[0] && this.openFile(input.files[0])));
    this.worker.addEventListener("message", ({ data }: MessageEvent<FromWorker>) => this.heard(data));
    this.worker.addEventListener("error", (event) => this.say(event.message || "The engine could not be started."));
  }

  // Both tools of a side have the side's colour.
  private get colours(): string[] {
    return TOOL_COLOURS.map(() => TOOL_COLOURS[this.letter === "A" ? 0 : 1]);
  }

  part<T extends HTMLElement = HTMLElement>(selector: string): T {
    return this.root.querySelector<T>(selector)!;
  }

  say(text: string) {
    this.part(".said").textContent = text;
  }

  // Opens the first of these that the server has.
  fetch([url, ...others]: string[]) {
    this.others = others;
    this.say("Opening the organ …");
    this.tell({ type: "fetch", url });
  }

  async openFile(file: File) {
    this.say(`Opening ${file.name} …`);
    const bytes = await file.arrayBuffer().catch(() => null);
    if (!bytes) return this.say(`${file.name}: the browser could not read it; was it moved or changed?`);
    this.tell({ type: "open", name: file.name, bytes }, [bytes]);
  }

  setTool(tool: ToolShape) {
    this.tool = tool;
    if (this.mesh) this.change(this.effects);
  }

  place(index: number, target: ToolTarget) {
    this.tell({ type: "tool", index, target });
  }

  withdraw(index: number) {
    this.tell({ type: "withdraw", index });
  }

  // What the tools of the last touch, or of the present one, did.
  async lastPath(): Promise<Path | null> {
    const answer = await this.ask({ type: "path" }, "path");
    return answer.type === "path" ? answer.path : null;
  }

  async try(path: Path) {
    const answer = await this.ask({ type: "try", path }, "tried");
    if (answer.type !== "tried") return;
    const { buffer, inside, vertices } = answer.trial.shape;
    this.trial = { of: answer.trial, shape: this.shapeOf(buffer, inside, vertices) };
  }

  get touched(): boolean {
    return this.pointer.active || !!this.frame?.tools.some(Boolean);
  }

  // The shape and the tools to draw now.
  get shown(): { shape: Shape | null; tools: (ToolFrame | null)[] } {
    if (this.trial && !this.touched) return { shape: this.trial.shape, tools: this.trial.of.tools };
    return { shape: this.live, tools: this.frame?.tools ?? [] };
  }

  askFrame() {
    if (this.waiting || !this.mesh) return;
    this.waiting = true;
    this.tell({ type: "frame", buffer: this.buffer }, this.buffer ? [this.buffer] : []);
    this.buffer = null;
  }

  // most: m, the palest colour of both sides.
  draw(most: number) {
    const { shape, tools } = this.shown;
    if (shape) this.view.move(shape, most);
    this.view.render();
    forceLabels(this.part(".labels"), tools, this.view.moveTools(tools, this.effects.contact === "patch" ? this.tool.discRadius : 0), [this.letter, this.letter], this.colours);
    const tool = tools.find(Boolean);
    this.part(".now").textContent = tool ? `${Math.hypot(...tool.force).toFixed(3)} N at ${(1000 * tool.depth).toFixed(1)} mm` : "";
  }

  dress() {
    const style = getComputedStyle(document.documentElement), colour = (name: string) => style.getPropertyValue(name).trim();
    this.view.dress(colour("--ink"), colour("--held"), colour("--soft-held"), colour("--touchable"), this.colours.map(colour));
  }

  private tell(message: ToWorker, transfer: Transferable[] = []) {
    this.worker.postMessage(message, transfer);
  }

  private ask(message: ToWorker, type: FromWorker["type"]): Promise<FromWorker> {
    return new Promise((done) => {
      this.answers.set(type, done);
      this.tell(message);
    });
  }

  private heard(message: FromWorker) {
    this.answers.get(message.type)?.(message);
    if (message.type === "frame") return this.take(message);
    if (message.type === "progress") return this.say(`${(message.done / 1e6).toFixed(0)} of ${(message.total / 1e6).toFixed(0)} MB`);
    if (message.type === "opened") return void this.open(message);
    if (message.type === "accepted") return this.accept(message);
    if (message.type === "refused") this.refused(message);
  }

  private async open({ mesh, info, provenance, bytes }: Extract<FromWorker, { type: "opened" }>) {
    Object.assign(this, { mesh, info, bytes, effects: DEFAULT_EFFECTS, fine: null, trial: null, live: null, buffer: null, waiting: false });
    this.view.open(mesh, String(provenance.frame));
    const words = [provenance.organ ?? "organ", `${info.nodeCount.toLocaleString("en")} vertices`, provenance.boundary, provenance.element, `${(bytes / 1e6).toFixed(1)} MB`];
    this.part(".facts").textContent = words.filter(Boolean).join(" · ");
    this.say("");
    this.fine = fineMesh(await this.renderMesh, mesh);
    this.view.openFine(this.fine);
    const effects = effectsOfWords(new URLSearchParams(this.wanted), { ...DEFAULT_EFFECTS, fine: this.fine !== null }, (effect) => this.isAvailable(effect));
    this.change(effects);
    this.events.opened();
  }

  private isAvailable(effect: string): boolean {
    return isAvailable(effect, this.info!, this.fine !== null);
  }

  private change(effects: PageEffects) {
    this.effects = effects;
    const { fine } = this;
    this.tell({ type: "effects", effects, tool: this.tool, mesh: fine ? { positions: fine.positions, normals: fine.normals } : null });
    this.panel.open(effects, (effect) => this.isAvailable(effect));
  }

  private accept({ effects, tool }: { effects: PageEffects; tool: ToolShape }) {
    this.accepted = { effects, tool };
    this.trial = null;
    this.events.changed();
  }

  private refused({ what, message }: Extract<FromWorker, { type: "refused" }>) {
    if (what === "absent") return this.others.length ? this.fetch(this.others) : this.say("No organ yet: open a bundle.");
    this.say(message);
    if (what !== "effects") return;
    Object.assign(this, this.accepted);
    this.panel.open(this.effects, (effect) => this.isAvailable(effect));
  }

  private take(frame: Frame) {
    this.waiting = false;
    const { inside, vertices, buffer } = frame, nodes = this.info!.surfaceNodeCount;
    if (buffer.byteLength !== frameBytes(nodes, inside, vertices) || (vertices && 3 * vertices !== this.fine?.positions.length)) return; // of another bundle
    if (frame.changed || !this.live) this.live = this.shapeOf(buffer.slice(0), inside, vertices);
    this.buffer = buffer;
    this.frame = frame;
    const words = flagWords(frame.flags);
    if (frame.tools.some(Boolean)) this.say(words.join("; "));
  }

  private shapeOf(buffer: ArrayBuffer, inside: number, vertices: number): Shape {
    const { fine, ...shape } = frameArrays(buffer, this.info!.surfaceNodeCount, inside, vertices);
    return { ...shape, fine: vertices ? fine : null };
  }
}

// null where the file is not of this organ.
function fineMesh(bytes: ArrayBuffer | null, mesh: Mesh): FineMesh | null {
  try {
    return bytes && readFineMesh(bytes, mesh);
  } catch {
    return null;
  }
}
