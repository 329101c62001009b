// The page: draws the frames that the worker sends, and sends the user's input to the worker.
import type { BundleInfo } from "../../module/palpate.js";
import { named, partsOf, type NamedPart } from "./anatomy";
import { FIELD_GRADIENT, SIGNED_GRADIENT } from "./colours";
import { DEFAULT_EFFECTS, DEFAULT_TOOL, EFFECT_LINES, isAvailable } from "./effects";
import { EffectsPanel } from "./effects_panel";
import { byId, input, isOn } from "./elements";
import { FrameClock } from "./clocks";
import { Cutting } from "./cutting";
import { readFineMesh, type FineMesh } from "./fine_mesh";
import { ForcePlot } from "./force_plot";
import { Headset } from "./headset";
import { largestOf } from "./geometry";
import { HealthyTwin, largestForce, twinOf } from "./healthy_twin";
import { playedWords } from "./holds";
import { bundleOfLink, linkOf, stateOfLink, wordsOfEffects, type PageState } from "./links";
import { offerLayers } from "./layer";
import { linearLimit, type LinearLimit } from "./linear_limit";
import { type ColourBy, type FieldOf, TOOL_COUNT, TOUCH_HZ, type Frame, type FromWorker, type Mesh, type PageEffects, type Path, type ToolShape, type ToolTarget, type ToWorker, type Trial } from "./messages";
import { NoduleTask, TASK_DEPTH, type Stiffness } from "./nodule_task";
import type { Hit, OrganView } from "./organ_view";
import { checkPlaceOfPath, demonstration, pathOfFile, save, trialPress } from "./path_files";
import { bundleOfScene, readScene } from "./scene_reader";
import { fetched, megabytes, servedFiles } from "./served";
import { showFigures } from "./figures";
import { Guide, GUIDED_CASES } from "./guided_cases";
import type { SectionAxis } from "./section";
import { SelfPlay } from "./self_play";
import { begin, isReady, state, TouchPage } from "./touch_page";
import { namesOf, sceneFiles } from "./world_files";
import { readOwn, type SceneFiles } from "./world_reader";
import type { WorldScene } from "./world_scene";
import { brief, count, decimal, fixed, keepInAddress, word, type Key } from "./words";

const SERVED = servedFiles();
const WANTED = new URLSearchParams(location.search);
const STARTS_TASK = WANTED.get("task") === "nodule", STARTS_CASE = GUIDED_CASES.find(({ name }) => name === WANTED.get("case"));
const ELEMENTS = ["p1", "p1-anp", "p1-ang", "p2-p0"];
const BRIDGE = Number(WANTED.get("device") ?? 18945); // the port on which the bridge of devices waits for this page
const SHOWN_DEPTH = 0.012; // m, of the press that plays itself, where linear elasticity is good as deep
const QUIET = 400; // ms without a touch before effects are timed

type Opened = Extract<FromWorker, { type: "opened" }>;

class Viewer extends TouchPage<Frame, ToWorker> {
  private plot = new ForcePlot(byId<HTMLCanvasElement>("plot"));
  private effectsPanel = new EffectsPanel(byId("effects"), (effects) => this.chooseEffects(effects), true);
  effects: PageEffects = DEFAULT_EFFECTS;
  private opening: Opened | null = null; // what the worker told of the bundle
  private mesh: Mesh | null = null;
  private organ = ""; // as the bundle calls it
  private parts: NamedPart[] = [];
  private fine: FineMesh | null = null; // what effects.fine draws
  private accepted: { effects: PageEffects; tool: ToolShape; fine: FineMesh | null } | null = null; // by the worker, to return to when it refuses others
  private fineFile: Promise<{ name: string; bytes: ArrayBuffer } | null>; // of the bundle that is being opened
  tool: ToolShape = DEFAULT_TOOL;
  task = new NoduleTask(byId("task"), byId("find-nodule"), {
    show: (nodules, answer, presses) => this.view.showNodules(nodules, answer, presses),
    picture: () => this.view.picture(),
    ended: () => {
      this.reset();
      this.findTwin();
    },
  });
  private guide = new Guide(byId("guide"), (scene) => void this.playServed(scene), () => this.reset());
  private twin: HealthyTwin | null = null;
  private trials: ((trial: Trial) => void)[] = []; // that the engine was asked to play
  private info: BundleInfo | null = null;
  private opened = false;
  private pressed: Hit | null = null; // the point of the last press
  private recordedSteps = 0;
  private replayed: Extract<FromWorker, { type: "replayed" }> | null = null;
  private ownName = ""; // of its file
  private ownScene: WorldScene | null = null; // that Replay plays: a scene file that holds or pierces the organ
  private link = ""; // of the page's state
  private linked = 0; // ms, when the address was last compared
  saved: Extract<FromWorker, { type: "saved" }> | null = null; // the last file
  private lastTouch = 0; // ms
  private measured = false; // or being measured: what effects cost
  private measuresLarge = false; // under large deformation too, as the user asked
  private frames = new FrameClock();
  private limit: LinearLimit | null = null;
  private field: FieldOf = "none"; // that the worker was asked for
  private linkedTo: number | null = null; // the port of the bridge of devices
  private headset: Headset;
  private cutting: Cutting;
  private wasFine = false; // before the organ could be cut
  private selfPlay = new SelfPlay(() => this.pressForShow(), () => {
    if (!this.selfPlay.isOn) this.reset();
    this.showHint();
  });

  constructor(canvas: HTMLCanvasElement, view: OrganView) {
    const worker = new Worker(new URL("./engine.worker.ts", import.meta.url), { type: "module" });
    super(canvas, view, worker, { push: "hint.push", pull: "hint.pull", scalpel: "hint.scalpel" });
    this.cutting = new Cutting(canvas, view, {
      effects: () => this.effects, send: (edge, toughness) => this.tell({ type: "blade", edge, toughness }),
      change: (effects) => this.allowCuts(effects), begins: () => this.beginCut(),
    });
    this.headset = new Headset(view, byId("headset"), {
      isOpen: isReady, tools: () => this.newest?.frame.tools ?? [], positions: () => this.newest?.shape.positions ?? null,
      send: (index, target) => this.tell({ type: "tool", index, target }), begun: () => this.reset(),
    });
    worker.addEventListener("message", ({ data }: MessageEvent<FromWorker>) => this.heard(data));
    worker.addEventListener("error", (event) => this.refuse("error.stopped", event.message || word("error.stopped.about"), 0));
    view.outlinesRest = true;
    offerLayers();
    this.connectOwn();
    this.connect(["colour-by", "show-names", "show-mesh", "show-fixed", "show-soft", "show-touchable"]);
    this.fineFile = fetched(SERVED.finer);
    this.tellLanguage();
    this.tell({ type: "fetch", url: SERVED.bundle });
  }

  protected pointing() {
    return {
      followsDeformed: () => this.effects.collision === "deformed",
      isIdle: () => this.cutting.isOn,
      depth: () => (this.task.isOn ? TASK_DEPTH : null),
      pressed: (hit: Hit) => {
        this.pressed = hit;
        if (this.newest?.frame.playing != null) this.endScene();
        this.ownScene = null;
        this.selfPlay.end();
        void this.task.press(hit.place, () => this.stiffnessAt(hit));
        byId("hint").classList.add("done");
        if (!this.newest?.frame.tools.some(Boolean)) this.plot.clear();
      },
    };
  }

  protected get isOpen() {
    return this.opened;
  }

  private heard(message: FromWorker) {
    if (message.type === "frame") return this.take(message);
    if (message.type === "progress") return this.progress(message.done, message.total);
    if (message.type === "costs") return this.showCosts(message);
    if (message.type === "opened") return void this.open(message);
    if (message.type === "accepted") return void (this.accepted = { effects: message.effects, tool: message.tool, fine: this.fine });
    if (message.type === "replayed") return this.afterReplay(message);
    if (message.type === "played") return this.afterScene(message.forces);
    if (message.type === "saved") return this.saveFile(message);
    if (message.type === "tried") return this.trials.shift()?.(message.trial);
    if (message.type === "linked") return this.showLink(message);
    if (message.type !== "refused") return; // the answers that Compare asks for
    if (message.what === "absent") return this.absent(message.name);
    if (message.what === "download") return this.refuse("error.download", word("error.download.about", { url: message.name, why: message.message }), 0);
    if (message.what === "scene") return this.tellUser(word("notice.refused", { name: this.ownName, why: message.message }));
    if (message.what === "effects") return this.refuseEffects(message.message);
    this.refuse(message.what === "bundle" ? "error.bundle" : "error.runtime", message.message, message.byteOffset);
  }

  // ---- opening -------------------------------------------------------------------------------------------------------

  private absent(url: string) {
    state(this.opened ? "ready" : "empty");
    if (SERVED.isNamed) this.tellUser(word("notice.absent", { url }));
  }

  private async open(opening: Opened) {
    const { mesh, name, nodules, info, provenance } = opening;
    this.opened = true;
    this.opening = opening;
    this.info = info;
    this.mesh = mesh;
    this.effects = DEFAULT_EFFECTS;
    this.tool = DEFAULT_TOOL;
    this.buffer = this.newest = this.pressed = this.replayed = this.ownScene = null;
    this.recordedSteps = 0;
    this.measured = this.measuresLarge = false;
    this.pointer.forget();
    this.plot.clear();
    this.view.open(mesh, String(provenance.frame));
    this.parts = partsOf(mesh, provenance);
    input("show-names").disabled = !this.parts.length;
    byId("show-names").closest(".line")!.classList.toggle("absent", !this.parts.length);
    this.cutting.open(info.hasCut);
    this.showChoices();
    this.fine = null;
    this.accepted = { effects: this.effects, tool: this.tool, fine: null };
    this.showEffects();
    this.task.open(nodules);
    this.showFacts();
    const hasInside = mesh.tetrahedra.length > 0;
    for (const [id, isThere] of [["show-soft", mesh.soft.length > 0], ["section", hasInside]] as const) {
      input(id).disabled = !isThere;
      byId(id).closest(".line")!.classList.toggle("absent", !isThere);
    }
    byId("section-absent").hidden = hasInside;
    if (!hasInside) byId<HTMLSelectElement>("section").value = "none";
    this.cut();
    this.limit = linearLimit(provenance, mesh.positions);
    this.tellUser("");
    byId("hint").classList.remove("done");
    const file = await this.fineFile;
    if (file) this.drawFine(file.name, file.bytes);
    state("ready");
    this.lastTouch = performance.now();
    this.followLink(!this.link);
    if (location.search.includes("device=") && this.linkedTo === null) this.connectDevices(BRIDGE);
    this.guide.end();
    if (STARTS_TASK && this.task.canStart) this.task.start();
    else if (STARTS_CASE && name === SERVED.bundle) {
      if (STARTS_CASE.view) this.view.camera.homeAt(...STARTS_CASE.view);
      this.guide.begin(STARTS_CASE);
    }
    else if (this.linkedTo === null && !this.pointer.kept.some(Boolean)) this.selfPlay.begin();
  }

  // Restores what the page's address holds, where it was made with this bundle or for any bundle.
  // isGiven: by the user; else it may be what the page wrote for the bundle before.
  private followLink(isGiven: boolean) {
    const made = bundleOfLink(location.hash), now = this.pageState();
    if (isGiven && made && made !== now.bundle) this.tellUser(word("notice.other-link"));
    if (location.hash && (!made || made === now.bundle)) this.restore(stateOfLink(location.hash, now, (effect) => isAvailable(effect, this.info!, this.fine !== null)));
    this.link = linkOf(this.pageState());
    history.replaceState(history.state, "", this.link);
    keepInAddress();
    this.showUndo();
  }

  private restoreTools(tools: (ToolTarget | null)[]) {
    this.pointer.forget();
    this.plot.clear();
    this.tell({ type: "reset" });
    if (!tools.some(Boolean)) return;
    input("keep").checked = true;
    this.pointer.keep(tools);
  }

  private restore({ effects, discRadius, colour, view, tools }: PageState) {
    const changed = JSON.stringify([effects, discRadius]) !== JSON.stringify([this.effects, this.tool.discRadius]);
    this.tool = { ...this.tool, discRadius };
    if (changed) this.changeEffects(effects);
    const now = this.pageState();
    if (changed || linkOf({ ...now, tools }) !== linkOf(now)) this.restoreTools(tools);
    this.showEffects();
    byId<HTMLSelectElement>("colour-by").value = colour;
    this.showChoices();
    this.view.camera.view = view;
  }

  private pageState(): PageState {
    const colour = byId<HTMLSelectElement>("colour-by").value as ColourBy, { effects, tool: { discRadius } } = this;
    return { bundle: hexadecimal(this.info!.identity), effects, discRadius, colour, view: this.view.camera.view, tools: this.pointer.kept };
  }

  // Keeps the address up to date. A change of effects, of kept tools, of disc or colour makes a step of the browser's history, which Undo
  // takes back; turning the camera does not. A step's state is its number in this page.
  private keepLink(now: number) {
    if (now - this.linked < 500 || this.pointer.active || document.body.dataset.state !== "ready") return;
    this.linked = performance.now();
    const link = linkOf(this.pageState());
    if (link === this.link) return;
    const withoutView = (one: string) => one.replace(/&view=.*/, "");
    if (withoutView(link) === withoutView(this.link)) history.replaceState(history.state, "", link);
    else history.pushState(Number(history.state ?? 0) + 1, "", link);
    this.link = link;
    this.showUndo();
  }

  private showUndo() {
    byId<HTMLButtonElement>("undo").disabled = !history.state;
  }

  // What was not yet a step becomes one first.
  protected undo() {
    this.keepLink(Infinity);
    if (history.state) history.back();
  }

  // Opens a finer surface for the open organ. What is drawn stays where the file is refused.
  private drawFine(name: string, bytes: ArrayBuffer) {
    try {
      this.fine = readFineMesh(bytes, this.mesh!, this.view.quality);
    } catch (error) {
      return this.tellUser(word("notice.fine-refused", { name, why: (error as Error).message }));
    }
    this.tellUser("");
    this.view.openFine(this.fine);
    this.changeEffects({ ...this.effects, fine: true }, true);
    this.showEffects();
  }

  private showFacts() {
    const { provenance, info, bytes, simd } = this.opening!, { boundary: where, element } = provenance;
    this.organ = String(provenance.organ ?? word("page.organ-name"));
    const name = named(this.organ);
    byId("name").textContent = name;
    document.title = `${name} – Palpate`;
    // Soft supports hold without fixing a node, so that the held region does not show them.
    const soft = Object.keys(provenance).flatMap((key) => /^(?:foundation|spring) (.+)$/.exec(key)?.[1] ?? []).map(named).join(", ");
    byId("facts").textContent = [
      word("facts.nodes", { count: count(info.nodeCount), touchable: count(info.touchableCount) }),
      where && word(soft ? "facts.held-softly" : "facts.held", { where: named(String(where)), soft }),
      ELEMENTS.includes(String(element)) ? word(`facts.element.${element}` as Key) : element, `${decimal(megabytes(bytes))} MB`, simd ? "" : word("facts.no-simd"),
      this.effects.fine && this.fine ? word("facts.drawn", { count: count(this.fine.triangles.length / 3) }) : "",
    ].filter(Boolean).join(" · ");
  }

  private showEffects() {
    input("radius").value = String(1000 * this.tool.discRadius);
    this.showRadius();
    this.effectsPanel.open(this.effects, (effect) => isAvailable(effect, this.info!, this.fine !== null));
  }

  private refuse(title: Key, text: string, byteOffset: number) {
    byId("error-title").dataset.words = title;
    byId("error-title").textContent = word(title);
    this.showError(text, byteOffset);
  }

  private refuseEffects(why: string) {
    this.tellUser(why);
    if (!this.accepted || !this.info) return;
    const drew = this.fine !== this.accepted.fine;
    Object.assign(this, this.accepted);
    if (drew) this.view.openFine(this.fine);
    if (["von-mises", "pressure"].includes(this.field) && !this.effects.inside) {
      byId<HTMLSelectElement>("section-field").value = "none"; // elements whose stress the runtime refuses
      this.cut();
    }
    if (this.effects.cut && byId<HTMLSelectElement>("section").value !== "none") {
      byId<HTMLSelectElement>("section").value = "none";
      this.cut();
    }
    this.cutting.follow();
    this.showEffects();
    this.showFacts();
  }

  // Files that the user drops: a bundle, perhaps with a finer surface; or a finer surface or a path for the open organ.
  protected async openFiles(files: Iterable<File>) {
    const all = [...files], ending = (ends: string) => all.find((file) => file.name.toLowerCase().endsWith(ends));
    const scene = ending(".toml"), path = scene ?? ending(".csv"), others = scene ? namesOf(await scene.text()) : [];
    const named = all.filter((file) => file !== path && (file.name.toLowerCase().endsWith(".csv") || others.includes(file.name)));
    const fine = all.find((file) => file.name.toLowerCase().endsWith(".ply") && !named.includes(file));
    const bundle = all.find((file) => file !== path && file !== fine && !named.includes(file));
    const bytes = fine?.arrayBuffer().catch(() => new ArrayBuffer(0));
    if (bundle) {
      this.fineFile = Promise.resolve(bytes && bytes.then((given) => ({ name: fine!.name, bytes: given }))).then((file) => file ?? null);
      return this.openBundle(bundle);
    }
    const other = fine ?? path;
    if (!this.opened) return other && this.tellUser(word(fine ? "notice.fine-first" : "notice.path-first", { name: other.name }));
    if (bytes) this.drawFine(fine!.name, await bytes);
    if (path) return this.playPath(path, named);
  }

  private async openBundle(file: File) {
    this.progress(0, 0);
    byId("progress-text").textContent = file.name;
    const bytes = await file.arrayBuffer().catch(() => null);
    if (!bytes) return this.refuse("error.unreadable", word("error.unreadable.about", { name: file.name }), 0);
    this.tell({ type: "open", name: file.name, bytes }, [bytes]);
  }

  // ---- doing ---------------------------------------------------------------------------------------------------------

  // The finer surface comes back with the whole organ.
  private withFine(effects: PageEffects): PageEffects {
    if (effects.cut && !this.effects.cut) this.wasFine = !!this.effects.fine;
    return this.effects.cut && !effects.cut && this.wasFine && this.fine ? { ...effects, fine: true } : effects;
  }

  // The scalpel is taken. What a cut does not leave right is off from now on, and the page says so.
  private allowCuts(effects: PageEffects) {
    byId<HTMLSelectElement>("section").value = "none";
    this.changeEffects(effects);
    this.cut();
    this.showEffects();
    this.tellUser(word("notice.cut"));
  }

  // In the list of effects, which shows what the cut has switched.
  private chooseEffects(effects: PageEffects) {
    const was = !!this.effects.cut;
    if (effects.cut && !was) this.allowCuts(effects);
    else this.changeEffects(effects);
    if (was === !!effects.cut) return;
    this.showEffects();
    document.querySelector<HTMLElement>('[data-effect="cut"]')!.focus();
  }

  private beginCut() {
    this.ownScene = null;
    this.selfPlay.end();
    byId("hint").classList.add("done");
  }

  // otherMesh: the finer mesh is another one.
  private changeEffects(wanted: PageEffects, otherMesh = false) {
    const effects = (this.effects = this.withFine(wanted));
    this.cutting.follow();
    this.showFacts();
    this.measured = this.measuresLarge = false;
    this.pointer.forget();
    const mesh = otherMesh && this.fine ? { positions: this.fine.positions, normals: this.fine.normals, parents: this.fine.parents } : undefined;
    this.tell({ type: "effects", effects, tool: this.tool, mesh });
  }

  // named: files that a scene may name.
  private async playPath(file: File, named: File[] = []) {
    try {
      const text = await file.text();
      if (file.name.toLowerCase().endsWith(".toml")) return this.playScene(text, file.name, await sceneFiles(named));
      const path = pathOfFile(text);
      checkPlaceOfPath(path, this.mesh!.positions);
      this.replay(path);
    } catch (error) {
      this.tellUser(word("notice.refused", { name: file.name, why: (error as Error).message }));
    }
  }

  // A scene that the server has.
  private async playServed(url: string) {
    const file = await fetched(new URL(url, location.href).href);
    if (file) return this.playPath(new File([file.bytes], file.name));
    this.guide.end();
    this.tellUser(word("notice.no-scene", { url }));
  }

  // A scene file: its effects and its tools' disc become the page's.
  private playScene(text: string, name: string, files: SceneFiles) {
    const bundle = bundleOfScene(text), open = hexadecimal(this.info!.identity);
    if (bundle && bundle !== open) throw new Error(word("scene.other-bundle", { bundle, open }));
    const own = readOwn(text, this.organ, files);
    this.ownName = name;
    if (own) return this.playOwn(own);
    const { effects, tool, path } = readScene(text, this);
    const missing = EFFECT_LINES.find((line) => line.value(effects) !== line.value(DEFAULT_EFFECTS) && line.effect !== "fine" && !isAvailable(line.effect, this.info!, false));
    if (missing) throw new Error(word("scene.no-data", { effect: word(`effect.${missing.effect}`) }));
    checkPlaceOfPath(path, this.mesh!.positions);
    this.tool = tool;
    this.changeEffects({ ...effects, inside: this.effects.inside });
    this.showEffects();
    this.replay(path);
  }

  // A scene file that holds or pierces the organ, under its own effects; then the pointer touches under the page's.
  private playOwn(scene: WorldScene) {
    this.ownScene = scene;
    this.obstacles = scene.obstacles;
    this.played = null;
    this.clear();
    this.tell({ type: "scene", scene });
  }

  // The user takes the organ from a scene that plays.
  private endScene() {
    this.tell({ type: "reset" });
    this.tellUser("");
    this.guide.show(null);
  }

  // Where one sees the dent from the side.
  private pressForShow() {
    const hit = this.front();
    if (hit) this.tell({ type: "replay", path: demonstration(hit.place, hit.normal, Math.min(SHOWN_DEPTH, this.limit?.depth ?? Infinity)) });
  }

  protected get playsItself() {
    return this.selfPlay.isOn;
  }

  protected replay(path: Path | null = null) {
    if (!this.opened) return;
    if (!path && this.ownScene) return this.playOwn(this.ownScene);
    this.ownScene = null;
    this.clear();
    if (!path && !this.recordedSteps) {
      const hit = this.pressed ?? this.front();
      if (hit) path = demonstration(hit.place, hit.normal);
    }
    this.tell({ type: "replay", path });
  }

  // For what is to be played.
  private clear() {
    this.pointer.forget();
    this.plot.clear();
    this.tellUser("");
    byId("hint").classList.add("done");
  }

  private afterReplay(message: Extract<FromWorker, { type: "replayed" }>) {
    this.replayed = message;
    if (!message.touched) this.tellUser(word("notice.never-met", { away: fixed(1000 * message.nearest, 1) }));
  }

  // Of a scene whose tools felt nothing: it may be another organ's.
  private afterScene(forces: Float64Array) {
    this.played = forces;
    this.guide.ended(largestOf(forces));
    if (this.ownScene?.tools.length && forces.every((force) => force === 0)) this.tellUser(word("notice.scene-never-met", { name: this.ownName }));
  }

  private saveFile(saved: Extract<FromWorker, { type: "saved" }>) {
    this.saved = saved;
    save(saved.as === "scene" ? "recording.toml" : "forces.csv", saved.text);
  }

  // ---- a healthy organ beside it, for the task ------------------------------------------------------------------------

  // Once, when a task begins; without one at the server, presses are not compared.
  private findTwin() {
    const address = twinOf(SERVED.bundle);
    if (address && !this.twin) this.twin = new HealthyTwin(address, () => this.mesh && this.twin!.isOf(this.mesh) && this.task.compares());
    else if (this.mesh && this.twin?.isOf(this.mesh)) this.task.compares();
  }

  // Force over depth of a press there, and in the healthy organ. Large deformation would take the engine's time from the touch.
  private async stiffnessAt({ place, normal }: Pick<Hit, "place" | "normal">): Promise<Stiffness | null> {
    const { twin, effects } = this;
    if (!this.mesh || effects.deformation !== "linear") return null;
    const path = trialPress(place, normal, TASK_DEPTH), mine = new Promise<Trial>((done) => this.trials.push(done));
    this.tell({ type: "try", path });
    const theirs = twin?.isOf(this.mesh) ? twin.plays(path, effects, this.tool) : null;
    const [here, healthy] = (await Promise.all([mine, theirs])).map((trial) => trial && largestForce(trial, TOOL_COUNT) / (1000 * TASK_DEPTH));
    return { here: here!, healthy: healthy || null };
  }

  // The names of what holds the organ.
  private showNames() {
    const parts = isOn("show-names") ? this.parts : [];
    showFigures(byId("names"), parts.map(({ name, places }) => ({ text: named(name), at: this.view.places(places).find(Boolean) ?? null })));
  }

  // The map of past presses.
  private showPresses() {
    const { presses } = this.task, at = this.view.places(presses.map(({ place }) => place));
    showFigures(byId("presses"), presses.map(({ found }, p) => ({ text: found && decimal(found.here.toFixed(3)), at: at[p] })));
  }

  private front(): Hit | null {
    return this.view.front(this.mesh!.touchable);
  }

  protected reset() {
    this.pointer.forget();
    this.plot.clear();
    this.endScene();
  }

  private connectOwn() {
    this.click("replay", () => this.replay());
    this.click("undo", () => this.undo());
    this.click("measure", () => {
      this.measured = !(this.measuresLarge = true);
    });
    this.click("device", () => this.connectDevices(this.linkedTo === null ? BRIDGE : null));
    this.click("open", () => byId("file").click());
    this.click("open-path", () => byId("path-file").click());
    this.click("save-scene", () => this.tell({ type: "save", as: "scene" }));
    this.click("compare", () => (location.href = compareAddress(this.effects, this.tool)));
    this.click("save-forces", () => this.tell({ type: "save", as: "forces" }));
    for (const id of ["section", "section-field"]) byId(id).addEventListener("change", () => this.cut());
    byId("section-at").addEventListener("input", () => this.cut());
    byId("radius").addEventListener("input", () => this.showRadius());
    byId("radius").addEventListener("change", () => this.changeEffects(this.effects));
    window.addEventListener("popstate", () => this.opened && this.followLink(true));
  }

  private tellLanguage() {
    this.tell({ type: "language", name: document.documentElement.lang });
  }

  protected translate() {
    this.tellLanguage();
    this.tellUser("");
    this.showRecorded();
    if (!this.opened) return;
    this.showFacts();
    this.showEffects();
    this.measured = false;
    this.task.show();
    this.guide.show(null);
    this.showChoices();
  }

  protected letGo() {
    this.pointer.forget();
    if (this.effects.cut) for (let index = 0; index < TOOL_COUNT; ++index) this.tell({ type: "withdraw", index });
    else this.tell({ type: "reset" }); // which makes the organ whole
  }

  // port: of the bridge; null: lets the devices go.
  private connectDevices(port: number | null) {
    this.linkedTo = port;
    byId("device").setAttribute("aria-pressed", String(port !== null));
    byId("linked").textContent = "";
    this.tell({ type: "link", port });
  }

  private showLink({ state: now, tools }: Extract<FromWorker, { type: "linked" }>) {
    byId("linked").textContent = now === "open" && tools.length ? word("devices.link.tools", { tools: tools.join(", ") }) : word(`devices.link.${now}`);
    if (now !== "open") this.linkedTo = null;
    byId("device").setAttribute("aria-pressed", String(now === "open"));
  }

  // ---- showing -------------------------------------------------------------------------------------------------------

  private showRadius() {
    this.tool = { ...this.tool, discRadius: Number(input("radius").value) / 1000 };
    byId("radius-mm").textContent = `${decimal(1000 * this.tool.discRadius)} mm`;
  }

  protected showChoices() {
    this.tell({ type: "colour", by: this.showDrawn(isOn("show-soft")) });
  }

  // A section needs the places of the inner nodes; a stress on it needs the effect `inside`, which is on only while it is shown.
  private cut() {
    const axis = byId<HTMLSelectElement>("section").value as SectionAxis;
    byId("section-place").hidden = byId("field-control").hidden = axis === "none";
    const field = axis === "none" ? "none" : (byId<HTMLSelectElement>("section-field").value as FieldOf);
    const shape = axis === "none" ? this.effects.shape : "volume", inside = field === "von-mises" || field === "pressure";
    if (shape !== this.effects.shape || inside !== !!this.effects.inside) {
      const { kept } = this.pointer;
      this.changeEffects({ ...this.effects, shape, inside });
      this.showEffects();
      if (kept.some(Boolean)) this.restoreTools(kept);
    }
    if (field !== this.field) this.tell({ type: "field", of: (this.field = field) });
    this.view.cut(axis, Number(input("section-at").value) / 100);
    if (this.newest) this.view.move(this.newest.shape);
  }

  protected draw() {
    const start = performance.now();
    this.headset.tick();
    this.selfPlay.tick(start, this.newest?.frame.replaying ?? false);
    this.moveOn(start, this.effects.contact === "patch" ? this.tool.discRadius : 0);
    this.view.moveBlades(this.newest?.frame.cut?.edges ?? []);
    const drawn = this.view.render();
    if (drawn || this.task.presses.length !== byId("presses").children.length) this.showPresses();
    if (drawn) this.showNames();
    this.plot.draw();
    if (drawn) this.frames.add(start, performance.now());
    else this.frames.pause();
    this.keepLink(start);
    if (!this.measured && start - this.lastTouch > QUIET) this.measure();
  }

  private take(frame: Frame) {
    const { inside, vertices } = frame;
    if (!this.takes(frame, this.info?.surfaceNodeCount ?? 0, inside, vertices, (this.fine?.positions.length ?? 0) / 3)) return;
    if (frame.changed) this.newest!.shape.field = frame.field;
    if (frame.surface !== undefined) this.view.showCut(frame.surface);
    this.cutting.show(frame.cut);
    this.recordedSteps = frame.recordedSteps;
    this.plot.add(frame.samples);
    this.numbers(frame);
  }

  protected numbers(frame: Frame) {
    const tools = frame.tools.filter((tool) => tool !== null);
    if (tools.length || frame.replaying || this.cutting.active) this.lastTouch = performance.now();
    super.numbers(frame, tools.length > 0, frame.replaying && frame.playing === null);
    if (frame.playing === null) this.showTrust(Math.max(0, ...tools.map((tool) => tool.depth)));
    else byId("trust").textContent = playedWords(frame, this.pace.share);
    if (frame.playing !== null) this.guide.show(frame.playing);
    this.showRecorded();
    byId("replay").toggleAttribute("disabled", frame.replaying);
    this.showFieldLegend();
    byId("frame-ms").textContent = fixed(this.frames.median, 1);
    byId("frame-rate").textContent = word("times.per-second", { count: this.frames.rate.toFixed(0) });
  }

  private showFieldLegend() {
    const { most, of } = this.view.section;
    byId("field-legend").hidden = of === "none";
    if (of === "none") return;
    const unit = of === "displacement" ? "mm" : most >= 1000 ? "kPa" : "Pa", end = unit === "mm" ? 1000 * most : unit === "kPa" ? most / 1000 : most;
    const [high, middle, low] = of === "pressure" ? [end, 0, -end] : [end, end / 2, 0];
    byId("field-name").textContent = word(`legend.field.${of}`);
    byId("field-ramp").style.background = of === "pressure" ? SIGNED_GRADIENT : FIELD_GRADIENT;
    byId("field-most").textContent = brief(high);
    byId("field-middle").textContent = brief(middle);
    byId("field-least").textContent = `${brief(low)} ${unit}`;
  }

  // What the forces are, and up to which depth they can be trusted.
  private showTrust(depth: number) {
    const { force, deformation } = this.effects, note = byId("trust"), { limit } = this;
    const linear = deformation === "linear" && force !== "response";
    const said: Record<string, unknown> = this.opening?.provenance ?? {};
    note.textContent = [
      linear && limit ? word(limit.rule, { depth: brief(1000 * limit.depth) }) : force === "response" ? word("trust.response") : "",
      Number(said.element_probes) > 0 ? word("trust.element", { percent: brief(100 * Number(said.element_excess_median)) }) : "",
    ].filter(Boolean).join(" ");
    note.classList.toggle("beyond", linear && !!limit && depth > limit.depth);
  }

  // What Replay plays and the files hold.
  private showRecorded() {
    const none = this.recordedSteps === 0, seconds = fixed(this.recordedSteps / TOUCH_HZ, 1);
    for (const id of ["save-scene", "save-forces"]) byId<HTMLButtonElement>(id).disabled = none;
    byId("recorded").textContent = none ? word(this.effects.cut ? "files.cut" : "files.nothing") : word("files.recorded", { seconds });
  }

  private measure() {
    const hit = this.pressed ?? this.front();
    if (!hit || document.hidden) return;
    this.measured = true;
    this.tell({ type: "measure", place: hit.place, normal: hit.normal, large: this.measuresLarge });
  }

  private showCosts({ costs, left, interrupted }: Extract<FromWorker, { type: "costs" }>) {
    this.effectsPanel.showCosts(costs);
    byId("measuring").textContent = left ? word("effects.measuring", { left }) : "";
    byId("measure-control").hidden = !this.info?.hasLarge || costs.some(({ effect }) => effect === "large") || this.measuresLarge;
    if (interrupted) this.measured = false;
  }

  // What the page shows now, for scripts.
  get shown() {
    const shape = this.newest?.shape;
    return { positions: shape?.positions ?? null, inside: (shape?.inside.length ?? 0) / 3, section: this.view.section.area, field: shape?.field ?? null, fieldMost: this.view.section.most, fine: shape?.fine ?? null, tools: this.newest?.frame.tools ?? [], engineBytes: this.newest?.frame.engineBytes ?? 0, replaying: this.newest?.frame.replaying ?? false, playing: this.newest?.frame.playing ?? null, holds: this.newest?.frame.holds ?? [], links: this.newest?.frame.links ?? [], obstacles: this.newest?.frame.obstacles ?? [], cut: this.newest?.frame.cut ?? null, triangles: this.view.triangles, played: this.played, replayed: this.replayed, curves: this.plot.traces.map((trace) => trace.curves) };
  }
}

// Compare with this page's setting on both sides.
function compareAddress(effects: PageEffects, { discRadius }: ToolShape): string {
  const words = String(new URLSearchParams(wordsOfEffects({ ...effects, cut: false })));
  return `compare.html${location.search}#${new URLSearchParams({ a: words, b: words, disc: String(1000 * discRadius) })}`;
}

const hexadecimal = (identity: bigint) => identity.toString(16).padStart(16, "0");
begin("palpateViewer", (canvas, view) => new Viewer(canvas, view)); // for scripts: see `shown`
