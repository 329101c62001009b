// Plays paths with palpate-run: the reference for the WebAssembly build.
import { execFileSync } from "node:child_process";
import { mkdirSync, readFileSync, readdirSync, writeFileSync } from "node:fs";
import { inflateSync } from "node:zlib";

// Plays tools along key frames [s, x, y, z], m. Returns forces [step][tool][3] N, shapes [frame] = positions [node][3] m, and skins:
// the positions of the render mesh, if `more` names one.
export function playNatively(palpateRun, folder, name, bundle, effects, tools, more = []) {
  const value = (v) => (Array.isArray(v) ? `[${v.map(value).join(", ")}]` : typeof v === "string" ? `"${v}"` : String(v));
  const lines = [`name = "${name}"`, `bundle = "${bundle}"`, `unit = "m"`, "[effects]"];
  for (const [key, word] of Object.entries(effects)) lines.push(`${key} = ${value(word)}`);
  for (const tool of tools) {
    lines.push("[[tool]]");
    for (const [key, v] of Object.entries(tool)) lines.push(`${key} = ${value(v)}`);
  }
  const { forces, shapes } = playScene(palpateRun, folder, name, lines.join("\n") + "\n", tools.length, more);
  return { forces, shapes: shapes("organ"), skins: shapes("skin") };
}

// Plays the text of a scene file. shapes: of the files whose names begin so.
export function playScene(palpateRun, folder, name, text, toolCount, more = []) {
  mkdirSync(folder, { recursive: true });
  writeFileSync(`${folder}/${name}.toml`, text);
  execFileSync(palpateRun, [`${folder}/${name}.toml`, "--quiet", ...more, "-o", `${folder}/${name}`]);
  const files = readdirSync(`${folder}/${name}/shapes`).sort();
  return {
    forces: readForces(readFileSync(`${folder}/${name}/forces.csv`, "utf8"), toolCount),
    shapes: (of) => files.filter((file) => file.startsWith(of)).map((file) => readPoints(readFileSync(`${folder}/${name}/shapes/${file}`))),
  };
}

export function readForces(csv, toolCount) {
  const rows = csv.trim().split("\n").slice(1).map((line) => line.split(",").slice(5, 8).map(Number));
  return Array.from({ length: rows.length / toolCount }, (_, step) => rows.slice(step * toolCount, (step + 1) * toolCount));
}

// The Points of a .vtu with appended, base64, zlib-compressed data, as VTK writes it.
function readPoints(bytes) {
  const text = bytes.toString("latin1");
  const word = /header_type="UInt64"/.test(text) ? 8 : 4;
  const offset = Number(text.match(/<Points>[^]*?offset="(\d+)"/)[1]);
  const encoded = text.slice(text.indexOf("_", text.indexOf("<AppendedData")) + 1 + offset);
  const base64Length = (count) => Math.ceil(count / 3) * 4;
  const words = (count) => {
    const raw = Buffer.from(encoded.slice(0, base64Length(count * word)), "base64");
    return Array.from({ length: count }, (_, i) => (word === 8 ? Number(raw.readBigUInt64LE(8 * i)) : raw.readUInt32LE(4 * i)));
  };
  const blocks = words(1)[0], header = words(3 + blocks), sizes = header.slice(3);
  const start = base64Length((3 + blocks) * word), total = sizes.reduce((sum, size) => sum + size, 0);
  const packed = Buffer.from(encoded.slice(start, start + base64Length(total)), "base64");
  let at = 0;
  const points = Buffer.concat(sizes.map((size) => inflateSync(packed.subarray(at, (at += size)))));
  return new Float32Array(points.buffer.slice(points.byteOffset, points.byteOffset + points.length));
}

// Interpolates linearly between key frames, as palpate-run does.
export function positionAt(path, time) {
  const after = path.findIndex((frame) => frame[0] > time);
  if (after === 0) return path[0].slice(1);
  if (after < 0) return path[path.length - 1].slice(1);
  const [t0, ...a] = path[after - 1], [t1, ...b] = path[after];
  return a.map((x, d) => x + ((time - t0) / (t1 - t0)) * (b[d] - x));
}

// Normals of vertices, weighted by area, as palpate-run makes them. positions: [vertices][3]; faces: three vertices each.
export function smoothNormals(positions, faces) {
  const normals = new Float64Array(positions.length), at = (v, d) => positions[3 * v + d];
  for (const [a, b, c] of faces)
    for (let d = 0; d < 3; ++d) {
      const e = (d + 1) % 3, f = (d + 2) % 3;
      const area = (at(b, e) - at(a, e)) * (at(c, f) - at(a, f)) - (at(b, f) - at(a, f)) * (at(c, e) - at(a, e));
      for (const v of [a, b, c]) normals[3 * v + d] += area;
    }
  return Float32Array.from(normals, (_, i) => normals[i] / Math.hypot(...normals.subarray(i - (i % 3), i - (i % 3) + 3)));
}

// A PLY file of points and of triangles, three corners each.
export const plyOf = (points, triangles, type = "float") =>
  `ply\nformat ascii 1.0\nelement vertex ${points.length}\n${["x", "y", "z"].map((axis) => `property ${type} ${axis}\n`).join("")}` +
  `element face ${triangles.length}\nproperty list uchar int vertex_indices\nend_header\n` +
  [...points.map((point) => point.join(" ")), ...triangles.map((corners) => `3 ${corners.join(" ")}`)].join("\n") + "\n";

// Of numbers, which may be more than a call takes as arguments.
export const largestOf = (numbers) => numbers.reduce((most, x) => Math.max(most, Math.abs(x)), 0);

// The largest difference of two arrays over the largest number in the second.
export function relativeDifference(found, expected) {
  if (found.length !== expected.length) return Infinity;
  let difference = 0, size = 0;
  for (let i = 0; i < expected.length; ++i) {
    difference = Math.max(difference, Math.abs(found[i] - expected[i]));
    size = Math.max(size, Math.abs(expected[i]));
  }
  return Number.isFinite(difference) && size > 0 ? difference / size : Infinity;
}

// On the box of tests/support: one tool presses the top and moves sideways (a disc if the contact is "patch"); one presses the far face.
export const boxToolsFor = (effects) => [
  { name: "presser", points: [[0, 0, 0]], ...(effects.contact === "patch" ? { disc_radius: 0.008, friction: 0.3 } : {}),
    path: [[0, 0.031, 0.024, 0.042], [0.1, 0.031, 0.024, 0.037], [0.2, 0.036, 0.027, 0.037], [0.25, 0.036, 0.027, 0.045]] },
  { name: "needle", points: [[0, 0, 0]], path: [[0, 0.062, 0.027, 0.021], [0.15, 0.056, 0.027, 0.021], [0.25, 0.056, 0.029, 0.021]] },
];
export const boxScenes = {
  point: { contact: "point" },
  deformed: { collision: "deformed", contact: "triangle", shape: "volume" },
  slipping: { collision: "deformed", contact: "patch", law: "coulomb" },
};

const of = (organ) => (organ ? `organ = "${organ}"\n` : "");
// Tools of scenes on the box of `write_tiny_bundle FILE corridor`, in mm: a needle that goes to the end of the corridor and comes out; a probe
// that presses the face z = 40. organ: its name, in a scene of several.
export const piercingNeedle = (organ) => `[[tool]]
name = "needle"
${of(organ)}near = [60, 24, 19]
depth = [[0, -2], [0.15, 30], [0.2, 70], [0.6, 70], [0.7, -5]]
[tool.needle]
direction = [-1, 0, 0]
radius = 0.5
friction = 1
puncture_force = 0.05
cutting_force = 0.02
`;
export const pressingProbe = (organ) => `[[tool]]
name = "probe"
${of(organ)}points = [[0, 0, 0]]
disc_radius = 8
near = [30, 25, 40]
depth = [[0, -3], [0.2, 4], [0.35, -3]]
`;
