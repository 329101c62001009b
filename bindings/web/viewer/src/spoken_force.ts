// Tells screen readers the force and the depth of each tool, politely: at most once a second, and once when the last tool is gone.
import { lengthOf } from "./geometry";
import type { ToolFrame } from "./messages";
import { fixed, word } from "./words";

const EVERY = 1000; // ms

export class SpokenForce {
  private last = -Infinity; // ms

  constructor(private place: HTMLElement) {}

  tell(tools: (ToolFrame | null)[], now = performance.now()) {
    if (now - this.last < EVERY) return;
    const felt = tools.flatMap((tool, t) => (tool ? [word("spoken.force", { tool: t + 1, newtons: fixed(lengthOf(tool.force), 1), mm: fixed(1000 * tool.depth, 0) })] : []));
    const text = felt.join("; ") || (this.place.textContent ? word("spoken.none") : "");
    if (text === this.place.textContent) return;
    this.last = now;
    this.place.textContent = text;
  }
}
