// What the page of one organ and the page of several share: the controls that both have, and the frames that the worker sends.
import { Pace, Spread, TouchRate } from "./clocks";
import { GRADIENT } from "./colours";
import { Cross } from "./cross";
import { flagWords } from "./effects";
import { byId, isOn, mode } from "./elements";
import { speedWords } from "./holds";
import { Gamepads } from "./gamepad";
import { Keys } from "./keys";
import { frameArrays, frameBytes, type ColourBy, type TouchFrame } from "./messages";
import type { ObstacleMesh } from "./obstacle_mesh";
import { OrganView, type Shape } from "./organ_view";
import { progressWords } from "./served";
import { SpokenForce } from "./spoken_force";
import { ToolPointer, type PointerOptions } from "./tool_pointer";
import { TOOL_COLOURS, ToolReadout } from "./tool_readout";
import { brief, chosenLanguage, count, fill, offerLanguages, speak, threeDigits, word, type Key } from "./words";

const ROOM = matchMedia("(min-width: 761px) and (min-height: 501px)"); // for the organ and the panel
const FLAGS_STAY = 4000; // ms after the last touch

export const isReady = () => document.body.dataset.state === "ready";

export type State = "loading" | "ready" | "empty" | "error" | "unable";
export function state(now: State) {
  document.body.dataset.state = now;
  document.querySelector("main")!.inert = now !== "ready"; // the keyboard reaches what is visible alone
}

function unable(why: Key) {
  byId("unable-text").textContent = word(why);
  state("unable");
}

// name: of the page among the global names, for scripts.
export function begin(name: string, make: (canvas: HTMLCanvasElement, view: OrganView) => unknown) {
  speak(chosenLanguage());
  if (typeof WebAssembly !== "object") return unable("unable.webassembly");
  const canvas = byId<HTMLCanvasElement>("organ");
  let view: OrganView;
  try {
    view = new OrganView(canvas);
  } catch {
    return unable("unable.webgl");
  }
  Object.assign(globalThis, { [name]: make(canvas, view) });
}

export abstract class TouchPage<Frame extends TouchFrame, Message> {
  protected pointer: ToolPointer;
  protected readout = new ToolReadout(byId("readout"), byId("labels"));
  protected newest: { shape: Shape; frame: Frame } | null = null;
  protected buffer: ArrayBuffer | null = null;
  protected obstacles: ObstacleMesh[] = []; // of the scene
  protected played: Float64Array | null = null; // forces of the scene's tools, when they were played
  protected waiting = false; // for a frame of the worker
  protected flagged = 0; // ms: when a step had flags; 0: what the page says is something else
  protected gamepads: Gamepads;
  private cross: Cross;
  private spoken = new SpokenForce(byId("spoken"));
  private times = { touchUs: new Spread(), shapeUs: new Spread() };
  private rate = new TouchRate();
  protected pace = new Pace(); // of a scene or a recording that plays

  // hints: the words below the organ, by the pointer's mode.
  constructor(private canvas: HTMLCanvasElement, protected view: OrganView, private worker: Worker, private hints: { push: Key; pull: Key; scalpel?: Key }) {
    this.pointer = new ToolPointer(canvas, view, {
      ...this.pointing(), pulls: () => mode("pull").checked, keeps: () => isOn("keep"),
      send: (index, target) => this.tell({ type: "tool", index, target } as Message), withdraw: (index) => this.tell({ type: "withdraw", index } as Message),
    });
    this.cross = new Cross(canvas, byId("cross"));
    this.gamepads = new Gamepads(this.cross, {
      isOpen: isReady, turn: (right, up) => view.camera.turn(right, up), home: () => view.camera.home(), reset: () => this.reset(),
      press: (share, x, y) => this.pointer.press(share, x, y), release: () => this.pointer.release(),
    });
  }

  // What else the pointer asks and tells.
  protected abstract pointing(): Omit<PointerOptions, "pulls" | "keeps" | "send" | "withdraw">;
  protected abstract reset(): void;
  protected abstract replay(): void;
  protected abstract openFiles(files: Iterable<File>): void;
  protected abstract letGo(): void; // of the tools that were kept
  protected abstract showChoices(): void;
  protected abstract translate(): void; // what the page's words cannot fill by themselves, in a language that the user has just chosen
  protected abstract get isOpen(): boolean;
  protected undo() {}
  // A press plays that nobody needs to be told of.
  protected get playsItself() {
    return false;
  }

  protected tell(message: Message, transfer: Transferable[] = []) {
    this.worker.postMessage(message, transfer);
  }

  protected click(id: string, act: () => void) {
    byId(id).addEventListener("click", act);
  }

  // changed: controls of what is drawn.
  protected connect(changed: string[]) {
    const { canvas, view: { camera } } = this;
    this.click("reset", () => this.reset());
    this.click("home", () => camera.home());
    this.click("error-back", () => state("ready"));
    const panel = (open: boolean) => byId("more").setAttribute("aria-expanded", String(document.body.classList.toggle("panel-open", open)));
    ROOM.addEventListener("change", () => panel(ROOM.matches));
    panel(ROOM.matches);
    this.click("more", () => panel(!document.body.classList.contains("panel-open")));
    for (const button of document.querySelectorAll("[data-open]")) button.addEventListener("click", () => byId("file").click());
    for (const file of document.querySelectorAll<HTMLInputElement>("input[type=file]"))
      file.addEventListener("change", () => {
        this.openFiles([...(file.files ?? [])]);
        file.value = "";
      });
    for (const id of changed) byId(id).addEventListener("change", () => this.showChoices());
    byId("keep").addEventListener("change", () => !isOn("keep") && this.letGo());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.dress());
    for (const choice of document.querySelectorAll('input[name="mode"]')) choice.addEventListener("change", () => this.showHint());
    offerLanguages(() => this.translate());
    new Keys(canvas, this.cross, {
      isOpen: isReady, turn: (right, up) => camera.turn(right, up), nearer: (factor) => camera.nearer(factor), home: () => camera.home(),
      push: (down, x, y) => this.pointer.key(down, x, y), undo: () => this.undo(), replay: () => this.replay(), reset: () => this.reset(),
    });
    this.connectDrops();
    this.dress();
    this.view.loop(() => this.isOpen && this.draw());
  }

  private connectDrops() {
    let over = 0;
    const dragging = (on: boolean) => document.body.classList.toggle("dragging", on);
    window.addEventListener("dragenter", (event) => (event.preventDefault(), dragging(++over > 0)));
    window.addEventListener("dragleave", () => dragging(--over > 0));
    window.addEventListener("dragover", (event) => event.preventDefault());
    window.addEventListener("drop", (event) => {
      event.preventDefault();
      over = 0;
      dragging(false);
      this.openFiles([...(event.dataTransfer?.files ?? [])]);
    });
  }

  // ---- showing -------------------------------------------------------------------------------------------------------

  // name: of the file; empty: the page's one.
  protected progress(done: number, total: number, name = "") {
    state("loading");
    const bar = byId<HTMLProgressElement>("progress");
    if (total) bar.value = done / total;
    else bar.removeAttribute("value");
    byId("progress-text").textContent = (name ? `${name}: ` : "") + progressWords(done, total);
  }

  protected showError(text: string, byteOffset: number) {
    byId("error-text").textContent = text;
    byId("error-place").textContent = byteOffset ? word("error.place", { byte: count(byteOffset) }) : "";
    byId("error-back").hidden = !this.isOpen;
    state("error");
  }

  // Says something beside the organ; on the empty page, in its card.
  protected tellUser(text: string) {
    this.flagged = 0;
    byId("notice").textContent = byId("empty-note").textContent = text;
  }

  protected showHint() {
    const hint = byId("hint");
    hint.dataset.words = this.playsItself ? "hint.plays" : (mode("scalpel").checked && this.hints.scalpel) || this.hints[mode("pull").checked ? "pull" : "push"];
    hint.classList.remove("done");
    fill(hint.parentElement!);
  }

  // Returns what the organs are coloured by.
  protected showDrawn(soft: boolean): ColourBy {
    const by = byId<HTMLSelectElement>("colour-by").value as ColourBy;
    byId("legend-name").textContent = word(by === "dent" ? "legend.dent" : "legend.displacement");
    this.view.scale(by);
    this.view.show({ colour: by !== "nothing", mesh: isOn("show-mesh"), fixed: isOn("show-fixed"), soft, touchable: isOn("show-touchable") });
    if (this.newest) this.view.move(this.newest.shape);
    byId("legend").hidden = by === "nothing";
    return by;
  }

  private dress() {
    this.view.dress(document.documentElement, TOOL_COLOURS);
    byId("ramp").style.background = GRADIENT;
    this.showChoices();
  }

  // ---- frames --------------------------------------------------------------------------------------------------------

  protected abstract draw(): void;

  // Moves what is drawn on, and asks the worker for its next frame. radius: m, of the tools' disc.
  protected moveOn(now: number, radius: number) {
    const { links = [], obstacles = [], tools = [] } = this.newest?.frame ?? {};
    if (this.newest) this.view.move(this.newest.shape);
    this.gamepads.tick(now);
    this.pointer.tick(tools.map((tool) => tool && tool.point));
    if (!this.waiting) {
      this.waiting = true;
      this.tell({ type: "frame", buffer: this.buffer } as Message, this.buffer ? [this.buffer] : []);
      this.buffer = null;
    }
    this.view.moveLinks(links);
    this.view.moveObstacles(this.obstacles, obstacles);
    this.readout.label(tools, this.view.moveTools(tools, radius, this.pointer.places));
  }

  // Takes a frame and its shape, where they are of what is open now. fine: vertices of the finer mesh that is drawn.
  protected takes(frame: Frame, nodes: number, inside = 0, vertices = 0, fine = vertices): boolean {
    this.waiting = false;
    if (frame.buffer.byteLength !== frameBytes(nodes, inside, vertices) || (vertices && vertices !== fine)) return false;
    if (frame.changed || !this.newest) {
      const { fine: mesh, ...shape } = frameArrays(frame.buffer.slice(0), nodes, inside, vertices);
      this.newest = { shape: { ...shape, fine: vertices ? mesh : null }, frame };
    } else this.newest.frame = frame;
    this.buffer = frame.buffer;
    return true;
  }

  // says: whether the page tells of flags now. replays: a recording.
  protected numbers(frame: Frame, says = true, replays = false) {
    const plays = frame.playing !== null;
    this.pace.add(frame, plays || replays);
    byId("trust").classList.toggle("plays", plays);
    this.readout.show(frame.tools);
    if (!this.playsItself) this.spoken.tell(frame.tools);
    for (const [key, id] of [["touchUs", "touch-us"], ["shapeUs", "shape-us"]] as const) {
      if (!frame[key]) continue;
      const times = this.times[key];
      times.add(frame[key]);
      byId(id).textContent = threeDigits(times.median);
      byId(`${id}-spread`).textContent = word("times.spread", { low: threeDigits(times.low), high: threeDigits(times.high) });
    }
    this.rate.add(frame.touches, frame.at);
    byId("touch-rate").textContent = frame.touches ? this.rate.words : word("times.at-rest");
    const words = flagWords(frame.flags), now = performance.now();
    // What plays leaves no touch out: it takes longer. Of a scene the line with its time says so.
    const slow = replays ? speedWords(1, this.pace.share) : frame.lost && !plays ? word("notice.lost", { count: frame.lost }) : "";
    if (slow && !this.playsItself) words.push(slow);
    if (words.length) this.flagged = now;
    if (this.flagged && (says || now - this.flagged > FLAGS_STAY)) {
      this.tellUser(words.join("; "));
      if (words.length) this.flagged = now;
    }
    byId("most").textContent = brief(1000 * this.view.most);
    byId("middle").textContent = brief(500 * this.view.most);
  }
}
