// The messages between the page and the worker.
import type { GraspState, LinkState } from "../../module/links.js";
import type { NeedleState } from "../../module/needles.js";
import type { BundleInfo, Effects, Pose, RenderMesh } from "../../module/palpate.js";
import type { LinkState as DeviceState } from "./device_link";
import type { Nodule } from "./nodules";
import type { WorldScene } from "./world_scene";

export const TOOL_COUNT = 2; // that the pointer, the keys and devices hold
export const MOST_TOOLS = 8; // of a scene file, as palpate-run has them
export const TOUCH_HZ = 1000;
export const DEFORM_HZ = 100; // solves of the body beside the touch, as in palpate-run

export interface ToolShape {
  discRadius: number; // m, of the disc under contact "patch"
  friction: number; // of the law "coulomb"
}

// The target that the pointer gives a tool. The tool comes to the organ from `start`, outside of it; a released tool returns to
// `start` and vanishes.
export interface ToolTarget {
  start: Vector;
  point: Vector;
  grasp: Vector | null; // a tool that pulls goes here first, below the surface, and takes hold
  down: boolean; // false: released
}
// A finer mesh of the page; parents: of its last vertices the two between which each lies, [vertex][2]. Left out: there are none.
export type BoundMesh = Required<RenderMesh> & { parents?: Uint32Array };

// The runtime's effects, and whether a finer mesh of the page is bound.
export type PageEffects = Omit<Effects, "renderMesh"> & { fine?: boolean };

export type Vector = [number, number, number];
export type Edge = [heel: Vector, tip: Vector]; // of the page's scalpel, m

// The tools' positions, touch by touch: [step][tool][x y z], NaN without a tool; hold: [step][tool].
export interface Path {
  steps: number;
  points: Float64Array;
  hold: Uint8Array;
}

// A path that was played, and what was felt.
export interface Recording extends Path {
  forces: Float64Array; // [step][tool][x y z] N, on the tool
  effects: PageEffects;
  tool: ToolShape;
}

export type ToWorker =
  | { type: "fetch"; url: string }
  | { type: "open"; name: string; bytes: ArrayBuffer }
  | { type: "effects"; effects: PageEffects; tool: ToolShape; mesh?: BoundMesh | null } // mesh: that the effect `fine` binds; left out: as it is
  | { type: "tool"; index: number; target: ToolTarget }
  | { type: "blade"; edge: Edge | null; toughness: number } // where the pointer moves the scalpel, in a scene with the effect `cut`; null: it is let go. toughness: J/m^2
  | { type: "withdraw"; index: number } // takes a tool away at once; a touch of this tool alone is not recorded
  | { type: "frame"; buffer: ArrayBuffer | null }
  | { type: "replay"; path: Path | null } // null: the last touch
  | { type: "scene"; scene: WorldScene } // plays a scene file that holds or pierces the organ, in a world of its own; answered by "played"
  | { type: "save"; as: SavedFile } // answered by "saved"
  | { type: "path" } // answered by "path": what Replay plays
  | { type: "try"; path: Path } // answered by "tried"
  | { type: "measure"; place: Vector; normal: Vector; large: boolean } // what effects cost; large: those under large deformation too. Answered by "costs"
  | { type: "colour"; by: ColourBy } // what a frame's lengths are
  | { type: "field"; of: FieldOf } // what a frame's field is
  | { type: "link"; port: number | null } // connects to the bridge of devices; null: lets it go. Answered by "linked", again and again
  | { type: "language"; name: string } // of the sentences in "refused"
  | { type: "reset" };

export type ColourBy = "dent" | "displacement" | "nothing";
// What the section shows: the length of the displacement, m; von Mises' stress, Pa; the pressure, Pa.
export type FieldOf = "none" | "displacement" | "von-mises" | "pressure";
export type SavedFile = "scene" | "forces";

export interface Mesh {
  positions: Float32Array; // rest, [node][3] m, of the surface
  triangles: Uint32Array;
  tetrahedra: Uint32Array; // empty where the bundle has no interior
  region: Int32Array; // of each of these tetrahedra
  fixed: Int32Array; // surface nodes that are fixed in every direction
  touchable: Int32Array;
  soft: Int32Array; // triangles over an elastic foundation
  stiffness: Float64Array; // of that, along each one's normal, N/m^3
}

// What a scene's tool is drawn as, where it is not a finger or a probe.
export type ToolBody = { kind: "jaws"; closed: boolean } | { kind: "needle"; axis: Vector; length: number }; // axis: from the handle to the tip; m

export interface ToolFrame {
  point: Vector;
  force: Vector; // N, on the tool
  contacts: number;
  depth: number; // m, from the point where the tool met the organ; 0 before that
  normal: Vector | null; // outward, of the plane that its disc is drawn in, where the effect `dent` tells it
  radius?: number; // m, of its disc, jaws or shaft; left out: the page's
  body?: ToolBody;
}

// What holds tissue in a scene, to be told in words.
export type Hold =
  | { kind: "needle"; name: string; condition: NeedleState["condition"]; depth: number; isFull: boolean } // isFull: it has no place left
  | { kind: "grasp"; name: string; condition: GraspState["condition"] }
  | { kind: "link"; name: string; condition: LinkState["condition"]; tension: number }; // N

export const MOST_LINKS_DRAWN = 1000; // as many as palpate.h has

// A stretch of a link, to be drawn.
export interface DrawnLink {
  kind: "thread" | "spring" | "clip";
  ends: [Vector, Vector]; // m, in the world
  condition: LinkState["condition"];
}

export interface Sample {
  tool: number;
  contact: number; // counts the tool's contacts: samples of two contacts belong to two curves
  depth: number; // m
  force: number; // N
}

// The surface of an organ that is cut, in place of the bundle's triangles.
export interface DrawnSurface {
  triangles: Uint32Array; // [triangle][3] nodes; the bundle's own first
  isLip: Uint8Array; // [triangle]
  made: Int32Array; // [][2]: the nodes that cuts have made, and those that they come from, at whose places they lie at rest
}

// What has been cut in a scene whose organ can be cut.
export interface CutFigures {
  area: number; // m^2, at rest
  faces: number;
  pieces: number;
  isFull: boolean; // nothing more can be cut
  force: number; // N, the largest on a blade
  edges: Vector[][]; // of the blades that are there, from heel to tip
}

// What the frames of a page of one organ and of several hold.
export interface TouchFrame {
  type: "frame";
  buffer: ArrayBuffer; // see frameArrays
  tools: (ToolFrame | null)[];
  changed: boolean; // the shape differs from that of the frame before
  flags: number; // of the last steps
  touches: number; // since the last frame
  at: number; // ms, the worker's clock
  touchUs: number; // 0: nothing was timed since the last frame
  shapeUs: number;
  lost: number; // touches that were left out because the loop was late; what plays makes them later, and takes longer
  made: number; // those that were due and were made
  playing: number | null; // s of the tools of a scene that plays
  lasts: number; // s of that scene
  speed: number; // times as fast as in life, where the device keeps up
  holds: Hold[]; // of that scene
  links: DrawnLink[];
  obstacles: Pose[]; // where those of the scene are; none: they are not there
}

export interface Frame extends TouchFrame {
  field: { of: FieldOf; values: Float32Array } | null; // [node], those of the interior too; null: the page asks for none
  inside: number; // nodes of the interior; 0: not computed
  vertices: number; // vertices of the finer mesh; 0: none is bound
  samples: Sample[]; // since the last frame
  cut: CutFigures | null; // null: nothing can be cut
  surface?: DrawnSurface | null; // from now on; null: the bundle's own triangles; left out: as before
  replaying: boolean;
  engineBytes: number; // the runtime's whole memory, which never shrinks
  recordedSteps: number; // of the touch that a replay plays and a file would hold; 0: none
}

// The middle of some times, and where 80 % of them lie, us.
export interface Times {
  median: number;
  low: number;
  high: number;
}

// A path that was played as fast as the device can, in a scene of its own that remembered nothing.
export interface Trial {
  forces: Float64Array; // [step][tool][x y z] N, on the tool
  samples: Sample[]; // force against depth
  tools: (ToolFrame | null)[]; // at farthestStep of the path
  shape: { buffer: ArrayBuffer; inside: number; vertices: number }; // then; see frameArrays
  touchUs: Times; // of means over TOUCHES_TIMED touches, the clock of a browser being coarser than a touch
  shapeUs: Times;
  flags: number; // of all its steps
}

export const TOUCHES_TIMED = 50;

export const frameBytes = (nodes: number, inside: number, vertices: number) => 16 * nodes + 12 * inside + 28 * vertices;

// The parts of a frame's buffer: surface nodes, inner nodes, finer mesh.
export function frameArrays(buffer: ArrayBuffer, nodes: number, inside: number, vertices: number) {
  let at = 0;
  const next = (count: number) => new Float32Array(buffer, (at += 4 * count) - 4 * count, count);
  return { positions: next(3 * nodes), inside: next(3 * inside), lengths: next(nodes), fine: { positions: next(3 * vertices), normals: next(3 * vertices), lengths: next(vertices) } };
}

export interface Cost {
  effect: string;
  touchUs: number; // the time that this effect adds, or would add
  shapeUs: number;
}

export type FromWorker =
  | { type: "started" } // the first of all
  | { type: "progress"; done: number; total: number }
  | { type: "opened"; name: string; mesh: Mesh; nodules: Nodule[]; info: BundleInfo; provenance: Record<string, unknown>; bytes: number; simd: boolean }
  | { type: "refused"; name: string; what: "bundle" | "effects" | "absent" | "download" | "runtime" | "scene"; message: string; byteOffset: number }
  | { type: "accepted"; effects: PageEffects; tool: ToolShape }
  | { type: "replayed"; positions: Float32Array; fine: Float32Array; touched: boolean; nearest: number } // the nodes of the last shape, m, and the finer mesh's; whether a tool met the organ, and else the least distance, m, between a tool and the nodes at rest
  | { type: "played"; forces: Float64Array } // the tools of "scene" have come to their end; [step][tool][x y z] N, on the tool
  | { type: "saved"; as: SavedFile; text: string; difference: number } // difference: of the file's forces from those felt, N
  | { type: "costs"; costs: Cost[]; left: number; interrupted: boolean } // those that are known, again and again; left: to be measured. interrupted: by a touch
  | { type: "path"; path: Path | null }
  | { type: "linked"; state: DeviceState; tools: string[] } // tools: of devices that are there
  | { type: "tried"; trial: Trial }
  | Frame;
