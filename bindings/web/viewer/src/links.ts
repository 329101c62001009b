// What the page's address holds after the #: the bundle's checksum, the effects that are not the page's own, the disc, the colour, the
// tools that stay, the camera. Opening the address again restores them; the browser's Back takes the last change of an effect back.
import { DEFAULT_EFFECTS, EFFECT_LINES, type EffectLine } from "./effects";
import { TOOL_COUNT, type ColourBy, type PageEffects, type ToolTarget, type Vector } from "./messages";

const COLOURS: readonly string[] = ["dent", "displacement", "nothing"] satisfies ColourBy[];
const IN_LINKS = EFFECT_LINES.filter(({ effect }) => effect !== "fine"); // a file of the user's, which an address cannot hold

export interface PageState {
  bundle: string; // 16 hexadecimal digits
  effects: PageEffects;
  discRadius: number; // m
  colour: ColourBy;
  tools: (ToolTarget | null)[]; // that stay where they are
  view: [azimuth: number, height: number, distance: number]; // degrees, degrees, m
}

export const bundleOfLink = (link: string) => new URLSearchParams(link.replace(/^#/, "")).get("bundle");

export function linkOf({ bundle, effects, discRadius, colour, tools, view }: PageState): string {
  const words = new URLSearchParams({ bundle, ...Object.fromEntries(wordsOfEffects(effects)) });
  words.set("disc", String(Number((1000 * discRadius).toFixed(1))));
  words.set("colour", colour);
  tools.forEach((tool, t) => tool && words.set(`tool${t + 1}`, wordOfTool(tool)));
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
    tools: Array.from({ length: TOOL_COUNT }, (_, t) => toolOfWord(words.get(`tool${t + 1}`) ?? "")),
    view: view.length === 3 && view.every(Number.isFinite) && view[2] > 0 ? (view as PageState["view"]) : now.view,
  };
}

// The effects that are not the page's own.
export function wordsOfEffects(effects: PageEffects): [effect: string, word: string][] {
  return IN_LINKS.filter((line) => line.value(effects) !== line.value(DEFAULT_EFFECTS)).map((line) => [line.effect, wordOf(line.value(effects))]);
}

// now: what the words cannot hold.
export function effectsOfWords(words: URLSearchParams, now: PageEffects, isAvailable: (effect: string) => boolean): PageEffects {
  let effects: PageEffects = { ...DEFAULT_EFFECTS, fine: now.fine, inside: now.inside };
  for (const line of IN_LINKS) {
    const word = words.get(line.effect);
    if (word !== null && isAvailable(line.effect) && allows(line, word)) effects = { ...effects, ...line.change(line.choices ? word : word === "on") };
  }
  return effects;
}

// Where a tool comes from, where it stands, and, for one that pulls, where it takes hold; mm, to a micrometre.
function wordOfTool({ start, point, grasp }: ToolTarget): string {
  return [start, point, grasp ?? []].flatMap((place) => [...place].map((x) => Number((1000 * x).toFixed(3)))).join(" ");
}

// null where the word is none.
function toolOfWord(word: string): ToolTarget | null {
  const numbers = word.split(" ").map((x) => Number(x) / 1000), places = [0, 3, 6].map((at) => numbers.slice(at, at + 3) as Vector);
  if (![6, 9].includes(numbers.length) || !numbers.every(Number.isFinite)) return null;
  return { start: places[0], point: places[1], grasp: numbers.length === 9 ? places[2] : null, down: true };
}

const wordOf = (value: string | boolean) => (typeof value === "string" ? value : value ? "on" : "off");
const allows = ({ choices }: EffectLine, word: string) => (choices ? choices.some(([value]) => value === word) : word === "on" || word === "off");
