// Builds the web component <palpate-viewer> into the folder of the npm package. PALPATE_WASM: as in vite.config.js; PALPATE_PACKAGE: the
// folder. The worker and the wasm files are files of their own beside it, in the words by which bundlers find them:
// new Worker(new URL("./palpate-engine.js", import.meta.url)). palpate-engine-inline.js has the text of both, for where that fails.
import { readFileSync } from "node:fs";
import { resolve } from "node:path";
import { defineConfig } from "vite";

const here = import.meta.dirname ?? new URL(".", import.meta.url).pathname;
const wasm = resolve(process.env.PALPATE_WASM ?? `${here}/../../build/web`);
const variantOf = (/** @type {string[]} */ files) => (files.some((file) => file.includes("simd/")) ? "simd" : "baseline");

const findable = (/** @type {string} */ code) =>
  code.replace(/new URL\(""\+new URL\("([\w./-]+)",import\.meta\.url\)\.href,import\.meta\.url\)/g, 'new URL("./$1",import.meta.url)')
    .replace(/""\+new URL\("([\w/-]+\.wasm)",import\.meta\.url\)\.href/g, 'new URL("./$1",import.meta.url).href');

/** @type {import("vite").Plugin} */
const packageFiles = {
  name: "package-files",
  enforce: "post",
  generateBundle(_options, bundle) {
    const engine = /** @type {import("vite").Rollup.OutputAsset} */ (bundle["palpate-engine.js"]), viewer = /** @type {import("vite").Rollup.OutputChunk} */ (bundle["palpate-viewer.js"]);
    viewer.code = findable(viewer.code);
    engine.source = findable(String(engine.source));
    const bytes = readFileSync(`${wasm}/simd/palpate.wasm`).toString("base64");
    const whole = engine.source.replace(/new URL\("\.\/simd\/palpate\.wasm",import\.meta\.url\)\.href/, `"data:application/wasm;base64,${bytes}"`)
      .replace(/new URL\("\.\/baseline\/palpate\.wasm",import\.meta\.url\)\.href/, '"data:,"');
    if (!viewer.code.includes('new URL("./palpate-engine.js",import.meta.url)') || whole.includes("import.meta")) throw new Error("the package's files are not where bundlers find them");
    this.emitFile({ type: "asset", fileName: "palpate-engine-inline.js", source: `export default ${JSON.stringify(whole)};\n` });
  },
};

export default defineConfig({
  root: `${here}/component`,
  base: "./",
  publicDir: false,
  resolve: { alias: { "@wasm": wasm } },
  build: {
    outDir: resolve(process.env.PALPATE_PACKAGE ?? `${here}/../../build/npm`), emptyOutDir: true, assetsDir: "", assetsInlineLimit: 0,
    modulePreload: false, chunkSizeWarningLimit: 1000, target: "es2022",
    rollupOptions: { input: `${here}/component/element.ts`, external: [/palpate-engine-inline/], preserveEntrySignatures: "strict", output: { entryFileNames: "palpate-viewer.js" } },
  },
  plugins: [packageFiles],
  worker: {
    format: "es",
    rollupOptions: { output: { entryFileNames: "palpate-engine.js", assetFileNames: ({ originalFileNames }) => `${variantOf(originalFileNames)}/[name][extname]` } },
  },
});
