// Builds the web component <palpate-viewer> into the folder of the npm package. PALPATE_WASM: as in vite.config.js; PALPATE_PACKAGE: the
// folder. The worker and the wasm files are files of their own beside it, which it finds by their addresses.
import { resolve } from "node:path";
import { defineConfig } from "vite";

const here = import.meta.dirname ?? new URL(".", import.meta.url).pathname;
const wasm = resolve(process.env.PALPATE_WASM ?? `${here}/../../build/web`);
const variantOf = (/** @type {string[]} */ files) => (files.some((file) => file.includes("simd/")) ? "simd" : "baseline");

export default defineConfig({
  root: `${here}/component`,
  base: "./",
  publicDir: false,
  resolve: { alias: { "@wasm": wasm } },
  build: {
    outDir: resolve(process.env.PALPATE_PACKAGE ?? `${here}/../../build/npm`), emptyOutDir: true, assetsDir: "", assetsInlineLimit: 0,
    modulePreload: false, chunkSizeWarningLimit: 1000, target: "es2022",
    rollupOptions: { input: `${here}/component/element.ts`, preserveEntrySignatures: "strict", output: { entryFileNames: "palpate-viewer.js" } },
  },
  worker: {
    format: "es",
    rollupOptions: { output: { entryFileNames: "palpate-engine.js", assetFileNames: ({ originalFileNames }) => `${variantOf(originalFileNames)}/[name][extname]` } },
  },
});
