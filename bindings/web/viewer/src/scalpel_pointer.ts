// Turns a drag over the organ into the way of a scalpel: its edge lies along the line of sight at the pointer, from outside of the organ into it.
import { along } from "./geometry";
import type { Edge } from "./messages";
import type { OrganView } from "./organ_view";

const OUTSIDE = 0.005; // m of the edge, before the surface

export interface ScalpelOptions {
  isOn: () => boolean;
  length: () => number; // m of the edge, behind the surface
  begins: () => void;
  send: (edge: Edge | null) => void; // null: it is let go
}

export class ScalpelPointer {
  private held: { pointer: number; away: number } | null = null; // away: m, of the surface from the eye

  constructor(canvas: HTMLCanvasElement, private view: OrganView, private options: ScalpelOptions) {
    // As those of ToolPointer: before the camera's.
    canvas.addEventListener("pointerdown", (event) => this.down(event), { capture: true });
    canvas.addEventListener("pointermove", (event) => this.move(event), { capture: true });
    for (const end of ["pointerup", "pointercancel"] as const) canvas.addEventListener(end, (event) => this.held?.pointer === event.pointerId && this.up(event), { capture: true });
  }

  get active() {
    return this.held !== null;
  }

  // A second finger ends the cut: the two move the camera.
  private down(event: PointerEvent) {
    if (this.held) return this.up();
    if (!this.options.isOn() || event.button !== 0 || !event.isPrimary) return;
    const hit = this.view.pick(event.offsetX, event.offsetY);
    if (!hit) return;
    this.view.hold(event);
    this.held = { pointer: event.pointerId, away: hit.away };
    this.options.begins();
    this.options.send(this.edge(event));
  }

  private move(event: PointerEvent) {
    if (this.held?.pointer !== event.pointerId) return;
    event.stopImmediatePropagation();
    this.options.send(this.edge(event));
  }

  private up(event?: PointerEvent) {
    event?.stopImmediatePropagation();
    this.held = null;
    this.view.letGo();
    this.options.send(null);
  }

  // Beside the organ, over a lip and where another part of the organ comes into sight the edge stays as deep as it was.
  private edge({ offsetX, offsetY }: PointerEvent): Edge {
    const held = this.held!, length = this.options.length(), hit = this.view.pick(offsetX, offsetY), sight = this.view.sight(offsetX, offsetY);
    if (hit && !hit.isLip && Math.abs(hit.away - held.away) < length) held.away = hit.away;
    return [along(sight.from, sight.along, held.away - OUTSIDE), along(sight.from, sight.along, held.away + length)];
  }
}
