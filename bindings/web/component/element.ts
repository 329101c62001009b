// <palpate-viewer bundle="...">: an organ under the pointer, in any page. palpate-viewer.d.ts says what it offers to that page.
import type { BundleInfo } from "../module/palpate.js";
import { Cross } from "../viewer/src/cross";
import { DEFAULT_TOOL, flagWords } from "../viewer/src/effects";
import { Keys } from "../viewer/src/keys";
import { effectsOfWords } from "../viewer/src/links";
import { LiveOrgan } from "../viewer/src/live_organ";
import type { ColourBy, Frame, FromWorker, PageEffects } from "../viewer/src/messages";
import { demonstration } from "../viewer/src/path_files";
import { fetched, progressWords } from "../viewer/src/served";
import { forceLabels, TOOL_COLOURS } from "../viewer/src/tool_readout";
import { isLanguage, useLanguage, word } from "../viewer/src/words";
import type { PalpateViewer, PalpateViewerEventMap } from "./palpate-viewer";
import { waysToStart } from "./package_engine";
import style from "./style.css?inline";

const WATCHED = ["bundle", "effects", "disc", "colour"];

export class PalpateViewerElement extends HTMLElement implements PalpateViewer {
  static observedAttributes = WATCHED;
  private canvas!: HTMLCanvasElement;
  private labels!: HTMLElement;
  private said!: HTMLElement;
  private organ: LiveOrgan | null = null;
  private drawing = 0; // of requestAnimationFrame
  private touched = false; // in the frame before
  private readonly scheme = matchMedia("(prefers-color-scheme: dark)");
  private readonly redress = () => this.dress();

  connectedCallback() {
    useLanguage(this.language);
    this.build();
    try {
      this.organ = this.start();
    } catch {
      return this.fail(word("unable.webgl"));
    }
    this.organ.speak(this.language);
    this.dress();
    this.scheme.addEventListener("change", this.redress);
    this.fetch();
    this.drawing = requestAnimationFrame(() => this.draw());
  }

  private get language() {
    const language = this.closest("[lang]")?.getAttribute("lang")?.split("-")[0] ?? "en";
    return isLanguage(language) ? language : "en";
  }

  disconnectedCallback() {
    cancelAnimationFrame(this.drawing);
    this.scheme.removeEventListener("change", this.redress);
    this.organ?.close();
    this.organ = null;
  }

  attributeChangedCallback(name: string, before: string | null, now: string | null) {
    if (!this.organ || before === now) return;
    if (name === "bundle") return this.fetch();
    if (name === "colour") return this.show();
    if (this.info) this.organ.change(this.wantedEffects(this.organ.effects), this.wantedTool);
  }

  // ---- what a page reads and sets -----------------------------------------------------------------------------------

  get bundle() {
    return new URL(this.getAttribute("bundle") ?? "", this.baseURI).href;
  }
  set bundle(address: string) {
    this.setAttribute("bundle", address);
  }
  get surface() {
    const address = this.getAttribute("surface");
    return address ? new URL(address, this.baseURI).href : "";
  }
  set surface(address: string) {
    this.setAttribute("surface", address);
  }
  get effects() {
    return this.getAttribute("effects") ?? "";
  }
  set effects(words: string) {
    this.setAttribute("effects", words);
  }
  get disc() {
    return 1000 * this.wantedTool.discRadius;
  }
  set disc(mm: number) {
    this.setAttribute("disc", String(mm));
  }
  get colour() {
    return this.getAttribute("colour") ?? "dent";
  }
  set colour(by: string) {
    this.setAttribute("colour", by);
  }
  get pull() {
    return this.hasAttribute("pull");
  }
  set pull(on: boolean) {
    this.toggleAttribute("pull", on);
  }
  get keep() {
    return this.hasAttribute("keep");
  }
  set keep(on: boolean) {
    this.toggleAttribute("keep", on);
  }
  get info(): BundleInfo | null {
    return this.organ?.info ?? null;
  }
  get tools() {
    return this.organ?.frame?.tools ?? [null, null];
  }

  press() {
    const { organ } = this, hit = organ?.mesh && organ.view.front(organ.mesh.touchable);
    if (hit) organ!.tell({ type: "replay", path: demonstration(hit.place, hit.normal) });
  }

  reset() {
    this.organ?.pointer.forget();
    this.organ?.tell({ type: "reset" });
  }

  home() {
    this.organ?.view.camera.home();
  }

  // ---- inside -------------------------------------------------------------------------------------------------------

  private build() {
    const root = this.shadowRoot ?? this.attachShadow({ mode: "open", delegatesFocus: true });
    const sheet = new CSSStyleSheet(); // a page may forbid styles in its text
    sheet.replaceSync(style);
    root.adoptedStyleSheets = [sheet];
    root.innerHTML = `<canvas tabindex="0" role="application"></canvas><div class="cross" hidden></div>
      <div class="labels" aria-hidden="true"></div><p class="said" role="status"></p>`;
    const part = (name: string) => root.querySelector<HTMLElement>(name)!;
    [this.canvas, this.labels, this.said] = [part("canvas") as HTMLCanvasElement, part(".labels"), part(".said")];
    this.canvas.setAttribute("aria-label", word("page.organ"));
  }

  private start(): LiveOrgan {
    const organ: LiveOrgan = new LiveOrgan(this.canvas, {
      pulls: () => this.pull, keeps: () => this.keep, pressed: () => {},
      send: (index, target) => organ.tell({ type: "tool", index, target }), withdraw: (index) => organ.tell({ type: "withdraw", index }),
    }, async () => (await fetched(this.surface || null))?.bytes ?? null, (own) => this.wantedEffects(own), {
      opening: () => {}, accepted: () => {}, opened: (bundle) => this.opened(bundle), refused: (why) => this.refused(why),
      progress: (done, total) => this.say(progressWords(done, total)),
      framed: (frame) => this.framed(frame),
    }, waysToStart);
    new Keys(this.canvas, new Cross(this.canvas, this.shadowRoot!.querySelector<HTMLElement>(".cross")!), {
      isOpen: () => this.info !== null, turn: (right, up) => organ.view.camera.turn(right, up), nearer: (factor) => organ.view.camera.nearer(factor),
      push: (down, x, y) => organ.pointer.key(down, x, y), home: () => this.home(), undo: () => {}, replay: () => this.press(), reset: () => this.reset(),
    }, this.canvas);
    return organ;
  }

  private fetch() {
    this.say(word("loading.heading"));
    this.organ!.tool = this.wantedTool;
    this.organ!.tell({ type: "fetch", url: this.bundle });
  }

  private get wantedTool() {
    const mm = Number(this.getAttribute("disc"));
    return { ...DEFAULT_TOOL, discRadius: mm >= 2 && mm <= 12 ? mm / 1000 : DEFAULT_TOOL.discRadius };
  }

  private wantedEffects(own: PageEffects): PageEffects {
    return effectsOfWords(new URLSearchParams(this.effects.trim().replace(/\s+/g, "&")), own, (effect) => this.organ!.isAvailable(effect));
  }

  private opened({ info, provenance, bytes }: Extract<FromWorker, { type: "opened" }>) {
    this.say("");
    this.show();
    this.send("palpate-open", { info, provenance, bytes });
  }

  private refused({ what, name, message }: Extract<FromWorker, { type: "refused" }>) {
    if (what === "runtime") this.fail(word("element.engine", { why: message }));
    else this.fail(what === "absent" ? word("element.absent", { url: name }) : message);
  }

  private framed({ tools, flags }: Frame) {
    const now = tools.some(Boolean);
    if (!now && !this.touched) return;
    this.touched = now;
    this.say(now ? flagWords(flags).join("; ") : "");
    this.send("palpate-touch", { tools, flags });
  }

  private draw() {
    this.drawing = requestAnimationFrame(() => this.draw());
    const organ = this.organ!;
    organ.askFrame();
    if (!organ.shape) return;
    organ.view.move(organ.shape);
    const { effects, tool } = organ;
    forceLabels(this.labels, this.tools, organ.view.moveTools(this.tools, effects.contact === "patch" ? tool.discRadius : 0));
    organ.view.render();
  }

  private dress() {
    this.organ!.view.dress(this, TOOL_COLOURS);
    this.show();
  }

  private show() {
    const by = this.colour as ColourBy;
    this.organ!.tell({ type: "colour", by });
    this.organ!.view.scale(by);
    this.organ!.view.show({ colour: by !== "nothing", mesh: false, fixed: false, soft: false, touchable: false });
  }

  private fail(message: string) {
    this.say(message);
    this.send("palpate-error", { message });
  }

  private say(text: string) {
    if (this.said.textContent !== text) this.said.textContent = text;
  }

  private send<Name extends "palpate-open" | "palpate-touch" | "palpate-error">(name: Name, detail: PalpateViewerEventMap[Name]["detail"]) {
    this.dispatchEvent(new CustomEvent(name, { detail, bubbles: true, composed: true }));
  }
}

customElements.define("palpate-viewer", PalpateViewerElement);
