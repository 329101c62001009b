// node compare_test.mjs PACKAGE_FOLDER PALPATE_RUN BUNDLE FOLDER [RENDER_MESH] (page.mjs): the page that sets two settings side by
// side. COMPARE_WITH: a bundle of the same organ with another mesh; without it, both sides have the same bundle.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { cpSync } from "node:fs";
import { test } from "node:test";
import { bundle, closed, drag, folder, frame, open, palpateRun, picture } from "./page.mjs";
import { playNatively, relativeDifference } from "./reference.mjs";
import { looksRight } from "./axe.mjs";

const RADIUS = 0.006; // m: the disc that the page starts with
process.env.PALPATE_BUNDLE_B = process.env.COMPARE_WITH ?? "";

async function comparing(hash = "", options = {}, language = "en") {
  const page = await open(options, undefined, `compare.html?language=${language}${hash}`);
  await page.waitForFunction(() => globalThis.palpateCompare?.areOpen && globalThis.palpateCompare.sides.every((side) => side.frame));
  return page;
}
const compared = (page) => page.waitForFunction(() => globalThis.palpateCompare.differences && !globalThis.palpateCompare.trying);
const found = (page) => page.evaluate(() => {
  const { sides, path, differences } = globalThis.palpateCompare;
  return {
    differences, steps: path.steps, points: [...path.points], trials: sides.map(({ trial: { of } }) => ({ forces: [...of.forces], samples: of.samples, touch: of.touchUs, shape: of.shapeUs })),
    views: sides.map(({ view }) => view.camera.camera.position.toArray()),
    rows: [...document.querySelectorAll("#rows tr")].map((row) => [...row.children].map((cell) => cell.textContent)),
  };
});
// The first tool's path and forces, [step][x y z].
const firstTool = (numbers) => Array.from({ length: numbers.length / 6 }, (_, step) => numbers.slice(6 * step, 6 * step + 3));
const natively = (name, path, effects, tool, of = bundle) => playNatively(palpateRun, folder, name, of, effects,
  [{ name: "probe", points: [[0, 0, 0]], path: firstTool(path).map((point, step) => [step / 1000, ...point]), ...tool }]).forces.map(([force]) => force);

test("both sides play one press; their forces are palpate-run's under each side's effects, and the table holds the difference", async () => {
  const page = await comparing("#b=contact%3Dpoint");
  assert.equal(await page.inputValue('.pane:nth-child(2) [data-effect="contact"]'), "point");
  assert.equal(await page.inputValue('.pane:nth-child(1) [data-effect="contact"]'), "patch");
  await page.click("#press");
  await compared(page);
  const { differences, points, trials, rows } = await found(page), forces = trials.map((trial) => firstTool(trial.forces));
  const expected = [
    natively("compare-a", points, { contact: "patch", collision: "deformed" }, { disc_radius: RADIUS }),
    process.env.COMPARE_WITH ? null : natively("compare-b", points, { contact: "point", collision: "deformed" }, {}),
  ];
  expected.forEach((of, i) => of && assert.ok(relativeDifference(forces[i].flat(), of.flat()) < 1e-5, `side ${"AB"[i]}`));
  const largest = Math.max(...forces[0].map((force, step) => Math.hypot(...force.map((x, d) => x - forces[1][step][d]))));
  assert.ok(largest > 1e-3, "a disc and a point differ");
  assert.ok(Math.abs(differences.largestForce - largest) < 1e-12);
  assert.equal(rows.length, 7);
  assert.ok(rows[1][3].startsWith(`${largest.toFixed(3)} N (`), rows[1][3]);
  assert.match(rows[0].join("|"), /[\d.]+ N\|[\d.]+ N\|[+−][\d.]+ N \([+−][\d.]+ %\)/);
  assert.match(rows[4][1], /^[\d.]+ µs, [\d.]+ to [\d.]+$/);
  assert.match(rows[6].join("|"), /[\d.]+ MB\|[\d.]+ MB\|× [\d.]+/);
  for (const { touch, shape } of trials) for (const { low, median, high } of [touch, shape]) assert.ok(low > 0 && low <= median && median <= high);
  await picture(page, "compare");
  await closed(page);
});

test("equal settings differ by nothing; a switched effect plays the press again, and the address keeps both settings", { skip: !!process.env.COMPARE_WITH }, async () => {
  const page = await comparing();
  await page.click("#press");
  await compared(page);
  const { points, differences: { largestForce, largest } } = await found(page);
  assert.equal(largestForce, 0);
  assert.ok(largest < 1e-15, "the shares of a node's nearest point are rounded");
  await page.click(".pane:nth-child(2) summary");
  await page.selectOption('.pane:nth-child(2) [data-effect="contact"]', "point");
  await page.waitForFunction(() => globalThis.palpateCompare.differences?.largest > 1e-5);
  assert.deepEqual((await found(page)).points, points, "the same press");
  await page.fill("#radius", "9");
  await page.waitForFunction(() => location.hash.includes("disc=9"));
  await compared(page);
  await page.reload();
  await page.waitForFunction(() => globalThis.palpateCompare?.areOpen && location.hash.includes("point"));
  assert.equal(await page.inputValue('.pane:nth-child(2) [data-effect="contact"]'), "point");
  assert.equal(await page.inputValue('.pane:nth-child(1) [data-effect="contact"]'), "patch");
  assert.equal(await page.textContent("#radius-mm"), "9 mm");
  await closed(page);
});

test("a press by mouse on one organ moves both; a drag beside one turns both", async () => {
  const page = await comparing("#b=law%3Dsliding");
  const box = await page.locator(".pane:nth-child(1) canvas").boundingBox(), at = await page.evaluate(() => {
    const [a] = globalThis.palpateCompare.sides, { point } = a.view.front(a.mesh.touchable), p = a.view.camera.camera.position.clone().set(...point).project(a.view.camera.camera);
    return [(p.x + 1) / 2, (1 - p.y) / 2];
  });
  const [x, y] = [box.x + at[0] * box.width, box.y + at[1] * box.height];
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + 60, y - 40);
  await page.mouse.move(x + 90, y - 60);
  await page.waitForFunction(() => globalThis.palpateCompare.sides.every((side) => side.frame.tools[0]?.depth > 0.003));
  await page.mouse.up();
  await compared(page);
  const { trials, points } = await found(page);
  for (const { samples } of trials) assert.ok(Math.max(...samples.map((sample) => sample.depth)) > 0.003);
  assert.ok(points.some(Number.isFinite));
  const before = (await found(page)).views[0];
  await page.mouse.move(box.x + 8, box.y + box.height - 8);
  await page.mouse.down();
  await page.mouse.move(box.x + 120, box.y + box.height - 40, { steps: 4 });
  await page.mouse.up();
  await frame(page);
  const { views: [a, b] } = await found(page);
  assert.ok(Math.hypot(...a.map((x, d) => x - before[d])) > 0.01, "the camera turned");
  assert.ok(Math.hypot(...a.map((x, d) => x - b[d])) < 1e-9, "both look from one place, but for the rounding of the camera's angles");
  await closed(page);
});

test("a pull on both sides is palpate-run's pull; in the other mode the button presses again", { skip: !!process.env.COMPARE_WITH }, async () => {
  const page = await comparing("#b=law%3Dsliding");
  await page.click('[value="pull"] + span');
  assert.equal(await page.textContent("#press"), "Pull");
  await page.click("#press");
  await compared(page);
  const { points, trials } = await found(page), [pull] = trials.map((trial) => firstTool(trial.forces)), { normal } = await page.evaluate(() => {
    const [{ view, mesh }] = globalThis.palpateCompare.sides;
    return view.front(mesh.touchable);
  });
  const native = natively("compare-pull", points, { contact: "patch", collision: "deformed" }, { disc_radius: RADIUS, hold: true });
  assert.ok(relativeDifference(pull.flat(), native.flat()) < 1e-5);
  assert.ok(Math.min(...pull.map((force) => force.reduce((sum, x, d) => sum + x * normal[d], 0))) < -0.05, "the organ pulls back");
  await page.click('[value="push"] + span');
  assert.equal(await page.textContent("#press"), "Press");
  await page.evaluate(() => (globalThis.palpateCompare.differences = null));
  await page.click("#press");
  await compared(page);
  assert.ok(Math.min(...firstTool((await found(page)).trials[0].forces).map((force) => force.reduce((sum, x, d) => sum + x * normal[d], 0))) > -1e-3);
  await closed(page);
});

test("the sides are named by what differs; each ready comparison sets both sides and presses at one click", { skip: !!process.env.COMPARE_WITH || !process.env.WRITE_TINY_BUNDLE }, async () => {
  const data = `${folder}/compare-data/box`, large = `${folder}/compare-ready.h5`;
  execFileSync(process.env.WRITE_TINY_BUNDLE, [large, "large"]);
  for (const resolution of ["1700", "20000"]) cpSync(bundle, `${data}/${resolution}/face/bundle.h5`);
  process.env.PALPATE_DATA = `${folder}/compare-data`;
  const served = process.env.PALPATE_BUNDLE;
  process.env.PALPATE_BUNDLE = process.env.PALPATE_BUNDLE_B = large;
  const page = await comparing(), names = () => page.$$eval(".caption h2", (all) => all.map((one) => one.textContent));
  assert.deepEqual(await names(), ["A", "B"], "nothing differs");
  const click = async (text) => {
    await page.evaluate(() => (globalThis.palpateCompare.path = globalThis.palpateCompare.differences = null));
    await page.click(`#ready button:has-text("${text}")`);
    await page.waitForFunction(() => globalThis.palpateCompare.path && globalThis.palpateCompare.differences && !globalThis.palpateCompare.trying);
    return page.evaluate(() => {
      const { points, steps } = globalThis.palpateCompare.path, places = Array.from({ length: steps }, (_, step) => [...points.slice(6 * step, 6 * step + 3)]);
      return 1000 * Math.max(...places.map((place) => Math.hypot(...place.map((x, d) => x - places[0][d])))) - 3; // begins 3 mm outside
    });
  };
  assert.ok(Math.abs((await click("25 mm deep")) - 25) < 0.1);
  assert.match(await page.textContent("#about"), /farthest from the organ's middle/);
  // It is at the end: no touchable place that faces the view lies farther from the middle.
  const [pressed, farthest] = await page.evaluate(() => {
    const [{ view, mesh }] = globalThis.palpateCompare.sides, { x, y, z } = view.camera.controls.target, { points } = globalThis.palpateCompare.path;
    const away = (place) => Math.hypot(place[0] - x, place[1] - y, place[2] - z), front = view.front(mesh.touchable);
    return [away([...points.slice(0, 3)]), away(front.place)];
  });
  assert.ok(pressed > farthest, `${pressed} m, and the front ${farthest} m`);
  assert.deepEqual(await names(), ["A: Deep pushes: off", "B: Deep pushes: each touch"]);
  assert.equal(await page.textContent("#name-b"), "B: Deep pushes: each touch");
  assert.ok(Math.abs((await click("Discs of")) - 6) < 0.1);
  assert.deepEqual(await names(), ["A: disc of 3 mm", "B: disc of 9 mm"]);
  assert.match(await page.evaluate(() => location.hash), /disc=3&discb=9/);
  assert.ok(Math.abs((await click("1,700 and 20,000")) - 6) < 0.1);
  assert.deepEqual(await page.evaluate(() => globalThis.palpateCompare.sides.map(({ address }) => /box.(\d+)/.exec(address)[1])), ["1700", "20000"]);
  await click("Discs of");
  assert.deepEqual(await page.evaluate(() => globalThis.palpateCompare.sides.map(({ address }) => /box.(\d+)/.exec(address)[1])), ["1700", "1700"], "one bundle where the bundle is not what differs");
  process.env.PALPATE_BUNDLE = served;
  process.env.PALPATE_BUNDLE_B = process.env.PALPATE_DATA = "";
  await closed(page);
});

for (const [word, deformation] of [["on", "large"], ["beside", "large-beside"], ["renewed", "large-renewed"]])
  test(`large deformation, ${word}, is a setting of a side whose bundle has it; its forces are palpate-run's`, { skip: !!process.env.COMPARE_WITH || !process.env.WRITE_TINY_BUNDLE }, async () => {
    const large = `${folder}/compare-large.h5`;
    execFileSync(process.env.WRITE_TINY_BUNDLE, [large, "large"]);
    process.env.PALPATE_BUNDLE_B = large;
    const page = await comparing(`#b=large%3D${word}`);
    process.env.PALPATE_BUNDLE_B = "";
    assert.equal(await page.isDisabled('.pane:nth-child(1) [data-effect="large"]'), true, "side A's bundle has none");
    assert.equal(await page.inputValue('.pane:nth-child(2) [data-effect="large"]'), word);
    await page.click("#press");
    await compared(page);
    const { differences, points, trials } = await found(page);
    const native = natively("compare-large", points, { contact: "patch", collision: "deformed", deformation }, { disc_radius: RADIUS }, large);
    assert.ok(relativeDifference(firstTool(trials[1].forces).flat(), native.flat()) < 1e-5);
    assert.ok(differences.largestForce > 1e-3, "linear and large differ");
    await closed(page);
  });

for (const [colorScheme, language, force] of [["light", "en", "Force where"], ["dark", "de", "Kraft, wo"]])
  test(`axe-core finds nothing in Compare, ${colorScheme}, ${language}, at 1440, 820 and 390 px; a switch of the language changes its words`, async () => {
    const page = await comparing("#b=contact%3Dpoint", { colorScheme }, language);
    await page.click("#press");
    await compared(page);
    const { rows: [[name, value]] } = await found(page);
    assert.ok(name.startsWith(force) && value.includes(language === "de" ? "," : "."), `${name}: ${value}`);
    await page.selectOption("#language", language === "de" ? "en" : "de");
    assert.ok((await found(page)).rows[0][0].startsWith(language === "de" ? "Force where" : "Kraft, wo"));
    await page.selectOption("#language", language);
    await looksRight(page, `compare-${colorScheme}`, { before: async (width) => width === 390 && page.click(".pane:nth-child(1) summary") });
    await page.close();
  });
