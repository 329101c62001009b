// node runtime_test.mjs MODULE PALPATE_RUN PALPATE_BUNDLE WRITE_TINY_BUNDLE FOLDER WASM...: tests each palpate.wasm. Compares it with
// palpate-run on the same paths; checks its size, its errors for damaged bytes, and that a step does not move the memory's arrays.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdirSync, readFileSync, statSync, writeFileSync } from "node:fs";
import { test } from "node:test";
import { pathToFileURL } from "node:url";
import { boxScenes, boxToolsFor, playNatively, plyOf, positionAt, relativeDifference, smoothNormals } from "./reference.mjs";

const [modulePath, palpateRun, palpateBundle, writeTinyBundle, folder, ...wasms] = process.argv.slice(2);
const { loadRuntime, hasSimd } = await import(pathToFileURL(modulePath));
mkdirSync(folder, { recursive: true });
const file = `${folder}/tiny.h5`;
execFileSync(writeTinyBundle, [file]);
const bytes = new Uint8Array(readFileSync(file));

// Both sum doubles in the same order without fused products. Differences come from the last bits of the C library's sines and
// exponentials, and from contacts at the limit between sticking and slipping. Shapes are floats: 6e-8 each.
const tolerance = 1e-5;

test("this Node has SIMD, so that both builds are held", () => assert.ok(hasSimd()));

// The compiler made wrong SIMD code elsewhere (bindings/web/CMakeLists.txt), so every kernel is tested: one for each number of columns.
for (const precision of ["f32", "f16"])
  test(`every build gives the same bits from ${precision}, whatever the number of nodes held`, async () => {
    const stored = precision === "f32" ? file : `${folder}/${precision}.h5`;
    if (stored !== file) execFileSync(palpateBundle, ["pack", file, "-o", stored, "--precision", precision, "--quiet"]);
    const shapes = await Promise.all(wasms.map(async (wasm) => {
      const bundle = (await loadRuntime(readFileSync(wasm))).openBundle(readFileSync(stored));
      const scene = bundle.createScene({ collision: "off" });
      return Array.from({ length: 9 }, (_, more) => {
        const held = Array.from(bundle.touchable.slice(3, 4 + more));
        scene.setTools([{ grips: held.map((node, i) => ({ node, displacement: [1e-3 * Math.sin(i + 1), 2e-3, -1e-3 * Math.cos(i)] })) }]);
        scene.touch(1e-3);
        scene.shape();
        return new Uint32Array(scene.displacements.slice().buffer);
      });
    }));
    assert.ok(shapes[0][0].some((bits) => bits !== 0));
    for (const others of shapes) assert.deepEqual(others, shapes[0]);
  });

for (const wasm of wasms) {
  const runtime = await loadRuntime(readFileSync(wasm));

  test(`${wasm} is under 1,200 KB`, () => assert.ok(statSync(wasm).size < 1200e3, `${statSync(wasm).size} bytes`));

  for (const [name, effects] of Object.entries(boxScenes))
    test(`${wasm} plays "${name}" as palpate-run does`, () => {
      const tools = boxToolsFor(effects);
      const expected = playNatively(palpateRun, folder, name, file, effects, tools);
      const bundle = runtime.openBundle(bytes), scene = bundle.createScene({ ...effects, maxTools: 2, maxPoints: 2 });
      const forces = [], shapes = [];
      expected.forces.forEach((_, step) => {
        scene.setTools(tools.map((tool) => ({ ...tool, discRadius: tool.disc_radius, points: positionAt(tool.path, step / 1000) })));
        scene.touch(1e-3);
        forces.push(...scene.force(0), ...scene.force(1));
        if (step < Math.ceil((shapes.length * 1000) / 60 - 1e-9)) return;
        scene.shape();
        shapes.push(scene.positions.slice());
      });
      assert.ok(Math.max(...forces.map(Math.abs)) > 0.05, "the tools press");
      assert.ok(relativeDifference(forces, expected.forces.flat(2)) < tolerance, "forces");
      assert.equal(shapes.length, expected.shapes.length);
      shapes.forEach((shape, i) => assert.ok(relativeDifference(shape, expected.shapes[i]) < tolerance, `shape ${i}`));
      const moved = relativeDifference(shapes.at(-1), expected.shapes[0]);
      assert.ok(moved > 100 * tolerance, "the shape moves");
      scene.destroy();
      bundle.close();
    });

  for (const effects of [{ collision: "deformed", contact: "point" }, { collision: "deformed", contact: "patch", law: "coulomb", dent: "discs" }])
  test(`${wasm}: a render mesh goes where palpate-run has it, ${JSON.stringify(effects)}`, () => {
    const tools = boxToolsFor(effects), bundle = runtime.openBundle(bytes);
    // Every surface node, and the middle of every triangle moved outwards by a millimetre.
    const { nodes, triangles, info } = bundle, positions = Array.from(nodes.subarray(0, 3 * info.surfaceNodeCount));
    for (let t = 0; t < info.triangleCount; ++t)
      for (let d = 0; d < 3; ++d) {
        const middle = [0, 1, 2].reduce((sum, v) => sum + nodes[3 * triangles[3 * t + v] + d] / 3, 0);
        positions.push(middle + (middle > 0.025 ? 0.001 : -0.001));
      }
    // Each triangle in three, around its middle.
    const faces = Array.from({ length: info.triangleCount }, (_, t) => [0, 1, 2].map((v) =>
      [triangles[3 * t + v], triangles[3 * t + (v + 1) % 3], info.surfaceNodeCount + t])).flat();
    const rows = Array.from({ length: positions.length / 3 }, (_, v) => positions.slice(3 * v, 3 * v + 3).map((x) => 1000 * x));
    writeFileSync(`${folder}/fine.ply`, plyOf(rows, faces, "double"));
    const expected = playNatively(palpateRun, folder, "skin", file, effects, tools, ["--render-mesh", `${folder}/fine.ply`]);
    const renderMesh = { positions: Float32Array.from(positions), normals: smoothNormals(positions, faces) };
    const report = effects.dent ? "contacts" : "off";
    const scene = bundle.createScene({ ...effects, report, renderMesh, maxTools: 2, maxPoints: 2 }), skins = [];
    assert.equal(scene.plan.at(-1).name, effects.dent ? "dent: discs" : "skin: render mesh");
    let dents = 0;
    expected.forces.forEach((_, step) => {
      scene.setTools(tools.map((tool) => ({ ...tool, discRadius: tool.disc_radius, points: positionAt(tool.path, step / 1000) })));
      scene.touch(1e-3);
      if (step < Math.ceil((skins.length * 1000) / 60 - 1e-9)) return;
      assert.equal(scene.shape() | scene.skin(), 0);
      skins.push(scene.skinPositions.slice());
      dents += scene.discNormals.length / 3;
    });
    assert.equal(dents > 0, !!effects.dent);
    assert.equal(skins.length, expected.skins.length);
    skins.forEach((skin, i) => assert.ok(relativeDifference(skin, expected.skins[i]) < tolerance, `skin ${i}`));
    assert.ok(relativeDifference(skins.at(-4), skins[0]) > 100 * tolerance, "the mesh moves");
    for (let i = 0; i < scene.skinNormals.length; i += 3) assert.ok(Math.abs(Math.hypot(...scene.skinNormals.subarray(i, i + 3)) - 1) < 1e-5);
    assert.throws(() => bundle.createScene({ renderMesh: { positions: Float32Array.of(1, 2) } }), /three numbers a vertex/);
    assert.throws(() => bundle.createScene({ renderMesh: { positions: Float32Array.of(30, 20, 40) } }), /give metres/);
    // Tools meet a surface 1 mm beyond the box's, but for the side that is held.
    const beyond = Float32Array.from(nodes.subarray(0, 3 * info.surfaceNodeCount), (x) => x + (x > 0.025 ? 0.001 : -0.001));
    const fine = bundle.createScene({ fineSurface: { positions: beyond, triangles: Int32Array.from(triangles) } });
    const touches = (/** @type {number} */ x) => {
      fine.setTools([{ points: [x, 0.024, 0.019] }]);
      fine.touch(1e-3);
      return fine.force(0).some((newton) => newton !== 0);
    };
    assert.deepEqual([0.063, 0.0611, 0.0609].map(touches), [false, false, true]);
    fine.destroy();
    assert.throws(() => bundle.createScene({ fineSurface: { positions: beyond, triangles: Int32Array.of(0, 1, 2) } }), /4 vertices or more and 4 triangles/);
    assert.throws(() => bundle.createScene({ fineSurface: { positions: beyond, triangles: Int32Array.of(0, 1) } }), /three a triangle/);
    scene.destroy();
    bundle.close();
  });

  test(`${wasm}: a grip holds a node where it is told`, () => {
    const bundle = runtime.openBundle(bytes), scene = bundle.createScene({ collision: "off", forceSlew: Infinity });
    const node = bundle.touchable[7], displacement = [0.001, -0.002, 0.0015];
    scene.setTools([{ grips: [{ node, displacement }] }]);
    assert.equal(scene.touch(1e-3), 0);
    assert.equal(scene.shape(), 0);
    const found = scene.displacements.subarray(3 * node, 3 * node + 3);
    assert.ok(relativeDifference(found, displacement) < 1e-6, "floats");
    assert.ok(Math.hypot(...scene.force(0)) > 0.01);
    scene.destroy();
    bundle.close();
  });

  test(`${wasm}: steps neither move nor grow the memory, and views show what they did`, () => {
    const bundle = runtime.openBundle(bytes), scene = bundle.createScene({ contact: "point" });
    const buffer = runtime.heap.buffer, positions = scene.positions, force = scene.force(0);
    for (let step = 0; step < 2000; ++step) {
      scene.setTools([{ points: [0.031, 0.024, 0.041 - 3e-6 * step] }]);
      scene.touch(1e-3);
    }
    const before = positions.slice();
    scene.shape();
    assert.equal(runtime.heap.buffer, buffer);
    assert.ok(force[2] > 0.05);
    assert.notDeepEqual(positions, before);
    scene.destroy();
    bundle.close();
  });

  test(`${wasm}: bytes that arrive in pieces are the same bundle`, async () => {
    const pieces = new ReadableStream({
      start(controller) {
        for (let at = 0; at < bytes.length; at += 5000) controller.enqueue(bytes.slice(at, at + 5000));
        controller.close();
      },
    });
    const seen = [];
    const bundle = await runtime.openBundleStream(pieces, 100, (done) => seen.push(done));  // 100 is too small on purpose: the memory must grow
    bundle.check();
    assert.equal(seen.at(-1), bytes.length);
    assert.equal(bundle.info.touchableCount, bundle.touchable.length);
    assert.equal(JSON.parse(bundle.provenance).organ, "box");
    assert.equal(bundle.foundation.length, 0);
    assert.deepEqual([...bundle.young], [5400]);
    assert.deepEqual([bundle.region.length, Math.max(...bundle.region)], [bundle.info.tetrahedronCount, 0]);
    assert.equal(bundle.fixed.reduce((sum, held) => sum + held, 0), 3 * 16);
    bundle.close();
  });

  test(`${wasm}: damaged bytes are refused with a sentence`, () => {
    const status = (damaged) => {
      try {
        runtime.openBundle(damaged).check();
      } catch (error) {
        assert.ok(error.message.length > 20, error.message);
        return error.status;
      }
    };
    assert.equal(status(bytes.slice(0, bytes.length / 2)), "truncated");
    assert.equal(status(new Uint8Array(5000)), "magic");
    const whole = runtime.openBundle(bytes), flipped = bytes.slice();
    flipped[whole.nodes.byteOffset - whole.store.start] ^= 1;  // the last bit of a coordinate
    whole.close();
    assert.equal(status(flipped), "checksum");
  });

  test(`${wasm}: an effect that is none, or that the bundle has nothing for, is refused`, () => {
    const bundle = runtime.openBundle(bytes);
    assert.throws(() => bundle.createScene({ contact: "glue" }), /contact: expected node, triangle, point, patch, found glue/);
    assert.throws(() => bundle.createScene({ force: "response" }), (error) => error.status === "effect");
    bundle.close();
  });
}
