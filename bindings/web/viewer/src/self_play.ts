// The press that plays itself, again and again, until the user does something. Where the user asks for less motion, none plays.
const PAUSE = 1500; // ms between two presses

export class SelfPlay {
  isOn = false;
  private ended = matchMedia("(prefers-reduced-motion: reduce)").matches;
  private next = 0; // ms

  // play: one press. changed: it begins, or has ended.
  constructor(private play: () => void, private changed: () => void) {
    for (const act of ["pointerdown", "keydown"]) document.addEventListener(act, () => this.end(), { capture: true });
  }

  // For an organ that was opened.
  begin() {
    if (this.ended || this.isOn) return;
    this.isOn = true;
    this.next = 0;
    this.changed();
  }

  end() {
    this.ended = true;
    if (!this.isOn) return;
    this.isOn = false;
    this.changed();
  }

  // Once per drawn frame. isPlaying: a press, or something else, plays now.
  tick(now: number, isPlaying: boolean) {
    if (!this.isOn || document.hidden) return;
    if (isPlaying) this.next = now + PAUSE;
    else if (now >= this.next) {
      this.next = now + PAUSE;
      this.play();
    }
  }
}
