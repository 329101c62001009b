// The effects that the page shows: for each a line with a switch or a list of values; its words are
// effect.NAME, .term in small print, and .about.
import {
  STEP_CONTACTS_DROPPED, STEP_DEFORMATION_BEHIND, STEP_DISCS_THINNED, STEP_FORCE_LIMITED, STEP_NOT_TOUCHABLE, STEP_REGULARISED, STEP_RESPONSE_RANGE,
  STEP_SOLVE_INEXACT, STEP_SURFACE_CROSSES, STEP_TRACKING_LOST, STEP_UNSOLVED, STEP_WORK_DEFERRED, type BundleInfo,
} from "../../module/palpate.js";
import type { PageEffects, ToolShape } from "./messages";
import { word, type Key } from "./words";

export const DEFAULT_EFFECTS: PageEffects = {
  collision: "deformed", contact: "patch", law: "sticking", force: "linear", shape: "surface", radial: "off", preload: false, relaxation: [],
  deformation: "linear", fine: false, dent: "discs", inside: false, cut: false,
};
export const DEFAULT_TOOL: ToolShape = { discRadius: 0.006, friction: 0.3 };

// Swine brain, Miller and Chinzei (1997): the shares by which the instantaneous force decays, and their time constants.
export const BRAIN_RELAXATION = [{ share: 0.45, time: 0.5 }, { share: 0.365, time: 50 }];

export type Effect = "contact" | "law" | "follow" | "large" | "force" | "radial" | "relaxation" | "interior" | "preload" | "fine" | "dent" | "cut";

export interface EffectLine {
  effect: Effect; // which words name
  choices?: [value: string, label: Key][]; // the values of a list; undefined: a switch
  cheapest: string | boolean; // the value that costs least, with which costs are compared
  value: (effects: PageEffects) => string | boolean;
  change: (value: string | boolean) => PageEffects;
}

// What knows the whole organ alone is off where the organ can be cut.
const CUT: PageEffects = { cut: true, collision: "deformed", force: "linear", radial: "off", shape: "surface", fine: false, inside: false };
// The measured curves correct a linear answer, so that one of the two is off where the other is on.
const LINEAR: PageEffects = { deformation: "linear" };
// What the page's address calls each model of deformation.
const LARGE = { off: "linear", on: "large", beside: "large-beside", renewed: "large-renewed", auto: "large-auto" } as const;
const wordOfLarge = ({ deformation = "linear" }: PageEffects) => Object.entries(LARGE).find(([, model]) => model === deformation)![0];

const switched = (effect: Effect, isOn: (effects: PageEffects) => boolean, on: PageEffects, off: PageEffects): EffectLine =>
  ({ effect, cheapest: false, value: isOn, change: (wanted) => (wanted ? on : off) });

export const EFFECT_LINES: EffectLine[] = [
  {
    effect: "contact",
    choices: [["patch", "effect.contact.patch"], ["point", "effect.contact.point"], ["triangle", "effect.contact.triangle"], ["node", "effect.contact.node"]],
    cheapest: "point", value: (e) => e.contact!, change: (v) => ({ contact: v as PageEffects["contact"] }),
  },
  {
    effect: "law",
    choices: [["sticking", "effect.law.sticking"], ["sliding", "effect.law.sliding"], ["unilateral", "effect.law.unilateral"], ["coulomb", "effect.law.coulomb"]],
    cheapest: "sticking", value: (e) => e.law!, change: (v) => ({ law: v as PageEffects["law"] }),
  },
  switched("follow", (e) => e.collision === "deformed", { collision: "deformed" }, { collision: "rest" }),
  {
    effect: "large",
    choices: [["off", "effect.large.off"], ["on", "effect.large.on"], ["beside", "effect.large.beside"], ["renewed", "effect.large.renewed"], ["auto", "effect.large.auto"]],
    cheapest: "off", value: wordOfLarge,
    change: (v) => (v === "off" ? LINEAR : { deformation: LARGE[v as keyof typeof LARGE], force: "linear", radial: "off" }),
  },
  switched("force", (e) => e.force === "response", { force: "response", ...LINEAR }, { force: "linear" }),
  switched("radial", (e) => e.radial === "response", { radial: "response", ...LINEAR }, { radial: "off" }),
  switched("relaxation", (e) => !!e.relaxation?.length, { relaxation: BRAIN_RELAXATION }, { relaxation: [] }),
  switched("interior", (e) => e.shape === "volume", { shape: "volume" }, { shape: "surface" }),
  switched("preload", (e) => !!e.preload, { preload: true }, { preload: false }),
  switched("fine", (e) => !!e.fine, { fine: true }, { fine: false }),
  switched("dent", (e) => e.dent === "discs", { dent: "discs" }, { dent: "off" }),
  switched("cut", (e) => e.cut === true, CUT, { cut: false }),
];
// What a page without a scalpel offers.
export const UNCUT_LINES = EFFECT_LINES.filter(({ effect }) => effect !== "cut");
export const canBeCut = (effects: PageEffects): PageEffects => ({ ...effects, ...CUT });

export function isAvailable(effect: string, info: BundleInfo, hasMesh: boolean): boolean {
  if (effect === "large") return info.hasLarge;
  if (effect === "force") return info.hasForce;
  if (effect === "radial") return info.hasRadial;
  if (effect === "interior") return info.hasInterior && info.nodeCount > info.surfaceNodeCount;
  if (effect === "preload") return info.hasPreload;
  if (effect === "cut") return info.hasCut;
  if (effect === "fine" || effect === "dent") return hasMesh;
  return true;
}

// The flags of a step as the page words them.
const FLAG_WORDS: [bit: number, key: Key][] = [
  [STEP_CONTACTS_DROPPED, "flag.contacts"],
  [STEP_REGULARISED, "flag.conflict"],
  [STEP_RESPONSE_RANGE, "flag.beyond"],
  [STEP_FORCE_LIMITED, "flag.limited"],
  [STEP_NOT_TOUCHABLE, "flag.not-touchable"],
  [STEP_UNSOLVED, "flag.not-finite"],
  [STEP_TRACKING_LOST, "flag.too-fast"],
  [STEP_WORK_DEFERRED, "flag.later"],
  [STEP_SOLVE_INEXACT, "flag.nearly"],
  [STEP_DISCS_THINNED, "flag.few-nodes"],
  [STEP_DEFORMATION_BEHIND, "flag.not-yet"],
  [STEP_SURFACE_CROSSES, "flag.crosses"],
];
export const flagWords = (flags: number) => FLAG_WORDS.filter(([bit]) => flags & bit).map(([, key]) => word(key));
