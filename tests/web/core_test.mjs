// core_test.mjs MODULE WRITE_TINY_BUNDLE FOLDER CORE_WASM WASM: the core alone as WebAssembly is small, gives the bits of the module with all effects, and
// says what it does not have.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdirSync, readFileSync } from "node:fs";
import { test } from "node:test";
import { pathToFileURL } from "node:url";

const [, , modulePath, writeTinyBundle, folder, coreWasm, wholeWasm] = process.argv;
const { loadRuntime } = await import(pathToFileURL(modulePath));
mkdirSync(folder, { recursive: true });
execFileSync(writeTinyBundle, [`${folder}/tiny.h5`]);
const bytes = readFileSync(`${folder}/tiny.h5`);
const core = await loadRuntime(readFileSync(coreWasm)), whole = await loadRuntime(readFileSync(wholeWasm));

test("the module of the core is small", () => {
  const kb = readFileSync(coreWasm).length / 1000, of = readFileSync(wholeWasm).length / 1000;
  console.log(`${kb.toFixed(0)} kB of ${of.toFixed(0)} kB`);
  assert.ok(kb <= of / 3);
});

for (const law of ["sticking", "sliding", "unilateral", "coulomb"])
  test(`${law}: forces and shape have the bits of the module with all effects`, () => {
    const played = [core, whole].map((runtime) => {
      const scene = runtime.openBundle(bytes).createScene({ contact: "patch", collision: "deformed", law }), forces = [];
      for (let step = 0; step <= 40; ++step) {
        scene.setTools([{ points: [0.062 - 1e-4 * step, 0.024, 0.021 + 1e-5 * step], discRadius: 0.004, friction: 0.3 }]);
        scene.touch(1e-3);
        forces.push(...scene.force(0));
      }
      scene.shape();
      return [forces, [...scene.positions]];
    });
    assert.ok(Math.hypot(...played[0][0].slice(-3)) > 0.01);
    assert.deepEqual(played[0], played[1]);
  });

test("what the core does not have is refused by its name", () => {
  const bundle = core.openBundle(bytes);
  assert.throws(() => bundle.createScene({ report: "contacts" }), /has none of the name report/);
  assert.throws(() => bundle.createScene({ relaxation: [{ share: 0.5, time: 1 }] }), /has none of the name relaxation/);
  assert.throws(() => bundle.createScene({}).report(), /does not have palpate_scene_report/);
});
