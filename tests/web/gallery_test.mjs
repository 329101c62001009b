// node gallery_test.mjs PACKAGE_FOLDER PALPATE_RUN BUNDLE FOLDER [RENDER_MESH] (page.mjs): the gallery of a data folder that this test
// makes, and the task of the hidden nodule. WRITE_TINY_BUNDLE: the program that writes the bundle with the nodule.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { cpSync, mkdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { get } from "node:http";
import { test } from "node:test";
import { looksRight, violations } from "./axe.mjs";
import { bundle, closed, drag, folder, inState, notice, noTools, open, packageFolder, pressedTo, ready, renderMesh } from "./page.mjs";

const data = `${folder}/data`, PICTURE = "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg==";
rmSync(data, { recursive: true, force: true });
for (const of of ["plate/5 mm/corners/pictures", "liver-tumour/1700/face", "liver-tumour/1700/face-healthy"]) mkdirSync(`${data}/${of}`, { recursive: true });
cpSync(bundle, `${data}/plate/5 mm/corners/bundle.h5`);
writeFileSync(`${data}/plate/5 mm/corners/pictures/boundary.png`, Buffer.from(PICTURE, "base64"));
if (renderMesh) cpSync(renderMesh, `${data}/plate/render.ply`);
execFileSync(process.env.WRITE_TINY_BUNDLE, [`${data}/liver-tumour/1700/face-healthy/bundle.h5`, "healthy"]);
cpSync(bundle, `${data}/bundle.h5`); // of no case
writeFileSync(`${data}/notes.txt`, "not for the page");
// A point and the links of a report as studies/accuracy/report.py writes them.
const study = `${data}/plate/accuracy/corners`, point = '<g data-opens="bundles/there.h5#contact=node&amp;disc=10"><circle r="40"/></g>';
mkdirSync(`${study}/bundles`, { recursive: true });
cpSync(bundle, `${study}/bundles/there.h5`);
const links = execFileSync("/usr/bin/python3", ["-c", "import report; print(report.LINKS)"], { cwd: `${packageFolder}/../../studies/accuracy` });
writeFileSync(`${study}/report.html`, `<!DOCTYPE html><svg viewBox="-50 -50 100 100" height="100">${point}</svg>${links}`);
execFileSync(process.env.WRITE_TINY_BUNDLE, [`${data}/liver-tumour/1700/face/bundle.h5`, "nodule"]);

const gallery = async (options = {}, folderOfData = data, language = "en") => {
  process.env.PALPATE_DATA = folderOfData;
  const page = await open(options, undefined, `gallery.html?language=${language}`);
  await inState(page, "ready");
  return page;
};

test("the gallery lists each bundle with organ, boundary set, size and picture; a card opens it with its finer surface", async () => {
  const page = await gallery();
  const cards = await page.$$eval("#organs li", (items) => items.map((item) => ({
    words: [item.querySelector("h2"), ...item.querySelectorAll("dd")].map((one) => one.textContent), picture: item.querySelector("img")?.complete && item.querySelector("img").naturalWidth,
  })));
  assert.deepEqual(cards.map(({ words }) => words.slice(0, 3).join(" ")), ["liver with tumours face 1700", "liver with tumours face-healthy 1700", "plate corners 5 mm"]);
  for (const { words } of cards) assert.match(words[3], /^\d+\.\d MB$/);
  await page.waitForFunction(() => document.querySelector("#organs img").naturalWidth === 1);
  assert.equal(await page.locator("#organs img").count(), 1);
  assert.match(await page.textContent("#organs li:first-child .picture"), /make -f Makefile\.data gallery/);
  await page.click("#organs li:last-child a");
  await inState(page, "ready");
  assert.match(await page.textContent("#facts"), /64 mesh points/);
  assert.equal(/drawn: /.test(await page.textContent("#facts")), !!renderMesh);
  assert.equal(await page.isVisible("#find-nodule"), false, "a body of one material has no nodule");
  await page.click("#compare");
  await page.waitForFunction(() => globalThis.palpateCompare?.areOpen);
  assert.match(await page.getAttribute("#viewer", "href"), /plate/, "Compare opens the same bundle and leads back to it");
  await closed(page);
});

test("a report of accuracy is listed, and a point of it opens its bundle with its contact and the study's disc", async () => {
  const page = await gallery();
  await page.click("#studies a");
  await page.click("circle");
  await page.waitForURL(/index\.html/);
  await inState(page, "ready");
  assert.match(await page.textContent("#facts"), /64 mesh points/);
  assert.equal(/drawn: /.test(await page.textContent("#facts")), !!renderMesh);
  assert.equal(await page.inputValue('[data-effect="contact"]'), "node");
  assert.equal(await page.textContent("#radius-mm"), "10 mm");
  await closed(page);
});

test("without organs the gallery says what makes one; an address of a missing bundle is named", async () => {
  const page = await gallery({}, `${folder}/none`);
  assert.match(await page.textContent("#none"), /make -f Makefile\.data/);
  assert.equal(await page.isVisible("#none"), true);
  assert.match(await page.textContent("#task-start"), /ORGAN=liver-tumour/);
  await page.goto(page.url().replace(/gallery\.html.*/, "index.html?bundle=data%2Fplate%2Fbundle.h5"));
  await inState(page, "empty");
  await notice(page, "data/plate/bundle.h5: the server has no such bundle");
  await closed(page);
});

test("the server gives bundles, surfaces and pictures of the data folder, and no other file", async () => {
  const page = await gallery(), { host } = new URL(page.url());
  // By http itself: browsers resolve the dots of an address before they ask.
  const status = (path) => new Promise((done) => get(`http://${host}`, { path }, (answer) => done((answer.resume(), answer.statusCode))));
  assert.equal(await status("/data/liver-tumour/1700/face/bundle.h5"), 200);
  assert.equal(await status("/data/plate/5%20mm/corners/pictures/boundary.png?x"), 200);
  for (const path of ["/data/notes.txt", "/data/%2e%2e/box.h5", "/data/..%2fbox.h5", "/data/plate", "/data/%ff.h5", "/data/none/bundle.h5"])
    assert.equal(await status(path), 404, path);
  await closed(page);
});

const score = (text) => Number(/^([\d.]+) mm from the point above the nodule/.exec(text)?.[1]);
const answer = (page) => page.textContent("#task p");

// The nodule is a box of 36 x 36 x 24 mm; its middle lies 24 mm under the middle of the face z = 60 mm. Nodes are shifted by up to 1.2 mm.
test("the task scores the place of the last press in millimetres, reveals the nodule, and begins again", async () => {
  const page = await gallery();
  await page.click("#task-start a");
  await inState(page, "ready");
  assert.match(await answer(page), /^Find the hidden nodule: a stiff nodule lies inside/);
  assert.equal(await page.isDisabled('[data-do="here"]'), true);
  await drag(page, [0, 0], [60, -40]);
  await drag(page, [40, 20], [90, -20]);
  assert.match(await answer(page), /^2 presses\. /);
  await page.waitForFunction(() => document.querySelectorAll("#presses span:not([hidden])").length === 2);
  const map = await page.evaluate(() => [...document.querySelectorAll("#presses span")].map((figure, p) => [figure.textContent, globalThis.palpateViewer.task.presses[p].found.here]));
  for (const [figure, stiffness] of map) assert.ok(stiffness > 0 && figure === stiffness.toFixed(3), `${figure}: ${stiffness} N/mm`);
  const place = await page.evaluate(() => globalThis.palpateViewer.pressed.place);
  await page.click('[data-do="here"]');
  const told = await answer(page), expected = 1000 * Math.hypot(place[0] - 0.03, place[1] - 0.03, place[2] - 0.06);
  assert.ok(Math.abs(score(told) - expected) < 1.7, `${told}; expected about ${expected}`);
  const [, presses, wide, deep, times] = /, with (\d+) presses in \d+ seconds?\. The nodule \(\w+\) is (\d+) mm wide, lies (\d+) mm deep and is ([\d.]+) times as stiff as the tissue around it\./.exec(told).map(Number);
  assert.ok(times > 1.5, told);
  assert.ok(Math.abs(wide - 2 * Math.cbrt((3 * 36 * 36 * 24) / (4 * Math.PI))) < 1.5, told);
  assert.ok(Math.abs(deep - (24 - wide / 2)) < 1.7, told);
  assert.equal(presses, 2);
  await noTools(page);
  const revealed = () => page.evaluate(() => globalThis.palpateViewer.view.noduleMarks.group.children.length);
  assert.equal(await revealed(), 6, "two presses, the nodule, both places and the line between them");
  const [card] = await Promise.all([page.waitForEvent("download"), page.click('[data-do="card"]')]), png = readFileSync(await card.path());
  assert.equal(card.suggestedFilename(), "nodule.png");
  assert.deepEqual([png.toString("latin1", 1, 4), png.readUInt32BE(16), png.readUInt32BE(20)], ["PNG", 1200, 630]);
  await page.click('[data-do="again"]');
  assert.equal(await revealed(), 0);
  assert.match(await answer(page), /^Find the hidden nodule/);
  await page.click('[data-do="stop"]');
  assert.equal(await page.isVisible("#task"), false);
  await page.click("#find-nodule");
  assert.equal(await page.isVisible("#task"), true);
  await page.focus("#organ");
  await page.keyboard.press("Shift+ArrowUp");
  await page.keyboard.press("Space", { delay: 300 });
  await page.waitForFunction(() => /^1 press\. /.test(document.querySelector("#task p").textContent), undefined);
  await closed(page);
});

test("the task's advice is true: beside the healthy organ a press takes more force over the nodule, and most where it is nearest", async () => {
  const page = await gallery();
  await page.click("#task-start a");
  await inState(page, "ready");
  await page.waitForFunction(() => /more force than in a healthy organ/.test(document.querySelector("#task p").textContent));
  // Over the face z = 60 mm, from its middle outwards; the nodule is 36 mm wide.
  const times = await page.evaluate(async () => {
    const viewer = globalThis.palpateViewer, found = [];
    for (const x of [0.03, 0.02, 0.01, 0.005]) found.push(await viewer.stiffnessAt({ place: [x, 0.03, 0.06], normal: [0, 0, 1] }));
    return found.map(({ here, healthy }) => here / healthy);
  });
  assert.ok(times.every((one, i) => one > 1 && (i === 0 || one < times[i - 1])), times.join(", "));
  assert.ok(times[0] > 1.1, `${times[0]} times`);
  await drag(page, [0, 0], [60, -40]);
  await page.waitForFunction(() => /^1 press\. There the organ has \d\.\d{3} N\/mm, a healthy one \d\.\d{3} N\/mm: \d\.\d\d times\. Is the place/.test(document.querySelector("#task p").textContent));
  await closed(page);
});

test("each press of the task goes to one depth, however far one drags; after it the pointer decides again", async () => {
  const page = await gallery();
  await page.click("#task-start a");
  await inState(page, "ready");
  for (const far of [20, 160]) {
    await drag(page, [0, 0], [far, 0], { release: false });
    await pressedTo(page, 6);
    await page.mouse.up();
    await noTools(page);
  }
  await page.click('[data-do="stop"]');
  await drag(page, [0, 0], [160, 0], { release: false });
  await page.waitForFunction(() => globalThis.palpateViewer.shown.tools[0].depth > 0.0065);
  await page.mouse.up();
  await closed(page);
});

test("the difficulty of a nodule falls with its depth and rises with its size and stiffness; where there are two, one may be chosen", async () => {
  const page = await gallery();
  await page.click("#task-start a");
  await inState(page, "ready");
  const [one] = await page.evaluate(() => globalThis.palpateViewer.task.nodules);
  const levels = await page.evaluate((nodule) => {
    const { task } = globalThis.palpateViewer, near = { ...nodule, centre: [0, 0, 0], above: [0, 0, 0.02], radius: 0.015, stiffer: 6 };
    const all = [near, { ...near, above: [0, 0, 0.03] }, { ...near, radius: 0.008 }, { ...near, stiffer: 1.5 }, { ...near, above: [0, 0, 0.06] }];
    task.open(all);
    task.start();
    return [...task.target.options].map((option) => option.text);
  }, one);
  assert.deepEqual(levels, ["any nodule", "easy: 5 mm deep, 6 times as stiff", "medium: 15 mm deep, 6 times as stiff", "hard: 12 mm deep, 6 times as stiff", "medium: 5 mm deep, 1.5 times as stiff", "hard: 45 mm deep, 6 times as stiff"]);
  await page.selectOption("#task select", "3");
  await drag(page, [0, 0], [30, 0]);
  assert.equal(await page.isDisabled("#task select"), true, "chosen before the first press");
  await page.click('[data-do="here"]');
  assert.match(await answer(page), /The nodule \(medium\) .* 1\.5 times as stiff/);
  await closed(page);
});

test("a guided case plays its scene, marks its sentences, and tells the largest force", async () => {
  const cases = `${folder}/cases`;
  rmSync(cases, { recursive: true, force: true });
  cpSync(bundle, `${cases}/liver/1700/abdomen/bundle.h5`);
  const page = await gallery({}, cases);
  assert.match(await page.textContent("#cases-start"), /biopsy while the patient breathes: it needs .*BC=biopsy-breathing/);
  assert.match(await page.textContent("#cases-start"), /minute of the upper abdomen: it needs .*make -f Makefile\.data abdomen-view/);
  // The scene of the real liver, at a place of the box.
  const scene = 'name = "lift"\nunit = "mm"\n[[tool]]\nname = "forceps"\npath = [[0, 30, 25, 40], [0.4, 30, 25, 40], [1.4, 30, 25, 44], [1.8, 30, 25, 44]]\n[tool.grasp]\nnear = [30, 25, 40]\nradius = 6\nclosing = [[0, 0], [0.4, 1.5]]\n';
  await page.route(/scenes\/liver\/lift\.toml/, (route) => route.fulfill({ body: scene }));
  await page.click("#cases-start a");
  await inState(page, "ready");
  await page.waitForFunction(() => /largest force was \d+\.\d\d N/.test(document.querySelector("#guide p").textContent));
  const told = await page.evaluate(() => [Math.max(...globalThis.palpateViewer.shown.played.map(Math.abs)), document.querySelector("#guide p").textContent]);
  assert.ok(told[0] > 0.01 && Number(/[\d.]+ N/.exec(told[1])[0].slice(0, -2)) >= told[0] - 0.01, told.join(": "));
  await page.click('#guide [data-do="play"]');
  await page.waitForFunction(() => document.querySelectorAll("#guide li").length === 3 && document.querySelector('#guide li:nth-child(2)[aria-current="step"]'));
  await page.click('#guide [data-do="close"]');
  assert.equal(await page.isVisible("#guide"), false);
  await page.waitForFunction(() => globalThis.palpateViewer.shown.playing === null);
  assert.equal(await page.evaluate(() => globalThis.palpateViewer.shown.played), null, "Stop ends the scene");
  await closed(page);
});

test("the scenes of the guided cases are served, and no other file of their folder", async () => {
  const page = await gallery(), { origin } = new URL(page.url());
  const answer = async (path) => (await page.request.get(`${origin}/scenes/${path}`)).status();
  for (const path of ["liver/lift.toml", "liver/biopsy-breathing.toml", "studies/minute.toml"]) assert.equal(await answer(path), 200, path);
  for (const path of ["liver/organ.mk", "liver/none.toml", "studies/none.toml", "liver/..%2forgan.toml", "liver/rod.csv"]) assert.equal(await answer(path), 404, path);
  await closed(page);
});

test("without a healthy organ beside it the task gives no advice", async () => {
  rmSync(`${folder}/alone`, { recursive: true, force: true });
  cpSync(`${data}/liver-tumour/1700/face`, `${folder}/alone/liver-tumour/1700/face`, { recursive: true });
  const page = await gallery({}, `${folder}/alone`);
  await page.click("#task-start a");
  await inState(page, "ready");
  await drag(page, [0, 0], [60, -40]);
  await page.waitForFunction(() => /^1 press\. There the organ has \d\.\d{3} N\/mm\. Is the place/.test(document.querySelector("#task p").textContent));
  await closed(page);
});

for (const [colorScheme, language, heading] of [["light", "en", "Organs"], ["dark", "de", "Organe"]])
  test(`axe-core finds nothing in the gallery and in the task, ${colorScheme}, ${language}, at 1440, 820 and 390 px`, async () => {
    const page = await gallery({ colorScheme }, data, language), wide = () => page.setViewportSize({ width: 1440, height: 900 });
    assert.equal(await page.textContent("h1"), heading);
    assert.equal(await page.textContent("#organs dt"), language === "de" ? "Gehalten" : "Held");
    await looksRight(page, `gallery-${colorScheme}`);
    await wide();
    const style = await page.addStyleTag({ content: "#task-start a { color: var(--accent); }" });
    assert.match((await violations(page)).join(), /contrast 1\.00/, "a control in the colour of its ground is found");
    await style.evaluate((one) => one.remove());
    await page.click("#task-start a");
    await inState(page, "ready");
    await looksRight(page, `task-${colorScheme}`, { fullPage: false });
    await wide();
    await drag(page, [0, 0], [60, -40]);
    await page.click('[data-do="here"]');
    await looksRight(page, `found-${colorScheme}`, { fullPage: false });
    await closed(page);
  });
test("a bundle that the server was started with has no task where nothing is hidden", async () => {
  const page = await ready();
  assert.equal(await page.isVisible("#find-nodule"), false);
  assert.equal(await page.isVisible("#task"), false);
  await closed(page);
});
