// node example.mjs BUNDLE: holds a node of the organ 1 mm lower and prints the force.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { hasSimd, loadRuntime } from "palpate";

const wasm = createRequire(import.meta.url).resolve(`palpate/${hasSimd() ? "simd" : "baseline"}/palpate.wasm`);
const runtime = await loadRuntime(readFileSync(wasm));
const bundle = runtime.openBundle(readFileSync(process.argv[2]));
const scene = bundle.createScene({ collision: "off", contact: "node" });
const node = bundle.touchable[bundle.touchable.length >> 1];
scene.setTools([{ grips: [{ node, displacement: [0, 0, -0.001] }] }]);
const flags = scene.touch(0.001);
const force = scene.force(0);
console.log(`node ${node}: ${force[2].toFixed(4)} N, flags ${flags}`);
if (!(force[2] > 0) || flags !== 0) process.exit(1);
