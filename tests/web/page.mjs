// What the tests of the viewer share: a server of the built page, headless Chromium, ways to open and ask the page. From the command
// line: PACKAGE_FOLDER PALPATE_RUN BUNDLE FOLDER [RENDER_MESH]. RENDER_MESH: a finer surface; "box": one for the box of tests/support;
// without it, its tests are skipped. Pictures and files go to FOLDER.
import assert from "node:assert/strict";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, resolve } from "node:path";
import { after, before } from "node:test";
import { pathToFileURL } from "node:url";
import { plyOf } from "./reference.mjs";

export const [packageFolder, palpateRun, bundle, folder] = process.argv.slice(2).map((path) => resolve(path));
const given = process.argv[6];
export const renderMesh = given === "box" ? `${folder}/render.ply` : given && resolve(given), ofFine = { skip: !given };
export const require = createRequire(`${packageFolder}/package.json`);
const { chromium } = require("playwright-core");
const { preview } = await import(pathToFileURL(require.resolve("vite").replace(/index\.cjs$/, "dist/node/index.js")));

// The software renderer, for machines without a graphics card.
const FLAGS = ["--no-sandbox", "--disable-gpu", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-quic",
  "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync"];
const PATIENCE = 120_000;  // ms: a busy machine may draw one frame in a second
// The software renderer takes most of a test's time. On the box the tests look at numbers: their pages draw nothing in WebGL, but those of
// browser_test.mjs draw, with a quarter of the pixels in each direction. On an organ the pictures are looked at.
const onBox = given === "box", SCALE = onBox ? 0.25 : 1, draws = !onBox || process.argv[1].endsWith("browser_test.mjs");
const drawNothing = () => {
  for (const name of Object.getOwnPropertyNames(WebGL2RenderingContext.prototype))
    if (name.startsWith("draw") && !name.startsWith("drawing")) WebGL2RenderingContext.prototype[name] = () => {};
};

let server, browser, url;
before(async () => {
  mkdirSync(folder, { recursive: true });
  if (onBox) writeFileSync(renderMesh, boxSurface([60, 50, 40], 12));
  process.env.PALPATE_BUNDLE = bundle;
  process.env.PALPATE_RENDER_MESH = renderMesh ?? "";
  server = await preview({ configFile: `${packageFolder}/vite.config.js`, preview: { port: 0, strictPort: false }, logLevel: "error" });
  url = server.resolvedUrls.local[0];
  browser = await chromium.launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium-headless-shell", args: FLAGS });
});
after(async () => {
  await browser?.close();
  await server?.close();
});

// Pages of the same options share a context: a browser that has read and compiled the page's files opens it again in half the time. What
// the page before it has kept in the browser is deleted.
const contexts = new Map();
async function contextFor(options) {
  const key = JSON.stringify(options);
  if (!contexts.has(key)) contexts.set(key, await browser.newContext({ viewport: { width: 1280, height: 800 }, deviceScaleFactor: SCALE, reducedMotion: "reduce", ...options }));
  return contexts.get(key);
}

// address: of the page, after the server's, or on another server. Without transitions, so that what a test measures is where it stays.
export async function open(options = {}, prepare = async () => {}, address = "") {
  const page = await (await contextFor(options)).newPage();
  page.setDefaultTimeout(PATIENCE);
  await page.addInitScript(() => {
    if (location.protocol !== "http:" || sessionStorage.getItem("isOfThisPage")) return; // loaded again
    localStorage.clear();
    localStorage.setItem("palpate-layer", "engineer"); // a new user's page has the layer Touch
    sessionStorage.setItem("isOfThisPage", "1");
  });
  if (!draws) await page.addInitScript(drawNothing);
  page.failures = [];
  page.on("pageerror", (error) => page.failures.push(error.message));
  await prepare(page);
  await page.goto(new URL(address, url).href);
  return page;
}
export async function closed(page) {
  assert.deepEqual(page.failures, []);
  await page.close();
}
export const inState = (page, state) => page.waitForFunction((s) => document.body.dataset.state === s, state);
export const frame = (page) => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
// Waits until the first tool's force is above that many N; 0: until it is zero.
export const pressesWith = (page, least) =>
  page.waitForFunction((wanted) => (wanted ? Number(document.getElementById("newtons").textContent) > wanted : Number(document.getElementById("newtons").textContent) === 0), least);
export const picture = async (page, name) => (await frame(page), page.screenshot({ path: `${folder}/${name}.png` }));
export const settled = (page) => page.waitForFunction(() => document.querySelectorAll("#effects .cost:not(:empty)").length > 3 && !document.getElementById("measuring").textContent);

// The page measures what effects cost when nobody has touched the organ for a while; `settled` waits for that.
export async function ready(options) {
  const page = await open(options);
  await inState(page, "ready");
  await page.waitForFunction(() => globalThis.palpateViewer.shown.positions); // the first frame of the engine
  return page;
}

// The text of the file that a button saves.
export async function saved(page, button) {
  await page.waitForFunction((id) => !document.getElementById(id).disabled, button);
  const [file] = await Promise.all([page.waitForEvent("download"), page.evaluate((id) => document.getElementById(id).click(), button)]);
  return readFileSync(await file.path(), "utf8");
}

// Until the page has replayed what `start` makes it play.
export async function replays(page, start) {
  await page.evaluate(() => (globalThis.palpateViewer.replayed = null));
  await start();
  await page.waitForFunction(() => globalThis.palpateViewer.replayed !== null);
}

// Presses with the mouse at a point beside the middle of the view and drags; px. release: false keeps the button down.
export async function drag(page, [fromX, fromY], [toX, toY], { release = true, button = "left" } = {}) {
  const box = await page.locator("#organ").boundingBox(), x = box.x + box.width / 2, y = box.y + box.height / 2;
  await page.mouse.move(x + fromX, y + fromY);
  await page.mouse.down({ button });
  await page.mouse.move(x + (fromX + toX) / 2, y + (fromY + toY) / 2);
  await page.mouse.move(x + toX, y + toY);
  if (button === "left")
    await page.waitForFunction(() => {
      const { pointer, shown } = globalThis.palpateViewer;
      return shown.tools[pointer.held.at(-1)?.index]?.depth > 0.002;
    });
  if (release) await page.mouse.up({ button });
}
// Waits until every tool stands at its target and its force has not changed for three frames of the worker. The force: to 1e-4 N, where the
// tests ask for 1e-3 N or more.
export const steady = (page) => page.waitForFunction(() => {
  const { newest, pointer } = globalThis.palpateViewer;
  if (!newest) return false; // the page has just been loaded
  const { at, tools } = newest.frame, far = (a, b) => Math.hypot(...a.map((x, d) => x - b[d]));
  const arrived = tools.every((tool, t) => !tool === !pointer.targets[t] && (!tool || far(tool.point, pointer.targets[t].point) < 1e-6));
  const known = (globalThis.palpateSteady ??= { at: 0, frames: 0, tools: [] });
  if (at === known.at) return false;
  const same = tools.length === known.tools.length && tools.every((tool, t) => !tool === !known.tools[t] && (!tool || far(tool.force, known.tools[t].force) < 1e-4));
  globalThis.palpateSteady = { at, tools, frames: arrived && same ? known.frames + 1 : 0 };
  if (globalThis.palpateSteady.frames < 3) return false;
  delete globalThis.palpateSteady;
  return true;
});
// Waits until the first tool has gone mm into the organ from where the pointer met it, along the normal there; to 0.01 mm: the page rounds no
// depth, and a tool arrives within 0.001 mm. (The depth that the page tells is along the normal of the organ's mesh.)
export const pressedTo = (page, mm) => page.waitForFunction((wanted) => {
  const ABOVE = 2; // mm, where a tool starts
  const { pointer, shown } = globalThis.palpateViewer, tool = shown.tools[0], start = pointer.targets[0]?.start;
  return tool && start && Math.abs(1000 * Math.hypot(...tool.point.map((x, d) => x - start[d])) - ABOVE - wanted) < 0.01;
}, mm);
export const noTools = (page) => page.waitForFunction(() => !globalThis.palpateViewer.shown.tools.some(Boolean));
// Where the camera is, as the organ sees it.
export const camera = (page) => page.evaluate(() => {
  const { camera, controls } = globalThis.palpateViewer.view.camera, offset = camera.position.clone().sub(controls.target);
  return { distance: offset.length(), direction: offset.normalize().toArray() };
});
export const same = (a, b, tolerance) => Math.hypot(...a.map((x, d) => x - b[d])) < tolerance;
export const shown = (page, of) => page.evaluate((name) => globalThis.palpateViewer.shown[name], of);
export const notice = (page, pattern) => page.waitForFunction((p) => new RegExp(p).test(document.getElementById("notice").textContent), pattern);
export const give = (page, name, content, input = "#file") =>
  page.setInputFiles(input, { name, mimeType: "application/octet-stream", buffer: Buffer.from(content) });

// The surface of a box as a PLY file: size in mm, shifted along x, each face in squares of two triangles.
export function boxSurface(size, cuts, away = 0) {
  const points = [], faces = [];
  for (let axis = 0; axis < 3; ++axis)
    for (const side of [0, 1]) {
      const first = points.length, row = cuts + 1, [u, v] = side ? [(axis + 1) % 3, (axis + 2) % 3] : [(axis + 2) % 3, (axis + 1) % 3];
      for (let i = 0; i <= cuts; ++i)
        for (let j = 0; j <= cuts; ++j) {
          const point = [0, 0, 0];
          point[axis] = side * size[axis], point[u] = (i * size[u]) / cuts, point[v] = (j * size[v]) / cuts;
          point[0] += away;
          points.push(point);
        }
      for (let i = 0; i < cuts; ++i)
        for (let j = 0; j < cuts; ++j) {
          const a = first + i * row + j, b = a + row;
          faces.push([a, b, b + 1], [a, b + 1, a + 1]);
        }
    }
  return plyOf(points, faces);
}

// A module of the page's own sources, as text that imports from them.
export async function moduleOf(text) {
  const { build } = require(require.resolve("esbuild", { paths: [dirname(require.resolve("vite"))] }));
  const { outputFiles: [made] } = await build({ stdin: { contents: text, resolveDir: `${packageFolder}/viewer/src` }, bundle: true, format: "esm", write: false, logLevel: "error" });
  return import(`data:text/javascript,${encodeURIComponent(made.text)}`);
}

// Asks the page for the surface point in the middle of the view and the inward direction.
export const middle = (page) => page.evaluate(() => {
  const { place, normal } = globalThis.palpateViewer.front();
  return { place, normal };
});
export const pathRows = ({ place, normal }, heights) => heights.map(([time, height]) => [time, ...place.map((x, d) => x + height * normal[d])]);
export const csv = (rows) => "time_s,x_m,y_m,z_m\n" + rows.map((row) => row.join(",")).join("\n") + "\n";

