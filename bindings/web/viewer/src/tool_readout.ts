// The force and the depth of each tool: in the headline, and the force beside the tool's arrow. A tool has the same number and
// colour here, in the plot and in three dimensions.
import type { ToolFrame, Vector } from "./messages";

export const TOOL_COLOURS = ["--force", "--second"]; // of the style sheet

export class ToolReadout {
  private rows: { row: HTMLElement; newtons: HTMLElement; depth: HTMLElement }[];

  constructor(headline: HTMLElement, private labels: HTMLElement) {
    const part = (row: Element, name: string) => row.querySelector<HTMLElement>(`.${name}`)!;
    this.rows = [...headline.children].map((row) => ({ row: row as HTMLElement, newtons: part(row, "newtons"), depth: part(row, "depth") }));
  }

  // The first tool's row stays when there is no tool.
  show(tools: (ToolFrame | null)[]) {
    this.rows.forEach(({ row, newtons, depth }, t) => {
      const tool = tools[t];
      row.hidden = !tool && (t > 0 || tools.some(Boolean));
      newtons.textContent = tool ? length(tool.force).toFixed(2) : "0.00";
      depth.textContent = tool ? (1000 * tool.depth).toFixed(1) : "0.0";
    });
  }

  // places: of the labels beside the arrows, in pixels; null: no label.
  label(tools: (ToolFrame | null)[], places: ([number, number] | null)[]) {
    places.forEach((at, t) => {
      if (!this.labels.children[t]) this.labels.append(document.createElement("span"));
      const label = this.labels.children[t] as HTMLElement;
      label.hidden = !at || !tools[t];
      if (label.hidden) return;
      label.style.color = `var(${TOOL_COLOURS[t]})`;
      label.textContent = `${t + 1}: ${length(tools[t]!.force).toFixed(2)} N`;
      label.style.transform = `translate(${at![0].toFixed(1)}px, ${at![1].toFixed(1)}px) translate(-50%, -110%)`;
    });
  }
}

const length = (v: Vector) => Math.hypot(...v);
