// The force and the depth of each tool: in the headline, and the force beside the tool's arrow. A tool has the same number and
// colour here, in the plot and in three dimensions.
import { lengthOf } from "./geometry";
import type { ToolFrame } from "./messages";
import { fixed } from "./words";

export const TOOL_COLOURS = ["--force", "--second"]; // of the style sheet
const colourOf = (tool: number, colours = TOOL_COLOURS) => colours[tool] ?? "--ink"; // of the third and further tools of a scene

export class ToolReadout {
  private rows: { row: HTMLElement; newtons: HTMLElement; depth: HTMLElement }[];

  constructor(private headline: HTMLElement, private labels: HTMLElement) {
    this.rows = [...headline.children].map(partsOf);
  }

  // The first tool's row stays when there is no tool.
  show(tools: (ToolFrame | null)[]) {
    while (this.rows.length < tools.length) this.add();
    this.rows.forEach(({ row, newtons, depth }, t) => {
      const tool = tools[t];
      row.hidden = !tool && (t > 0 || tools.some(Boolean));
      newtons.textContent = fixed(tool ? lengthOf(tool.force) : 0, 2);
      depth.textContent = fixed(tool ? 1000 * tool.depth : 0, 1);
    });
  }

  // A row for a further tool, like that of the second one.
  private add() {
    const row = this.rows[1].row.cloneNode(true) as HTMLElement;
    row.style.setProperty("--mine", `var(${colourOf(this.rows.length)})`);
    row.querySelector(".number > dd")!.textContent = String(this.rows.length + 1);
    for (const part of row.querySelectorAll("[id]")) part.removeAttribute("id");
    this.headline.append(row);
    this.rows.push(partsOf(row));
  }

  label(tools: (ToolFrame | null)[], places: ([number, number] | null)[]) {
    forceLabels(this.labels, tools, places);
  }
}

// A label beside each arrow. places: in pixels; null: no label. names, colours: of the tools.
export function forceLabels(labels: HTMLElement, tools: (ToolFrame | null)[], places: ([number, number] | null)[], names?: string[], colours = TOOL_COLOURS) {
  for (let t = 0; t < Math.max(TOOL_COLOURS.length, labels.children.length, tools.length); ++t) {
    if (!labels.children[t]) labels.append(document.createElement("span"));
    const label = labels.children[t] as HTMLElement, at = places[t], tool = tools[t];
    label.hidden = !at || !tool;
    if (label.hidden) continue;
    label.style.color = `var(${colourOf(t, colours)})`;
    label.textContent = `${names?.[t] ?? t + 1}: ${fixed(lengthOf(tool!.force), 2)} N`;
    label.style.transform = `translate(${at![0].toFixed(1)}px, ${at![1].toFixed(1)}px) translate(-50%, -110%)`;
  }
}

function partsOf(row: Element) {
  const part = (name: string) => row.querySelector<HTMLElement>(`.${name}`)!;
  return { row: row as HTMLElement, newtons: part("newtons"), depth: part("depth") };
}
