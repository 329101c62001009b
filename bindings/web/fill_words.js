// A plugin of Vite that completes the pages: the parts that several pages share, from parts/, and in the elements that name a word the
// English one, which they hold until the page's script has run.
import { readFileSync } from "node:fs";
import { marked } from "./viewer/words/marked.js";

// <!-- part: NAME KEY=VALUE ... -->: the part with each {KEY} replaced by its value.
export const withParts = (/** @type {string} */ html, /** @type {string} */ viewer) =>
  html.replace(/ *<!-- part: (\w+) ?(.*?) -->\n/g, (_, name, values) => {
    const value = Object.fromEntries(values.split(" ").map((/** @type {string} */ pair) => pair.split("=")));
    return readFileSync(`${viewer}/parts/${name}.html`, "utf8").replace(/\{(\w+)\}/g, (_, key) => value[key]);
  });

export function fillWords(/** @type {string} */ viewer) {
  const handler = (/** @type {string} */ html) => {
    const words = JSON.parse(readFileSync(`${viewer}/words/words.json`, "utf8"));
    const word = (/** @type {string} */ key) => marked(words[key]?.[0] ?? `no word ${key}`);
    return withParts(html, viewer).replace(/ data-words="([^"]+)"([^>]*)><\//g, (_, key, rest) => ` data-words="${key}"${rest}>${word(key)}</`)
      .replace(/ data-words-(aria-label)="([^"]+)"/g, (all, name, key) => `${all} ${name}="${word(key)}"`);
  };
  return { name: "fill-words", transformIndexHtml: { order: /** @type {const} */ ("pre"), handler } };
}
