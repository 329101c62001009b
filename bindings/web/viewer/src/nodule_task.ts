// The task of finding a hidden nodule by touch: the user presses, names the place of the last press, and learns how far it is from the
// point of the surface above the nodule.
import { distance } from "./geometry";
import type { Vector } from "./messages";
import type { Nodule } from "./nodules";
import { fixed, word } from "./words";

export interface Answer {
  nodule: Nodule; // the one whose point is nearest to the place
  place: Vector; // of the surface at rest, m
  millimetres: number; // between the place and the nodule's point
}

export interface TaskEvents {
  show: (nodules: Nodule[], answer: Answer | null) => void; // what the organ's view marks
  ended: () => void; // takes the tools away
}

export class NoduleTask {
  answer: Answer | null = null;
  private nodules: Nodule[] = [];
  private presses = 0;
  private last: Vector | null = null;
  private began = 0; // ms
  private took = 0; // s
  private times: number | null = null; // that the last press takes more force than in a healthy organ
  private isCompared = false;

  constructor(private box: HTMLElement, private offer: HTMLElement, private events: TaskEvents) {
    offer.addEventListener("click", () => this.start());
    this.part("here").addEventListener("click", () => this.here());
    this.part("again").addEventListener("click", () => this.start());
    this.part("stop").addEventListener("click", () => this.stop());
  }

  private part(name: string): HTMLButtonElement {
    return this.box.querySelector(`[data-do="${name}"]`)!;
  }

  // Presses are compared with those in a healthy organ from now on.
  compares() {
    this.isCompared = true;
    if (!this.box.hidden) this.show();
  }

  get isOn() {
    return !this.box.hidden && !this.answer;
  }

  // Of the bundle that was opened; a bundle without nodules has no task.
  open(nodules: Nodule[]) {
    this.isCompared = false;
    this.nodules = nodules;
    this.offer.hidden = nodules.length === 0;
    this.stop();
  }

  get canStart() {
    return this.nodules.length > 0;
  }

  start() {
    this.presses = this.began = 0;
    this.answer = this.last = this.times = null;
    this.box.hidden = false;
    this.events.ended();
    this.events.show([], null);
    this.show();
  }

  stop() {
    this.box.hidden = true;
    this.answer = null;
    this.events.show([], null);
  }

  // A press at a place of the surface at rest. times: the force that it takes there for that in a healthy organ; null: nobody knows.
  async press(place: Vector, times: () => Promise<number | null>) {
    if (!this.isOn) return;
    if (!this.began) this.began = performance.now();
    const number = ++this.presses;
    this.last = place;
    this.times = null;
    this.show();
    const found = await times();
    if (number !== this.presses || !this.isOn) return;
    this.times = found;
    this.show();
  }

  private here() {
    if (!this.last) return;
    this.answer = nearestNodule(this.nodules, this.last);
    this.took = (performance.now() - this.began) / 1000;
    this.events.ended();
    this.events.show(this.nodules, this.answer);
    this.show();
  }

  show() {
    const { answer, presses } = this;
    this.part("here").hidden = !!answer;
    this.part("here").disabled = presses === 0;
    this.part("again").hidden = !answer;
    this.box.querySelector("p")!.textContent = answer ? this.result(answer)
      : presses ? word("task.ask", { presses: counted("presses", presses), compared: this.times === null ? "" : `${word("task.times", { times: fixed(this.times, 2) })} ` })
      : word(this.nodules.length > 1 ? "task.begin.many" : "task.begin.one", { count: this.nodules.length, advice: this.isCompared ? `${word("task.advice")} ` : "" });
  }

  private result({ nodule: { centre, radius, above }, millimetres }: Answer): string {
    const deep = 1000 * Math.max(0, distance(centre, above) - radius);
    return word("task.result", {
      away: fixed(millimetres, 1), wide: fixed(2000 * radius, 0), deep: fixed(deep, 0),
      presses: counted("presses", this.presses), seconds: counted("seconds", Math.round(this.took)),
    });
  }
}

export function nearestNodule(nodules: Nodule[], place: Vector): Answer {
  const answers = nodules.map((nodule) => ({ nodule, place, millimetres: 1000 * distance(nodule.above, place) }));
  return answers.reduce((best, one) => (one.millimetres < best.millimetres ? one : best));
}

const counted = (what: "presses" | "seconds", count: number) => word(`task.${what}.${count === 1 ? "one" : "many"}`, { count });
