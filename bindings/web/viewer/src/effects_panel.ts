// The list of effects on the page: for each a switch or a list of values, and its cost.
import { EFFECT_LINES, UNCUT_LINES } from "./effects";
import { element } from "./elements";
import type { Cost, PageEffects } from "./messages";
import { decimal, word, type Key } from "./words";

export class EffectsPanel {
  private effects: PageEffects = {};
  private costs = new Map<string, HTMLElement>();

  // explains: the viewer's, with a sentence below each effect; without, the sentence is the line's title.
  constructor(private list: HTMLElement, private changed: (effects: PageEffects) => void, private explains = false) {}

  open(effects: PageEffects, isAvailable: (effect: string) => boolean) {
    this.effects = { ...effects };
    this.list.replaceChildren(...(this.explains ? EFFECT_LINES : UNCUT_LINES).map((line) => {
      const available = isAvailable(line.effect);
      const row = element("label", { class: "line" }), cost = element("span", { class: "cost" }), sentence = word(`effect.${line.effect}.about`);
      const about = element("p", { class: "about", id: `about-${line.effect}` }, available ? sentence : `${sentence} ${word("effect.absent")}`);
      if (!this.explains) row.title = about.textContent!;
      row.classList.toggle("absent", !available);
      const dim = (value: string | boolean) => row.classList.toggle("off", value === line.cheapest);
      dim(line.value(effects));
      const term = this.explains ? [element("small", {}, word(`effect.${line.effect}.term`))] : [];
      const name = element("span", { class: "name" }, word(`effect.${line.effect}`), " ", ...term);
      const control = line.choices ? choice(line.choices, String(line.value(effects))) : toggle(line.value(effects) === true);
      control.disabled = !available;
      control.dataset.effect = line.effect;
      control.addEventListener("change", () => {
        const value = control instanceof HTMLInputElement ? control.checked : control.value;
        dim(value);
        this.effects = { ...this.effects, ...line.change(value) };
        this.changed(this.effects);
      });
      this.costs.set(line.effect, cost);
      row.append(name, cost, control);
      if (!this.explains) return row;
      control.setAttribute("aria-describedby", about.id);
      return element("div", { class: "control" }, row, about);
    }));
  }

  showCosts(costs: Cost[]) {
    for (const { effect, touchUs, shapeUs } of costs) this.costs.get(effect)!.textContent = `${brief(touchUs)} · ${brief(shapeUs)}`;
  }
}

const brief = (us: number) => (us < 0.05 ? "0" : decimal(us.toFixed(us < 9.95 ? 1 : 0)));

const toggle = (on: boolean) => Object.assign(element("input", { type: "checkbox", role: "switch" }), { checked: on });

function choice(choices: [string, Key][], chosen: string): HTMLSelectElement {
  return element("select", {}, ...choices.map(([value, label]) => new Option(word(label), value, false, value === chosen)));
}
