// The blades of a scene in the world of its one organ, as palpate-run has them (programs/player/organ_cuts.cpp).
import { Quaternion, Vector3 } from "three";
import type { Blade } from "../../module/palpate.js";
import type { Vector } from "./messages";
import { alongRows } from "./path_files";
import type { TouchWorld } from "./touch_world";
import type { SceneBlade, WorldScene } from "./world_scene";

const NODES_OF_POINT = 12, MOST_BLADES = 4, CUT_POINTS = 12, CUT_LIPS = 64; // of palpate_cut.h; where the file says nothing else
// Contact nodes that blades with a toughness and lips may need.
export const nodesOfCut = (points = CUT_POINTS, lips = CUT_LIPS) => NODES_OF_POINT * MOST_BLADES * points + 2 * lips;

export class SceneBlades {
  private all: PlayedBlade[];

  constructor({ blades }: WorldScene) {
    this.all = blades.map((blade) => new PlayedBlade(blade));
  }

  // Before a touch: where they are at a time, s, no earlier than the one before.
  hold({ world }: TouchWorld, time: number) {
    this.all.forEach((blade, b) => world.organs[0].setBlade(b, blade.at(time)));
  }

  // Of each blade in the last touch, from heel to tip; empty: it was withdrawn.
  get edges(): Vector[][] {
    return this.all.map(({ edge }) => edge);
  }
}

class PlayedBlade {
  edge: Vector[] = [];
  private placeAt: (time: number) => Vector;
  private turnAt: (time: number) => Vector; // degrees

  constructor(private of: SceneBlade) {
    this.placeAt = alongRows(of.path);
    this.turnAt = alongRows(of.turn ?? [[0, 0, 0, 0]]);
  }

  // null: it is withdrawn.
  at(time: number): Blade | null {
    const { cuts, edge, direction, toughness, friction, width, turn: turns } = this.of, place = this.placeAt(time), axis = new Vector3(...this.turnAt(time)), degrees = axis.length();
    this.edge = [];
    if (cuts.length && !cuts.some(([from, until]) => from <= time && time < until)) return null;
    const turn = new Quaternion().setFromAxisAngle(axis.normalize(), (degrees * Math.PI) / 180);
    const turned = (v: Vector) => (turns ? (new Vector3(...v).applyQuaternion(turn).toArray() as Vector) : v);
    this.edge = edge.map((point) => turned(point).map((x, d) => x + place[d]) as Vector);
    return { points: this.edge.flat(), ...(direction ? { direction: turned(direction), toughness, friction, width } : {}) };
  }
}
