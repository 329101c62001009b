// node cut_test.mjs PACKAGE_FOLDER PALPATE_RUN BUNDLE FOLDER (page.mjs): the scalpel of the page, and scenes with blades, on a block of 80 x 50 x 40 mm
// that can be cut. PALPATE_PYTHON, PALPATE_PRECOMPUTE: what makes the block.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { test } from "node:test";
import { closed, folder, notice, packageFolder, palpateRun, ready, steady } from "./page.mjs";
import { playScene, relativeDifference } from "./reference.mjs";

const { PALPATE_PYTHON = "python3", PALPATE_PRECOMPUTE = palpateRun.replace(/palpate-run$/, "palpate-precompute") } = process.env;
const block = `${folder}/block.h5`;
execFileSync(PALPATE_PYTHON, [`${packageFolder}/../../tests/embed/cut_block.py`, PALPATE_PRECOMPUTE, block], { stdio: "ignore" });

// The page with the block, and what its console says of errors.
async function openBlock() {
  const page = await ready();
  page.on("console", (message) => message.type() === "error" && page.failures.push(message.text()));
  await page.setInputFiles("#file", block);
  await page.waitForFunction(() => globalThis.palpateViewer.info.hasCut && document.body.dataset.state === "ready" && globalThis.palpateViewer.shown.positions);
  return page;
}
const shown = (page) => page.evaluate(() => {
  const { cut, triangles, tools, positions } = globalThis.palpateViewer.shown;
  return { cut, triangles, tools, finite: [...positions].every(Number.isFinite) };
});
const take = async (page, tool) => {
  await page.click(`input[value="${tool}"] + span`);
  if (tool === "scalpel") await page.waitForFunction(() => globalThis.palpateViewer.accepted.effects.cut);
};
// Draws the pointer over the organ, from one pixel beside the middle of the view to another, and holds it there until the scalpel feels a force, N; then the
// scalpel has come to where it was let go.
async function draw(page, [fromX, fromY], [toX, toY], force = 0) {
  const box = await page.locator("#organ").boundingBox(), x = box.x + box.width / 2, y = box.y + box.height / 2, steps = 12;
  await page.mouse.move(x + fromX, y + fromY);
  await page.mouse.down();
  for (let i = 1; i <= steps; ++i) await page.mouse.move(x + fromX + ((toX - fromX) * i) / steps, y + fromY + ((toY - fromY) * i) / steps);
  await page.waitForFunction((least) => globalThis.palpateViewer.shown.cut?.edges.length === 1 && globalThis.palpateViewer.shown.cut.force >= least, force);
  const held = await shown(page);
  await page.mouse.up();
  await page.waitForFunction(() => globalThis.palpateViewer.shown.cut?.edges.length === 0);
  return held;
}
const isWhole = (page, triangles) => page.waitForFunction((count) => globalThis.palpateViewer.shown.triangles === count && !globalThis.palpateViewer.shown.cut?.faces, triangles);

test("a bundle without a region of a cut has no scalpel", async () => {
  const page = await ready();
  assert.equal(await page.isVisible("#scalpel-choice"), false);
  assert.equal(await page.isDisabled('[data-effect="cut"]'), true);
  await closed(page);
});

test("a drag of the scalpel cuts the organ: the surface that is drawn has lips, which are pressed; Reset makes it whole", async () => {
  const page = await openBlock(), before = await shown(page);
  assert.equal(before.cut, null);
  await take(page, "scalpel");
  const held = await draw(page, [-90, -40], [110, 20]), after = await shown(page);
  assert.equal(held.cut.edges[0].length, 2);
  assert.ok(Math.abs(Math.hypot(...[0, 1, 2].map((d) => held.cut.edges[0][1][d] - held.cut.edges[0][0][d])) - 0.035) < 1e-4, "30 mm, and 5 mm before the surface");
  assert.ok(after.cut.area > 1.5e-3, `${after.cut.area} m^2`);
  assert.equal(after.triangles, before.triangles + 2 * after.cut.faces);
  assert.ok(after.finite);
  assert.match(await page.textContent("#cut"), new RegExp(`${Math.round(1e6 * after.cut.area).toLocaleString("en")} mm² cut`));
  // A lip is found by the pointer where a pull holds the cut open, what is found lies on it, and a finger meets it there.
  await page.check("#keep", { force: true });
  await take(page, "pull");
  const at = await page.locator("#organ").boundingBox();
  await page.mouse.move(at.x + at.width / 2 + 20, at.y + at.height / 2 + 25);
  await page.mouse.down();
  await page.mouse.move(at.x + at.width / 2 + 30, at.y + at.height / 2 + 140, { steps: 6 });
  await steady(page);
  await page.mouse.up();
  const lips = await page.evaluate(() => {
    const { view } = globalThis.palpateViewer, { clientWidth: width, clientHeight: height } = document.getElementById("organ"), found = [];
    for (let x = 0.1; x < 0.9; x += 0.01) for (let y = 0.1; y < 0.9; y += 0.01) found.push([x * width, y * height, view.pick(x * width, y * height)]);
    return found.filter(([, , hit]) => hit?.isLip).map(([x, y, { normal, place }]) => [Math.hypot(...normal), ...place, x, y]);
  });
  assert.ok(lips.length > 3, `${lips.length} places on lips`);
  for (const [length, x, y, z] of lips) assert.ok(Math.abs(length - 1) < 1e-6 && x >= -1e-6 && x <= 0.080001 && y >= -1e-6 && y <= 0.050001 && z >= -1e-6 && z <= 0.040001, `${x} ${y} ${z}`);
  assert.equal((await shown(page)).cut.faces, after.cut.faces, "another tool leaves the cut as it is");
  const [, , , , x, y] = lips[Math.floor(lips.length / 2)];
  await take(page, "push");
  await page.mouse.move(at.x + x, at.y + y);
  await page.mouse.down();
  await page.waitForFunction(() => globalThis.palpateViewer.shown.tools[1]?.contacts > 0 && Math.hypot(...globalThis.palpateViewer.shown.tools[1].force) > 0.005);
  if (process.env.PALPATE_PICTURES) await page.screenshot({ path: `${process.env.PALPATE_PICTURES}/cut.png` });
  await page.mouse.up();
  await page.click("#reset");
  await isWhole(page, before.triangles);
  await closed(page);
});

test("with a toughness the scalpel feels a force; what knows the whole organ alone is off, or refused in the library's words", async () => {
  const page = await openBlock(), { triangles } = await shown(page);
  await take(page, "scalpel");
  await page.locator("#toughness").fill("4");
  await page.locator("#toughness").dispatchEvent("input");
  await draw(page, [-90, -40], [60, 0], 0.01);
  const { faces } = (await shown(page)).cut;
  assert.ok(faces > 0);
  // The disc of another tool, and what is refused, leave the cut.
  await page.locator("#radius").fill("8");
  await page.locator("#radius").dispatchEvent("change");
  await page.waitForFunction(() => globalThis.palpateViewer.accepted.tool.discRadius === 0.008);
  await page.selectOption("#section", "x");
  await notice(page, "does not follow a cut");
  assert.equal(await page.inputValue("#section"), "none");
  assert.equal((await shown(page)).cut.faces, faces);
  // Without the effect the organ is whole, and the pointer pushes.
  await page.click('[data-effect="cut"]');
  await isWhole(page, triangles);
  assert.equal(await page.isChecked('input[value="push"]'), true);
  await closed(page);
});

const blades = `name = "blades"
unit = "mm"
bundle = "block.h5"
[limits]
displacement = 0.05
[[tool]]
name = "finger"
points = [[0, 0, 0]]
disc_radius = 5
path = [[0, 60, 25, 44], [0.3, 60, 25, 36], [0.6, 60, 25, 36]]
[[blade]]
name = "scalpel"
edge = [[0, 0, 50], [0, 0, -10]]
path = [[0, 40, -5, 0], [0.5, 40, 56, 0]]
toughness = 10
direction = [0, 1, 0]
cuts = [[0, 0.55]]
`;

test("a scene with a blade plays with the forces of palpate-run, and the cut is drawn", async () => {
  const page = await openBlock(), before = await shown(page), expected = playScene(palpateRun, folder, "blades", blades, 1).forces.flat(2);
  const give = (text) => page.setInputFiles("#path-file", { name: "own.toml", mimeType: "application/octet-stream", buffer: Buffer.from(text) });
  const whole = playScene(palpateRun, folder, "no-blade", blades.replace(/\[\[blade\]\][^]*/, ""), 1).forces.flat(2);
  assert.ok(relativeDifference(whole, expected) > 0.01, "the finger feels the cut");
  await give(blades);
  await page.waitForFunction(() => globalThis.palpateViewer.shown.cut?.faces > 0 && globalThis.palpateViewer.shown.cut.edges[0].length === 2, undefined, { polling: 20 });
  await page.waitForFunction((count) => globalThis.palpateViewer.shown.triangles > count, before.triangles, { polling: 20 });
  await page.waitForFunction(() => globalThis.palpateViewer.shown.played);
  const played = await page.evaluate(() => [...globalThis.palpateViewer.shown.played]);
  assert.ok(relativeDifference(played, expected) < 2e-5, `${relativeDifference(played, expected)}`);
  await isWhole(page, before.triangles);
  for (const [text, pattern] of [
    [blades.replace("toughness", "tough"), "own.toml: .*blade.* 1 has tough"],
    [blades.replace("direction = [0, 1, 0]", ""), "own.toml: .*blade.* 1: expected edge with 2 to 16 points"],
    [blades.replace("[limits]", "[effects]\ncut = false\n[limits]"), "own.toml: .*cut: expected true"],
    [blades.replace("[limits]", "[effects]\ncrossings = true\n[limits]"), "own.toml: .*does not follow a cut"],
  ]) {
    await give(text);
    await notice(page, pattern);
  }
  await closed(page);
});
