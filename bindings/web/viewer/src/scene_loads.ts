// The loads of a scene in a world, as palpate-run has them (programs/player/organ_loads.cpp).
import type { Effects } from "../../module/palpate.js";
import type { Vector } from "./messages";
import { alongRows } from "./path_files";
import { scenePlaceOn } from "./scene_tool";
import type { TouchWorld, WorldPart } from "./touch_world";
import type { SceneLoad, WorldScene } from "./world_scene";

export class SceneLoads {
  private organs: { own: { load: SceneLoad; at: (time: number) => Vector }[]; patches: NonNullable<Effects["loads"]> }[];

  // Throws an Error where a patch has no place on its organ.
  constructor({ loads, organs }: WorldScene, parts: WorldPart[]) {
    this.organs = parts.map(({ bundle }, k) => {
      const own = loads.filter(({ organ }) => organ === k);
      return { own: own.map((load) => ({ load, at: alongRows(load.rows) })), patches: own.map(({ name, near, at, radius }) => ({ centre: scenePlaceOn(bundle, { near, at }, `[[load]] ${name}`, organs[k].name).point, radius })) };
    });
  }

  // The patches of an organ's effects.
  patches(organ: number): NonNullable<Effects["loads"]> {
    return this.organs[organ].patches;
  }

  // Before a touch: what the patches bear at a time, s, no earlier than the one before.
  hold({ world }: TouchWorld, time: number) {
    this.organs.forEach(({ own }, k) => own.forEach(({ load, at }, i) => world.organs[k].setLoad(i, at(time), load)));
  }
}
