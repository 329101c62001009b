// What holds tissue in a scene, in words.
import type { Hold, TouchFrame } from "./messages";
import { brief, fixed, word } from "./words";

const MOST = 4; // told at a time

// share: of that speed which the device reaches.
export function playedWords({ playing, lasts, speed, holds }: Pick<TouchFrame, "playing" | "lasts" | "speed" | "holds">, share: number): string {
  const told = holds.slice(0, MOST).map(wordsOf), rest = holds.length - told.length;
  const time = playing === null ? "" : word("world.playing", { seconds: fixed(playing, 1), all: fixed(lasts, 1) });
  return [time, playing === null ? "" : speedWords(speed, share), ...told, rest ? word("holds.more", { count: rest }) : ""].filter(Boolean).join(" · ");
}

// How fast something plays; empty: as fast as in life.
export function speedWords(speed: number, share: number): string {
  const reached = speed * share;
  if (share < 1 && reached < 1) return word("world.slower", { times: brief(1 / reached) });
  return Math.abs(reached - 1) > 1e-6 ? word("world.speed", { times: brief(reached, 3) }) : "";
}

function wordsOf(hold: Hold): string {
  const { name } = hold;
  if (hold.kind === "grasp") return word(`holds.grasp.${hold.condition}`, { name });
  if (hold.kind === "link") return word(`holds.link.${hold.condition}`, { name, newtons: fixed(Math.abs(hold.tension), 2) });
  const condition = hold.condition === "none" ? "outside" : hold.condition === "stuck" && hold.isFull ? "full" : hold.condition;
  return word(`holds.needle.${condition}`, { name, depth: fixed(1000 * hold.depth, 1) });
}
