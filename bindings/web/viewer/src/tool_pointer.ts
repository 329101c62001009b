// Turns the input of mouse, pen, fingers and keys into targets of the tools.
import { along, distance } from "./geometry";
import { TOOL_COUNT, type ToolTarget, type Vector } from "./messages";
import type { Hit, OrganView } from "./organ_view";

const ABOVE = 0.002; // m, height above the surface at which a tool starts
const GRASP = 3e-4; // m, depth at which a pulling tool takes hold
const TOUCH_DOWN = 0.001; // m, depth of a press before the pointer moves
const ARRIVED = 1e-6; // m, from its target
const DEEPEST = 0.03; // m
const DEEPEST_SHARE = 0.3; // of the organ's radius: well below palpate_scene_def.release_distance, at which a tool loses its contact
const PEN_DEPTH = 0.02; // m, how deep a pen presses at its full pressure
const FINGER_SCALE = 1e-4; // m per pixel at the most: on a phone the organ is small, and a short way of the finger would go deep
const NO_PRESSURE = 0.5; // what browsers report for a pen that does not measure its pressure
const KEY_SPEED = 0.012; // m/s while space is held
const KEYBOARD = -1, GAMEPAD = -2; // stand for the ids of pointers
const HANDED_OVER = "palpateHandedOver"; // marks an event that the camera alone hears

export interface PointerOptions {
  pulls: () => boolean;
  keeps: () => boolean;
  followsDeformed: (hit: Hit) => boolean;
  radiusAt?: (hit: Hit) => number; // m, of the organ there; left out: of all that is shown
  send: (index: number, target: ToolTarget) => void;
  withdraw: (index: number) => void; // as if the press had not been
  pressed: (hit: Hit) => void;
  isIdle?: () => boolean; // something else hears the pointer
  depth?: () => number | null; // m, to which each push goes; null: as the pointer says
}

interface Held {
  pointer: number;
  index: number;
  hit: Hit;
  place: Vector; // the point where the tool meets the surface
  x: number;
  y: number;
  now: [x: number, y: number];
  since: number; // ms
  target: ToolTarget;
  scale: number; // m per pixel
  measures: boolean; // it is a pen that has reported a pressure
  slides: boolean; // a push follows the pointer along the surface's plane too
}

export class ToolPointer {
  private held: Held[] = [];
  private fingers = new Map<number, PointerEvent>(); // on the canvas, with their last events
  private targets: (ToolTarget | null)[] = Array(TOOL_COUNT).fill(null);
  private oldest = 0;
  private coming: number[] = []; // tools that are not in place yet; the first one is on its way

  constructor(private canvas: HTMLCanvasElement, private view: OrganView, private options: PointerOptions) {
    // These listeners run before those of the camera: a press on the organ moves a tool, a press beside the organ turns the camera.
    canvas.addEventListener("pointerdown", (event) => this.down(event), { capture: true });
    canvas.addEventListener("pointermove", (event) => this.move(event), { capture: true });
    for (const end of ["pointerup", "pointercancel"] as const)
      canvas.addEventListener(end, (event) => (this.fingers.delete(event.pointerId), this.up(event.pointerId, event)), { capture: true });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  }

  // Where the pointer is that holds each tool, in pixels of the canvas; null: none does.
  get places(): ([x: number, y: number] | null)[] {
    return this.targets.map((_, index) => this.held.find((h) => h.index === index && h.pointer !== KEYBOARD)?.now ?? null);
  }

  get active() {
    return this.held.length > 0;
  }

  // The tools that stay although no pointer holds them.
  get kept(): (ToolTarget | null)[] {
    return this.targets.map((target, index) => (this.held.some((h) => h.index === index) ? null : target));
  }

  // Puts tools that stay, one after the other: a tool meets the organ as the tools before it have left it.
  keep(targets: (ToolTarget | null)[]) {
    this.targets = targets.slice(0, TOOL_COUNT);
    this.coming = [...this.targets.keys()].filter((index) => this.targets[index]);
    if (this.coming.length) this.options.send(this.coming[0], this.targets[this.coming[0]]!);
  }

  // Removes all tools at once.
  forget() {
    this.held = [];
    this.coming = [];
    this.targets.fill(null);
    this.view.letGo();
  }

  // The space key: pushes at a point of the canvas, deeper the longer it is held.
  key(down: boolean, x: number, y: number) {
    const held = this.held.find((h) => h.pointer === KEYBOARD);
    if (!down) return held && this.up(KEYBOARD);
    if (held) return;
    const hit = this.view.pick(x, y);
    if (hit) this.take(KEYBOARD, hit, x, y);
  }

  // A gamepad's press, as deep as `share` (0 to 1) says, dragged to a point of the canvas.
  press(share: number, x: number, y: number) {
    if (!this.held.some((h) => h.pointer === GAMEPAD)) {
      const hit = this.view.pick(x, y);
      if (hit) this.take(GAMEPAD, hit, x, y);
    }
    const held = this.held.find((h) => h.pointer === GAMEPAD);
    if (held) this.aim(held, share * PEN_DEPTH, x - held.x, y - held.y);
  }

  release() {
    this.up(GAMEPAD);
  }

  // Once per frame: sends the next tool that stays when the one before it has arrived, and deepens the pushes that grow with time.
  // places: of the tools.
  tick(places: (Vector | null)[]) {
    const [index, next] = this.coming, target = this.targets[index], at = places[index];
    if (target && at && distance(at, target.point) < ARRIVED) {
      this.coming.shift();
      if (this.targets[next]) this.options.send(next, this.targets[next]);
    }
    const held = this.held.find((h) => h.pointer === KEYBOARD);
    if (held) this.aim(held, TOUCH_DOWN + ((performance.now() - held.since) / 1000) * KEY_SPEED, 0, 0);
  }

  private down(event: PointerEvent) {
    if ((event as unknown as Record<string, boolean>)[HANDED_OVER]) return;
    if (event.pointerType === "touch") {
      this.fingers.set(event.pointerId, event);
      if (this.fingers.size > 1) return this.pinch();
    }
    if (event.button !== 0 || this.options.isIdle?.()) return;
    const hit = this.view.pick(event.offsetX, event.offsetY);
    if (!hit) return;
    this.view.hold(event);
    this.take(event.pointerId, hit, event.offsetX, event.offsetY);
  }

  private take(pointer: number, hit: Hit, x: number, y: number) {
    const index = this.freeTool();
    if (index === null) return;
    const place = this.options.followsDeformed(hit) ? hit.point : hit.place;
    const grasp = this.options.pulls() ? along(place, hit.normal, -GRASP) : null;
    // Above the surface at rest too: a dent that is drawn may be gone in the engine, as after a reset, and a tool that starts in the organ
    // meets nothing.
    const dent = hit.normal.reduce((sum, n, d) => sum + n * (hit.place[d] - place[d]), 0);
    const target: ToolTarget = { start: along(place, hit.normal, ABOVE + Math.max(0, dent)), point: place, grasp, down: true };
    const held: Held = { pointer, index, hit, place, x, y, now: [x, y], since: performance.now(), target, scale: this.view.metresPerPixel(hit.point), measures: false, slides: pointer === GAMEPAD };
    this.held.push(held);
    this.options.pressed(hit);
    this.aim(held, TOUCH_DOWN, 0, 0);
  }

  // A tool that no pointer uses; if there is none, the tool that was released first.
  private freeTool(): number | null {
    const busy = (index: number) => this.held.some((h) => h.index === index);
    const free = this.targets.findIndex((target, index) => !target && !busy(index));
    if (free >= 0) return free;
    for (let i = 0; i < TOOL_COUNT; ++i) {
      const index = (this.oldest + i) % TOOL_COUNT;
      if (busy(index)) continue;
      this.oldest = (index + 1) % TOOL_COUNT;
      return index;
    }
    return null;
  }

  // Two fingers move the camera: a finger that pushed takes its tool back, and the camera gets the finger too.
  private pinch() {
    for (const { pointer, index } of this.held.filter((h) => this.fingers.has(h.pointer))) {
      this.end(pointer);
      this.targets[index] = null;
      this.options.withdraw(index);
      const { clientX, clientY } = this.fingers.get(pointer)!;
      const event = new PointerEvent("pointerdown", { pointerId: pointer, pointerType: "touch", clientX, clientY, button: 0, buttons: 1 });
      this.canvas.dispatchEvent(Object.assign(event, { [HANDED_OVER]: true }));
    }
  }

  private move(event: PointerEvent) {
    if (this.fingers.has(event.pointerId)) this.fingers.set(event.pointerId, event);
    const held = this.held.find((h) => h.pointer === event.pointerId);
    if (!held) {
      if (event.pointerType === "mouse" && event.buttons === 0)
        this.canvas.classList.toggle("over", this.view.pick(event.offsetX, event.offsetY) !== null);
      return;
    }
    event.stopImmediatePropagation();
    held.now = [event.offsetX, event.offsetY];
    const dx = event.offsetX - held.x, dy = event.offsetY - held.y;
    held.measures ||= event.pointerType === "pen" && event.pressure !== NO_PRESSURE;
    const scale = event.pointerType === "touch" ? Math.min(held.scale * 0.5, FINGER_SCALE) : held.scale * 0.5;
    const deeper = held.measures ? event.pressure * PEN_DEPTH : Math.hypot(dx, dy) * scale;
    this.aim(held, TOUCH_DOWN + deeper, dx, dy);
  }

  // The target of a push: along the normal, at the depth; where it slides, beside it too. The target of a pull: the position of the pointer.
  private aim(held: Held, depth: number, dx: number, dy: number) {
    const { target, hit, place } = held;
    depth = this.options.depth?.() ?? depth;
    const dragged = this.view.drag(hit.point, dx, dy);
    const way = dragged.map((x, d) => x - hit.point[d]), up = way.reduce((sum, x, d) => sum + x * hit.normal[d], 0);
    const pulled = place.map((x, d) => x + way[d]) as Vector;
    const beside = held.slides ? (place.map((x, d) => x + way[d] - up * hit.normal[d]) as Vector) : place;
    held.target = { ...target, point: target.grasp ? limited(place, pulled, this.deepest(hit)) : along(beside, hit.normal, -Math.min(this.deepest(hit), depth)) };
    this.targets[held.index] = held.target;
    this.options.send(held.index, held.target);
  }

  private deepest(hit: Hit) {
    return Math.min(DEEPEST, DEEPEST_SHARE * (this.options.radiusAt?.(hit) ?? this.view.radius));
  }

  private up(pointer: number, event?: PointerEvent) {
    const held = this.end(pointer);
    if (!held) return;
    event?.stopImmediatePropagation();
    if (this.options.keeps()) return;
    this.targets[held.index] = null;
    this.options.send(held.index, { ...held.target, down: false });
  }

  private end(pointer: number): Held | undefined {
    const held = this.held.find((h) => h.pointer === pointer);
    this.held = this.held.filter((h) => h !== held);
    if (held && this.held.length === 0) this.view.letGo();
    return held;
  }
}

function limited(from: Vector, to: Vector, most: number): Vector {
  const way = to.map((x, d) => x - from[d]), length = Math.hypot(...way);
  return length <= most ? to : (from.map((x, d) => x + (way[d] * most) / length) as Vector);
}
