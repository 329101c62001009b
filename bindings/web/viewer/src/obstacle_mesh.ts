// The surface of an obstacle in its own frame: a rectangle, a disc, or a mesh of a file as palpate-run reads it (.ply, .stl, .obj, .off).
import { STLLoader } from "three/addons/loaders/STLLoader.js";
import { PLYLoader } from "three/addons/loaders/PLYLoader.js";
import type { BufferGeometry } from "three";
import { word } from "./words";

export interface ObstacleMesh {
  positions: Float32Array; // [vertex][3] m
  triangles: Uint32Array; // [triangle][3], counter-clockwise from outside
}

const DISC_CORNERS = 48; // of palpate_obstacles.h

export function flatMesh(kind: "rectangle" | "disc", [a, b]: [number, number]): ObstacleMesh {
  const angle = (c: number) => (2 * Math.PI * c) / DISC_CORNERS;
  const rim = kind === "rectangle" ? [[-a, -b], [a, -b], [a, b], [-a, b]].map(([x, y]) => [x / 2, y / 2])
    : Array.from({ length: DISC_CORNERS }, (_, c) => [a * Math.cos(angle(c)), a * Math.sin(angle(c))]);
  return { positions: Float32Array.from(rim.flatMap(([x, y]) => [x, y, 0])), triangles: fanOf(rim.map((_, c) => c)) };
}

const fanOf = (corners: number[]) => Uint32Array.from(corners.slice(2).flatMap((corner, c) => [corners[0], corners[c + 1], corner]));

// unit: metres in a unit of the file. Throws an Error that says what is wrong with it.
export function readObstacleMesh(name: string, bytes: Uint8Array, unit: number): ObstacleMesh {
  const ending = name.toLowerCase().slice(name.lastIndexOf(".")), text = () => new TextDecoder().decode(bytes);
  let mesh: ObstacleMesh;
  try {
    const buffer = bytes.slice().buffer;
    if (ending === ".stl") mesh = welded(new STLLoader().parse(buffer));
    else if (ending === ".ply") mesh = welded(new PLYLoader().parse(buffer));
    else if (ending === ".obj") mesh = meshOfObj(text());
    else mesh = meshOfOff(text());
  } catch {
    throw new Error(word("world.mesh", { name }));
  }
  const vertices = mesh.positions.length / 3;
  if (!mesh.triangles.length || mesh.triangles.some((corner) => !(corner < vertices)) || !mesh.positions.every(Number.isFinite)) throw new Error(word("world.mesh", { name }));
  return { positions: mesh.positions.map((x) => unit * x), triangles: mesh.triangles };
}

// An STL file repeats each vertex for each of its triangles; those at one place become one.
function welded(geometry: BufferGeometry): ObstacleMesh {
  const { array, count } = geometry.getAttribute("position"), index = geometry.getIndex(), first = new Map<string, number>(), places: number[] = [];
  const vertex = Uint32Array.from({ length: count }, (_, v) => {
    const place = [array[3 * v], array[3 * v + 1], array[3 * v + 2]], key = place.join(" "), known = first.get(key);
    if (known !== undefined) return known;
    first.set(key, places.length / 3);
    places.push(...place);
    return places.length / 3 - 1;
  });
  return { positions: Float32Array.from(places), triangles: index ? Uint32Array.from(index.array, (v) => vertex[v]) : vertex };
}

function meshOfObj(text: string): ObstacleMesh {
  const places: number[] = [], triangles: number[] = [];
  for (const line of text.split(/\r?\n/)) {
    const [key, ...words] = line.replace(/#.*/, "").trim().split(/\s+/);
    if (key === "v") places.push(...words.slice(0, 3).map(Number));
    const corner = (one: string) => Number(one.split("/")[0]);
    if (key === "f") triangles.push(...fanOf(words.map(corner).map((c) => (c < 0 ? places.length / 3 + c : c - 1))));
  }
  return { positions: Float32Array.from(places), triangles: Uint32Array.from(triangles) };
}

function meshOfOff(text: string): ObstacleMesh {
  const [head, ...words] = text.replace(/#.*/g, "").trim().split(/\s+/), numbers = words.map(Number), [vertices, faces] = numbers, triangles: number[] = [];
  if (head !== "OFF") throw new Error(head);
  for (let face = 0, at = 3 + 3 * vertices; face < faces; ++face) {
    triangles.push(...fanOf(numbers.slice(at + 1, at + 1 + numbers[at])));
    at += 1 + numbers[at];
  }
  return { positions: Float32Array.from(numbers.slice(3, 3 + 3 * vertices)), triangles: Uint32Array.from(triangles) };
}
