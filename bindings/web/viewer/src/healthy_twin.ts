// The same organ without its nodules, in an engine of its own: what a press would take there. The server has it beside the organ's bundle,
// CASE-healthy/bundle.h5 for CASE/bundle.h5 (pipelines/liver-tumour).
import { EngineStart } from "./engine_start";
import { lengthOf } from "./geometry";
import type { FromWorker, Mesh, PageEffects, Path, ToolShape, Trial } from "./messages";

export const twinOf = (bundle: string): string | null => (/\/data\/.*\/bundle\.h5$/.test(bundle) ? bundle.replace(/\/bundle\.h5$/, "-healthy/bundle.h5") : null);

// The largest force on the first tool, N.
export function largestForce({ forces }: Trial, tools: number): number {
  let largest = 0;
  for (let at = 0; at < forces.length; at += 3 * tools) largest = Math.max(largest, lengthOf(forces.subarray(at, at + 3)));
  return largest;
}

export class HealthyTwin {
  private engine: EngineStart;
  private mesh: Mesh | null = null;
  private answers: ((trial: Trial) => void)[] = [];

  // opened: it is there.
  constructor(address: string, opened: () => void) {
    const heard = (message: FromWorker) => {
      if (message.type === "tried") this.answers.shift()?.(message.trial);
      if (message.type !== "opened") return;
      this.mesh = message.mesh;
      opened();
    };
    this.engine = new EngineStart([() => new Worker(new URL("./engine.worker.ts", import.meta.url), { type: "module" })], heard, () => {});
    this.engine.tell({ type: "fetch", url: address }, []);
  }

  // Whether it has the mesh of that organ.
  isOf({ positions }: Mesh): boolean {
    return this.mesh?.positions.length === positions.length && positions.every((x, i) => Math.abs(x - this.mesh!.positions[i]) < 1e-6);
  }

  plays(path: Path, effects: PageEffects, tool: ToolShape): Promise<Trial> {
    this.engine.tell({ type: "effects", effects: { ...effects, fine: false }, tool, mesh: null }, []);
    this.engine.tell({ type: "try", path }, []);
    return new Promise((done) => this.answers.push(done));
  }

  close() {
    this.engine.close();
  }
}
