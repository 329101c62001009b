// The scalpel of the page: the mode of the pointer, its sliders, and what the page tells of the cut.
import { canBeCut } from "./effects";
import { byId, input, mode } from "./elements";
import type { CutFigures, Edge, PageEffects } from "./messages";
import type { OrganView } from "./organ_view";
import { ScalpelPointer } from "./scalpel_pointer";
import { count, fixed, word } from "./words";

export interface CuttingPage {
  effects: () => PageEffects;
  change: (effects: PageEffects) => void; // of the scene, and of what shows them
  begins: () => void; // a cut
  send: (edge: Edge | null, toughness: number) => void;
}

export class Cutting {
  private pointer: ScalpelPointer;

  constructor(canvas: HTMLCanvasElement, view: OrganView, private page: CuttingPage) {
    this.pointer = new ScalpelPointer(canvas, view, {
      isOn: () => this.isOn, length: () => Number(input("blade-length").value) / 1000, begins: page.begins,
      send: (edge) => page.send(edge, Number(input("toughness").value)),
    });
    for (const choice of document.querySelectorAll('input[name="mode"]')) choice.addEventListener("change", () => this.choose());
    for (const id of ["blade-length", "toughness"]) byId(id).addEventListener("input", () => this.showSliders());
    this.showSliders();
  }

  // The pointer cuts in place of touching.
  get isOn() {
    return mode("scalpel").checked;
  }

  get active() {
    return this.pointer.active;
  }

  // canCut: the open bundle has a region of a cut.
  open(canCut: boolean) {
    byId("scalpel-choice").hidden = byId("scalpel-about").hidden = !canCut;
    this.leave();
  }

  // Where the effects have no cut any more.
  follow() {
    if (!this.page.effects().cut) this.leave();
    this.showSliders();
  }

  // The scalpel needs the effect `cut`, which stays on when another tool is taken, so that the organ stays cut.
  private choose() {
    if (this.isOn && !this.page.effects().cut) this.page.change(canBeCut(this.page.effects()));
    this.showSliders();
  }

  private leave() {
    if (!this.isOn) return;
    mode("push").checked = true;
    mode("push").dispatchEvent(new Event("change"));
  }

  private showSliders() {
    byId("scalpel-control").hidden = byId("toughness-control").hidden = !this.isOn;
    const length = input("blade-length").value, toughness = input("toughness").value;
    byId("blade-mm").textContent = `${length} mm`;
    byId("toughness-told").textContent = `${toughness} J/m²`;
  }

  // Once for each frame of the engine.
  show(cut: CutFigures | null) {
    const told = byId("cut"), text = cut?.faces ? cutWords(cut) : "";
    told.hidden = !text;
    if (told.textContent !== text) told.textContent = text;
  }
}

function cutWords({ area, force, pieces, isFull }: CutFigures): string {
  const parts = [word("cut.area", { area: count(Math.round(1e6 * area)) })];
  if (force > 0) parts.push(word("cut.force", { newtons: fixed(force, 2) }));
  if (pieces > 1) parts.push(word("cut.pieces", { count: pieces }));
  if (isFull) parts.push(word("cut.full"));
  return parts.join(" · ");
}
