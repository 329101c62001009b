// node component_test.mjs PACKAGE_FOLDER PALPATE_RUN BUNDLE FOLDER [RENDER_MESH] (page.mjs): the npm package, its types, and its element
// <palpate-viewer> in the example page. PALPATE_PACKAGE: the folder of the npm package.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { copyFileSync, createReadStream, mkdirSync, readdirSync, readFileSync, rmSync, statSync, symlinkSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";
import { violations } from "./axe.mjs";
import { bundle, closed, folder, frame, open, packageFolder, renderMesh, require } from "./page.mjs";

const npm = process.env.PALPATE_PACKAGE;
const { serveExample } = await import(pathToFileURL(`${packageFolder}/example/serve.mjs`));
let server, address;
before(async () => {
  server = await serveExample(npm, bundle, renderMesh);
  address = `http://127.0.0.1:${server.address().port}/`;
});
after(() => server?.close());

// The example page with its organ open. What its element sends is kept in globalThis.heard.
async function example(options = {}) {
  const page = await open(options, (p) => p.addInitScript(() => {
    globalThis.heard = [];
    for (const name of ["palpate-open", "palpate-touch", "palpate-error"]) addEventListener(name, ({ detail }) => globalThis.heard.push({ name, ...detail }));
  }), address);
  await page.waitForFunction(() => globalThis.heard.some(({ name }) => name === "palpate-open"));
  await page.waitForFunction(() => document.querySelector("palpate-viewer").organ.shape);
  return page;
}
const heard = (page, name) => page.evaluate((wanted) => globalThis.heard.filter((one) => one.name === wanted).map(({ info, ...rest }) => ({ ...rest, nodes: info?.nodeCount })), name);
const none = (page) => page.waitForFunction(() => !document.querySelector("palpate-viewer").tools.some(Boolean));
// Space, held: a push that grows while it is held.
const push = async (page) => {
  await page.focus("palpate-viewer");
  await page.keyboard.down("Space");
  await page.waitForFunction(() => document.querySelector("palpate-viewer").tools[0]?.depth > 0.002);
};

test("the example page presses an organ: the element tells force, depth and flags, and the page shows the newtons", async () => {
  const page = await example();
  assert.equal((await heard(page, "palpate-open"))[0].nodes, 64);
  if (renderMesh) await page.waitForFunction(() => document.querySelector("palpate-viewer").organ.shape.fine?.positions.length > 3 * 64);
  const box = await page.locator("palpate-viewer").boundingBox(), at = await page.evaluate(() => {
    const { organ: { view, mesh } } = document.querySelector("palpate-viewer"), { point } = view.front(mesh.touchable), p = view.camera.camera.position.clone().set(...point).project(view.camera.camera);
    return [(p.x + 1) / 2, (1 - p.y) / 2];
  });
  const [x, y] = [box.x + at[0] * box.width, box.y + at[1] * box.height];
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + 40, y - 30);
  await page.waitForFunction(() => Number(document.getElementById("force").textContent) > 0.05 && document.querySelector("palpate-viewer").tools[0].depth > 0.002);
  const [tool] = await page.evaluate(() => document.querySelector("palpate-viewer").tools);
  assert.ok(tool.contacts > 0 && tool.point.every(Number.isFinite));
  await page.mouse.up();
  await none(page);
  await page.waitForFunction(() => document.getElementById("force").textContent === "0.00");
  assert.equal((await heard(page, "palpate-touch")).at(-1).flags, 0);
  await page.evaluate(() => document.querySelector("palpate-viewer").press());
  await page.waitForFunction(() => document.querySelector("palpate-viewer").tools[0]);
  await closed(page);
});

test("attributes and properties change the disc, the effects and the bundle; a released tool stays with `keep`", async () => {
  const page = await example();
  // The largest force of a press of 6 mm under what the element has now, in a scene that remembers nothing.
  const pressed = async (change) => {
    const forces = await page.evaluate(async (of) => {
      const element = Object.assign(document.querySelector("palpate-viewer"), of), { organ } = element, { place, normal } = organ.view.front(organ.mesh.touchable);
      const steps = 200, points = new Float64Array(6 * steps).fill(NaN);
      for (let step = 0; step < steps; ++step) for (let d = 0; d < 3; ++d) points[6 * step + d] = place[d] + (0.002 - (0.008 * step) / (steps - 1)) * normal[d];
      const { trial } = await organ.ask({ type: "try", path: { steps, points, hold: new Uint8Array(2 * steps) } }, "tried");
      return [...trial.forces];
    }, change);
    return Math.max(...forces.filter(Number.isFinite).map(Math.abs));
  };
  const wide = await pressed({ disc: 12 }), narrow = await pressed({ disc: 3 });
  assert.ok(narrow > 0.05 && wide > 1.2 * narrow, `${wide} N with 12 mm, ${narrow} N with 3 mm`);
  const point = await pressed({ effects: "contact=point" });
  assert.ok(Math.abs(point / narrow - 1) > 0.02, `${point} N on a point`);
  await page.evaluate(() => (document.querySelector("palpate-viewer").keep = true));
  await push(page);
  await page.keyboard.up("Space");
  for (let i = 0; i < 5; ++i) await frame(page);
  assert.ok(await page.evaluate(() => document.querySelector("palpate-viewer").tools[0] !== null), "the tool stays");
  await page.evaluate(() => document.querySelector("palpate-viewer").reset());
  await none(page);
  await page.evaluate(() => document.querySelector("palpate-viewer").setAttribute("bundle", "none.h5"));
  await page.waitForFunction(() => /none\.h5: the server has no such bundle/.test(document.querySelector("palpate-viewer").shadowRoot.querySelector(".said").textContent));
  assert.equal((await heard(page, "palpate-error")).length, 1);
  await page.evaluate(() => (document.querySelector("palpate-viewer").bundle = "bundle.h5"));
  await page.waitForFunction(() => globalThis.heard.some(({ name }) => name === "palpate-open"));
  await closed(page);
});

test("an element that leaves the page stops its engine; one that comes back opens its organ again", async () => {
  const page = await example();
  assert.equal(page.workers().length, 1);
  await page.evaluate(() => (globalThis.kept = document.querySelector("palpate-viewer")).remove());
  for (let i = 0; page.workers().length && i < 100; ++i) await frame(page);
  assert.equal(page.workers().length, 0);
  await page.evaluate(() => {
    globalThis.heard = [];
    document.body.prepend(globalThis.kept);
  });
  await page.waitForFunction(() => globalThis.heard.some(({ name }) => name === "palpate-open"));
  await closed(page);
});

for (const colorScheme of ["light", "dark"])
  test(`axe-core finds nothing in the element, ${colorScheme}`, async () => {
    const page = await example({ colorScheme });
    await push(page);
    assert.deepEqual((await violations(page)).filter((one) => one.includes("palpate-viewer")), []);
    await page.screenshot({ path: `${folder}/component-${colorScheme}.png` });
    await closed(page);
  });

test("the package holds what its exports name, each wasm once, and its types accept a program and refuse a wrong one", () => {
  const { exports } = JSON.parse(readFileSync(`${npm}/package.json`, "utf8")), files = readdirSync(npm, { recursive: true });
  for (const of of Object.values(exports).flatMap((one) => (typeof one === "string" ? [one] : Object.values(one)))) assert.ok(files.includes(of.slice(2)), of);
  assert.deepEqual(files.filter((file) => file.endsWith(".wasm")).sort(), ["baseline/palpate.wasm", "simd/palpate.wasm"]);
  const user = `${folder}/user`;
  rmSync(user, { recursive: true, force: true });
  mkdirSync(`${user}/node_modules`, { recursive: true });
  symlinkSync(npm, `${user}/node_modules/palpate`);
  writeFileSync(`${user}/program.ts`, `import { STEP_NOT_TOUCHABLE, loadRuntime, type Scene } from "palpate";
import "palpate/viewer";
const organ = document.querySelector("palpate-viewer")!;
organ.addEventListener("palpate-touch", ({ detail }) => console.log(detail.tools[0]?.force[2].toFixed(2), detail.flags & STEP_NOT_TOUCHABLE));
organ.disc = 8;
export const make = async (wasm: ArrayBuffer, bundle: Uint8Array): Promise<Scene> => (await loadRuntime(wasm)).openBundle(bundle).createScene({ contact: "patch" });
// @ts-expect-error: a number
organ.disc = "8";
// @ts-expect-error: an array
organ.addEventListener("palpate-touch", ({ detail }) => detail.tools[0]?.force.z);
// @ts-expect-error: no such contact
export const wrong = async (scenes: Awaited<ReturnType<typeof make>>) => scenes.bundle.createScene({ contact: "disc" });
`);
  execFileSync(`${packageFolder}/node_modules/.bin/tsc`, ["--noEmit", "--strict", "--target", "es2022", "--module", "esnext", "--moduleResolution", "bundler", "program.ts"], { cwd: user });
});

// ---- the packed package in pages of others -----------------------------------------------------------------------------

const PAGE = `<!doctype html><html lang="en"><meta charset="utf-8"><title>Empty</title><palpate-viewer bundle="bundle.h5"></palpate-viewer>`;
const vite = await import(pathToFileURL(require.resolve("vite").replace(/index\.cjs$/, "dist/node/index.js")));

// A project with the packed package in node_modules. files: beside it.
function project(name, files) {
  const root = join(folder, name), installed = join(root, "node_modules/palpate");
  rmSync(root, { recursive: true, force: true });
  mkdirSync(installed, { recursive: true });
  execFileSync("npm", ["pack", "--silent", "--pack-destination", root, npm], { cwd: root });
  execFileSync("tar", ["-xzf", readdirSync(root).find((file) => file.endsWith(".tgz")), "--strip-components=1", "-C", installed], { cwd: root });
  mkdirSync(join(root, "public"));
  copyFileSync(bundle, join(root, "public/bundle.h5"));
  writeFileSync(join(root, "package.json"), '{ "type": "module", "private": true }');
  for (const [file, text] of Object.entries(files)) writeFileSync(join(root, file), text);
  return root;
}

// Serves folders as they are. Returns the address.
const servers = [];
after(() => servers.forEach((one) => one.close()));
const TYPES = { html: "text/html; charset=utf-8", js: "text/javascript", wasm: "application/wasm" };
function serve(folders, headers = {}) {
  const other = createServer(({ url }, response) => {
    const path = decodeURI(url.replace(/[?#].*/, "").replace(/\/$/, "/index.html")), file = folders.map((at) => join(at, path)).find((one) => statSync(one, { throwIfNoEntry: false })?.isFile());
    if (!file) return response.writeHead(404).end();
    response.writeHead(200, { "Content-Type": TYPES[file.split(".").pop()] ?? "application/octet-stream", "Content-Length": statSync(file).size, ...headers });
    createReadStream(file).pipe(response);
  });
  servers.push(other);
  return new Promise((done) => other.listen(0, "127.0.0.1", () => done(`http://127.0.0.1:${other.address().port}/`)));
}

// The element opens its organ and is pressed; nothing was refused.
async function isTouched(at, prepare = async () => {}) {
  const page = await open({}, async (p) => {
    await p.addInitScript(() => {
      globalThis.heard = [];
      for (const name of ["palpate-open", "palpate-error"]) addEventListener(name, ({ detail: { message = "" } }) => globalThis.heard.push([name, message]));
      addEventListener("palpate-touch", ({ detail: { tools } }) => (globalThis.touched ||= tools[0]?.contacts > 0));
    });
    await prepare(p);
  }, at);
  await page.waitForFunction(() => globalThis.heard.length);
  assert.deepEqual(await page.evaluate(() => globalThis.heard), [["palpate-open", ""]]);
  await page.waitForFunction(() => document.querySelector("palpate-viewer").organ.shape);
  await frame(page); // the camera is where the organ is drawn from
  await page.evaluate(() => document.querySelector("palpate-viewer").press());
  await page.waitForFunction(() => globalThis.touched);
  return page;
}

const VITE = {
  "index.html": `${PAGE}<script type="module" src="/main.js"></script></html>`,
  "main.js": `import { hasSimd, loadRuntime } from "palpate";
import simd from "palpate/simd/palpate.wasm?url";
import baseline from "palpate/baseline/palpate.wasm?url";
import "palpate/viewer";
const runtime = await loadRuntime(fetch(hasSimd() ? simd : baseline));
globalThis.nodes = runtime.openBundle(await (await fetch("bundle.h5")).arrayBuffer()).info.nodeCount;
`,
};
const inModule = async (page) => {
  await page.waitForFunction(() => globalThis.nodes);
  assert.equal(await page.evaluate(() => globalThis.nodes), 64);
};

test("the packed package works in an empty page of Vite, served and built", async () => {
  const root = project("vite", VITE), settings = { root, configFile: false, logLevel: "error" };
  const dev = await vite.createServer({ ...settings, server: { port: 0, host: "127.0.0.1" } });
  try {
    await dev.listen();
    const page = await isTouched(dev.resolvedUrls.local[0]);
    await inModule(page);
    await closed(page);
  } finally {
    await dev.close();
  }
  await vite.build({ ...settings, base: "./", build: { target: "es2022" } });
  const built = await isTouched(await serve([join(root, "dist")]));
  await inModule(built);
  await closed(built);
});

const STATIC = (at) => ({
  "index.html": `${PAGE}<script type="module" src="main.js"></script></html>`,
  "main.js": `import { hasSimd, loadRuntime } from "${at}palpate.js";
import "${at}palpate-viewer.js";
const runtime = await loadRuntime(fetch(new URL(hasSimd() ? "${at}simd/palpate.wasm" : "${at}baseline/palpate.wasm", import.meta.url)));
globalThis.nodes = runtime.openBundle(await (await fetch("bundle.h5")).arrayBuffer()).info.nodeCount;
`,
});
const POLICY = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:";

test("the packed package works as plain files, under a policy that forbids styles in the text and unsafe-eval", async () => {
  const root = project("static", STATIC("./node_modules/palpate/"));
  const broken = [], page = await isTouched(await serve([root, join(root, "public")], { "Content-Security-Policy": POLICY }), async (p) => {
    p.on("console", (line) => /Content Security Policy/.test(line.text()) && broken.push(line.text()));
  });
  await inModule(page);
  assert.equal(await page.evaluate(() => getComputedStyle(document.querySelector("palpate-viewer")).position), "relative", "its style is there");
  assert.deepEqual(broken, []);
  assert.match(page.workers()[0].url(), /palpate-engine\.js$/, "the engine's own file is the worker");
  await closed(page);
});

test("the packed package works from another origin", async () => {
  const root = project("elsewhere", {}), at = await serve([join(root, "node_modules/palpate")], { "Access-Control-Allow-Origin": "*" });
  const here = project("here", STATIC(at)), page = await isTouched(await serve([here, join(here, "public")]));
  await inModule(page);
  await closed(page);
});

test("an engine that a page's policy refuses is named as the cause, and so is a file that is no WebAssembly", async () => {
  const root = project("refused", STATIC("./node_modules/palpate/"));
  const page = await open({}, async (p) => p.addInitScript(() => {
    globalThis.heard = [];
    addEventListener("palpate-error", ({ detail }) => globalThis.heard.push(detail.message));
  }), await serve([root, join(root, "public")], { "Content-Security-Policy": POLICY.replace("worker-src 'self'", "worker-src 'none'") }));
  await page.waitForFunction(() => globalThis.heard.length);
  const [message] = await page.evaluate(() => globalThis.heard);
  assert.match(message, /engine/);
  assert.doesNotMatch(message, /WebGL/);
  const wrong = await page.evaluate(async () => (await import("./node_modules/palpate/palpate.js")).loadRuntime(fetch("index.html")).catch((error) => error.message));
  assert.match(wrong, /index\.html: expected a WebAssembly module, found "<!do"/);
  await page.close();
});
