// What holds tissue in a scene, in words.
import type { Hold } from "./messages";
import { fixed, word } from "./words";

const MOST = 4; // told at a time

// playing: s of the scene's tools; null: they do not play.
export function playedWords(playing: number | null, holds: Hold[]): string {
  const told = holds.slice(0, MOST).map(wordsOf), rest = holds.length - told.length;
  return [...(playing === null ? [] : [word("world.playing", { seconds: fixed(playing, 1) })]), ...told, ...(rest ? [word("holds.more", { count: rest })] : [])].join(" · ");
}

function wordsOf(hold: Hold): string {
  const { name } = hold;
  if (hold.kind === "grasp") return word(`holds.grasp.${hold.condition}`, { name });
  if (hold.kind === "link") return word(`holds.link.${hold.condition}`, { name, newtons: fixed(Math.abs(hold.tension), 2) });
  const condition = hold.condition === "none" ? "outside" : hold.condition === "stuck" && hold.isFull ? "full" : hold.condition;
  return word(`holds.needle.${condition}`, { name, depth: fixed(1000 * hold.depth, 1) });
}
