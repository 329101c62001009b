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

// Places that were read off an image, mm in its frame: nothing in an image of labels says where a lobe is.
interface ReadPlaces {
  image: string; // its SHA-256, as bundles that were made of it hold it
  organs: string[];
  parts: Record<string, Vector[]>;
}
const READ: ReadPlaces[] = [{
  image: "8d585a21aaaa34ab62219fa3606541b73de22e25211f78180c625df341cc1991", // the default liver's; there x grows to the patient's left
  organs: ["liver", "liver-tumour", "upper-abdomen"],
  parts: {
    "right-lobe": [[67, 42, 109], [42, 157, 142], [72, 38, 110]], "left-lobe": [[205, 47, 147], [191, 71, 157], [177, 76, 106]],
    "gallbladder-bed": [[97, 78, 80], [97, 56, 70], [110, 57, 84]], // where the image's gallbladder touches the liver
  },
}];
const SURFACE_AWAY = 0.015; // m, of a place on another mesh of the same image

export const named = (name: string) => known(`anatomy.${name}`) ?? name;

// What the image of the organ is known to show, and what holds the organ.
export function partsOf(mesh: Mesh, provenance: Record<string, unknown>): NamedPart[] {
  const { parts } = READ.find(({ image, organs }) => image === provenance.image_sha256 && organs.includes(String(provenance.organ))) ?? { parts: {} as ReadPlaces["parts"] };
  const read = Object.entries(parts).map(([name, places]) => ({ name, places: places.flatMap((place) => onSurface(mesh, place.map((x) => x / 1000) as Vector)) }));
  return [...read.filter(({ places }) => places.length), ...foundationsOf(mesh, provenance)];
}

// The middle of the nearest triangle; none where the surface is far away.
function onSurface({ positions, triangles }: Mesh, place: Vector): Vector[] {
  let nearest = place, least = SURFACE_AWAY;
  for (let t = 0; t < triangles.length; t += 3) {
    const middle = middleOf([0, 1, 2].map((i) => [...positions.subarray(3 * triangles[t + i], 3 * triangles[t + i] + 3)] as Vector)), away = distance(middle, place);
    if (away < least) [nearest, least] = [middle, away];
  }
  return least < SURFACE_AWAY ? [nearest] : [];
}

// The elastic foundations, each where its own stiffness is; one that another covers wholly is left out.
function foundationsOf({ positions, triangles, soft, stiffness }: Mesh, provenance: Record<string, unknown>): NamedPart[] {
  return Object.entries(provenance).flatMap(([key, value]) => {
    const name = /^foundation (.+)$/.exec(key)?.[1], normal = Number(/^normal ([\d.e+-]+)/.exec(String(value))?.[1]);
    if (!name || !normal) return [];
    const centres = [...soft].filter((_, i) => Math.abs(stiffness[i] / normal - 1) < NEAR).map((t) => middleOf([0, 1, 2].map((i) => [...positions.subarray(3 * triangles[3 * t + i], 3 * triangles[3 * t + i] + 3)] as Vector)));
    if (!centres.length) return [];
    const middle = middleOf(centres), sorted = centres.sort((a, b) => distance(a, middle) - distance(b, middle)), count = Math.min(PLACES, centres.length);
    return [{ name, places: Array.from({ length: count }, (_, p) => sorted[Math.floor((p * centres.length) / count)]) }];
  });
}
