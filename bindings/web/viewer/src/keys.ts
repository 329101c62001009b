// The keyboard: turns the organ, moves the cross, pushes at the cross. Keys work wherever the focus is within `heard`, apart from those
// that the focused control uses itself.
import type { Cross } from "./cross";

const STEP = 24; // px: one move of the cross
const TURN = 0.08; // rad
const NEARER = 0.92;

export interface KeyActions {
  isOpen: () => boolean;
  turn: (right: number, up: number) => void;
  nearer: (factor: number) => void;
  push: (down: boolean, x: number, y: number) => void; // at a point of the canvas, px
  home: () => void;
  undo: () => void;
  replay: () => void;
  reset: () => void;
}

export class Keys {
  private pushes = false;
  private points = false; // a press of the pointer gives the canvas the focus, which browsers may show as that of the keyboard

  constructor(private canvas: HTMLElement, private cross: Cross, private actions: KeyActions, heard: Document | HTMLElement = document) {
    (heard as HTMLElement).addEventListener("keydown", (event) => this.down(event));
    (heard as HTMLElement).addEventListener("keyup", (event) => event.key === " " && this.push(false));
    for (const left of [window, heard]) left.addEventListener("blur", () => this.push(false));
    // The ring and the cross are shown to users of the keyboard alone.
    canvas.addEventListener("focus", () => this.byKeys(!this.points && canvas.matches(":focus-visible")));
    canvas.addEventListener("blur", () => this.byKeys(false));
    document.addEventListener("pointerdown", () => this.byKeys(!(this.points = true)), { capture: true });
    for (const ended of ["pointerup", "pointercancel", "keydown"]) document.addEventListener(ended, () => (this.points = false), { capture: true });
  }

  private down(event: KeyboardEvent) {
    const undoes = event.key === "z" && !event.shiftKey; // with Ctrl or Command too
    if (((event.ctrlKey || event.metaKey) && !undoes) || event.altKey || !this.actions.isOpen() || usesKey(event.target as HTMLElement, event.key)) return;
    const act = this.act(event);
    if (!act) return;
    event.preventDefault();
    this.byKeys(true);
    act();
  }

  private act({ key, shiftKey }: KeyboardEvent): (() => void) | undefined {
    const { turn, nearer, home, undo, replay, reset } = this.actions;
    const arrow = (right: number, up: number) => () => (shiftKey ? this.cross.move(STEP * right, -STEP * up) : turn(TURN * right, TURN * up));
    const acts: Record<string, () => void> = {
      ArrowLeft: arrow(-1, 0), ArrowRight: arrow(1, 0), ArrowUp: arrow(0, 1), ArrowDown: arrow(0, -1),
      "+": () => nearer(NEARER), "=": () => nearer(NEARER), "-": () => nearer(1 / NEARER),
      Home: home, h: home, z: undo, r: replay, Escape: reset, " ": () => this.push(true),
    };
    return acts[key.length === 1 ? key.toLowerCase() : key];
  }

  private push(down: boolean) {
    if (down === this.pushes) return;
    this.pushes = down;
    this.actions.push(down, ...this.cross.place);
  }

  private byKeys(on: boolean) {
    this.canvas.classList.toggle("by-keys", on);
    this.cross.show(on);
  }
}

// Whether a focused control does something of its own with the key.
function usesKey(focused: HTMLElement, key: string): boolean {
  if (focused.matches("select")) return key !== "Escape";
  if (focused.matches("button, a, summary")) return key === " " || key === "Enter";
  if (!(focused instanceof HTMLInputElement)) return false;
  if (focused.type === "checkbox") return key === " ";
  return focused.type !== "radio" && focused.type !== "range" ? true : key === " " || key === "Home" || key.startsWith("Arrow");
}
