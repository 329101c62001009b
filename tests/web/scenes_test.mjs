// node scenes_test.mjs PACKAGE_FOLDER PALPATE_RUN BUNDLE FOLDER (page.mjs): what the pages do with scene files that name rates of their own or
// CSV files, and with each scene of pipelines/. PALPATE_DATA: a data folder; each scene is then played on its bundle, where the folder has it,
// and compared with palpate-run. PALPATE_RUN plays the references.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { existsSync, mkdirSync, readdirSync, readFileSync, writeFileSync } from "node:fs";
import { basename, dirname, resolve } from "node:path";
import { test } from "node:test";
import { bundle, closed, folder, inState, moduleOf, notice, open, packageFolder, palpateRun, ready } from "./page.mjs";
import { playScene, readForces, relativeDifference } from "./reference.mjs";

const pipelines = resolve(packageFolder, "../../pipelines"), data = process.env.PALPATE_DATA;
const inFolders = (name) => readdirSync(pipelines, { recursive: true }).filter((file) => basename(dirname(file)) === name && file.endsWith(".toml")).sort();
const text = (file) => readFileSync(`${pipelines}/${file}`, "utf8");

// Until the scene has been played to its end.
const playedToItsEnd = async (page) => {
  await page.waitForFunction(() => globalThis.palpateViewer.shown.played);
  return page.evaluate(() => [...globalThis.palpateViewer.shown.played]);
};
const give = (page, files) => {
  const named = files.map(([name, content]) => ({ name, mimeType: "application/octet-stream", buffer: Buffer.from(content) }));
  return page.evaluate(() => (globalThis.palpateViewer.played = null)).then(() => page.setInputFiles("#path-file", named));
};

const readers = () => moduleOf('export { readOwn, readWorld } from "./world_reader"; export { readScene } from "./scene_reader"; export { DEFAULT_EFFECTS, DEFAULT_TOOL } from "./effects";');

test("each scene of pipelines/ plays; one of several organs with a blade is refused with the key's name", async () => {
  const { readOwn, readWorld, readScene, DEFAULT_EFFECTS, DEFAULT_TOOL } = await readers(), scenes = inFolders("scenes"), worlds = inFolders("worlds");
  assert.ok(scenes.length >= 20 && worlds.length >= 1, `${scenes.length} scenes, ${worlds.length} of several organs`);
  const files = (of) => (name) => (existsSync(resolve(pipelines, dirname(of), name)) ? readFileSync(resolve(pipelines, dirname(of), name), "utf8") : null);
  const how = {};
  for (const scene of scenes) {
    const own = readOwn(text(scene), "organ", files(scene));
    if (!own) readScene(text(scene), { effects: DEFAULT_EFFECTS, tool: DEFAULT_TOOL });
    how[scene] = own ? `its own ${own.tools.length} tools${own.rates.touch === 1000 ? "" : `, ${own.rates.touch} touches a second`}` : "as a touch of the page";
  }
  for (const world of worlds) how[world] = `${readWorld(text(world), files(world)).organs.length} organs, on the page of several`;
  const cut = readOwn(text("liver/scenes/cut.toml"), "organ", () => null);
  assert.deepEqual([cut.blades.length, cut.organs[0].effects.cut, cut.organs[0].effects.collision], [1, true, "deformed"]);
  const [world] = worlds;
  assert.throws(() => readWorld(`${text(world)}\n[[blade]]\nname = "scalpel"\nedge = [[0, 0, 0], [0, 0, 9]]\n`, files(world)), /the scene has blade, which this page cannot play/);
  console.log(Object.entries(how).map(([scene, played]) => `${scene}: ${played}`).join("\n"));
});

// Of the same box, with what large deformation needs.
const openLarge = async (page) => {
  execFileSync(process.env.WRITE_TINY_BUNDLE, [`${folder}/large.h5`, "large"]);
  await page.setInputFiles("#file", `${folder}/large.h5`);
  await page.waitForFunction(() => globalThis.palpateViewer.info.hasLarge && document.body.dataset.state === "ready");
};
const rows = "# s, then mm\ntime_s,x,y,z\n0,30,25,44\n0.5,30,25,36\n1,30,25,36\n";
const slow = (effects = "", rate = "touch = 50\nshape = 10", more = "") => `name = "slow"
unit = "mm"
bundle = "box.h5"
[effects]
law = "unilateral"
${effects}
[rate]
${rate}
[[tool]]
name = "finger"
points = [[0, 0, 0], [8, 0, 0]]
disc_radius = 4
path_csv = "presses.csv"
${more}`;

test("a scene with a rate of its own and a path in a CSV file plays with the forces of palpate-run, at its own speed", async () => {
  const page = await ready();
  writeFileSync(`${folder}/presses.csv`, rows);
  for (const [name, scene] of Object.entries({ linear: slow(), off: slow('shape = "surface"', "touch = 250\nshape = 10"), beside: slow('deformation = "large-beside"', "touch = 40\ndeform = 16\nshape = 8").replace("box.h5", "large.h5") })) {
    if (name === "beside") await openLarge(page);
    const expected = playScene(palpateRun, folder, `rates-${name}`, scene, 1).forces.flat(2), began = Date.now();
    await give(page, [["slow.toml", scene], ["presses.csv", rows]]);
    const played = await playedToItsEnd(page);
    assert.ok(relativeDifference(played, expected) < 2e-5, `${name}: ${relativeDifference(played, expected)}`);
    assert.ok(Date.now() - began > 900, "it takes the second that it lasts");
  }
  await closed(page);
});

// A plate comes down beside the finger and turns, and the box lies on a ridge.
const ridge = "v 20 0 0\nv 40 0 0\nv 30 0 8\nv 20 50 0\nv 40 50 0\nv 30 50 8\nf 1 4 5 2\nf 1 3 6 4\nf 2 5 6 3\nf 1 2 3\nf 4 6 5\n";
const plates = `name = "plates"
unit = "mm"
bundle = "box.h5"
[effects]
law = "unilateral"
[limits]
obstacle_nodes = 100
[[tool]]
name = "finger"
points = [[0, 0, 0]]
disc_radius = 4
path = [[0, 30, 25, 42], [0.2, 30, 25, 37], [2.5, 30, 25, 37]]
`;
const obstacles = `[[obstacle]]
name = "plate"
kind = "disc"
radius = 14
normal = [0, 0, -1]
friction = 0.3
path = [[0, 45, 30, 43], [0.4, 45, 30, 38]]
turn = [[0, 0, 0, 0], [0.4, 0, 6, 0]]
depth = 8
[[obstacle]]
name = "ridge"
kind = "mesh"
file = "ridge.obj"
position = [10, 0, -7.5]
`;

test("a scene with obstacles plays with the forces of palpate-run, and they are drawn where they are", async () => {
  const page = await ready();
  writeFileSync(`${folder}/ridge.obj`, ridge);
  const forces = (name, scene) => playScene(palpateRun, folder, name, scene, 1).forces.flat(2), expected = forces("plates", plates + obstacles);
  assert.ok(relativeDifference(forces("no-plates", plates), expected) > 0.1, "the finger feels what the plate and the ridge do");
  await give(page, [["plates.toml", plates + obstacles], ["ridge.obj", ridge]]);
  await page.waitForFunction(() => globalThis.palpateViewer.shown.playing > 0.5, undefined, { polling: 50 });
  const drawn = await page.evaluate(() => globalThis.palpateViewer.shown.obstacles.map(({ position }) => [...position]));
  assert.equal(drawn.length, 2);
  assert.ok(Math.abs(drawn[0][2] - 0.038) < 1e-9, `the plate has come down: ${drawn[0]}`);
  if (process.env.PALPATE_PICTURES) await page.screenshot({ path: `${process.env.PALPATE_PICTURES}/obstacles.png` });
  const played = await playedToItsEnd(page);
  assert.ok(relativeDifference(played, expected) < 2e-5, `${relativeDifference(played, expected)}`);
  assert.equal((await page.evaluate(() => globalThis.palpateViewer.shown.obstacles)).length, 0, "they went with the scene");
  for (const [files, pattern] of [
    [[["own.toml", plates + obstacles]], "own.toml: .*obstacle.* 2 file: expected the file ridge.obj with the scene"],
    [[["own.toml", plates + obstacles], ["ridge.obj", "no mesh"]], "own.toml: ridge.obj: expected the triangles of"],
    [[["own.toml", plates + obstacles.replace("radius = 14", "size = [1, 2]")], ["ridge.obj", ridge]], "own.toml: .*obstacle.* 1: expected kind"],
    [[["own.toml", plates + obstacles.replace("depth", "deepness")], ["ridge.obj", ridge]], "own.toml: .*obstacle.* 1 has deepness"],
  ]) {
    await give(page, files);
    await notice(page, pattern);
  }
  await closed(page);
});

test("a scene of hours plays in fast motion, and the page says how fast", async () => {
  const page = await ready(), hours = slow("", "touch = 0.02\nshape = 0.02").replace('path_csv = "presses.csv"', "path = [[0, 30, 25, 44], [4000, 30, 25, 36]]");
  const expected = playScene(palpateRun, folder, "hours", hours, 1).forces.flat(2);
  await give(page, [["hours.toml", hours]]);
  await page.waitForFunction(() => /200 times as fast as in life/.test(document.getElementById("trust").textContent));
  assert.ok(relativeDifference(await playedToItsEnd(page), expected) < 2e-5);
  await closed(page);
});

test("what a scene lacks is said with its name: the CSV file, a wrong row, a rate that cannot be, more touches than are kept", async () => {
  const page = await ready();
  for (const [files, pattern] of [
    [[["own.toml", slow()]], "own.toml: .*1 path_csv: expected the file presses.csv with the scene, found none"],
    [[["own.toml", slow()], ["presses.csv", "0,1,2\n"]], "own.toml: presses.csv: line 1: expected 4 numbers"],
    [[["own.toml", slow("", "touch = 0")], ["presses.csv", rows]], "own.toml: .rate. touch: expected a number of 0.000001 to 1000000 Hz, found 0"],
    [[["own.toml", slow("", "touch = 50\ndeform = 60\nshape = 10")], ["presses.csv", rows]], "own.toml: .rate. deform: expected a number of .* to 50 Hz, found 60"],
    [[["own.toml", slow("", "touch = 50\ndefrom = 10")], ["presses.csv", rows]], "own.toml: .rate. has defrom"],
    [[["own.toml", slow("", "touch = 1000000")], ["presses.csv", rows]], "own.toml: the scene has 1000000 touches, and this page keeps the forces of 600000"],
    [[["own.toml", slow("", "touch = 50", "[[motion]]\nname = 'x'\namounts_csv = 'tide.csv'\n")], ["presses.csv", rows]], "own.toml: .*motion.* 1 amounts_csv: expected the file tide.csv"],
  ]) {
    await give(page, files);
    await notice(page, pattern);
  }
  await closed(page);
});

test("a German page says in German what the engine's thread and the runtime refuse", async () => {
  const page = await open({}, undefined, "?language=de"), german = async (files, pattern) => (await give(page, files), notice(page, pattern));
  await inState(page, "ready");
  const near = (place) => `name = "near"\nunit = "mm"\n[[tool]]\nname = "finger"\npoints = [[0, 0, 0]]\nnear = ${place}\ndepth = [[0, 0], [0.1, 1]]\n`;
  await german([["weit.toml", near("[9000, 0, 0]")]], "weit.toml: .*erwartet eine Stelle nahe bei");
  await german([["fern.toml", near("[20, 25, 40]").replace("[[tool]]", "[effects]\nradial = 'response'\nforce = 'response'\n[[tool]]")]], "fern.toml: (Diesem Tensorbündel fehlen Daten für einen Effekt|Ein Abschnitt des Tensorbündels fehlt).* Auf Englisch: .*needs section");
  for (const [bytes, pattern] of [[Buffer.from("no bundle"), /(endet zu früh|kein Tensorbündel).*Auf Englisch: /], [readFileSync(bundle).fill(7, 200_000, 200_100), /beschädigt.*Auf Englisch: .*checksum/]]) {
    await page.setInputFiles("#file", { name: "kaputt.h5", mimeType: "application/octet-stream", buffer: bytes });
    await inState(page, "error");
    assert.match(await page.textContent("#error-text"), pattern);
    await page.click("#error-back");
    await inState(page, "ready");
  }
  // The engine's thread follows a change of the language.
  await page.selectOption("#language", "en");
  await german([["far.toml", near("[9000, 0, 0]")]], "far.toml: .*expected a place near");
  await closed(page);
});

// On the organs themselves, where they are there: the page's forces and those of palpate-run.
test("the scenes of pipelines/ on their own bundles", { skip: !data }, async () => {
  const notes = [], pages = new Map();
  for (const scene of inFolders("scenes")) {
    const own = /^bundle = "(.*)"/m.exec(text(scene))?.[1], of = own && resolve(pipelines, dirname(scene), own).replace(/^.*\/data\//, `${data}/`).replace("/compression-at-once/", "/compression/");
    if (!of || !existsSync(of)) {
      notes.push(`${scene}: ${of ?? "no bundle named"} is not there`);
      continue;
    }
    if (!pages.has(of)) {
      for (const page of pages.values()) await page.close();
      pages.clear();
      const page = await open({}, undefined, `?bundle=${encodeURIComponent(`data${of.slice(data.length)}`)}`);
      await inState(page, "ready");
      pages.set(of, page);
    }
    const page = pages.get(of), at = `${folder}/shipped`, csv = [...text(scene).matchAll(/_csv = "(.*)"/g)].map(([, name]) => [name, readFileSync(resolve(pipelines, dirname(scene), name))]);
    mkdirSync(at, { recursive: true });
    execFileSync(palpateRun, [`${pipelines}/${scene}`, "--bundle", of, "--quiet", "-o", at], { stdio: "pipe" });
    await give(page, [[basename(scene), text(scene)], ...csv]);
    await page.waitForFunction((name) => globalThis.palpateViewer.shown.played || globalThis.palpateViewer.replayed || document.getElementById("notice").textContent.startsWith(name), basename(scene), { timeout: 300_000 });
    const told = await page.evaluate(() => [...(globalThis.palpateViewer.shown.played ?? [])]), said = await page.textContent("#notice");
    const lines = readFileSync(`${at}/forces.csv`, "utf8"), tools = new Set(lines.trim().split("\n").slice(1).map((line) => line.split(",")[1])).size;
    const expected = readForces(lines, tools).flat(2), difference = told.length === expected.length ? relativeDifference(told, expected) : NaN;
    notes.push(`${scene}: ${told.length ? `forces differ by ${difference.toExponential(1)}` : "played as a touch"} ${said}`);
    await page.evaluate(() => (globalThis.palpateViewer.replayed = null));
  }
  console.log(notes.join("\n"));
});
