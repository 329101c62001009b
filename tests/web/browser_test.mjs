// node browser_test.mjs PACKAGE_FOLDER PALPATE_RUN BUNDLE FOLDER [RENDER_MESH] (page.mjs): tests the built viewer in headless Chromium.
// Compares its forces and shapes with palpate-run on the same paths; tests the mouse and the states of the page; writes pictures and
// frame times to FOLDER.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFileSync, rmSync, writeFileSync } from "node:fs";
import { test } from "node:test";
import { bundle, closed, csv, drag, folder, frame, give, inState, middle, notice, ofFine, open, palpateRun, pathRows, picture, pressesWith, ready, renderMesh, replays, saved, settled } from "./page.mjs";
import { largestOf, playNatively, readForces, relativeDifference } from "./reference.mjs";

const TOLERANCE = 1e-5;  // both sum doubles in the same order; shapes are floats
const RADIUS = 0.006;  // m: the disc that the page starts with

// Plays a path in the page. Reads the forces from the file that the page saves.
async function playInPage(page, text) {
  await page.evaluate(() => (globalThis.palpateViewer.replayed = null));
  await give(page, "path.csv", text, "#path-file");
  return replayed(page);
}
async function replayed(page) {
  await page.waitForFunction(() => globalThis.palpateViewer.replayed !== null);
  const forces = readForces(await saved(page, "save-forces"), 1);
  const { positions, fine } = await page.evaluate(() => {
    const { positions, fine } = globalThis.palpateViewer.replayed;
    return { positions: [...positions], fine: [...fine] };
  });
  return { forces, positions, fine };
}

function assertSame(found, expected) {
  assert.equal(found.forces.length, expected.forces.length);
  assert.ok(largestOf(expected.forces.flat(2)) > 0.05, "the tool presses");
  const forces = relativeDifference(found.forces.flat(2), expected.forces.flat(2));
  assert.ok(forces < TOLERANCE, `forces differ by ${forces}`);
  if (!expected.shapes) return;
  const shapes = relativeDifference(found.positions, expected.shapes.at(-1));
  assert.ok(shapes < TOLERANCE, `shapes differ by ${shapes}`);
  if (!renderMesh) return;
  const fine = relativeDifference(found.fine, expected.skins.at(-1));
  assert.ok(fine < TOLERANCE, `the finer surface differs by ${fine}`);
  assert.ok(relativeDifference(expected.skins.at(-1), expected.skins[0]) > 100 * TOLERANCE, "it moves");
}

test("a path gives palpate-run's forces and shape, under each effect that is switched on", async () => {
  const page = await ready();
  // 250 touches, so that the last one is also a frame of palpate-run (60 frames a second).
  const rows = pathRows(await middle(page), [[0, 0.002], [0.05, 0.001], [0.2, -0.006], [0.25, -0.008]]);
  const tool = { name: "probe", points: [[0, 0, 0]], path: rows };
  const native = (name, effects, tools) => playNatively(palpateRun, folder, name, bundle, effects, tools, renderMesh ? ["--render-mesh", renderMesh] : []);
  const drawn = renderMesh ? { dent: "discs" } : {}; // as the page draws it
  const disc = { ...tool, disc_radius: RADIUS }, rubbing = { ...disc, friction: 0.3 };
  assertSame(await playInPage(page, csv(rows)), native("disc", { contact: "patch", collision: "deformed", ...drawn }, [disc]));

  await page.selectOption('[data-effect="law"]', "coulomb");
  assertSame(await playInPage(page, csv(rows)),
    native("slipping", { contact: "patch", law: "coulomb", collision: "deformed", ...drawn }, [rubbing]));

  await page.selectOption('[data-effect="law"]', "sticking");
  await page.uncheck('[data-effect="follow"]');
  await page.selectOption('[data-effect="contact"]', "point");
  assertSame(await playInPage(page, csv(rows)), native("point", { contact: "point" }, [tool]));

  // If the bundle has an interior: it is computed and drawn only when the user asks for it.
  const inside = () => page.evaluate(() => globalThis.palpateViewer.shown.inside);
  assert.equal(await inside(), 0);
  if (await page.isEnabled('[data-effect="interior"]')) {
    await page.check('[data-effect="interior"]');
    assertSame(await playInPage(page, csv(rows)), native("volume", { contact: "point", shape: "volume" }, [tool]));
    await page.waitForFunction(() => globalThis.palpateViewer.shown.inside > 0);
    await picture(page, "interior");
  }
  await closed(page);
});

test("the finer surface is drawn where there is one, its cost is told, and it can be switched off", ofFine, async () => {
  const page = await ready();
  const drawn = () => page.evaluate(() => globalThis.palpateViewer.shown.fine?.positions.length ?? 0);
  const vertices = Number(readFileSync(renderMesh).toString("latin1").match(/element vertex (\d+)/)[1]);
  await page.waitForFunction(() => globalThis.palpateViewer.shown.fine);
  assert.equal(await drawn(), 3 * vertices);
  assert.match(await page.textContent("#facts"), /drawn: [\d,]+ triangles/);
  await settled(page);
  const cost = page.locator("#effects .line", { hasText: "Smooth surface" }).locator(".cost");
  assert.match(await cost.textContent(), /^\d.* · [\d.]+$/);
  assert.ok(Number((await cost.textContent()).split(" · ")[1]) > 0);
  for (const id of ["show-fixed", "show-touchable", "show-mesh"]) await page.check(`#${id}`);
  await picture(page, "mesh-under-fine");
  await page.uncheck('[data-effect="fine"]');
  await page.waitForFunction(() => globalThis.palpateViewer.shown.fine === null);
  assert.doesNotMatch(await page.textContent("#facts"), /drawn/);
  await picture(page, "mesh");
  await page.check('[data-effect="fine"]');
  await page.waitForFunction(() => globalThis.palpateViewer.shown.fine);
  await closed(page);
});

test("a finer surface is dropped beside a bundle or on an open organ; one that is none is named", ofFine, async () => {
  const page = await open({}, (p) => p.route("**/render.ply", (route) => route.fulfill({ status: 404, body: "" })));
  await inState(page, "ready");
  assert.equal(await page.isDisabled('[data-effect="fine"]'), true);
  await give(page, "given.ply", "ply\nthis is none");
  await notice(page, "given.ply: this finer surface cannot be used");
  const good = readFileSync(renderMesh);
  await give(page, "given.ply", good);
  await page.waitForFunction(() => globalThis.palpateViewer.shown.fine);
  await page.evaluate(async (ply) => {
    const files = new DataTransfer(), bytes = await (await fetch("bundle.h5")).arrayBuffer();
    files.items.add(new File([Uint8Array.from(atob(ply), (c) => c.charCodeAt(0))], "fine.PLY"));
    files.items.add(new File([bytes], "dropped.h5"));
    dispatchEvent(new DragEvent("drop", { dataTransfer: files }));
  }, good.toString("base64"));
  await page.waitForFunction(() => globalThis.palpateViewer.shown.fine);
  assert.equal(await page.isChecked('[data-effect="fine"]'), true);
  await closed(page);
});

test("the mouse pushes: newtons, depth, plot; its saved scene gives the same forces in palpate-run", async () => {
  const page = await ready();
  await settled(page);
  await picture(page, "rest");
  await drag(page, [0, 0], [110, -90], { release: false });
  await pressesWith(page, 0.1);
  await picture(page, "push");
  assert.ok(Number(await page.textContent("#depth")) > 3);
  assert.match(await page.textContent("#labels"), /\d\.\d\d N/);
  await page.mouse.up();
  await pressesWith(page, 0);
  await page.waitForFunction(() => globalThis.palpateViewer.recordedSteps > 0);

  await page.click("#replay");
  const found = await replayed(page);
  writeFileSync(`${folder}/recorded.toml`, await saved(page, "save-scene"));
  execFileSync(palpateRun, [`${folder}/recorded.toml`, "--bundle", bundle, "--quiet", "-o", `${folder}/recorded`]);
  const expected = readForces(readFileSync(`${folder}/recorded/forces.csv`, "utf8"), 1);
  assertSame({ forces: found.forces }, { forces: expected });
  await closed(page);
});

test("one tool stays while another pulls; reset takes both away", async () => {
  const page = await ready({ colorScheme: "dark" });
  const held = () => page.evaluate(() => globalThis.palpateViewer.shown.tools.filter((tool) => tool?.contacts > 0).length);
  await page.click("#keep + span");
  await drag(page, [60, 0], [140, 40], { release: false });
  await pressesWith(page, 0.05);
  await page.mouse.up();
  await frame(page);
  assert.equal(await held(), 1);
  await page.click('[value="pull"] + span');
  for (const id of ["show-fixed", "show-touchable", "show-mesh"]) await page.check(`#${id}`);
  // So little that the first tool stays inside the organ that the second one alone would leave.
  await drag(page, [-60, 10], [-75, -20], { release: false });
  await page.waitForFunction(() => globalThis.palpateViewer.shown.tools.filter((tool) => tool?.contacts > 0).length === 2);
  await picture(page, "two-tools-dark");
  await page.mouse.up();
  await page.click("#reset");
  await pressesWith(page, 0);
  assert.equal(await held(), 0);
  await closed(page);
});

test("on a phone: a finger pushes, details open and close", async () => {
  const page = await ready({ viewport: { width: 390, height: 780 }, hasTouch: true, isMobile: true });
  const box = await page.locator("#organ").boundingBox();
  const client = await page.context().newCDPSession(page);
  const finger = (type, dx, dy) => client.send("Input.dispatchTouchEvent",
    { type, touchPoints: type === "touchEnd" ? [] : [{ x: box.x + box.width / 2 + dx, y: box.y + box.height / 2 + dy }] });
  await finger("touchStart", 0, 0);
  await finger("touchMove", 20, 20);
  await finger("touchMove", 45, 45);
  await pressesWith(page, 0.1);
  await picture(page, "phone");
  await finger("touchEnd");
  await page.click("#more");
  await picture(page, "phone-details");
  const [organ, panel] = await Promise.all(["#organ", "#panel"].map((id) => page.locator(id).boundingBox()));
  assert.ok(organ.y + organ.height < panel.y + 0.1 * panel.height, "the organ is above its details");
  await page.click("#more");
  assert.equal(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), true);
  await closed(page);
});

test("no bundle: the page says what to do, and takes one that is opened; a damaged one is refused with its reason", async () => {
  const page = await open({}, (p) => p.route("**/bundle.h5", (route) => route.fulfill({ status: 404, body: "" })));
  await inState(page, "empty");
  await picture(page, "empty");
  const give = (file) => page.setInputFiles("#file", file);  // by name, because Playwright passes at most 50 MB as bytes
  const damaged = `${folder}/damaged.h5`, bytes = readFileSync(bundle);
  writeFileSync(damaged, bytes.subarray(0, bytes.length / 2));
  await give(damaged);
  await inState(page, "error");
  assert.match(await page.textContent("#error-text"), /bytes/);
  assert.equal(await page.isVisible("#error-back"), false);
  await picture(page, "error");
  await give(bundle);
  await inState(page, "ready");
  writeFileSync(damaged, "this is no bundle".repeat(1000));
  await give(damaged);
  await inState(page, "error");
  rmSync(damaged);
  await page.click("#error-back");
  await inState(page, "ready");
  await closed(page);
});

test("while the bundle comes: progress", async () => {
  let come;
  const wait = new Promise((resolved) => (come = resolved));
  const page = await open({ colorScheme: "dark" }, (p) => p.route("**/bundle.h5", async (route) => (await wait, route.continue())));
  assert.equal(await page.getAttribute("body", "data-state"), "loading");
  await picture(page, "loading-dark");
  come();
  await inState(page, "ready");
  await page.close();
});

test("without WebAssembly the page says so", async () => {
  const page = await open({}, (p) => p.addInitScript(() => delete globalThis.WebAssembly));
  await inState(page, "unable");
  assert.match(await page.textContent("#unable-text"), /WebAssembly/);
  await picture(page, "no-webassembly");
  await page.close();
});

test("a path file that is none is named, with its line", async () => {
  const page = await ready();
  const bad = [["time,x,y,z\n0,1,2\n", 2], ["0,1,2\n1,0,0,0\n", 1], ["nan,nan,nan,nan\n1,0,0,0\n", 1], ["t,x,y,z\nt,x,y,z\n0,0,0,0\n", 2], ["0,,1,2\n", 1]];
  for (const [i, [text, line]] of bad.entries()) {
    await give(page, `bad${i}.csv`, text, "#path-file");
    await notice(page, `bad${i}\\.csv: line ${line}`);
  }
  await page.close();
});

test("a picture of a press, seen from the side", async () => {
  const page = await ready();
  const from = await middle(page);
  await page.evaluate(() => globalThis.palpateViewer.view.camera.turn(0.42, 0.12));
  const rows = pathRows(from, [[0, 0.002], [0.05, 0.001], [0.8, -0.016], [60, -0.016]]);
  await give(page, "path.csv", csv(rows), "#path-file");
  await page.waitForFunction(() => globalThis.palpateViewer.shown.tools[0]?.depth > 0.0155);
  await picture(page, "pressed");
  await page.click("#reset");
  await page.close();
});

// Frame times of a replayed press with the surface that is drawn now.
async function timed(page) {
  await replays(page, () => page.click("#replay"));
  return page.evaluate(() => {
    const { info, shown, frames, times, fine } = globalThis.palpateViewer;
    return { vertices: info.nodeCount, surface: info.surfaceNodeCount, drawnTriangles: shown.fine ? fine.triangles.length / 3 : info.triangleCount,
      drawMs: frames.median, framesPerSecond: frames.rate, touchUs: times.touchUs.median, shapeUs: times.shapeUs.median };
  });
}

test("frames are timed while a press plays, with the finer surface and without", async () => {
  const page = await ready();
  const times = [await timed(page)];
  if (renderMesh) {
    await page.uncheck('[data-effect="fine"]');
    times.unshift(await timed(page));
    assert.ok(times[1].drawnTriangles > times[0].drawnTriangles);
  }
  writeFileSync(`${folder}/frame-times.json`, JSON.stringify(times, null, 1) + "\n");
  console.log(JSON.stringify(times));
  for (const { drawMs, framesPerSecond, touchUs, shapeUs } of times) assert.ok(drawMs > 0 && framesPerSecond > 0 && touchUs > 0 && shapeUs > 0);
  await page.close();
});
