// Draws the organ, the tools and their forces in three dimensions.
import {
  AmbientLight, BackSide, BufferAttribute, BufferGeometry, Color, DirectionalLight, DoubleSide, DynamicDrawUsage, FrontSide, HemisphereLight, LineBasicMaterial, LineSegments,
  type Material, Mesh as Object3, MeshBasicMaterial, type Object3D, Points, PointsMaterial, Raycaster, Scene, Vector2, Vector3, WebGLRenderer,
} from "three";
import type { Pose } from "../../module/palpate.js";
import { BladeFigures } from "./blade_figures";
import { CutLips, cornersOf, cutOrgan, normalsOf } from "./cut_lips";
import { colourByDisplacement, roundUp, TISSUE } from "./colours";
import type { FineMesh } from "./fine_mesh";
import { boxOf, distance } from "./geometry";
import { frontOf, OrganCamera } from "./organ_camera";
import { LinkFigures } from "./link_figures";
import { NoduleMarks } from "./nodule_marks";
import { ObstacleFigures } from "./obstacle_figures";
import type { ObstacleMesh } from "./obstacle_mesh";
import type { Answer, TaskPress } from "./nodule_task";
import type { Nodule } from "./nodules";
import { PointerLines } from "./pointer_lines";
import { chosenQuality, isChosen, SlowFrames, type Quality } from "./quality";
import { Section, type SectionAxis } from "./section";
import { roomLight, Tissue } from "./tissue";
import { ToolFigure } from "./tool_figure";
import { TOOL_COUNT, type ColourBy, type DrawnSurface, type Frame, type DrawnLink, type Mesh, type ToolFrame, type Vector } from "./messages";

const LONGEST_DENT = 0.005, DENT_SHARE = 0.1; // m, and of the organ's smallest extent: that of a press up to where linear elasticity is good
const SAME_PLACE = 0.008; // m: a dent moves what one sees by less
const RINGS = 5; // of a dent as deep as the scale
const STAYS = 300, SHARPER = 1.5; // ms without a change, after which a processor draws the picture with more pixels
const FACES = 0.5; // cosine between the surface's normal and the line of sight of a place that a press reaches from the view
const FROM_THE_SIDE = 0.6; // cosine between the surface's normal and the line of sight where the page presses by itself

export interface Hit {
  triangle: number;
  nodes: number[]; // of the triangle
  barycentric: Vector;
  point: Vector; // on the surface as drawn
  place: Vector; // at rest
  normal: Vector; // at rest, smooth, outwards; of a lip as drawn
  isLip: boolean; // of a cut
  away: number; // m, from the eye
}

export interface Shown {
  colour: boolean;
  mesh: boolean;
  fixed: boolean;
  touchable: boolean;
  soft: boolean;
}

export interface Shape {
  positions: Float32Array; // [node][3] m
  inside: Float32Array; // [node][3] m; empty: the interior is not drawn
  field?: Frame["field"]; // that the section shows; none: it shows the tissues
  lengths: Float32Array; // of displacement or dent, m
  fine: { positions: Float32Array; normals: Float32Array; lengths: Float32Array } | null; // [vertex]
}

const FINE_HIDES = 0.004; // m: marks on the coarse surface show through a finer surface that lies up to this far above them

export class OrganView {
  readonly camera: OrganCamera;
  private noduleMarks = new NoduleMarks();
  readonly section = new Section(TISSUE);
  most = 0.005; // m: the palest colour, and what is longer
  outlinesRest = false; // while tools press, what the organ has left shows behind it
  private renderer: WebGLRenderer;
  private scene = new Scene();
  private geometry = new BufferGeometry();
  private surface = new Object3(this.geometry, new Tissue());
  private fine = new Object3(new BufferGeometry(), this.surface.material); // drawn instead of the surface where a finer mesh is bound
  private inside = new LineSegments(new BufferGeometry(), new LineBasicMaterial({ transparent: true, opacity: 0.5 }));
  private tetrahedra: Uint32Array<ArrayBufferLike> = new Uint32Array(0);
  private wire = new Object3(this.geometry, new MeshBasicMaterial({ wireframe: true, transparent: true, opacity: 0.35, depthWrite: false }));
  private fixed = new Points(new BufferGeometry(), new PointsMaterial({ size: 7, sizeAttenuation: false }));
  private touchable = new Points(new BufferGeometry(), new PointsMaterial({ size: 5, sizeAttenuation: false }));
  private outline = new Object3(new BufferGeometry(), new MeshBasicMaterial({ side: BackSide, transparent: true, opacity: 0.3, depthWrite: false })); // of the organ at rest: its far side, which only a dent uncovers
  private soft = new Object3(new BufferGeometry(), new MeshBasicMaterial({ transparent: true, opacity: 0.55, depthWrite: false })); // triangles over a foundation
  private tools = Array.from({ length: TOOL_COUNT }, () => new ToolFigure());
  private links = new LinkFigures();
  private obstacles = new ObstacleFigures();
  private blades = new BladeFigures();
  private lips = new CutLips();
  private whole: Mesh | null = null; // the open mesh
  private seesThrough = false; // the tissue hides no needle
  private inks = { halo: "#ffffff", forces: [] as string[], further: "#000000" };
  private lines = new PointerLines();
  private lights: { light: DirectionalLight | HemisphereLight | AmbientLight; high: number; low: number }[];
  private slow = new SlowFrames();
  quality: Quality;
  private raycaster = new Raycaster();
  private rest: Float32Array<ArrayBufferLike> = new Float32Array(0);
  private own: Float32Array | null = null; // colours of the surface's vertices; null: all have the tissue's
  private restNormals: Float32Array<ArrayBufferLike> = new Float32Array(0);
  private stale = true; // the picture no longer shows what there is
  private moved: { shape: Shape; palest?: number } | null = null; // what move() took last; null: to be taken again
  private changed = 0; // ms: when the picture last showed something new
  private drawnFrom = ""; // place and target of the camera in the last picture
  private longestDent = 0.005; // m, that the scale of dents has; for the bundle that is open
  private longest = 0.005; // m, of the scale of what is shown
  private touched = false; // the picture shows tools
  private shown: Shown = { colour: true, mesh: false, fixed: false, touchable: false, soft: false };
  radius = 0.1; // m, of the organ

  constructor(private canvas: HTMLCanvasElement) {
    this.quality = chosenQuality(canvas.ownerDocument);
    this.renderer = new WebGLRenderer({ canvas, antialias: this.quality === "high", alpha: true }); // smooth edges are half of a processor's time
    this.camera = new OrganCamera(canvas);
    const lamp = new DirectionalLight(0xfff4ea), rim = new DirectionalLight(0xdfe9ff), sky = new HemisphereLight(0xffffff, 0x998877), all = new AmbientLight(0xffffff);
    lamp.position.set(-0.6, 0.9, 0.8);
    rim.position.set(1, -0.6, -0.3);
    sky.position.set(0, 0, 1);
    this.lights = [{ light: lamp, high: 1.35, low: 2.1 }, { light: rim, high: 0.45, low: 0.7 }, { light: sky, high: 0.15, low: 0.75 }, { light: all, high: 0.05, low: 0.25 }];
    this.camera.camera.add(lamp, rim);
    this.draws(this.quality);
    this.surface.material.polygonOffset = true;
    this.surface.material.polygonOffsetFactor = this.surface.material.polygonOffsetUnits = 1;
    this.renderer.localClippingEnabled = true;
    this.scene.add(this.section.cut, this.camera.camera, sky, all, this.surface, this.fine, this.inside, this.outline, this.soft, this.wire, this.fixed, this.touchable, this.noduleMarks.group, ...this.tools.map((t) => t.group), this.links.group, this.obstacles.group, this.blades.group, this.lips.group, this.lines.group);
    for (const material of [this.soft.material, this.wire.material, this.fixed.material, this.touchable.material, ...this.links.materials]) shownThrough(material, FINE_HIDES);
    // The browser may have thrown the picture away.
    canvas.addEventListener("webglcontextrestored", () => (this.stale = true));
    canvas.ownerDocument.addEventListener("visibilitychange", this.again);
  }

  private again = () => {
    this.stale = true;
    this.moved = null;
  };

  // In low quality the picture needs no light of a room, no second layer on the tissue, and while it moves no more pixels than the page has.
  private draws(quality: Quality) {
    this.quality = quality;
    for (const { light, high, low } of this.lights) light.intensity = quality === "high" ? high : low;
    this.scene.environment = quality === "high" ? (this.scene.environment ?? roomLight(this.renderer)) : null;
    this.scene.environmentIntensity = 0.35;
    this.surface.material.draw(quality);
    if (quality === "low") for (const tool of this.tools) tool.dull();
    this.stale = true;
  }

  // frame: of the bundle's coordinates, "LPS" or "RAS". own: colours of the vertices without a dent, [vertex][3] linear light. from: where the
  // camera stands at first; left out: in front.
  open(mesh: Mesh, frame: string, own: Float32Array | null = null, from: Vector3 = frontOf(frame)) {
    this.own = own;
    const nodes = mesh.positions.length / 3;
    const position = changing(mesh.positions.slice());
    this.geometry = this.wire.geometry = renewed(this.surface, { position, color: changing(new Float32Array(3 * nodes)), dent: changing(new Float32Array(nodes), 1) }, mesh.triangles);
    this.geometry.computeVertexNormals();
    this.whole = mesh;
    this.lips.hide();
    this.rest = mesh.positions;
    this.restNormals = (this.geometry.getAttribute("normal").array as Float32Array).slice();
    // Marks that share the array of the surface's positions.
    renewed(this.fixed, { position }, Uint32Array.from(mesh.fixed));
    renewed(this.touchable, { position }, Uint32Array.from(mesh.touchable));
    renewed(this.soft, { position }, cornersOf(mesh.soft, mesh.triangles));
    this.wire.frustumCulled = false;
    this.geometry.computeBoundingSphere();
    const sphere = this.geometry.boundingSphere!;
    this.radius = sphere.radius;
    const { low, high } = boxOf(mesh.positions);
    this.most = this.longest = this.longestDent = roundUp(Math.min(LONGEST_DENT, DENT_SHARE * Math.min(...high.map((x, d) => x - low[d]))));
    renewed(this.outline, { position: new BufferAttribute(mesh.positions, 3) }, mesh.triangles);
    this.openFine(null);
    renewed(this.inside, {});
    this.tetrahedra = mesh.tetrahedra;
    this.section.open(mesh);
    this.move({ positions: mesh.positions, inside: new Float32Array(0), lengths: new Float32Array(nodes), fine: null });
    this.camera.open(sphere.center, sphere.radius, mesh.positions, from);
  }

  // Draws these triangles of the open mesh alone, [triangle][3] nodes; the others are not picked either.
  showTriangles(triangles: Uint32Array) {
    this.geometry.setIndex(new BufferAttribute(triangles, 1));
    this.again();
  }

  // Draws this surface of the open mesh; null: its own one.
  showCut(surface: DrawnSurface | null) {
    const mesh = this.whole!, organ = surface ? cutOrgan(mesh, surface) : { triangles: mesh.triangles, rest: mesh.positions };
    this.geometry.setIndex(new BufferAttribute(organ.triangles, 1));
    this.soft.geometry.setIndex(new BufferAttribute(cornersOf(mesh.soft, organ.triangles), 1));
    this.rest = organ.rest;
    this.restNormals = normalsOf(organ.rest, organ.triangles);
    if (surface) this.lips.show(this.geometry, surface);
    else this.lips.hide();
    this.again();
  }

  // That are drawn of the surface and of lips.
  get triangles(): number {
    return (this.geometry.index?.count ?? 0) / 3 + this.lips.count;
  }

  openFine(mesh: FineMesh | null) {
    this.again();
    if (!mesh) return void renewed(this.fine, {});
    const [position, normal, color] = [mesh.positions, mesh.normals, mesh.positions].map((numbers) => changing(numbers.slice()));
    renewed(this.fine, { position, normal, color, dent: changing(new Float32Array(position.count), 1) }, mesh.triangles);
    renewed(this.outline, { position: new BufferAttribute(mesh.positions, 3) }, mesh.triangles);
  }

  // Takes the positions of a frame. A finer mesh is drawn instead of the surface, and the interior shows through it.
  // palest: m, the length of the palest colour; left out: by the frame's own lengths.
  move(shape: Shape, palest?: number) {
    if (shape === this.moved?.shape && palest === this.moved.palest) return;
    const { positions, lengths, fine } = shape;
    this.moved = { shape, palest };
    this.stale = true;
    this.moveInside(shape);
    this.most = palest ?? this.longest;
    put(this.geometry, "position", positions);
    this.geometry.boundingSphere!.radius = this.radius * 1.5;
    this.surface.visible = !fine;
    this.fine.visible = !!fine;
    if (fine) {
      put(this.fine.geometry, "position", fine.positions);
      put(this.fine.geometry, "normal", fine.normals);
      this.colour(this.fine.geometry, fine.lengths);
    } else {
      this.geometry.computeVertexNormals();
      this.colour(this.geometry, lengths);
    }
  }

  // The scale of the colours, which stays while one presses: a motion of the whole organ is longer than a dent.
  scale(by: ColourBy) {
    this.most = this.longest = (by === "displacement" ? 2 : 1) * this.longestDent;
    this.again();
  }

  // Edges between two nodes of which at least one is inside, computed when they are first drawn; or the section.
  private moveInside({ positions, inside, field = null }: Shape) {
    this.section.move(positions, inside, field);
    for (const { material } of [this.surface, this.soft, this.wire, this.fixed, this.touchable]) material.clippingPlanes = this.section.planes;
    this.surface.material.side = this.section.cut.visible ? DoubleSide : FrontSide;
    this.inside.visible = inside.length > 0 && !this.section.cut.visible;
    const skin = this.surface.material;
    const isClear = this.inside.visible || this.seesThrough;
    if (skin.transparent !== isClear) {
      skin.transparent = isClear;
      skin.opacity = isClear ? 0.35 : 1;
      skin.depthWrite = !isClear;
      skin.needsUpdate = true;
    }
    if (!this.inside.visible) return;
    const { geometry } = this.inside;
    if (!geometry.hasAttribute("position")) {
      geometry.setAttribute("position", changing(new Float32Array(positions.length + inside.length)));
      geometry.setIndex(new BufferAttribute(edgesInside(this.tetrahedra, positions.length / 3), 1));
    }
    const position = geometry.getAttribute("position") as BufferAttribute;
    (position.array as Float32Array).set(positions);
    (position.array as Float32Array).set(inside, positions.length);
    position.needsUpdate = true;
  }

  private colour(geometry: BufferGeometry, lengths: Float32Array) {
    const colour = geometry.getAttribute("color") as BufferAttribute, colours = colour.array as Float32Array;
    if (this.shown.colour) colourByDisplacement(lengths, this.most, this.own, colours);
    else if (this.own) colours.set(this.own);
    else for (let i = 0; i < colours.length; ++i) colours[i] = TISSUE[i % 3];
    colour.needsUpdate = true;
    put(geometry, "dent", lengths);
    this.surface.material.rings(this.shown.colour ? this.most / RINGS : 0);
  }

  show(shown: Shown) {
    this.again();
    this.shown = shown;
    this.wire.visible = this.lips.wire.visible = shown.mesh;
    this.fixed.visible = shown.fixed;
    this.touchable.visible = shown.touchable;
    this.soft.visible = shown.soft;
  }

  // Reads the colours of an element's style, which differ between the light and the dark scheme. tools: the names of the tools' colours.
  dress(of: Element, tools: string[]) {
    const style = getComputedStyle(of), colourOf = (name: string) => style.getPropertyValue(name).trim();
    const [ink, held, soft, touchable] = ["--ink", "--held", "--soft-held", "--touchable"].map(colourOf), forces = tools.map(colourOf);
    const halo = new Color(ink).getHSL({ h: 0, s: 0, l: 0 }).l < 0.5 ? "#ffffff" : "#14181b";
    this.wire.material.color = this.lips.wire.material.color = new Color(ink);
    this.inside.material.color = new Color(ink);
    this.outline.material.color = new Color(ink);
    this.fixed.material.color = new Color(held);
    this.soft.material.color = new Color(soft);
    this.touchable.material.color = new Color(touchable);
    this.inks = { halo, forces, further: ink };
    this.tools.forEach((tool, t) => tool.dress(halo, forces[t] ?? ink));
    this.lines.dress(ink);
    this.noduleMarks.dress(touchable, forces[0]);
    this.again();
  }

  // Cuts the next shape that is moved: Section.set.
  cut(axis: SectionAxis, at: number) {
    this.section.set(axis, at, (direction) => this.camera.facing(direction));
    this.again();
  }

  showNodules(nodules: Nodule[], answer: Answer | null, presses: TaskPress[]) {
    this.noduleMarks.show(nodules, answer, presses);
    this.stale = true;
  }

  moveLinks(links: DrawnLink[]) {
    this.stale ||= links.length > 0 || this.links.count > 0;
    this.links.move(links);
  }

  // surfaces: of the obstacles of a scene; poses: where they are, none where they are not there.
  moveObstacles(surfaces: ObstacleMesh[], poses: Pose[]) {
    this.stale ||= poses.length > 0 || this.obstacles.count > 0;
    this.obstacles.move(surfaces, poses);
  }

  // edges: of the blades that are there, from heel to tip.
  moveBlades(edges: Vector[][]) {
    this.stale ||= edges.length > 0 || this.blades.count > 0;
    this.blades.move(edges, this.camera.camera);
  }

  // What presses the organ moves a tool from now on: the camera stays until letGo().
  hold(event: PointerEvent) {
    event.stopImmediatePropagation();
    this.canvas.focus({ preventScroll: true });
    this.canvas.setPointerCapture(event.pointerId);
    this.camera.controls.enabled = false;
    this.canvas.classList.add("held");
  }

  letGo() {
    this.camera.controls.enabled = true;
    this.canvas.classList.remove("held");
  }

  // A figure for each tool of a scene.
  private makeTools(count: number) {
    while (this.tools.length < count) {
      const tool = new ToolFigure();
      tool.dress(this.inks.halo, this.inks.further);
      if (this.quality === "low") tool.dull();
      this.tools.push(tool);
      this.scene.add(tool.group);
    }
  }

  // radii: of the tools' discs where a tool's frame has none, one for all or of each tool. pointers: of the tools that one holds, in pixels of the canvas. Returns the position of
  // each tool's label, likewise.
  moveTools(frames: (ToolFrame | null)[], radii: number | number[], pointers: ([x: number, y: number] | null)[] = []): ([x: number, y: number] | null)[] {
    const { camera } = this.camera, touched = frames.some(Boolean), pierced = frames.some((frame) => frame?.body?.kind === "needle");
    this.makeTools(frames.length);
    if (pierced !== this.seesThrough) {
      this.seesThrough = pierced;
      this.again();
    }
    this.stale ||= touched || this.touched;
    this.touched = touched;
    this.outline.visible = this.outlinesRest && touched && !this.section.cut.visible;
    const places = frames.map((frame, t) => {
      const tip = this.tools[t].move(frame, frame?.radius ?? (typeof radii === "number" ? radii : radii[t]), camera);
      return tip && this.toScreen(tip);
    });
    this.tools.slice(frames.length).forEach((tool) => tool.move(null, 0, camera));
    this.surface.material.shade(this.tools.slice(0, TOOL_COUNT).map((tool) => tool.shade));
    this.lines.move(frames.map((frame, t) => {
      const at = pointers[t], tip = this.tools[t].shade?.tip;
      return frame && at && tip ? { from: tip, to: this.atPixel(at, new Vector3(...frame.point)) } : null;
    }));
    return places;
  }

  // The point below a pixel, as far from the eye as another point is.
  private atPixel([x, y]: [number, number], like: Vector3): Vector3 {
    const { clientWidth: width, clientHeight: height } = this.canvas, depth = like.clone().project(this.camera.camera).z;
    return new Vector3((2 * x) / width - 1, 1 - (2 * y) / height, depth).unproject(this.camera.camera);
  }

  // Where these places of the surface at rest are in the canvas, px; null: on the far side.
  places(of: Vector[]): ([x: number, y: number] | null)[] {
    return of.map((place) => {
      const at = this.toScreen(new Vector3(...place)), seen = this.pick(...at);
      return seen && distance(seen.place, place) < SAME_PLACE ? at : null;
    });
  }

  // The canvas, with the picture that is drawn now.
  picture(): HTMLCanvasElement {
    this.draw();
    return this.canvas;
  }

  pick(x: number, y: number): Hit | null {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    this.raycaster.setFromCamera(new Vector2((2 * x) / width - 1, 1 - (2 * y) / height), this.camera.camera);
    const drawn = (point: Vector3) => this.section.planes.every((plane) => plane.distanceToPoint(point) >= 0);
    const hit = this.raycaster.intersectObjects([this.surface, ...this.lips.picked], false).find(({ point }) => drawn(point));
    if (!hit?.face || hit.face.normal.dot(this.raycaster.ray.direction) > 0) return null; // the cut is before it
    const corners = [hit.face.a, hit.face.b, hit.face.c];
    const barycentric = barycentricOf(hit.point, corners.map((n) => new Vector3().fromBufferAttribute(this.geometry.getAttribute("position") as BufferAttribute, n)));
    const mix = (of: Float32Array) => [0, 1, 2].map((d) => corners.reduce((sum, n, i) => sum + barycentric[i] * of[3 * n + d], 0)) as Vector;
    const isLip = hit.object !== this.surface, normal = isLip ? hit.face.normal : new Vector3(...mix(this.restNormals)).normalize();
    return { isLip, away: hit.distance, triangle: hit.faceIndex!, nodes: corners, barycentric, point: hit.point.toArray() as Vector, place: mix(this.rest), normal: normal.toArray() as Vector };
  }

  // A touchable point of the organ near the middle of the view, which the view shows from the side: a press there is a dent that one
  // sees.
  front(touchable: ArrayLike<number>): Hit | null {
    const { clientWidth: width, clientHeight: height } = this.canvas, nodes = new Set(Array.from(touchable));
    let best: Hit | null = null, least = Infinity;
    for (let x = 0.2; x < 0.81; x += 0.05)
      for (let y = 0.2; y < 0.81; y += 0.05) {
        const hit = this.pick(x * width, y * height);
        if (!hit) continue;
        const away = Math.hypot(x - 0.5, y - 0.5), beyond = hit.nodes.every((node) => nodes.has(node)) ? 0 : 10;
        const cost = beyond + away + 2 * Math.abs(this.camera.facing(hit.normal) - FROM_THE_SIDE);
        if (cost < least) [best, least] = [hit, cost];
      }
    return best;
  }

  // The touchable point that lies farthest from the organ's middle, of those that face the view.
  end(touchable: ArrayLike<number>): Hit | null {
    const { clientWidth: width, clientHeight: height } = this.canvas, nodes = new Set(Array.from(touchable)), { x, y, z } = this.camera.controls.target;
    let best: Hit | null = null, most = 0;
    for (let right = 0.02; right < 0.99; right += 0.02)
      for (let down = 0.02; down < 0.99; down += 0.02) {
        const hit = this.pick(right * width, down * height);
        if (!hit || !hit.nodes.every((node) => nodes.has(node)) || this.camera.facing(hit.normal) < FACES) continue;
        const away = distance(hit.place, [x, y, z]);
        if (away > most) [best, most] = [hit, away];
      }
    return best;
  }

  // The line of sight through a pixel: from the eye, along a direction of length 1.
  sight(x: number, y: number): { from: Vector; along: Vector } {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    this.raycaster.setFromCamera(new Vector2((2 * x) / width - 1, 1 - (2 * y) / height), this.camera.camera);
    return { from: this.raycaster.ray.origin.toArray() as Vector, along: this.raycaster.ray.direction.toArray() as Vector };
  }

  // Moves a point by pixels in the plane that faces the camera.
  drag(point: Vector, dx: number, dy: number): Vector {
    const metres = this.metresPerPixel(point);
    const right = new Vector3(), up = new Vector3();
    this.camera.camera.matrixWorld.extractBasis(right, up, new Vector3());
    return new Vector3(...point).addScaledVector(right, dx * metres).addScaledVector(up, -dy * metres).toArray() as Vector;
  }

  metresPerPixel(point: Vector): number {
    return this.camera.metresPerPixel(new Vector3(...point), this.canvas.clientHeight);
  }

  // Calls `draw` for each frame of the screen, or of a headset while it shows the organ.
  loop(draw: () => void) {
    this.renderer.setAnimationLoop(draw);
  }

  get xr() {
    return this.renderer.xr;
  }

  add(object: Object3D) {
    this.scene.add(object);
    this.stale = true;
  }

  // Draws only where the picture would differ from the last one, and says whether it drew: a page at rest takes no time of the graphics card.
  render(): boolean {
    if (this.xr.isPresenting) return this.draw(); // the headset has its own size and cameras
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return false; // while the page is laid out
    const size = this.renderer.getSize(new Vector2());
    if (size.x !== width || size.y !== height) this.resize(width, height, this.renderer.getPixelRatio());
    this.camera.update();
    const from = [...this.camera.camera.position, ...this.camera.controls.target].join(), now = performance.now();
    if (this.stale || from !== this.drawnFrom) this.changed = now;
    const ratio = this.ratioAt(now);
    if (ratio !== this.renderer.getPixelRatio()) this.resize(width, height, ratio);
    if (!this.stale && from === this.drawnFrom) {
      this.slow.pause();
      return false;
    }
    this.drawnFrom = from;
    if (this.quality === "high" && !isChosen() && this.slow.add(now)) this.draws("low");
    return this.draw();
  }

  // Pixels of the picture for one of the page. In low quality a picture that stays is drawn once more, with more of them.
  private ratioAt(now: number): number {
    if (this.quality === "high") return Math.min(2, devicePixelRatio);
    return Math.min(1, devicePixelRatio) * (now - this.changed > STAYS ? SHARPER : 1);
  }

  private resize(width: number, height: number, ratio: number) {
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    this.camera.resize(width / height);
    this.stale = true;
  }

  private draw(): boolean {
    this.renderer.render(this.scene, this.camera.camera);
    this.stale = this.xr.isPresenting;
    return true;
  }

  // Gives the graphics memory back.
  close() {
    this.renderer.setAnimationLoop(null);
    this.canvas.ownerDocument.removeEventListener("visibilitychange", this.again);
    this.camera.controls.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
  }

  private toScreen(point: Vector3): [number, number] {
    const p = point.clone().project(this.camera.camera);
    return [((p.x + 1) / 2) * this.canvas.clientWidth, ((1 - p.y) / 2) * this.canvas.clientHeight];
  }
}

// Pairs of nodes; nodes 0 .. surface-1 are on the surface.
function edgesInside(tetrahedra: Uint32Array, surface: number): Uint32Array {
  const seen = new Set<number>(), edges: number[] = [];
  for (let t = 0; t < tetrahedra.length; t += 4)
    for (let i = 0; i < 4; ++i)
      for (let j = i + 1; j < 4; ++j) {
        const a = Math.min(tetrahedra[t + i], tetrahedra[t + j]), b = Math.max(tetrahedra[t + i], tetrahedra[t + j]), key = a * 2 ** 26 + b;
        if (b < surface || seen.has(key)) continue;
        seen.add(key);
        edges.push(a, b);
      }
  return Uint32Array.from(edges);
}

const changing = (numbers: Float32Array, each = 3) => new BufferAttribute(numbers, each).setUsage(DynamicDrawUsage);

// Gives an object a new geometry; it is drawn wherever the camera looks.
function renewed(object: Pick<Object3, "geometry" | "frustumCulled">, attributes: Record<string, BufferAttribute>, index?: Uint32Array): BufferGeometry {
  object.geometry.dispose();
  object.geometry = new BufferGeometry();
  for (const [name, attribute] of Object.entries(attributes)) object.geometry.setAttribute(name, attribute);
  if (index) object.geometry.setIndex(new BufferAttribute(index, 1));
  object.frustumCulled = false;
  return object.geometry;
}

function put(geometry: BufferGeometry, name: string, numbers: Float32Array) {
  const attribute = geometry.getAttribute(name) as BufferAttribute;
  (attribute.array as Float32Array).set(numbers);
  attribute.needsUpdate = true;
}

// Draws an object as if it were nearer to the camera by this distance, m.
function shownThrough(material: Material, by: number) {
  material.onBeforeCompile = (shader) => {
    shader.vertexShader = shader.vertexShader.replace("#include <project_vertex>", `#include <project_vertex>
      vec4 nearer = projectionMatrix * (mvPosition + vec4(0.0, 0.0, ${by.toFixed(4)}, 0.0));
      gl_Position.z = nearer.z / nearer.w * gl_Position.w;`);
  };
}

function barycentricOf(p: Vector3, [a, b, c]: Vector3[]): Vector {
  const area = (u: Vector3, v: Vector3, w: Vector3) => v.clone().sub(u).cross(w.clone().sub(u));
  const whole = area(a, b, c), square = whole.lengthSq();
  const first = area(b, c, p).dot(whole) / square, second = area(c, a, p).dot(whole) / square;
  return [first, second, 1 - first - second];
}
