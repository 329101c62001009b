// node world_test.mjs MODULE PALPATE_RUN WRITE_TINY_BUNDLE FOLDER WASM...: worlds of several organs and motions in the JavaScript module, on
// boxes of 60 x 50 x 40 mm whose faces at x = 0 are held; against palpate-run.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdirSync, readFileSync } from "node:fs";
import { test } from "node:test";
import { pathToFileURL } from "node:url";
import { boxToolsFor, playScene, positionAt, relativeDifference } from "./reference.mjs";

const [modulePath, palpateRun, writeTinyBundle, folder, ...wasms] = process.argv.slice(2);
const { loadRuntime, PalpateError } = await import(pathToFileURL(modulePath));
mkdirSync(folder, { recursive: true });
execFileSync(writeTinyBundle, [`${folder}/box.h5`]);
execFileSync(writeTinyBundle, [`${folder}/breathing.h5`, "motions"]);
const files = Object.fromEntries(["box", "breathing"].map((name) => [name, new Uint8Array(readFileSync(`${folder}/${name}.h5`))]));

// As runtime_test.mjs has it: the last bits of the C library's functions; shapes are floats.
const tolerance = 1e-5;
// Where organs press one another: a pair begins to press at the place that was found last, which is up to a fiftieth of an edge old. The step in
// which it was found follows from bounds, whose last bits differ.
const pressingTolerance = 5e-4;
const refused = (call, sentence) => assert.throws(call, (error) => error instanceof PalpateError && sentence.test(error.message));
const sum = (vectors) => vectors.reduce((all, vector) => all.map((x, d) => x + vector[d]), [0, 0, 0]);
const bytesOf = (numbers) => Buffer.from(numbers.buffer, numbers.byteOffset, numbers.byteLength);

// A box stands turned on the other one, which its piston moves; a disc presses it from above and slides, a needle presses the one below.
const effects = { collision: "deformed", contact: "patch", law: "unilateral" };
const above = { position: [0, 0.05, 0.0805], orientation: [0, 1, 0, 0] }; // half a turn about x
const tools = [
  { discRadius: 0.008, path: [[0, 0.045, 0.025, 0.0825], [0.1, 0.045, 0.025, 0.0765], [0.2, 0.042, 0.027, 0.0765], [0.25, 0.042, 0.027, 0.084]] },
  { discRadius: 0.003, path: [[0, 0.062, 0.025, 0.021], [0.15, 0.057, 0.025, 0.021], [0.25, 0.057, 0.027, 0.021]] },
];
const breath = { amplitude: 0.002, period: 0.2, mean: 0.001 };
const amount = (time) => breath.mean + breath.amplitude * Math.sin(2 * Math.PI * ((time / breath.period) % 1));
const rows = (path) => `[${path.map((row) => `[${row.join(", ")}]`).join(", ")}]`;
const sceneText = `name = "organs"
unit = "m"
[effects]
law = "unilateral"
[world]
pairs = 60
friction = 0.2
[limits]
displacement = 0.1
[[organ]]
name = "below"
bundle = "breathing.h5"
[[organ]]
name = "above"
bundle = "box.h5"
position = [0, 0.05, 0.0805]
turn = [180, 0, 0]
[[motion]]
name = "piston"
organ = "below"
sine = { amplitude = ${breath.amplitude}, period = ${breath.period}, mean = ${breath.mean} }
${tools.map(({ discRadius, path }, t) => `[[tool]]\nname = "tool ${t}"\npoints = [[0, 0, 0]]\ndisc_radius = ${discRadius}\npath = ${rows(path)}\n`).join("")}`;

for (const wasm of wasms) {
  const runtime = await loadRuntime(readFileSync(wasm));
  const room = { maxTools: 2, maxPoints: 2, maxContactNodes: 200 };
  const makeWorld = (options = { maxPairs: 60, friction: 0.2 }) => {
    const below = runtime.openBundle(files.breathing), box = runtime.openBundle(files.box);
    const world = runtime.createWorld([{ bundle: below, effects: { ...effects, ...room, motions: true } }, { bundle: box, effects: { ...effects, ...room }, pose: above }], options);
    return { world, close: () => (world.destroy(), below.close(), box.close()) };
  };
  const toolsAt = (time) => tools.map(({ discRadius, path }) => ({ discRadius, points: positionAt(path, time) }));
  const step = (world, touch) => {
    world.organs[0].setMotions([amount(touch / 1000), 0, 0, 0]);
    world.setTools(toolsAt(touch / 1000));
    return world.touch(1e-3);
  };

  test(`${wasm}: a world of one organ gives the bits of its scene`, () => {
    const bundle = runtime.openBundle(files.box), all = { ...effects, ...room, law: "coulomb", report: "contacts", queries: "on" };
    const scene = bundle.createScene(all), world = runtime.createWorld([{ bundle, effects: all }]), [organ] = world.organs;
    for (let touch = 0; touch < 250; ++touch) {
      const sent = boxToolsFor({ contact: "patch" }).map(({ path, disc_radius, friction }) => ({ points: positionAt(path, touch / 1000), discRadius: disc_radius ?? 0, friction }));
      scene.setTools(sent);
      world.setTools(sent);
      assert.equal(world.touch(1e-3), scene.touch(1e-3));
      for (const tool of [0, 1]) {
        assert.deepEqual(bytesOf(world.force(tool)), bytesOf(scene.force(tool)), `touch ${touch}`);
        assert.deepEqual(bytesOf(organ.forceRaw(tool)), bytesOf(scene.forceRaw(tool)));
        assert.equal(world.contactCount(tool), scene.contactCount(tool));
      }
      if (touch % 16) continue;
      assert.equal(organ.shape(), scene.shape());
      assert.deepEqual(bytesOf(organ.positions), bytesOf(scene.positions));
      assert.deepEqual(organ.report, scene.report);
      assert.deepEqual(organ.castRay([0.031, 0.024, 0.1], [0, 0, -1]), scene.castRay([0.031, 0.024, 0.1], [0, 0, -1]));
    }
    assert.ok(Math.hypot(...scene.force(1)) > 0.01, "the tools press");
    assert.deepEqual(world.pairs, []);
    world.destroy();
    scene.destroy();
    bundle.close();
  });

  test(`${wasm}: organs that press one another while one breathes: forces and shapes are palpate-run's`, () => {
    const expected = playScene(palpateRun, folder, "organs", sceneText, 2), { world, close } = makeWorld();
    const forces = [], shapes = [[], []];
    let pressed = 0;
    expected.forces.forEach((_, touch) => {
      step(world, touch);
      forces.push(...world.force(0), ...world.force(1));
      pressed = Math.max(pressed, Math.hypot(...world.organStates[0].pressed));
      if (touch < Math.ceil((shapes[0].length * 1000) / 60 - 1e-9)) return;
      world.organs.forEach((organ, k) => (organ.shape(), shapes[k].push(organ.positions.slice())));
    });
    assert.ok(Math.max(...forces.map(Math.abs)) > 0.05, "the tools press");
    assert.ok(pressed > 0.05, `the organs press one another: ${pressed} N`);
    assert.ok(relativeDifference(forces, expected.forces.flat(2)) < pressingTolerance, `forces: ${relativeDifference(forces, expected.forces.flat(2))}`);
    // palpate-run writes the organs where they are in the world.
    const turned = (points) => points.map((x, i) => (i % 3 === 0 ? x : i % 3 === 1 ? 0.05 - x : 0.0805 - x));
    [["below", (points) => points], ["above", turned]].forEach(([name, inWorld], k) => {
      const wanted = expected.shapes(`organ_${name}_`);
      assert.equal(shapes[k].length, wanted.length);
      shapes[k].forEach((shape, i) => assert.ok(relativeDifference(inWorld(shape), wanted[i]) < pressingTolerance, `${name}, shape ${i}`));
      assert.ok(relativeDifference(inWorld(shapes[k][8]), wanted[0]) > 100 * tolerance, `${name} moves`);
    });
    close();
  });

  test(`${wasm}: what organs do to one another is opposite, and the sum of its pairs`, () => {
    const { world, close } = makeWorld();
    for (let touch = 0; touch < 150; ++touch) step(world, touch);
    const [below, top] = world.organStates, { pairs } = world;
    assert.ok(pairs.some(({ force }) => Math.hypot(...force) > 0) && pairs.length <= 60);
    for (const pair of pairs) {
      assert.deepEqual([...pair.organs].sort(), [0, 1]);
      assert.ok(Math.abs(Math.hypot(...pair.normal) - 1) < 1e-9 && pair.pressure >= 0);
    }
    const onBelow = sum(pairs.map(({ organs, force }) => force.map((x) => (organs[0] === 0 ? x : -x))));
    onBelow.forEach((x, d) => {
      assert.ok(Math.abs(x - below.pressed[d]) < 1e-12);
      assert.ok(Math.abs(below.pressed[d] + top.pressed[d]) < 1e-12);
    });
    const onTools = sum([0, 1].map((tool) => [...world.forceRaw(tool)])), onOrgans = sum([below.force, top.force]);
    onTools.forEach((x, d) => assert.ok(Math.abs(x + onOrgans[d]) < 1e-9, "tools and organs press one another"));
    assert.equal(below.nearTools + top.nearTools >= 2, true);
    close();
  });

  test(`${wasm}: a saved world goes on with the same bits; a reset one begins again`, () => {
    const { world, close } = makeWorld(), bytes = () => Buffer.from(world.contactBytes);
    for (let touch = 0; touch < 100; ++touch) step(world, touch);
    const state = world.save(), goOn = () => Array.from({ length: 20 }, (_, i) => (step(world, 100 + i), bytes()));
    const first = goOn();
    world.restore(state);
    // The count of touches is of the world and no state.
    goOn().forEach((found, i) => assert.deepEqual(found, first[i], `touch ${i}`));
    refused(() => world.restore(state.slice(0, 50)), /./);
    world.reset();
    step(world, 0);
    assert.equal(world.contactCount(0), 0);
    close();
  });

  test(`${wasm}: links hold organs together: their laws, opposite forces, breaking, refusals`, () => {
    const bundle = runtime.openBundle(files.box), apart = 0.09;
    // The second box is turned half about z, so that the free faces look at one another.
    const pose = { position: [0.12 + apart, 0.05, 0], orientation: [0, 0, 0, 1] }, linked = { collision: "off", contact: "point", ...room };
    const world = runtime.createWorld([{ bundle, effects: linked }, { bundle, effects: linked, pose }], { maxLinks: 2 });
    const fixed = (triangle) => [0, 1, 2].some((v) => bundle.fixed[3 * bundle.triangles[3 * triangle + v]]);
    const free = Array.from({ length: bundle.triangles.length / 3 }, (_, t) => t).filter((t) => !fixed(t));
    const end = (organ, k) => ({ organ, triangle: free[k], barycentric: [0.2, 0.3, 0.5] });
    const spring = { kind: "spring", ends: [end(0, 3), end(1, 7)], restLength: 0.02, stiffness: 5, id: 4 };
    const thread = { kind: "thread", ends: [end(0, 9), { world: [0.03, 0.02, 0.5] }], restLength: 5 };
    world.setLinks([spring, thread]);
    for (let touch = 0; touch < 50; ++touch) assert.equal(world.touch(1e-3), 0);
    const [taut, slack] = world.links;
    assert.deepEqual([taut.id, taut.condition, slack.condition], [4, "taut", "slack"]);
    assert.ok(taut.tension > 0.05 && Math.abs(taut.tension - 5 * (taut.length - 0.02)) < 1e-6, "its law");
    const line = taut.ends[1].map((x, d) => x - taut.ends[0][d]);
    line.forEach((x, d) => assert.ok(Math.abs(taut.force[d] - (taut.tension * x) / taut.length) < 1e-3 * taut.tension, "along the line, in the world"));
    for (const organ of world.organs) assert.ok((organ.shape(), Math.max(...organ.displacements.map(Math.abs))) > 1e-5, "both organs give way");
    world.setLinks([{ ...spring, stiffness: 10 }, thread]);
    world.touch(1e-3);
    assert.ok(world.links[0].tension > taut.tension, "stiffer at run time");
    world.setLinks([{ kind: "clip", ends: [end(0, 3), end(1, 7)], breakingForce: 1e-6 }]);
    assert.ok(world.touch(1e-3) & (1 << 14), "LINK_BROKE");
    assert.equal(world.links[0].condition, "broken");
    refused(() => world.setLinks([{ ...spring, kind: "glue" }]), /expected a kind thread, spring, clip, found glue/);
    refused(() => world.setLinks([{ ...spring, ends: [end(0, 3), end(5, 7)] }]), /organ/);
    assert.throws(() => world.setLinks([spring, spring, spring]), /3 links; the world was made for 2/);
    assert.equal(world.links.length, 1, "the world keeps its links");
    world.destroy();
    bundle.close();
  });

  test(`${wasm}: a tool presses with a force and tells where it stands`, () => {
    const bundle = runtime.openBundle(files.breathing);
    const scene = bundle.createScene({ collision: "deformed", law: "sticking", forceControl: true });
    for (let step = 0; step < 60; ++step) {
      scene.setTools([{ points: [0.041, 0.026, 0.0405], givenForce: { force: [0, 0, -0.05] } }]);
      scene.touch(0.001);
    }
    const { condition, force, displacement } = scene.givenForce(0);
    assert.equal(condition, "carried");
    assert.ok(Math.abs(force[2] + 0.05) < 1e-6 && displacement[2] < -0.0005);
    assert.equal(scene.givenForce(1), undefined);
    scene.destroy();
  });

  test(`${wasm}: loads of a scene: a weight, a traction, refusals`, () => {
    const bundle = runtime.openBundle(files.breathing), place = { centre: [0.06, 0.025, 0.02], radius: 0.05 };
    const scene = bundle.createScene({ collision: "deformed", loads: [place] });
    scene.setLoad(0, [0, 0, -0.001], { inWorld: true });
    assert.equal(scene.touch(0.001), 0);
    const [state] = scene.loadStates;
    assert.equal(state.force[2], -0.001);
    assert.ok(state.displacement[2] < 0 && Math.abs(state.area - 0.002) < 1e-9);
    scene.setLoad(0, [0, 0, -1], { perArea: true });
    scene.touch(0.001);
    assert.ok(Math.abs(scene.loadStates[0].force[2] + 0.002) < 1e-9);
    refused(() => scene.setLoad(1, [0, 0, 0]), /found load 1/);
    refused(() => bundle.createScene({ collision: "deformed", loads: Array(5).fill(place) }), /at most 4 patches/);
    scene.destroy?.();
  });
  test(`${wasm}: obstacles of a scene: a plate that moves, a mesh, refusals`, () => {
    const bundle = runtime.openBundle(files.box), down = [0, 1, 0, 0];
    const plate = { kind: "rectangle", size: [0.1, 0.09], friction: 0.3, position: [0.03, 0.025, 0.042], orientation: down };
    // A ridge whose edge lies below the box, along y.
    const ridge = {
      kind: "mesh", positions: [0.02, 0, 0, 0.04, 0, 0, 0.03, 0, 0.008, 0.02, 0.05, 0, 0.04, 0.05, 0, 0.03, 0.05, 0.008],
      triangles: [0, 3, 4, 0, 4, 1, 0, 2, 5, 0, 5, 3, 1, 4, 5, 1, 5, 2, 0, 1, 2, 3, 5, 4], position: [0.01, 0, -0.006],
    };
    const scene = bundle.createScene({ collision: "deformed", obstacles: [plate, { kind: "disc", radius: 0.02, position: [1, 0, 0] }, ridge], obstacleNodes: 100 });
    for (let step = 0; step <= 100; ++step) {
      scene.setObstaclePose(0, { position: [0.03, 0.025, 0.042 - 4e-5 * step], orientation: down });
      assert.equal(scene.touch(0.001), 0);
    }
    const [first, second, third] = scene.obstacleStates;
    assert.ok(first.force[2] > 0.1 && first.nodes > 0 && Math.abs(first.position[2] - 0.038) < 1e-12);
    assert.deepEqual(first.orientation, down);
    assert.ok(Math.abs(first.torque[0]) + Math.abs(first.torque[1]) > 0);
    assert.deepEqual([second.nodes, second.force], [0, [0, 0, 0]]);
    assert.ok(third.nodes > 0 && third.force[2] < 0, "the plate presses the box onto the ridge");
    assert.equal(scene.obstacleStates.length, 3);
    refused(() => scene.setObstaclePose(3, {}), /found 3 of 3/);
    const create = (obstacle, more) => bundle.createScene({ collision: "deformed", obstacles: [obstacle], ...more });
    refused(() => create({ kind: "cube" }), /rectangle, disc, mesh/);
    refused(() => create({ kind: "rectangle", size: [1] }), /size: expected 2 numbers/);
    refused(() => create({ kind: "disc", radius: -1 }), /a size above 0/);
    refused(() => create({ kind: "mesh", positions: [0, 0, 0, 1], triangles: [] }), /three numbers a vertex/);
    refused(() => create(plate, { collision: "rest" }), /DEFORMED/);
    scene.destroy();
    bundle.close();
  });
  test(`${wasm}: motions of a scene: amounts, held volumes, refusals`, () => {
    const bundle = runtime.openBundle(files.breathing), scene = bundle.createScene({ collision: "deformed", motions: true });
    assert.deepEqual(bundle.motions, [["piston", "piston"], ["turn", "rotation"], ["filling", "pressure"], ["weight", "gravity"]].map(([name, kind]) => ({ name, kind })));
    const face = () => (scene.shape(), scene.displacements[3 * bundle.fixed.findIndex((held) => held) / 3]);
    scene.setMotions([0.002, 0, 0, 0]);
    scene.touch(1e-3);
    assert.ok(Math.abs(face() - 0.002) < 1e-8, "the held face goes with the piston");
    scene.setMotions([0, 0, 20, 0]);
    for (let touch = 0; touch < 10; ++touch) scene.touch(1e-3);
    const { amount: pressure, volume } = scene.motionStates[2];
    assert.equal(pressure, 20);
    scene.holdVolume(2, 2 * volume);
    for (let touch = 0; touch < 10; ++touch) scene.touch(1e-3);
    assert.ok(Math.abs(scene.motionStates[2].amount - 40) < 1e-6, "twice the volume takes twice the pressure");
    scene.holdVolume(2, null);
    refused(() => scene.setMotions([0, 0]), /setMotions: expected 4 amounts, one for each motion of the bundle, found 2/);
    refused(() => scene.setMotions([NaN, 0, 0, 0]), /./);
    refused(() => scene.holdVolume(0, 1e-6), /./);
    refused(() => bundle.createScene({ collision: "rest", motions: true }), /./);
    scene.destroy();
    bundle.close();
  });

  test(`${wasm}: what belongs to the world is refused of an organ, and what cannot be names the organ`, () => {
    const { world, close } = makeWorld({ maxPairs: 0 }), [organ] = world.organs;
    for (const call of ["setTools", "touch", "save", "destroy"]) refused(() => organ[call]([]), new RegExp(`${call}: expected a scene of its own, found an organ of a world`));
    assert.throws(() => world.setTools(Array(3).fill({})), /3 tools/);
    const bundle = runtime.openBundle(files.box), twice = (more, options) => runtime.createWorld([{ bundle, effects: {} }, { bundle, effects: more }], options);
    refused(() => twice({ maxPoints: 3 }), /organ/);
    refused(() => twice({}, { maxPairs: 10 }), /organ/);
    refused(() => twice({ contact: "glue" }), /contact: expected node/);
    refused(() => runtime.createWorld([]), /organ_count/);
    refused(() => runtime.createWorld([{ bundle, pose: { position: [0, 0] } }]), /position: expected 3 numbers, found 2/);
    const two = twice({}, {}); // two organs of one bundle, which pass through one another
    two.setTools([{ points: [0.031, 0.024, 0.037] }]);
    two.touch(1e-3);
    assert.deepEqual([...two.organs[0].force(0)], [...two.organs[1].force(0)]);
    two.destroy();
    bundle.close();
    close();
  });
}
