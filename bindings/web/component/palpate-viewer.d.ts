// The types of `palpate/viewer`, which defines the element <palpate-viewer>. README.md of the package lists what it can do.
import type { BundleInfo } from "palpate";

/** A tool as the last step left it. */
export interface ViewerTool {
  /** x y z of the middle of the tool's disc, m, in the bundle's frame. */
  readonly point: [number, number, number];
  /** x y z of the force of the organ on the tool, N. */
  readonly force: [number, number, number];
  /** m, from where the tool met the organ; 0 before that. */
  readonly depth: number;
  /** How many contacts it has. */
  readonly contacts: number;
}

export interface PalpateViewerEventMap extends HTMLElementEventMap {
  /** A bundle is open and drawn. provenance: organ, element, sources (formats/BUNDLE.md). */
  "palpate-open": CustomEvent<{ info: BundleInfo; provenance: Record<string, unknown>; bytes: number }>;
  /** Once per drawn frame while tools are there, and once when the last one has gone. flags: bits STEP_... of `palpate`. */
  "palpate-touch": CustomEvent<{ tools: (ViewerTool | null)[]; flags: number }>;
  /** A bundle or an effect was refused, or the engine could not start; the sentence is shown in the element too. */
  "palpate-error": CustomEvent<{ message: string }>;
}

export interface PalpateViewer {
  /** The bundle's address, absolute. Attribute `bundle`; another one opens another organ. */
  bundle: string;
  /** The address of a finer surface to draw, a PLY file; "": none. Attribute `surface`; read when a bundle opens. */
  surface: string;
  /** Effects, in the words of the viewer's address: "law=coulomb contact=point". Attribute `effects`. */
  effects: string;
  /** Radius of the disc that presses, mm, 2 to 12. Attribute `disc`. */
  disc: number;
  /** What colours the surface: "dent", "displacement" or "nothing". Attribute `colour`. */
  colour: string;
  /** The pointer pulls in place of pushing. Attribute `pull`. */
  pull: boolean;
  /** A released tool stays. Attribute `keep`. */
  keep: boolean;
  /** Null until a bundle is open. */
  readonly info: BundleInfo | null;
  /** Both tools; null: it is not there. */
  readonly tools: (ViewerTool | null)[];
  /** Presses where the view shows the dent from the side, for 2.4 s. Does nothing before a bundle is open. */
  press(): void;
  /** Takes the tools away. */
  reset(): void;
  /** Shows the whole organ from the front. */
  home(): void;
}

export declare class PalpateViewerElement extends HTMLElement {
  addEventListener<K extends keyof PalpateViewerEventMap>(type: K, listener: (event: PalpateViewerEventMap[K]) => void, options?: boolean | AddEventListenerOptions): void;
  addEventListener(type: string, listener: EventListenerOrEventListenerObject, options?: boolean | AddEventListenerOptions): void;
}
export interface PalpateViewerElement extends PalpateViewer {}

declare global {
  interface HTMLElementTagNameMap {
    "palpate-viewer": PalpateViewerElement;
  }
}
