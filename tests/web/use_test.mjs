// node use_test.mjs PACKAGE_FOLDER PALPATE_RUN BUNDLE FOLDER [RENDER_MESH] (page.mjs): what users of the viewer ran into: numbers of two
// tools in one line, files that were refused without a reason, a camera inside the organ.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { boxSurface, camera, closed, csv, drag, folder, frame, give, inState, middle, noTools, notice, ofFine, open, pathRows, picture, ready, renderMesh, same, shown, steady } from "./page.mjs";

// ---- numbers ---------------------------------------------------------------------------------------------------------

test("each tool has its own force and depth; its headline, label, arrow and curve share a number and a colour", async () => {
  const page = await ready({ deviceScaleFactor: 1 }); // the plot's lines are as thin as its pixels
  await page.click("#keep + span");
  await drag(page, [-50, 0], [60, -60]);
  await drag(page, [60, 10], [85, 0]);
  await steady(page);
  const said = await page.evaluate(() => {
    const { shown, view } = globalThis.palpateViewer, colour = (element) => getComputedStyle(element).color;
    return [...document.querySelectorAll("#readout .tool")].map((row, t) => ({
      force: Number(row.querySelector(".newtons").textContent), depth: Number(row.querySelector(".depth").textContent), number: row.querySelector(".number dd").textContent,
      label: document.getElementById("labels").children[t].textContent, arrow: `#${view.tools[t].ink.color.getHexString()}`,
      colours: [colour(row.querySelector(".newtons")), colour(document.getElementById("labels").children[t])], tool: shown.tools[t],
    }));
  });
  assert.equal(said.length, 2);
  const hex = (rgb) => `#${rgb.match(/\d+/g).slice(0, 3).map((x) => Number(x).toString(16).padStart(2, "0")).join("")}`;
  said.forEach(({ force, depth, number, label, arrow, colours, tool }, t) => {
    assert.ok(Math.abs(force - Math.hypot(...tool.force)) < 0.006, "the force is this tool's");
    assert.ok(Math.abs(depth - 1000 * tool.depth) < 0.06, "the depth is this tool's");
    assert.equal(number, String(t + 1));
    assert.match(label, new RegExp(`^${t + 1}: ${force.toFixed(2)} N$`));
    assert.equal(colours[0], colours[1]);
    assert.equal(arrow, hex(colours[0]));
  });
  const drawn = await page.evaluate(() => {
    const plot = document.getElementById("plot"), { data } = plot.getContext("2d").getImageData(0, 0, plot.width, plot.height), found = new Set();
    for (let i = 0; i < data.length; i += 4) if (data[i + 3] === 255) found.add(`#${[...data.subarray(i, i + 3)].map((x) => x.toString(16).padStart(2, "0")).join("")}`);
    return [...found];
  });
  for (const { arrow } of said) assert.ok(drawn.includes(arrow), `the plot has a line in ${arrow}`);
  assert.notEqual(said[0].colours[0], said[1].colours[0]);
  assert.notEqual(said[0].force, said[1].force);
  await picture(page, "two-tools-numbered");
  await closed(page);
});

test("the plot keeps two touches of one tool apart, and a long touch keeps its beginning", async () => {
  const page = await ready();
  await page.click("#keep + span");
  for (const x of [-60, 60, 0]) await drag(page, [x, 0], [x + 60, -50]);
  await page.waitForFunction(() => globalThis.palpateViewer.shown.curves[0].length === 2);
  const curves = await shown(page, "curves");
  for (const curve of curves.flat()) assert.equal(new Set(curve.map((sample) => sample.contact)).size, 1);
  await page.click("#reset");
  const long = await page.evaluate(() => {
    const { plot } = globalThis.palpateViewer, steps = Array.from({ length: 100_000 }, (_, i) => i);
    plot.clear();
    for (const i of steps) plot.add([{ tool: 0, contact: 1, depth: 1e-7 * i, force: 1e-6 * i }]);
    return globalThis.palpateViewer.shown.curves[0][0].map((sample) => sample.depth);
  });
  assert.equal(long[0], 0);
  assert.ok(long.at(-1) > 0.0099 && long.length > 1000 && long.length < 10_000);
  await closed(page);
});

test("times have a median and a spread, the touch rate is measured, and a push beyond what linear elasticity is good for is marked", async () => {
  const page = await ready();
  assert.equal(await page.textContent("#touch-rate"), "at rest");
  const limit = Number((await page.textContent("#trust")).match(/^Good up to ([\d.]+) mm of depth/)[1]);
  assert.ok(limit > 1 && limit <= 10);
  const beyond = () => page.evaluate(() => document.getElementById("trust").classList.contains("beyond"));
  await page.click("#keep + span");
  await drag(page, [0, 0], [150, -60]);
  await page.waitForFunction((mm) => Number(document.getElementById("depth").textContent) > mm, limit);
  // Read in the page itself: a slow machine shows "at rest" again before a second question arrives.
  const rate = await page.waitForFunction(() => /^(\d+) Hz$/.exec(document.getElementById("touch-rate").textContent)?.[1]);
  assert.equal(await beyond(), true);
  const hertz = Number(await rate.jsonValue());
  assert.ok(hertz > 50 && hertz < 1200, `${hertz} Hz`);
  const [low, high] = (await page.textContent("#touch-us-spread")).split(" to ").map(Number), median = Number(await page.textContent("#touch-us"));
  assert.ok(low > 0 && low <= median && median <= high);
  await page.click("#reset");
  await noTools(page);
  await frame(page);
  assert.equal(await beyond(), false);
  await closed(page);
});

test("a section cuts the organ open: its area is that of the box, follows the plane and the press, and asks for the interior", async () => {
  const page = await ready();
  const section = () => page.evaluate(() => globalThis.palpateViewer.shown.section);
  assert.equal(await section(), 0);
  assert.equal(await page.evaluate(() => globalThis.palpateViewer.shown.inside), 0, "nothing is computed for a section that nobody asks for");
  const extent = await page.evaluate(() => {
    const at = globalThis.palpateViewer.shown.positions, range = (d) => {
      const along = at.filter((_, i) => i % 3 === d);
      return Math.max(...along) - Math.min(...along);
    };
    return [0, 1, 2].map(range);
  });
  for (const [d, axis] of ["x", "y", "z"].entries()) {
    await page.selectOption("#section", axis);
    const exact = extent[0] * extent[1] * extent[2] / extent[d];
    for (const place of ["20", "50", "73"]) {
      await page.fill("#section-at", place);
      await page.waitForFunction(() => globalThis.palpateViewer.shown.section > 0);
      assert.ok(Math.abs((await section()) / exact - 1) < 1e-4, `${axis} at ${place}: ${await section()} m^2, the box has ${exact}`); // single precision
    }
  }
  assert.equal(await page.isChecked('[data-effect="interior"]'), true);
  await page.selectOption("#section", "none");
  await page.waitForFunction(() => globalThis.palpateViewer.shown.section === 0);
  await page.click("#keep + span");
  await drag(page, [0, 0], [60, -60]);
  await page.selectOption("#section", "z");
  await page.fill("#section-at", "50");
  await page.waitForFunction((rest) => Math.abs(globalThis.palpateViewer.shown.section / rest - 1) > 1e-3, extent[0] * extent[1]);
  await page.uncheck('[data-effect="interior"]');
  await page.waitForFunction(() => globalThis.palpateViewer.shown.section === 0);
  await closed(page);
});

test("a section shows a field: its values are those of the tissue, its legend has a unit, the engine computes it only while the list asks", async () => {
  const page = await ready();
  const inside = () => page.evaluate(() => globalThis.palpateViewer.accepted.effects.inside);
  const field = (of) => page.waitForFunction((name) => (globalThis.palpateViewer.shown.field?.of ?? "none") === name, of);
  const legend = () => page.evaluate(() => ["field-name", "field-most", "field-middle", "field-least"].map((id) => document.getElementById(id).textContent));
  assert.equal(await page.isVisible("#section-field"), false, "a field needs a section");
  assert.equal(await page.isVisible("#section-absent"), false);
  await page.click("#keep + span");
  await drag(page, [0, 0], [60, -60]);
  await steady(page);
  await page.selectOption("#section", "z");
  await page.waitForFunction(() => globalThis.palpateViewer.shown.section > 0);
  assert.equal(await inside(), false);
  await field("none");
  assert.equal(await page.isVisible("#field-legend"), false);
  await page.focus("#section-field"); // by keys
  await page.keyboard.press("ArrowDown");
  await field("displacement");
  assert.equal(await inside(), false, "displacements are those of the shape");
  await steady(page);
  const moved = await page.evaluate(() => {
    const { field: { values }, positions, inside: inner } = globalThis.palpateViewer.shown, rest = globalThis.palpateViewer.mesh.positions;
    const exact = rest.map((x, i) => positions[i] - x), lengths = Array.from({ length: rest.length / 3 }, (_, n) => Math.hypot(...exact.slice(3 * n, 3 * n + 3)));
    return { nodes: values.length === rest.length / 3 + inner, far: Math.max(...lengths.map((length, n) => Math.abs(length - values[n]))), most: Math.max(...lengths) };
  });
  assert.ok(moved.nodes && moved.most > 0.002);
  assert.ok(moved.far < 2e-8, `${moved.far} m: positions of some centimetres are single numbers`);
  await page.waitForFunction(() => document.getElementById("field-least").textContent === "0 mm");
  assert.equal((await legend())[0], "Motion inside");
  await page.selectOption("#section-field", "von-mises");
  await field("von-mises");
  assert.equal(await inside(), true);
  await steady(page);
  assert.equal(await page.evaluate(() => globalThis.palpateViewer.shown.tools.filter(Boolean).length), 1, "the tool that was kept is there again");
  const stress = await page.evaluate(() => [...globalThis.palpateViewer.shown.field.values]);
  assert.ok(Math.max(...stress) > 100 && Math.min(...stress) >= 0, `${Math.max(...stress)} Pa under a push of 2 mm and more into 5.4 kPa`);
  await page.waitForFunction(() => /^0 k?Pa$/.test(document.getElementById("field-least").textContent));
  // The cut's colours are those of the legend: the brightest one is at the largest value on the cut.
  const cut = await page.evaluate(() => {
    const { section } = globalThis.palpateViewer.view, colours = section.cut.geometry.getAttribute("color").array;
    return { most: section.most, kinds: new Set([...colours].map((c) => c.toFixed(3))).size, lit: section.cut.material.type };
  });
  assert.ok(cut.most <= 2.5 * Math.max(...stress) && cut.kinds > 20);
  assert.equal(cut.lit, "MeshBasicMaterial");
  await page.selectOption("#section-field", "pressure");
  await field("pressure");
  await steady(page);
  const pressure = await page.evaluate(() => [...globalThis.palpateViewer.shown.field.values]);
  assert.ok(Math.max(...pressure) > 50, "compressed under the tool");
  await page.waitForFunction(() => document.getElementById("field-middle").textContent === "0");
  const [name, high, , low] = await legend();
  assert.equal(name, "Pressure");
  assert.equal(low.replace(/ k?Pa$/, ""), `-${high}`);
  await page.selectOption("#section", "none");
  await page.waitForFunction(() => globalThis.palpateViewer.accepted.effects.inside === false);
  await field("none");
  assert.equal(await page.isVisible("#field-legend"), false);
  await page.selectOption("#section", "x"); // the list has kept its choice
  await field("pressure");
  await page.click("#reset");
  await noTools(page);
  await page.waitForFunction(() => globalThis.palpateViewer.shown.field.values.every((value) => Math.abs(value) < 1e-3));
  await closed(page);
});

test("a soft support is shown where the bundle has one", async () => {
  const page = await ready();
  const soft = /softly/.test(await page.textContent("#facts")), triangles = await page.evaluate(() => globalThis.palpateViewer.mesh.soft.length);
  assert.equal(triangles > 0, soft);
  assert.equal(await page.isEnabled("#show-soft"), soft);
  if (soft) {
    await page.check("#show-soft");
    await picture(page, "soft-support");
    assert.equal(await page.evaluate(() => globalThis.palpateViewer.view.soft.visible && globalThis.palpateViewer.view.soft.geometry.getIndex().count), 3 * triangles);
  }
  await closed(page);
});

test("the colour shows the dent at the tool, and hardly the parts that move as a whole", ofFine, async () => {
  const page = await ready();
  await page.click("#keep + span");
  await drag(page, [0, 0], [120, -60]);
  await steady(page);
  const drawnNow = async (by) => {
    await page.selectOption("#colour-by", by);
    await steady(page);
    return page.evaluate(() => {
      const { fine, tools } = globalThis.palpateViewer.shown;
      return { positions: [...fine.positions], lengths: [...fine.lengths], point: tools[0].point };
    });
  };
  const { positions, lengths: dents, point } = await drawnNow("dent"), { lengths: moves } = await drawnNow("displacement");
  const away = moves.map((_, v) => Math.hypot(...point.map((x, d) => positions[3 * v + d] - x)));
  const mean = (lengths, chosen) => chosen.reduce((sum, v) => sum + lengths[v], 0) / chosen.length;
  const far = [...away.keys()].filter((v) => away[v] > 0.03), deepest = dents.indexOf(Math.max(...dents));
  assert.ok(away[deepest] < 0.015, `the deepest dent is ${away[deepest]} m from the tool`);
  assert.ok(mean(dents, far) < 0.3 * mean(moves, far), `far away: ${mean(dents, far)} m of ${mean(moves, far)} m`);
  assert.match(await page.textContent("#legend-name"), /Motion/);
  await closed(page);
});

test("the drawn surface meets the drawn tool within 0.2 mm, and stands away from it where the dent is switched off", ofFine, async () => {
  const page = await open({}, undefined, "?quality=high");
  await inState(page, "ready");
  await page.click("#keep + span");
  await drag(page, [0, 0], [90, -40]);
  await steady(page);
  // The farthest vertex under the disc's inner half from the disc's plane, m. On the same side of the box, whose edges are sharp.
  const farthest = () => page.evaluate(() => {
    const { shown: { fine, tools }, tool: { discRadius } } = globalThis.palpateViewer, { point, normal } = tools[0], plane = globalThis.discPlane ??= normal;
    let most = 0, count = 0;
    for (let v = 0; v < fine.positions.length; v += 3) {
      const from = point.map((x, d) => fine.positions[v + d] - x), height = from.reduce((sum, x, d) => sum + x * plane[d], 0);
      const facing = plane.reduce((sum, x, d) => sum + x * fine.normals[v + d], 0);
      if (facing < 0.8 || Math.hypot(...from.map((x, d) => x - height * plane[d])) > 0.5 * discRadius || Math.abs(height) > 0.015) continue;
      [most, count] = [Math.max(most, Math.abs(height)), count + 1];
    }
    return { most, count };
  });
  const dented = await farthest();
  assert.ok(dented.count > 3 && dented.most < 2e-4, JSON.stringify(dented));
  await page.uncheck('[data-effect="dent"]');
  await noTools(page); // the new scene is there: a press before that would go with the old one
  await drag(page, [0, 0], [90, -40]);
  await steady(page);
  const flat = await farthest();
  assert.ok(flat.most > 1e-3, JSON.stringify(flat));
  await closed(page);
});

test("the scale of the dent stays while a press deepens, and the dent is seen against the outline at rest", async () => {
  const page = await ready(), scale = () => page.textContent("#most"), before = await scale();
  const outline = () => page.evaluate(() => globalThis.palpateViewer.view.outline.visible);
  assert.equal(before, "5", "a tenth of the 40 mm of the box, rounded up");
  assert.equal(await outline(), false);
  await page.click("#keep + span");
  for (const far of [20, 200]) {
    await drag(page, [0, 0], [far, 0]);
    await steady(page);
    assert.equal(await scale(), before);
    assert.equal(await outline(), true);
    await page.click("#reset");
    await noTools(page);
  }
  await page.selectOption("#colour-by", "displacement");
  await page.waitForFunction(() => document.getElementById("most").textContent === "10");
  await page.waitForFunction(() => !globalThis.palpateViewer.view.outline.visible);
  await closed(page);
});

test("tools meet the organ where it is drawn: a second tool beside a deep one begins without force", async () => {
  const page = await ready();
  assert.equal(await page.isChecked('[data-effect="follow"]'), true);
  await page.click("#keep + span");
  await drag(page, [0, 0], [180, -60]);
  await steady(page);
  await drag(page, [14, 8], [70, -16]); // twice as far it would lose its contact
  const [[ofFirst], [[one, two]]] = await shown(page, "curves");
  const most = Math.max(...ofFirst.map((sample) => sample.force));
  // The page is told some places of a press, the first one at any depth: the line through two of them tells the force where it began.
  const began = one.force - (two.force - one.force) / (two.depth - one.depth) * one.depth;
  assert.ok(one.depth < 2e-3 && Math.abs(began) < 0.05 * most, `${began} N, ${one.force} N at ${one.depth} m, beside ${most} N`);
  await closed(page);
});

// ---- files -----------------------------------------------------------------------------------------------------------

const drawn = (page) => page.evaluate(() => globalThis.palpateViewer.shown.fine?.positions.length ?? 0);

test("a finer surface that is refused leaves the one that is drawn, and the reason names the file's own vertex and unit", ofFine, async () => {
  const page = await ready();
  await page.waitForFunction(() => globalThis.palpateViewer.shown.fine);
  const before = await drawn(page), good = readFileSync(renderMesh);
  await page.selectOption('[data-effect="law"]', "sliding");
  const refused = async (name, content, pattern) => {
    await give(page, name, content);
    await notice(page, pattern);
    await frame(page);
    assert.equal(await drawn(page), before);
    assert.equal(await page.isChecked('[data-effect="fine"]'), true);
    assert.equal(await page.inputValue('[data-effect="law"]'), "sliding");
  };
  await refused("away.ply", boxSurface([60, 50, 40], 2, 1000), "away.ply.*vertex \\d+ \\(10?[0-9]+, [-\\d., ]+ mm\\).*another organ");
  await picture(page, "refused-surface");
  const apart = await page.evaluate(() => {
    const box = (id) => document.getElementById(id).getBoundingClientRect(), said = box("notice");
    const meets = ({ left, right, top, bottom }) => left < said.right && said.left < right && top < said.bottom && said.top < bottom;
    return !meets(box("name")) && !meets(box("facts")) && !meets(box("readout"));
  });
  assert.ok(apart, "the reason covers no other text");
  // Of another body: twice as thick.
  await refused("other.ply", boxSurface([60, 50, 400], 6), "other.ply.*another organ");
  for (const part of [0.3, 0.7, 0.97]) await refused("cut.ply", good.subarray(0, Math.floor(part * good.length)), "cut.ply.*(ends before|no number)");
  await refused("binary.ply", binaryCut(), "binary.ply.*ends before");
  await closed(page);
});

// A binary PLY file that ends in its second face.
function binaryCut() {
  const head = "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 4\n" +
    "property list uchar int vertex_indices\nend_header\n";
  return Buffer.concat([Buffer.from(head), Buffer.alloc(4 * 12 + 13 + 5, 1)]);
}

test("a path in mm, one far away and one that never meets the organ are named", async () => {
  const page = await ready();
  const from = await middle(page), play = (text) => give(page, "path.csv", text, "#path-file");
  const rows = pathRows(from, [[0, 0.002], [0.2, -0.004]]);
  await play(csv(rows.map(([time, ...x]) => [time, ...x.map((m) => 1000 * m + 3000)])));
  await notice(page, "path.csv: expected a path in metres.*away");
  await play(csv(rows.map(([time, ...x]) => [time, ...x.map((m) => 1000 * m)])));
  await notice(page, "path.csv.*fit in mm");
  await play(csv(pathRows(from, [[0, 0.02], [0.3, 0.01]])));
  await notice(page, "never met the organ.*within [\\d.]+ mm");
  await closed(page);
});

test("a scene that never meets the organ, and one that is refused, are named by their files", async () => {
  const page = await ready(), scene = (more) => `name = "away"\nunit = "mm"\n[effects]\ncontact = "point"\n[limits]\nforce = 10\n[[tool]]\npoints = [[0, 0, 0]]\npath = [[0, 900, 900, 900], [0.3, 900, 900, 800]]\n${more}`;
  await give(page, "away.toml", scene(""), "#path-file");
  await notice(page, "away\\.toml: no tool of this scene felt the organ");
  await give(page, "wrong.toml", scene('law = "coulomb"\n'), "#path-file");
  await notice(page, "^wrong\\.toml: .*law");
  await give(page, "links.toml", scene('[[link]]\nname = "l"\nkind = "thread"\nplaces = [[0, 0, 0], [900, 900, 900]]\nrest_length = -1\n'), "#path-file");
  await notice(page, "^links\\.toml: ");
  await closed(page);
});

test("a bundle that does not come is told with the cause, not as a server without organs", async () => {
  for (const [answer, cause] of [[(route) => route.abort("connectionreset"), "Failed to fetch"], [(route) => route.fulfill({ status: 503, body: "" }), "503"]]) {
    const page = await open({}, (p) => p.route(/bundle\.h5/, answer));
    await inState(page, "error");
    assert.match(await page.textContent("#error-title"), /could not be loaded/);
    assert.match(await page.textContent("#error-text"), new RegExp(`bundle\\.h5: .*${cause}`));
    await closed(page);
  }
});

test("another bundle that one opens is no link of another bundle; what a step told goes away after the touch; the mouse shows no cross", async () => {
  const page = await ready();
  await page.selectOption('[data-effect="law"]', "sliding");
  await page.waitForFunction(() => location.hash.includes("law=sliding"));
  execFileSync(process.env.WRITE_TINY_BUNDLE, [`${folder}/large.h5`, "large"]);
  await give(page, "large.h5", readFileSync(`${folder}/large.h5`));
  await page.waitForFunction(() => !document.querySelector('[data-effect="large"]').disabled);
  await page.waitForFunction(() => !location.hash.includes("law=sliding"));
  assert.equal(await page.textContent("#notice"), "");
  await drag(page, [0, 0], [60, -40], { release: false });
  assert.equal(await page.isVisible("#cross"), false);
  // Tells of touches that were left out, and returns what the page says then.
  const told = () => page.evaluate(() => (globalThis.palpateViewer.numbers({ ...globalThis.palpateViewer.newest.frame, lost: 126 }), document.getElementById("notice").textContent));
  assert.match(await told(), /126 touches left out/);
  await page.mouse.up();
  await noTools(page);
  await told();
  await page.waitForFunction(() => document.getElementById("notice").textContent === "");
  await closed(page);
});

test("files dropped on the empty page are answered", async () => {
  const page = await open({}, (p) => p.route(/bundle\.h5|render\.ply/, (route) => route.fulfill({ status: 404, body: "" })));
  await inState(page, "empty");
  for (const name of ["surface.ply", "path.csv"]) {
    await page.evaluate((file) => {
      const files = new DataTransfer();
      files.items.add(new File(["0,0,0,0\n"], file));
      dispatchEvent(new DragEvent("drop", { dataTransfer: files }));
    }, name);
    await page.waitForFunction((file) => document.getElementById("empty-note").textContent.startsWith(file), name);
    assert.match(await page.textContent("#empty-note"), /open a bundle first/);
  }
  await closed(page);
});

// ---- camera ----------------------------------------------------------------------------------------------------------

// When its motion has ended: after a drag it runs on for some frames.
async function still(page) {
  for (let before = await camera(page); ; ) {
    await frame(page);
    const now = await camera(page);
    if (same(now.direction, before.direction, 1e-5) && Math.abs(now.distance - before.distance) < 1e-6) return now;
    before = now;
  }
}

test("the wheel stops in front of the organ; Reset and another window size keep the view; the right button turns it", async () => {
  const page = await ready();
  const home = await camera(page);
  await page.mouse.move(500, 400);
  for (let i = 0; i < 60; ++i) await page.mouse.wheel(0, -400);
  const near = await still(page);
  assert.ok(near.distance < 0.8 * home.distance);
  const sees = () => page.evaluate(() => {
    const canvas = document.getElementById("organ");
    return globalThis.palpateViewer.view.pick(canvas.clientWidth / 2, canvas.clientHeight / 2) !== null;
  });
  assert.ok(await sees(), "the camera is outside");
  await drag(page, [0, 0], [120, 40], { button: "right" });
  const turned = await still(page);
  assert.ok(await sees(), "and stays outside when it turns");
  assert.ok(!same(turned.direction, near.direction, 0.05), "the right button turns");
  assert.deepEqual((await shown(page, "tools")).filter(Boolean), []);
  await page.click("#reset");
  await frame(page);
  assert.ok(same((await camera(page)).direction, turned.direction, 1e-3));
  for (const [width, height] of [[700, 800], [1400, 900]]) {
    await page.setViewportSize({ width, height });
    await page.waitForFunction(([w, h]) => {
      const { clientWidth, clientHeight } = document.getElementById("organ"), { aspect } = globalThis.palpateViewer.view.camera.camera;
      return innerWidth === w && innerHeight === h && Math.abs(aspect - clientWidth / clientHeight) < 1e-9;
    }, [width, height]);
    const now = await camera(page);
    assert.ok(now.distance > 0.7 * turned.distance && now.distance < 2 * turned.distance);
    assert.ok(same(now.direction, turned.direction, 1e-3), `the direction stays: ${now.direction} after ${turned.direction}, at ${width} px`);
  }
  await page.click("#home");
  await frame(page);
  assert.ok(same((await camera(page)).direction, home.direction, 1e-3));
  await closed(page);
});

test("on a phone two fingers on the organ zoom and press nothing", async () => {
  const page = await ready({ viewport: { width: 390, height: 780 }, hasTouch: true, isMobile: true });
  await page.evaluate(() => globalThis.palpateViewer.view.camera.nearer(0.01));
  await frame(page);
  const before = await camera(page);
  const client = await page.context().newCDPSession(page);
  const fingers = (type, ...at) => client.send("Input.dispatchTouchEvent", { type, touchPoints: at.map(([x, y], id) => ({ x, y, id })) });
  const [high, low] = [340, 440];
  assert.equal(await page.evaluate((at) => at.every((y) => globalThis.palpateViewer.view.pick(195, y)), [high, low]), true, "both on the organ");
  await fingers("touchStart", [195, high]);
  await page.waitForFunction(() => globalThis.palpateViewer.pointer.active);
  await fingers("touchStart", [195, high], [195, low]);
  for (let i = 1; i <= 6; ++i) await fingers("touchMove", [195, high + 6 * i], [195, low - 6 * i]);
  assert.equal(await page.evaluate(() => globalThis.palpateViewer.pointer.active), false);
  await fingers("touchEnd");
  assert.ok((await still(page)).distance > 1.2 * before.distance, "the pinch moves the camera away");
  await noTools(page);
  assert.equal(await page.evaluate(() => globalThis.palpateViewer.recordedSteps), 0);
  await closed(page);
});
