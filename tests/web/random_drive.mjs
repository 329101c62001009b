// node random_drive.mjs PACKAGE_FOLDER PALPATE_RUN BUNDLE FOLDER [RENDER_MESH] (page.mjs): drives the viewer at random for MINUTES (5): mouse,
// keys, switches, replays, windows of other sizes. Fails where the page fails, or where its memory grows. SEED (1): of the random numbers.
import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import { test } from "node:test";
import { folder, frame, noTools, ready } from "./page.mjs";

const minutes = Number(process.env.MINUTES ?? 5), seed = Number(process.env.SEED ?? 1);
const WARM = 0.25; // of the time: what the page keeps once, such as compiled code, is there then
const ROOM = 2e6; // bytes; two measurements of a page that keeps nothing differ by 0.6e6
const GROWTH = 1.01; // of the median of the last third of the measurements over that of the first

// Numbers from 0 to 1 (mulberry32).
let state = seed;
function random() {
  state = (state + 0x6d2b79f5) | 0;
  let t = Math.imul(state ^ (state >>> 15), 1 | state);
  t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
  return ((t ^ (t >>> 14)) >>> 0) / 2 ** 32;
}
const between = (low, high) => low + (high - low) * random();
const oneOf = (all) => all[Math.floor(random() * all.length)];

const ACTS = {
  press: async (page) => {
    const box = await page.locator("#organ").boundingBox(), at = () => [box.x + between(0.1, 0.9) * box.width, box.y + between(0.1, 0.9) * box.height];
    await page.mouse.move(...at());
    await page.mouse.down({ button: oneOf(["left", "left", "left", "right"]) });
    for (let i = 0; i < 3; ++i) await page.mouse.move(...at(), { steps: 2 });
    for (const button of ["left", "right"]) await page.mouse.up({ button });
  },
  wheel: (page) => page.mouse.wheel(0, between(-600, 600)),
  key: (page) => page.keyboard.press(oneOf(["ArrowLeft", "ArrowUp", "+", "-", "h", "r", "z", "Escape", "Shift+ArrowRight", "Space"]), { delay: between(0, 200) }),
  effect: (page) => page.evaluate((number) => {
    const controls = [...document.querySelectorAll("[data-effect]:not(:disabled)")], control = controls[Math.floor(number * controls.length)];
    if (control.matches("select")) control.selectedIndex = (control.selectedIndex + 1) % control.options.length;
    else control.checked = !control.checked;
    control.dispatchEvent(new Event("change", { bubbles: true }));
  }, random()),
  mode: (page) => page.evaluate((id) => document.querySelector(id).click(), oneOf(["#keep", '[value="push"]', '[value="pull"]', "#reset", "#replay", "#undo", "#home"])),
  show: (page) => page.evaluate(([id, value]) => {
    const control = document.querySelector(id);
    if (control.matches("select")) control.value = value;
    else control.checked = !control.checked;
    control.dispatchEvent(new Event("change", { bubbles: true }));
  }, oneOf([["#colour-by", "displacement"], ["#colour-by", "dent"], ["#show-mesh", ""], ["#show-touchable", ""], ["#language", "de"], ["#language", "en"]])),
  size: (page) => page.setViewportSize({ width: Math.round(between(390, 1440)), height: Math.round(between(600, 900)) }),
};

// Asks the browser about the page, and about the page's worker: (method) => answers.
async function debuggers(page) {
  const session = await page.context().newCDPSession(page), attached = new Promise((done) => session.once("Target.attachedToTarget", done));
  await session.send("Target.setAutoAttach", { autoAttach: true, waitForDebuggerOnStart: false, flatten: false });
  const { sessionId } = await attached;
  let last = 0;
  const ofWorker = (method) => new Promise((done) => {
    const id = ++last, hear = ({ message }) => {
      const answer = JSON.parse(message);
      if (answer.id !== id) return;
      session.off("Target.receivedMessageFromTarget", hear);
      done(answer.result);
    };
    session.on("Target.receivedMessageFromTarget", hear);
    void session.send("Target.sendMessageToTarget", { sessionId, message: JSON.stringify({ id, method }) });
  });
  return async (method) => [await session.send(method), await ofWorker(method)];
}

// Bytes of the page and its worker after a collection of garbage (JavaScript, elements, arrays), and of the runtime. Without tools, whose
// touch is recorded while they are there.
async function memory(page, ask) {
  await page.evaluate(() => {
    if (document.getElementById("keep").checked) document.getElementById("keep").click();
    document.getElementById("reset").click();
  });
  await noTools(page);
  await ask("HeapProfiler.collectGarbage");
  const heaps = await ask("Runtime.getHeapUsage");
  const bytes = heaps.reduce((sum, heap) => sum + heap.usedSize + heap.embedderHeapUsedSize + heap.backingStorageSize, 0);
  return bytes + (await page.evaluate(() => globalThis.palpateViewer.shown.engineBytes));
}

test(`the viewer is driven at random for ${minutes} minutes, seed ${seed}: it does not fail, and its memory does not grow`, async () => {
  const page = await ready(), start = Date.now(), end = start + 60_000 * minutes, every = (60_000 * minutes * (1 - WARM)) / 12, used = [];
  const ask = await debuggers(page);
  let acts = 0, next = start + WARM * (end - start);
  while (Date.now() < end) {
    await ACTS[oneOf(Object.keys(ACTS))](page);
    ++acts;
    assert.deepEqual(page.failures, []);
    assert.equal(await page.getAttribute("body", "data-state"), "ready");
    if (Date.now() < next) continue;
    used.push(await memory(page, ask));
    next += every;
    await frame(page);
  }
  const third = Math.floor(used.length / 3), median = (of) => [...of].sort((a, b) => a - b)[of.length >> 1];
  const [first, last] = [median(used.slice(0, third)), median(used.slice(-third))];
  writeFileSync(`${folder}/random-drive.json`, JSON.stringify({ minutes, seed, acts, bytes: used, first, last }, null, 1) + "\n");
  console.log(`${acts} acts; ${(first / 1e6).toFixed(1)} MB at first, ${(last / 1e6).toFixed(1)} MB at last`);
  assert.ok(third >= 2, `only ${used.length} measurements: let it run longer (MINUTES)`);
  assert.ok(last < GROWTH * first + ROOM, `the memory grew from ${first} to ${last} bytes: ${used}`);
});
