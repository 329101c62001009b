// What the engine's threads of both pages share: the runtime, bundles from addresses, and what a frame tells of the touches before it.
import baselineUrl from "@wasm/baseline/palpate.wasm?url";
import simdUrl from "@wasm/simd/palpate.wasm?url";
import { hasSimd, loadRuntime, PalpateError, type Bundle, type Runtime } from "../../module/palpate.js";
import type { TouchFrame } from "./messages";
import type { TouchLoop } from "./touch_loop";

let runtime: Runtime | null = null;

export async function startRuntime(): Promise<Runtime> {
  return (runtime ??= await loadRuntime(fetch(hasSimd() ? simdUrl : baselineUrl)));
}

// The file did not come, or not as a whole.
export class DownloadError extends Error {}

// null where the address has no file.
export async function answerOf(url: string): Promise<Response | null> {
  const answer = await fetch(url).catch((error: Error) => {
    throw new DownloadError(error.message);
  });
  if (!answer.ok && ![404, 410].includes(answer.status)) throw new DownloadError(`${answer.status} ${answer.statusText}`.trim());
  return answer.ok && answer.body ? answer : null;
}

// progress: of bytes, about a hundred times.
export function openStream(engine: Runtime, { headers, body }: Response, progress: (done: number, total: number) => void): Promise<Bundle> {
  const total = Number(headers.get("content-length") ?? 0);
  let told = 0;
  return engine.openBundleStream(body!, total, (done) => {
    if (done - told >= total / 100 || done >= total) progress((told = done), total);
  }).catch((error) => {
    throw error instanceof PalpateError ? error : new DownloadError((error as Error).message);
  });
}

export class FrameCounts {
  stale = true; // touches have changed the contacts since the last shape
  flags = 0; // since the last frame
  private touches = 0; // since the last frame
  private shapeMs = 0; // time of the newest shape

  addTouch(flags: number) {
    this.flags |= flags;
    ++this.touches;
    this.stale = true;
  }

  // Where the shape is stale. Returns whether it was.
  renewShape(shape: () => number): boolean {
    if (!this.stale) return false;
    const start = performance.now();
    this.flags |= shape();
    this.shapeMs = performance.now() - start;
    this.stale = false;
    return true;
  }

  // What a frame tells, which then begins anew.
  take(touched: { touchMs: number }, loop: TouchLoop): Pick<TouchFrame, "flags" | "lost" | "made" | "touches" | "at" | "touchUs" | "shapeUs"> {
    const { flags, touches, shapeMs } = this, { lost, made } = loop, { touchMs } = touched;
    this.flags = this.touches = loop.lost = loop.made = touched.touchMs = 0;
    return { flags, lost, made, touches, at: performance.now(), touchUs: touches ? (1000 * touchMs) / touches : 0, shapeUs: touches ? 1000 * shapeMs : 0 };
  }
}
