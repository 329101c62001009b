// A tool as it is drawn: a fingertip for a wide disc, a probe with a shaft for a narrow one or a point; and the arrow of the force on it.
import {
  BoxGeometry, BufferAttribute, CapsuleGeometry, CircleGeometry, Color, CylinderGeometry, DoubleSide, Group, LatheGeometry, type Material, Mesh as Object3, MeshBasicMaterial,
  MeshLambertMaterial, MeshPhysicalMaterial, Matrix4, Quaternion, RingGeometry, Shape, ShapeGeometry, SphereGeometry, Vector2, Vector3, type BufferGeometry, type PerspectiveCamera,
} from "three";
import type { ToolFrame } from "./messages";

const NEWTON = 0.03; // m of arrow
const LONGEST_ARROW = 0.08, SHORTEST_ARROW = 0.012; // m
const FINGER = 0.0045; // m: a disc of this radius or more is a fingertip's
const POINT = 0.0014; // m, radius of the ball of a tool without a disc
const THINNEST = 0.0007; // m, radius of a needle's shaft as it is drawn
const WIDEST_JAWS = 0.0035; // m, the disc radius up to which forceps are drawn wider
const OPEN_JAWS = 0.22; // rad, of each jaw
const ALONG_VIEW = 0.94; // cosine from which an arrow along the line of sight is drawn as a ring
const FOLLOWS = 0.35; // share of a turn that a frame makes, so that a tool turns smoothly

// In the figure's own frame z is the outward normal of the contact, and lengths are in disc radii.
const UP = new Vector3(0, 0, 1);

// Lit by the surface's own lights. A finger lets the dent behind it through.
const CLEAR = 0.6;
const skin = () => new MeshPhysicalMaterial({ color: "#e6b59c", roughness: 0.62, clearcoat: 0.12, clearcoatRoughness: 0.5, vertexColors: true, transparent: true, opacity: CLEAR });
const steel = () => new MeshPhysicalMaterial({ color: "#c9d0d4", roughness: 0.28, metalness: 0.85 });
const grip = () => new MeshPhysicalMaterial({ color: "#2f3a44", roughness: 0.6 });

// What moves and turns with the contact.
interface Body {
  group: Group;
  end: Vector3; // of its axis, in disc radii
  thick: number; // its radius, in disc radii
}

export class ToolFigure {
  readonly group = new Group();
  private finger = fingertip();
  private probe = flatProbe();
  private ball = ballProbe();
  private forceps = forceps();
  private needle = hypodermic();
  private arrow = new ForceArrow();
  private normal = new Vector3();
  private rod = { tip: new Vector3(), end: new Vector3(), radius: 0 };
  private shown = false;

  constructor() {
    this.group.add(...this.bodies.map((body) => body.group), this.arrow.group);
    this.group.visible = false;
  }

  private get bodies(): Body[] {
    return [this.finger, this.probe, this.ball, this.forceps, this.needle];
  }

  // What the arrow is drawn with.
  get ink() {
    return this.arrow.ink;
  }

  // The tool's axis, for its shadow; null where there is no tool.
  get shade() {
    return this.shown ? this.rod : null;
  }

  dress(halo: string, force: string) {
    this.arrow.dress(halo, force);
  }

  // Without what shines: a processor that draws takes a second to prepare that for the first press.
  dull() {
    this.group.traverse((part) => {
      if (!(part instanceof Object3) || !(part.material instanceof MeshPhysicalMaterial)) return;
      const { color, vertexColors, transparent, opacity } = part.material;
      part.material = new MeshLambertMaterial({ color, vertexColors, transparent, opacity });
    });
  }

  // radius: m, of the disc; 0: a point. Returns where the arrow's label belongs, or null without a force to label.
  move(frame: ToolFrame | null, radius: number, camera: PerspectiveCamera): Vector3 | null {
    this.group.visible = frame !== null;
    if (!frame) return (this.shown = false), null;
    const point = new Vector3(...frame.point), force = new Vector3(...frame.force), newtons = force.length();
    this.turn(frame, force, newtons);
    const { body: wanted } = frame, size = wanted?.kind === "needle" ? Math.max(radius, THINNEST) : wanted ? Math.min(radius, WIDEST_JAWS) : radius || POINT;
    const body = wanted?.kind === "jaws" ? this.forceps : wanted ? this.needle : radius === 0 ? this.ball : radius >= FINGER ? this.finger : this.probe;
    for (const one of this.bodies) one.group.visible = one === body;
    if (wanted?.kind === "jaws") this.forceps.open(wanted.closed ? 0 : OPEN_JAWS);
    if (wanted?.kind === "needle") this.needle.lengthen(wanted.length / size);
    body.group.position.copy(point);
    body.group.scale.setScalar(size);
    body.group.matrix.makeBasis(...frameAround(this.normal, camera));
    body.group.quaternion.setFromRotationMatrix(body.group.matrix);
    this.rod.tip.copy(point).addScaledVector(this.normal, body.thick * size);
    this.rod.end.copy(body.end).multiplyScalar(size).applyQuaternion(body.group.quaternion).add(point);
    this.rod.radius = body.thick * size;
    this.shown = true;
    // A needle's force is felt at its hub, where the label hides no tip.
    return this.arrow.move(body === this.needle ? this.rod.end : point, force, newtons, 1.6 * body.thick * size + 0.004, camera);
  }

  // The drawn plane's normal where the runtime tells it, else the force's direction.
  private turn(frame: ToolFrame, force: Vector3, newtons: number) {
    const axis = frame.body?.kind === "needle" ? frame.body.axis : null;
    const wanted = axis ? new Vector3(...axis).negate() : frame.normal ? new Vector3(...frame.normal) : newtons > 1e-3 ? force.clone().normalize() : null;
    if (!wanted) return;
    if (!this.shown || this.normal.lengthSq() === 0) this.normal.copy(wanted);
    else if (frame.normal || axis) this.normal.copy(wanted);
    else this.normal.lerp(wanted, FOLLOWS).normalize();
  }
}

// x, y and z of a figure: z along the normal, x as far up the picture as it can be, so that a finger comes from above.
function frameAround(normal: Vector3, camera: PerspectiveCamera): [Vector3, Vector3, Vector3] {
  const up = new Vector3(0.35, 1, 0).transformDirection(camera.matrixWorld), side = new Vector3(1, 0, 0).transformDirection(camera.matrixWorld);
  const x = up.clone().addScaledVector(normal, -up.dot(normal));
  if (x.lengthSq() < 0.02) x.copy(side).addScaledVector(normal, -side.dot(normal));
  x.normalize();
  return [x, new Vector3().crossVectors(normal, x), normal];
}

// ---- the bodies ------------------------------------------------------------------------------------------------------

// A capsule that leans back by 40 degrees from the normal. What would be below the surface is flat: the pad, of radius 1.
function fingertip(): Body {
  const group = new Group(), thick = 1.4, pad = Math.sqrt(thick * thick - 1), lean = (40 * Math.PI) / 180, long = 12;
  const axis = new Vector3(Math.sin(lean), 0, Math.cos(lean));
  const finger = new CapsuleGeometry(thick, long, 20, 40, 48).translate(0, long / 2, 0);
  finger.applyQuaternion(turnFrom(new Vector3(0, 1, 0), axis)).translate(0, 0, pad);
  flatten(finger, axis, pad, thick, long);
  group.add(new Object3(finger, skin()));
  const nail = new SphereGeometry(1, 32, 20, 0, 2 * Math.PI, 0, 0.5 * Math.PI).scale(0.68, 0.2, 0.9);
  const up = new Vector3(Math.cos(lean), 0, -Math.sin(lean)).negate();
  nail.applyMatrix4(basisOf(new Vector3(0, 1, 0), up, axis)).translate(...place(axis, 0.35, up, thick - 0.14, pad));
  group.add(new Object3(nail, new MeshPhysicalMaterial({ color: "#f0cfc2", roughness: 0.3, clearcoat: 0.6, clearcoatRoughness: 0.2, transparent: true, opacity: CLEAR })));
  return { group, end: axis.clone().multiplyScalar(5), thick };
}

const turnFrom = (from: Vector3, to: Vector3) => new Quaternion().setFromUnitVectors(from, to);
const basisOf = (x: Vector3, y: Vector3, z: Vector3) => new Matrix4().makeBasis(x, y, z);
const place = (axis: Vector3, along: number, up: Vector3, above: number, pad: number) =>
  axis.clone().multiplyScalar(along).addScaledVector(up, above).add(new Vector3(0, 0, pad)).toArray() as [number, number, number];

// Vertices below the contact's plane go onto it, the skin reddens towards the pad, and the finger fades out towards its other end.
function flatten(geometry: BufferGeometry, axis: Vector3, pad: number, thick: number, long: number) {
  const position = geometry.getAttribute("position") as BufferAttribute, colour = new Float32Array(4 * position.count), p = new Vector3();
  for (let v = 0; v < position.count; ++v) {
    p.fromBufferAttribute(position, v);
    const along = p.clone().sub(new Vector3(0, 0, pad)).dot(axis);
    const crease = 1 - 0.05 * Math.exp(-(((along - 3.2) / 0.18) ** 2)) - 0.03 * Math.exp(-(((along - 3.6) / 0.14) ** 2));
    const pressed = Math.exp(-Math.max(0, p.z) / (0.5 * thick));
    const end = Math.min(1, Math.max(0, (long - along) / (0.4 * long)));
    colour.set([crease, crease * (1 - 0.1 * pressed), crease * (1 - 0.12 * pressed), end * end * (3 - 2 * end)], 4 * v);
    position.setZ(v, Math.max(p.z, 0));
  }
  geometry.setAttribute("color", new BufferAttribute(colour, 4));
  geometry.computeVertexNormals();
}

// A steel rod of the disc's radius with a rounded rim, and a handle.
function flatProbe(): Body {
  const group = new Group(), rim = 0.12;
  const profile = [new Vector2(0, 0), new Vector2(1 - rim, 0), ...Array.from({ length: 6 }, (_, i) => {
    const angle = ((i + 1) / 6) * 0.5 * Math.PI;
    return new Vector2(1 - rim + rim * Math.sin(angle), rim - rim * Math.cos(angle));
  }), new Vector2(1, 2.2), new Vector2(0.62, 3.4), new Vector2(0.55, 24)];
  group.add(new Object3(new LatheGeometry(profile, 48).rotateX(0.5 * Math.PI), steel()));
  group.add(new Object3(new CylinderGeometry(1.25, 1.25, 14, 32).rotateX(0.5 * Math.PI).translate(0, 0, 31), grip()));
  return { group, end: UP.clone().multiplyScalar(16), thick: 1 };
}

function ballProbe(): Body {
  const group = new Group();
  group.add(new Object3(new SphereGeometry(1, 32, 20).translate(0, 0, 0.9), steel()));
  group.add(new Object3(new CylinderGeometry(0.45, 0.45, 30, 24).rotateX(0.5 * Math.PI).translate(0, 0, 16), steel()));
  group.add(new Object3(new CylinderGeometry(1.3, 1.3, 16, 32).rotateX(0.5 * Math.PI).translate(0, 0, 38), grip()));
  return { group, end: UP.clone().multiplyScalar(20), thick: 1 };
}

// Two jaws that meet at the tissue, a joint, a shaft and a handle.
function forceps(): Body & { open: (angle: number) => void } {
  const group = new Group(), hinge = 9, jaws = [1, -1].map((side) => {
    const jaw = new Group(), blade = new BoxGeometry(1.1, 0.5, hinge).translate(0, 0.28 * side, -hinge / 2);
    jaw.add(new Object3(blade, steel()));
    jaw.position.z = hinge - 0.4;
    group.add(jaw);
    return { jaw, side };
  });
  group.add(new Object3(new SphereGeometry(1, 24, 16).translate(0, 0, hinge), steel()));
  group.add(new Object3(new CylinderGeometry(0.7, 0.7, 26, 24).rotateX(0.5 * Math.PI).translate(0, 0, hinge + 13), steel()));
  group.add(new Object3(new CylinderGeometry(1.2, 1.2, 14, 24).rotateX(0.5 * Math.PI).translate(0, 0, hinge + 32), grip()));
  return { group, end: UP.clone().multiplyScalar(16), thick: 0.8, open: (angle) => jaws.forEach(({ jaw, side }) => (jaw.rotation.x = side * angle)) };
}

// A shaft with a tip of two radii, and a hub behind it. lengthen: in radii, from the tip to the hub.
function hypodermic(): Body & { lengthen: (length: number) => void } {
  const group = new Group(), tip = 4, end = new Vector3();
  const shaft = new Object3(new CylinderGeometry(1, 1, 1, 16).rotateX(0.5 * Math.PI).translate(0, 0, 0.5), steel());
  const hub = new Object3(new CylinderGeometry(4, 2, 14, 24).rotateX(0.5 * Math.PI).translate(0, 0, 7), grip());
  shaft.position.z = tip;
  group.add(new Object3(new CylinderGeometry(1, 0.05, tip, 16).rotateX(0.5 * Math.PI).translate(0, 0, tip / 2), steel()), shaft, hub);
  return { group, end, thick: 1, lengthen: (length) => ((shaft.scale.z = length - tip), (hub.position.z = length), end.set(0, 0, length)) };
}

// ---- the arrow -------------------------------------------------------------------------------------------------------

// A flat arrow beside the tool that turns about its own direction to face the eye, with a halo; along the line of sight a ring with a
// point.
class ForceArrow {
  readonly group = new Group();
  readonly ink = new MeshBasicMaterial({ depthTest: false, transparent: true, side: DoubleSide });
  private halo = new MeshBasicMaterial({ depthTest: false, transparent: true, side: DoubleSide, opacity: 0.9 });
  private flat = new Group();
  private ring = new Group();
  private parts = [this.halo, this.ink].map((material, i) => ordered(new Object3(new ShapeGeometry(new Shape()), material), i));
  private length = 0;

  constructor() {
    this.flat.add(...this.parts);
    [this.halo, this.ink].forEach((material, i) => {
      const edge = i ? 0 : 0.0007;
      this.ring.add(ordered(new Object3(new RingGeometry(0.0042 - edge, 0.0056 + edge, 40), material), i));
      this.ring.add(ordered(new Object3(new CircleGeometry(0.0016 + edge, 24), material), i));
    });
    this.group.add(this.flat, this.ring);
  }

  dress(halo: string, force: string) {
    this.halo.color = new Color(halo);
    this.ink.color = new Color(force);
  }

  // beside: m between the tool's axis and the arrow. Returns where the label belongs.
  move(point: Vector3, force: Vector3, newtons: number, beside: number, camera: PerspectiveCamera): Vector3 | null {
    this.group.visible = newtons > 5e-3;
    if (!this.group.visible) return null;
    const direction = force.clone().normalize(), eye = camera.position.clone().sub(point).normalize();
    const side = new Vector3().crossVectors(direction, eye);
    const right = new Vector3(1, 0, 0).transformDirection(camera.matrixWorld);
    if (side.dot(right) < 0) side.negate();
    const along = Math.abs(direction.dot(eye)) > ALONG_VIEW;
    this.ring.visible = along;
    this.flat.visible = !along;
    const from = point.clone().addScaledVector(along ? right : side.normalize(), beside);
    if (along) {
      this.ring.position.copy(from);
      this.ring.quaternion.copy(camera.quaternion);
      return from.addScaledVector(new Vector3(0, 1, 0).transformDirection(camera.matrixWorld), 0.01);
    }
    this.lengthen(Math.min(LONGEST_ARROW, SHORTEST_ARROW + NEWTON * newtons));
    this.flat.position.copy(from);
    this.flat.matrix.makeBasis(side, direction, new Vector3().crossVectors(side, direction));
    this.flat.quaternion.setFromRotationMatrix(this.flat.matrix);
    return from.addScaledVector(direction, this.length + 0.004);
  }

  private lengthen(length: number) {
    if (Math.abs(length - this.length) < 2e-4) return;
    this.length = length;
    this.parts.forEach((part, i) => {
      part.geometry.dispose();
      part.geometry = new ShapeGeometry(arrow(length, i ? 0 : 0.0007));
    });
  }
}

// Along y from 0; edge: by how much it is wider all around.
function arrow(length: number, edge: number): Shape {
  const shaft = 0.0011 + edge, head = 0.0034 + 2 * edge, neck = length - 0.0085 - edge, low = -edge, tip = length + 2 * edge;
  const shape = new Shape();
  shape.moveTo(-shaft, low).lineTo(shaft, low).lineTo(shaft, neck).lineTo(head, neck).lineTo(0, tip).lineTo(-head, neck).lineTo(-shaft, neck).closePath();
  return shape;
}

function ordered<Drawn extends Object3<BufferGeometry, Material>>(object: Drawn, order: number): Drawn {
  object.renderOrder = 5 + order;
  object.frustumCulled = false;
  return object;
}
