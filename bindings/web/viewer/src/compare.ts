// Compare: the same press or pull under two settings, two organs side by side from one camera, the two curves, and the difference.
import { roundUp } from "./colours";
import { CompareSide } from "./compare_side";
import { Cross } from "./cross";
import { DEFAULT_TOOL } from "./effects";
import { byId, element, input, mode } from "./elements";
import { ForcePlot } from "./force_plot";
import { largestOf } from "./geometry";
import { Keys } from "./keys";
import { wordsOfEffects } from "./links";
import { TOOL_COUNT, TOUCH_HZ, type Path, type Times, type Trial } from "./messages";
import { demonstration, demonstrationOfPull } from "./path_files";
import { readyComparisons, type ReadyComparison } from "./ready_comparisons";
import { fetched, servedBundles, servedFiles, type ServedBundle } from "./served";
import { namesOf } from "./side_names";
import { NearestPoints } from "./surface_difference";
import { brief, chosenLanguage, decimal, fixed, keepInAddress, offerLanguages, speak, threeDigits, word, type Key } from "./words";

const LONGEST = 30 * TOUCH_HZ; // steps of a touch that are compared
const LEAST_MOST = 0.002; // m: the palest colour stands for this much at least
const DISCS = ["radius", "radius-b"]; // the sliders of A and B
const SAMPLES_APART = 1000; // contacts of two tools are different curves

const pulls = () => mode("pull").checked;
const address = new URLSearchParams(location.hash.slice(1));

class Compare {
  readonly sides: CompareSide[];
  path: Path | null = null; // what both played
  differences: { largestForce: number; largest: number; rms: number } | null = null; // N, m, m
  private plot = new ForcePlot(byId<HTMLCanvasElement>("plot"), ["A", "B"], "deepest");
  private leader = 0; // the side whose camera the other one follows
  private touching: CompareSide | null = null; // the side that the user presses
  private nearest: { points: NearestPoints; of: unknown; on: unknown } | null = null;
  private trying = false;
  private served: ServedBundle[] = [];
  private wanted: ReadyComparison | null = null; // whose press follows when both bundles are open
  private seen: Key | null = null; // what the comparison that was played shows
  private again = false; // something changed while both were tried

  constructor() {
    const { bundle, finer, isNamed } = servedFiles();
    const renderMesh = fetched(finer).then((file) => file && file.bytes);
    const bundles = [[bundle], isNamed ? [bundle] : [new URL("bundle-b.h5", location.href).href, bundle]];
    byId<HTMLAnchorElement>("viewer").search = location.search;
    this.sides = (["A", "B"] as const).map((letter, index) => this.side(letter, index, renderMesh));
    DISCS.forEach((id, side) => {
      input(id).value = (side && address.get("discb")) || address.get("disc") || String(1000 * DEFAULT_TOOL.discRadius);
      byId(id).addEventListener("input", () => this.showRadius());
      byId(id).addEventListener("change", () => this.setRadius());
    });
    this.setRadius();
    void servedBundles().then((served) => {
      this.served = served;
      this.offerReady();
    });
    bundles.forEach((urls, i) => this.sides[i].fetch(urls));
    byId("press").addEventListener("click", () => this.press());
    byId("whole").addEventListener("click", () => this.lead.view.camera.home());
    for (const choice of document.querySelectorAll('input[name="mode"]')) choice.addEventListener("change", () => this.chooseMode());
    offerLanguages(() => this.translate());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.dress());
    this.connectKeys();
    this.dress();
    requestAnimationFrame(() => this.draw());
  }

  private side(letter: "A" | "B", index: number, renderMesh: Promise<ArrayBuffer | null>): CompareSide {
    const root = (byId<HTMLTemplateElement>("side").content.cloneNode(true) as DocumentFragment).firstElementChild as HTMLElement;
    byId("sides").append(root);
    return new CompareSide(root, letter, address.get(letter.toLowerCase()) ?? "", renderMesh, {
      opened: () => this.opened(), changed: () => this.changed(), pulls,
      send: (tool, target) => {
        this.touching = this.sides[index];
        for (const side of this.sides) side.place(tool, target);
      },
      withdraw: (tool) => this.sides.forEach((side) => side.withdraw(tool)),
      leads: () => (this.leader = index),
    });
  }

  private get lead() {
    return this.sides[this.leader];
  }

  private get areOpen() {
    return this.sides.every((side) => side.mesh);
  }

  private opened() {
    this.nearest = null;
    document.body.dataset.state = this.areOpen ? "ready" : "loading";
    this.keepAddress();
    this.name();
    this.offerReady();
    if (this.areOpen && this.wanted) this.pressTo(this.wanted);
  }

  // The names of both sides.
  private name() {
    const names = this.areOpen ? namesOf(this.sides.map((side) => side.setting)) : this.sides.map(() => "");
    this.sides.forEach((side, i) => side.call(names[i]));
    names.forEach((name, i) => (byId(`name-${"ab"[i]}`).textContent = name ? `${"AB"[i]}: ${name}` : "AB"[i]));
  }

  // ---- comparisons at one click ---------------------------------------------------------------------------------------

  private offerReady() {
    if (!this.areOpen) return;
    const ready = readyComparisons(this.sides[0].info!.hasLarge, this.served, this.sides[0].address);
    byId("ready").replaceChildren(...ready.map((one) => {
      const button = element("button", { type: "button" }, word(one.name));
      button.addEventListener("click", () => this.begin(one));
      return button;
    }));
  }

  // Both sides take the settings of a comparison, then both are pressed.
  private begin(ready: ReadyComparison) {
    const { effects, discs, bundles } = ready;
    mode("push").checked = true;
    this.chooseMode();
    DISCS.forEach((id, side) => (input(id).value = String(discs[side])));
    this.showRadius();
    this.sides.forEach((side, i) => side.useEffects(effects[i], discs[i] / 1000));
    const wanted = bundles ?? this.sides.map(() => this.sides[0].address), others = this.sides.filter((side, i) => !side.address.endsWith(wanted[i]));
    this.wanted = others.length ? ready : null;
    if (!others.length) return this.pressTo(ready);
    for (const side of others) {
      side.mesh = null;
      side.fetch([new URL(wanted[this.sides.indexOf(side)], location.href).href]);
    }
  }

  private pressTo({ depth, at, seen }: ReadyComparison) {
    this.wanted = null;
    const [{ view, mesh }] = this.sides, hit = at === "end" ? view.end(mesh!.touchable) : view.front(mesh!.touchable);
    this.seen = seen ?? null;
    if (hit) void this.try(demonstration(hit.place, hit.normal, depth));
  }

  private changed() {
    this.differences = null;
    this.keepAddress();
    this.name();
    if (this.path) void this.try(this.path);
  }

  // Returns the radii, mm.
  private showRadius(): number[] {
    return DISCS.map((id) => {
      const mm = Number(input(id).value);
      byId(`${id}-mm`).textContent = `${decimal(mm)} mm`;
      return mm;
    });
  }

  private setRadius() {
    this.showRadius().forEach((mm, i) => this.sides[i].change(this.sides[i].effects, { ...DEFAULT_TOOL, discRadius: mm / 1000 }));
  }

  // The address holds both settings; opened again, it restores them.
  private keepAddress() {
    if (!this.areOpen) return;
    const words = new URLSearchParams(this.sides.map(({ effects }, i) => ["ab"[i], String(new URLSearchParams(wordsOfEffects(effects)))]));
    const [disc, other] = DISCS.map((id) => input(id).value);
    words.set("disc", disc);
    if (other !== disc) words.set("discb", other);
    history.replaceState(null, "", `#${words}`);
  }

  // Pushes or pulls from now on; what was played before is of the other mode.
  private chooseMode() {
    this.path = this.seen = null;
    byId("press").dataset.words = pulls() ? "compare.pull" : "compare.press";
    byId("press").textContent = word(pulls() ? "compare.pull" : "compare.press");
  }

  // What the page's words cannot fill by themselves.
  private translate() {
    this.showRadius();
    for (const side of this.sides) side.translate();
    this.name();
    this.offerReady();
    const [a, b] = this.sides.map((side) => side.trial);
    if (this.differences && a && b) this.show(a.of, b.of);
  }

  // The last touch again, or else a press, or a pull, where one sees the dent from the side.
  private press() {
    if (!this.areOpen || this.sides.some((side) => side.touched)) return;
    const [a] = this.sides, hit = a.view.front(a.mesh!.touchable);
    const path = this.path ?? (hit && (pulls() ? demonstrationOfPull : demonstration)(hit.place, hit.normal));
    if (path) void this.try(path);
  }

  // One side after the other, so that neither takes time from the other one.
  private async try(path: Path): Promise<void> {
    this.path = path;
    this.again = this.trying;
    if (this.trying) return;
    this.trying = true;
    byId("about").textContent = word("compare.playing");
    for (const side of this.sides) await side.try(path);
    this.trying = false;
    if (this.again) return this.try(this.path);
    this.compare();
  }

  private compare() {
    const [a, b] = this.sides, [first, second] = this.sides.map((side) => side.trial);
    if (!first || !second) return;
    if (this.nearest?.of !== a.mesh || this.nearest?.on !== b.mesh) this.nearest = { points: new NearestPoints(a.mesh!, b.mesh!), of: a.mesh, on: b.mesh };
    const { largest, rms } = this.nearest!.points.difference(first.shape.positions, second.shape.positions, b.mesh!.positions);
    this.differences = { largestForce: largestDifference(first.of.forces, second.of.forces), largest, rms };
    this.show(first.of, second.of);
  }

  private show(a: Trial, b: Trial) {
    this.plot.clear();
    [a, b].forEach((trial, i) => this.plot.add(trial.samples.map((sample) => ({ ...sample, tool: i, contact: sample.contact + SAMPLES_APART * sample.tool }))));
    const { largestForce, largest, rms } = this.differences!, [before, after] = this.sides;
    const moved = this.sides.map((side) => largestMove(side.trial!.shape.positions, side.mesh!.positions));
    const forces = [a, b].map((trial) => Math.max(0, ...trial.tools.map((tool) => (tool ? Math.hypot(...tool.force) : 0))));
    const most = largestOf(a.forces);
    byId("rows").replaceChildren(
      row("compare.row.force", forces.map((x) => `${fixed(x, 3)} N`), `${signed(forces[1] - forces[0], 3)} N ${share(forces[1] - forces[0], forces[0])}`),
      row("compare.row.largest-force", ["", ""], `${fixed(largestForce, 3)} N ${share(largestForce, most, false)}`),
      row("compare.row.displacement", moved.map((x) => `${fixed(1000 * x, 2)} mm`), `${signed(1000 * (moved[1] - moved[0]), 2)} mm ${share(moved[1] - moved[0], moved[0])}`),
      row("compare.row.surface", ["", ""], `${fixed(1000 * largest, 2)}; ${fixed(1000 * rms, 2)} mm ${share(largest, moved[0], false)}`),
      row("compare.row.touch", [times(a.touchUs), times(b.touchUs)], ratio(a.touchUs, b.touchUs)),
      row("compare.row.shape", [times(a.shapeUs), times(b.shapeUs)], ratio(a.shapeUs, b.shapeUs)),
      row("compare.row.size", [before, after].map((side) => `${fixed(side.bytes / 1e6, 1)} MB`), `× ${brief(after.bytes / before.bytes)}`));
    const { farthest } = this.nearest!.points;
    byId("about").textContent = [this.seen ? word(this.seen) : "", word("compare.played", { seconds: fixed(this.path!.steps / TOUCH_HZ, 1) }), farthest > 1e-6 ? word("compare.apart", { mm: fixed(1000 * farthest, 1) }) : ""].join(" ");
  }

  private draw() {
    requestAnimationFrame(() => this.draw());
    for (const side of this.sides) side.askFrame();
    let longest = LEAST_MOST;
    for (const { shown: { shape } } of this.sides) for (const length of shape?.fine?.lengths ?? shape?.lengths ?? []) longest = Math.max(longest, length);
    const most = roundUp(longest);
    // Drawing moves the leading camera on; the other side then follows it.
    for (const side of [this.lead, ...this.sides.filter((other) => other !== this.lead)]) {
      if (side !== this.lead && this.areOpen) side.view.camera.follow(this.lead.view.camera);
      if (side.mesh) side.draw(most);
    }
    this.plot.draw();
    if (this.touching && !this.sides.some((side) => side.touched)) void this.afterTouch();
  }

  private async afterTouch() {
    const side = this.touching!;
    this.touching = null;
    const path = await side.lastPath();
    this.seen = null;
    if (path?.steps) void this.try(beginningOf(path));
  }

  private connectKeys() {
    const camera = () => this.lead.view.camera, cross = new Cross(this.sides[0].canvas, document.createElement("i"));
    new Keys(this.sides[0].canvas, cross, {
      isOpen: () => this.areOpen, turn: (right, up) => camera().turn(right, up), nearer: (factor) => camera().nearer(factor),
      home: () => camera().home(), push: (down) => down && this.press(), replay: () => this.press(), reset: () => {}, undo: () => {},
    });
  }

  private dress() {
    for (const side of this.sides) side.dress();
  }
}

function beginningOf(path: Path): Path {
  const steps = Math.min(LONGEST, path.steps);
  return { steps, points: path.points.slice(0, 3 * TOOL_COUNT * steps), hold: path.hold.slice(0, TOOL_COUNT * steps) };
}

const largestDifference = (a: Float64Array, b: Float64Array) => largestOf(a.map((x, i) => x - b[i]));
const largestMove = (now: Float32Array, rest: Float32Array) => largestOf(now.map((x, i) => x - rest[i]));

const signed = (x: number, digits: number) => `${x < 0 ? "−" : "+"}${fixed(Math.abs(x), digits)}`;
const share = (x: number, of: number, sign = true) => (of > 0 ? `(${sign ? signed((100 * x) / of, 1) : fixed((100 * x) / of, 1)} %)` : "");
const times = ({ median, low, high }: Times) => (median ? word("compare.times", { median: threeDigits(median), low: threeDigits(low), high: threeDigits(high) }) : word("compare.short"));
const ratio = (a: Times, b: Times) => (a.median && b.median ? `× ${brief(b.median / a.median)}` : "");

const row = (name: Key, values: string[], difference: string) =>
  element("tr", {}, element("th", { scope: "row" }, word(name)), ...[...values, difference].map((text) => element("td", {}, text)));

speak(chosenLanguage());
keepInAddress();
Object.assign(globalThis, { palpateCompare: new Compare() }); // for scripts
