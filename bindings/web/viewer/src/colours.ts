// The colours of displacements, from the organ's own colour to pale yellow. The brightness grows with the displacement, so that
// the scale can be read in grey too.
const STOPS: [number, number, number][] = [[152, 74, 70], [191, 98, 66], [221, 139, 68], [241, 190, 96], [253, 238, 178]];
export const GRADIENT = `linear-gradient(to top, ${STOPS.map((c) => `rgb(${c.join(" ")})`).join(", ")})`;

const linear = (byte: number) => Math.pow(byte / 255, 2.2);
const LINEAR_STOPS = STOPS.map((stop) => stop.map(linear));
// Of several organs: reddish brown, violet, green, ochre, blue grey, rose, teal, grey, and again.
const ORGANS: [number, number, number][] = [[152, 74, 70], [122, 92, 142], [104, 140, 82], [176, 137, 82], [92, 124, 150], [184, 116, 140], [76, 140, 132], [130, 130, 130]];
const organBytes = (organ: number) => ORGANS[organ % ORGANS.length];
export const organColour = (organ: number) => `rgb(${organBytes(organ).join(" ")})`; // of a style sheet
export const organTissue = (organ: number) => organBytes(organ).map(linear); // linear light
export const TISSUE = LINEAR_STOPS[0] as [number, number, number];

// lengths [nodes] m -> colours [nodes][3], linear light; a length of `most` (m) gets the palest colour.
export function colourByDisplacement(lengths: Float32Array, most: number, colours: Float32Array) {
  const last = STOPS.length - 1;
  for (let n = 0; n < lengths.length; ++n) {
    const at = Math.min(1, lengths[n] / most) * last, low = Math.min(last - 1, Math.floor(at)), share = at - low;
    for (let c = 0; c < 3; ++c) colours[3 * n + c] = LINEAR_STOPS[low][c] + share * (LINEAR_STOPS[low + 1][c] - LINEAR_STOPS[low][c]);
  }
}

// The same for vertices that have colours of their own, [vertex][3] linear light, in place of the darkest one.
export function colourOwnByDisplacement(lengths: Float32Array, most: number, own: Float32Array, colours: Float32Array) {
  const last = STOPS.length - 1;
  colourByDisplacement(lengths, most, colours);
  for (let n = 0; n < lengths.length; ++n) {
    const at = Math.min(1, lengths[n] / most) * last;
    for (let c = 0; at < 1 && c < 3; ++c) colours[3 * n + c] = own[3 * n + c] + at * (LINEAR_STOPS[1][c] - own[3 * n + c]);
  }
}

// The smallest of 1, 2, 5, 10, ... that is not below the value.
export function roundUp(value: number): number {
  const power = 10 ** Math.floor(Math.log10(Math.max(value, 1e-12)));
  return [1, 2, 5, 10].map((m) => m * power).find((m) => m >= value * (1 - 1e-9)) ?? 10 * power;
}
