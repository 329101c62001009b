// The runtime in a browser, a worker or Node: the C API of runtime/include/palpate/palpate.h and palpate_world.h, compiled to WebAssembly.
// Units, costs and the meaning of every field are those of these headers. Arrays named "view" lie in the module's own memory and
// are not copied. Opening a bundle or creating a scene may move them, so ask for them again afterwards; a step never moves them.
import { ARGUMENT, Heap, HeapBytes, PalpateError, readFields } from "./heap.js";
import { Scene } from "./scene.js";
import { readKeys, SceneDef } from "./scene_def.js";
import { reader } from "./struct.js";
import { World } from "./world.js";
export * from "./flags.js";
export { PalpateError, Scene, World };

/** @typedef {{points?: ArrayLike<number>, grips?: Grip[], hold?: boolean, discRadius?: number, friction?: number, id?: number,
 *   reference?: ArrayLike<number>, grasp?: Grasp, needle?: Needle, givenForce?: GivenForce, organ?: number}} Tool
 *  id: 0 or more, by which the scene knows the tool from touch to touch; left out: its index.
 *  points: x y z after one another, m, in the world; discRadius: m, of the flat disc that each point presses on the organ (contact
 *  "patch"); reference: x y z, m, in the world, about which torque() is taken; left out: no torque is computed; grasp: the jaws are
 *  closed in each touch that has it (effects: grasps); needle: it is in or before the tissue in each touch that has it (effects: needles);
 *  givenForce: it presses with this force, wherever that brings it (effects: forceControl);
 *  organ: of a world, which the grips, the grasp, the needle and the force hold; left out: the first one. */
/** @typedef {{node?: number, triangle?: number, barycentric?: number[], displacement: ArrayLike<number>, axes?: number}} Grip
 *  Holds a touchable node, or a point of a triangle (barycentric weights); give node or triangle. At a displacement from rest, m. axes: bits 1, 2, 4
 *  impose x, y, z. */
// Printed from palpate_scene_key():
/** @typedef {{
 *   collision?: "off" | "rest" | "deformed", contact?: "node" | "triangle" | "point" | "patch",
 *   law?: "sticking" | "sliding" | "unilateral" | "coulomb", force?: "off" | "linear" | "response", shape?: "off" | "surface" | "volume",
 *   radial?: "off" | "response", preload?: boolean | "off" | "on", maxTools?: number, maxPoints?: number, maxContactNodes?: number,
 *   maxOperations?: number, forceLimit?: number, forceSlew?: number, torqueLimit?: number, torqueSlew?: number, maxToolSpeed?: number,
 *   releaseDistance?: number, deformation?: "linear" | "large" | "large-beside" | "large-renewed" | "large-auto", grasps?: boolean,
 *   needles?: boolean, needlePlaces?: number, motions?: boolean, maxLinks?: number, report?: "off" | "contacts",
 *   queries?: boolean | "off" | "on", dent?: "off" | "discs", inside?: boolean | "off" | "on", forceControl?: boolean,
 *   obstacleNodes?: number, crossings?: boolean | "off" | "on", crossingsCalls?: number, crossingsOperations?: number,
 *   cut?: boolean | "off" | "on", cutNodes?: number, cutRank?: number, cutOperations?: number, cutPoints?: number, cutLips?: number,
 *   cutRebase?: number,
 * }} SceneKeys */
// (end of what is printed)
/** @typedef {SceneKeys & {relaxation?: {share: number, time: number}[], loads?: {centre: ArrayLike<number>, radius: number}[], obstacles?: Obstacle[], renderMesh?: RenderMesh, fineSurface?: FineSurface}} Effects
 *  The effects of a scene; those left out have the values of palpate_default_scene_def. */
/** @typedef {{positions: Float32Array, normals?: Float32Array}} RenderMesh
 *  A finer mesh that follows the surface, [vertices][3] m in the bundle's frame; which creating the scene reads and does not keep. */
/** @typedef {{positions: Float32Array, triangles: Int32Array}} FineSurface
 *  A closed surface that tools meet in place of the bundle's triangles: [vertices][3] m in the bundle's frame, and [triangles][3]
 *  vertices, counter-clockwise from outside; which creating the scene reads and does not keep. */
/** @typedef {{position?: ArrayLike<number>, orientation?: ArrayLike<number>, velocity?: ArrayLike<number>,
 *   angularVelocity?: ArrayLike<number>}} Pose
 *  Where the organ's frame is in the world: m; a quaternion w x y z of length 1; m/s; rad/s about the world's axes. What is left
 *  out is the identity, or zero. */
/** @typedef {import("./links.js").Link} Link */
/** @typedef {import("./links.js").WorldLink} WorldLink */
/** @typedef {import("./links.js").Grasp} Grasp */
/** @typedef {import("./given_force.js").GivenForce} GivenForce */
/** @typedef {import("./needles.js").Needle} Needle */
/** @typedef {import("./obstacles.js").Obstacle} Obstacle */
/** @typedef {import("./obstacles.js").ObstacleState} ObstacleState */
/** @typedef {import("./cuts.js").Blade} Blade */
/** @typedef {import("./cuts.js").BladeState} BladeState */
/** @typedef {import("./cuts.js").CutState} CutState */
/** @typedef {import("./cuts.js").CutSurface} CutSurface */
/** @typedef {import("./needles.js").NeedleState} NeedleState */
/** @typedef {import("./links.js").LinkState} LinkState */
/** @typedef {import("./links.js").GraspState} GraspState */
/** @typedef {import("./given_force.js").GivenForceState} GivenForceState */
/** @typedef {import("./contact_report.js").ContactReport} ContactReport */
/** @typedef {import("./contact_report.js").SurfaceHit} SurfaceHit */
/** @typedef {import("./scene.js").MotionState} MotionState */
/** @typedef {import("./scene.js").LoadState} LoadState */
/** @typedef {import("./inside.js").Measures} Measures */
/** @typedef {import("./crossings.js").Crossing} Crossing */
/** @typedef {import("./inside.js").Places} Places */
/** @typedef {import("./inside.js").Place} Place */
/** @typedef {import("./world.js").Organ} Organ */
/** @typedef {import("./world.js").WorldOptions} WorldOptions */
/** @typedef {import("./world.js").OrganState} OrganState */
/** @typedef {import("./world.js").Pair} Pair */
/** @typedef {{name: string, kind: "piston" | "rotation" | "field" | "pressure" | "gravity"}} Motion  kind: what its amounts are in: m, rad,
 *  1, Pa, m/s^2 */
/** @typedef {{name: string, half: string, sections: string, mappedBytes: number}} PlanPass */
/** @typedef {{identity: bigint, nodeCount: number, surfaceNodeCount: number, triangleCount: number, tetrahedronCount: number,
 *   touchableCount: number, hasInterior: boolean, hasRadial: boolean, hasForce: boolean, hasPreload: boolean, hasLarge: boolean, hasCut: boolean, motionCount: number}} BundleInfo */

const MOTION_KINDS = /** @type {const} */ (["piston", "rotation", "field", "pressure", "gravity"]); // of palpate.h, from 1 on
const INFO = {
  integer: ["node_count", "surface_node_count", "triangle_count", "tetrahedron_count", "touchable_count", "has_interior", "has_radial", "has_force", "has_preload",
    "has_large", "motion_count"],
};
const REGION = 12, FOUNDATION = 21, YOUNG = 30, CUT_NODES = 110; // sections of the bundle (formats/BUNDLE.md)

// A WebAssembly module with one function that uses a v128: valid where the engine has SIMD.
const SIMD_PROBE = new Uint8Array([0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 10, 1, 8, 0, 65, 0,
  253, 15, 253, 98, 11]);
/** @returns {boolean} whether this engine takes palpate.wasm built with SIMD */
export const hasSimd = () => typeof WebAssembly === "object" && WebAssembly.validate(SIMD_PROBE);

/** Compiles and starts the runtime. Each thread needs its own; bundles and scenes belong to the runtime that made them.
 *  @param {BufferSource | Promise<Response>} wasm the bytes of palpate.wasm, or fetch(...) of them
 *  @returns {Promise<Runtime>} */
export async function loadRuntime(wasm) {
  const imports = { env: { emscripten_notify_memory_growth() {} } };  // views check memory.buffer themselves
  const source = wasm instanceof Promise ? await wasm : wasm;
  let bytes;
  if (source instanceof Response) {
    if (!source.ok) throw new Error(`${source.url}: the server answered ${source.status}`);
    bytes = await source.arrayBuffer();
  } else {
    bytes = source;
  }
  const begin = new TextDecoder().decode(ArrayBuffer.isView(bytes) ? new Uint8Array(bytes.buffer, bytes.byteOffset, 4) : bytes.slice(0, 4));
  if (begin !== "\0asm") throw new Error(`${source instanceof Response ? source.url : "palpate.wasm"}: expected a WebAssembly module, found "${begin}"`);
  return new Runtime((await WebAssembly.instantiate(bytes, imports)).instance);
}

// What stands for each function that a module does not have: web/core/palpate.wasm has the core alone.
const ABSENT = new Proxy({}, {
  get(_, name) {
    return () => {
      throw new PalpateError(ARGUMENT, `this palpate.wasm does not have ${String(name)}: load the module with all effects`);
    };
  },
});

export class Runtime {
  /** @param {WebAssembly.Instance} instance */
  constructor(instance) {
    /** @type {any} the functions of palpate.h, and malloc and free; pointers are numbers */
    this.api = Object.create(ABSENT, Object.getOwnPropertyDescriptors(instance.exports));
    this.api._initialize();
    this.heap = new Heap(this.api);
    this.fields = readFields(this.api, this.heap);
    this.keys = readKeys(this);
  }

  /** @param {string} name "struct" (its size) or "struct.field" (its offset) @returns {number} bytes */
  field(name) {
    const offset = this.fields.get(name);
    if (offset === undefined) throw new Error(`palpate.wasm has no ${name}; build it and palpate.js from the same sources`);
    return offset;
  }

  /** Copies the bytes into the module's memory, once, and checks them. @param {Uint8Array | BufferSource} given @returns {Bundle} */
  openBundle(given) {
    const bytes = ArrayBuffer.isView(given) ? new Uint8Array(given.buffer, given.byteOffset, given.byteLength) : new Uint8Array(given);
    const store = new HeapBytes(this.heap, bytes.length);
    try {
      store.append(bytes);
      return new Bundle(this, store);
    } catch (error) {
      store.release();
      throw error;
    }
  }

  /** The same for bytes that arrive piece by piece; each piece is copied to its final address.
   *  @param {ReadableStream<Uint8Array>} stream @param {number} expectedBytes 0 if unknown
   *  @param {(doneBytes: number) => void} [progress] @returns {Promise<Bundle>} */
  async openBundleStream(stream, expectedBytes, progress) {
    const store = new HeapBytes(this.heap, expectedBytes || 1 << 24);
    try {
      const reader = stream.getReader();
      for (let piece = await reader.read(); !piece.done; piece = await reader.read()) {
        store.append(piece.value);
        progress?.(store.count);
      }
      return new Bundle(this, store);
    } catch (error) {
      store.release();
      throw error;
    }
  }

  /** Several organs and the tools that touch them. @param {Organ[]} organs @param {WorldOptions} [options] @returns {World} */
  createWorld(organs, options = {}) {
    return new World(this, organs, options);
  }

  /** What a save of the C API writes, as a copy. @param {number} size @param {(at: number, bytes: number, error: number) => number} save */
  savedState(size, save) {
    const at = this.heap.take(size);
    try {
      this.check((error) => save(at, size, error));
      return this.heap.bytes.slice(at, at + size);
    } finally {
      this.heap.release(at);
    }
  }

  /** Gives the bytes to a restore of the C API. @param {Uint8Array} state @param {(at: number, bytes: number, error: number) => number} restore */
  restoreState(state, restore) {
    const at = this.heap.take(state.length + 8);
    try {
      this.heap.bytes.set(state, at);
      this.check((error) => restore(at, state.length, error));
    } finally {
      this.heap.release(at);
    }
  }

  /** Reads the structs whose addresses `next` gives, up to a zero. @template Read @param {(index: number) => number} next
   *  @param {(at: number) => Read} read @returns {Read[]} */
  list(next, read) {
    const found = [];
    for (let at = 0; (at = next(found.length) >>> 0) !== 0;) found.push(read(at));
    return found;
  }

  /** Makes a call that returns a status and fills a palpate_error; throws where it failed. @param {(error: number) => number} call */
  check(call) {
    this.open((_, error) => call(error));
  }

  /** Makes a call that fills a pointer and a palpate_error. @param {(out: number, error: number) => number} call
   *  @returns {number} the pointer */
  open(call) {
    const { heap } = this;
    const size = this.field("palpate_error"), error = heap.take(size + 8), out = error + size;
    heap.bytes.fill(0, error, out + 8);
    const status = call(out, error), pointer = heap.u32(out);
    const text = heap.text(error + this.field("palpate_error.text"));
    const offset = Number(heap.data.getBigUint64(error + this.field("palpate_error.byte_offset"), true));
    heap.release(error);
    if (status !== 0) throw new PalpateError(status, text, offset);
    return pointer;
  }
}

export class Bundle {
  /** @param {Runtime} runtime @param {HeapBytes} store */
  constructor(runtime, store) {
    this.runtime = runtime;
    this.store = store;
    this.byteCount = store.count;
    const { api, heap } = runtime;
    this.pointer = runtime.open((out, error) => api.palpate_bundle_open(store.start, store.count, 0, out, error));
    /** @type {BundleInfo} */
    this.info = this.#describe();
    const size = heap.take(4), text = api.palpate_bundle_provenance(this.pointer, size) >>> 0;
    /** JSON: organ, element, sources of the bundle (formats/BUNDLE.md) */
    this.provenance = heap.utf8(text, heap.u32(size));
    heap.release(size);
  }

  #describe() {
    const { api, heap } = this.runtime;
    const at = heap.take(this.runtime.field("palpate_bundle_info"));
    api.palpate_bundle_fill_info(this.pointer, at, this.runtime.field("palpate_bundle_info"));
    const info = reader(this.runtime, "palpate_bundle_info", at).all(INFO);
    for (const name of Object.keys(info)) if (name.startsWith("has")) info[name] = !!info[name];
    info.identity = heap.data.getBigUint64(at + this.runtime.field("palpate_bundle_info.identity"), true);
    heap.release(at);
    info.hasCut = this.#section(CUT_NODES).bytes > 0;
    return info;
  }

  /** view [N][3] m: positions as meshed, surface nodes first */
  get nodes() {
    return this.#view(Float64Array, "nodes", 3 * this.info.nodeCount);
  }
  /** view [F][3] */
  get triangles() {
    return this.#view(Int32Array, "triangles", 3 * this.info.triangleCount);
  }
  /** view [E][4] */
  get tetrahedra() {
    return this.#view(Int32Array, "tetrahedra", 4 * this.info.tetrahedronCount);
  }
  /** view [S]: node indices */
  get touchable() {
    return this.#view(Int32Array, "touchable", this.info.touchableCount);
  }
  /** view [N][3]: 1 where a node is fixed along x, y or z */
  get fixed() {
    return this.#view(Uint8Array, "fixed", 3 * this.info.nodeCount);
  }
  /** @template View @param {new (buffer: ArrayBuffer, at: number, count: number) => View} Kind @param {string} name @param {number} count */
  #view(Kind, name, count) {
    const { api, heap } = this.runtime, at = api[`palpate_bundle_${name}`](this.pointer) >>> 0;
    return new Kind(heap.buffer, at, count);
  }

  /** view [F][2] N/m^3: the stiffness of the elastic foundation under each triangle, along its normal and along the surface; zeros where
   *  there is none. Empty where the bundle has no foundation. */
  get foundation() {
    const { at, bytes } = this.#section(FOUNDATION);
    return new Float64Array(this.runtime.heap.buffer, at, bytes / 8);
  }
  /** view [E]: the region of each tetrahedron, an index into young */
  get region() {
    const { at, bytes } = this.#section(REGION);
    return new Int32Array(this.runtime.heap.buffer, at, bytes / 4);
  }
  /** view [R] Pa: Young's modulus of each region */
  get young() {
    const { at, bytes } = this.#section(YOUNG);
    return new Float64Array(this.runtime.heap.buffer, at, bytes / 8);
  }

  /** The motions that a scene with motions: true can set, in their order: copies. @returns {Motion[]} */
  get motions() {
    const { runtime } = this, { api, heap } = runtime, size = runtime.field("palpate_motion_info"), at = heap.take(size);
    try {
      return Array.from({ length: this.info.motionCount }, (_, motion) => {
        runtime.check((error) => api.palpate_bundle_motion(this.pointer, motion, at, size, error));
        const kind = MOTION_KINDS[reader(runtime, "palpate_motion_info", at).integer("kind") - 1];
        return { name: heap.text(at + runtime.field("palpate_motion_info.name")), kind };
      });
    } finally {
      heap.release(at);
    }
  }

  // Where a section lies in the module's memory, by the bundle's index, which opening checked. No bytes where the bundle has none.
  #section(/** @type {number} */ id) {
    const { heap } = this.runtime, { start } = this.store;
    const number = (/** @type {number} */ at) => Number(heap.data.getBigUint64(at, true));
    for (let entry = start + 64, end = entry + 72 * heap.u32(start + 12); entry < end; entry += 72)
      if (heap.u32(entry) === id) return { at: start + number(entry + 48), bytes: number(entry + 56) };
    return { at: 0, bytes: 0 };
  }

  /** Compares every section with its checksum; throws where one differs. Reads the whole bundle. */
  check() {
    this.runtime.check((error) => this.runtime.api.palpate_bundle_check(this.pointer, error));
  }

  /** @param {Effects} [effects] @returns {Scene} */
  createScene(effects = {}) {
    const { runtime } = this, def = new SceneDef(runtime, effects);
    try {
      return new Scene(this, def, runtime.open((out, error) => runtime.api.palpate_scene_create(this.pointer, def.at, out, error)));
    } finally {
      def.release();
    }
  }

  /** Its scenes must be destroyed first. */
  close() {
    this.runtime.api.palpate_bundle_close(this.pointer);
    this.store.release();
  }
}
