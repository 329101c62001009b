// The effects that the page shows: for each a line with a switch or a list of values.
import type { BundleInfo } from "../../module/palpate.js";
import type { PageEffects, ToolShape } from "./messages";

export const DEFAULT_EFFECTS: PageEffects = {
  collision: "deformed", contact: "patch", law: "sticking", force: "linear", shape: "surface", radial: "off", preload: false, relaxation: [],
  deformation: "linear", fine: false,
};
export const DEFAULT_TOOL: ToolShape = { discRadius: 0.006, friction: 0.3 };

// Swine brain, Miller and Chinzei (1997): the shares by which the instantaneous force decays, and their time constants.
export const BRAIN_RELAXATION = [{ share: 0.45, time: 0.5 }, { share: 0.365, time: 50 }];

export interface EffectLine {
  effect: string;
  label: string;
  about: string;
  choices?: [word: string, label: string][]; // the values of a list; undefined: a switch
  cheapest: string | boolean; // the value that costs least, with which costs are compared
  value: (effects: PageEffects) => string | boolean;
  change: (value: string | boolean) => PageEffects;
}

// The measured curves correct a linear answer, so that one of the two is off where the other is on.
const LINEAR: PageEffects = { deformation: "linear" };

export const EFFECT_LINES: EffectLine[] = [
  {
    effect: "contact", label: "Contact", about: "where a tool holds the surface",
    choices: [["patch", "disc"], ["point", "point"], ["triangle", "triangle"], ["node", "node"]],
    cheapest: "point", value: (e) => e.contact!, change: (v) => ({ contact: v as PageEffects["contact"] }),
  },
  {
    effect: "law", label: "Law", about: "how it holds",
    choices: [["sticking", "sticks"], ["sliding", "slides"], ["unilateral", "pushes only"], ["coulomb", "friction"]],
    cheapest: "sticking", value: (e) => e.law!, change: (v) => ({ law: v as PageEffects["law"] }),
  },
  {
    effect: "follow", label: "Follow the surface", about: "tools meet the organ where it is now",
    cheapest: false, value: (e) => e.collision === "deformed", change: (v) => ({ collision: v ? "deformed" : "rest" }),
  },
  {
    effect: "large", label: "Large deformation", about: "right at any depth: lobes turn and keep their volume; takes longer",
    cheapest: false, value: (e) => e.deformation === "large", change: (v) => (v ? { deformation: "large", force: "linear", radial: "off" } : LINEAR),
  },
  {
    effect: "force", label: "Measured force", about: "force corrected onto the tissue's measured curve",
    cheapest: false, value: (e) => e.force === "response", change: (v) => (v ? { force: "response", ...LINEAR } : { force: "linear" }),
  },
  {
    effect: "radial", label: "Measured bulging", about: "sideways displacement corrected onto the measured curve",
    cheapest: false, value: (e) => e.radial === "response", change: (v) => (v ? { radial: "response", ...LINEAR } : { radial: "off" }),
  },
  {
    effect: "relaxation", label: "Relaxation", about: "force that fades while held, as measured on brain",
    cheapest: false, value: (e) => !!e.relaxation?.length, change: (v) => ({ relaxation: v ? BRAIN_RELAXATION : [] }),
  },
  {
    effect: "interior", label: "Interior", about: "the mesh inside moves too and is drawn, through the surface",
    cheapest: false, value: (e) => e.shape === "volume", change: (v) => ({ shape: v ? "volume" : "surface" }),
  },
  {
    effect: "preload", label: "Weight", about: "rest shape under the organ's own weight",
    cheapest: false, value: (e) => !!e.preload, change: (v) => ({ preload: !!v }),
  },
  {
    effect: "fine", label: "Fine surface", about: "a finer mesh follows the organ and is drawn in its place; a .ply file, dropped beside the bundle",
    cheapest: false, value: (e) => !!e.fine, change: (v) => ({ fine: !!v }),
  },
];

export function isAvailable(effect: string, info: BundleInfo, hasMesh: boolean): boolean {
  if (effect === "large") return info.hasLarge;
  if (effect === "force") return info.hasForce;
  if (effect === "radial") return info.hasRadial;
  if (effect === "interior") return info.hasInterior && info.nodeCount > info.surfaceNodeCount;
  if (effect === "preload") return info.hasPreload;
  if (effect === "fine") return hasMesh;
  return true;
}

// The step flags of palpate.h as the page words them.
const FLAG_WORDS: [bit: number, words: string][] = [
  [1 << 1, "more contacts than the scene has room for"],
  [1 << 2, "the tools ask for what cannot be: one gives way"],
  [1 << 3, "beyond the measured range"],
  [1 << 4, "force limited"],
  [1 << 6, "not touchable here: neighbours are held instead"],
  [1 << 7, "not solved: the bundle's numbers are not finite here"],
  [1 << 9, "too fast: the tool is not followed until it comes in again"],
  [1 << 10, "part of the work waits for the next step"],
  [1 << 11, "the law is met only nearly"],
  [1 << 12, "fewer nodes under the disc than it covers: the force is too small"],
  [1 << 13, "the organ has not yet followed the tool to the end"],
];
export const flagWords = (flags: number) => FLAG_WORDS.filter(([bit]) => flags & bit).map(([, words]) => words);
