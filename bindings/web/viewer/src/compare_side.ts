// One of the two sides of Compare: an organ under effects of its own, drawn as both sides' camera sees it.
import { named } from "./anatomy";
import { flagWords } from "./effects";
import { EffectsPanel } from "./effects_panel";
import { effectsOfWords } from "./links";
import { LiveOrgan } from "./live_organ";
import type { FromWorker, PageEffects, Path, ToolFrame, ToolTarget, Trial } from "./messages";
import type { Shape } from "./organ_view";
import { progressWords } from "./served";
import { forceLabels, TOOL_COLOURS } from "./tool_readout";
import type { Setting } from "./side_names";
import { count, fill, fixed, word } from "./words";

export interface SideEvents {
  opened: () => void;
  changed: () => void; // the effects: what was tried before is of others
  send: (index: number, target: ToolTarget) => void;
  withdraw: (index: number) => void;
  pulls: () => boolean; // the pointer pulls in place of pushing
  leads: () => void; // this side's camera is the one that the user turns
}

export class CompareSide extends LiveOrgan {
  readonly canvas: HTMLCanvasElement;
  trial: { of: Trial; shape: Shape } | null = null; // shown when no tool is there
  private panel: EffectsPanel;
  private provenance: Record<string, unknown> = {};
  private words: string; // of the effects that the next bundle begins with
  address = ""; // of the bundle; empty: a file of the user's
  private others: string[] = []; // addresses to try where the server does not have the bundle

  // words: of the effects that the page's address asks for. renderMesh: the bytes of the finer surface; null: there is none.
  constructor(private root: HTMLElement, private letter: "A" | "B", words: string, renderMesh: Promise<ArrayBuffer | null>, private of: SideEvents) {
    const canvas = root.querySelector("canvas")!, wanted = () => this.words;
    const pointer = { pulls: of.pulls, keeps: () => false, send: of.send, withdraw: of.withdraw, pressed: () => {} };
    super(canvas, pointer, () => renderMesh, (own: PageEffects) => effectsOfWords(new URLSearchParams(wanted()), own, (effect) => this.isAvailable(effect)), {
      opening: () => (this.trial = null),
      opened: (bundle) => this.wasOpened(bundle), accepted: () => this.wasAccepted(), refused: (why) => this.wasRefused(why),
      progress: (done, total) => this.say(progressWords(done, total)),
      framed: ({ tools, flags }) => tools.some(Boolean) && this.say(flagWords(flags).join("; ")),
    });
    this.canvas = canvas;
    this.words = words;
    this.part("h2").className = letter.toLowerCase();
    this.translate();
    this.view.show({ colour: true, mesh: false, fixed: false, touchable: false, soft: false });
    this.panel = new EffectsPanel(this.part(".effects"), (effects) => (this.change(effects), this.showEffects()));
    for (const type of ["pointerdown", "wheel", "focus"]) this.canvas.addEventListener(type, () => of.leads(), { capture: true, passive: true });
    const input = this.part<HTMLInputElement>("input[type=file]");
    this.part(".open").addEventListener("click", () => input.click());
    input.addEventListener("change", () => void (input.files?.[0] && this.openFile(input.files[0])));
  }

  // Both tools of a side have the side's colour.
  private get colours(): string[] {
    return TOOL_COLOURS.map(() => TOOL_COLOURS[this.letter === "A" ? 0 : 1]);
  }

  part<T extends HTMLElement = HTMLElement>(selector: string): T {
    return this.root.querySelector<T>(selector)!;
  }

  // What this side shows, to be named by what differs from the other one.
  get setting(): Setting {
    const { provenance: { organ, boundary, element }, info, bytes, effects, tool: { discRadius } } = this;
    return { organ: String(organ ?? word("page.organ-name")), boundary: String(boundary ?? ""), element: String(element ?? ""), nodes: info!.nodeCount, bytes, effects, discRadius };
  }

  // name: what differs from the other side; empty: nothing does.
  call(name: string) {
    this.part("h2").textContent = name ? `${this.letter}: ${name}` : this.letter;
  }

  // The effects that these words of an address name, in the open bundle.
  useEffects(words: string, discRadius: number) {
    this.words = words;
    if (!this.info) return;
    this.change(effectsOfWords(new URLSearchParams(words), this.effects, (effect) => this.isAvailable(effect)), { ...this.tool, discRadius });
    this.showEffects();
  }

  say(text: string) {
    this.part(".said").textContent = text;
  }

  // Opens the first of these that the server has.
  fetch([url, ...others]: string[]) {
    this.address = url;
    this.others = others;
    this.say(word("compare.opening"));
    this.tell({ type: "fetch", url });
  }

  async openFile(file: File) {
    this.address = "";
    this.say(word("compare.opening-file", { name: file.name }));
    const bytes = await file.arrayBuffer().catch(() => null);
    if (!bytes) return this.say(word("error.unreadable.about", { name: file.name }));
    this.tell({ type: "open", name: file.name, bytes }, [bytes]);
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
    return { shape: this.shape, tools: this.frame?.tools ?? [] };
  }

  // most: m, the palest colour of both sides.
  draw(most: number) {
    const { shape, tools } = this.shown;
    if (shape) this.view.move(shape, most);
    const radius = this.effects.contact === "patch" ? this.tool.discRadius : 0;
    forceLabels(this.part(".labels"), tools, this.view.moveTools(tools, radius), [this.letter, this.letter], this.colours);
    this.view.render();
    const tool = tools.find(Boolean);
    this.part(".now").textContent = tool ? word("compare.now", { newtons: fixed(Math.hypot(...tool.force), 3), mm: fixed(1000 * tool.depth, 1) }) : "";
  }

  dress() {
    this.view.dress(document.documentElement, this.colours);
  }

  // The words in the page's language.
  translate() {
    this.speak(document.documentElement.lang);
    const { root, letter, info, bytes } = this;
    fill(root);
    root.setAttribute("aria-label", word("compare.side", { side: letter }));
    this.canvas.setAttribute("aria-label", word("compare.organ", { side: letter }));
    this.say("");
    if (!info) return;
    const { organ, boundary, element } = this.provenance;
    this.part(".facts").textContent = [organ ? named(String(organ)) : word("page.organ-name"), word("compare.vertices", { count: count(info.nodeCount) }), boundary && named(String(boundary)), element, `${fixed(bytes / 1e6, 1)} MB`].filter(Boolean).join(" · ");
    this.showEffects();
  }

  private wasOpened({ provenance }: Extract<FromWorker, { type: "opened" }>) {
    this.provenance = provenance;
    this.translate();
    this.of.opened();
  }

  private showEffects() {
    this.panel.open(this.effects, (effect) => this.isAvailable(effect));
  }

  private wasAccepted() {
    this.trial = null;
    this.of.changed();
  }

  private wasRefused({ what, message }: Extract<FromWorker, { type: "refused" }>) {
    if (what === "absent") return this.others.length ? this.fetch(this.others) : this.say(word("compare.none"));
    this.say(message);
    if (what === "effects") this.showEffects();
  }
}
