// The task of finding a hidden nodule by touch: the user presses, to one depth everywhere, reads the stiffness of each place, names the
// place of the last press, and learns how far it is from the point of the surface above the nodule.
import { noduleCard } from "./nodule_card";
import { distance } from "./geometry";
import type { Vector } from "./messages";
import { levelOf, type Nodule } from "./nodules";
import { brief, fixed, word } from "./words";

export const TASK_DEPTH = 0.006; // m, of each press

export interface Answer {
  nodule: Nodule; // the one whose point is nearest to the place
  place: Vector; // of the surface at rest, m
  millimetres: number; // between the place and the nodule's point
}

// What a press found: force over depth, N/mm; null: nobody knows.
export interface Stiffness {
  here: number;
  healthy: number | null; // at the same place of a healthy organ
}

export interface TaskPress {
  place: Vector; // of the surface at rest, m
  found: Stiffness | null;
}

export interface TaskEvents {
  show: (nodules: Nodule[], answer: Answer | null, presses: TaskPress[]) => void; // what the organ's view marks
  ended: () => void; // takes the tools away
  picture: () => HTMLCanvasElement; // of the organ, drawn just now
}

export class NoduleTask {
  answer: Answer | null = null;
  presses: TaskPress[] = [];
  private nodules: Nodule[] = [];
  private began = 0; // ms
  private took = 0; // s
  private isCompared = false;

  constructor(private box: HTMLElement, private offer: HTMLElement, private events: TaskEvents) {
    offer.addEventListener("click", () => this.start());
    this.part("here").addEventListener("click", () => this.here());
    this.part("again").addEventListener("click", () => this.start());
    this.part("stop").addEventListener("click", () => this.stop());
    this.part("card").addEventListener("click", () => noduleCard(this.events.picture(), this.result(this.answer!)));
    this.target.addEventListener("change", () => this.mark());
  }

  private part(name: string): HTMLButtonElement {
    return this.box.querySelector(`[data-do="${name}"]`)!;
  }

  // The nodule to be found: its number; empty: any.
  private get target(): HTMLSelectElement {
    return this.box.querySelector("select")!;
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
    this.target.value = "";
    this.stop();
  }

  get canStart() {
    return this.nodules.length > 0;
  }

  start() {
    this.presses = [];
    this.began = 0;
    this.answer = null;
    this.box.hidden = false;
    this.events.ended();
    this.mark();
    this.show();
  }

  stop() {
    this.box.hidden = true;
    this.answer = null;
    this.presses = [];
    this.mark();
  }

  // A press at a place of the surface at rest. stiffness: what is found there.
  async press(place: Vector, stiffness: () => Promise<Stiffness | null>) {
    if (!this.isOn) return;
    if (!this.began) this.began = performance.now();
    const press: TaskPress = { place, found: null };
    this.presses.push(press);
    this.show();
    press.found = await stiffness();
    if (!this.isOn || !this.presses.includes(press)) return;
    this.mark();
    this.show();
  }

  private here() {
    const { last } = this;
    if (!last) return;
    const wanted = this.target.value, among = wanted ? [this.nodules[Number(wanted)]] : this.nodules;
    this.answer = nearestNodule(among, last.place);
    this.took = (performance.now() - this.began) / 1000;
    this.events.ended();
    this.mark();
    this.show();
  }

  private get last(): TaskPress | undefined {
    return this.presses.at(-1);
  }

  private mark() {
    this.events.show(this.answer ? this.nodules : [], this.answer, this.presses);
  }

  show() {
    const { answer, presses: { length: count } } = this;
    this.part("here").hidden = !!answer;
    this.part("here").disabled = count === 0;
    this.part("again").hidden = this.part("card").hidden = !answer;
    this.showTargets(count > 0);
    this.box.querySelector("p")!.textContent = answer ? this.result(answer)
      : count ? word("task.ask", { presses: counted("presses", count), found: this.found(this.last!) })
      : word(this.nodules.length > 1 ? "task.begin.many" : "task.begin.one", {
        count: this.nodules.length, depth: brief(1000 * TASK_DEPTH), level: word(`task.level.${levelOf(this.nodules[0] ?? null)}`), advice: this.isCompared ? `${word("task.advice")} ` : "",
      });
  }

  // The list of nodules with the difficulty of each; a choice before the first press.
  private showTargets(isBegun: boolean) {
    const { target, nodules } = this, chosen = target.value;
    target.closest("label")!.hidden = nodules.length < 2 || !!this.answer;
    target.disabled = isBegun;
    target.replaceChildren(new Option(word("task.target.any"), ""), ...nodules.map((nodule, n) =>
      new Option(word("task.target", { level: word(`task.level.${levelOf(nodule)}`), deep: fixed(deepOf(nodule), 0), times: brief(nodule.stiffer) }), String(n))));
    target.value = chosen;
  }

  private found({ found }: TaskPress): string {
    if (!found) return "";
    const { here, healthy } = found, known = { here: fixed(here, 3) };
    return `${healthy ? word("task.found.compared", { ...known, healthy: fixed(healthy, 3), times: fixed(here / healthy, 2) }) : word("task.found", known)} `;
  }

  private result({ nodule, millimetres }: Answer): string {
    return word("task.result", {
      away: fixed(millimetres, 1), wide: fixed(2000 * nodule.radius, 0), deep: fixed(deepOf(nodule), 0), level: word(`task.level.${levelOf(nodule)}`), times: brief(nodule.stiffer),
      presses: counted("presses", this.presses.length), seconds: counted("seconds", Math.round(this.took)),
    });
  }
}

// mm of healthy tissue above it.
const deepOf = ({ centre, above, radius }: Nodule) => 1000 * Math.max(0, distance(centre, above) - radius);

export function nearestNodule(nodules: Nodule[], place: Vector): Answer {
  const answers = nodules.map((nodule) => ({ nodule, place, millimetres: 1000 * distance(nodule.above, place) }));
  return answers.reduce((best, one) => (one.millimetres < best.millimetres ? one : best));
}

const counted = (what: "presses" | "seconds", count: number) => word(`task.${what}.${count === 1 ? "one" : "many"}`, { count });
