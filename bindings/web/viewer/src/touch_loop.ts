// Steps touches at a fixed rate. A browser wakes a worker about every 4 ms; it then makes the touches that are due. Where they take longer than
// there is time, as those of several organs may, it makes as many as leave time for frames between them.
import { TOUCH_HZ } from "./messages";

const LINGER = 0.25 * TOUCH_HZ; // touches after the last tool has left, while forces still decay
const MOST_DUE = 100; // a late loop runs at most this many touches to catch up and leaves out the others
const LONGEST = 12; // ms of touches without a pause, in which the page's messages are heard: it asks for a frame there

export class TouchLoop {
  lost = 0; // touches that were due and left out; the reader resets it and `made`
  made = 0; // touches that were made
  steps = 0; // since it began to run, those left out too
  quiet = 0; // touches since the last tool left
  private next = new MessageChannel(); // wakes a loop that is late: a timer would let 4 ms go by
  private running = false;
  private began = 0; // ms: the time at which step 0 was due

  // step: makes one touch, and says whether there are tools or motions. after: the touches of one wake-up.
  constructor(private step: () => boolean, private after: () => void = () => {}) {
    this.next.port1.onmessage = () => this.tick();
  }

  get isRunning() {
    return this.running;
  }

  run() {
    this.quiet = 0;
    if (this.running) return;
    this.running = true;
    this.began = performance.now();
    this.steps = 0;
    this.tick();
  }

  private leaveOut(touches: number) {
    this.lost += touches;
    this.steps += touches;
  }

  private tick() {
    const start = performance.now();
    const { lost } = this;
    let due = Math.floor(((start - this.began) * TOUCH_HZ) / 1000) - this.steps;
    if (due > MOST_DUE) this.leaveOut(due - MOST_DUE);
    due = Math.min(due, MOST_DUE);
    for (let made = 0; made < due && this.running; ++made) {
      if (performance.now() - start > LONGEST) {
        this.leaveOut(due - made);
        break;
      }
      ++this.steps;
      ++this.made;
      this.quiet = this.step() ? 0 : this.quiet + 1;
      this.running = this.quiet <= LINGER;
    }
    if (due) this.after();
    if (!this.running) return;
    if (this.lost > lost) this.next.port2.postMessage(null); // comes after what the page has sent until now
    else setTimeout(() => this.tick(), 0);
  }
}
