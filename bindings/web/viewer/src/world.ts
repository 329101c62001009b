// The page of several organs: draws the frames that its worker sends, and sends the user's input to the worker.
import { Vector3 } from "three";
import { named } from "./anatomy";
import { clearestDirection } from "./clear_view";
import { organColour } from "./colours";
import { DEFAULT_EFFECTS, DEFAULT_TOOL } from "./effects";
import { byId, element, input, isOn, mode } from "./elements";
import { playedWords } from "./holds";
import { JoinedOrgans } from "./joined_organs";
import type { ClockState } from "./motion_clocks";
import { frontOf } from "./organ_camera";
import type { Hit, OrganView } from "./organ_view";
import { begin, state, TouchPage } from "./touch_page";
import { droppedWorld, servedWorld, type WorldFiles } from "./world_files";
import type { FromWorldWorker, OpenedOrgan, OrganForces, ToWorldWorker, WorldFrame, WorldSettings } from "./world_messages";
import type { WorldScene } from "./world_scene";
import { count, decimal, fixed, keepInAddress, tell, word } from "./words";

const STILL = matchMedia("(prefers-reduced-motion: reduce)");

class WorldPage extends TouchPage<WorldFrame, ToWorldWorker> {
  private opening: { scene: WorldScene; settings: WorldSettings } | null = null; // what the worker was told to open
  private scene: WorldScene | null = null;
  private organs: OpenedOrgan[] = [];
  private rows: HTMLElement[] = []; // of the organs' forces
  private joined: JoinedOrgans | null = null;
  private settings: WorldSettings = { discRadius: DEFAULT_TOOL.discRadius, law: DEFAULT_EFFECTS.law, touch: false, friction: 0 };
  private accepted = this.settings; // by the worker, to return to when it refuses others
  private held = new Set<string>(); // motions whose slider the user holds

  constructor(canvas: HTMLCanvasElement, view: OrganView) {
    const worker = new Worker(new URL("./world.worker.ts", import.meta.url), { type: "module" });
    super(canvas, view, worker, { push: "world.hint.push", pull: "world.hint.pull" });
    keepInAddress();
    worker.addEventListener("message", ({ data }: MessageEvent<FromWorldWorker>) => this.heard(data));
    worker.addEventListener("error", ({ message }) => this.showError(message || word("error.stopped.about"), 0));
    this.click("play", () => this.replay());
    for (const id of ["touch", "friction", "law", "radius"]) byId(id).addEventListener("change", () => this.change());
    for (const id of ["friction", "radius"]) byId(id).addEventListener("input", () => this.showValues());
    this.connect(["colour-by", "show-mesh", "show-fixed", "show-touchable"]);
    void this.open(servedWorld);
  }

  protected pointing() {
    return {
      followsDeformed: (hit: Hit) => this.scene!.organs[this.joined!.organAt(hit)].effects.collision === "deformed",
      radiusAt: (hit: Hit) => this.joined!.radiusAt(hit),
      pressed: () => byId("hint").classList.add("done"),
    };
  }

  protected get isOpen() {
    return this.scene !== null;
  }

  private heard(message: FromWorldWorker) {
    if (message.type === "frame") return this.take(message);
    if (message.type === "progress") return this.progress(message.done, message.total, message.name);
    if (message.type === "opened") return this.show(message);
    if (message.type === "accepted") return void (this.accepted = message.settings);
    if (message.type === "played") return void (this.played = message.forces);
    if (message.what === "world") return this.showError(message.message, message.byteOffset);
    if (message.what === "settings") this.takeBack();
    this.tellUser(message.message);
  }

  // ---- opening -------------------------------------------------------------------------------------------------------

  private async open(files: () => Promise<WorldFiles | null>) {
    this.progress(0, 0);
    byId("progress-text").textContent = word("loading.starting");
    try {
      const found = await files();
      if (!found) return state(this.scene ? "ready" : "empty");
      const { scene } = found, settings = { ...this.settings, touch: scene.pairs > 0, friction: scene.friction };
      this.opening = { scene, settings };
      this.tell({ type: "language", name: document.documentElement.lang });
      this.tell({ type: "open", ...found, settings }, found.files.flatMap(({ source }) => (typeof source === "string" ? [] : [source])));
    } catch (error) {
      this.showError((error as Error).message, 0);
    }
  }

  private show({ organs, frame, clocks }: Extract<FromWorldWorker, { type: "opened" }>) {
    this.scene = this.opening!.scene;
    this.obstacles = this.scene.obstacles;
    this.settings = this.accepted = this.opening!.settings;
    this.joined = new JoinedOrgans(organs);
    this.newest = this.buffer = null;
    this.waiting = false;
    this.pointer.forget();
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
    byId("name").textContent = named(name);
    document.title = `${named(name)} – Palpate`;
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
      return element("tr", {}, element("th", { scope: "row" }, element("label", {}, shown, dot, named(name))), element("td"), element("td"));
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
    input("friction").disabled = !isOn("touch");
    mode("pull").disabled = !this.canPull;
    if (!this.canPull && mode("pull").checked) mode("push").click();
  }

  private change() {
    this.settings = {
      discRadius: Number(input("radius").value) / 1000, law: byId<HTMLSelectElement>("law").value as WorldSettings["law"],
      touch: isOn("touch"), friction: Number(input("friction").value),
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

  protected showChoices() {
    this.tell({ type: "colour", by: this.showDrawn(false) });
  }

  // ---- doing ---------------------------------------------------------------------------------------------------------

  protected replay() {
    if (!this.scene?.tools.length) return;
    this.pointer.forget();
    byId("hint").classList.add("done");
    this.tellUser("");
    this.played = null;
    this.tell({ type: "play" });
  }

  protected reset() {
    this.pointer.forget();
    this.tell({ type: "reset" });
    this.tellUser("");
  }

  protected letGo() {
    this.reset();
  }

  protected openFiles(files: File[]) {
    if (files.length) void this.open(() => droppedWorld(files));
  }

  protected translate() {
    this.tell({ type: "language", name: document.documentElement.lang });
    this.tellUser("");
    if (!this.scene) return;
    this.showFacts();
    this.rows.forEach((row, k) => (row.querySelector("label")!.lastChild!.textContent = named(this.organs[k].name)));
    this.showValues();
    this.showChoices();
  }

  // ---- frames --------------------------------------------------------------------------------------------------------

  protected draw() {
    this.moveOn(performance.now(), this.discDrawn);
    this.view.render();
  }

  // m, of the pointer's tools; 0: they have no disc.
  private get discDrawn(): number {
    return this.scene!.organs.some(({ effects }) => effects.contact === "patch") ? this.settings.discRadius : 0;
  }

  private take(frame: WorldFrame) {
    if (this.takes(frame, (this.joined?.mesh.positions.length ?? 0) / 3)) this.numbers(frame);
  }

  protected numbers(frame: WorldFrame) {
    super.numbers(frame);
    this.showForces(frame.organs);
    this.showTimes(frame.clocks);
    byId("trust").textContent = playedWords(frame, this.pace.share);
  }

  // What the page shows now, for scripts.
  get shown() {
    const { frame, shape } = this.newest ?? {};
    return { positions: shape?.positions ?? null, tools: frame?.tools ?? [], organs: frame?.organs ?? [], clocks: frame?.clocks ?? [], playing: frame?.playing ?? null, holds: frame?.holds ?? [], links: frame?.links ?? [], obstacles: frame?.obstacles ?? [], played: this.played };
  }
}

begin("palpateWorld", (canvas, view) => new WorldPage(canvas, view)); // for scripts: see `shown`
