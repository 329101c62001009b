// The two layers of the page: Touch shows what a first touch needs, Engineer everything. What belongs to the second layer alone has the
// class "engineer".
import { kept, keep } from "./kept";

const KEPT = "palpate-layer";

// The layer of the address (?layer=engineer), else the one that was chosen here before, else Touch.
export function offerLayers() {
  const choices = [...document.querySelectorAll<HTMLInputElement>('input[name="layer"]')];
  const show = (layer: string) => (document.body.dataset.layer = layer);
  const wanted = new URLSearchParams(location.search).get("layer") ?? kept(KEPT), first = choices.find(({ value }) => value === wanted) ?? choices[0];
  first.checked = true;
  show(first.value);
  for (const choice of choices)
    choice.addEventListener("change", () => {
      show(choice.value);
      keep(KEPT, choice.value);
    });
}
