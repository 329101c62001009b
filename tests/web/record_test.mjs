// node record_test.mjs PACKAGE_FOLDER PALPATE_RUN BUNDLE FOLDER [RENDER_MESH] (page.mjs): recordings, scene files and links of the viewer:
// what was touched can be saved, played, sent and taken back.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFileSync, writeFileSync } from "node:fs";
import { test } from "node:test";
import { bundle, camera, closed, csv, drag, folder, give, inState, middle, noTools, notice, palpateRun, pathRows, picture, ready, replays, same, saved, shown, steady } from "./page.mjs";
import { largestOf, piercingNeedle, playScene, pressingProbe, readForces, relativeDifference } from "./reference.mjs";

const rowsOf = (text) => text.trim().split("\n").slice(1).map((row) => row.split(",").map(Number));
const largest = (text) => largestOf(readForces(text, 1).flat(2));

// ---- recordings ------------------------------------------------------------------------------------------------------

test("the last touch is saved as it was felt, without a replay; before any, the page says why nothing can be saved", async () => {
  const page = await ready();
  assert.equal(await page.isDisabled("#save-forces"), true);
  assert.match(await page.textContent("#recorded"), /touch the organ/);
  await drag(page, [0, 0], [90, -60]);
  await noTools(page);
  assert.ok(largest(await saved(page, "save-forces")) > 0.05);
  assert.match(await page.textContent("#recorded"), /^The last touch: [\d.]+ s/);
  // A path is played, then the organ is touched elsewhere: the files hold the touch.
  const from = await middle(page), played = csv(pathRows(from, [[0, 0.002], [0.2, -0.004]]));
  await replays(page, () => give(page, "path.csv", played, "#path-file"));
  const start = (text) => (text.startsWith("#") ? JSON.parse(text.match(/path = \[\s*(\[.*?\])/)[1]) : rowsOf(text)[0]).slice(1);
  const distance = (a, b) => Math.hypot(...a.map((x, d) => x - b[d]));
  assert.ok(distance(start(await saved(page, "save-scene")), start(played)) < 1e-9);
  await drag(page, [70, 10], [120, -60]);
  await noTools(page);
  assert.ok(distance(start(await saved(page, "save-scene")), start(played)) > 0.002);
  await closed(page);
});

test("a touch with a tool that stays is saved and replayed, after Reset and after an effect is switched", async () => {
  const page = await ready();
  await page.click("#keep + span");
  await drag(page, [0, 0], [90, -60]);
  const during = largest(await saved(page, "save-forces"));
  assert.ok(during > 0.05);
  await page.click("#reset");
  await noTools(page);
  const felt = await saved(page, "save-forces");
  assert.ok(largest(felt) > 0.05);
  await replays(page, () => page.click("#replay"));
  assert.equal(await saved(page, "save-forces"), felt, "the replay gives the same forces to the last digit");
  await drag(page, [0, 0], [90, -60]);
  await page.selectOption('[data-effect="contact"]', "point");
  await noTools(page);
  assert.ok(largest(await saved(page, "save-forces")) > 0.05);
  await closed(page);
});

test("a saved scene plays in palpate-run to the same bytes as the page saves, and verifies as a record: all tools, pushes and pulls", async () => {
  const page = await ready();
  const plays = async (name) => {
    const files = { forces: await saved(page, "save-forces"), scene: await saved(page, "save-scene") };
    assert.equal(await page.evaluate(() => globalThis.palpateViewer.saved.difference), 0, "the forces are those that were felt");
    writeFileSync(`${folder}/${name}.toml`, files.scene);
    execFileSync(palpateRun, [`${folder}/${name}.toml`, "--bundle", bundle, "--quiet", "-o", `${folder}/${name}`], { stdio: "pipe" });
    assert.ok(files.forces === readFileSync(`${folder}/${name}/forces.csv`, "utf8"), "forces.csv is the same to the byte");
    assert.match(execFileSync(palpateRun, ["--replay", `${folder}/${name}.toml`, "--bundle", bundle], { encoding: "utf8" }), /as recorded/);
    return files;
  };
  // Three pushes of two tools: the third one takes the first tool's place. Then a pull.
  await page.click("#keep + span");
  for (const x of [-60, 60, 0]) await drag(page, [x, 0], [x + 60, -50]);
  await page.click("#keep + span");
  await noTools(page);
  const { scene, forces } = await plays("kept");
  assert.equal(scene.match(/\[\[tool\]\]/g).length, 2);
  assert.ok(largest(forces) > 0.05 && !/[eE]\+?\d{3}/.test(forces));
  await page.click('[value="pull"] + span');
  await page.selectOption('[data-effect="law"]', "coulomb");
  await page.check('[data-effect="relaxation"]');
  await drag(page, [0, 0], [70, -60]);
  await noTools(page);
  const pulled = await plays("pulled");
  assert.match(pulled.scene, /law = "coulomb"[^]*terms = \[\[0.45, 0.5\][^]*hold = true\ndisc_radius = 0.006\nfriction = 0.3/);
  await closed(page);
});

test("large deformation is offered where the bundle has it, changes the force, and leaves the measured curves off", async () => {
  const page = await ready();
  assert.equal(await page.isDisabled('[data-effect="large"]'), true, "the box has no order of elimination");
  execFileSync(process.env.WRITE_TINY_BUNDLE, [`${folder}/large.h5`, "large"]);
  await give(page, "large.h5", readFileSync(`${folder}/large.h5`));
  await page.waitForFunction(() => !document.querySelector('[data-effect="large"]').disabled);
  const path = csv(pathRows(await middle(page), [[0, 0.002], [0.2, -0.008], [0.3, -0.008]])), most = {};
  for (const [choice, deformation] of [["off", "linear"], ["on", "large"], ["beside", "large-beside"], ["renewed", "large-renewed"]]) {
    await page.selectOption('[data-effect="large"]', choice);
    await replays(page, () => give(page, "path.csv", path, "#path-file"));
    const scene = await saved(page, "save-scene"), forces = await saved(page, "save-forces");
    most[choice] = largest(forces);
    assert.match(scene, new RegExp(`deformation = "${deformation}"`));
    writeFileSync(`${folder}/large.toml`, scene);
    execFileSync(palpateRun, [`${folder}/large.toml`, "--bundle", `${folder}/large.h5`, "--quiet", "-o", `${folder}/large`]);
    assert.equal(readFileSync(`${folder}/large/forces.csv`, "utf8"), forces, `${choice}: palpate-run plays it to the same bytes`);
    // The page writes its address a little later.
    if (choice !== "off") await page.waitForFunction((wanted) => location.hash.includes(wanted), `large=${choice}`);
  }
  assert.ok(most.off > 0.05 && Math.abs(most.on / most.off - 1) > 0.01 && Math.abs(most.on / most.off - 1) < 0.5, JSON.stringify(most));
  // A body that is solved beside the touch is 10 ms late at most, so that its largest force is near that of a body solved in each touch.
  for (const choice of ["beside", "renewed"]) assert.ok(Math.abs(most[choice] / most.on - 1) < 0.05, JSON.stringify(most));
  await picture(page, "large");
  await closed(page);
});

test("frames and touches do not wait for the costs of effects; those of large deformation are measured when the page is asked to", async () => {
  const page = await ready();
  execFileSync(process.env.WRITE_TINY_BUNDLE, [`${folder}/large.h5`, "large"]);
  await give(page, "large.h5", readFileSync(`${folder}/large.h5`));
  await page.waitForFunction(() => !document.querySelector('[data-effect="large"]').disabled);
  const cost = (effect) => page.evaluate((name) => document.querySelector(`[data-effect=${name}]`).parentElement.querySelector(".cost").textContent, effect);
  await page.waitForFunction(() => !document.getElementById("measure-control").hidden && !document.getElementById("measuring").textContent);
  assert.match(await cost("contact"), /^\d/);
  assert.equal(await cost("large"), "", "nothing was solved that nobody asked for");
  await page.selectOption('[data-effect="large"]', "on");
  // The three messages wait in this order while the engine measures its first slice, however fast the machine is: the engine answers the
  // frame before it measures on, and the tool ends the measuring.
  const said = await page.evaluate(() => new Promise((done) => {
    const { worker } = globalThis.palpateViewer, { place, normal } = globalThis.palpateViewer.front(), said = [];
    const point = place.map((x, d) => x - 0.002 * normal[d]), start = place.map((x, d) => x + 0.002 * normal[d]);
    worker.addEventListener("message", ({ data: { type, left, interrupted, tools } }) => {
      if (said.length > 0 || left > 0) said.push({ type, left, interrupted });
      if (type === "frame" && tools[0]?.contacts) done(said);
    });
    worker.postMessage({ type: "measure", place, normal, large: true });
    worker.postMessage({ type: "frame", buffer: null });
    worker.postMessage({ type: "tool", index: 0, target: { start, point, grasp: null, down: true } });
  }));
  const interrupted = said.findIndex((one) => one.interrupted);
  assert.ok(interrupted > 0 && said.slice(0, interrupted).some(({ type }) => type === "frame"), JSON.stringify(said));
  assert.ok(said[interrupted - 1].type === "frame" || said[interrupted - 1].left > 0);
  await page.click("#reset");
  await page.click("#measure");
  await page.waitForFunction(() => document.querySelector('[data-effect="large"]').parentElement.querySelector(".cost").textContent);
  await closed(page);
});

// ---- links and scene files ---------------------------------------------------------------------------------------------

test("the address restores effects, disc, colour and camera; Back takes an effect back; a link of another bundle changes nothing", async () => {
  const page = await ready();
  const kept = (part) => page.waitForFunction((text) => location.hash.includes(text), part);
  await page.selectOption('[data-effect="law"]', "sliding");
  await kept("law=sliding");
  await page.fill("#radius", "9");
  await page.selectOption("#colour-by", "displacement");
  await kept("disc=9");
  await page.evaluate(() => globalThis.palpateViewer.view.camera.turn(0.7, 0.2));
  await kept("colour=displacement");
  await page.waitForFunction(() => location.hash.endsWith(globalThis.palpateViewer.view.camera.view.map((x, i) => x.toFixed(i < 2 ? 1 : 4)).join("+")));
  const { direction } = await camera(page);
  await page.reload();
  await inState(page, "ready");
  await page.waitForFunction(() => globalThis.palpateViewer.link);
  assert.equal(await page.inputValue('[data-effect="law"]'), "sliding");
  assert.equal(await page.textContent("#radius-mm"), "9 mm");
  assert.equal(await page.inputValue("#colour-by"), "displacement");
  assert.ok(same((await camera(page)).direction, direction, 0.01));
  await page.check('[data-effect="relaxation"]');
  await kept("relaxation=on");
  await page.goBack();
  await page.waitForFunction(() => !document.querySelector('[data-effect="relaxation"]').checked);
  assert.equal(await page.inputValue('[data-effect="law"]'), "sliding");
  const other = (await page.evaluate(() => location.href)).replace(/bundle=[0-9a-f]{4}/, "bundle=0000").replace("law=sliding", "law=glue");
  await page.goto("about:blank");
  await page.goto(other);
  await inState(page, "ready");
  await notice(page, "another bundle");
  assert.equal(await page.inputValue('[data-effect="law"]'), "sticking");
  await closed(page);
});

test("the address restores tools that stay; Undo takes back tools and effects, one after the other", async () => {
  const page = await ready();
  assert.equal(await page.isDisabled("#undo"), true);
  const kept = (pattern) => page.waitForFunction((p) => new RegExp(p).test(location.hash), pattern);
  await page.click("#keep + span");
  await drag(page, [0, 0], [90, -60]);
  await kept("tool1=[^&]+");
  await steady(page); // the page restores the second tool when the first one has arrived
  // Not so deep that the organ sinks away below the first tool.
  await drag(page, [-60, 0], [-30, -40]);
  await kept("tool2=[^&]+");
  const forces = async () => (await shown(page, "tools")).map((tool) => tool && Math.hypot(...tool.force));
  await steady(page);
  const felt = await forces();
  assert.ok(felt.every((newton) => newton > 0.05));
  await page.reload();
  await inState(page, "ready");
  await page.waitForFunction(() => globalThis.palpateViewer.shown.tools.every((tool) => tool?.depth > 0.002));
  await steady(page);
  assert.equal(await page.isChecked("#keep"), true);
  // The address holds micrometres, and tools come straight where the hand's way was another one.
  (await forces()).forEach((newton, t) => assert.ok(Math.abs(newton - felt[t]) < 0.02 * felt[t], `${newton} N after ${felt[t]} N`));
  await page.selectOption('[data-effect="law"]', "sliding");
  await kept("law=sliding");
  await noTools(page);
  await page.click("#undo");
  await kept("bundle=[0-9a-f]+&disc.*tool1=.*tool2=");
  assert.equal(await page.inputValue('[data-effect="law"]'), "sticking");
  await page.waitForFunction(() => globalThis.palpateViewer.shown.tools.every((tool) => tool?.depth > 0.002));
  await page.keyboard.press("Control+z");
  await page.waitForFunction(() => !/tool2/.test(location.hash) && /tool1/.test(location.hash));
  await page.waitForFunction(() => globalThis.palpateViewer.shown.tools.filter(Boolean).length === 1);
  await page.keyboard.press("z");
  await noTools(page);
  await page.waitForFunction(() => document.getElementById("undo").disabled);
  await closed(page);
});

test("the page plays the scene that it saved, with its effects and disc, to the same bytes; a scene that it cannot play is refused by its key", async () => {
  const page = await ready();
  await page.selectOption('[data-effect="law"]', "coulomb");
  await page.fill("#radius", "4.5");
  await page.click("#keep + span");
  await drag(page, [0, 0], [90, -60]);
  await drag(page, [-60, 0], [0, -50]);
  await page.click("#keep + span");
  await noTools(page);
  const scene = await saved(page, "save-scene"), forces = await saved(page, "save-forces");
  await page.goto("about:blank");
  await page.goBack();
  await page.evaluate(() => (location.hash = ""));
  await page.reload();
  await inState(page, "ready");
  const play = (text, name = "recording.toml") => give(page, name, text, "#path-file");
  await play(scene);
  await page.waitForFunction(() => globalThis.palpateViewer.replayed !== null);
  assert.equal(await page.inputValue('[data-effect="law"]'), "coulomb");
  assert.equal(await page.textContent("#radius-mm"), "4.5 mm");
  assert.ok((await saved(page, "save-forces")) === forces, "the same forces to the byte");
  assert.ok((await saved(page, "save-scene")) === scene, "the same scene to the byte");
  // A scene that was written by hand, in mm; its tool rests at a point beside its path.
  const { place, normal } = await middle(page), row = (time, height) => `[${[time, ...place.map((x, d) => 1000 * (x + height * normal[d]) - (d === 0 ? 1 : 0))].join(", ")}]`;
  const own = `name = "own"\nunit = "mm"\n[effects]\nlaw = "sliding"\n[[tool]]\nname = "probe"\npoints = [[1, 0, 0]]\ndisc_radius = 5\npath = [${row(0, 0.002)}, ${row(0.2, -0.004)}]\n`;
  await replays(page, () => play(own, "own.toml"));
  assert.equal(await page.textContent("#radius-mm"), "5 mm");
  writeFileSync(`${folder}/own.toml`, own);
  execFileSync(palpateRun, [`${folder}/own.toml`, "--bundle", bundle, "--quiet", "-o", `${folder}/own`], { stdio: "pipe" });
  const native = readForces(readFileSync(`${folder}/own/forces.csv`, "utf8"), 1).flat(2), here = readForces(await saved(page, "save-forces"), 1).flat(2);
  assert.equal(here.length, native.length);
  assert.ok(Math.max(...here.map((newton, i) => Math.abs(newton - native[i]))) < 1e-9 * Math.max(...native.map(Math.abs)), "palpate-run's forces");
  for (const [change, pattern] of [
    [(text) => text.replace("points = [[1, 0, 0]]", "capsule = { radius = 4 }"), "own.toml: .*capsule: expected a radius and a length above 0"],
    [(text) => text.replace("points = [[1, 0, 0]]", "points = []"), "own.toml: .*points: expected one point"],
    [(text) => text.replace(/path = .*/, "path_csv = 'way.csv'"), "own.toml: .*1 path_csv: expected the file way.csv with the scene, found none"],
    [(text) => text.replace("disc_radius = 5", "at = 'below'"), "own.toml: .*at: expected one of foremost, .*found .below."],
    [(text) => `${text}[[tool.grip]]\naxes = 'xx'\n`, "own.toml: .*grip 1: expected either nearest or box"],
    [(text) => text.replace('"sliding"', '"slides"'), "own.toml: .effects. law: expected sticking, .*found .slides."],
    [(text) => text.replace('unit = "mm"', ""), "own.toml: unit: expected m, cm, mm or um, found nothing"],
    [(text) => text.replace("disc_radius = 5", "disc_radius = 50"), "own.toml: disc_radius: expected 2 to 12 mm.*found 50 mm"],
    [(text) => `${text}[rate]\ndeform = 0\n`, "own.toml: .rate. deform: expected a number of .* to 1000 Hz, found 0"],
    [(text) => `${text}[limits]\nforces = 1\n`, "own.toml: .limits. has forces, which this page cannot play"],
    [(text) => text.replace("[[tool]]", "[[tool"), "own.toml: line \\d+: this is no TOML"],
    [(text) => `# bundle 0123456789abcdef\n${text}`, "own.toml: recorded on the bundle 0123456789abcdef; open is"],
  ]) {
    assert.notEqual(change(own), own);
    await play(change(own), "own.toml");
    await notice(page, pattern);
  }
  assert.equal(await page.textContent("#radius-mm"), "5 mm", "a refused scene changes nothing");
  await closed(page);
});

// The forces of a scene that the page plays to its end are those of palpate-run.
async function assertPlayed(page, expected) {
  await page.waitForFunction(() => globalThis.palpateViewer.shown.played);
  const difference = relativeDifference(await page.evaluate(() => [...globalThis.palpateViewer.shown.played]), expected);
  assert.ok(difference < 2e-5, `${difference}`);
}

// A rod and forceps that turn, a tool of two points, nodes that are gripped, and a finger on a side of the patient.
const handled = `name = "handled"
unit = "mm"
bundle = "pierced.h5"
[effects]
law = "unilateral"
[limits]
displacement = 0.1
[[tool]]
name = "rod"
capsule = { radius = 3, length = 20, axis = [1, 0, 0], samples = 24 }
path = [[0, 10, 25, 45], [0.1, 10, 25, 41], [0.2, 12, 25, 41]]
turn = [[0, 0, 0, 0], [0.1, 0, 0, 0], [0.2, 0, 5, 30]]
[[tool]]
name = "fork"
points = [[-4, 0, 0], [4, 0, 0]]
path = [[0, 45, 10, 45], [0.15, 45, 10, 38], [0.2, 45, 10, 38]]
[[tool]]
name = "forceps"
path = [[0, 45, 40, 42], [0.2, 45, 38, 45]]
turn = [[0, 0, 0, 0], [0.2, 20, 0, 0]]
[tool.grasp]
near = [45, 40, 40]
radius = 6
[[tool]]
name = "held"
path = [[0, 0, 0, 0], [0.2, 1, 0, 2]]
[[tool.grip]]
nearest = [20, 45, 40]
axes = "xz"
[[tool.grip]]
box = { min = [8, 49, 38], max = [12, 51, 42] }
[[tool]]
name = "finger"
points = [[0, 0, 0]]
at = "uppermost"
depth = [[0, -1], [0.2, 3]]
`;

test("rods, forks, turned forceps, grips and a finger on a side play to the forces of palpate-run", async () => {
  execFileSync(process.env.WRITE_TINY_BUNDLE, [`${folder}/pierced.h5`, "corridor"]);
  const expected = playScene(palpateRun, folder, "handled", handled, 5).forces, page = await ready();
  for (let tool = 0; tool < 5; ++tool) assert.ok(expected.some((step) => Math.hypot(...step[tool]) > 0.01), `tool ${tool} is felt`);
  await give(page, "pierced.h5", readFileSync(`${folder}/pierced.h5`));
  await inState(page, "ready");
  await give(page, "handled.toml", handled, "#path-file");
  await assertPlayed(page, expected.flat(2));
  await closed(page);
});

// A needle goes to the end of its corridor and comes out, while a thread is drawn tight and a probe is placed by `near`.
const piercing = `name = "piercing"
unit = "mm"
bundle = "pierced.h5"
[effects]
law = "unilateral"
[limits]
displacement = 0.1
needle_places = 12
${piercingNeedle()}${pressingProbe()}[[link]]
name = "suture"
kind = "thread"
places = [[40, 10, 40], [50, 25, 40], [40, 40, 40]]
rest_lengths = [[0, 40], [0.2, 20]]
`;

test("a scene with a needle, a link and a placed tool plays to the forces of palpate-run; the organ is translucent, and the page tells where the needle is", async () => {
  execFileSync(process.env.WRITE_TINY_BUNDLE, [`${folder}/pierced.h5`, "corridor"]);
  const expected = playScene(palpateRun, folder, "piercing", piercing, 2).forces.flat(2), page = await ready();
  await give(page, "piercing.toml", piercing, "#path-file");
  await notice(page, "add a \\[\\[corridor\\]\\] to the boundary file"); // the box that is open has none
  await give(page, "pierced.h5", readFileSync(`${folder}/pierced.h5`));
  await page.waitForFunction(() => document.body.dataset.state === "ready" && !document.getElementById("notice").textContent.includes("corridor") && globalThis.palpateViewer.shown.positions);
  await page.evaluate(() => {
    globalThis.told = new Set();
    globalThis.deepest = globalThis.clear = globalThis.links = 0;
    new MutationObserver(() => {
      const { shown, view } = globalThis.palpateViewer;
      for (const words of document.getElementById("trust").textContent.split(" · ")) globalThis.told.add(words.replace(/[\d.]+ (mm|N|s)/, "# $1"));
      globalThis.deepest = Math.max(globalThis.deepest, Number(document.getElementById("depth").textContent));
      globalThis.clear += shown.tools[0]?.body?.kind === "needle" && view.surface.material.transparent ? 1 : 0;
      globalThis.links = Math.max(globalThis.links, shown.links.length);
    }).observe(document.getElementById("trust"), { childList: true });
  });
  for (const again of [false, true]) {
    if (again) await page.click("#replay"); // Replay plays the scene again
    else await give(page, "piercing.toml", piercing, "#path-file");
    await assertPlayed(page, expected);
    await page.waitForFunction(() => globalThis.palpateViewer.shown.playing === null);
  }
  const { told, deepest, clear, links } = await page.evaluate(() => ({ told: [...globalThis.told], deepest: globalThis.deepest, clear: globalThis.clear, links: globalThis.links }));
  for (const words of [/^needle: outside$/, /^needle: (cuts, )?# mm in the tissue$/, /^needle: at the end of the corridor, # mm in the tissue$/, /^suture: taut, # N$/])
    assert.ok(told.some((one) => words.test(one)), `${words} of ${told}`);
  assert.ok(deepest > 40 && clear > 0 && links === 2, `${deepest} mm, ${clear} frames, ${links} stretches`);
  // Then the pointer touches as before.
  await page.waitForFunction(() => !globalThis.palpateViewer.view.surface.material.transparent);
  await drag(page, [0, 0], [60, -60]);
  await noTools(page);
  await closed(page);
});
