// node bench/web.mjs BUNDLE [FOLDER]: time of a step of the WebAssembly runtime in Node, with SIMD and without, in turns in one run.
// FOLDER has simd/palpate.wasm and baseline/palpate.wasm; default build/web. Medians, us; the held nodes are far from one another.
import { readFileSync } from "node:fs";
import { loadRuntime } from "../bindings/web/module/palpate.js";

const [file, folder = "build/web"] = process.argv.slice(2);
const BUILDS = ["simd", "baseline"], ROUNDS = 400, CALLS = 10;
const median = (numbers) => numbers.sort((a, b) => a - b)[numbers.length >> 1];

function time(call) {
  const start = performance.now();
  for (let i = 0; i < CALLS; ++i) call();
  return ((performance.now() - start) * 1000) / CALLS;
}

const bundles = [];
for (const build of BUILDS) bundles.push((await loadRuntime(readFileSync(`${folder}/${build}/palpate.wasm`))).openBundle(readFileSync(file)));
const touchable = bundles[0].touchable.slice(), { info } = bundles[0];
console.log(`${info.surfaceNodeCount} surface nodes, medians of ${ROUNDS} x ${CALLS} steps\nnodes  shape: ${BUILDS.join(", ")}, ratio  touch: ${BUILDS.join(", ")}`);
for (const held of [1, 3, 10, 30]) {
  const grips = Array.from({ length: held }, (_, i) => ({ node: touchable[Math.floor((i * touchable.length) / held)], displacement: [0, 0.002, 0] }));
  const scenes = bundles.map((bundle) => bundle.createScene({ collision: "off" }));
  const shape = scenes.map(() => []), touch = scenes.map(() => []);
  for (const scene of scenes) {
    scene.setTools([{ grips }]);
    if (scene.touch(1e-3) & 1) throw new Error("the runtime does not take these grips");
  }
  for (let round = 0; round < ROUNDS; ++round)
    scenes.forEach((scene, i) => {
      touch[i].push(time(() => scene.touch(1e-3)));
      shape[i].push(time(() => scene.shape()));
    });
  const [simd, baseline] = shape.map(median), touches = touch.map(median);
  console.log(`${String(held).padStart(5)}  ${simd.toFixed(1)}, ${baseline.toFixed(1)}, ${(baseline / simd).toFixed(1)}  ${touches.map((us) => us.toFixed(2)).join(", ")}`);
  for (const scene of scenes) scene.destroy();
}
