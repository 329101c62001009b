// The guided cases: scenes of pipelines/ORGAN/scenes and of studies that play on an organ, with a sentence for each of their parts.
import { element } from "./elements";
import type { ServedBundle } from "./served";
import { fixed, word, type Key } from "./words";

export interface GuidedCase {
  name: string; // ?case=NAME of the viewer's address; its words are case.NAME
  organ: string;
  boundary: string; // of the bundle that it needs
  target?: string; // of Makefile.data, that makes this bundle and opens the case; left out: the organ with its boundary set does
  scene: string; // address
  view?: [azimuth: number, height: number]; // of the camera, degrees, where the tools are out of sight from the front
  steps: [begin: number, sentence: Key][]; // s of the scene
}

export const GUIDED_CASES: GuidedCase[] = [
  { name: "lift", organ: "liver", boundary: "abdomen", scene: "scenes/liver/lift.toml", steps: [[0, "case.lift.close"], [0.4, "case.lift.lift"], [1.4, "case.lift.hold"]] },
  { name: "biopsy", organ: "liver", boundary: "biopsy-breathing", scene: "scenes/liver/biopsy-breathing.toml",
    steps: [[0, "case.biopsy.way"], [0.5, "case.biopsy.in"], [2, "case.biopsy.wait"], [6, "case.biopsy.out"]] },
  { name: "cut", organ: "liver", boundary: "cut", scene: "scenes/liver/cut.toml",
    steps: [[0, "case.cut.close"], [0.4, "case.cut.lift"], [1, "case.cut.cut"], [3, "case.cut.away"]] },
  { name: "minute", organ: "upper-abdomen", boundary: "held-breathing", target: "abdomen-view", scene: "scenes/studies/minute.toml", view: [-108, -33],
    steps: [[0, "case.minute.breathe"], [4, "case.minute.press"], [5, "case.minute.draw"], [17, "case.minute.open"], [21, "case.minute.deeper"], [37, "case.minute.again"]] },
];

// What makes the bundle of a case.
export const commandOfCase = ({ organ, boundary, target }: GuidedCase) => `make -f Makefile.data ${target ?? `ORGAN=${organ} BC=${boundary}`}`;

// The smallest of the server's bundles that a case plays on.
export const bundleOfCase = ({ organ, boundary }: GuidedCase, bundles: ServedBundle[]): ServedBundle | undefined =>
  bundles.filter((one) => one.organ === organ && one.boundary === boundary).sort((a, b) => a.bytes - b.bytes)[0];

// The box beside the organ: the sentences, the one of the present part marked, and what was felt.
export class Guide {
  private of: GuidedCase | null = null;
  private felt: number | null = null; // N: the largest force, when the scene has ended
  private shown = "";

  // play: the scene of the case, from its beginning; stop: ends it.
  constructor(private box: HTMLElement, private play: (scene: string) => void, stop: () => void) {
    this.part("play").addEventListener("click", () => this.of && this.begin(this.of));
    this.part("close").addEventListener("click", () => (this.end(), stop()));
  }

  private part(name: string): HTMLElement {
    return this.box.querySelector(`[data-do="${name}"]`)!;
  }

  begin(of: GuidedCase) {
    this.of = of;
    this.felt = null;
    this.box.hidden = false;
    this.play(of.scene);
    this.show(0);
  }

  end() {
    this.of = null;
    this.box.hidden = true;
  }

  ended(felt: number) {
    this.felt = felt;
    this.show(null);
  }

  // playing: s of the scene; null: it does not play.
  show(playing: number | null) {
    const { of, felt } = this;
    if (!of) return;
    const now = playing === null ? -1 : of.steps.filter(([begin]) => begin <= playing).length - 1, state = [of.name, now, felt, word("decimal")].join();
    if (state === this.shown) return;
    this.shown = state;
    this.box.querySelector("h2")!.textContent = word(`case.${of.name}` as Key);
    this.box.querySelector("ol")!.replaceChildren(...of.steps.map(([, sentence], s) => element("li", s === now ? { "aria-current": "step" } : {}, word(sentence))));
    this.box.querySelector("p")!.textContent = felt === null ? "" : word("case.felt", { newtons: fixed(felt, 2) });
  }
}
