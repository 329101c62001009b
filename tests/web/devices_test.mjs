// node devices_test.mjs PACKAGE_FOLDER PALPATE_RUN BUNDLE FOLDER [RENDER_MESH] (page.mjs): the viewer under a gamepad, which the test
// puts in the place of the browser's, and in a headset that IWER emulates (https://github.com/meta-quest/immersive-web-emulation-runtime).
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { camera, closed, frame, inState, noTools, open, pressedTo, ready, require, same, steady } from "./page.mjs";

const opened = async (prepare) => {
  const page = await open({}, prepare);
  await inState(page, "ready");
  return page;
};

// ---- gamepad ---------------------------------------------------------------------------------------------------------

// A gamepad in the standard mapping, at rest. globalThis.pad moves it.
const withGamepad = () => opened((page) => page.addInitScript(() => {
  globalThis.pad = { id: "test", index: 0, connected: true, mapping: "standard", axes: [0, 0, 0, 0],
    buttons: Array.from({ length: 17 }, () => ({ pressed: false, touched: false, value: 0 })) };
  navigator.getGamepads = () => [null, globalThis.pad];
}));
const stick = (page, ...axes) => page.evaluate((to) => (globalThis.pad.axes = to), axes);
const button = (page, index, value) => page.evaluate(([i, v]) => (globalThis.pad.buttons[i] = { pressed: v > 0.5, touched: v > 0, value: v }), [index, value]);
const tool = (page) => page.evaluate(() => globalThis.palpateViewer.shown.tools[0]);
const TRIGGER = 7, B = 1;

test("a gamepad's trigger presses at the cross as deep as it is pulled; the left stick moves the tool over the surface", async () => {
  const page = await withGamepad();
  for (const [value, mm] of [[0.05, 1], [0.25, 5], [0.4, 8], [0.2, 4]]) {
    await button(page, TRIGGER, value);
    await pressedTo(page, mm);
  }
  await steady(page);
  const before = (await tool(page)).point, { normal } = await page.evaluate(() => globalThis.palpateViewer.pressed);
  assert.ok(Math.hypot(...(await tool(page)).force) > 0.05);
  await stick(page, 0.1, 0, 0, 0);
  for (let i = 0; i < 5; ++i) await frame(page);
  assert.ok(same((await tool(page)).point, before, 1e-5), "a stick near its middle rests");
  await stick(page, 1, 0, 0, 0);
  await page.waitForFunction(([x, y, z]) => {
    const { point } = globalThis.palpateViewer.shown.tools[0];
    return Math.hypot(point[0] - x, point[1] - y, point[2] - z) > 0.004;
  }, before);
  await stick(page, 0, 0, 0, 0);
  await steady(page);
  const way = (await tool(page)).point.map((x, d) => x - before[d]), up = way.reduce((sum, x, d) => sum + x * normal[d], 0);
  assert.ok(Math.abs(up) < 1e-5, `along the surface, and ${up} m off it`);
  await button(page, TRIGGER, 0);
  await noTools(page);
  await closed(page);
});

test("a gamepad's right stick turns the organ, and B takes a kept tool away, once for each press", async () => {
  const page = await withGamepad(), { direction } = await camera(page);
  await stick(page, 0, 0, 1, 0);
  await page.waitForFunction(([x, y]) => {
    const { camera: { position }, controls } = globalThis.palpateViewer.view.camera, away = position.clone().sub(controls.target).normalize();
    return Math.hypot(away.x - x, away.y - y) > 0.2;
  }, direction);
  await stick(page, 0, 0, 0, 0);
  await page.click("#keep + span");
  await button(page, TRIGGER, 0.3);
  await page.waitForFunction(() => globalThis.palpateViewer.shown.tools[0]?.depth > 0.004);
  await button(page, TRIGGER, 0);
  await steady(page);
  assert.ok((await tool(page)).depth > 0.004, "it stays");
  await button(page, B, 1);
  await noTools(page);
  // B is still down: another tool comes and stays.
  await button(page, TRIGGER, 0.3);
  await page.waitForFunction(() => globalThis.palpateViewer.shown.tools[0]?.depth > 0.004);
  await button(page, TRIGGER, 0);
  await button(page, B, 0);
  await steady(page);
  // A press in the frame of a reset: the page still draws the dent, in which a tool would start inside the organ and meet nothing.
  await page.evaluate(([b, trigger]) => (globalThis.pad.buttons[b].pressed = true, globalThis.pad.buttons[trigger].value = 0.4), [B, TRIGGER]);
  await page.waitForFunction(() => globalThis.palpateViewer.shown.tools[0]?.depth > 0.007);
  await closed(page);
});

// ---- headset ---------------------------------------------------------------------------------------------------------

const iwer = readFileSync(require.resolve("iwer/build/iwer.min.js"), "utf8");
const withHeadset = () => opened((page) => page.addInitScript(`${iwer}
  globalThis.device = new IWER.XRDevice(IWER.metaQuest3);
  globalThis.device.installRuntime({ forceInstall: true });
  // IWER 2.5.0 takes the argument's matrix, where the standard gives a transform.
  const { getOffsetReferenceSpace } = IWER.XRReferenceSpace.prototype;
  IWER.XRReferenceSpace.prototype.getOffsetReferenceSpace = function (origin) { return getOffsetReferenceSpace.call(this, origin.matrix); };`));

test("without a headset the page offers none", async () => {
  const page = await ready();
  assert.equal(await page.isVisible("#headset"), false);
  await closed(page);
});

test("in a headset a controller's tip pushes the organ, holds it with the trigger, and vibrates; afterwards the view is as before", async () => {
  const page = await withHeadset(), before = await camera(page);
  await page.waitForFunction(() => !document.getElementById("headset").hidden);
  await page.evaluate(() => (globalThis.place = globalThis.palpateViewer.front()));
  await page.click("#headset");
  await page.waitForFunction(() => globalThis.palpateViewer.view.xr.isPresenting && globalThis.palpateViewer.headset.hands.some((hand) => hand.source));
  // Moves the right controller so that its tip stands at this height above the surface in front, m. The organ is in the headset's frame,
  // whose x, y, z are the bundle's x, z, -y, with its middle 0.15 m below and 0.5 m before the head; the tip is 0.06 m before the controller.
  const tip = (height) => page.evaluate((above) => {
    const { view, headset } = globalThis.palpateViewer, { device } = globalThis;
    const { place, normal } = globalThis.place, c = view.camera.controls.target, [x, y, z] = place.map((p, d) => p + above * normal[d] - [c.x, c.y, c.z][d]);
    device.controllers.right.position.set(x, device.position.y + z - 0.15, 0.06 - 0.5 - y);
    device.controllers.right.quaternion.set(0, 0, 0, 1);
    return headset.hands.findIndex((hand) => hand.source?.handedness === "right");
  }, height);
  const right = await tip(0.2);
  await noTools(page);
  await tip(0.01);
  await page.waitForFunction((hand) => globalThis.palpateViewer.shown.tools[hand], right);
  assert.equal(await page.evaluate((hand) => globalThis.palpateViewer.shown.tools[hand].contacts, right), 0, "a tool that is near has no force yet");
  await page.evaluate((hand) => {
    const [motor] = globalThis.palpateViewer.headset.hands[hand].source.gamepad.hapticActuators ?? [];
    globalThis.pulses = [];
    if (motor) motor.pulse = (strength) => globalThis.pulses.push(strength);
  }, right);
  await tip(-0.006);
  await page.waitForFunction((hand) => Math.abs(globalThis.palpateViewer.shown.tools[hand]?.depth - 0.006) < 5e-4, right);
  const felt = await page.evaluate((hand) => globalThis.palpateViewer.shown.tools[hand].force, right), { normal } = await page.evaluate(() => globalThis.place);
  assert.ok(felt.reduce((sum, x, d) => sum + x * normal[d], 0) > 0.05, "the organ pushes back");
  await page.waitForFunction(() => globalThis.pulses.some((strength) => strength > 0));
  // With the trigger pulled it takes hold of what it meets: drawn back it pulls.
  await tip(0.01);
  await page.waitForFunction((hand) => globalThis.palpateViewer.shown.tools[hand]?.contacts === 0, right);
  await page.evaluate(() => globalThis.device.controllers.right.updateButtonValue("trigger", 1));
  await page.waitForFunction((hand) => globalThis.palpateViewer.headset.hands[hand].grasp, right);
  await tip(-0.002);
  await page.waitForFunction((hand) => globalThis.palpateViewer.shown.tools[hand]?.contacts, right);
  await tip(0.006);
  await page.waitForFunction(([hand, [a, b, c]]) => {
    const [x, y, z] = globalThis.palpateViewer.shown.tools[hand]?.force ?? [0, 0, 0];
    return a * x + b * y + c * z < -0.02;
  }, [right, normal]);
  await page.evaluate(() => globalThis.device.controllers.right.updateButtonValue("trigger", 0));
  await tip(0.2);
  await noTools(page);
  await page.screenshot({ path: `${process.argv[5]}/headset.png` });
  await page.evaluate(() => globalThis.palpateViewer.headset.session.end());
  await page.waitForFunction(() => !globalThis.palpateViewer.view.xr.isPresenting);
  await frame(page);
  const now = await camera(page);
  assert.ok(same(now.direction, before.direction, 1e-3) && Math.abs(now.distance / before.distance - 1) < 1e-3, "the view is as before");
  await closed(page);
});
