// The colours of displacements, from the organ's own colour to pale yellow. The brightness grows with the displacement, so that
// the scale can be read in grey too.
import { Color } from "three";

const STOPS: [number, number, number][] = [[152, 74, 70], [191, 98, 66], [221, 139, 68], [241, 190, 96], [253, 238, 178]];
const gradientOf = (stops: [number, number, number][]) => `linear-gradient(to top, ${stops.map((c) => `rgb(${c.join(" ")})`).join(", ")})`;
export const GRADIENT = gradientOf(STOPS);

const linear = (byte: number) => Math.pow(byte / 255, 2.2);
const LINEAR_STOPS = STOPS.map((stop) => stop.map(linear));
// Of several organs: reddish brown, violet, green, ochre, blue grey, rose, teal, grey, and again.
const ORGANS: [number, number, number][] = [[152, 74, 70], [122, 92, 142], [104, 140, 82], [176, 137, 82], [92, 124, 150], [184, 116, 140], [76, 140, 132], [130, 130, 130]];
const organBytes = (organ: number) => ORGANS[organ % ORGANS.length];
export const organColour = (organ: number) => `rgb(${organBytes(organ).join(" ")})`; // of a style sheet
export const organTissue = (organ: number) => organBytes(organ).map(linear); // linear light
export const TISSUE = LINEAR_STOPS[0] as [number, number, number];

// What lies at a share, 0 to 1, of the way along the stops, into colours[first .. first + 2].
function colourAt(stops: number[][], share: number, colours: number[] | Float32Array, first: number) {
  const last = stops.length - 1, at = Math.min(1, Math.max(0, share)) * last, low = Math.min(last - 1, Math.floor(at));
  for (let c = 0; c < 3; ++c) colours[first + c] = stops[low][c] + (at - low) * (stops[low + 1][c] - stops[low][c]);
}

// The colour of a share of the scale, 0 to 1.
export function organColourOf(share: number): Color {
  const found: number[] = [];
  colourAt(LINEAR_STOPS, share, found, 0);
  return new Color().setRGB(found[0], found[1], found[2]);
}

// lengths [nodes] m -> colours [nodes][3], linear light; a length of `most` (m) gets the palest colour. own: colours of the vertices'
// own in place of the darkest one; null: there are none.
export function colourByDisplacement(lengths: Float32Array, most: number, own: Float32Array | null, colours: Float32Array) {
  const stops = [[...TISSUE], ...LINEAR_STOPS.slice(1)];
  for (let n = 0; n < lengths.length; ++n) {
    for (let c = 0; own && c < 3; ++c) stops[0][c] = own[3 * n + c];
    colourAt(stops, lengths[n] / most, colours, 3 * n);
  }
}

// The colours of a field on a section: from dark to pale for what is above 0; and for what has a sign, from blue by white to red.
const FIELD: [number, number, number][] = [[49, 18, 89], [57, 86, 140], [31, 146, 140], [94, 201, 98], [249, 230, 64]];
const SIGNED: [number, number, number][] = [[38, 84, 166], [132, 170, 216], [245, 245, 242], [232, 148, 116], [170, 36, 44]];
export const FIELD_GRADIENT = gradientOf(FIELD), SIGNED_GRADIENT = gradientOf(SIGNED);
const LINEAR_FIELD = FIELD.map((stop) => stop.map(linear)), LINEAR_SIGNED = SIGNED.map((stop) => stop.map(linear));

// share: of the scale's end, 0 to 1, or -1 to 1 for what has a sign. Linear light, into colours[first .. first + 2].
export function colourOfField(share: number, isSigned: boolean, colours: number[], first: number) {
  colourAt(isSigned ? LINEAR_SIGNED : LINEAR_FIELD, isSigned ? (share + 1) / 2 : share, colours, first);
}

// The smallest of 1, 2, 5, 10, ... that is not below the value.
export function roundUp(value: number): number {
  const power = 10 ** Math.floor(Math.log10(Math.max(value, 1e-12)));
  return [1, 2, 5, 10].map((m) => m * power).find((m) => m >= value * (1 - 1e-9)) ?? 10 * power;
}
