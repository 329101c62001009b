// The obstacles of a scene in a world, as palpate-run has them (programs/player/organ_obstacles.cpp).
import { Quaternion, Vector3 } from "three";
import type { Obstacle, Pose } from "../../module/palpate.js";
import type { Vector } from "./messages";
import { alongRows } from "./path_files";
import type { TouchWorld } from "./touch_world";
import type { SceneObstacle, WorldScene } from "./world_scene";

export const OBSTACLE_NODES = 256; // that they may hold, where the file says nothing else

export class SceneObstacles {
  private all: { obstacle: SceneObstacle; at: (time: number) => Pose }[];
  private organs: number[][]; // [organ] the obstacles that hold it off, in the order of the scene

  constructor({ obstacles, organs }: WorldScene) {
    this.all = obstacles.map((obstacle) => ({ obstacle, at: poseOf(obstacle) }));
    this.organs = organs.map((_, k) => obstacles.flatMap((obstacle, i) => (obstacle.organs.includes(k) ? [i] : [])));
  }

  // Of an organ's effects, where they are when the scene begins.
  of(organ: number): Obstacle[] {
    return this.organs[organ].map((i) => {
      const { kind, size, positions, triangles, friction, depth } = this.all[i].obstacle, pose = poseOf(this.all[i].obstacle)(0);
      const shape = kind === "mesh" ? { positions, triangles } : kind === "disc" ? { radius: size[0] } : { size };
      return { kind, ...shape, friction, ...(depth === undefined ? {} : { depth }), position: pose.position, orientation: pose.orientation };
    });
  }

  // Before a touch: where those that move are at a time, s, no earlier than the one before.
  hold({ world }: TouchWorld, time: number) {
    const poses = this.poses(time);
    this.organs.forEach((own, k) => own.forEach((i, index) => {
      const { path, turn } = this.all[i].obstacle;
      if (path.length > 1 || turn.length > 1) world.organs[k].setObstaclePose(index, poses[i]);
    }));
  }

  // Of all obstacles, likewise.
  poses(time: number): Pose[] {
    return this.all.map(({ at }) => at(time));
  }
}

// The obstacle's turn after that of its normal, at times that grow from call to call.
function poseOf({ path, turn, normal }: SceneObstacle): (time: number) => Pose {
  const placeAt = alongRows(path), turnAt = alongRows(turn.length ? turn : [[0, 0, 0, 0]]), toNormal = turnOf(normal);
  return (time) => {
    const axis = new Vector3(...turnAt(time)), degrees = axis.length();
    const { w, x, y, z } = new Quaternion().setFromAxisAngle(degrees > 0 ? axis.normalize() : axis, (degrees * Math.PI) / 180).multiply(toNormal);
    return { position: placeAt(time), orientation: [w, x, y, z] };
  };
}

// The shortest turn that takes z to a direction; half a turn about x where that is -z.
function turnOf(direction: Vector): Quaternion {
  const along = new Vector3(...direction).normalize();
  return along.z <= -1 + 1e-12 ? new Quaternion(1, 0, 0, 0) : new Quaternion().setFromUnitVectors(new Vector3(0, 0, 1), along);
}
