// The motions of a scene, by name: organs that breathe together have one clock.
import type { Motion, World } from "../../module/palpate.js";
import type { SceneMotion, WorldScene } from "./world_scene";
import { sineCosine } from "./sine";
import { word } from "./words";

export interface ClockState {
  name: string;
  share: number; // of the round, 0 to 1
  plays: boolean;
}

class MotionClock {
  time = 0; // s
  plays = false;
  private round: number; // s
  private returns: boolean; // after a round it begins again without a jump

  constructor(readonly name: string, motions: SceneMotion[]) {
    this.round = Math.max(...motions.map(({ rows, sine }) => (sine ? sine.period : rows!.at(-1)![0])), 1e-3);
    this.returns = motions.every(({ sine }) => sine);
  }

  get share(): number {
    return this.returns ? (this.time % this.round) / this.round : Math.min(1, this.time / this.round);
  }
  set share(share: number) {
    this.time = share * this.round;
  }

  play() {
    this.plays = true;
    if (!this.returns && this.time >= this.round) this.time = 0;
  }

  advance(seconds: number) {
    if (!this.plays) return;
    this.time += seconds;
    if (!this.returns && this.time >= this.round) this.plays = false;
  }
}

interface MovedOrgan {
  organ: number;
  amounts: Float64Array; // of all motions of its bundle
  parts: { clock: MotionClock; index: number; scale: number; motion: SceneMotion }[];
}

export class MotionClocks {
  private organs: MovedOrgan[] = [];
  private clocks: MotionClock[];

  // known: the motions of each organ's bundle. Throws an Error where the scene names one that its bundle does not have.
  constructor({ motions, organs, unit }: WorldScene, known: Motion[][]) {
    this.clocks = [...new Set(motions.map(({ name }) => name))].map((name) => new MotionClock(name, motions.filter((motion) => motion.name === name)));
    organs.forEach(({ name }, organ) => {
      const own = motions.filter((motion) => motion.organ === organ);
      if (!own.length) return;
      const parts = own.map((motion) => {
        const index = known[organ].findIndex((one) => one.name === motion.name);
        if (index < 0)
          throw new Error(word("world.no-motion", { organ: name, name: motion.name, known: known[organ].map((one) => one.name).join(", ") || word("scene.nothing") }));
        const { kind } = known[organ][index], scale = kind === "piston" ? unit : kind === "rotation" ? Math.PI / 180 : 1;
        return { clock: this.clocks.find((clock) => clock.name === motion.name)!, index, scale, motion };
      });
      this.organs.push({ organ, amounts: new Float64Array(known[organ].length), parts });
    });
  }

  get play(): boolean {
    return this.clocks.some((clock) => clock.plays);
  }
  get states(): ClockState[] {
    return this.clocks.map(({ name, share, plays }) => ({ name, share, plays }));
  }

  // Sets a clock by its name: to a share of its round, where one is given.
  set(name: string, plays: boolean, share?: number) {
    const clock = this.clocks.find((one) => one.name === name);
    if (!clock) return;
    if (share !== undefined) clock.share = share;
    if (plays) clock.play();
    else clock.plays = false;
  }

  advance(seconds: number) {
    for (const clock of this.clocks) clock.advance(seconds);
  }

  // All clocks at one time, s.
  goTo(time: number) {
    for (const clock of this.clocks) clock.time = time;
  }

  // Moves the organs of a world.
  move({ organs }: World) {
    this.fill();
    for (const { organ, amounts } of this.organs) organs[organ].setMotions(amounts);
  }

  private fill() {
    for (const { amounts, parts } of this.organs) for (const { clock, index, scale, motion } of parts) amounts[index] = scale * amountAt(motion, clock.time);
  }
}

function amountAt({ rows, sine }: SceneMotion, time: number): number {
  return sine ? sine.mean + sine.amplitude * sineCosine(2 * Math.PI * ((time / sine.period) % 1)).sine : valueAt(rows!, time);
}

// On straight lines between the rows, the first one before them, the last one after them.
export function valueAt(rows: number[][], time: number): number {
  const after = rows.findIndex(([t]) => t > time);
  if (after === 0) return rows[0][1];
  if (after < 0) return rows.at(-1)![1];
  const [t0, a] = rows[after - 1], [t1, b] = rows[after];
  return a + ((time - t0) / (t1 - t0)) * (b - a);
}
