// What holds tissue in a scene, in words.
import type { Hold, TouchFrame } from "./messages";
import { brief, fixed, word } from "./words";

const MOST = 4; // told at a time

export function playedWords({ playing, speed, holds }: Pick<TouchFrame, "playing" | "speed" | "holds">): string {
  const told = holds.slice(0, MOST).map(wordsOf), rest = holds.length - told.length;
  return [...(playing === null ? [] : [word("world.playing", { seconds: fixed(playing, 1) }), ...(Math.abs(speed - 1) > 1e-6 ? [word("world.speed", { times: brief(speed, 3) })] : [])]), ...told, ...(rest ? [word("holds.more", { count: rest })] : [])].join(" · ");
}

function wordsOf(hold: Hold): string {
  const { name } = hold;
  if (hold.kind === "grasp") return word(`holds.grasp.${hold.condition}`, { name });
  if (hold.kind === "link") return word(`holds.link.${hold.condition}`, { name, newtons: fixed(Math.abs(hold.tension), 2) });
  const condition = hold.condition === "none" ? "outside" : hold.condition === "stuck" && hold.isFull ? "full" : hold.condition;
  return word(`holds.needle.${condition}`, { name, depth: fixed(1000 * hold.depth, 1) });
}
