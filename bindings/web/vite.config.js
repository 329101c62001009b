// Builds and serves the viewer. PALPATE_WASM: folder of simd/palpate.wasm and baseline/palpate.wasm; PALPATE_BUNDLE: the bundle
// that the page opens by itself; PALPATE_BUNDLE_B: the other one of Compare; PALPATE_RENDER_MESH: the finer surface that it draws; PALPATE_VIEWER: where the built page goes.
import { createReadStream, statSync } from "node:fs";
import { resolve } from "node:path";
import { defineConfig } from "vite";

const here = import.meta.dirname ?? new URL(".", import.meta.url).pathname;
const wasm = resolve(process.env.PALPATE_WASM ?? `${here}/../../build/web`);
const out = resolve(process.env.PALPATE_VIEWER ?? `${here}/../../build/viewer`);

// The files that the environment variables name, read again for every request.
const FILES = { "/bundle.h5": "PALPATE_BUNDLE", "/bundle-b.h5": "PALPATE_BUNDLE_B", "/render.ply": "PALPATE_RENDER_MESH" };
const serveFiles = {
  name: "serve-files",
  configurePreviewServer(server) {
    for (const [path, variable] of Object.entries(FILES))
      server.middlewares.use(path, (_request, response) => {
        try {
          const file = process.env[variable];
          response.setHeader("Content-Length", statSync(file).size);
          response.setHeader("Content-Type", "application/octet-stream");
          createReadStream(file).pipe(response);
        } catch {
          response.statusCode = 404;
          response.end(`no ${variable}`);
        }
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
    rollupOptions: { input: [`${here}/viewer/index.html`, `${here}/viewer/compare.html`] } },
  worker: { format: "es" },
  preview: { headers, host: "127.0.0.1", port: 5173 },
  plugins: [serveFiles],
});
