// Names of an organ and of what holds it, in the page's language where the page knows them.
import { distance, middleOf } from "./geometry";
import type { Mesh, Vector } from "./messages";
import { known } from "./words";

const PLACES = 12; // of a part: a name stands at the first that one sees
const NEAR = 1e-4; // relative: the provenance has six digits of a stiffness

export interface NamedPart {
  name: string; // as the bundle has it
  places: Vector[]; // of the surface at rest, m: the first one in its middle, the others ever farther from that
}

export const named = (name: string) => known(`anatomy.${name}`) ?? name;

// The elastic foundations, each where its own stiffness is; one that another covers wholly is left out.
export function partsOf({ positions, triangles, soft, stiffness }: Mesh, provenance: Record<string, unknown>): NamedPart[] {
  return Object.entries(provenance).flatMap(([key, value]) => {
    const name = /^foundation (.+)$/.exec(key)?.[1], normal = Number(/^normal ([\d.e+-]+)/.exec(String(value))?.[1]);
    if (!name || !normal) return [];
    const centres = [...soft].filter((_, i) => Math.abs(stiffness[i] / normal - 1) < NEAR).map((t) => middleOf([0, 1, 2].map((i) => [...positions.subarray(3 * triangles[3 * t + i], 3 * triangles[3 * t + i] + 3)] as Vector)));
    if (!centres.length) return [];
    const middle = middleOf(centres), sorted = centres.sort((a, b) => distance(a, middle) - distance(b, middle)), count = Math.min(PLACES, centres.length);
    return [{ name, places: Array.from({ length: count }, (_, p) => sorted[Math.floor((p * centres.length) / count)]) }];
  });
}
