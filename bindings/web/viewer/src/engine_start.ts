// Starts the engine's thread in the first of several ways that works, and keeps what is told to it until then.
import type { FromWorker, ToWorker } from "./messages";
import { word } from "./words";

export type WayToStart = () => Worker | Promise<Worker>;

export class EngineStart {
  private worker: Worker | null = null;
  private told: [ToWorker, Transferable[]][] = []; // before it started
  private closed = false;

  // failed: why the first way failed, where all did; and what stopped the engine later.
  constructor(ways: WayToStart[], private heard: (message: FromWorker) => void, private failed: (why: string) => void) {
    void this.start(ways);
  }

  tell(message: ToWorker, transfer: Transferable[]) {
    if (this.worker) this.worker.postMessage(message, transfer);
    else this.told.push([message, transfer]);
  }

  close() {
    this.closed = true;
    this.worker?.terminate();
  }

  private async start(ways: WayToStart[]) {
    let why = "";
    for (const way of ways) {
      try {
        const worker = await started(way);
        if (this.closed) return worker.terminate();
        this.worker = worker;
        worker.addEventListener("message", ({ data }: MessageEvent<FromWorker>) => this.heard(data));
        worker.addEventListener("error", ({ message }) => this.failed(message || word("error.stopped.about")));
        for (const [message, transfer] of this.told.splice(0)) worker.postMessage(message, transfer);
        return;
      } catch (error) {
        why ||= (error as Error).message;
      }
    }
    this.failed(why);
  }
}

async function started(way: WayToStart): Promise<Worker> {
  const worker = await way();
  return new Promise((done, fail) => {
    worker.addEventListener("message", () => done(worker), { once: true }); // "started"
    worker.addEventListener("error", ({ message }) => {
      worker.terminate();
      fail(new Error(message || word("error.stopped.about")));
    }, { once: true });
  });
}
