// What a cut has changed, for the page: the surface, where the page does not have it yet, and what has been cut so far.
import type { Scene } from "../../module/palpate.js";
import { lengthOf } from "./geometry";
import type { CutFigures, DrawnSurface, Vector } from "./messages";

export class CutWatch {
  made: Int32Array = new Int32Array(0); // [][2]: the new nodes of the surface that the page has, each with the one that it comes from
  private of: Scene | null = null;
  private version = -1;
  private isWhole = true; // the page draws the bundle's own triangles

  // For another bundle, which the page draws whole.
  forget() {
    this.of = null;
    this.made = new Int32Array(0);
    this.isWhole = true;
  }

  // What the page draws from now on. undefined: as before; null: the bundle's own triangles.
  news(organ: Scene): DrawnSurface | null | undefined {
    const state = organ.cutState, version = state?.surface ?? -1;
    if (organ === this.of && version === this.version) return undefined;
    const wasWhole = this.isWhole;
    this.of = organ;
    this.version = version;
    this.isWhole = !state || (state.faces === 0 && state.removed === 0);
    if (this.isWhole) {
      this.made = new Int32Array(0);
      return wasWhole ? undefined : null;
    }
    const { triangles, isLip, nodes } = organ.cutSurface;
    this.made = nodes;
    return { triangles: Uint32Array.from(triangles), isLip, made: nodes };
  }
}

// edges: of the blades that are there. null: nothing can be cut.
export function cutFigures(organ: Scene, edges: Vector[][]): CutFigures | null {
  const state = organ.cutState;
  if (!state) return null;
  const { area, faces, pieces, isFull } = state;
  return { area, faces, pieces, isFull, force: Math.max(0, ...edges.map((_, blade) => lengthOf(organ.blade(blade)!.force))), edges };
}
