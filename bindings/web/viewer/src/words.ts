// The words that the pages show, in the page's language; English at the start. words.json has each word in the languages of its first line;
// a word may hold {places} for values, `code` and [keys].
import words from "../words/words.json";
import { keep as keepHere, kept as keptHere } from "./kept";
import { marked } from "../words/marked.js";

export type Key = keyof typeof words;

const LANGUAGES = words["language.code"];
const KEPT = "palpate-language"; // in localStorage
const ATTRIBUTES = ["aria-label"];

let language = LANGUAGES[0];

export function word(key: Key, values: Record<string, string | number> = {}): string {
  return words[key][LANGUAGES.indexOf(language)].replace(/\{(\w+)\}/g, (_, name) => String(values[name]));
}

// The word, where there is one.
export const known = (key: string): string | undefined => (key in words ? word(key as Key) : undefined);
export const count = (value: number) => value.toLocaleString(language);
// A number's digits with the language's decimal mark.
export const decimal = (digits: string | number) => String(digits).replace(".", word("decimal"));
export const brief = (value: number, digits = 2) => decimal(Number(value.toPrecision(digits)));
export const fixed = (value: number, digits: number) => decimal(value.toFixed(digits));
export const threeDigits = (value: number) => fixed(value, value < 99.5 ? 1 : 0);

// The word as an element's content.
export function tell(element: HTMLElement, key: Key, values?: Record<string, string | number>) {
  element.innerHTML = marked(word(key, values));
}

// Fills the elements that name a word: data-words="key" its content, data-words-aria-label="key" the attribute.
export function fill(root: ParentNode) {
  for (const element of root.querySelectorAll<HTMLElement>("[data-words]")) tell(element, element.dataset.words as Key);
  for (const name of ATTRIBUTES)
    for (const element of root.querySelectorAll(`[data-words-${name}]`)) element.setAttribute(name, word(element.getAttribute(`data-words-${name}`) as Key));
}

export const isLanguage = (name: string) => LANGUAGES.includes(name);

// The language of the words from now on. What is shown already keeps its own.
export function useLanguage(name: string) {
  language = name;
}

// The language of the address, else the one that was chosen here before, else the browser's, else English.
export function chosenLanguage(): string {
  const wanted = [new URLSearchParams(location.search).get("language"), kept(), ...navigator.languages.map((name) => name.split("-")[0])];
  return wanted.find((name) => name !== null && isLanguage(name)) ?? "en";
}

export function speak(name: string) {
  useLanguage(name);
  document.documentElement.lang = name;
  fill(document);
}

// Lists of languages in the page. chosen: after the user took another one, which the browser and the address then keep.
export function offerLanguages(chosen: () => void) {
  for (const list of document.querySelectorAll<HTMLSelectElement>("select.language")) {
    list.append(...LANGUAGES.map((lang, l) => Object.assign(new Option(words["language.name"][l], lang), { lang })));
    list.value = language;
    list.addEventListener("change", () => {
      speak(list.value);
      keep(language);
      for (const other of document.querySelectorAll<HTMLSelectElement>("select.language")) other.value = language;
      chosen();
    });
  }
}

// Names the language in the address where the user chose it; other steps of the browser's history may name another one.
export function keepInAddress() {
  const address = new URL(location.href);
  if (kept() !== language || address.searchParams.get("language") === language) return;
  address.searchParams.set("language", language);
  history.replaceState(history.state, "", address);
}

const kept = () => keptHere(KEPT);

// In the address too.
function keep(name: string) {
  keepHere(KEPT, name);
  const address = new URL(location.href);
  address.searchParams.set("language", name);
  history.replaceState(history.state, "", address);
}
