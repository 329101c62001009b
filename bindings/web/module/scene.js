// A scene: one organ and the tools that touch it, or an organ of a world, whose tools the world touches with.
import { readHit, readReport } from "./contact_report.js";
import { bladeBytes, fillBlade, readBladeState, readCutState, readCutSurface } from "./cuts.js";
import { STEP_BAD_INPUT, STEP_OTHER_BUNDLE } from "./flags.js";
import { ARGUMENT, PalpateError } from "./heap.js";
import { Crossings } from "./crossings.js";
import { Measures, Places } from "./inside.js";
import { readGivenForceState } from "./given_force.js";
import { fillLink, readGraspState, readLinkState } from "./links.js";
import { readNeedleState } from "./needles.js";
import { readObstacleState } from "./obstacles.js";
import { fillPose } from "./scene_def.js";
import { reader } from "./struct.js";
import { ToolMemory } from "./tool_memory.js";
import { ToolStates } from "./tool_states.js";
/** @import { Bundle, Tool, Pose, PlanPass } from "./palpate.js" */
/** @import { Link, LinkState, GraspState } from "./links.js" */
/** @import { GivenForceState } from "./given_force.js" */
/** @import { NeedleState } from "./needles.js" */
/** @import { Blade, BladeState, CutState, CutSurface } from "./cuts.js" */
/** @import { ObstacleState } from "./obstacles.js" */
/** @import { ContactReport, SurfaceHit } from "./contact_report.js" */
/** @import { SceneDef } from "./scene_def.js" */
/** @typedef {{at: number, touched: boolean}} TouchedContacts  Where the contacts of the last touch are, and whether there was one. */
/** @typedef {{force: number[], place: number[], displacement: number[], area: number}} LoadState  A load after a touch, as palpate_load_state. */
/** @typedef {{amount: number, volume: number}} MotionState  A motion after a touch, as palpate_motion_state. */

export class Scene extends ToolStates {
  // Addresses in the module's memory: contacts, the palpate_shape_out and its arrays.
  #memory = 0;
  /** @type {ToolMemory | undefined} of a world's organ: none */
  #tools;
  #contacts;
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
  #linksAt = 0;
  #amountsAt = 0; // of the motions
  #bladeAt = 0;
  /** @type {Measures | undefined} of all nodes */
  #field;
  /** @type {Crossings | undefined} */
  #crossings;

  /** Bundle.createScene and World make scenes.
   *  @param {Bundle} bundle @param {SceneDef} def @param {number} pointer of the palpate_scene that was made by it
   *  @param {TouchedContacts} [ofWorld] of an organ of a world, which keeps it up to date */
  constructor(bundle, def, pointer, ofWorld) {
    const { runtime } = bundle, { effects } = def;
    super(runtime, "palpate_tool_state", "palpate_contacts");
    this.bundle = bundle;
    this.pointer = pointer;
    /** vertices of the render mesh, which skin() fills */
    this.vertexCount = (effects.renderMesh?.positions.length ?? 0) / 3;
    this.hasNormals = !!effects.renderMesh?.normals;
    /** whether skin() draws the dents of the report's discs */
    this.hasDents = effects.dent === "discs";
    this.maxTools = def.integer("maxTools");
    this.maxPoints = def.integer("maxPoints");
    this.maxLinks = def.integer("maxLinks");
    /** nodes that shape() fills: none, those of the surface, or all */
    this.nodeCount = [0, bundle.info.surfaceNodeCount, bundle.info.nodeCount][def.integer("shape")] ?? 0;
    /** whether blades cut the organ */
    this.canCut = def.integer("cut") !== 0;
    this.#contacts = ofWorld ?? { at: 0, touched: false };
    this.#takeMemory(!ofWorld);
    if (def.integer("inside")) this.#field = new Measures(runtime, this.nodeCount, ["strains", "stresses", "pressures", "von_mises", "principal"]);
    if (def.integer("crossings")) this.#crossings = new Crossings(runtime);
  }

  // Allocates all memory of the steps at once: tools and contacts, where the scene has its own; the shape's arrays.
  /** @param {boolean} isOwn */
  #takeMemory(isOwn) {
    const { runtime } = this, { api, heap } = runtime;
    if (isOwn) {
      this.#tools = new ToolMemory(runtime, this.maxTools, this.maxPoints);
      this.#contactsBytes = api.palpate_contacts_bytes(this.pointer);
    }
    const sizes = [
      this.#contactsBytes, runtime.field("palpate_shape_out"), 12 * this.nodeCount, 12 * this.nodeCount,
      runtime.field("palpate_skin_out"), 12 * this.vertexCount, this.hasNormals ? 12 * this.vertexCount : 0,
      this.nodeCount ? 12 * this.bundle.info.surfaceNodeCount : 0, runtime.field("palpate_surface_hit"),
      runtime.field("palpate_pose"), 48, this.maxLinks * runtime.field("palpate_link"), this.hasDents ? 12 * this.maxPoints : 0,
      8 * this.bundle.info.motionCount, this.canCut ? bladeBytes(runtime) : 0,
    ].map((bytes) => (bytes + 15) & ~15);
    this.#memory = heap.takeZeros(sizes.reduce((sum, bytes) => sum + bytes, 0));
    let at = this.#memory, contactsAt = 0;
    [contactsAt, this.#shapeAt, this.#displacementsAt, this.#positionsAt, this.#skinAt, this.#skinPositionsAt, this.#skinNormalsAt,
      this.#normalsAt, this.#hitAt, this.#poseAt, this.#numbersAt, this.#linksAt, this.#discNormalsAt, this.#amountsAt, this.#bladeAt] = sizes.map((bytes) => (at += bytes) - bytes);
    if (isOwn) this.#contacts.at = contactsAt;
    const put = (/** @type {number} */ at, /** @type {string} */ name, /** @type {number} */ value) =>
      heap.data.setUint32(at + runtime.field(name), value, true);
    api.palpate_init_shape_out(this.#shapeAt, runtime.field("palpate_shape_out"));
    if (this.vertexCount) api.palpate_init_skin_out(this.#skinAt, runtime.field("palpate_skin_out"));
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
    return runtime.list((pass) => api.palpate_scene_plan(this.pointer, pass), (at) => {
      const text = (/** @type {string} */ name) => heap.text(heap.u32(at + runtime.field(`palpate_plan_pass.${name}`)));
      return { name: text("name"), half: text("half"), sections: text("sections"), mappedBytes: reader(runtime, "palpate_plan_pass", at).whole("mapped_bytes") };
    });
  }

  // Throws for an organ of a world. @param {string} call
  #ownTools(/** @type {string} */ call) {
    if (!this.#tools) throw new PalpateError(ARGUMENT, `${call}: expected a scene of its own, found an organ of a world; call ${call} of the World`);
    return this.#tools;
  }

  /** Sets the tools for the next touch. @param {Tool[]} tools known by their id, or by their order */
  setTools(tools) {
    this.#ownTools("setTools").set(tools);
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
    return this.runtime.list((link) => this.runtime.api.palpate_scene_link_state(this.pointer, link), (at) => readLinkState(this.runtime, at));
  }
  /** The grasp of the tool with that id after the last touch(): a copy. @param {number} id
   *  @returns {GraspState | undefined} undefined: no tool has the id, or no tool of the scene may grasp */
  grasp(id) {
    const at = this.runtime.api.palpate_scene_grasp_state(this.pointer, id) >>> 0;
    return at === 0 ? undefined : readGraspState(this.runtime, at);
  }
  /** Where the tool with that id and a force stands after the last touch(): a copy. @param {number} id
   *  @returns {GivenForceState | undefined} undefined: no tool has the id, or no tool of the scene may have a force */
  givenForce(id) {
    const at = this.runtime.api.palpate_scene_given_force_state(this.pointer, id) >>> 0;
    return at === 0 ? undefined : readGivenForceState(this.runtime, at);
  }
  /** The needle of the tool with that id after the last touch(): a copy. @param {number} id
   *  @returns {NeedleState | undefined} undefined: no tool has the id, or no tool of the scene may have a needle */
  needle(id) {
    const at = this.runtime.api.palpate_scene_needle_state(this.pointer, id) >>> 0;
    return at === 0 ? undefined : readNeedleState(this.runtime, at);
  }

  /** Says by how much each of the bundle's motions moves the organ, from the next touch() on. Call it before each touch of an organ that
   *  breathes. Needs motions: true. @param {ArrayLike<number>} amounts m, rad, 1, Pa or m/s^2: the unit of each motion's kind */
  setMotions(amounts) {
    const { runtime } = this, { motionCount } = this.bundle.info;
    if (amounts.length !== motionCount)
      throw new PalpateError(ARGUMENT, `setMotions: expected ${motionCount} amounts, one for each motion of the bundle, found ${amounts.length}`);
    new Float64Array(runtime.heap.buffer, this.#amountsAt, motionCount).set(amounts);
    runtime.check((error) => runtime.api.palpate_scene_set_motions(this.pointer, this.#amountsAt, motionCount, error));
  }

  /** Of a motion of kind "pressure": holds the volume that its surface sweeps, m^3, in place of its pressure. null: the pressure is given
   *  again. @param {number} motion @param {number | null} volume */
  holdVolume(motion, volume) {
    const { api } = this.runtime;
    this.runtime.check((error) => api.palpate_scene_hold_volume(this.pointer, motion, volume === null ? 0 : 1, volume ?? 0, error));
  }

  /** The motions after the last touch(), in the bundle's order: copies. @returns {MotionState[]} */
  get motionStates() {
    const { runtime } = this, fields = { number: ["amount", "volume"] };
    return runtime.list((motion) => runtime.api.palpate_scene_motion_state(this.pointer, motion), (at) => reader(runtime, "palpate_motion_state", at).all(fields));
  }

  /** Says what a patch of `loads` bears, from the next touch() on: N in all, or Pa with perArea; along the axes of the organ, or of the world
   *  with inWorld, as a weight. @param {number} load @param {ArrayLike<number>} vector @param {{perArea?: boolean, inWorld?: boolean}} [how] */
  setLoad(load, vector, { perArea = false, inWorld = false } = {}) {
    const { runtime } = this;
    new Float64Array(runtime.heap.buffer, this.#numbersAt, 3).set(Array.from(vector).slice(0, 3));
    runtime.check((error) => runtime.api.palpate_scene_set_load(this.pointer, load, 2 * Number(perArea) + Number(inWorld), this.#numbersAt, error));
  }

  /** The loads after the last touch(), in the order of the patches: copies. @returns {LoadState[]} */
  get loadStates() {
    const { runtime } = this, fields = { vector: ["force", "place", "displacement"], number: ["area"] };
    return runtime.list((load) => runtime.api.palpate_scene_load_state(this.pointer, load), (at) => reader(runtime, "palpate_load_state", at).all(fields));
  }

  /** Says where one of `obstacles` is at the next touch(), in the world; each later one moves it on by its velocities.
   *  @param {number} obstacle @param {Pose} pose */
  setObstaclePose(obstacle, pose) {
    const { runtime } = this, at = this.#poseAt;
    fillPose(runtime, at, pose);
    runtime.check((error) => runtime.api.palpate_scene_set_obstacle_pose(this.pointer, obstacle, at, error));
  }

  /** The obstacles after the last touch(), in their order: copies. @returns {ObstacleState[]} */
  get obstacleStates() {
    const { runtime } = this;
    return runtime.list((obstacle) => runtime.api.palpate_scene_obstacle_state(this.pointer, obstacle), (at) => readObstacleState(runtime, at));
  }

  /** Says where a blade is at the next touch(): it cuts what lies between there and where it was in the touch before. null withdraws it. Needs cut: true.
   *  @param {number} number 0 to 3 @param {Blade | null} blade */
  setBlade(number, blade) {
    const { runtime } = this, at = this.#bladeAt;
    this.#needCut();
    fillBlade(runtime, at, blade);
    runtime.check((error) => runtime.api.palpate_scene_set_blade(this.pointer, number, at, error));
  }
  /** A blade after the last touch(): a copy. @param {number} number @returns {BladeState | undefined} undefined: the scene has no such blade */
  blade(number) {
    const at = this.canCut ? this.runtime.api.palpate_scene_blade_state(this.pointer, number) >>> 0 : 0;
    return at === 0 ? undefined : readBladeState(this.runtime, at);
  }
  /** At the next touch(), removes the tetrahedra whose middle lies within `radius` m of a place in the world. With `needed` s each goes once it has been in such
   *  balls for so long, `held` s of it in this one. Needs cut: true.
   *  @param {ArrayLike<number>} centre m @param {number} radius @param {number} [held] @param {number} [needed] */
  removeTissue(centre, radius, held = 0, needed = 0) {
    const { runtime } = this;
    this.#needCut();
    this.#setNumbers(this.#numbersAt, centre, 3, "centre");
    runtime.check((error) => runtime.api.palpate_scene_remove_tissue(this.pointer, this.#numbersAt, radius, held, needed, error));
  }
  /** What has been cut, after the last touch(): a copy. @returns {CutState | undefined} undefined: the scene does not cut */
  get cutState() {
    const at = this.canCut ? this.runtime.api.palpate_scene_cut_state(this.pointer) >>> 0 : 0;
    return at === 0 ? undefined : readCutState(this.runtime, at);
  }
  /** The surface of what is left, to draw in place of the bundle's triangles, and the nodes that cuts have made: copies. Call it when cutState.surface has changed. Needs cut: true.
   *  @returns {CutSurface} */
  get cutSurface() {
    this.#needCut();
    return readCutSurface(this.runtime, this.pointer);
  }
  #needCut() {
    if (!this.canCut) throw new PalpateError(ARGUMENT, "the scene does not cut; make it with cut: true");
  }

  /** The touch half of a step: collision, contacts, forces. @param {number} dt s since the last touch
   *  @returns {number} flag bits of palpate.h, 0: full trust */
  touch(dt) {
    const { at, count } = this.#ownTools("touch");
    this.#contacts.touched = true;
    return this.runtime.api.palpate_scene_touch(this.pointer, at, count, dt, this.#contacts.at, this.#contactsBytes) >>> 0;
  }

  /** With deformation "large-beside", "large-renewed" or "large-auto": solves the body under the contacts of the last touch. A page without a second thread calls it
   *  between touches, as often as it has time. @returns {number} evaluations of the energy that it took; 0: nothing to do; -1: the
   *  scene has another deformation */
  deform() {
    return this.runtime.api.palpate_scene_deform(this.pointer);
  }

  /** The shape half of a step: fills positions and displacements from the last touch's contacts. @returns {number} flag bits */
  shape() {
    return this.runtime.api.palpate_scene_shape(this.pointer, this.#contacts.at, this.#shapeAt) >>> 0;
  }

  /** Moves the render mesh with the last shape(): fills skinPositions and skinNormals. With dent: "discs" it sinks to the discs of the
   *  last touch(). @returns {number} flag bits */
  skin() {
    const { api, heap } = this.runtime;
    if (this.hasDents)
      heap.data.setUint32(this.#skinAt + this.runtime.field("palpate_skin_out.report"), api.palpate_scene_report(this.pointer), true);
    return this.runtime.api.palpate_scene_skin(this.pointer, this.#shapeAt, this.#skinAt) >>> 0;
  }

  /** @protected */
  contactsAddress() {
    return this.#contacts.at;
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

  /** Strain and stress of the last shape() at all nodes: fills `field`, and is what insideAt() reads. Needs inside: true. @returns {number} flag bits */
  inside() {
    return this.runtime.api.palpate_scene_inside(this.pointer, this.#shapeAt, this.field.at) >>> 0;
  }
  /** whether the scene has inside: true */
  get hasField() {
    return this.#field !== undefined;
  }
  /** Of the last inside(), [nodeCount] rows; displacements are those of the scene. */
  get field() {
    if (!this.#field) throw new PalpateError(ARGUMENT, "the scene tells nothing of its inside; make it with inside: true");
    return this.#field;
  }
  /** Goes on with the check whether the last shape() crosses itself. Needs crossings: true. @returns {number} flag bits: STEP_SURFACE_CROSSES
   *  where the last finished check found a crossing; `crossed` tells which */
  crossings() {
    if (!this.#crossings) throw new PalpateError(ARGUMENT, "the scene checks no crossings; make it with crossings: true");
    return this.runtime.api.palpate_scene_crossings(this.pointer, this.#shapeAt, this.#crossings.at) >>> 0;
  }
  /** whether the scene has crossings: true */
  get hasCrossings() {
    return this.#crossings !== undefined;
  }
  /** What the last finished check of crossings() found; of a scene without them nothing.
   *  @returns {{checks: number, pairs: number, places: import("./crossings.js").Crossing[]}} */
  get crossed() {
    return this.#crossings?.found ?? { checks: 0, pairs: 0, places: [] };
  }
  /** The places of points of the organ as it was meshed: of each the tetrahedron that it lies in, or the nearest one within `farthest`
   *  metres. Needs inside: true. It takes memory, until the places' release(). @param {ArrayLike<number>} points [count][3] m
   *  @param {{farthest?: number}} [options] @returns {Places} */
  locate(points, { farthest = 0 } = {}) {
    const { api, heap } = this.runtime;
    if (points.length % 3) throw new PalpateError(ARGUMENT, `locate: expected three numbers a point, found ${points.length}`);
    const count = points.length / 3, places = new Places(this.runtime, count), at = heap.take(8 * points.length + 8);
    new Float64Array(heap.buffer, at, points.length).set(points);
    places.missing = api.palpate_scene_locate(this.pointer, at, count, farthest, places.at);
    heap.release(at);
    if (places.missing >= 0) return places;
    places.release();
    throw new PalpateError(ARGUMENT, "locate: expected a scene with inside: true, and a farthest distance of 0 or above");
  }
  /** Strain and stress at places, of the shape of the last inside(): fills their `measures`. @param {Places} places @returns {number} flag bits */
  insideAt(places) {
    return this.runtime.api.palpate_scene_inside_at(this.pointer, places.at, places.count, places.measures.at) >>> 0;
  }
  /** Carries places along with the last shape(): fills their `positions`. @param {Places} places @returns {number} flag bits */
  carry(places) {
    return this.runtime.api.palpate_scene_carry(this.pointer, this.#shapeAt, places.at, places.count, places.positions.byteOffset) >>> 0;
  }

  /** view: the contacts as plain bytes. They may be copied to contactBytes of another scene with the same bundle and limits. */
  get contactBytes() {
    const used = this.runtime.heap.u32(this.#contacts.at + this.runtime.field("palpate_contacts.used_bytes"));
    return new Uint8Array(this.runtime.heap.buffer, this.#contacts.at, used);
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
    return atRest || !this.#contacts.touched ? 0 : this.#contacts.at;
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

  /** Says where the organ is at the next touch; each later one moves it on by its velocities. Tools, forces and torques are in the
   *  world. @param {Pose} pose */
  setPose(pose) {
    const { runtime } = this, at = this.#poseAt;
    fillPose(runtime, at, pose);
    runtime.check((error) => runtime.api.palpate_scene_set_pose(this.pointer, at, error));
  }

  /** What the touches have left in the scene, as bytes: after restore() the next touches give the same bits, if they get the same
   *  input. @returns {Uint8Array} a copy, for a scene with the same effects on the same bundle and version */
  save() {
    const { api } = this.runtime;
    this.#ownTools("save");
    return this.runtime.savedState(api.palpate_scene_state_bytes(this.pointer) >>> 0, (at, bytes, error) => api.palpate_scene_save(this.pointer, at, bytes, error));
  }

  /** Takes back what save() gave. Bytes that are damaged, or of another version, effects or bundle, throw, and the scene stays as it
   *  was. Forces, shapes and queries of the restored state come with the next touch(). @param {Uint8Array} state */
  restore(state) {
    this.#ownTools("restore");
    this.runtime.restoreState(state, (at, bytes, error) => this.runtime.api.palpate_scene_restore(this.pointer, at, bytes, error));
    this.#contacts.touched = false;
  }

  /** Forgets contacts, last positions and forces. */
  reset() {
    this.#contacts.touched = false;
    this.runtime.api.palpate_scene_reset(this.pointer);
  }

  /** The same for one tool alone. @param {number} id */
  resetTool(id) {
    this.runtime.api.palpate_scene_reset_tool(this.pointer, id);
  }

  destroy() {
    this.#ownTools("destroy").release();
    this.runtime.api.palpate_scene_destroy(this.pointer);
    this.releaseMemory();
  }

  /** Of an organ of a world: when the world is destroyed. */
  releaseMemory() {
    this.#field?.release();
    this.#crossings?.release();
    this.runtime.heap.release(this.#memory);
  }
}
