// What the tests of the viewer share: a server of the built page, headless Chromium, ways to open and ask the page. From the command
// line: PACKAGE_FOLDER PALPATE_RUN BUNDLE FOLDER [RENDER_MESH]. RENDER_MESH: a finer surface; "box": one for the box of tests/support;
// without it, its tests are skipped. Pictures and files go to FOLDER.
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { resolve } from "node:path";
import { after, before } from "node:test";
import { pathToFileURL } from "node:url";

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

// address: of the page, after the server's.
export async function open(options = {}, prepare = async () => {}, address = "") {
  const page = await browser.newPage({ viewport: { width: 1280, height: 800 }, ...options });
  page.setDefaultTimeout(PATIENCE);
  page.failures = [];
  page.on("pageerror", (error) => page.failures.push(error.message));
  await prepare(page);
  await page.goto(url + address);
  return page;
}
export const inState = (page, state) => page.waitForFunction((s) => document.body.dataset.state === s, state);
export const frame = (page) => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
export const newtons = async (page) => Number(await page.textContent("#newtons"));
export const picture = async (page, name) => (await frame(page), page.screenshot({ path: `${folder}/${name}.png` }));
export const settled = (page) => page.waitForFunction(() => document.querySelectorAll("#effects .cost:not(:empty)").length > 3);

export async function ready(options) {
  const page = await open(options);
  await inState(page, "ready");
  await settled(page);
  return page;
}

// The text of the file that a button saves.
export async function saved(page, button) {
  await page.waitForFunction((id) => !document.getElementById(id).disabled, button);
  const [file] = await Promise.all([page.waitForEvent("download"), page.evaluate((id) => document.getElementById(id).click(), button)]);
  return readFileSync(await file.path(), "utf8");
}

// Presses with the mouse at a point beside the middle of the view and drags; px. release: false keeps the button down.
export async function drag(page, [fromX, fromY], [toX, toY], { release = true, button = "left" } = {}) {
  const box = await page.locator("#organ").boundingBox(), x = box.x + box.width / 2, y = box.y + box.height / 2;
  await page.mouse.move(x + fromX, y + fromY);
  await page.mouse.down({ button });
  await page.mouse.move(x + (fromX + toX) / 2, y + (fromY + toY) / 2);
  await page.mouse.move(x + toX, y + toY);
  if (button === "left") await page.waitForFunction(() => globalThis.palpateViewer.shown.tools.some((tool) => tool?.depth > 0.002));
  if (release) await page.mouse.up({ button });
}
export const noTools = (page) => page.waitForFunction(() => !globalThis.palpateViewer.shown.tools.some(Boolean));
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
export const middle = (page) => page.evaluate(() => {
  const { place, normal } = globalThis.palpateViewer.front();
  return { place, normal };
});
export const pathRows = ({ place, normal }, heights) => heights.map(([time, height]) => [time, ...place.map((x, d) => x + height * normal[d])]);
export const csv = (rows) => "time_s,x_m,y_m,z_m\n" + rows.map((row) => row.join(",")).join("\n") + "\n";

