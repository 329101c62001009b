// What the two sides of Compare are called: by what differs between them.
import { DEFAULT_EFFECTS, UNCUT_LINES, type EffectLine } from "./effects";
import type { PageEffects } from "./messages";
import { count, decimal, word, type Key } from "./words";

export interface Setting {
  organ: string;
  boundary: string;
  element: string;
  nodes: number; // of the mesh
  bytes: number; // of the bundle
  effects: PageEffects;
  discRadius: number; // m
}

// Of each setting the words of what is not the same in both; empty where nothing differs.
export function namesOf(settings: Setting[]): string[] {
  const parts = settings.map((setting) => [
    setting.organ, word("compare.vertices", { count: count(setting.nodes) }), setting.boundary, setting.element,
    ...UNCUT_LINES.map((line) => wordsOf(line, setting.effects)), word("compare.disc-of", { mm: decimal(Number((1000 * setting.discRadius).toFixed(1))) }),
  ]);
  return parts.map((own, s) => own.filter((part, p) => part !== parts[1 - s][p]).join(", "));
}

function wordsOf({ effect, choices, value }: EffectLine, effects: PageEffects): string {
  const now = value({ ...DEFAULT_EFFECTS, ...effects }), name = word(`effect.${effect}`);
  const chosen = choices ? word(choices.find(([one]) => one === now)![1]) : word(`switch.${now ? "on" : "off"}` as Key);
  return `${name}: ${chosen}`;
}
