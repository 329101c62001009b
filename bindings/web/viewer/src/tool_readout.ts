// The force and the depth of each tool: in the headline, and the force beside the tool's arrow. A tool has the same number and
// colour here, in the plot and in three dimensions.
import type { ToolFrame, Vector } from "./messages";
import { fixed } from "./words";

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
      newtons.textContent = fixed(tool ? length(tool.force) : 0, 2);
      depth.textContent = fixed(tool ? 1000 * tool.depth : 0, 1);
    });
  }

  label(tools: (ToolFrame | null)[], places: ([number, number] | null)[]) {
    forceLabels(this.labels, tools, places);
  }
}

// A label beside each arrow. places: in pixels; null: no label. names, colours: of the tools.
export function forceLabels(labels: HTMLElement, tools: (ToolFrame | null)[], places: ([number, number] | null)[], names = ["1", "2"], colours = TOOL_COLOURS) {
  for (let t = 0; t < TOOL_COLOURS.length; ++t) {
    if (!labels.children[t]) labels.append(document.createElement("span"));
    const label = labels.children[t] as HTMLElement, at = places[t], tool = tools[t];
    label.hidden = !at || !tool;
    if (label.hidden) continue;
    label.style.color = `var(${colours[t]})`;
    label.textContent = `${names[t]}: ${fixed(length(tool!.force), 2)} N`;
    label.style.transform = `translate(${at![0].toFixed(1)}px, ${at![1].toFixed(1)}px) translate(-50%, -110%)`;
  }
}

const length = (v: Vector) => Math.hypot(...v);
