// The runtime in a browser, a worker or Node: the C API of runtime/include/palpate/palpate.h, compiled to WebAssembly.
// Units, costs and the meaning of every field are those of palpate.h. Arrays named "view" lie in the module's own memory and
// are not copied. Opening a bundle or creating a scene may move them, so ask for them again afterwards; a step never moves them.
import { readHit, readReport } from "./contact_report.js";
import { STEP_BAD_INPUT, STEP_OTHER_BUNDLE } from "./flags.js";
import { ARGUMENT, Heap, HeapBytes, PalpateError, readFields } from "./heap.js";
import { fillGrasp, fillLink, readGraspState, readLinkState } from "./links.js";
import { fillSceneDef, lendFineSurface, lendRenderMesh } from "./scene_def.js";
export * from "./flags.js";
export { PalpateError };

/** @typedef {{points?: ArrayLike<number>, grips?: Grip[], hold?: boolean, discRadius?: number, friction?: number, id?: number,
 *   reference?: ArrayLike<number>, grasp?: Grasp}} Tool
 *  id: 0 or more, by which the scene knows the tool from touch to touch; left out: its index.
 *  points: x y z after one another, m, in the world; discRadius: m, of the flat disc that each point presses on the organ (contact
 *  "patch"); reference: x y z, m, in the world, about which torque() is taken; left out: no torque is computed; grasp: the jaws are
 *  closed in each touch that has it (effects: grasps). */
/** @typedef {{node?: number, triangle?: number, barycentric?: number[], displacement: ArrayLike<number>, axes?: number}} Grip
 *  Holds a touchable node, or a point of a triangle (barycentric weights); give node or triangle. At a displacement from rest, m. axes: bits 1, 2, 4
 *  impose x, y, z. */
/** @typedef {{
 *   collision?: "off" | "rest" | "deformed", contact?: "node" | "triangle" | "point" | "patch",
 *   law?: "sticking" | "sliding" | "unilateral" | "coulomb", force?: "off" | "linear" | "response",
 *   shape?: "off" | "surface" | "volume", radial?: "off" | "response", preload?: boolean,
 *   deformation?: "linear" | "large" | "large-beside" | "large-renewed",
 *   queries?: "off" | "on", report?: "off" | "contacts", dent?: "off" | "discs",
 *   relaxation?: {share: number, time: number}[], renderMesh?: RenderMesh, fineSurface?: FineSurface,
 *   maxTools?: number, maxPoints?: number, maxContactNodes?: number, forceLimit?: number, forceSlew?: number,
 *   torqueLimit?: number, torqueSlew?: number, maxToolSpeed?: number, releaseDistance?: number, maxOperations?: number,
 *   maxLinks?: number, grasps?: boolean
 * }} Effects The effects of a scene; those left out have the values of palpate_default_scene_def. */
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
/** @typedef {import("./links.js").Grasp} Grasp */
/** @typedef {import("./links.js").LinkState} LinkState */
/** @typedef {import("./links.js").GraspState} GraspState */
/** @typedef {import("./contact_report.js").ContactReport} ContactReport */
/** @typedef {import("./contact_report.js").SurfaceHit} SurfaceHit */
/** @typedef {{name: string, half: string, sections: string, mappedBytes: number}} PlanPass */
/** @typedef {{identity: bigint, nodeCount: number, surfaceNodeCount: number, triangleCount: number, tetrahedronCount: number,
 *   touchableCount: number, hasInterior: boolean, hasRadial: boolean, hasForce: boolean, hasPreload: boolean, hasLarge: boolean}} BundleInfo */

const GRIP_NODE = 1, GRIP_SURFACE_POINT = 2;
const REGION = 12, FOUNDATION = 21, YOUNG = 30; // sections of the bundle (formats/BUNDLE.md)

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
  return new Runtime((await WebAssembly.instantiate(bytes, imports)).instance);
}

export class Runtime {
  /** @param {WebAssembly.Instance} instance */
  constructor(instance) {
    /** @type {any} the functions of palpate.h, and malloc and free; pointers are numbers */
    this.api = instance.exports;
    this.api._initialize();
    this.heap = new Heap(this.api);
    this.fields = readFields(this.api, this.heap);
  }

  /** @param {string} name "struct" (its size) or "struct.field" (its offset) @returns {number} bytes */
  field(name) {
    const offset = this.fields.get(name);
    if (offset === undefined) throw new Error(`palpate.wasm has no ${name}; build it and palpate.js from the same sources`);
    return offset;
  }

  /** Copies the bytes into the module's memory, once, and checks them. @param {Uint8Array} bytes @returns {Bundle} */
  openBundle(bytes) {
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
    const number = (/** @type {string} */ name) => heap.i32(at + this.runtime.field(`palpate_bundle_info.${name}`));
    const info = {
      identity: heap.data.getBigUint64(at + this.runtime.field("palpate_bundle_info.identity"), true), nodeCount: number("node_count"), surfaceNodeCount: number("surface_node_count"),
      triangleCount: number("triangle_count"), tetrahedronCount: number("tetrahedron_count"),
      touchableCount: number("touchable_count"), hasInterior: !!number("has_interior"), hasRadial: !!number("has_radial"),
      hasForce: !!number("has_force"), hasPreload: !!number("has_preload"), hasLarge: !!number("has_large"),
    };
    heap.release(at);
    return info;
  }

  /** view [N][3] m: positions as meshed, surface nodes first */
  get nodes() {
    return new Float64Array(this.runtime.heap.buffer, this.runtime.api.palpate_bundle_nodes(this.pointer) >>> 0, 3 * this.info.nodeCount);
  }
  /** view [F][3] */
  get triangles() {
    return new Int32Array(this.runtime.heap.buffer, this.runtime.api.palpate_bundle_triangles(this.pointer) >>> 0, 3 * this.info.triangleCount);
  }
  /** view [E][4] */
  get tetrahedra() {
    return new Int32Array(this.runtime.heap.buffer, this.runtime.api.palpate_bundle_tetrahedra(this.pointer) >>> 0, 4 * this.info.tetrahedronCount);
  }
  /** view [S]: node indices */
  get touchable() {
    return new Int32Array(this.runtime.heap.buffer, this.runtime.api.palpate_bundle_touchable(this.pointer) >>> 0, this.info.touchableCount);
  }
  /** view [N][3]: 1 where a node is fixed along x, y or z */
  get fixed() {
    return new Uint8Array(this.runtime.heap.buffer, this.runtime.api.palpate_bundle_fixed(this.pointer) >>> 0, 3 * this.info.nodeCount);
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
    return new Scene(this, effects);
  }

  /** Its scenes must be destroyed first. */
  close() {
    this.runtime.api.palpate_bundle_close(this.pointer);
    this.store.release();
  }
}

export class Scene {
  #toolCount = 0;
  // Addresses in the module's memory: tools, their points and grips, contacts, the palpate_shape_out and its arrays.
  #memory = 0;
  #toolsAt = 0;
  #pointsAt = 0;
  #gripsAt = 0;
  #contactsAt = 0;
  #contactsBytes = 0;
  #shapeAt = 0;
  #displacementsAt = 0;
  #positionsAt = 0;
  #skinAt = 0;
  #skinPositionsAt = 0;
  #skinNormalsAt = 0;
  #discNormalsAt = 0;
  #normalsAt = 0;
  #hitAt = 0;
  #poseAt = 0;
  #numbersAt = 0; // six doubles: what a query asks
  #graspsAt = 0;
  #linksAt = 0;
  #touched = false;

  /** @param {Bundle} bundle @param {Effects} effects */
  constructor(bundle, effects) {
    const { runtime } = bundle, { api, heap } = runtime;
    this.bundle = bundle;
    this.runtime = runtime;
    const def = heap.take(runtime.field("palpate_scene_def"));
    /** vertices of the render mesh, which skin() fills */
    this.vertexCount = (effects.renderMesh?.positions.length ?? 0) / 3;
    this.hasNormals = !!effects.renderMesh?.normals;
    /** whether skin() draws the dents of the report's discs */
    this.hasDents = effects.dent === "discs";
    let mesh = 0, fine = 0;
    try {
      api.palpate_init_scene_def(def, runtime.field("palpate_scene_def"));
      fillSceneDef(runtime, def, effects);
      if (effects.renderMesh) mesh = lendRenderMesh(runtime, def, effects.renderMesh);
      if (effects.fineSurface) fine = lendFineSurface(runtime, def, effects.fineSurface);
      this.pointer = runtime.open((out, error) => api.palpate_scene_create(bundle.pointer, def, out, error));
      const limit = (/** @type {string} */ name) => heap.i32(def + runtime.field(`palpate_scene_def.${name}`));
      this.maxTools = limit("max_tools");
      this.maxPoints = limit("max_points");
      this.maxLinks = limit("max_links");
      const shape = limit("shape");
      /** nodes that shape() fills: none, those of the surface, or all */
      this.nodeCount = [0, bundle.info.surfaceNodeCount, bundle.info.nodeCount][shape] ?? 0;
    } finally {
      heap.release(def);
      if (mesh) heap.release(mesh);
      if (fine) heap.release(fine);
    }
    this.#takeMemory();
  }

  // Allocates all memory of the steps at once: tools, their points and grips, contacts, the shape's arrays.
  #takeMemory() {
    const { runtime } = this, { api, heap } = runtime;
    this.#contactsBytes = api.palpate_contacts_bytes(this.pointer);
    const sizes = [
      this.maxTools * runtime.field("palpate_tool"), this.maxTools * this.maxPoints * 24,
      this.maxTools * this.maxPoints * runtime.field("palpate_grip"), this.#contactsBytes,
      runtime.field("palpate_shape_out"), 12 * this.nodeCount, 12 * this.nodeCount,
      runtime.field("palpate_skin_out"), 12 * this.vertexCount, this.hasNormals ? 12 * this.vertexCount : 0,
      this.nodeCount ? 12 * this.bundle.info.surfaceNodeCount : 0, runtime.field("palpate_surface_hit"),
      runtime.field("palpate_pose"), 48, this.maxTools * runtime.field("palpate_grasp"),
      this.maxLinks * runtime.field("palpate_link"), this.hasDents ? 12 * this.maxPoints : 0,
    ].map((bytes) => (bytes + 15) & ~15);
    const all = sizes.reduce((sum, bytes) => sum + bytes, 0);
    this.#memory = heap.take(all);
    heap.bytes.fill(0, this.#memory, this.#memory + all);
    let at = this.#memory;
    [this.#toolsAt, this.#pointsAt, this.#gripsAt, this.#contactsAt, this.#shapeAt, this.#displacementsAt, this.#positionsAt,
      this.#skinAt, this.#skinPositionsAt, this.#skinNormalsAt, this.#normalsAt, this.#hitAt, this.#poseAt,
      this.#numbersAt, this.#graspsAt, this.#linksAt, this.#discNormalsAt] = sizes.map((bytes) => (at += bytes) - bytes);
    const put = (/** @type {number} */ at, /** @type {string} */ name, /** @type {number} */ value) =>
      heap.data.setUint32(at + runtime.field(name), value, true);
    api.palpate_init_shape_out(this.#shapeAt, runtime.field("palpate_shape_out"));
    api.palpate_init_skin_out(this.#skinAt, runtime.field("palpate_skin_out"));
    put(this.#shapeAt, "palpate_shape_out.displacements", this.nodeCount ? this.#displacementsAt : 0);
    put(this.#shapeAt, "palpate_shape_out.positions", this.nodeCount ? this.#positionsAt : 0);
    put(this.#shapeAt, "palpate_shape_out.node_capacity", this.nodeCount);
    put(this.#skinAt, "palpate_skin_out.positions", this.#skinPositionsAt);
    put(this.#skinAt, "palpate_skin_out.normals", this.hasNormals ? this.#skinNormalsAt : 0);
    put(this.#skinAt, "palpate_skin_out.vertex_capacity", this.vertexCount);
    put(this.#skinAt, "palpate_skin_out.disc_normals", this.hasDents ? this.#discNormalsAt : 0);
    put(this.#skinAt, "palpate_skin_out.disc_capacity", this.hasDents ? this.maxPoints : 0);
  }

  /** That a touch may count in operations, whatever the tools do. @returns {number} */
  get mostOperations() { return Number(this.runtime.api.palpate_scene_most_operations(this.pointer)); }

  /** The passes of a step, in order. @returns {PlanPass[]} */
  get plan() {
    const { runtime } = this, { api, heap } = runtime;
    /** @type {PlanPass[]} */
    const passes = [];
    for (let at = 0; (at = api.palpate_scene_plan(this.pointer, passes.length) >>> 0) !== 0;) {
      const text = (/** @type {string} */ name) => heap.text(heap.u32(at + runtime.field(`palpate_plan_pass.${name}`)));
      const mapped = heap.data.getBigUint64(at + runtime.field("palpate_plan_pass.mapped_bytes"), true);
      passes.push({ name: text("name"), half: text("half"), sections: text("sections"), mappedBytes: Number(mapped) });
    }
    return passes;
  }

  /** Sets the tools for the next touch. @param {Tool[]} tools known by their id, or by their order */
  setTools(tools) {
    if (tools.length > this.maxTools) throw new RangeError(`${tools.length} tools; the scene was made for ${this.maxTools}`);
    tools.forEach((tool, index) => this.#setTool(index, tool));
    this.#toolCount = tools.length;
  }

  /** @param {number} index @param {Tool} tool */
  #setTool(index, tool) {
    const { runtime } = this;
    const points = tool.points ?? [], grips = tool.grips ?? [];
    if (points.length > 3 * this.maxPoints || grips.length > this.maxPoints)
      throw new RangeError(`a tool of ${points.length / 3} points and ${grips.length} grips; the scene was made for ${this.maxPoints}`);
    const at = this.#toolsAt + index * runtime.field("palpate_tool");
    const field = (/** @type {string} */ name) => at + runtime.field(`palpate_tool.${name}`);
    runtime.api.palpate_init_tool(at, runtime.field("palpate_tool"));
    const pointsAt = this.#pointsAt + index * this.maxPoints * 24;
    new Float64Array(runtime.heap.buffer, pointsAt, points.length).set(points);
    const gripSize = runtime.field("palpate_grip"), gripsAt = this.#gripsAt + index * this.maxPoints * gripSize;
    grips.forEach((grip, g) => this.#setGrip(gripsAt + g * gripSize, grip));
    const { data } = runtime.heap;
    data.setInt32(field("id"), tool.id ?? -1, true);
    data.setUint32(field("points"), pointsAt, true);
    data.setInt32(field("point_count"), points.length / 3, true);
    data.setUint32(field("grips"), gripsAt, true);
    data.setInt32(field("grip_count"), grips.length, true);
    data.setInt32(field("hold"), tool.hold ? 1 : 0, true);
    data.setFloat64(field("disc_radius"), tool.discRadius ?? 0, true);
    data.setFloat64(field("friction"), tool.friction ?? 0, true);
    data.setInt32(field("has_torque"), tool.reference ? 1 : 0, true);
    if (tool.reference) this.#setNumbers(field("reference"), tool.reference, 3, "reference");
    if (!tool.grasp) return;
    const graspAt = this.#graspsAt + index * runtime.field("palpate_grasp");
    fillGrasp(runtime, graspAt, tool.grasp);
    data.setUint32(field("grasp"), graspAt, true);
  }

  /** Gives the scene its links, in place of those that it had; each later touch() holds them. One that was there before with its id, kind
   *  and ends keeps its state, and takes its new numbers. What cannot be throws, and the scene keeps its links. @param {Link[]} links */
  setLinks(links) {
    const { runtime } = this, size = runtime.field("palpate_link");
    if (links.length > this.maxLinks) throw new RangeError(`${links.length} links; the scene was made for ${this.maxLinks}`);
    links.forEach((link, i) => fillLink(runtime, this.#linksAt + i * size, link));
    runtime.check((error) => runtime.api.palpate_scene_set_links(this.pointer, this.#linksAt, links.length, error));
  }
  /** The links after the last touch(), in their order: copies. @returns {LinkState[]} */
  get links() {
    const states = [];
    for (let at = 0; (at = this.runtime.api.palpate_scene_link_state(this.pointer, states.length) >>> 0) !== 0;)
      states.push(readLinkState(this.runtime, at));
    return states;
  }
  /** The grasp of the tool with that id after the last touch(): a copy. @param {number} id
   *  @returns {GraspState | undefined} undefined: no tool has the id, or no tool of the scene may grasp */
  grasp(id) {
    const at = this.runtime.api.palpate_scene_grasp_state(this.pointer, id) >>> 0;
    return at === 0 ? undefined : readGraspState(this.runtime, at);
  }

  /** @param {number} at @param {Grip} grip */
  #setGrip(at, grip) {
    const { runtime } = this, { data } = runtime.heap;
    const field = (/** @type {string} */ name) => at + runtime.field(`palpate_grip.${name}`);
    if ((grip.node === undefined) === (grip.triangle === undefined))
      throw new RangeError("a grip needs either node, for a node, or triangle, for a point of a triangle");
    runtime.api.palpate_init_grip(at, runtime.field("palpate_grip"));
    data.setInt32(field("kind"), grip.node === undefined ? GRIP_SURFACE_POINT : GRIP_NODE, true);
    data.setInt32(field("node"), grip.node ?? -1, true);
    data.setInt32(field("triangle"), grip.triangle ?? -1, true);
    for (let d = 0; d < 3; ++d) {
      data.setFloat64(field("barycentric") + 8 * d, grip.barycentric?.[d] ?? 0, true);
      data.setFloat64(field("displacement") + 8 * d, grip.displacement[d], true);
    }
    data.setUint32(field("axes"), grip.axes ?? 7, true);
  }

  /** The touch half of a step: collision, contacts, forces. @param {number} dt s since the last touch
   *  @returns {number} flag bits of palpate.h, 0: full trust */
  touch(dt) {
    const { api } = this.runtime;
    this.#touched = true;
    return api.palpate_scene_touch(this.pointer, this.#toolsAt, this.#toolCount, dt, this.#contactsAt, this.#contactsBytes) >>> 0;
  }

  /** With deformation "large-beside" or "large-renewed": solves the body under the contacts of the last touch. A page without a second thread calls it
   *  between touches, as often as it has time. @returns {number} evaluations of the energy that it took; 0: nothing to do; -1: the
   *  scene has another deformation */
  deform() {
    return this.runtime.api.palpate_scene_deform(this.pointer);
  }

  /** The shape half of a step: fills positions and displacements from the last touch's contacts. @returns {number} flag bits */
  shape() {
    return this.runtime.api.palpate_scene_shape(this.pointer, this.#contactsAt, this.#shapeAt) >>> 0;
  }

  /** Moves the render mesh with the last shape(): fills skinPositions and skinNormals. With dent: "discs" it sinks to the discs of the
   *  last touch(). @returns {number} flag bits */
  skin() {
    const { api, heap } = this.runtime;
    if (this.hasDents)
      heap.data.setUint32(this.#skinAt + this.runtime.field("palpate_skin_out.report"), api.palpate_scene_report(this.pointer), true);
    return this.runtime.api.palpate_scene_skin(this.pointer, this.#shapeAt, this.#skinAt) >>> 0;
  }

  /** view [3] N: force on the tool, within the scene's limits. @param {number} tool */
  force(tool) {
    return this.#toolVector(tool, "force");
  }
  /** view [3] N: force on the tool before those limits. @param {number} tool */
  forceRaw(tool) {
    return this.#toolVector(tool, "force_raw");
  }
  /** view [3] N m: torque on the tool about its reference, within the scene's limits. @param {number} tool */
  torque(tool) {
    return this.#toolVector(tool, "torque");
  }
  /** view [3] N m: torque on the tool before those limits. @param {number} tool */
  torqueRaw(tool) {
    return this.#toolVector(tool, "torque_raw");
  }
  /** The address of a tool's state in the last touch's contacts. @param {number} tool */
  #toolStateAt(tool) {
    return this.#contactsAt + this.runtime.field("palpate_contacts") + tool * this.runtime.field("palpate_tool_state");
  }
  /** @param {number} tool @param {"force" | "force_raw" | "torque" | "torque_raw"} name */
  #toolVector(tool, name) {
    const { runtime } = this;
    return new Float64Array(runtime.heap.buffer, this.#toolStateAt(tool) + runtime.field(`palpate_tool_state.${name}`), 3);
  }

  /** The number of a tool's contacts. @param {number} tool @returns {number} */
  contactCount(tool) {
    const { runtime } = this;
    return runtime.heap.i32(this.#toolStateAt(tool) + runtime.field("palpate_tool_state.contact_count"));
  }

  /** The flag bits of a tool. @param {number} tool @returns {number} */
  toolFlags(tool) {
    const { runtime } = this;
    return runtime.heap.u32(this.#toolStateAt(tool) + runtime.field("palpate_tool_state.flags"));
  }

  /** view [nodeCount][3] m, of the last shape() */
  get positions() {
    return new Float32Array(this.runtime.heap.buffer, this.#positionsAt, 3 * this.nodeCount);
  }
  /** view [nodeCount][3] m, of the last shape() */
  get displacements() {
    return new Float32Array(this.runtime.heap.buffer, this.#displacementsAt, 3 * this.nodeCount);
  }

  /** view [vertexCount][3] m, of the last skin() */
  get skinPositions() {
    return new Float32Array(this.runtime.heap.buffer, this.#skinPositionsAt, 3 * this.vertexCount);
  }
  /** With dent: "discs", of the last skin(): view [contacts][3], for each contact of the report the outward normal of the plane that
   *  its disc is drawn in; zero where it has none. */
  get discNormals() {
    const { heap } = this.runtime;
    const count = this.hasDents ? heap.i32(this.#skinAt + this.runtime.field("palpate_skin_out.disc_count")) : 0;
    return new Float32Array(heap.buffer, this.#discNormalsAt, 3 * count);
  }
  /** view [vertexCount][3], unit, of the last skin(); empty for a render mesh without normals */
  get skinNormals() {
    return new Float32Array(this.runtime.heap.buffer, this.#skinNormalsAt, this.hasNormals ? 3 * this.vertexCount : 0);
  }

  /** view: the contacts as plain bytes. They may be copied to contactBytes of another scene with the same bundle and limits. */
  get contactBytes() {
    const used = this.runtime.heap.u32(this.#contactsAt + this.runtime.field("palpate_contacts.used_bytes"));
    return new Uint8Array(this.runtime.heap.buffer, this.#contactsAt, used);
  }

  /** The outward normals of the surface's nodes in the last shape(), for a page that draws the bundle's own triangles.
   *  @returns {Float32Array} view [surfaceNodeCount][3], unit length */
  normals() {
    const { api, heap } = this.runtime, count = this.bundle.info.surfaceNodeCount;
    if (this.nodeCount === 0) throw new PalpateError(ARGUMENT, "normals: expected a scene with a shape, found shape: off");
    const flags = api.palpate_scene_normals(this.pointer, this.#shapeAt, this.#normalsAt, count) >>> 0;
    if (flags & STEP_BAD_INPUT)
      throw new PalpateError(ARGUMENT, "normals: expected shape() before, and a scene with collision, queries, a law other than sticking, or contact triangle, point or patch");
    return new Float32Array(heap.buffer, this.#normalsAt, 3 * count);
  }

  /** The first point where a ray passes through the surface, at most `longest` metres along it. The surface is the one that the last
   *  touch() deformed; atRest: the one at rest. Needs queries: "on". All of it is in the organ's frame.
   *  @param {ArrayLike<number>} origin m @param {ArrayLike<number>} direction of any length
   *  @param {{longest?: number, atRest?: boolean}} [options] @returns {SurfaceHit | undefined} undefined: none */
  castRay(origin, direction, { longest = Infinity, atRest = false } = {}) {
    const { api } = this.runtime, from = this.#numbersAt, along = from + 24;
    this.#setNumbers(from, origin, 3, "origin");
    this.#setNumbers(along, direction, 3, "direction");
    return this.#hit((hit) => api.palpate_scene_cast_ray(this.pointer, this.#contactsFor(atRest), from, along, longest, hit));
  }

  /** The point of the surface that is nearest to a point, if it is nearer than `farthest` metres. As castRay otherwise.
   *  @param {ArrayLike<number>} point m @param {{farthest?: number, atRest?: boolean}} [options] @returns {SurfaceHit | undefined} */
  closestPoint(point, { farthest = Infinity, atRest = false } = {}) {
    const { api } = this.runtime;
    this.#setNumbers(this.#numbersAt, point, 3, "point");
    return this.#hit((hit) =>
      api.palpate_scene_closest_point(this.pointer, this.#contactsFor(atRest), this.#numbersAt, farthest, hit));
  }

  /** The distance of a point from the surface, m, below zero inside. As castRay otherwise.
   *  @param {ArrayLike<number>} point m @param {{atRest?: boolean}} [options] @returns {number} */
  signedDistance(point, { atRest = false } = {}) {
    const { api, heap } = this.runtime, out = this.#numbersAt + 24;
    this.#setNumbers(this.#numbersAt, point, 3, "point");
    this.#answered(api.palpate_scene_signed_distance(this.pointer, this.#contactsFor(atRest), this.#numbersAt, out));
    return heap.data.getFloat64(out, true);
  }

  /** @param {(hit: number) => number} ask */
  #hit(ask) {
    const { runtime } = this;
    runtime.api.palpate_init_surface_hit(this.#hitAt, runtime.field("palpate_surface_hit"));
    this.#answered(ask(this.#hitAt));
    return readHit(runtime, this.#hitAt);
  }
  /** @param {number} flags */
  #answered(flags) {
    if (flags & (STEP_BAD_INPUT | STEP_OTHER_BUNDLE))
      throw new PalpateError(ARGUMENT, "a query expects a scene with queries: \"on\", numbers that are finite, a direction that is not zero, and a distance above zero");
  }
  /** The address of the contacts that deform the surface; 0: it is at rest. @param {boolean} atRest */
  #contactsFor(atRest) {
    return atRest || !this.#touched ? 0 : this.#contactsAt;
  }
  /** @param {number} at @param {ArrayLike<number>} numbers @param {number} count @param {string} name */
  #setNumbers(at, numbers, count, name) {
    if (numbers.length !== count) throw new RangeError(`${name}: expected ${count} numbers, found ${numbers.length}`);
    new Float64Array(this.runtime.heap.buffer, at, count).set(numbers);
  }

  /** The contacts of the last touch(), and what began and ended in it: a copy. Read it after every touch(), because the next one
   *  writes over the events. Needs report: "contacts". @returns {ContactReport} */
  get report() {
    const at = this.runtime.api.palpate_scene_report(this.pointer) >>> 0;
    if (at === 0) throw new PalpateError(ARGUMENT, "the scene reports no contacts; make it with report: \"contacts\"");
    return readReport(this.runtime, at);
  }

  /** Says where the organ is at the next touch(); each later one moves it on by its velocities. Tools, forces and torques are in the
   *  world. @param {Pose} pose */
  setPose(pose) {
    const { runtime } = this, at = this.#poseAt;
    runtime.api.palpate_init_pose(at, runtime.field("palpate_pose"));
    const put = (/** @type {ArrayLike<number> | undefined} */ numbers, /** @type {string} */ field, /** @type {string} */ name, count = 3) =>
      numbers && this.#setNumbers(at + runtime.field(`palpate_pose.${field}`), numbers, count, name);
    put(pose.position, "position", "position");
    put(pose.orientation, "orientation", "orientation", 4);
    put(pose.velocity, "velocity", "velocity");
    put(pose.angularVelocity, "angular_velocity", "angularVelocity");
    runtime.check((error) => runtime.api.palpate_scene_set_pose(this.pointer, at, error));
  }

  /** What the touches have left in the scene, as bytes: after restore() the next touches give the same bits, if they get the same
   *  input. @returns {Uint8Array} a copy, for a scene with the same effects on the same bundle and version */
  save() {
    const { api, heap } = this.runtime, size = api.palpate_scene_state_bytes(this.pointer) >>> 0, at = heap.take(size);
    try {
      this.runtime.check((error) => api.palpate_scene_save(this.pointer, at, size, error));
      return heap.bytes.slice(at, at + size);
    } finally {
      heap.release(at);
    }
  }

  /** Takes back what save() gave. Bytes that are damaged, or of another version, effects or bundle, throw, and the scene stays as it
   *  was. Forces, shapes and queries of the restored state come with the next touch(). @param {Uint8Array} state */
  restore(state) {
    const { api, heap } = this.runtime, at = heap.take(state.length + 8);
    try {
      heap.bytes.set(state, at);
      this.runtime.check((error) => api.palpate_scene_restore(this.pointer, at, state.length, error));
      this.#touched = false;
    } finally {
      heap.release(at);
    }
  }

  /** Forgets contacts, last positions and forces. */
  reset() {
    this.#touched = false;
    this.runtime.api.palpate_scene_reset(this.pointer);
  }

  /** The same for one tool alone. @param {number} id */
  resetTool(id) {
    this.runtime.api.palpate_scene_reset_tool(this.pointer, id);
  }

  destroy() {
    this.runtime.api.palpate_scene_destroy(this.pointer);
    this.runtime.heap.release(this.#memory);
  }
}

