// How much the page draws: all of it on a graphics card, less where a processor draws the picture or where frames come slowly.
export type Quality = "high" | "low";

const SLOW = 45; // ms between two frames, the median, from which the page draws less
const FRAMES = 40; // between which that is measured

// `?quality=high` and `?quality=low` in the address decide; else the renderer's name does, as a context tells it that is made for this alone:
// whether edges are smoothed is decided when the one that draws is made.
export function chosenQuality(document: Document): Quality {
  const wanted = new URLSearchParams(location.search).get("quality");
  if (wanted === "high" || wanted === "low") return wanted;
  const context = document.createElement("canvas").getContext("webgl2"), quality = context && isSoftware(context) ? "low" : "high";
  context?.getExtension("WEBGL_lose_context")?.loseContext();
  return quality;
}

export const isChosen = () => new URLSearchParams(location.search).has("quality");

function isSoftware(context: WebGLRenderingContext | WebGL2RenderingContext): boolean {
  const info = context.getExtension("WEBGL_debug_renderer_info");
  const name = String(context.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : context.RENDERER));
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}

// Tells once when frames come slowly, of those that are drawn one after the other.
export class SlowFrames {
  private times: number[] = [];
  private last = 0;

  // The page draws nothing new for now.
  pause() {
    this.last = -Infinity;
  }

  add(now: number): boolean {
    const passed = now - this.last;
    this.last = now;
    if (passed < 1000) this.times.push(passed); // a hidden page draws none
    if (this.times.length < FRAMES) return false;
    const median = this.times.sort((a, b) => a - b)[FRAMES / 2];
    this.times = [];
    return median > SLOW;
  }
}
