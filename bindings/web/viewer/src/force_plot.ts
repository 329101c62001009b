// The live plot of force against depth: one curve per tool for the present touch; the axes grow with the values.
import { roundUp } from "./colours";
import { TOOL_COUNT, type Sample } from "./messages";

const MOST_SAMPLES = 6000;
const MARGIN = { left: 40, right: 10, top: 8, bottom: 30 };

export class ForcePlot {
  private traces: Sample[][] = Array.from({ length: TOOL_COUNT }, () => []);
  private drawn = "";

  constructor(private canvas: HTMLCanvasElement) {}

  clear() {
    for (const trace of this.traces) trace.length = 0;
  }

  add(samples: Sample[]) {
    for (const sample of samples) {
      const trace = this.traces[sample.tool];
      trace.push(sample);
      if (trace.length > MOST_SAMPLES) trace.splice(0, trace.length - MOST_SAMPLES);
    }
  }

  draw() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const style = getComputedStyle(this.canvas), colour = (name: string) => style.getPropertyValue(name);
    const state = [width, height, devicePixelRatio, colour("--ink"), ...this.traces.map((t) => `${t.length} ${t.at(-1)?.depth} ${t.at(-1)?.force}`)].join();
    if (state === this.drawn || width === 0) return;
    this.drawn = state;
    this.canvas.width = width * devicePixelRatio;
    this.canvas.height = height * devicePixelRatio;
    const context = this.canvas.getContext("2d")!;
    context.scale(devicePixelRatio, devicePixelRatio);
    const all = this.traces.flat();
    const deepest = roundUp(Math.max(5, ...all.map((s) => 1000 * s.depth))), most = roundUp(Math.max(0.1, ...all.map((s) => s.force)));
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
    ["--force", "--second"].forEach((name, tool) => {
      const trace = this.traces[tool], last = trace.at(-1);
      if (!last) return;
      context.strokeStyle = context.fillStyle = colour(name);
      line(context, trace.map((s) => [x(1000 * s.depth), y(s.force)]));
      context.beginPath();
      context.arc(x(1000 * last.depth), y(last.force), 3.5, 0, 7);
      context.fill();
    });
  }
}

const tidy = (value: number) => String(Number(value.toPrecision(2)));

function line(context: CanvasRenderingContext2D, points: [number, number][]) {
  context.beginPath();
  for (const [x, y] of points) context.lineTo(x, y);
  context.stroke();
}
