// node browser_test.mjs PACKAGE_FOLDER PALPATE_RUN BUNDLE FOLDER [RENDER_MESH]: tests the built viewer in headless Chromium. Compares
// its forces and shapes with palpate-run on the same paths; tests mouse, keys and the states of the page; writes pictures and frame
// times to FOLDER. RENDER_MESH: a finer surface; "box": one for the box of tests/support; without it, its tests are skipped.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { resolve } from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";
import { playNatively, readForces, relativeDifference } from "./reference.mjs";

const [packageFolder, palpateRun, bundle, folder] = process.argv.slice(2).map((path) => resolve(path)), given = process.argv[6];
const renderMesh = given === "box" ? `${folder}/render.ply` : given && resolve(given), ofFine = { skip: !given };
const require = createRequire(`${packageFolder}/package.json`);
const { chromium } = require("playwright-core");
const { preview } = await import(pathToFileURL(require.resolve("vite").replace(/index\.cjs$/, "dist/node/index.js")));

// The software renderer, for machines without a graphics card.
const FLAGS = ["--no-sandbox", "--disable-gpu", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-quic",
  "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync"];
const TOLERANCE = 1e-5;  // both sum doubles in the same order; shapes are floats
const RADIUS = 0.006;  // m: the disc that the page starts with
const PATIENCE = 120_000;  // ms: a busy machine may draw one frame in a second

let server, browser, url;
before(async () => {
  mkdirSync(folder, { recursive: true });
  if (given === "box") writeFileSync(renderMesh, boxSurface([60, 50, 40], 12));
  process.env.PALPATE_BUNDLE = bundle;
  process.env.PALPATE_RENDER_MESH = renderMesh ?? "";
  server = await preview({ configFile: `${packageFolder}/vite.config.js`, preview: { port: 0, strictPort: false }, logLevel: "error" });
  url = server.resolvedUrls.local[0];
  browser = await chromium.launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium", args: FLAGS });
});
after(async () => {
  await browser?.close();
  await server?.close();
});

async function open(options = {}, prepare = async () => {}) {
  const page = await browser.newPage({ viewport: { width: 1280, height: 800 }, ...options });
  page.setDefaultTimeout(PATIENCE);
  page.failures = [];
  page.on("pageerror", (error) => page.failures.push(error.message));
  await prepare(page);
  await page.goto(url);
  return page;
}
const inState = (page, state) => page.waitForFunction((s) => document.body.dataset.state === s, state);
const frame = (page) => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
const newtons = async (page) => Number(await page.textContent("#newtons"));
const picture = async (page, name) => (await frame(page), page.screenshot({ path: `${folder}/${name}.png` }));
const settled = (page) => page.waitForFunction(() => document.querySelectorAll("#effects .cost:not(:empty)").length > 3);

async function ready(options) {
  const page = await open(options);
  await inState(page, "ready");
  await settled(page);
  return page;
}

// The surface of a box as a PLY file: size in mm, shifted along x, each face in squares of two triangles.
function boxSurface(size, cuts, away = 0) {
  const points = [], faces = [];
  for (let axis = 0; axis < 3; ++axis)
    for (const side of [0, 1]) {
      const first = points.length, row = cuts + 1, [u, v] = side ? [(axis + 1) % 3, (axis + 2) % 3] : [(axis + 2) % 3, (axis + 1) % 3];
      for (let i = 0; i <= cuts; ++i)
        for (let j = 0; j <= cuts; ++j) {
          const point = [0, 0, 0];
          point[axis] = side * size[axis], point[u] = (i * size[u]) / cuts, point[v] = (j * size[v]) / cuts;
          point[0] += away;
          points.push(point.join(" "));
        }
      for (let i = 0; i < cuts; ++i)
        for (let j = 0; j < cuts; ++j) {
          const a = first + i * row + j, b = a + row;
          faces.push(`3 ${a} ${b} ${b + 1}`, `3 ${a} ${b + 1} ${a + 1}`);
        }
    }
  return `ply\nformat ascii 1.0\nelement vertex ${points.length}\nproperty float x\nproperty float y\nproperty float z\n` +
    `element face ${faces.length}\nproperty list uchar int vertex_indices\nend_header\n${[...points, ...faces].join("\n")}\n`;
}

// Asks the page for the surface point in the middle of the view and the inward direction.
const middle = (page) => page.evaluate(() => {
  const { place, normal } = globalThis.palpateViewer.front();
  return { place, normal };
});
const pathRows = ({ place, normal }, heights) => heights.map(([time, height]) => [time, ...place.map((x, d) => x + height * normal[d])]);
const csv = (rows) => "time_s,x_m,y_m,z_m\n" + rows.map((row) => row.join(",")).join("\n") + "\n";

// Plays a path in the page. Reads the forces from the file that the page saves.
async function playInPage(page, text) {
  await page.evaluate(() => (globalThis.palpateViewer.replayed = null));
  await page.setInputFiles("#path-file", { name: "path.csv", mimeType: "text/csv", buffer: Buffer.from(text) });
  return replayed(page);
}
async function replayed(page) {
  await page.waitForFunction(() => globalThis.palpateViewer.replayed !== null);
  const [file] = await Promise.all([page.waitForEvent("download"), page.evaluate(() => document.getElementById("save-forces").click())]);
  const forces = readForces(readFileSync(await file.path(), "utf8"), 1);
  const { positions, fine } = await page.evaluate(() => {
    const { positions, fine } = globalThis.palpateViewer.replayed;
    return { positions: [...positions], fine: [...fine] };
  });
  return { forces, positions, fine };
}

function assertSame(found, expected) {
  assert.equal(found.forces.length, expected.forces.length);
  assert.ok(Math.max(...expected.forces.flat(2).map(Math.abs)) > 0.05, "the tool presses");
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
  const disc = { ...tool, disc_radius: RADIUS }, rubbing = { ...disc, friction: 0.3 };
  assertSame(await playInPage(page, csv(rows)), native("disc", { contact: "patch" }, [disc]));

  await page.selectOption('[data-effect="law"]', "coulomb");
  await page.check('[data-effect="follow"]');
  assertSame(await playInPage(page, csv(rows)),
    native("slipping", { contact: "patch", law: "coulomb", collision: "deformed" }, [rubbing]));

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
  assert.deepEqual(page.failures, []);
  await page.close();
});

test("the finer surface is drawn where there is one, its cost is told, and it can be switched off", ofFine, async () => {
  const page = await ready();
  const drawn = () => page.evaluate(() => globalThis.palpateViewer.shown.fine?.positions.length ?? 0);
  const vertices = Number(readFileSync(renderMesh).toString("latin1").match(/element vertex (\d+)/)[1]);
  await page.waitForFunction(() => globalThis.palpateViewer.shown.fine);
  assert.equal(await drawn(), 3 * vertices);
  assert.match(await page.textContent("#facts"), /drawn: [\d,]+ triangles/);
  const cost = page.locator("#effects .line", { hasText: "Fine surface" }).locator(".cost");
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
  assert.deepEqual(page.failures, []);
  await page.close();
});

test("a finer surface is dropped beside a bundle or on an open organ; one that is none or of another organ is named", ofFine, async () => {
  const page = await open({}, (p) => p.route("**/render.ply", (route) => route.fulfill({ status: 404, body: "" })));
  await inState(page, "ready");
  assert.equal(await page.isDisabled('[data-effect="fine"]'), true);
  const give = (text) => page.setInputFiles("#file", { name: "given.ply", mimeType: "application/octet-stream", buffer: Buffer.from(text) });
  const notice = (pattern) => page.waitForFunction((p) => new RegExp(p).test(document.getElementById("notice").textContent), pattern);
  await give("ply\nthis is none");
  await notice("given.ply: no finer surface");
  const good = readFileSync(renderMesh);
  await give(good);
  await page.waitForFunction(() => globalThis.palpateViewer.shown.fine);
  await give(boxSurface([60, 50, 40], 2, 1000));  // a metre away
  await notice("give metres");
  await page.waitForFunction(() => globalThis.palpateViewer.shown.fine === null);
  assert.equal(await page.isDisabled('[data-effect="fine"]'), true);
  await page.evaluate(async (ply) => {
    const files = new DataTransfer(), bytes = await (await fetch("bundle.h5")).arrayBuffer();
    files.items.add(new File([Uint8Array.from(atob(ply), (c) => c.charCodeAt(0))], "fine.PLY"));
    files.items.add(new File([bytes], "dropped.h5"));
    dispatchEvent(new DragEvent("drop", { dataTransfer: files }));
  }, good.toString("base64"));
  await page.waitForFunction(() => globalThis.palpateViewer.shown.fine);
  assert.equal(await page.isChecked('[data-effect="fine"]'), true);
  assert.deepEqual(page.failures, []);
  await page.close();
});

test("the mouse pushes: newtons, depth, plot; its saved path gives the same forces in palpate-run", async () => {
  const page = await ready();
  await picture(page, "rest");
  const box = await page.locator("#organ").boundingBox(), x = box.x + box.width / 2, y = box.y + box.height / 2;
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + 60, y - 50, { steps: 4 });
  await page.mouse.move(x + 110, y - 90, { steps: 4 });
  await page.waitForFunction(() => Number(document.getElementById("newtons").textContent) > 0.1);
  await picture(page, "push");
  assert.ok(Number(await page.textContent("#depth")) > 3);
  assert.match(await page.textContent("#labels"), /\d\.\d\d N/);
  await page.mouse.up();
  await page.waitForFunction(() => Number(document.getElementById("newtons").textContent) === 0);
  await page.waitForFunction(() => globalThis.palpateViewer.recorded);

  await page.click("#replay");
  const found = await replayed(page);
  const [file] = await Promise.all([page.waitForEvent("download"), page.evaluate(() => document.getElementById("save-path").click())]);
  writeFileSync(`${folder}/path.csv`, readFileSync(await file.path()));
  const scene = `name = "recorded"\nbundle = "${bundle}"\nunit = "m"\n[effects]\ncontact = "patch"\n` +
    `[[tool]]\nname = "mouse"\npoints = [[0, 0, 0]]\ndisc_radius = ${RADIUS}\npath_csv = "path.csv"\n`;
  writeFileSync(`${folder}/recorded.toml`, scene);
  execFileSync(palpateRun, [`${folder}/recorded.toml`, "--quiet", "-o", `${folder}/recorded`]);
  const expected = readForces(readFileSync(`${folder}/recorded/forces.csv`, "utf8"), 1);
  assertSame({ forces: found.forces.slice(0, expected.length) }, { forces: expected });
  assert.ok(found.forces.length - expected.length <= 1, `${found.forces.length} and ${expected.length} steps`);
  assert.deepEqual(page.failures, []);
  await page.close();
});

test("one tool stays while another pulls; reset takes both away", async () => {
  const page = await ready({ colorScheme: "dark" });
  const box = await page.locator("#organ").boundingBox(), x = box.x + box.width / 2, y = box.y + box.height / 2;
  const drag = async (fromX, fromY, toX, toY) => {
    await page.mouse.move(fromX, fromY);
    await page.mouse.down();
    await page.mouse.move((fromX + toX) / 2, (fromY + toY) / 2);
    await page.mouse.move(toX, toY);
    await page.waitForFunction(() => Number(document.getElementById("newtons").textContent) > 0.05);
  };
  const held = () => page.evaluate(() => globalThis.palpateViewer.shown.tools.filter((tool) => tool?.contacts > 0).length);
  await page.click("text=Keep");
  await drag(x + 60, y, x + 140, y + 40);
  await page.mouse.up();
  await frame(page);
  assert.equal(await held(), 1);
  await page.click("text=Pull");
  for (const id of ["show-fixed", "show-touchable", "show-mesh"]) await page.check(`#${id}`);
  await drag(x - 60, y + 10, x - 110, y - 70);
  await page.waitForFunction(() => globalThis.palpateViewer.shown.tools.filter((tool) => tool?.contacts > 0).length === 2);
  await picture(page, "two-tools-dark");
  await page.mouse.up();
  await page.click("#reset");
  await page.waitForFunction(() => Number(document.getElementById("newtons").textContent) === 0);
  assert.equal(await held(), 0);
  assert.deepEqual(page.failures, []);
  await page.close();
});

test("by keyboard alone: the organ turns, space pushes, escape resets", async () => {
  const page = await ready();
  await page.focus("#organ");
  const before = await page.evaluate(() => globalThis.palpateViewer.view.camera.position.toArray());
  await page.keyboard.press("ArrowLeft");
  await frame(page);
  assert.notDeepEqual(await page.evaluate(() => globalThis.palpateViewer.view.camera.position.toArray()), before);
  await page.keyboard.down("Space");
  await page.waitForFunction(() => Number(document.getElementById("newtons").textContent) > 0.1);
  await page.keyboard.up("Space");
  await page.waitForFunction(() => Number(document.getElementById("newtons").textContent) === 0);
  await page.keyboard.press("Escape");
  assert.equal(await newtons(page), 0);
  await page.close();
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
  await page.waitForFunction(() => Number(document.getElementById("newtons").textContent) > 0.1);
  await picture(page, "phone");
  await finger("touchEnd");
  await page.click("#more");
  await page.waitForTimeout(400);
  await picture(page, "phone-details");
  await page.click("#more");
  assert.equal(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), true);
  assert.deepEqual(page.failures, []);
  await page.close();
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
  assert.deepEqual(page.failures, []);
  await page.close();
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
  await page.setInputFiles("#path-file", { name: "bad.csv", mimeType: "text/csv", buffer: Buffer.from("time,x,y,z\n0,1,2\n") });
  await page.waitForFunction(() => /bad.csv: line 2/.test(document.getElementById("notice").textContent));
  await page.close();
});

test("a picture of a press, seen from the side", async () => {
  const page = await ready();
  const from = await middle(page);
  await page.evaluate(() => globalThis.palpateViewer.view.turn(0.42, 0.12));
  const rows = pathRows(from, [[0, 0.002], [0.05, 0.001], [0.8, -0.016], [60, -0.016]]);
  await page.setInputFiles("#path-file", { name: "path.csv", mimeType: "text/csv", buffer: Buffer.from(csv(rows)) });
  await page.waitForFunction(() => globalThis.palpateViewer.shown.tools[0]?.depth > 0.0155);
  await picture(page, "pressed");
  await page.click("#reset");
  await page.close();
});

// Frame times of a replayed press with the surface that is drawn now.
async function timed(page) {
  await page.evaluate(() => (globalThis.palpateViewer.replayed = null));
  await page.click("#replay");
  await page.waitForFunction(() => globalThis.palpateViewer.replayed !== null);
  return page.evaluate(() => {
    const { info, shown, frames, smooth, fine } = globalThis.palpateViewer;
    return { vertices: info.nodeCount, surface: info.surfaceNodeCount, drawnTriangles: shown.fine ? fine.triangles.length / 3 : info.triangleCount,
      drawMs: frames.median, framesPerSecond: frames.rate, touchUs: smooth.touchUs, shapeUs: smooth.shapeUs };
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
