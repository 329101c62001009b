// The live plot of force against depth: one curve for each contact of a tool since the first tool arrived; the axes grow with the
// values.
import { roundUp } from "./colours";
import { TOOL_COUNT, type Sample } from "./messages";
import { TOOL_COLOURS } from "./tool_readout";
import { decimal } from "./words";

const MOST_SAMPLES = 6000;
const MARGIN = { left: 40, right: 10, top: 8, bottom: 30 };

// The samples of one tool. A trace that is full drops every second sample, and from then on takes half as many: a long touch keeps
// its beginning.
class Trace {
  samples: Sample[] = [];
  private every = 1;
  private seen = 0;

  add(sample: Sample) {
    const last = this.samples.at(-1), ends = last && last.contact !== sample.contact;
    if (this.seen++ % this.every && !ends) return;
    this.samples.push(sample);
    if (this.samples.length < MOST_SAMPLES) return;
    this.samples = this.samples.filter((_, i) => i % 2 === 0);
    this.every *= 2;
  }

  clear() {
    this.samples = [];
    this.every = 1;
    this.seen = 0;
  }

  get deepest(): Sample | undefined {
    return this.samples.reduce((best: Sample | undefined, one) => (best && best.depth >= one.depth ? best : one), undefined);
  }

  // The samples of each contact.
  get curves(): Sample[][] {
    const curves: Sample[][] = [];
    for (const sample of this.samples)
      if (curves.at(-1)?.[0].contact === sample.contact) curves.at(-1)!.push(sample);
      else curves.push([sample]);
    return curves;
  }
}

export class ForcePlot {
  readonly traces = Array.from({ length: TOOL_COUNT }, () => new Trace());
  private drawn = "";

  // names: of the curves. named: where on a curve its name stands.
  constructor(private canvas: HTMLCanvasElement, private names = ["1", "2"], private named: "newest" | "deepest" = "newest") {}

  clear() {
    for (const trace of this.traces) trace.clear();
  }

  add(samples: Sample[]) {
    for (const sample of samples) this.traces[sample.tool].add(sample);
  }

  draw() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const style = getComputedStyle(this.canvas), colour = (name: string) => style.getPropertyValue(name);
    const last = this.traces.map(({ samples }) => `${samples.length} ${samples.at(-1)?.depth} ${samples.at(-1)?.force}`);
    const state = [width, height, devicePixelRatio, colour("--ink"), decimal("."), ...last].join();
    if (state === this.drawn || width === 0) return;
    this.drawn = state;
    this.canvas.width = width * devicePixelRatio;
    this.canvas.height = height * devicePixelRatio;
    const context = this.canvas.getContext("2d")!;
    context.scale(devicePixelRatio, devicePixelRatio);
    let deepest = 0.005, most = 0.1; // m, N
    for (const { samples } of this.traces)
      for (const { depth, force } of samples) [deepest, most] = [Math.max(deepest, depth), Math.max(most, force)];
    deepest = roundUp(1000 * deepest), most = roundUp(most);
    const x = (mm: number) => MARGIN.left + (mm / deepest) * (width - MARGIN.left - MARGIN.right);
    const y = (newtons: number) => height - MARGIN.bottom - (newtons / most) * (height - MARGIN.top - MARGIN.bottom);

    context.font = "11px system-ui, sans-serif";
    context.fillStyle = colour("--soft");
    context.strokeStyle = colour("--line");
    context.lineWidth = 1;
    for (const share of [0, 0.5, 1]) {
      line(context, [[x(0), y(share * most)], [x(deepest), y(share * most)]]);
      context.textAlign = "right";
      context.fillText(tidy(share * most), x(0) - 6, y(share * most) + 4);
      context.textAlign = share === 1 ? "right" : "center";
      context.fillText(share === 1 ? `${tidy(deepest)} mm` : tidy(share * deepest), x(share * deepest), height - 13);
    }
    context.textAlign = "left";
    context.fillText("N", x(0) + 5, y(most) + 12);
    context.lineWidth = 2;
    context.lineJoin = "round";
    this.traces.forEach((trace, tool) => {
      const end = this.named === "newest" ? trace.samples.at(-1) : trace.deepest;
      if (!end) return;
      context.strokeStyle = context.fillStyle = colour(TOOL_COLOURS[tool]);
      for (const curve of trace.curves) line(context, curve.map((s) => [x(1000 * s.depth), y(s.force)]));
      context.beginPath();
      context.arc(x(1000 * end.depth), y(end.force), 3.5, 0, 7);
      context.fill();
      context.font = "600 11px system-ui, sans-serif";
      context.textAlign = "right";
      context.fillText(this.names[tool], x(1000 * end.depth) - 6, y(end.force) - 5);
    });
  }
}

const tidy = (value: number) => decimal(Number(value.toPrecision(2)));

function line(context: CanvasRenderingContext2D, points: [number, number][]) {
  context.beginPath();
  for (const [x, y] of points) context.lineTo(x, y);
  context.stroke();
}
