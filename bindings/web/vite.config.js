// Builds and serves the viewer. PALPATE_WASM: folder of simd/palpate.wasm and baseline/palpate.wasm; PALPATE_BUNDLE: the bundle
// that the page opens by itself; PALPATE_VIEWER: where the built page goes.
import { createReadStream, statSync } from "node:fs";
import { resolve } from "node:path";
import { defineConfig } from "vite";

const here = import.meta.dirname ?? new URL(".", import.meta.url).pathname;
const wasm = resolve(process.env.PALPATE_WASM ?? `${here}/../../build/web`);
const out = resolve(process.env.PALPATE_VIEWER ?? `${here}/../../build/viewer`);

// /bundle.h5 is the bundle of PALPATE_BUNDLE, read anew for every request.
const serveBundle = {
  name: "serve-bundle",
  configurePreviewServer(server) {
    server.middlewares.use("/bundle.h5", (_request, response) => {
      try {
        const file = process.env.PALPATE_BUNDLE;
        response.setHeader("Content-Length", statSync(file).size);
        response.setHeader("Content-Type", "application/x-hdf5");
        createReadStream(file).pipe(response);
      } catch {
        response.statusCode = 404;
        response.end("no bundle");
      }
    });
  },
};

// A page of its own is given a clock of 5 us, without which one step could not be timed.
const headers = { "Cross-Origin-Opener-Policy": "same-origin", "Cross-Origin-Embedder-Policy": "require-corp" };

export default defineConfig({
  root: `${here}/viewer`,
  base: "./",
  resolve: { alias: { "@wasm": wasm } },
  build: { outDir: out, emptyOutDir: true, assetsInlineLimit: 0, chunkSizeWarningLimit: 1000, target: "es2022" },
  worker: { format: "es" },
  preview: { headers, host: "127.0.0.1", port: 5173 },
  plugins: [serveBundle],
});
