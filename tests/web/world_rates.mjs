// node world_rates.mjs PACKAGE_FOLDER PALPATE_RUN BUNDLE FOLDER (page.mjs): touches and pictures a second of the page of several organs, in
// headless Chromium with a software renderer, for a scene of several organs: PALPATE_WORLD, and the bundles of PALPATE_WORLD_BUNDLES. Prints
// a line for organs that only move, for a press of the pointer, and for the scene's own tools. SECONDS of each (5).
import { readdirSync, readFileSync } from "node:fs";
import { test } from "node:test";
import { closed, inState, open } from "./page.mjs";

const SECONDS = Number(process.env.SECONDS ?? 5);

// Counts what happens in the page from now on.
const count = (page) => page.evaluate(() => {
  const world = globalThis.palpateWorld, { view } = world, counts = (globalThis.counts = { began: performance.now(), drawn: 0, touches: 0, lost: 0, shapes: 0, touchUs: [], shapeUs: [], drawMs: 0 });
  if (!globalThis.plain) {
    globalThis.plain = { render: view.render.bind(view), take: world.take.bind(world), move: world.moveOn.bind(world) };
    const timed = (act) => (...given) => {
      const start = performance.now(), made = act(...given);
      globalThis.counts.drawMs += performance.now() - start;
      return made;
    };
    const render = timed(globalThis.plain.render);
    view.render = () => {
      const drew = render();
      if (drew) ++globalThis.counts.drawn;
      return drew;
    };
    world.moveOn = timed(globalThis.plain.move);
    world.take = timed((frame) => {
      const { counts: now } = globalThis;
      now.touches += frame.touches;
      now.lost += frame.lost;
      if (frame.changed) ++now.shapes;
      if (frame.touches) now.touchUs.push(frame.touchUs), now.shapeUs.push(frame.shapeUs);
      globalThis.plain.take(frame);
    });
  }
  return counts.began;
});
const told = (page) => page.evaluate(() => {
  const { began, drawn, touches, lost, shapes, touchUs, shapeUs, drawMs } = globalThis.counts, seconds = (performance.now() - began) / 1000;
  const middle = (all) => Math.round(all.sort((a, b) => a - b)[all.length >> 1] ?? 0);
  return { "pictures a second": (drawn / seconds).toFixed(1), "shapes a second": (shapes / seconds).toFixed(1), "touches a second": Math.round(touches / seconds), "left out": Math.round(lost / seconds), "a touch, us": middle(touchUs), "a shape, us": middle(shapeUs), "page, ms a picture": (drawMs / drawn).toFixed(1) };
});

// CPU time of the browser's processes of a kind, s. Linux.
function cpu(kind) {
  let ticks = 0;
  for (const id of readdirSync("/proc").filter((name) => /^\d+$/.test(name)))
    try {
      if (!readFileSync(`/proc/${id}/cmdline`, "latin1").includes(`--type=${kind}`)) continue;
      const fields = readFileSync(`/proc/${id}/stat`, "latin1").split(") ").at(-1).split(" ");
      ticks += Number(fields[11]) + Number(fields[12]);
    } catch {} // it has just ended
  return ticks / 100;
}

test("rates of the page of several organs", async () => {
  const size = (process.env.VIEWPORT ?? "1280x800").split("x").map(Number);
  const page = await open({ reducedMotion: "no-preference", viewport: { width: size[0], height: size[1] } }, undefined, `world.html${process.env.WORDS ?? ""}`), lines = {};
  await inState(page, "ready");
  await page.waitForFunction(() => globalThis.palpateWorld.shown.positions);
  const measured = async (name) => {
    await page.waitForTimeout(1500);
    await count(page);
    const before = [cpu("gpu-process"), cpu("renderer")];
    await page.waitForTimeout(1000 * SECONDS);
    lines[name] = await told(page);
    const [gpu, renderer] = [cpu("gpu-process") - before[0], cpu("renderer") - before[1]], { drawn } = await page.evaluate(() => globalThis.counts);
    Object.assign(lines[name], { "drawing, CPU ms a picture": ((1000 * gpu) / drawn).toFixed(1), "drawing, cores": (gpu / SECONDS).toFixed(2), "page and engine, cores": (renderer / SECONDS).toFixed(2) });
  };
  await measured("breathing");
  const box = await page.locator("#organ").boundingBox();
  const at = await page.evaluate(() => {
    const { view } = globalThis.palpateWorld, { clientWidth: width, clientHeight: height } = document.getElementById("organ"), found = [];
    for (let x = 0.3; x < 0.71; x += 0.05) for (let y = 0.3; y < 0.71; y += 0.05) if (view.pick(x * width, y * height)) found.push([x * width, y * height]);
    return found[found.length >> 1];
  });
  await page.mouse.move(box.x + at[0], box.y + at[1]);
  await page.mouse.down();
  await page.mouse.move(box.x + at[0] + 20, box.y + at[1] + 30, { steps: 4 });
  await measured("breathing, pressed");
  await page.mouse.up();
  await page.click("#play");
  await measured("the scene's tools");
  console.table(lines);
  await closed(page);
});
