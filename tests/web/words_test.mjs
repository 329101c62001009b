// node words_test.mjs VIEWER_FOLDER: the words of the viewer's pages and of <palpate-viewer>. A word has the same places for values in each
// language; the pages and their source hold no other text that a user sees; each control of the viewer has its sentence.
import assert from "node:assert/strict";
import { existsSync, readFileSync } from "node:fs";
import { dirname, resolve } from "node:path";
import { test } from "node:test";

const viewer = process.argv[2];
const { withParts } = await import(`${resolve(viewer)}/../fill_words.js`);
const words = JSON.parse(readFileSync(`${viewer}/words/words.json`, "utf8"));
const pages = Object.fromEntries(["index", "world", "compare", "gallery"].map((page) => [page, withParts(readFileSync(`${viewer}/${page}.html`, "utf8"), viewer)]));
const html = pages.index;
const SAME_EVERYWHERE = /^(Palpate|[AB]|p1|p1-anp|p2-p0|\d*(\.\d+)?|–|\d* ?(N|mm|µs|ms|Hz))$/;

// The pages' and the element's own source, and the worker's that says sentences: their first files and what these import, without comments.
const FIRST = [...["main", "world", "world.worker", "compare", "gallery"].map((name) => `${viewer}/src/${name}.ts`), `${viewer}/../component/element.ts`];
function sources(files = FIRST, found = new Map()) {
  for (const file of files.map((name) => resolve(name))) {
    if (found.has(file) || !existsSync(file)) continue;
    const text = readFileSync(file, "utf8").replace(/\/\*[^]*?\*\//g, "").replace(/(^|\s)\/\/.*$/gm, "$1");
    found.set(file, text);
    sources([...text.matchAll(/^import (?!type ).* from "(\.[\w./]+)"/gm)].map(([, other]) => `${dirname(file)}/${other}.ts`), found);
  }
  return found;
}

// Literals of a text. A value in a template becomes {}.
const literals = (text) => [...text.matchAll(/"((?:[^"\\\n]|\\.)*)"|`((?:[^`\\]|\\.)*)`/g)].map((m) => m[1] ?? withoutValues(m[2]));
function withoutValues(template) {
  let text = "", depth = 0;
  for (const piece of template.split(/(\$?\{|\})/)) {
    if (piece.endsWith("{") && depth++ === 0) text += "{}";
    else if (piece === "}") --depth;
    else if (depth === 0) text += piece;
  }
  return text;
}

// Two words in a row are a sentence for users, apart from shaders, fonts and CSS; and so is a word that is given to the user directly.
const NOT_SHOWN = /#include|vec4|\bvarying float |system-ui|linear-gradient|^[\w-]+ [#.\[]|^translate|\[data-|^\(prefers-|^make -f |^<canvas /;
const sentences = (text) => literals(text).filter((one) => /\p{L}{2,}[,;:]? \p{L}{2,}/u.test(one) && !NOT_SHOWN.test(one));
const GIVEN = /(?:\.(?:textContent|innerText|title|ariaLabel) = |tellUser\(|new Option\(|Error\(|"aria-label", |fillText\()(["`][^"`]*["`])/g;
const given = (text) => [...text.matchAll(GIVEN)].map(([, one]) => one.slice(1, -1).replace(/\$\{.*?\}+/g, "")).filter((one) => /\p{L}{2,}/u.test(one.replace(/Palpate|\bmm\b/g, "")));

test("each word is there in each language, with the same places for values", () => {
  const count = words["language.code"].length, places = (word) => [...word.matchAll(/\{\w+\}/g)].map(([place]) => place).sort();
  assert.ok(count >= 2);
  for (const [key, all] of Object.entries(words)) {
    assert.equal(all.filter((word) => word.trim()).length, count, key);
    for (const word of all) assert.deepEqual(places(word), places(all[0]), key);
  }
});

// What is the same word in both languages.
const OF_BOTH = ["page.details", "tool.more", "show.field.von-mises", "world.organs.name"];
test("each word has a German form of its own, each reason for which the runtime refuses too", () => {
  const same = Object.keys(words).filter((key) => words[key][0] === words[key][1] && /\p{L}{4,}/u.test(words[key][0].replace(/\{\w+\}|`[^`]*`/g, "")));
  assert.deepEqual(same.filter((key) => !OF_BOTH.includes(key)), [], "English in the place of German");
  const reasons = /STATUS = \[([^\]]*)\]/.exec(readFileSync(`${viewer}/../module/heap.js`, "utf8"))[1].match(/\w+/g).filter((one) => one !== "ok");
  assert.ok(reasons.length >= 10);
  for (const reason of reasons) assert.match(words[`runtime.${reason}`]?.[1] ?? "", /\p{L}{4,}[^{]*Auf Englisch: \{text\}$/u, reason);
  const messages = Object.keys(words).filter((key) => /^(error|unable|notice|element|path|fine|scene|world|runtime|flag|devices\.link)\./.test(key));
  assert.ok(messages.length > 100, `${messages.length} messages`);
  console.log(`${messages.length} messages of ${Object.keys(words).length} words, each in English and German`);
});

test("the pages' HTML shows words alone", () => {
  for (const [name, page] of Object.entries(pages)) {
    const texts = page.split(/<[^>]*>/).map((text) => text.trim()).filter((text) => !SAME_EVERYWHERE.test(text));
    assert.deepEqual(texts, [], name);
    assert.deepEqual([...page.matchAll(/ (?:title|aria-label||alt)="[^"]*"/g)].map(([attribute]) => attribute), [], name);
  }
});

test("the pages' source shows words alone", () => {
  const found = sources();
  assert.ok(found.size > 30, "the pages' files are found");
  for (const [name, text] of found) assert.deepEqual([...sentences(text), ...given(text)], [], name);
});

test("the search for text in the source finds some", () => {
  assert.deepEqual(sentences('say("a whole sentence"); say(`${n} of them are here`); use("key")'), ["a whole sentence", "{} of them are here"]);
  assert.deepEqual(given('a.textContent = "Dent"; b.title = `${x} newtons`; throw new Error("wrong")'), ["Dent", " newtons", "wrong"]);
});

test("the pages' words exist, and each word is used", () => {
  const source = [...sources().values()].join("\n");
  const named = [...Object.values(pages).join("").matchAll(/ data-words(?:-[\w-]+)?="([^"]*)"/g)].map(([, key]) => key);
  for (const key of [...named, ...[...source.matchAll(/\bword\("([^"]*)"/g)].map(([, key]) => key)]) assert.ok(key in words, `no word ${key}`);
  const used = new Set([...named, ...literals(source)]), begun = literals(source).filter((one) => /^[a-z]+\..*\{\}/.test(one)).map((one) => one.split("{}")[0]);
  assert.deepEqual(Object.keys(words).filter((key) => !used.has(key) && !begun.some((start) => key.startsWith(start))), []);
});

test("each effect has a name, a term and a sentence; each control of the page has its sentence", () => {
  const effects = [...readFileSync(`${viewer}/src/effects.ts`, "utf8").matchAll(/^(?: {4}effect: | {2}switched\()"(\w+)"/gm)].map(([, effect]) => effect);
  assert.ok(effects.length >= 10);
  for (const effect of effects) for (const part of ["", ".term", ".about"]) assert.ok(`effect.${effect}${part}` in words, `effect.${effect}${part}`);
  const controls = html.match(/<aside[^]*<\/aside>/)[0].split(/<div class="control">|(?=<div(?: class="engineer")?><(?:a|button))/).filter((part) => /<(input|select|button|a) /.test(part));
  assert.ok(controls.length >= 12);
  for (const control of controls) assert.match(control, /class="about" data-words=/);
  for (const [, name] of html.match(/<div id="corner">[^]*<\/section>/)[0].matchAll(/data-words="tool\.(\w+)"><\/(?:span|button)>/g))
    if (name !== "more") assert.match(html, new RegExp(`<dd data-words="tool.${name}.about">`));
});
