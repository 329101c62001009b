// node first_minute_test.mjs PACKAGE_FOLDER PALPATE_RUN BUNDLE FOLDER [RENDER_MESH] (page.mjs): what a new user meets: what this is, a press
// that plays itself, the layer Touch, and the force that a screen reader tells.
import assert from "node:assert/strict";
import { test } from "node:test";
import { closed, drag, frame, inState, moduleOf, noTools, open, ready, steady } from "./page.mjs";
import { looksRight } from "./axe.mjs";

// As a new user: no choice is kept, and motion is welcome.
const newUser = async (options = {}, address = "") => {
  const page = await open({ reducedMotion: "no-preference", ...options }, (p) => p.addInitScript(() => sessionStorage.getItem("isChosen") || localStorage.removeItem("palpate-layer")), address);
  await inState(page, "ready");
  return page;
};
const deeperThan = (page, mm) => page.waitForFunction((depth) => globalThis.palpateViewer.shown.tools[0]?.depth > depth / 1000, mm);

test("the page says what it is and what it is not for, in both languages", async () => {
  const page = await ready();
  assert.match(await page.textContent("#purpose"), /finite elements.*force in newtons.*For education and research, not for clinical use/);
  await page.selectOption("#language", "de");
  assert.match(await page.textContent("#purpose"), /finiten Elementen.*nicht für den klinischen Gebrauch/);
  assert.equal(await page.isVisible("#purpose"), true);
  await closed(page);
});

test("a press plays itself, again and again, no deeper than linear elasticity is good, until one touches; then the touch counts", async () => {
  const page = await newUser();
  await deeperThan(page, 2);
  assert.match(await page.textContent("#hint"), /plays itself/);
  const limit = await page.evaluate(() => globalThis.palpateViewer.limit.depth);
  let deepest = 0;
  for (let press = 0; press < 2; ++press) {
    await deeperThan(page, 2);
    await page.waitForFunction(() => !globalThis.palpateViewer.shown.tools.some(Boolean));
    deepest = Math.max(deepest, ...(await page.evaluate(() => globalThis.palpateViewer.shown.curves[0].flat().map(({ depth }) => depth))));
  }
  assert.ok(deepest < limit + 1e-4, `${deepest} m, of ${limit} m`);
  await drag(page, [0, 0], [60, -40]);
  assert.equal(await page.evaluate(() => globalThis.palpateViewer.selfPlay.isOn), false);
  assert.doesNotMatch(await page.textContent("#hint"), /plays itself/);
  await noTools(page);
  await page.waitForTimeout(2500); // longer than the pause between two presses
  assert.equal(await page.evaluate(() => globalThis.palpateViewer.shown.tools.some(Boolean)), false, "no press follows");
  await closed(page);
});

test("no press plays itself for those who ask for less motion, where a link holds tools, and in a task", async () => {
  const still = await ready(), isOn = (page) => page.evaluate(() => globalThis.palpateViewer.selfPlay.isOn);
  assert.equal(await isOn(still), false);
  await still.click("#keep + span");
  await drag(still, [0, 0], [60, -40]);
  await steady(still);
  await still.waitForFunction(() => location.hash.includes("tool1"));
  const hash = await still.evaluate(() => location.hash);
  await closed(still);
  const linked = await newUser({}, hash);
  await deeperThan(linked, 1);
  assert.equal(await isOn(linked), false);
  await closed(linked);
});

test("a key ends the press that plays itself", async () => {
  const page = await newUser();
  await deeperThan(page, 1);
  await page.keyboard.press("ArrowLeft");
  await noTools(page);
  assert.equal(await page.evaluate(() => globalThis.palpateViewer.selfPlay.isOn), false);
  await closed(page);
});

test("the layer Touch has what a first touch needs, Engineer everything; the choice is kept, and an address may name it", async () => {
  const page = await newUser({ reducedMotion: "reduce" });
  const seen = (...names) => page.evaluate((all) => all.map((name) => document.querySelector(name).checkVisibility({ visibilityProperty: true })), names);
  const both = ['input[value="push"] + span', 'input[value="pull"] + span', "#reset", "#radius", 'a[href="gallery.html"]', "#plot"], second = ["#keep + span", "#replay", "#effects", "#show-mesh", "#save-scene", "#device", "#facts"];
  assert.deepEqual(await seen(...both), both.map(() => true));
  assert.deepEqual(await seen(...second), second.map(() => false));
  await page.evaluate(() => sessionStorage.setItem("isChosen", "1"));
  await page.click('input[value="engineer"] + span');
  assert.deepEqual(await seen(...both, ...second), [...both, ...second].map(() => true));
  await page.reload();
  await inState(page, "ready");
  assert.equal(await page.isChecked('input[value="engineer"]'), true);
  await closed(page);
  const named = await newUser({}, "?layer=engineer");
  assert.equal(await named.isVisible("#effects"), true);
  await closed(named);
});

test("what holds the organ is named where it is, in both languages; a bundle without supports has no names to show", async () => {
  const page = await ready();
  assert.equal(await page.isDisabled("#show-names"), !(await page.evaluate(() => globalThis.palpateViewer.parts.length)));
  // As of a bundle with a diaphragm: the names stand at their places, and only at those that one sees.
  await page.evaluate(() => {
    const viewer = globalThis.palpateViewer, { place } = viewer.front(), { positions } = viewer.mesh, far = [...positions.subarray(0, 3)];
    for (let n = 0; n < positions.length; n += 3) if (Math.hypot(...place.map((x, d) => x - positions[n + d])) > Math.hypot(...place.map((x, d) => x - far[d]))) far.splice(0, 3, ...positions.subarray(n, n + 3));
    viewer.parts = [{ name: "diaphragm", places: [far, place] }, { name: "viscera", places: [far] }];
    document.getElementById("show-names").disabled = false;
  });
  const shown = () => page.$$eval("#names span:not([hidden])", (all) => all.map((one) => one.textContent));
  assert.deepEqual(await shown(), []);
  await page.check("#show-names");
  await page.waitForFunction(() => document.querySelector("#names span"));
  assert.deepEqual(await shown(), ["diaphragm"]);
  await page.selectOption("#language", "de");
  await page.waitForFunction(() => document.querySelector("#names span").textContent === "Zwerchfell");
  await closed(page);
});

test("lobes are named on organs of the image that they were read off, and on no other one", async () => {
  const { partsOf } = await moduleOf('export { partsOf } from "./anatomy";'), image = "8d585a21aaaa34ab62219fa3606541b73de22e25211f78180c625df341cc1991";
  const at = [0.205, 0.047, 0.147], positions = Float32Array.from([0, 1, 2].flatMap((corner) => at.map((x, d) => x + (d === corner ? 0.004 : 0))));
  const mesh = { positions, triangles: Uint32Array.from([0, 1, 2]), soft: Int32Array.from([]), stiffness: Float64Array.from([]) };
  const names = (provenance) => partsOf(mesh, provenance).map(({ name }) => name);
  assert.deepEqual(names({ organ: "liver", image_sha256: image }), ["left-lobe"], "the right lobe is far from this triangle");
  assert.deepEqual(names({ organ: "liver", image_sha256: "0" }), []);
  assert.deepEqual(names({ organ: "spleen", image_sha256: image }), []);
});

test("a screen reader is told the force politely, at most once a second, and that the tool is gone", async () => {
  const page = await ready();
  await page.evaluate(() => {
    globalThis.told = [];
    const place = document.getElementById("spoken");
    new MutationObserver(() => globalThis.told.push({ at: performance.now(), text: place.textContent })).observe(place, { childList: true });
  });
  assert.equal(await page.getAttribute("#spoken", "role"), "status");
  for (const far of [30, 60, 90]) {
    await drag(page, [0, 0], [far, -20]);
    await page.waitForTimeout(600);
  }
  await page.waitForFunction(() => globalThis.told.at(-1)?.text === "No tool touches the organ.");
  const told = await page.evaluate(() => globalThis.told);
  assert.match(told[0].text, /^Tool 1: \d+\.\d newtons at \d+ millimetres$/);
  for (let i = 1; i < told.length; ++i) assert.ok(told[i].at - told[i - 1].at > 990, JSON.stringify(told));
  await closed(page);
});

for (const [colorScheme, language] of [["light", "en"], ["dark", "de"]])
  test(`axe-core finds nothing in the layer Touch while a press plays itself, ${colorScheme}, ${language}`, async () => {
    const page = await newUser({ colorScheme }, `?language=${language}`);
    await deeperThan(page, 1);
    await frame(page);
    await looksRight(page, `touch-${colorScheme}`, { fullPage: false });
    await closed(page);
  });
