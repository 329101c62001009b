// A scene of several organs, as its file has it.
import type { Pose } from "../../module/palpate.js";
import type { PageEffects, Vector } from "./messages";
import type { Rates } from "./scene_reader";

export interface SceneOrgan {
  name: string;
  bundle: string | null; // relative to the scene's folder
  pose: Pose;
  effects: PageEffects;
}

export interface SceneMotion {
  name: string;
  organ: number;
  rows: number[][] | null; // s, amount
  sine: { amplitude: number; period: number; mean: number } | null; // period: s
}

export interface SceneGrasp {
  near: Vector; // m, in the organ's frame
  opposite: Vector | null;
  radius: number; // m
  friction?: number;
  clampForce?: number; // N
  closing: number[][] | null; // s, m
  closed: [number, number][]; // s; empty: always
}

export interface SceneNeedle {
  entry: Vector | null; // m, in the organ's frame; null: the tool's place
  direction: Vector | null; // of length 1, from the handle to the tip, in the organ's frame; null: against the surface's normal
  radius: number; // m
  friction: number; // N/m
  punctureForce: number; // N
  cuttingForce: number; // N
  spacing?: number; // m
}

export interface SceneLink {
  name: string;
  kind: "thread" | "spring" | "clip";
  organs: number[]; // of each place
  isBetween: boolean; // a link of the world; else of one organ
  places: Vector[]; // m, in the frame of each organ
  world: Vector | null; // one more end, m
  restLength: number[][] | null; // s, m
  stiffness: number[][] | null; // s, N/m
  breakingForce?: number; // N
  radius?: number; // m
}

// Nodes that move as the tool has moved since its start.
export interface SceneGrip {
  nearest: Vector | null; // m, in the organ's frame: the touchable node that is nearest
  box: [Vector, Vector] | null; // its corners, m: the touchable nodes in it
  axes: number; // bits 1, 2, 4: along x, y, z
}

export const SIDES = ["foremost", "hindmost", "leftmost", "rightmost", "uppermost", "lowest"] as const;
export type Side = (typeof SIDES)[number];

export interface ScenePlace {
  near: Vector | null; // m, in the organ's frame
  at: Side | null; // of the patient, where `near` is null
  depth: number[][]; // s, m
}

// A weight or a traction on a patch.
export interface SceneLoad {
  name: string;
  organ: number;
  near: Vector | null; // m, in the organ's frame
  at: Side | null; // of the patient, where `near` is null
  radius: number; // m
  rows: number[][]; // s, x, y, z: N in all, or Pa
  perArea: boolean;
  inWorld: boolean;
}

// A rigid surface that organs do not enter.
export interface SceneObstacle {
  name: string;
  kind: "rectangle" | "disc" | "mesh";
  organs: number[]; // that it holds off
  size: [number, number]; // m: of a rectangle its lengths, of a disc its radius and 0
  positions: Float32Array; // m, of its surface in its frame: what is drawn, and of a mesh what is computed
  triangles: Uint32Array;
  normal: Vector; // of any length, to the side of the organ
  path: number[][]; // s, x, y, z m
  turn: number[][]; // s, and degrees about x, y, z; empty: it does not turn
  friction: number;
  depth?: number; // m
}

// A line that cuts the organ of a scene of one organ.
export interface SceneBlade {
  name: string;
  edge: Vector[]; // m, in the blade's frame, from heel to tip
  path: number[][]; // s, x, y, z m
  turn: number[][] | null; // s, and degrees about x, y, z; null: it does not turn
  cuts: [number, number][]; // s: when it is there; empty: always
  toughness: number; // J/m^2; 0: it feels nothing
  friction: number; // Pa, of its flanks
  width: number; // m, of these behind the edge
  direction: Vector | null; // of length 1, where the edge looks, in its frame; null: without toughness
}

export interface SceneTool {
  name: string;
  organ: number; // that `place`, `grips`, `grasp` and `needle` are on
  points: Vector[]; // m, in the tool's frame
  grips: SceneGrip[];
  path: number[][] | null; // s, x, y, z m
  turn: number[][] | null; // s, and degrees about x, y, z: an axis whose length is the angle
  place: ScenePlace | null;
  hold: boolean;
  discRadius: number; // m
  friction: number;
  away: [number, number][]; // s
  grasp: SceneGrasp | null;
  needle: SceneNeedle | null; // its tip is the tool's position
}

export interface WorldScene {
  name: string;
  unit: number; // metres in a unit of the amounts of pistons
  rates: Rates;
  pairs: number;
  friction: number; // between organs
  forceLimit?: number; // N
  forceSlew?: number; // N/s
  maxPoints?: number;
  maxContactNodes?: number;
  needlePlaces?: number;
  obstacleNodes?: number;
  cutPoints?: number;
  cutLips?: number;
  organs: SceneOrgan[];
  motions: SceneMotion[];
  loads: SceneLoad[];
  obstacles: SceneObstacle[];
  blades: SceneBlade[];
  tools: SceneTool[];
  links: SceneLink[];
}
