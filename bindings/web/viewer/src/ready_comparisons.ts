// The comparisons that Compare offers at one click, where the server's bundles can show them.
import type { ServedBundle } from "./served";
import type { Key } from "./words";

export interface ReadyComparison {
  name: Key;
  effects: [a: string, b: string]; // words of the page's address
  discs: [a: number, b: number]; // mm
  depth: number; // m, of the press
  at: "front" | "end"; // where one sees the dent from the side, or the end that lies farthest from the organ's middle
  seen?: Key; // what it shows
  bundles: [a: string, b: string] | null; // addresses; null: A's on both sides
}

const DISC = 6; // mm
const COARSE = "1700", FINE = "20000"; // resolutions

// hasLarge: the bundle of side A can deform largely. bundles: of the server. open: the address of side A's bundle.
export function readyComparisons(hasLarge: boolean, bundles: ServedBundle[], open: string): ReadyComparison[] {
  const pair = meshes(bundles, open), ready: ReadyComparison[] = [];
  if (hasLarge) ready.push({ name: "compare.ready.large", effects: ["", "large=on"], discs: [DISC, DISC], depth: 0.025, at: "end", seen: "compare.seen.large", bundles: null });
  if (pair) ready.push({ name: "compare.ready.mesh", effects: ["", ""], discs: [DISC, DISC], depth: 0.006, at: "front", bundles: pair });
  ready.push({ name: "compare.ready.disc", effects: ["", ""], discs: [3, 9], depth: 0.006, at: "front", bundles: null });
  return ready;
}

// One organ and one boundary set on both meshes; that of the open bundle first.
function meshes(bundles: ServedBundle[], open: string): [string, string] | null {
  const pairs = bundles.filter(({ resolution }) => resolution === COARSE).flatMap((coarse) => {
    const fine = bundles.find(({ organ, boundary, resolution }) => organ === coarse.organ && boundary === coarse.boundary && resolution === FINE);
    return fine ? [[coarse.bundle, fine.bundle] as [string, string]] : [];
  });
  return pairs.find((pair) => pair.some((address) => open.endsWith(address))) ?? pairs[0] ?? null;
}
