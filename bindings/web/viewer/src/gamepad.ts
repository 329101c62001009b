// A gamepad (the standard mapping of https://w3c.github.io/gamepad): the left stick moves the cross and, during a press, the tool; the
// right stick turns the organ; the right trigger presses as deep as it is pulled.
import type { Cross } from "./cross";

const DEAD = 0.15; // of a stick's way: nearer to the middle it rests
const MOVE = 300; // px/s of the cross with a stick at its end
const TURN = 1.8; // rad/s
const PRESSED = 0.02; // of a trigger's way
const LONGEST_FRAME = 0.1; // s: after a pause nothing jumps
const TRIGGER = 7, RESETS = 1, HOME = 9; // buttons of the standard mapping

export interface GamepadActions {
  isOpen: () => boolean;
  turn: (right: number, up: number) => void; // rad
  press: (share: number, x: number, y: number) => void; // at a point of the canvas, px; share: of the deepest press, 0 to 1
  release: () => void;
  reset: () => void;
  home: () => void;
}

export class Gamepads {
  private before = 0; // ms, the last frame
  private pressing = false;
  private down = new Set<number>(); // buttons, in the last frame

  constructor(private cross: Cross, private actions: GamepadActions) {}

  // Once per drawn frame.
  tick(now: number) {
    const seconds = Math.min(LONGEST_FRAME, (now - this.before) / 1000), pad = connected();
    this.before = now;
    if (!pad || !this.actions.isOpen()) return this.press(0);
    const [right, down, turnRight, turnDown] = pad.axes.map(live);
    if (right || down) {
      this.cross.show(true);
      this.cross.move(MOVE * seconds * right, MOVE * seconds * down);
    }
    if (turnRight || turnDown) this.actions.turn(TURN * seconds * turnRight, -TURN * seconds * turnDown);
    this.press(pad.buttons[TRIGGER].value);
    this.act(pad, RESETS, this.actions.reset);
    this.act(pad, HOME, this.actions.home);
  }

  private press(share: number) {
    if (share > PRESSED) this.actions.press(share, ...this.cross.place);
    else if (this.pressing) this.actions.release();
    this.pressing = share > PRESSED;
  }

  // Once for each time that the button goes down.
  private act(pad: Gamepad, button: number, does: () => void) {
    const is = pad.buttons[button].pressed;
    if (is && !this.down.has(button)) does();
    if (is) this.down.add(button);
    else this.down.delete(button);
  }
}

// Browsers name gamepads in the page's secure contexts alone, and only after one of their buttons was pressed.
const connected = () => (navigator.getGamepads?.() ?? []).find((pad) => pad?.connected && pad.mapping === "standard") ?? null;
const live = (way: number) => (Math.abs(way) < DEAD ? 0 : way);
