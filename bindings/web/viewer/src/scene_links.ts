// The links of a scene in a world: those of one organ, and those between organs, as palpate-run holds them (programs/player/held_tissue.cpp,
// organ_links.cpp).
import type { LinkState, WorldLink } from "../../module/links.js";
import { distance } from "./geometry";
import type { DrawnLink, Hold, Vector } from "./messages";
import { valueAt } from "./motion_clocks";
import { placeOn } from "./surface_places";
import { OrganFrame, type TouchWorld, type WorldPart } from "./touch_world";
import type { SceneLink, WorldScene } from "./world_scene";

const NODES_OF_END = 3, NODES_OF_WIDE_END = 8; // as palpate.h states them

// Between two ends of a link.
interface Stretch {
  of: SceneLink;
  share: number; // of the whole link's length at rest
  link: WorldLink;
}

export class SceneLinks {
  private lists: { organ: number | null; stretches: Stretch[]; areGiven: boolean }[]; // organ: whose links they are; null: the world's
  private frames: OrganFrame[];

  // Throws an Error where an end has no place on its organ.
  constructor({ links, organs }: WorldScene, parts: WorldPart[]) {
    this.frames = parts.map(({ pose }) => new OrganFrame(pose));
    const list = (organ: number | null, own: SceneLink[]) => ({
      organ, areGiven: false, stretches: own.flatMap((link) => stretchesOf(link, parts, organs.map(({ name }) => name), this.frames)),
    });
    this.lists = parts.map((_, k) => list(k, links.filter(({ isBetween, organs: of }) => !isBetween && of[0] === k)));
    this.lists.push(list(null, links.filter(({ isBetween }) => isBetween)));
  }

  // Links of an organ, or of the world.
  count(organ: number | null): number {
    return this.lists.find((list) => list.organ === organ)!.stretches.length;
  }

  // Nodes in contact that an organ's links need at most.
  nodes(organ: number): number {
    const ends = this.lists[organ].stretches.flatMap(({ of, link }) => link.ends.map((end) => ("world" in end ? 0 : of.radius ? NODES_OF_WIDE_END : NODES_OF_END)));
    return ends.reduce((sum: number, one) => sum + one, 0);
  }

  // Before a touch: the links as they are at a time, s.
  hold({ world }: TouchWorld, time: number) {
    for (const list of this.lists) {
      if (!list.stretches.length) continue;
      const changes = list.stretches.map((stretch) => takeNumbers(stretch, time)).some(Boolean);
      if (list.areGiven && !changes) continue;
      (list.organ === null ? world : world.organs[list.organ]).setLinks(list.stretches.map(({ link }) => link));
      list.areGiven = true;
    }
  }

  // After a touch.
  drawn(world: TouchWorld): DrawnLink[] {
    return this.states(world).map(([stretch, { condition, ends }, organ]) => ({ kind: stretch.of.kind, condition, ends: ends.map((end) => this.inWorld(end, organ)) as [Vector, Vector] }));
  }

  // Each link once, by the stretch with the largest tension; broken where any stretch is.
  told(world: TouchWorld): Hold[] {
    const all = this.states(world), links = [...new Set(all.map(([{ of }]) => of))];
    return links.map((link) => {
      const states = all.filter(([{ of }]) => of === link).map(([, state]) => state), has = (condition: LinkState["condition"]) => states.some((state) => state.condition === condition);
      const tension = states.reduce((most, state) => (Math.abs(state.tension) > Math.abs(most) ? state.tension : most), 0);
      return { kind: "link", name: link.name, condition: has("broken") ? "broken" : has("taut") ? "taut" : "slack", tension };
    });
  }

  private states({ world }: TouchWorld): [Stretch, LinkState, number | null][] {
    return this.lists.flatMap(({ organ, stretches }) => {
      if (!stretches.length) return [];
      const { links } = organ === null ? world : world.organs[organ];
      return links.map((state, s) => [stretches[s], state, organ] as [Stretch, LinkState, number | null]);
    });
  }

  private inWorld(end: number[], organ: number | null): Vector {
    const point = [...end];
    if (organ !== null) this.frames[organ].toWorld(point);
    return point as Vector;
  }
}

function stretchesOf(link: SceneLink, parts: WorldPart[], names: string[], frames: OrganFrame[]): Stretch[] {
  const ends: WorldLink["ends"] = [], points: number[][] = [];
  link.places.forEach((near, p) => {
    const organ = link.organs[p], { point, triangle, barycentric } = placeOn(parts[organ].bundle, near, `[[link]] ${link.name}`, names[organ], "surface"), at = [...point];
    if (link.isBetween) frames[organ].toWorld(at);
    ends.push({ organ, triangle, barycentric });
    points.push(at);
  });
  if (link.world) (ends.push({ world: link.world }), points.push(link.world));
  const apart = points.slice(1).map((point, i) => distance(point, points[i])), length = apart.reduce((sum, one) => sum + one, 0);
  return apart.map((own, i) => ({
    of: link, share: length > 0 ? own / length : 1 / apart.length,
    link: {
      kind: link.kind, ends: [ends[i], ends[i + 1]], runsOn: i + 1 < apart.length, restLength: link.kind === "clip" ? 0 : own,
      ...(link.radius ? { radius: link.radius } : {}), ...(link.breakingForce ? { breakingForce: link.breakingForce } : {}),
    },
  }));
}

// Returns whether a number has changed.
function takeNumbers({ of, share, link }: Stretch, time: number): boolean {
  const { restLength, stiffness } = link;
  if (of.restLength) link.restLength = share * valueAt(of.restLength, time);
  if (of.stiffness) link.stiffness = valueAt(of.stiffness, time);
  return link.restLength !== restLength || link.stiffness !== stiffness;
}
