// node world_page_test.mjs PACKAGE_FOLDER PALPATE_RUN BUNDLE FOLDER (page.mjs): the page of several organs, on three boxes: one breathes, one
// stands turned on it, one is aside. WRITE_TINY_BUNDLE: the program that makes them.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { pathToFileURL } from "node:url";
import { closed, folder, inState, open, packageFolder, palpateRun, require } from "./page.mjs";
import { piercingNeedle, playScene, pressingProbe, relativeDifference } from "./reference.mjs";
import { violations } from "./axe.mjs";

const bundles = { box: `${folder}/box.h5`, breathing: `${folder}/breathing.h5` };
execFileSync(process.env.WRITE_TINY_BUNDLE, [bundles.box]);
execFileSync(process.env.WRITE_TINY_BUNDLE, [bundles.breathing, "motions"]);

const organ = (name, bundle, more = "") => `[[organ]]\nname = "${name}"\nbundle = "${bundle}.h5"\n${more}\n`;
// Forceps that take the far edge of the box aside and draw it along.
const forceps = `[[tool]]
name = "forceps"
organ = "aside"
path = [[0, 60, 115, 20], [0.1, 60, 115, 20], [0.35, 64, 115, 22]]
[tool.grasp]
near = [60, 25, 20]
radius = 6
closed = [[0.05, 0.3]]
`;
// The probe presses through the upper box on the lower one; the jaws take the far edge of the box aside.
const sceneText = (more = "") => `name = "three boxes"
unit = "mm"
[effects]
law = "unilateral"
[world]
pairs = 60
friction = 0.2
[limits]
displacement = 0.1
${organ("below", "breathing")}${organ("above", "box", "position = [0, 50, 80.5]\nturn = [180, 0, 0]")}${organ("aside", "box", "position = [0, 90, 0]")}
[[motion]]
name = "piston"
organ = "below"
sine = { amplitude = 2, period = 0.2, mean = 1 }
[[tool]]
name = "probe"
organ = "above"
points = [[0, 0, 0]]
disc_radius = 8
near = [45, 25, 0]
depth = [[0, -3], [0.15, 6], [0.3, 6], [0.35, -3]]
${forceps}${more}`;

process.env.PALPATE_WORLD = `${folder}/three-boxes.toml`;
process.env.PALPATE_WORLD_BUNDLES = `below=${bundles.breathing} above=${bundles.box} aside=${bundles.box}`;
const expected = playScene(palpateRun, folder, "three-boxes", sceneText(), 2);

// Three tools and two links: a needle and a probe on one box, forceps on the other one, which a thread draws together and a spring pulls to
// the first one.
execFileSync(process.env.WRITE_TINY_BUNDLE, [`${folder}/pierced.h5`, "corridor"]);
const heldScene = `name = "held boxes"
unit = "mm"
[effects]
law = "unilateral"
[limits]
displacement = 0.1
needle_places = 12
${organ("pierced", "pierced")}${organ("aside", "box", "position = [0, 90, 0]")}
${piercingNeedle("pierced")}${forceps}${pressingProbe("pierced")}[[link]]
name = "suture"
kind = "thread"
organ = "aside"
places = [[40, 10, 40], [50, 25, 40], [40, 40, 40]]
rest_lengths = [[0, 40], [0.2, 20]]
[[link]]
name = "ligament"
kind = "spring"
organs = ["pierced", "aside"]
places = [[50, 50, 20], [50, 0, 20]]
rest_length = 20
stiffness = 3
`;
const heldExpected = playScene(palpateRun, folder, "held-boxes", heldScene, 3);

const shown = (page) => page.evaluate(() => {
  const { positions, ...rest } = globalThis.palpateWorld.shown;
  return rest;
});
const until = (page, condition, given) => page.waitForFunction(condition, given);
const newtons = (page) => page.$$eval("#organs tbody tr", (rows) => rows.map((row) => [...row.children].slice(1).map((cell) => Number.parseFloat(cell.textContent))));

async function opened(options = {}, address = "world.html?language=en") {
  const page = await open(options, undefined, address);
  await inState(page, "ready");
  await until(page, () => globalThis.palpateWorld.shown.positions);
  return page;
}

// Holds the mouse on an organ's upper face, near its middle as the view shows it, and drags down by px.
async function press(page, organ, px) {
  const at = await page.evaluate((name) => {
    const { view, joined, organs } = globalThis.palpateWorld, { clientWidth: width, clientHeight: height } = document.getElementById("organ");
    const wanted = organs.findIndex((one) => one.name === name), found = [];
    for (let x = 0.05; x < 0.96; x += 0.02)
      for (let y = 0.05; y < 0.96; y += 0.02) {
        const hit = view.pick(x * width, y * height);
        if (hit && joined.organAt(hit) === wanted && hit.normal[2] > 0.9) found.push([x * width, y * height]);
      }
    const middle = [0, 1].map((d) => found.reduce((sum, one) => sum + one[d], 0) / found.length), away = (one) => Math.hypot(one[0] - middle[0], one[1] - middle[1]);
    return found.sort((one, other) => away(one) - away(other))[0];
  }, organ);
  assert.ok(at, `${organ} is in sight`);
  const box = await page.locator("#organ").boundingBox(), [x, y] = [box.x + at[0], box.y + at[1]];
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x, y + px / 2);
  await page.mouse.move(x, y + px);
}
const forcesAbove = (page, organ, of, least) => until(page, ([k, which, newton]) => globalThis.palpateWorld.shown.organs[k][which] > newton, [organ, of, least]);
const noForces = (page) => until(page, () => globalThis.palpateWorld.shown.organs.every(({ tools, organs }) => tools < 1e-9 && organs < 0.02));

test("the scene's tools play to the forces of palpate-run; organs, motions and tools are told", async () => {
  const page = await opened();
  assert.match(await page.textContent("#facts"), /^3 organs · [\d,]+ mesh points$/);
  assert.deepEqual(await page.$$eval("#organs tbody th", (cells) => cells.map((cell) => cell.textContent)), ["below", "above", "aside"]);
  assert.match(await page.textContent("#played"), /1: probe, 2: forceps/);
  assert.deepEqual(await violations(page), []);
  await page.click("#play");
  await until(page, () => globalThis.palpateWorld.shown.played);
  const played = await page.evaluate(() => [...globalThis.palpateWorld.shown.played]), wanted = expected.forces.flat(2);
  assert.ok(wanted.some((newton) => Math.abs(newton) > 0.1) && expected.forces.some(([, forceps]) => Math.hypot(...forceps) > 0.05), "both tools are felt");
  assert.ok(relativeDifference(played, wanted) < 1e-5, `${relativeDifference(played, wanted)}`);
  await closed(page);
});

test("needles, links and more than two tools play to the forces of palpate-run, and the page tells how they hold", async () => {
  const page = await opened();
  const files = [["scene.toml", heldScene], ["pierced.h5", readFileSync(`${folder}/pierced.h5`)], ["box.h5", readFileSync(bundles.box)]];
  await page.setInputFiles("#file", files.map(([name, content]) => ({ name, mimeType: "application/octet-stream", buffer: Buffer.from(content) })));
  await until(page, () => document.getElementById("name").textContent === "held boxes" && globalThis.palpateWorld.shown.links.length === 3);
  // The links hold the organs before the scene plays too.
  await until(page, () => globalThis.palpateWorld.shown.holds.some(({ name, condition, tension }) => name === "ligament" && condition === "taut" && tension > 0.02));
  await page.evaluate(() => {
    globalThis.told = new Set();
    globalThis.rows = 0;
    new MutationObserver(() => {
      for (const words of document.getElementById("trust").textContent.split(" · ")) globalThis.told.add(words.replace(/[\d.]+ (mm|N|s)/, "# $1"));
      globalThis.rows = Math.max(globalThis.rows, [...document.querySelectorAll("#readout .tool")].filter((row) => !row.hidden).length);
    }).observe(document.getElementById("trust"), { childList: true });
  });
  await page.click("#play");
  await until(page, () => globalThis.palpateWorld.shown.played);
  const played = await page.evaluate(() => [...globalThis.palpateWorld.shown.played]), wanted = heldExpected.forces.flat(2);
  for (const tool of [0, 1, 2]) assert.ok(heldExpected.forces.some((step) => Math.hypot(...step[tool]) > 0.03), `tool ${tool + 1} is felt`);
  assert.ok(relativeDifference(played, wanted) < 1e-5, `${relativeDifference(played, wanted)}`);
  const told = await page.evaluate(() => [...globalThis.told]);
  for (const words of [/^needle: (cuts, )?# mm in the tissue$/, /^needle: at the end of the corridor, # mm in the tissue$/, /^forceps: holds$/, /^suture: taut, # N$/, /^ligament: taut, # N$/]) assert.ok(told.some((one) => words.test(one)), `${words} of ${told}`);
  assert.equal(await page.evaluate(() => globalThis.rows), 3);
  await closed(page);
});

test("any organ is pressed and pulled; organs press one another; motions play, stop and go where the slider is; refused files leave the organs", async () => {
  const page = await opened();
  // Through the upper box on the lower one.
  await press(page, "above", 200);
  await forcesAbove(page, 1, "tools", 0.1);
  await forcesAbove(page, 0, "organs", 0.05);
  const [below, above, aside] = await newtons(page);
  assert.ok(above[0] > 0.05 && below[0] === 0 && aside[0] === 0 && aside[1] === 0, JSON.stringify([below, above, aside]));
  assert.ok(Math.abs(below[1] - above[1]) < 0.05, "what they do to one another is opposite");
  await page.mouse.up();
  await noForces(page);
  // With the switch off they pass through one another.
  await page.uncheck("#touch");
  await press(page, "above", 200);
  await forcesAbove(page, 1, "tools", 0.1);
  assert.ok((await shown(page)).organs.every(({ organs }) => organs === 0));
  await page.mouse.up();
  await page.check("#touch");
  // The box aside, pulled: it follows the pointer upwards.
  await page.click('input[value="pull"] + span');
  await press(page, "aside", -60);
  await forcesAbove(page, 2, "tools", 0.05);
  assert.ok((await shown(page)).tools[0].force[2] < 0, "it holds the tool back");
  await page.mouse.up();
  await noForces(page);
  // An organ that is not drawn is not picked either.
  const picked = () => page.evaluate(() => {
    const { view, joined } = globalThis.palpateWorld, { clientWidth: width, clientHeight: height } = document.getElementById("organ"), found = new Set();
    for (let x = 0.05; x < 0.96; x += 0.05) for (let y = 0.05; y < 0.96; y += 0.05) {
      const hit = view.pick(x * width, y * height);
      if (hit) found.add(joined.organAt(hit));
    }
    return [...found].sort();
  });
  assert.deepEqual(await picked(), [0, 1, 2]);
  await page.locator("#organs input").nth(1).uncheck();
  assert.deepEqual(await picked(), [0, 2]);
  await page.locator("#organs input").nth(1).check();
  assert.deepEqual(await picked(), [0, 1, 2]);
  await page.selectOption("#law", "unilateral");
  await until(page, () => document.getElementById("notice").textContent.startsWith("Under this grip tools only push"));
  assert.ok(await page.isDisabled('input[value="pull"]') && (await page.isChecked('input[value="push"]')));

  // The motion: the held face is where the piston has it.
  const face = () => page.evaluate(() => globalThis.palpateWorld.shown.positions[3 * globalThis.palpateWorld.joined.mesh.fixed[0]]);
  const isAt = (mm) => until(page, (metres) => Math.abs(globalThis.palpateWorld.shown.positions[3 * globalThis.palpateWorld.joined.mesh.fixed[0]] - metres) < 1e-6, mm / 1000);
  const slider = page.locator("#motions input"), button = page.locator("#motions button");
  await isAt(1); // the mean, at the begin of a round
  await slider.fill("0.25");
  await isAt(3);
  await slider.fill("0.75");
  await isAt(-1);
  assert.equal(await button.textContent(), "Play");
  await button.click();
  await until(page, () => globalThis.palpateWorld.shown.clocks[0].plays);
  const [once] = [await face()];
  await until(page, (before) => Math.abs(globalThis.palpateWorld.shown.positions[3 * globalThis.palpateWorld.joined.mesh.fixed[0]] - before) > 5e-4, once);
  assert.equal(await button.textContent(), "Pause");
  await button.click();
  await until(page, () => !globalThis.palpateWorld.shown.clocks[0].plays);

  // A scene that cannot be used is named, and the organs stay.
  const give = (...given) => page.setInputFiles("#file", given.map(([name, content]) => ({ name, mimeType: "application/octet-stream", buffer: Buffer.from(content) })));
  const refusal = async (pattern, ...given) => {
    await give(...given);
    await inState(page, "error");
    assert.match(await page.textContent("#error-text"), pattern);
    await page.click("#error-back");
    await inState(page, "ready");
  };
  const box = ["box.h5", readFileSync(bundles.box)], breathing = ["breathing.h5", readFileSync(bundles.breathing)];
  await refusal(/box\.h5: expected a scene file of several organs/, box);
  await refusal(/\[\[organ\]\] below: expected its bundle as below\.h5 or breathing\.h5 beside the scene, found box\.h5/, ["scene.toml", sceneText()], box);
  await refusal(/the scene has carried, which this page cannot play; palpate-run can/, ["scene.toml", sceneText('[[carried]]\nname = "tumour"\n')], box, breathing);
  await refusal(/\[\[link\]\] 1: expected kind thread, spring or clip/, ["scene.toml", sceneText('[[link]]\nname = "knot"\nkind = "knot"\n')], box, breathing);
  await refusal(/\[\[motion\]\] tide: expected one of the motions of the bundle of below \(piston, turn, filling, weight\), found another name/, ["scene.toml", sceneText().replace('name = "piston"', 'name = "tide"')], box, breathing);
  await refusal(/found a scene of one/, ["scene.toml", 'unit = "mm"\n'], box);
  await refusal(/breathing\.h5: .*\w/, ["scene.toml", sceneText()], box, ["breathing.h5", "no bundle"]);
  // Two organs of a dropped scene, which share one bundle.
  await give(["pair.toml", `name = "pair"\nunit = "mm"\n${organ("left", "box")}${organ("right", "box", "position = [100, 0, 0]")}`], box);
  await until(page, () => document.body.dataset.state === "ready" && globalThis.palpateWorld.shown.organs.length === 2);
  assert.equal(await page.textContent("#name"), "pair");
  assert.ok(await page.isDisabled("#play"), "it has no tools");
  assert.ok(await page.isHidden("#motions-section"));
  await page.selectOption("#language", "de");
  assert.equal(await page.textContent("#home"), "Alle Organe");
  await closed(page);
});

test("touches that take 5 ms leave time for frames between them", async () => {
  const { transformWithEsbuild } = await import(pathToFileURL(require.resolve("vite").replace(/index\.cjs$/, "dist/node/index.js")));
  const source = readFileSync(`${packageFolder}/viewer/src/touch_loop.ts`, "utf8").replace(/^import .*$/m, "const TOUCH_HZ = 1000;");
  // A browser takes one message at a time, and timers between; Node would take all messages of a port first.
  const oneByOne = `class MessageChannel {
    port1 = {};
    port2 = { postMessage: () => setImmediate(() => this.port1.onmessage()) };
  }\n`;
  const { code } = await transformWithEsbuild(source, "touch_loop.ts"), { TouchLoop } = await import(`data:text/javascript,${encodeURIComponent(oneByOne + code)}`);
  let touches = 0;
  const loop = new TouchLoop(() => {
    for (const until = performance.now() + 5; performance.now() < until; );
    return ++touches < 200;
  });
  loop.run();
  // What a browser calls for each message: the time between two, in the middle of many.
  const waits = [];
  for (let before = performance.now(); touches < 200; ) {
    await new Promise((done) => setTimeout(done, 0));
    const now = performance.now();
    waits.push(now - before);
    before = now;
  }
  const middle = waits.sort((a, b) => a - b)[Math.floor(waits.length / 2)];
  assert.ok(middle < 60, `${middle} ms between frames`);
  assert.ok(loop.lost > 100, `${loop.lost} touches of which nobody could make so many`);
});
