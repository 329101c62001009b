// node module_test.mjs MODULE WRITE_TINY_BUNDLE CUT_BLOCK PYTHON PRECOMPUTE FOLDER WASM...: pose, torque, report, queries, inside and saved states of the JavaScript module,
// on a box of 60 x 48 x 40 mm whose face at x = 0 is held.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdirSync, readFileSync } from "node:fs";
import { test } from "node:test";
import { pathToFileURL } from "node:url";

const [modulePath, writeTinyBundle, cutBlock, python, precompute, folder, ...wasms] = process.argv.slice(2);
const { loadRuntime, PalpateError, STEP_BAD_INPUT, STEP_SURFACE_CROSSES } = await import(pathToFileURL(modulePath));
mkdirSync(folder, { recursive: true });
const file = `${folder}/module.h5`;
execFileSync(writeTinyBundle, [file]);
const bytes = new Uint8Array(readFileSync(file));
// 80 x 50 x 40 mm, all of which may be cut.
execFileSync(python, [cutBlock, precompute, `${folder}/block.h5`], { stdio: "ignore" });
const block = new Uint8Array(readFileSync(`${folder}/block.h5`));

const above = [0.031, 0.024, 0.045], top = 0.04;
/** A tool that comes from above and stays `depth` below the top: its place at each touch. */
const press = (depth, touches) => Array.from({ length: touches }, (_, i) => [above[0], above[1], Math.max(top - depth, above[2] - 1e-4 * i)]);
const near = (found, expected, tolerance, what) =>
  found.forEach((x, d) => assert.ok(Math.abs(x - expected[d]) <= tolerance, `${what}: ${found} against ${expected}`));
const refused = (call, sentence) => assert.throws(call, (error) => error instanceof PalpateError && sentence.test(error.message));

for (const wasm of wasms) {
  const runtime = await loadRuntime(readFileSync(wasm));
  const open = (effects) => {
    const bundle = runtime.openBundle(bytes), scene = bundle.createScene(effects);
    return { bundle, scene, close: () => (scene.destroy(), bundle.close()) };
  };
  const play = (scene, points, tool = {}) => points.map((point) => (scene.setTools([{ ...tool, points: point }]), scene.touch(1e-3)));

  test(`${wasm}: an organ that is turned and moved gives the same forces, turned`, () => {
    const still = open({ collision: "deformed" }), turned = open({ collision: "deformed" });
    turned.scene.setPose({ position: [0.5, -0.2, 0.1], orientation: [Math.SQRT1_2, 0, 0, Math.SQRT1_2] }); // 90 degrees about z
    play(still.scene, press(2e-3, 100));
    play(turned.scene, press(2e-3, 100).map(([x, y, z]) => [0.5 - y, -0.2 + x, 0.1 + z]));
    const [fx, fy, fz] = still.scene.forceRaw(0);
    assert.ok(fz > 0.05);
    near([...turned.scene.forceRaw(0)], [-fy, fx, fz], 1e-9 * fz, "force"); // both solve the same system, apart from rounding of the pose
    refused(() => turned.scene.setPose({ orientation: [2, 0, 0, 0] }), /orientation/);
    refused(() => turned.scene.setPose({ position: [NaN, 0, 0] }), /./);
    assert.throws(() => turned.scene.setPose({ position: [0, 0] }), /position: expected 3 numbers, found 2/);
    still.close(), turned.close();
  });

  test(`${wasm}: a blade cuts a block in two, and its surface stays closed`, () => {
    const bundle = runtime.openBundle(block), effects = { collision: "deformed", contact: "point", cut: true, cutOperations: 1e9 };
    const scene = bundle.createScene({ ...effects, shape: "surface" }), edge = (y) => [-0.01, 0.01, 0.03, 0.05].flatMap((z) => [0.04, y, z]);
    const closed = ({ triangles }) => {
      const edges = new Set();
      for (let t = 0; t < triangles.length; t += 3) for (let v = 0; v < 3; ++v) edges.add(`${triangles[t + v]} ${triangles[t + ((v + 1) % 3)]}`);
      return edges.size === triangles.length && [...edges].every((each) => edges.has(each.split(" ").reverse().join(" ")));
    };
    assert.equal(scene.touch(0.001), 0);
    assert.deepEqual(scene.cutSurface.triangles, Int32Array.from(bundle.triangles));
    assert.ok(scene.cutSurface.isLip.every((lip) => lip === 0));
    const before = scene.cutState, whole = bundle.triangles.length / 3;
    assert.deepEqual([before.faces, before.pieces, before.area, before.isFull], [0, 1, 0, false]);
    for (let step = 0; step <= 60; ++step) {
      scene.setBlade(0, { points: edge(-0.005 + 0.001 * step) });
      assert.equal(scene.touch(0.001), 0);
      assert.ok(closed(scene.cutSurface), `step ${step}`);
    }
    const state = scene.cutState, { triangles, isLip, nodes } = scene.cutSurface, { surfaceNodeCount, hasCut } = bundle.info, own = [...nodes].filter((_, i) => i % 2 === 0);
    const other = runtime.openBundle(bytes);
    assert.deepEqual([hasCut, other.info.hasCut], [true, false]);
    other.close();
    assert.ok(own.length === state.nodes && new Set(own).size === own.length && nodes.every((node) => node < surfaceNodeCount) && own.every((node) => triangles.includes(node)));
    assert.ok(state.surface > before.surface && state.faces > 0 && Math.abs(state.area - 0.05 * 0.04) < 2e-5);
    assert.deepEqual([state.pieces, state.waiting, state.left, state.isFull], [2, 0, 0, false]);
    assert.equal(isLip.reduce((sum, lip) => sum + lip, 0), 2 * state.faces);
    assert.equal(triangles.length / 3, whole + 2 * state.faces);
    assert.equal(scene.shape(), 0);
    assert.ok(triangles.every((node) => Number.isFinite(scene.positions[3 * node])));
    scene.setBlade(0, null);
    scene.removeTissue([0.02, 0.025, 0.04], 0.015, 0.001, 0.002);
    assert.equal(scene.touch(0.001), 0);
    assert.equal(scene.cutState.removed, 0);
    scene.removeTissue([0.02, 0.025, 0.04], 0.015, 0.001, 0.002);
    assert.equal(scene.touch(0.001), 0);
    assert.ok(scene.cutState.removed > 0 && closed(scene.cutSurface));
    scene.destroy();
    bundle.close();
  });

  test(`${wasm}: a blade feels tissue with toughness; what is no blade is refused`, () => {
    const bundle = runtime.openBundle(block), scene = bundle.createScene({ collision: "deformed", contact: "point", cut: true, cutOperations: 1e9 });
    const edge = (y) => [-0.01, 0.01, 0.03, 0.05].flatMap((z) => [0.04, y, z]);
    for (let step = 0; step <= 35; ++step) {
      scene.setBlade(0, { points: edge(-0.005 + 0.001 * step), direction: [0, 1, 0], toughness: 20, friction: 100, width: 0.01 });
      assert.equal(scene.touch(0.001), 0);
    }
    const { force, work, frictionWork, inTissue } = scene.blade(0);
    assert.ok(force[1] < -0.1 && work > 0 && frictionWork > 0 && inTissue > 0, `${force}`);
    assert.equal(scene.blade(4), undefined);
    refused(() => scene.setBlade(4, { points: edge(0) }), /PALPATE_MAX_BLADES/);
    refused(() => scene.setBlade(0, { points: [0, 0, 0] }), /2 to 16 points, found 3/);
    refused(() => scene.setBlade(0, { points: edge(0), direction: [1] }), /direction: expected 3 numbers/);
    refused(() => scene.setBlade(0, { points: edge(0), toughness: 1 }), /./);
    refused(() => scene.removeTissue([0, 0, 0], 0), /./);
    refused(() => bundle.createScene({ collision: "rest", cut: true }), /DEFORMED/);
    scene.destroy();
    bundle.close();
    const plain = open({ collision: "deformed" });
    refused(() => plain.scene.setBlade(0, null), /cut: true/);
    assert.deepEqual([plain.scene.cutState, plain.scene.blade(0)], [undefined, undefined]);
    plain.close();
  });

  test(`${wasm}: an organ with a velocity meets a tool at rest`, () => {
    const { scene, close } = open({ collision: "deformed" });
    scene.setPose({ velocity: [0, 0, 0.1] });
    play(scene, Array.from({ length: 70 }, () => above)); // 7 mm of the organ's motion, of which 5 reach the tool
    assert.ok(scene.forceRaw(0)[2] > 0.05);
    close();
  });

  test(`${wasm}: the torque is the lever times the force`, () => {
    const { scene, close } = open({ collision: "deformed", torqueLimit: Infinity, torqueSlew: Infinity, forceSlew: Infinity });
    const reference = [above[0] - 0.03, above[1], top];
    const points = press(2e-3, 100), end = points.at(-1);
    play(scene, points, { reference });
    const f = scene.forceRaw(0), r = end.map((x, d) => x - reference[d]);
    const cross = [r[1] * f[2] - r[2] * f[1], r[2] * f[0] - r[0] * f[2], r[0] * f[1] - r[1] * f[0]];
    assert.ok(Math.abs(cross[1]) > 1e-3);
    near([...scene.torqueRaw(0)], cross, 1e-9 * Math.hypot(...cross), "raw torque");
    near([...scene.torque(0)], cross, 1e-9 * Math.hypot(...cross), "torque");
    play(scene, points);
    near([...scene.torque(0)], [0, 0, 0], 0, "torque without a reference");
    close();
  });

  test(`${wasm}: the report tells a contact from its begin to its end`, () => {
    const { scene, bundle, close } = open({ collision: "deformed", report: "contacts", contact: "point" });
    const kinds = [];
    let deepest;
    for (const point of [...press(2e-3, 80), above]) {
      scene.setTools([{ id: 7, points: point }]);
      scene.touch(1e-3);
      const { contacts, events, step } = scene.report;
      kinds.push(...events.map(({ kind, toolId, contact }) => ({ kind, toolId, contact, step })));
      if (contacts.length) deepest = contacts[0];
    }
    assert.deepEqual(kinds.map(({ kind, toolId, contact }) => [kind, toolId, contact]), [["begin", 7, 0], ["end", 7, -1]]);
    assert.ok(kinds[0].step > 50 && kinds[0].step < 55, "the tool is at the top after 5 mm of 0.1 mm a touch");
    assert.equal(deepest.toolId, 7);
    assert.equal(deepest.begun, kinds[0].step);
    assert.equal(deepest.state, "sticks");
    near([deepest.depth], [2e-3], 1e-5, "depth");
    near(deepest.place, [above[0], above[1], top - 2e-3], 1e-6, "place"); // floats in the bundle
    near([deepest.barycentric.reduce((sum, w) => sum + w)], [1], 1e-12, "weights");
    assert.ok(deepest.triangle >= 0 && deepest.triangle < bundle.info.triangleCount && deepest.node === -1);
    assert.ok(deepest.force[2] > 0.01 && deepest.normal[2] > 0.9);
    const silent = open({});
    refused(() => silent.scene.report, /report: "contacts"/);
    silent.close(), close();
  });

  test(`${wasm}: rays, nearest points and distances are of the surface at rest and deformed`, () => {
    const { scene, close } = open({ collision: "deformed", contact: "point", queries: "on" });
    const from = [above[0], above[1], 0.1], down = [0, 0, -2];
    near(scene.castRay(from, down).point, [above[0], above[1], top], 1e-8, "at rest");
    assert.equal(scene.castRay(from, [0, 0, 1]), undefined);
    assert.equal(scene.castRay(from, down, { longest: 0.05 }), undefined);
    play(scene, press(2e-3, 100));
    const hit = scene.castRay(from, down);
    near(hit.point, [above[0], above[1], top - 2e-3], 1e-6, "deformed");
    near([hit.distance], [0.062], 1e-6, "distance");
    near(scene.castRay(from, down, { atRest: true }).point, [above[0], above[1], top], 1e-8, "at rest again");
    near([scene.signedDistance(from, { atRest: true }), scene.signedDistance([above[0], above[1], top - 1e-3], { atRest: true })],
      [0.06, -1e-3], 1e-8, "signed distances at rest");
    assert.ok(scene.signedDistance([above[0], above[1], top - 1e-3]) > 0, "the tissue has gone");
    near([scene.closestPoint(from, { atRest: true }).distance], [0.06], 1e-8, "nearest");
    assert.equal(scene.closestPoint(from, { farthest: 0.05 }), undefined);
    refused(() => scene.castRay(from, [0, 0, 0]), /direction that is not zero/);
    assert.throws(() => scene.castRay(from, [0, 0]), /direction: expected 3 numbers, found 2/);
    scene.reset();
    near(scene.castRay(from, down).point, [above[0], above[1], top], 1e-8, "after a reset");
    const without = open({});
    refused(() => without.scene.signedDistance(from), /queries: "on"/);
    without.close(), close();
  });

  test(`${wasm}: a thread pulls, a slack one does not, and a clip may break`, () => {
    const { scene, close } = open({ collision: "off", contact: "point", queries: "on", maxLinks: 3 });
    const place = (point) => (({ triangle, barycentric }) => ({ triangle, barycentric }))(scene.closestPoint(point));
    const ends = [place([0.06, 0.012, 0.02]), place([0.06, 0.036, 0.02])];
    const thread = { kind: "thread", ends, restLength: 0.015, stiffness: 30 };
    scene.setLinks([thread, { kind: "thread", ends, restLength: 0.05, id: 9 }]);
    for (let i = 0; i < 30; ++i) scene.touch(1e-3);
    const [taut, slack] = scene.links;
    assert.deepEqual([taut.condition, slack.condition, slack.id, slack.tension], ["taut", "slack", 9, 0]);
    // The law of the thread, to the accuracy with which its line turns, 1e-4.
    near([taut.tension / (30 * (taut.length - 0.015))], [1], 1e-3, "tension");
    assert.ok(taut.tension > 0.01 && taut.length < 0.024);
    near([Math.hypot(...taut.force)], [taut.tension], 1e-9, "force");
    near([Math.hypot(...taut.ends[1].map((x, d) => x - taut.ends[0][d]))], [taut.length], 1e-9, "length");
    scene.setLinks([{ ...thread, stiffness: 60 }]);
    for (let i = 0; i < 30; ++i) scene.touch(1e-3);
    assert.ok(scene.links[0].tension > taut.tension, "stiffer at run time");
    scene.setLinks([{ kind: "clip", ends: [ends[0], { world: [0.07, 0.012, 0.02] }], breakingForce: 1e-6 }]);
    assert.ok(scene.touch(1e-3) & (1 << 14), "LINK_BROKE");
    assert.equal(scene.links[0].condition, "broken");
    refused(() => scene.setLinks([{ ...thread, kind: "glue" }]), /expected a kind thread, spring, clip, found glue/);
    refused(() => scene.setLinks([{ ...thread, ends: [ends[0]] }]), /expected two ends, found 1/);
    refused(() => scene.setLinks([{ ...thread, stiffness: 0 }]), /a stiffness above 0 N/);
    assert.throws(() => scene.setLinks([thread, thread, thread, thread]), /4 links; the scene was made for 3/);
    assert.equal(scene.links.length, 1, "the scene keeps its links");
    close();
  });

  test(`${wasm}: jaws lift and turn tissue, slip beyond their friction, and open`, () => {
    const { scene, close } = open({ queries: "on", grasps: true, torqueLimit: Infinity, torqueSlew: Infinity, forceSlew: Infinity });
    const at = [0.06, 0.024, 0.02], { triangle, barycentric } = scene.closestPoint(at), place = { triangle, barycentric };
    const hold = (grasp) => {
      scene.setTools([{ id: 5, reference: at, grasp: grasp && { place, position: at, radius: 0.012, ...grasp } }]);
      assert.equal(scene.touch(1e-3), 0);
      return scene.grasp(5);
    };
    near(hold({}).force, [0, 0, 0], 1e-9, "it closes without a force");
    const held = hold({ position: [0.06, 0.024, 0.022], orientation: [Math.cos(0.1), Math.sin(0.1), 0, 0] });
    assert.equal(held.condition, "holds");
    assert.ok(held.force[2] < -0.01 && held.torque[0] < -1e-5, `${held.force}, ${held.torque}`);
    near([...scene.forceRaw(0)], held.force, 1e-9, "force");
    near([...scene.torqueRaw(0)], held.torque, 1e-9, "torque");
    const slipping = hold({ position: [0.06, 0.024, 0.023], friction: 0.5, clampForce: 0.02 });
    assert.equal(slipping.condition, "slips");
    near([slipping.frictionLimit], [0.01], 1e-12, "friction");
    assert.ok(Math.hypot(...slipping.force) <= 0.01 * 1.002 && slipping.slipped > 0, "within 0.1 % of its friction, or below");
    assert.equal(hold(undefined).condition, "open");
    assert.equal(scene.grasp(6), undefined);
    refused(() => hold({ position: [0, 0] }), /position: expected 3 numbers, found 2/);
    close();
  });

  test(`${wasm}: a needle cuts, is held by friction, and comes out`, () => {
    const pierced = `${folder}/module-corridor.h5`;
    execFileSync(writeTinyBundle, [pierced, "corridor"]);
    const bundle = runtime.openBundle(new Uint8Array(readFileSync(pierced)));
    const effects = { queries: "on", needles: true, needlePlaces: 12, forceLimit: Infinity, forceSlew: Infinity };
    const scene = bundle.createScene(effects), entry = [0.06, 0.024, 0.019], { triangle, barycentric } = scene.closestPoint(entry);
    const needle = { place: { triangle, barycentric }, direction: [-1, 0, 0], radius: 5e-4, friction: 1, cuttingForce: 0.02, punctureForce: 0.05 };
    const drive = (from, to) => {
      for (let step = 1; step <= 60; ++step) {
        const tip = [entry[0] - (from + ((to - from) * step) / 60), entry[1], entry[2]];
        scene.setTools([{ id: 5, reference: tip, needle: { ...needle, tip } }]);
        assert.equal(scene.touch(1e-3), 0);
      }
      return scene.needle(5);
    };
    const inside = drive(-2e-3, 0.03);
    assert.equal(inside.condition, "cuts");
    near([inside.tipForce], [0.02], 1e-6, "cutting force");
    assert.equal(inside.slipping, inside.places);
    // 1 N/m times the way in the tissue, but for what is behind the last of its places, 5 mm apart.
    assert.ok(inside.shaftForce <= inside.depth && inside.shaftForce > inside.depth - 5.5e-3, `${inside.shaftForce} of ${inside.depth}`);
    near([...scene.forceRaw(0)], inside.force, 1e-9, "force");
    near([...scene.torqueRaw(0)], inside.torque, 1e-9, "torque");
    const out = drive(0.03, -0.01);
    assert.equal(out.condition, "outside");
    near(out.force, [0, 0, 0], 0, "force outside");
    assert.equal(scene.needle(6), undefined);
    scene.destroy(), bundle.close();
    const without = runtime.openBundle(bytes);
    refused(() => without.createScene(effects), /add a \[\[corridor\]\] to the boundary file/);
    without.close();
  });

  test(`${wasm}: a surface that passes through itself is told, and where`, () => {
    const { scene, bundle, close } = open({ collision: "off", crossings: true, crossingsCalls: 1, crossingsOperations: 1e6 });
    scene.shape();
    assert.equal(scene.crossings(), 0);
    assert.deepEqual(scene.crossed, { checks: 1, pairs: 0, places: [] });
    // A node of the top and one of the bottom, 40 mm below it, are pushed past one another.
    const { nodes, touchable } = bundle, near40 = (z) => touchable.reduce((best, n) => {
      const away = (m) => Math.hypot(nodes[3 * m] - 0.04, nodes[3 * m + 1] - 0.032, nodes[3 * m + 2] - z);
      return away(n) < away(best) ? n : best;
    });
    scene.setTools([{ grips: [{ node: near40(0.04), displacement: [0, 0, -0.03] }, { node: near40(0), displacement: [0, 0, 0.03] }] }]);
    scene.touch(1e-3);
    scene.shape();
    assert.equal(scene.crossings(), STEP_SURFACE_CROSSES);
    const { pairs, places } = scene.crossed;
    assert.ok(pairs > 0 && places.length === Math.min(pairs, 16));
    assert.ok(places.every(({ place, rest, triangle }) => place[2] > 0 && place[2] < 0.04 && rest.length === 2 && rest[0].length === 3 && triangle[0] < triangle[1]));
    close();
    const without = open({});
    assert.ok(!without.scene.hasCrossings);
    refused(() => without.scene.crossings(), /crossings: true/);
    without.close();
  });

  test(`${wasm}: strain, stress and carried points inside are those of the shape`, () => {
    const { scene, bundle, close } = open({ collision: "deformed", shape: "volume", inside: true });
    play(scene, press(2e-3, 100));
    const points = [0.031, 0.024, 0.03, 0.012, 0.03, 0.011, ...bundle.nodes.subarray(0, 3), 0.5, 0, 0];
    const places = scene.locate(points, { farthest: 0.001 });
    assert.deepEqual([places.count, places.missing, places.place(3).tetrahedron], [4, 1, -1]);
    const { tetrahedra, nodes } = bundle, { tetrahedron, weight, distance } = places.place(1);
    near([weight.reduce((sum, w) => sum + w), distance], [1, 0], 1e-12, "weights");
    const corners = [...tetrahedra.subarray(4 * tetrahedron, 4 * tetrahedron + 4)], mix = (of) => [0, 1, 2].map((d) => corners.reduce((sum, n, i) => sum + weight[i] * of[3 * n + d], 0));
    near(mix(nodes), points.slice(3, 6), 1e-12, "the place is at the point");
    assert.equal(scene.insideAt(places), STEP_BAD_INPUT, "there is no field yet");
    scene.shape();
    assert.equal(scene.inside(), 0);
    // The measures follow from the stress, and the stress across from the strain; single precision.
    const { stresses, pressures, vonMises, principal, strains } = scene.field;
    assert.equal(pressures.length, bundle.info.nodeCount);
    const mu = 5400 / (2 * 1.45);
    let most = 0;
    for (let n = 0; n < pressures.length; ++n) {
      const [xx, yy, zz, xy, yz, xz] = stresses.subarray(6 * n, 6 * n + 6), size = Math.hypot(xx, yy, zz, xy, yz, xz);
      near([pressures[n], principal[3 * n] + principal[3 * n + 1] + principal[3 * n + 2]], [-(xx + yy + zz) / 3, xx + yy + zz], 1e-5 * size, "pressure");
      near([vonMises[n]], [Math.sqrt(((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) / 2 + 3 * (xy ** 2 + yz ** 2 + xz ** 2))], 1e-5 * size, "von Mises");
      assert.ok(principal[3 * n] >= principal[3 * n + 1] && principal[3 * n + 1] >= principal[3 * n + 2]);
      near([xy, yz, xz], [...strains.subarray(6 * n + 3, 6 * n + 6)].map((strain) => 2 * mu * strain), 1e-5 * size, "shear");
      most = Math.max(most, Math.abs(strains[6 * n + 2]));
    }
    assert.ok(most > 0.005, `the tissue under the tool is pressed by ${most}`);
    assert.equal(scene.carry(places), STEP_BAD_INPUT, "one place has no tetrahedron");
    places.release();
    const two = scene.locate(points.slice(0, 6));
    assert.equal(scene.insideAt(two) | scene.carry(two), 0);
    near([...two.measures.displacements.subarray(3, 6)], mix(scene.displacements), 1e-9, "displacement");
    near([...two.positions.subarray(3, 6)], mix(scene.positions), 1e-8, "position"); // positions of 5 cm in single precision
    assert.ok(two.measures.pressures[0] > 0, "compressed below the tool");
    assert.equal(two.measures.stresses.length, 12);
    two.release();
    refused(() => scene.locate([0, 0]), /three numbers a point, found 2/);
    refused(() => scene.locate(points, { farthest: -1 }), /farthest distance of 0 or above/);
    close();
    const without = open({ shape: "volume" });
    refused(() => without.scene.inside(), /inside: true/);
    refused(() => without.scene.locate(points), /inside: true/);
    without.close();
    refused(() => open({ inside: true }), /./);
  });

  test(`${wasm}: normals of the drawn triangles point outwards`, () => {
    const { scene, bundle, close } = open({ collision: "deformed" });
    play(scene, press(2e-3, 100));
    scene.shape();
    const normals = scene.normals(), nodes = bundle.nodes;
    assert.equal(normals.length, 3 * bundle.info.surfaceNodeCount);
    for (let v = 0; v < bundle.info.surfaceNodeCount; ++v) {
      const n = normals.subarray(3 * v, 3 * v + 3), outward = [0.03, 0.024, 0.02].map((middle, d) => nodes[3 * v + d] - middle);
      assert.ok(Math.abs(Math.hypot(...n) - 1) < 1e-5 && n[0] * outward[0] + n[1] * outward[1] + n[2] * outward[2] > 0, `vertex ${v}`);
    }
    close();
    const shapeless = open({ shape: "off" });
    refused(() => shapeless.scene.normals(), /shape: off/);
    shapeless.close();
  });

  test(`${wasm}: an organ that deforms largely follows a deep push and comes back`, () => {
    const large = `${folder}/large.h5`;
    execFileSync(writeTinyBundle, [large, "large"]);
    const bundle = runtime.openBundle(new Uint8Array(readFileSync(large))), effects = { collision: "deformed", contact: "point", maxOperations: 1e8 };
    assert.ok(bundle.info.hasLarge);
    const linear = bundle.createScene(effects), scene = bundle.createScene({ ...effects, deformation: "large" });
    for (const each of [linear, scene]) assert.equal(play(each, press(8e-3, 150)).at(-1), 0);
    const [first, second] = [linear, scene].map((each) => each.forceRaw(0)[2]);
    assert.ok(Math.abs(second / first - 1) > 0.02 && Math.abs(second / first - 1) < 0.5, `${second} N, linear ${first} N`);
    assert.equal(scene.shape(), 0);
    assert.ok(Math.min(...scene.displacements) < -6e-3);
    play(scene, Array.from({ length: 30 }, () => above));
    scene.shape();
    assert.ok(Math.max(...scene.displacements.map(Math.abs)) < 1e-6);
    assert.throws(() => bundle.createScene({ ...effects, deformation: "large", force: "response" }), PalpateError);
    // Beside the touch: solved between the touches, to the same force.
    const beside = bundle.createScene({ ...effects, deformation: "large-beside" });
    assert.equal(linear.deform(), -1);
    assert.equal(beside.deform(), 0, "nothing to do before the first touch");
    for (const points of press(8e-3, 150)) {
      play(beside, [points]);
      while (beside.deform() > 0);
    }
    play(beside, [press(8e-3, 150).at(-1)]);
    assert.ok(Math.abs(beside.forceRaw(0)[2] / second - 1) < 0.01, `${beside.forceRaw(0)[2]} N, large ${second} N`);
    linear.destroy(), scene.destroy(), beside.destroy(), bundle.close();
  });

  test(`${wasm}: a saved state goes on with the same bits`, () => {
    const effects = { collision: "deformed", law: "coulomb", relaxation: [{ share: 0.5, time: 0.02 }] };
    const one = open(effects), two = open(effects), points = press(2e-3, 100);
    const dragged = Array.from({ length: 50 }, (_, i) => [above[0] + 1e-4 * i, above[1], top - 2e-3]);
    play(one.scene, points, { friction: 0.3 });
    const state = one.scene.save();
    play(one.scene, dragged, { friction: 0.3 });
    two.scene.restore(state);
    play(two.scene, dragged, { friction: 0.3 });
    assert.ok(one.scene.force(0)[2] > 0.01);
    assert.deepEqual([...two.scene.contactBytes], [...one.scene.contactBytes]);
    const damaged = state.slice();
    damaged[damaged.length >> 1] ^= 1;
    refused(() => two.scene.restore(damaged), /./);
    refused(() => two.scene.restore(new Uint8Array(0)), /./);
    const other = open({ ...effects, law: "sticking" });
    refused(() => other.scene.restore(state), /./);
    one.close(), two.close(), other.close();
  });
}
