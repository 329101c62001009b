// Plays a path in a scene of its own, as fast as the device can: what Compare sets side by side.
import { Spread } from "./clocks";
import { lengthOf } from "./geometry";
import { HeldTools } from "./held_tools";
import { TOUCHES_TIMED, TOUCH_HZ, type Path, type Sample, type Times, type ToolFrame } from "./messages";
import { farthestStep } from "./path_files";
import { recordedTool } from "./recorder";
import type { TouchScene } from "./touch_scene";

const SAMPLE_EVERY = 4; // touches per point of a curve
const SHAPE_EVERY = Math.round(TOUCH_HZ / 60);

// shapeAt: called with the shape of the path's farthest step.
export function playTrial(scene: TouchScene, path: Path, tools: number, shapeAt: () => void) {
  const chosen = farthestStep(path), forces = new Float64Array(3 * tools * path.steps), samples: Sample[] = [], held = new HeldTools();
  const touchUs = new Spread(Infinity), shapeUs = new Spread(Infinity);
  const contacts: number[] = []; // of each tool the newest one: samples of two contacts belong to two curves
  let begun = 0, shown: (ToolFrame | null)[] = [], flags = 0;
  scene.touchMs = 0;
  for (let step = 0; step < path.steps; ++step) {
    const present = Array.from({ length: tools }, (_, tool) => recordedTool(path, step, tool));
    flags |= scene.touch(present);
    const felt = present.map((tool, t): ToolFrame | null => {
      if (held.meet(t, tool, scene.contacts(t))) contacts[t] = ++begun;
      return tool && { point: tool.point, force: scene.force(t), contacts: scene.contacts(t), depth: held.depth(t, tool.point), normal: null };
    });
    felt.forEach((tool, t) => {
      const force = tool?.force ?? scene.force(t);
      forces.set(force, 3 * (tools * step + t));
      if (tool && held.isIn(t) && step % SAMPLE_EVERY === 0) samples.push({ tool: t, contact: contacts[t], depth: tool.depth, force: lengthOf(force) });
    });
    if ((step + 1) % TOUCHES_TIMED === 0) touchUs.add((1000 * scene.touchMs) / TOUCHES_TIMED), (scene.touchMs = 0);
    if (step % SHAPE_EVERY === 0 || step === chosen) {
      const start = performance.now();
      flags |= scene.shape();
      shapeUs.add(1000 * (performance.now() - start));
    }
    if (step === chosen) shapeAt(), (shown = felt.map((tool, t) => tool && { ...tool, normal: scene.discNormal(t) }));
  }
  return { forces, samples, tools: shown, touchUs: plain(touchUs), shapeUs: plain(shapeUs), flags };
}

const plain = ({ median, low, high }: Times): Times => ({ median, low, high });
