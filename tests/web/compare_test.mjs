// node compare_test.mjs PACKAGE_FOLDER PALPATE_RUN BUNDLE FOLDER [RENDER_MESH] (page.mjs): the page that sets two settings side by
// side. COMPARE_WITH: a bundle of the same organ with another mesh; without it, both sides have the same bundle.
import assert from "node:assert/strict";
import { test } from "node:test";
import { bundle, drag, folder, frame, open, palpateRun, picture } from "./page.mjs";
import { playNatively, relativeDifference } from "./reference.mjs";
import { violations } from "./axe.mjs";

const RADIUS = 0.006; // m: the disc that the page starts with
process.env.PALPATE_BUNDLE_B = process.env.COMPARE_WITH ?? "";

async function comparing(hash = "", options = {}) {
  const page = await open(options, undefined, `compare.html${hash}`);
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
const natively = (name, path, effects, tool) => playNatively(palpateRun, folder, name, bundle, effects,
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
  assert.deepEqual(page.failures, []);
  await page.close();
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
  assert.deepEqual(page.failures, []);
  await page.close();
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
  assert.deepEqual(page.failures, []);
  await page.close();
});

for (const colorScheme of ["light", "dark"])
  test(`axe-core finds nothing in Compare, ${colorScheme}, at 1440, 820 and 390 px`, async () => {
    const page = await comparing("#b=contact%3Dpoint", { colorScheme });
    await page.click("#press");
    await compared(page);
    for (const width of [1440, 820, 390]) {
      await page.setViewportSize({ width, height: 900 });
      if (width === 390) await page.click(".pane:nth-child(1) summary");
      await frame(page);
      assert.deepEqual(await violations(page), []);
      assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), "nothing is wider than the page");
      await frame(page);
      await page.screenshot({ path: `${folder}/compare-${colorScheme}-${width}.png`, fullPage: true });
    }
    await page.close();
  });
