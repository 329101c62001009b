// Measures what each effect costs: plays the same press with the effect and without it. It pauses again and again, so that a touch need not
// wait for the end.
import type { Bundle, RenderMesh } from "../../module/palpate.js";
import type { Cost, PageEffects, ToolShape, Vector } from "./messages";
import { TouchScene } from "./touch_scene";

const ROUNDS = 7;
const LONG_ENOUGH = 2000; // ms: no further round of an effect that has taken so long
const SHAPES = 20;
const PRESS = 1e-3; // m, before the time is taken, and again while it is
const TOUCHES = 100, TOUCHES_OF_LARGE = 20; // of each of the two
const PAUSE_AFTER = 2; // ms: a touch of the user waits for one call more at the most

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

export const COST_NAMES = Object.keys(SWITCHES);

// A step under large deformation solves the whole body, and its scene takes long to make: the page measures it when it is asked to.
export const solvesBody = (effect: string, { deformation }: PageEffects) => effect === "large" || (deformation ?? "linear") !== "linear";

export interface CostsOf {
  bundle: Bundle;
  effects: PageEffects;
  tool: ToolShape;
  mesh: RenderMesh | null;
  relaxation: PageEffects["relaxation"];
  place: Vector;
  normal: Vector;
}

// The cost of one effect; none where the bundle lacks a section that it needs. Each value that it yields is a pause.
export function* measureCost(effect: string, { bundle, effects, tool, mesh, relaxation, place, normal }: CostsOf): Generator<void, Cost | null> {
  const base: PageEffects = { ...effects, fine: false }; // the finer mesh takes so long that it would hide the others' cost
  const variant = (change: PageEffects) => new TouchScene(bundle, { ...base, ...change }, tool, mesh);
  const [off, on] = SWITCHES[effect], under: PageEffects = effect === "dent" ? { fine: true, contact: "patch" } : {};
  // A choice of several values keeps its value; a switch that is off is measured as if it were on.
  const chosen = Object.entries(off).every(([key, value]) => same(base[key as keyof PageEffects], value));
  const touches = solvesBody(effect, effects) ? TOUCHES_OF_LARGE : TOUCHES, scenes: TouchScene[] = [];
  try {
    for (const change of [off, chosen ? (effect === "relaxation" ? { relaxation } : on) : {}]) {
      scenes.push(variant({ ...under, ...change }));
      yield;
    }
    const [without, withIt] = scenes;
    return { effect, ...(yield* difference(withIt, without, touches, place, normal)) };
  } catch {
    return null;
  } finally {
    for (const scene of scenes) scene.destroy();
  }
}

const same = (a: unknown, b: unknown) => JSON.stringify(a) === JSON.stringify(b);

// Each time is that of the fastest round, because an interruption can only make a round slower.
function* difference(withIt: TouchScene, without: TouchScene, touches: number, place: Vector, normal: Vector) {
  const best = { touch: [Infinity, Infinity], shape: [Infinity, Infinity] };
  for (let round = 0, spent = 0; round < ROUNDS && spent < LONG_ENOUGH; ++round)
    for (const [i, scene] of [withIt, without].entries()) {
      const touchUs = yield* timePress(scene, touches, place, normal), shapeUs = yield* time(SHAPES, () => scene.shape());
      best.touch[i] = Math.min(best.touch[i], touchUs);
      best.shape[i] = Math.min(best.shape[i], shapeUs);
      spent += (2 * touches * touchUs + SHAPES * shapeUs) / 1000;
    }
  return { touchUs: Math.max(0, best.touch[0] - best.touch[1]), shapeUs: Math.max(0, best.shape[0] - best.shape[1]) };
}

function* timePress(scene: TouchScene, touches: number, place: Vector, normal: Vector) {
  scene.reset();
  const at = (height: number): Vector => [0, 1, 2].map((d) => place[d] + height * normal[d]) as Vector;
  let height = 2e-4;
  const press = () => scene.touch([{ point: at((height -= PRESS / touches)), hold: false }, null]);
  yield* time(touches, press);
  return yield* time(touches, press);
}

// The time of one call, us.
function* time(count: number, call: () => void): Generator<void, number> {
  let spent = 0;
  for (let made = 0; made < count; ) {
    const start = performance.now();
    let now = start;
    for (; made < count && now - start < PAUSE_AFTER; now = performance.now(), ++made) call();
    spent += now - start;
    yield;
  }
  return (spent * 1000) / count;
}
