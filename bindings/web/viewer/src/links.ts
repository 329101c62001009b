// What the page's address holds after the #: the bundle's checksum, the effects that are not the page's own, the disc, the colour, the
// camera. Opening the address again restores them; the browser's Back takes the last change of an effect back.
import { DEFAULT_EFFECTS, EFFECT_LINES, type EffectLine } from "./effects";
import type { ColourBy, PageEffects } from "./messages";

const COLOURS: readonly string[] = ["dent", "displacement", "nothing"] satisfies ColourBy[];
const IN_LINKS = EFFECT_LINES.filter(({ effect }) => effect !== "fine"); // a file of the user's, which an address cannot hold

export interface PageState {
  bundle: string; // 16 hexadecimal digits
  effects: PageEffects;
  discRadius: number; // m
  colour: ColourBy;
  view: [azimuth: number, height: number, distance: number]; // degrees, degrees, m
}

export const bundleOfLink = (link: string) => new URLSearchParams(link.replace(/^#/, "")).get("bundle");

export function linkOf({ bundle, effects, discRadius, colour, view }: PageState): string {
  const words = new URLSearchParams({ bundle, ...Object.fromEntries(wordsOfEffects(effects)) });
  words.set("disc", String(Number((1000 * discRadius).toFixed(1))));
  words.set("colour", colour);
  words.set("view", view.map((x, i) => x.toFixed(i < 2 ? 1 : 4)).join(" "));
  return `#${words}`;
}

// The state of a link; what the link does not hold, or holds wrongly, is as in `now`. effects: only available ones.
export function stateOfLink(link: string, now: PageState, isAvailable: (effect: string) => boolean): PageState {
  const words = new URLSearchParams(link.replace(/^#/, ""));
  const effects = effectsOfWords(words, now.effects, isAvailable);
  const disc = Number(words.get("disc")), colour = words.get("colour") ?? "", view = (words.get("view") ?? "").split(" ").map(Number);
  return {
    bundle: now.bundle, effects, discRadius: disc >= 2 && disc <= 12 ? disc / 1000 : now.discRadius,
    colour: COLOURS.includes(colour) ? (colour as ColourBy) : now.colour,
    view: view.length === 3 && view.every(Number.isFinite) && view[2] > 0 ? (view as PageState["view"]) : now.view,
  };
}

// The effects that are not the page's own.
export function wordsOfEffects(effects: PageEffects): [effect: string, word: string][] {
  return IN_LINKS.filter((line) => line.value(effects) !== line.value(DEFAULT_EFFECTS)).map((line) => [line.effect, wordOf(line.value(effects))]);
}

// now: what the words cannot hold.
export function effectsOfWords(words: URLSearchParams, now: PageEffects, isAvailable: (effect: string) => boolean): PageEffects {
  let effects: PageEffects = { ...DEFAULT_EFFECTS, fine: now.fine };
  for (const line of IN_LINKS) {
    const word = words.get(line.effect);
    if (word !== null && isAvailable(line.effect) && allows(line, word)) effects = { ...effects, ...line.change(line.choices ? word : word === "on") };
  }
  return effects;
}

const wordOf = (value: string | boolean) => (typeof value === "string" ? value : value ? "on" : "off");
const allows = ({ choices }: EffectLine, word: string) => (choices ? choices.some(([value]) => value === word) : word === "on" || word === "off");
