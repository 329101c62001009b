// The camera: turns around the organ, comes nearer, stays outside.
import { MOUSE, PerspectiveCamera, Vector3 } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

const FRONT = new Vector3(0.85, -1, 0.6).normalize(); // from the patient's front and left and from above (LPS: y to the back, z up)
// frame: "LPS", or "RAS", in which x and y point the other way.
export const frontOf = (frame: string) => (frame === "RAS" ? new Vector3(-FRONT.x, -FRONT.y, FRONT.z) : FRONT);
function directionAt(azimuth: number, height: number): Vector3 {
  const a = (azimuth * Math.PI) / 180, h = (Math.max(-89, Math.min(89, height)) * Math.PI) / 180;
  return new Vector3(Math.cos(a) * Math.cos(h), Math.sin(a) * Math.cos(h), Math.sin(h));
}
const BESIDE = 0.35; // in radii of the organ: nodes within this distance of the line of sight keep the camera away

export class OrganCamera {
  readonly camera = new PerspectiveCamera(32, 1, 0.005, 20);
  readonly controls: OrbitControls;
  private centre = new Vector3();
  private radius = 0.1; // m, of the organ
  private nodes: ArrayLike<number> = [];
  private front = FRONT;
  private from = new Vector3(); // direction for which the least distance was computed
  private sized = false; // the canvas has had a size
  private placed = false; // before that, the camera was

  constructor(canvas: HTMLCanvasElement) {
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enablePan = false;
    this.controls.enableDamping = true;
    this.controls.dampingFactor = 0.12;
    this.controls.mouseButtons.RIGHT = MOUSE.ROTATE;
  }

  // from: the direction in which the camera stands at first.
  open(centre: Vector3, radius: number, nodes: ArrayLike<number>, from: Vector3) {
    this.front = from;
    this.centre.copy(centre);
    this.radius = radius;
    this.nodes = nodes;
    this.controls.target.copy(centre);
    this.controls.maxDistance = radius * 8;
    this.home();
  }

  // The whole organ, from the front.
  home() {
    const tan = Math.tan((this.camera.fov * Math.PI) / 360);
    const distance = Math.min((0.92 * this.radius) / this.widest(), this.halfSize()) / tan;
    this.camera.position.copy(this.centre).addScaledVector(this.front, distance);
    this.update();
  }

  // The whole organ, from where this azimuth and height say, degrees; home() then comes back here.
  homeAt(azimuth: number, height: number) {
    this.front = directionAt(azimuth, height);
    this.home();
  }

  turn(right: number, up: number) {
    const offset = this.offset(), distance = offset.length(), angle = Math.atan2(offset.y, offset.x) + right;
    const height = Math.max(-1.45, Math.min(1.45, Math.asin(offset.z / distance) + up));
    offset.set(Math.cos(angle) * Math.cos(height), Math.sin(angle) * Math.cos(height), Math.sin(height)).multiplyScalar(distance);
    this.camera.position.copy(this.centre).add(offset);
  }

  nearer(factor: number) {
    this.camera.position.sub(this.centre).multiplyScalar(factor).add(this.centre);
  }

  // Azimuth and height of the camera as the centre sees it, degrees; distance, m.
  get view(): [number, number, number] {
    const { x, y, z } = this.offset(), distance = Math.hypot(x, y, z);
    return [(Math.atan2(y, x) * 180) / Math.PI, (Math.asin(z / distance) * 180) / Math.PI, distance];
  }
  set view([azimuth, height, distance]) {
    this.camera.position.copy(directionAt(azimuth, height)).multiplyScalar(distance).add(this.centre);
    this.placed = true;
    this.update();
  }

  // Looks from where another camera is, at what that one looks at.
  follow(other: OrganCamera) {
    if (this.camera.position.equals(other.camera.position) && this.controls.target.equals(other.controls.target)) return;
    this.centre.copy(other.centre);
    this.controls.target.copy(other.controls.target);
    this.camera.position.copy(other.camera.position);
    this.controls.minDistance = 0; // the other one keeps its distance
    this.from.copy(this.offset().normalize());
    this.controls.update();
  }

  // The same view in a canvas of another shape; the whole organ in the first canvas.
  resize(aspect: number) {
    const before = this.widest();
    this.camera.aspect = aspect;
    this.camera.updateProjectionMatrix();
    if (this.sized) this.nearer(before / this.widest());
    else if (!this.placed) this.home();
    this.sized = true;
  }

  update() {
    const direction = this.offset().normalize();
    if (direction.distanceTo(this.from) > 1e-3) {
      this.from.copy(direction);
      this.controls.minDistance = this.outside(direction) + 0.2 * this.radius;
    }
    this.controls.update();
  }

  // The cosine between a direction and the line of sight, 1: towards the camera.
  facing(direction: ArrayLike<number>): number {
    const { x, y, z } = this.offset().normalize();
    return x * direction[0] + y * direction[1] + z * direction[2];
  }

  metresPerPixel(point: Vector3, height: number): number {
    const depth = point.clone().sub(this.camera.position).dot(this.camera.getWorldDirection(new Vector3()));
    return (2 * depth * Math.tan((this.camera.fov * Math.PI) / 360)) / height;
  }

  private offset() {
    return this.camera.position.clone().sub(this.centre);
  }

  // What the organ's nodes ask of half the picture's height from the front, m, so that it fills three quarters of the width or half the height: a
  // picture that is higher than wide has more room than a ball around the organ asks for.
  private halfSize(): number {
    const right = new Vector3().crossVectors(this.camera.up, this.front).normalize(), up = new Vector3().crossVectors(this.front, right), node = new Vector3();
    let wide = 0, high = 0;
    for (let n = 0; n < this.nodes.length; n += 3) {
      node.fromArray(this.nodes, n).sub(this.centre);
      wide = Math.max(wide, Math.abs(node.dot(right)));
      high = Math.max(high, Math.abs(node.dot(up)));
    }
    return Math.max(wide / (0.75 * this.camera.aspect), high / 0.5);
  }

  // The smaller of height and width of the view, in heights.
  private widest() {
    return Math.min(1, this.camera.aspect);
  }

  // How far the organ reaches from its centre towards the camera, m.
  private outside({ x, y, z }: Vector3): number {
    const { nodes, centre, radius } = this, beside = (BESIDE * radius) ** 2;
    let most = 0;
    for (let n = 0; n < nodes.length; n += 3) {
      const a = nodes[n] - centre.x, b = nodes[n + 1] - centre.y, c = nodes[n + 2] - centre.z, along = a * x + b * y + c * z;
      if (along > most && a * a + b * b + c * c - along * along < beside) most = along;
    }
    return most;
  }
}
