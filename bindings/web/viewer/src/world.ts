// The page of several organs: draws the frames that its worker sends, and sends the user's input to the worker.
import { Vector3 } from "three";
import { clearestDirection } from "./clear_view";
import { Spread, TouchRate } from "./clocks";
import { GRADIENT, organColour } from "./colours";
import { Cross } from "./cross";
import { DEFAULT_EFFECTS, DEFAULT_TOOL, flagWords } from "./effects";
import { element } from "./elements";
import { Gamepads } from "./gamepad";
import { playedWords } from "./holds";
import { JoinedOrgans } from "./joined_organs";
import { Keys } from "./keys";
import { frameArrays, frameBytes, type ColourBy } from "./messages";
import type { ClockState } from "./motion_clocks";
import { frontOf } from "./organ_camera";
import { OrganView, type Shape } from "./organ_view";
import { megabytes } from "./served";
import { ToolPointer } from "./tool_pointer";
import { TOOL_COLOURS, ToolReadout } from "./tool_readout";
import { droppedWorld, servedWorld, type WorldFiles } from "./world_files";
import type { FromWorldWorker, OpenedOrgan, OrganForces, ToWorldWorker, WorldFrame, WorldSettings } from "./world_messages";
import type { WorldScene } from "./world_scene";
import { chosenLanguage, count, decimal, fill, fixed, keepInAddress, offerLanguages, speak, tell, word, type Key } from "./words";

const byId = <T extends HTMLElement = HTMLElement>(id: string) => document.getElementById(id) as T;
const input = (id: string) => byId<HTMLInputElement>(id);
const isReady = () => document.body.dataset.state === "ready";
const STILL = matchMedia("(prefers-reduced-motion: reduce)");

type State = "loading" | "ready" | "empty" | "error" | "unable";
function state(now: State) {
  document.body.dataset.state = now;
  document.querySelector("main")!.inert = now !== "ready"; // the keyboard reaches what is visible alone
}

function begin() {
  speak(chosenLanguage());
  keepInAddress();
  if (typeof WebAssembly !== "object") return unable("unable.webassembly");
  let view: OrganView;
  try {
    view = new OrganView(byId<HTMLCanvasElement>("organ"));
  } catch {
    return unable("unable.webgl");
  }
  Object.assign(globalThis, { palpateWorld: new WorldPage(byId<HTMLCanvasElement>("organ"), view) }); // for scripts: see `shown`
}

function unable(why: Key) {
  byId("unable-text").textContent = word(why);
  state("unable");
}

class WorldPage {
  private worker = new Worker(new URL("./world.worker.ts", import.meta.url), { type: "module" });
  private pointer: ToolPointer;
  private cross: Cross;
  private gamepads: Gamepads;
  private readout = new ToolReadout(byId("readout"), byId("labels"));
  private opening: { scene: WorldScene; settings: WorldSettings } | null = null; // what the worker was told to open
  private scene: WorldScene | null = null;
  private organs: OpenedOrgan[] = [];
  private rows: HTMLElement[] = []; // of the organs' forces
  private joined: JoinedOrgans | null = null;
  private settings: WorldSettings = { discRadius: DEFAULT_TOOL.discRadius, law: DEFAULT_EFFECTS.law, touch: false, friction: 0 };
  private accepted = this.settings; // by the worker, to return to when it refuses others
  private newest: { shape: Shape; frame: WorldFrame } | null = null;
  private buffer: ArrayBuffer | null = null;
  private waiting = false; // for a frame of the worker
  private flagged = false; // what the page says is a step's flags
  private played: Float64Array | null = null; // forces of the scene's tools, when they were played
  private held = new Set<string>(); // motions whose slider the user holds
  private times = { touchUs: new Spread(), shapeUs: new Spread() };
  private rate = new TouchRate();

  constructor(canvas: HTMLCanvasElement, private view: OrganView) {
    this.pointer = new ToolPointer(canvas, view, {
      pulls: () => this.pulls,
      keeps: () => input("keep").checked,
      followsDeformed: (hit) => this.scene!.organs[this.joined!.organAt(hit)].effects.collision === "deformed",
      radiusAt: (hit) => this.joined!.radiusAt(hit),
      send: (index, target) => this.tell({ type: "tool", index, target }),
      withdraw: (index) => this.tell({ type: "withdraw", index }),
      pressed: () => byId("hint").classList.add("done"),
    });
    this.cross = new Cross(canvas, byId("cross"));
    this.gamepads = new Gamepads(this.cross, {
      isOpen: isReady, turn: (right, up) => view.camera.turn(right, up), home: () => view.camera.home(), reset: () => this.reset(),
      press: (share, x, y) => this.pointer.press(share, x, y), release: () => this.pointer.release(),
    });
    this.worker.addEventListener("message", ({ data }: MessageEvent<FromWorldWorker>) => this.heard(data));
    this.worker.addEventListener("error", ({ message }) => this.refuse(message || word("error.stopped.about")));
    this.connect(canvas);
    this.dress();
    void this.open(servedWorld);
    view.loop(() => this.draw());
  }

  private tell(message: ToWorldWorker, transfer: Transferable[] = []) {
    this.worker.postMessage(message, transfer);
  }

  private heard(message: FromWorldWorker) {
    if (message.type === "frame") return this.take(message);
    if (message.type === "progress") return this.progress(message);
    if (message.type === "opened") return this.show(message);
    if (message.type === "accepted") return void (this.accepted = message.settings);
    if (message.type === "played") return void (this.played = message.forces);
    if (message.what === "world") return this.refuse(message.message, message.byteOffset);
    if (message.what === "settings") this.takeBack();
    this.tellUser(message.message);
  }

  // ---- opening -------------------------------------------------------------------------------------------------------

  private async open(files: () => Promise<WorldFiles | null>) {
    this.progress({ name: "", done: 0, total: 0 });
    try {
      const found = await files();
      if (!found) return state(this.scene ? "ready" : "empty");
      const { scene } = found, settings = { ...this.settings, touch: scene.pairs > 0, friction: scene.friction };
      this.opening = { scene, settings };
      this.tell({ type: "language", name: document.documentElement.lang });
      this.tell({ type: "open", ...found, settings }, found.files.flatMap(({ source }) => (typeof source === "string" ? [] : [source])));
    } catch (error) {
      this.refuse((error as Error).message);
    }
  }

  private progress({ name, done, total }: { name: string; done: number; total: number }) {
    state("loading");
    const bar = byId<HTMLProgressElement>("progress");
    if (total) bar.value = done / total;
    else bar.removeAttribute("value");
    const values = { done: decimal(megabytes(done)), total: decimal(megabytes(total)) };
    byId("progress-text").textContent = name ? `${name}: ${word(total ? "loading.progress" : "loading.done", values)}` : word("loading.starting");
  }

  private refuse(text: string, byteOffset = 0) {
    byId("error-text").textContent = text;
    byId("error-place").textContent = byteOffset ? word("error.place", { byte: count(byteOffset) }) : "";
    byId("error-back").hidden = !this.scene;
    state("error");
  }

  private show({ organs, frame, clocks }: Extract<FromWorldWorker, { type: "opened" }>) {
    this.scene = this.opening!.scene;
    this.settings = this.accepted = this.opening!.settings;
    this.joined = new JoinedOrgans(organs);
    this.newest = this.buffer = null;
    this.waiting = false;
    this.pointer.forget();
    this.view.most = 0.005;
    const from = clearestDirection(organs.map(({ mesh }) => mesh), frontOf(frame).toArray());
    this.view.open(this.joined.mesh, frame, this.joined.colours, new Vector3(...from));
    this.organs = organs;
    this.showFacts();
    this.showOrgans();
    this.showClocks(clocks);
    this.showSettings();
    this.showChoices();
    byId("play").toggleAttribute("disabled", !this.scene.tools.length);
    byId("hint").classList.remove("done");
    this.tellUser("");
    state("ready");
    if (!STILL.matches) for (const { name } of clocks) this.tell({ type: "motion", name, plays: true });
  }

  private showFacts() {
    const { name } = this.scene!, nodes = this.organs.reduce((sum, organ) => sum + organ.nodes, 0);
    byId("name").textContent = name;
    document.title = `${name} – Palpate`;
    byId("facts").textContent = word("world.facts", { organs: count(this.organs.length), nodes: count(nodes) });
    const tools = this.scene!.tools.map((tool, t) => `${t + 1}: ${tool.name}`).join(", ");
    if (tools) tell(byId("played"), "world.played", { tools });
    else tell(byId("played"), "world.no-tools");
  }

  private showOrgans() {
    const row = ({ name }: { name: string }, k: number) => {
      const dot = element("i", { class: "dot" }), shown = element("input", { type: "checkbox", checked: "" });
      dot.style.background = organColour(k);
      shown.addEventListener("change", () => this.hide());
      return element("tr", {}, element("th", { scope: "row" }, element("label", {}, shown, dot, name)), element("td"), element("td"));
    };
    this.rows = this.organs.map(row);
    byId("organs").querySelector("tbody")!.replaceChildren(...this.rows);
  }

  // Organs without their ticks are not drawn; they stay where they are.
  private hide() {
    this.view.showTriangles(this.joined!.trianglesOf((organ) => this.rows[organ].querySelector("input")!.checked));
    if (this.newest) this.view.move(this.newest.shape);
  }

  private showForces(organs: OrganForces[]) {
    const newtons = (force: number) => `${fixed(force, 2)} N`;
    this.rows.forEach((row, k) => {
      row.children[1].textContent = newtons(organs[k].tools);
      row.children[2].textContent = newtons(organs[k].organs);
    });
  }

  // ---- motions -------------------------------------------------------------------------------------------------------

  private showClocks(clocks: ClockState[]) {
    byId("motions-section").hidden = !clocks.length;
    byId("motions").replaceChildren(...clocks.map(({ name }) => {
      const button = element("button", { type: "button", "aria-label": name }), slider = element("input", { type: "range", min: 0, max: 1, step: 0.005, value: 0, "aria-label": name });
      button.addEventListener("click", () => this.tell({ type: "motion", name, plays: button.dataset.plays !== "yes" }));
      slider.addEventListener("input", () => (this.held.add(name), this.tell({ type: "motion", name, plays: false, share: Number(slider.value) })));
      slider.addEventListener("change", () => this.held.delete(name));
      return element("div", { class: "line" }, element("span", { class: "name" }, name), slider, button);
    }));
    this.showTimes(clocks);
  }

  private showTimes(clocks: ClockState[]) {
    byId("motions").querySelectorAll(".line").forEach((line, m) => {
      const { name, share, plays } = clocks[m], [slider, button] = [line.querySelector("input")!, line.querySelector("button")!];
      if (!this.held.has(name)) slider.value = String(share);
      button.dataset.plays = plays ? "yes" : "no";
      button.textContent = word(plays ? "world.motion.pause" : "world.motion.play");
      button.ariaLabel = `${button.textContent}: ${name}`;
      slider.disabled = button.disabled = this.newest?.frame.playing != null;
    });
  }

  // ---- settings ------------------------------------------------------------------------------------------------------

  private showSettings() {
    const { discRadius, law, touch, friction } = this.settings;
    input("radius").value = String(1000 * discRadius);
    byId<HTMLSelectElement>("law").value = law!;
    input("touch").checked = touch;
    input("friction").value = String(friction);
    this.showValues();
  }

  private showValues() {
    const { value: mm } = input("radius"), { value: friction } = input("friction");
    byId("radius-mm").textContent = `${decimal(mm)} mm`;
    byId("friction-value").textContent = decimal(friction);
    input("friction").disabled = !input("touch").checked;
    const pull = document.querySelector<HTMLInputElement>('input[name="mode"][value="pull"]')!;
    pull.disabled = !this.canPull;
    if (pull.disabled && pull.checked) document.querySelector<HTMLInputElement>('input[name="mode"][value="push"]')!.click();
  }

  private change() {
    this.settings = {
      discRadius: Number(input("radius").value) / 1000, law: byId<HTMLSelectElement>("law").value as WorldSettings["law"],
      touch: input("touch").checked, friction: Number(input("friction").value),
    };
    this.showValues();
    this.pointer.forget();
    this.tellUser(this.canPull ? "" : word("world.no-pull"));
    this.tell({ type: "settings", settings: this.settings });
  }

  // Tools that only push hold nothing.
  private get canPull(): boolean {
    return ["sticking", "sliding"].includes(byId<HTMLSelectElement>("law").value);
  }

  private takeBack() {
    this.settings = this.accepted;
    this.showSettings();
  }

  private showChoices() {
    const by = byId<HTMLSelectElement>("colour-by").value as ColourBy;
    this.tell({ type: "colour", by });
    byId("legend-name").textContent = word(by === "dent" ? "legend.dent" : "legend.displacement");
    this.view.show({ colour: by !== "nothing", mesh: input("show-mesh").checked, fixed: input("show-fixed").checked, soft: false, touchable: input("show-touchable").checked });
    if (this.newest) this.view.move(this.newest.shape);
    byId("legend").hidden = by === "nothing";
  }

  private tellUser(text: string) {
    byId("notice").textContent = byId("empty-note").textContent = text;
  }

  // ---- doing ---------------------------------------------------------------------------------------------------------

  private play() {
    if (!this.scene?.tools.length) return;
    this.pointer.forget();
    byId("hint").classList.add("done");
    this.tellUser("");
    this.played = null;
    this.tell({ type: "play" });
  }

  private reset() {
    this.pointer.forget();
    this.tell({ type: "reset" });
    this.tellUser("");
  }

  private connect(canvas: HTMLCanvasElement) {
    const click = (id: string, act: () => void) => byId(id).addEventListener("click", act);
    click("play", () => this.play());
    click("reset", () => this.reset());
    click("home", () => this.view.camera.home());
    click("error-back", () => state("ready"));
    click("more", () => byId("more").setAttribute("aria-expanded", String(document.body.classList.toggle("panel-open"))));
    for (const button of document.querySelectorAll("[data-open]")) button.addEventListener("click", () => byId("file").click());
    byId("file").addEventListener("change", () => {
      this.openFiles([...(input("file").files ?? [])]);
      input("file").value = "";
    });
    for (const id of ["touch", "friction", "law", "radius"]) byId(id).addEventListener("change", () => this.change());
    for (const id of ["friction", "radius"]) byId(id).addEventListener("input", () => this.showValues());
    for (const id of ["colour-by", "show-mesh", "show-fixed", "show-touchable"]) byId(id).addEventListener("change", () => this.showChoices());
    byId("keep").addEventListener("change", () => !input("keep").checked && this.reset());
    for (const mode of document.querySelectorAll('input[name="mode"]')) mode.addEventListener("change", () => this.showHint());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.dress());
    offerLanguages(() => this.translate());
    new Keys(canvas, this.cross, {
      isOpen: isReady, turn: (right, up) => this.view.camera.turn(right, up), nearer: (factor) => this.view.camera.nearer(factor), home: () => this.view.camera.home(),
      push: (down, x, y) => this.pointer.key(down, x, y), undo: () => {}, replay: () => this.play(), reset: () => this.reset(),
    });
    this.connectDrops();
  }

  private openFiles(files: File[]) {
    if (files.length) void this.open(() => droppedWorld(files));
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

  private showHint() {
    const hint = byId("hint");
    hint.dataset.words = this.pulls ? "world.hint.pull" : "world.hint.push";
    hint.classList.remove("done");
    fill(hint.parentElement!);
  }

  private get pulls(): boolean {
    return document.querySelector<HTMLInputElement>('input[name="mode"][value="pull"]')!.checked;
  }

  // What the page's words cannot fill by themselves, in a language that the user has just chosen.
  private translate() {
    this.tell({ type: "language", name: document.documentElement.lang });
    this.tellUser("");
    if (!this.scene) return;
    this.showFacts();
    this.showValues();
    this.showChoices();
  }

  private dress() {
    const style = getComputedStyle(document.documentElement), colour = (name: string) => style.getPropertyValue(name).trim();
    this.view.dress(colour("--ink"), colour("--held"), colour("--soft-held"), colour("--touchable"), TOOL_COLOURS.map(colour));
    byId("ramp").style.background = GRADIENT;
    this.showChoices();
  }

  // ---- frames --------------------------------------------------------------------------------------------------------

  private draw() {
    if (!this.scene) return;
    this.gamepads.tick(performance.now());
    this.pointer.tick((this.newest?.frame.tools ?? []).map((tool) => tool && tool.point));
    if (!this.waiting) {
      this.waiting = true;
      this.tell({ type: "frame", buffer: this.buffer }, this.buffer ? [this.buffer] : []);
      this.buffer = null;
    }
    if (this.newest) this.view.move(this.newest.shape);
    const frames = this.newest?.frame.tools ?? [];
    this.view.moveLinks(this.newest?.frame.links ?? []);
    this.readout.label(frames, this.view.moveTools(frames, this.discDrawn, this.pointer.places));
    this.view.render();
  }

  // m, of the pointer's tools; 0: they have no disc.
  private get discDrawn(): number {
    return this.scene!.organs.some(({ effects }) => effects.contact === "patch") ? this.settings.discRadius : 0;
  }

  private take(frame: WorldFrame) {
    this.waiting = false;
    const nodes = (this.joined?.mesh.positions.length ?? 0) / 3;
    if (frame.buffer.byteLength !== frameBytes(nodes, 0, 0)) return; // of the scene that was open before
    if (frame.changed || !this.newest) this.newest = { shape: { ...frameArrays(frame.buffer.slice(0), nodes, 0, 0), fine: null }, frame };
    else this.newest.frame = frame;
    this.buffer = frame.buffer;
    this.numbers(frame);
  }

  private numbers(frame: WorldFrame) {
    this.readout.show(frame.tools);
    this.showForces(frame.organs);
    this.showTimes(frame.clocks);
    for (const [key, id] of [["touchUs", "touch-us"], ["shapeUs", "shape-us"]] as const) {
      if (!frame[key]) continue;
      const times = this.times[key];
      times.add(frame[key]);
      byId(id).textContent = threeDigits(times.median);
      byId(`${id}-spread`).textContent = word("times.spread", { low: threeDigits(times.low), high: threeDigits(times.high) });
    }
    this.rate.add(frame.touches, frame.at);
    byId("touch-rate").textContent = frame.touches ? this.rate.words : word("times.at-rest");
    byId("trust").textContent = playedWords(frame.playing, frame.holds);
    const words = flagWords(frame.flags);
    if (frame.lost) words.push(word("notice.lost", { count: frame.lost }));
    if (words.length || this.flagged) this.tellUser(words.join("; "));
    this.flagged = words.length > 0;
    byId("most").textContent = brief(1000 * this.view.most);
    byId("middle").textContent = brief(500 * this.view.most);
  }

  // What the page shows now, for scripts.
  get shown() {
    const { frame, shape } = this.newest ?? {};
    return { positions: shape?.positions ?? null, tools: frame?.tools ?? [], organs: frame?.organs ?? [], clocks: frame?.clocks ?? [], playing: frame?.playing ?? null, holds: frame?.holds ?? [], links: frame?.links ?? [], played: this.played };
  }
}

const threeDigits = (value: number) => fixed(value, value < 99.5 ? 1 : 0);
const brief = (value: number) => decimal(Number(value.toPrecision(2)));

begin();
