// Measures what each effect costs: plays the same press with the effect and without it.
import type { Bundle, RenderMesh } from "../../module/palpate.js";
import type { Cost, PageEffects, ToolShape, Vector } from "./messages";
import { TouchScene } from "./touch_scene";

const ROUNDS = 7;
const TOUCHES = 100;
const SHAPES = 20;
const PRESS_STEP = 1e-5; // m per touch

// For each switch of the page: the effects with this switch off, and on.
const SWITCHES: Record<string, [PageEffects, PageEffects]> = {
  follow: [{ collision: "rest" }, { collision: "deformed" }],
  contact: [{ contact: "point" }, { contact: "patch" }],
  law: [{ law: "sticking" }, { law: "coulomb" }],
  large: [{ deformation: "linear" }, { deformation: "large" }],
  force: [{ force: "linear" }, { force: "response" }],
  radial: [{ radial: "off" }, { radial: "response" }],
  interior: [{ shape: "surface" }, { shape: "volume" }],
  relaxation: [{ relaxation: [] }, {}],
  preload: [{ preload: false }, { preload: true }],
  fine: [{ fine: false }, { fine: true }],
  dent: [{ dent: "off" }, { dent: "discs" }],
};

export function measureCosts(bundle: Bundle, effects: PageEffects, tool: ToolShape, mesh: RenderMesh | null, relaxation: PageEffects["relaxation"],
                             available: (effect: string) => boolean, place: Vector, normal: Vector): Cost[] {
  const names = Object.keys(SWITCHES).filter(available);
  const base: PageEffects = { ...effects, fine: false }; // the finer mesh takes so long that it would hide the others' cost
  const variant = (change: PageEffects): TouchScene | null => {
    try {
      return new TouchScene(bundle, { ...base, ...change }, tool, mesh);
    } catch {
      return null; // the bundle lacks a section that the effect needs
    }
  };
  return names.flatMap((effect) => {
    const [off, on] = SWITCHES[effect], under: PageEffects = effect === "dent" ? { fine: true, contact: "patch" } : {};
    const without = variant({ ...under, ...off });
    // A choice of several values keeps its value; a switch that is off is measured as if it were on.
    const chosen = Object.entries(off).every(([key, value]) => same(base[key as keyof PageEffects], value));
    const withIt = variant({ ...under, ...(chosen ? (effect === "relaxation" ? { relaxation } : on) : {}) });
    const cost = without && withIt ? difference(withIt, without, place, normal) : null;
    without?.destroy();
    withIt?.destroy();
    return cost ? [{ effect, ...cost }] : [];
  });
}

const same = (a: unknown, b: unknown) => JSON.stringify(a) === JSON.stringify(b);

// Each time is that of the fastest round, because an interruption can only make a round slower.
function difference(withIt: TouchScene, without: TouchScene, place: Vector, normal: Vector) {
  const best = { touch: [Infinity, Infinity], shape: [Infinity, Infinity] };
  for (let round = 0; round < ROUNDS; ++round)
    [withIt, without].forEach((scene, i) => {
      best.touch[i] = Math.min(best.touch[i], timePress(scene, place, normal));
      best.shape[i] = Math.min(best.shape[i], time(SHAPES, () => scene.shape()));
    });
  return { touchUs: Math.max(0, best.touch[0] - best.touch[1]), shapeUs: Math.max(0, best.shape[0] - best.shape[1]) };
}

function timePress(scene: TouchScene, place: Vector, normal: Vector): number {
  scene.reset();
  const at = (height: number): Vector => [0, 1, 2].map((d) => place[d] + height * normal[d]) as Vector;
  let height = 2e-4;
  const press = () => scene.touch([{ point: at((height -= PRESS_STEP)), hold: false }, null]);
  for (let step = 0; step < TOUCHES; ++step) press();
  return time(TOUCHES, press);
}

// The time of one call, us.
function time(count: number, call: () => void): number {
  const start = performance.now();
  for (let i = 0; i < count; ++i) call();
  return ((performance.now() - start) * 1000) / count;
}
