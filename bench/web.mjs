// node bench/web.mjs BUNDLE [FOLDER]: time of a step of the WebAssembly runtime in Node, with SIMD and without, in turns in one run; and of a
// render mesh that follows the surface, without the dent of a disc and with it.
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

// A render mesh on the surface: each triangle's points at shares of its corners.
const CUTS = 4;
function finer({ nodes, triangles }) {
  const positions = [], normals = [], corner = (t, v) => nodes.subarray(3 * triangles[3 * t + v], 3 * triangles[3 * t + v] + 3);
  for (let t = 0; t < triangles.length / 3; ++t) {
    const [a, b, c] = [0, 1, 2].map((v) => corner(t, v)), u = b.map((x, d) => x - a[d]), w = c.map((x, d) => x - a[d]);
    const normal = [u[1] * w[2] - u[2] * w[1], u[2] * w[0] - u[0] * w[2], u[0] * w[1] - u[1] * w[0]];
    for (let i = 0; i < CUTS; ++i)
      for (let j = 0; i + j < CUTS; ++j) {
        positions.push(...a.map((x, d) => x + ((i + 0.3) * u[d] + (j + 0.3) * w[d]) / (CUTS + 0.6)));
        normals.push(...normal);
      }
  }
  return { positions: Float32Array.from(positions), normals: Float32Array.from(normals) };
}

const renderMesh = finer(bundles[0]), held = new Set(touchable), { triangles } = bundles[0];
const triangle = Array.from({ length: info.triangleCount }, (_, t) => t).find((t) => [0, 1, 2].every((v) => held.has(triangles[3 * t + v])));
const inward = renderMesh.normals.slice(3 * triangle * ((CUTS * (CUTS + 1)) / 2)).slice(0, 3), length = Math.hypot(...inward);
const displacement = [...inward].map((x) => (-0.005 * x) / length);
const skins = ["off", "discs"].map((dent) => {
  const scene = bundles[0].createScene({ collision: "off", contact: "patch", report: "contacts", dent, renderMesh });
  scene.setTools([{ grips: [{ triangle, barycentric: [0.4, 0.3, 0.3], displacement }], discRadius: 0.006 }]);
  scene.touch(1e-3);
  scene.shape();
  return { scene, times: [] };
});
for (let round = 0; round < ROUNDS; ++round) for (const { scene, times } of skins) times.push(time(() => scene.skin()));
const [without, dented] = skins.map(({ times }) => median(times));
console.log(`render mesh of ${renderMesh.positions.length / 3} vertices: ${without.toFixed(0)} without a dent, ${dented.toFixed(0)} with one of a disc of 6 mm radius, ratio ${(dented / without).toFixed(2)}`);
