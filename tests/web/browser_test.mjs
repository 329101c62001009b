// node browser_test.mjs PACKAGE_FOLDER PALPATE_RUN BUNDLE FOLDER: the built viewer in headless Chromium. Its forces and shapes
// against palpate-run on the same paths, what mouse and keys do, the states of the page; pictures and frame times into FOLDER.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { resolve } from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";
import { playNatively, readForces, relativeDifference } from "./reference.mjs";

const [packageFolder, palpateRun, bundle, folder] = process.argv.slice(2).map((path) => resolve(path));
const require = createRequire(`${packageFolder}/package.json`);
const { chromium } = require("playwright-core");
const { preview } = await import(pathToFileURL(require.resolve("vite").replace(/index\.cjs$/, "dist/node/index.js")));

// The software renderer: the machine need not have a graphics card.
const FLAGS = ["--no-sandbox", "--disable-gpu", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-quic",
  "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync"];
const TOLERANCE = 1e-5;  // doubles in the same order; shapes are floats
const RADIUS = 0.006;  // m: the page's disc at first
const PATIENCE = 120_000;  // ms: a busy machine draws a frame a second

let server, browser, url;
before(async () => {
  mkdirSync(folder, { recursive: true });
  process.env.PALPATE_BUNDLE = bundle;
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

// A place of the surface in the middle of the view and the way in, from the page itself.
const middle = (page) => page.evaluate(() => {
  const { place, normal } = globalThis.palpateViewer.front();
  return { place, normal };
});
const pathRows = ({ place, normal }, heights) => heights.map(([time, height]) => [time, ...place.map((x, d) => x + height * normal[d])]);
const csv = (rows) => "time_s,x_m,y_m,z_m\n" + rows.map((row) => row.join(",")).join("\n") + "\n";

// Plays a path in the page; the forces are those of the file that the page saves.
async function playInPage(page, text) {
  await page.evaluate(() => (globalThis.palpateViewer.replayed = null));
  await page.setInputFiles("#path-file", { name: "path.csv", mimeType: "text/csv", buffer: Buffer.from(text) });
  return replayed(page);
}
async function replayed(page) {
  await page.waitForFunction(() => globalThis.palpateViewer.replayed !== null);
  const [file] = await Promise.all([page.waitForEvent("download"), page.evaluate(() => document.getElementById("save-forces").click())]);
  const forces = readForces(readFileSync(await file.path(), "utf8"), 1);
  return { forces, positions: await page.evaluate(() => [...globalThis.palpateViewer.replayed.positions]) };
}

function assertSame(found, expected) {
  assert.equal(found.forces.length, expected.forces.length);
  assert.ok(Math.max(...expected.forces.flat(2).map(Math.abs)) > 0.05, "the tool presses");
  const forces = relativeDifference(found.forces.flat(2), expected.forces.flat(2));
  assert.ok(forces < TOLERANCE, `forces differ by ${forces}`);
  if (!expected.shapes) return;
  const shapes = relativeDifference(found.positions, expected.shapes.at(-1));
  assert.ok(shapes < TOLERANCE, `shapes differ by ${shapes}`);
}

test("a path gives palpate-run's forces and shape, under each effect that is switched on", async () => {
  const page = await ready();
  // 250 touches: the last is one of palpate-run's frames as well (60 a second).
  const rows = pathRows(await middle(page), [[0, 0.002], [0.05, 0.001], [0.2, -0.006], [0.25, -0.008]]);
  const tool = { name: "probe", points: [[0, 0, 0]], path: rows };
  const disc = { ...tool, radius: RADIUS }, rubbing = { ...disc, friction: 0.3 };
  assertSame(await playInPage(page, csv(rows)), playNatively(palpateRun, folder, "disc", bundle, { contact: "patch" }, [disc]));

  await page.selectOption('[data-effect="law"]', "coulomb");
  await page.check('[data-effect="follow"]');
  assertSame(await playInPage(page, csv(rows)),
    playNatively(palpateRun, folder, "slipping", bundle, { contact: "patch", law: "coulomb", collision: "deformed" }, [rubbing]));

  await page.selectOption('[data-effect="law"]', "sticking");
  await page.uncheck('[data-effect="follow"]');
  await page.selectOption('[data-effect="contact"]', "point");
  assertSame(await playInPage(page, csv(rows)), playNatively(palpateRun, folder, "point", bundle, { contact: "point" }, [tool]));
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
    `[[tool]]\nname = "mouse"\npoints = [[0, 0, 0]]\nradius = ${RADIUS}\npath_csv = "path.csv"\n`;
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
  const bytes = readFileSync(bundle);
  const give = (buffer) => page.setInputFiles("#file", { name: "given.h5", mimeType: "application/x-hdf5", buffer });
  await give(bytes.subarray(0, bytes.length / 2));
  await inState(page, "error");
  assert.match(await page.textContent("#error-text"), /bytes/);
  assert.equal(await page.isVisible("#error-back"), false);
  await picture(page, "error");
  await give(bytes);
  await inState(page, "ready");
  await give(Buffer.from("this is no bundle".repeat(1000)));
  await inState(page, "error");
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

test("frames are timed while the demonstration plays", async () => {
  const page = await ready();
  await page.click("#replay");
  await page.waitForFunction(() => globalThis.palpateViewer.replayed !== null);
  const times = await page.evaluate(() => ({
    vertices: globalThis.palpateViewer.info.nodeCount, surface: globalThis.palpateViewer.info.surfaceNodeCount,
    drawMs: globalThis.palpateViewer.frames.median, framesPerSecond: globalThis.palpateViewer.frames.rate,
    touchUs: globalThis.palpateViewer.smooth.touchUs, shapeUs: globalThis.palpateViewer.smooth.shapeUs,
  }));
  writeFileSync(`${folder}/frame-times.json`, JSON.stringify(times, null, 1) + "\n");
  console.log(JSON.stringify(times));
  assert.ok(times.drawMs > 0 && times.framesPerSecond > 0 && times.touchUs > 0 && times.shapeUs > 0);
  await page.close();
});
