// Plays a path in a scene of its own, as fast as the device can: what Compare sets side by side.
import { Spread } from "./clocks";
import { TOUCHES_TIMED, TOUCH_HZ, type Path, type Sample, type Times, type ToolFrame, type Vector } from "./messages";
import { farthestStep } from "./path_files";
import { recordedTool, type RecordedTool } from "./recorder";
import type { TouchScene } from "./touch_scene";

const SAMPLE_EVERY = 4; // touches per point of a curve
const SHAPE_EVERY = Math.round(TOUCH_HZ / 60);

// Each tool's depth from where it met the organ; counts contacts, so that two of them are two curves.
class Contacts {
  private met: (Vector | null)[] = [];
  private contact: number[] = [];
  private begun = 0;

  // 0 without contact.
  depth(index: number, tool: RecordedTool, contacts: number): number {
    if (!tool || contacts === 0) return (this.met[index] = null), 0;
    if (!this.met[index]) [this.met[index], this.contact[index]] = [tool.point, ++this.begun];
    return Math.hypot(...tool.point.map((x, d) => x - this.met[index]![d]));
  }
  of(index: number): number | null {
    return this.met[index] ? this.contact[index] : null;
  }
}

// shapeAt: called with the shape of the path's farthest step.
export function playTrial(scene: TouchScene, path: Path, tools: number, shapeAt: () => void) {
  const chosen = farthestStep(path), forces = new Float64Array(3 * tools * path.steps), samples: Sample[] = [], contacts = new Contacts();
  const touchUs = new Spread(Infinity), shapeUs = new Spread(Infinity);
  let shown: (ToolFrame | null)[] = [], flags = 0;
  scene.touchMs = 0;
  for (let step = 0; step < path.steps; ++step) {
    const present = Array.from({ length: tools }, (_, tool) => recordedTool(path, step, tool));
    flags |= scene.touch(present);
    const felt = present.map((tool, t): ToolFrame | null => {
      const depth = contacts.depth(t, tool, scene.contacts(t));
      return tool && { point: tool.point, force: scene.force(t), contacts: scene.contacts(t), depth, normal: null };
    });
    felt.forEach((tool, t) => {
      const force = tool?.force ?? scene.force(t), contact = contacts.of(t);
      forces.set(force, 3 * (tools * step + t));
      if (tool && contact !== null && step % SAMPLE_EVERY === 0) samples.push({ tool: t, contact, depth: tool.depth, force: Math.hypot(...force) });
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
