// A plugin of Vite: fills a page's elements that name a word with the English one, which they hold until the page's script has run.
import { readFileSync } from "node:fs";
import { marked } from "./viewer/words/marked.js";

export function fillWords(folder) {
  return {
    name: "fill-words",
    transformIndexHtml(html) {
      const words = JSON.parse(readFileSync(`${folder}/words.json`, "utf8"));
      const word = (key) => words[key]?.[0] ?? `no word ${key}`;
      return html.replace(/ data-words="([^"]+)"([^>]*)><\//g, (_, key, rest) => ` data-words="${key}"${rest}>${marked(word(key))}</`)
        .replace(/ data-words-(aria-label)="([^"]+)"/g, (all, name, key) => `${all} ${name}="${marked(word(key))}"`);
    },
  };
}
