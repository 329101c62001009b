// Builds and serves the viewer. PALPATE_WASM: folder of simd/palpate.wasm and baseline/palpate.wasm; PALPATE_BUNDLE: the bundle
// that the page opens by itself; PALPATE_BUNDLE_B: the other one of Compare; PALPATE_RENDER_MESH: the finer surface that it draws;
// PALPATE_WORLD: the scene that the page of several organs opens; PALPATE_WORLD_BUNDLES: "NAME=FILE NAME=FILE", the bundle of each organ;
// PALPATE_DATA: the folder of the bundles in the gallery; PALPATE_VIEWER: where the built page goes.
import { createReadStream, statSync } from "node:fs";
import { resolve } from "node:path";
import { defineConfig } from "vite";
import { bundlesOf, fileOf, sceneOf, studiesOf } from "./data_folder.js";
import { fillWords } from "./fill_words.js";

const here = import.meta.dirname ?? new URL(".", import.meta.url).pathname;
const wasm = resolve(process.env.PALPATE_WASM ?? `${here}/../../build/web`);
const out = resolve(process.env.PALPATE_VIEWER ?? `${here}/../../build/viewer`);

const TYPES = { ".png": "image/png", ".html": "text/html; charset=utf-8" };
// file: absent, or not there: answers 404 with the reason.
function send(response, file, reason) {
  try {
    response.setHeader("Content-Length", statSync(file).size);
    response.setHeader("Content-Type", TYPES[file.slice(file.lastIndexOf("."))] ?? "application/octet-stream");
    createReadStream(file).pipe(response);
  } catch {
    response.statusCode = 404;
    response.end(reason);
  }
}

// The files that the environment variables name, read again for every request.
const FILES = { "/bundle.h5": "PALPATE_BUNDLE", "/bundle-b.h5": "PALPATE_BUNDLE_B", "/render.ply": "PALPATE_RENDER_MESH", "/world.toml": "PALPATE_WORLD" };
// url: "/NAME.h5".
function worldBundle(url) {
  const name = url.replace(/^\/|\.h5.*$/g, ""), pairs = (process.env.PALPATE_WORLD_BUNDLES ?? "").split(" ");
  return pairs.find((pair) => pair.startsWith(`${name}=`))?.slice(name.length + 1);
}
const serveFiles = {
  name: "serve-files",
  configurePreviewServer(server) {
    const data = () => process.env.PALPATE_DATA ?? "";
    for (const [path, variable] of Object.entries(FILES)) server.middlewares.use(path, (_request, response) => send(response, process.env[variable], `no ${variable}`));
    server.middlewares.use("/world-bundles", (request, response) => send(response, worldBundle(request.url), `no ${request.url} in PALPATE_WORLD_BUNDLES`));
    server.middlewares.use("/data", (request, response) => send(response, data() && fileOf(data(), request.url), `no ${request.url} among the data`));
    server.middlewares.use("/scenes", (request, response) => send(response, sceneOf(`${here}/../..`, request.url), `no scene ${request.url}`));
    for (const [path, list] of [["/bundles.json", bundlesOf], ["/studies.json", studiesOf]])
      server.middlewares.use(path, (_request, response) => {
        response.setHeader("Content-Type", "application/json");
        response.end(JSON.stringify(data() ? list(data()) : []));
      });
  },
};

// These headers isolate the page. Browsers give an isolated page a clock of 5 us, which timing one step needs.
const headers = { "Cross-Origin-Opener-Policy": "same-origin", "Cross-Origin-Embedder-Policy": "require-corp" };

export default defineConfig({
  root: `${here}/viewer`,
  base: "./",
  resolve: { alias: { "@wasm": wasm } },
  build: { outDir: out, emptyOutDir: true, assetsInlineLimit: 0, chunkSizeWarningLimit: 1000, target: "es2022",
    rollupOptions: { input: ["index", "world", "compare", "gallery"].map((page) => `${here}/viewer/${page}.html`) } },
  worker: { format: "es" },
  preview: { headers, host: "127.0.0.1", port: 5173 },
  plugins: [serveFiles, fillWords(`${here}/viewer`)],
});
