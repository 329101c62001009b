// The messages between the page of several organs and its worker.
import type { Effects } from "../../module/palpate.js";
import type { ColourBy, Mesh, ToolTarget, TouchFrame } from "./messages";
import type { ClockState } from "./motion_clocks";
import type { WorldScene } from "./world_scene";

// A bundle's file. Several organs may have one.
export interface WorldFile {
  name: string;
  source: string | ArrayBuffer; // an address, or the bytes
}

// How the pointer's tools touch the organs; the scene's own tools play under what its file says.
export interface WorldSettings {
  discRadius: number; // m
  law: Effects["law"];
  touch: boolean; // organs press one another
  friction: number; // between organs
}

export type ToWorldWorker =
  | { type: "open"; scene: WorldScene; files: WorldFile[]; of: number[]; settings: WorldSettings } // of: the file of each organ
  | { type: "settings"; settings: WorldSettings } // answered by "accepted" or "refused"
  | { type: "tool"; index: number; target: ToolTarget }
  | { type: "withdraw"; index: number }
  | { type: "motion"; name: string; plays: boolean; share?: number }
  | { type: "play" } // the scene's own tools, from the begin
  | { type: "frame"; buffer: ArrayBuffer | null }
  | { type: "colour"; by: ColourBy }
  | { type: "language"; name: string } // of the sentences in "refused"
  | { type: "reset" };

export interface OrganForces {
  tools: number; // N, by all tools
  organs: number; // N, by all other organs
}

// Its buffer: the surface nodes of all organs, one organ after the other.
export interface WorldFrame extends TouchFrame {
  organs: OrganForces[];
  clocks: ClockState[];
}

export interface OpenedOrgan {
  name: string;
  mesh: Mesh; // at rest, in the world
  nodes: number; // of the whole mesh
}

export type FromWorldWorker =
  | { type: "progress"; name: string; done: number; total: number }
  | { type: "opened"; organs: OpenedOrgan[]; frame: string; clocks: ClockState[] } // frame: of the first organ's coordinates
  | { type: "accepted"; settings: WorldSettings }
  | { type: "refused"; what: "world" | "settings" | "play"; message: string; byteOffset: number }
  | { type: "played"; forces: Float64Array } // the scene's tools have come to their end; [step][tool][x y z] N, on the tool
  | WorldFrame;
