// node gltf_test.mjs PACKAGE_FOLDER PALPATE_RUN WRITE_TINY_BUNDLE FOLDER: checks the file of palpate-run --export with Khronos'
// validator, and compares its shapes with the VTU files. Exits with 77 (skipped, for ctest) without the packages from npm.
import assert from "node:assert/strict";
import { execFileSync, spawnSync } from "node:child_process";
import { existsSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { resolve } from "node:path";
import { test } from "node:test";
import { boxToolsFor, playNatively, plyOf, relativeDifference } from "./reference.mjs";

const [packageFolder, palpateRun, writeTinyBundle, folder] = process.argv.slice(2).map((path) => resolve(path));
if (!existsSync(`${packageFolder}/node_modules/gltf-validator`)) {
  console.log(`${packageFolder}: its packages are not installed; make -f Makefile.data test installs them`);
  process.exit(77);
}
const validator = createRequire(`${packageFolder}/package.json`)("gltf-validator");
mkdirSync(folder, { recursive: true });
const bundle = `${folder}/box.h5`, glb = `${folder}/box.glb`;
execFileSync(writeTinyBundle, [bundle]);
const play = (effects, more) => playNatively(palpateRun, folder, "exported", bundle, effects, boxToolsFor(effects), more);

// The document and its numbers: accessor -> typed array.
function read(bytes) {
  const length = bytes.readUInt32LE(12), document = JSON.parse(bytes.toString("utf8", 20, 20 + length));
  const buffer = Uint8Array.from(bytes.subarray(28 + length)).buffer;
  const numbers = document.accessors.map(({ bufferView, count, type, componentType }) => {
    const Numbers = componentType === 5126 ? Float32Array : Uint32Array;
    return new Numbers(buffer, document.bufferViews[bufferView].byteOffset, count * (type === "VEC3" ? 3 : 1));
  });
  return { document, numbers };
}

for (const shape of ["surface", "volume"])
  test(`the file of a scene with shape "${shape}" is valid and holds the shapes`, async () => {
    const { shapes } = play({ contact: "point", shape }, ["--export", glb]);
    const bytes = readFileSync(glb);
    const report = await validator.validateBytes(new Uint8Array(bytes), { maxIssues: 10 });
    const { numErrors, numWarnings } = report.issues;
    assert.deepEqual({ numErrors, numWarnings }, { numErrors: 0, numWarnings: 0 }, JSON.stringify(report.issues.messages));
    assert.equal(report.info.hasMorphTargets, true);

    const { document, numbers } = read(bytes), [primitive] = document.meshes[0].primitives;
    const rest = numbers[primitive.attributes.POSITION], [sampler] = document.animations[0].samplers;
    assert.equal(primitive.targets.length, shapes.length);
    shapes.forEach((expected, i) => {
      const moved = numbers[primitive.targets[i].POSITION].map((x, n) => x + rest[n]);
      assert.ok(relativeDifference(moved, expected.slice(0, rest.length)) < 1e-6, `shape ${i}: float's rounding`);
    });
    assert.ok(relativeDifference(numbers[primitive.targets.at(-5).POSITION].map((x, n) => x + rest[n]), rest) > 1e-3, "it moves");
    // At the time of each shape, the weight of this shape is 1 and all others are 0.
    numbers[sampler.input].forEach((time, i) => assert.ok(Math.abs(time - Math.ceil((i * 1000) / 60 - 1e-9) / 1000) < 1e-6));
    numbers[sampler.output].forEach((weight, i) => assert.equal(weight, Math.floor(i / shapes.length) === i % shapes.length ? 1 : 0));
    const normals = numbers[primitive.attributes.NORMAL];
    for (let n = 0; n < rest.length; n += 3) assert.ok(Math.abs(Math.hypot(...normals.subarray(n, n + 3)) - 1) < 1e-5);
  });

test("with a render mesh the file is of that mesh, valid, and holds its shapes", async () => {
  const { document: coarse, numbers: own } = read((play({ contact: "point" }, ["--export", glb]), readFileSync(glb)));
  const surface = own[coarse.meshes[0].primitives[0].attributes.POSITION], triangles = own[coarse.meshes[0].primitives[0].indices];
  // The box's surface 0.2 mm further out; triangles do not share corners.
  const corners = [...triangles].map((n) => [0, 1, 2].map((d) => 1000 * surface[3 * n + d] + (surface[3 * n + d] > 0.03 ? 0.2 : -0.2)));
  const faces = Array.from({ length: triangles.length / 3 }, (_, t) => [3 * t, 3 * t + 1, 3 * t + 2]);
  writeFileSync(`${folder}/fine.ply`, plyOf(corners, faces));
  const { skins } = play({ contact: "point" }, ["--render-mesh", `${folder}/fine.ply`, "--export", glb]);
  const bytes = readFileSync(glb), report = await validator.validateBytes(new Uint8Array(bytes), { maxIssues: 10 });
  assert.deepEqual([report.issues.numErrors, report.issues.numWarnings], [0, 0], JSON.stringify(report.issues.messages));
  const { document, numbers } = read(bytes), [primitive] = document.meshes[0].primitives, rest = numbers[primitive.attributes.POSITION];
  assert.equal(rest.length, 3 * triangles.length);
  assert.equal(primitive.targets.length, skins.length);
  skins.forEach((expected, i) => {
    const moved = numbers[primitive.targets[i].POSITION].map((x, n) => x + rest[n]);
    assert.ok(relativeDifference(moved, expected) < 1e-6, `shape ${i}: float's rounding`);
  });
  assert.ok(relativeDifference(skins.at(-5), rest) > 1e-3, "it moves");
});

test("every Nth shape alone", () => {
  play({ contact: "point" }, ["--export", glb, "--every", "5"]);
  assert.equal(read(readFileSync(glb)).document.meshes[0].primitives[0].targets.length, Math.ceil(16 / 5));
});

test("a scene that has no shapes is refused, and nothing is written", () => {
  const refused = spawnSync(palpateRun, [`${folder}/exported.toml`, "--export", `${folder}/absent/box.glb`], { encoding: "utf8" });
  assert.equal(refused.status, 2);
  assert.match(refused.stderr, /absent/);
  assert.equal(existsSync(`${folder}/absent`), false);
  assert.throws(() => play({ contact: "point", shape: "off" }, ["--export", `${folder}/none.glb`]), /expected surface or volume/);
  assert.equal(existsSync(`${folder}/none.glb`), false);
});
