// node access_test.mjs PACKAGE_FOLDER PALPATE_RUN BUNDLE FOLDER [RENDER_MESH] (page.mjs): the viewer by keyboard alone, on a phone's
// screen, and under axe-core (https://github.com/dequelabs/axe-core).
import assert from "node:assert/strict";
import { test } from "node:test";
import { closed, frame, inState, noTools, open, picture, pressedTo, pressesWith, ready, steady } from "./page.mjs";
import { violations } from "./axe.mjs";

for (const colorScheme of ["light", "dark"])
  test(`axe-core finds nothing, ${colorScheme}: the organ, the panel of a phone, the empty page, a refused bundle`, async () => {
    const page = await ready({ colorScheme });
    await page.keyboard.down("Space");
    await pressesWith(page, 0.1);
    assert.deepEqual(await violations(page), []);
    await page.keyboard.up("Space");
    for (const width of [820, 390]) {
      await page.setViewportSize({ width, height: 844 });
      if (width === 390) await page.click("#more");
      await frame(page);
      assert.deepEqual(await violations(page), []);
      await picture(page, `${colorScheme}-${width}`);
    }
    await page.close();
    const empty = await open({ colorScheme }, (p) => p.route(/bundle\.h5|render\.ply/, (route) => route.fulfill({ status: 404, body: "" })));
    await inState(empty, "empty");
    assert.deepEqual(await violations(empty), []);
    await empty.setInputFiles("#file", { name: "bad.h5", mimeType: "application/octet-stream", buffer: Buffer.from("no bundle") });
    await inState(empty, "error");
    assert.deepEqual(await violations(empty), []);
    await empty.close();
  });

test("keys work wherever the focus is; the cross moves, space pushes there, and escape takes a kept tool away", async () => {
  const page = await ready();
  const direction = () => page.evaluate(() => globalThis.palpateViewer.view.camera.camera.position.toArray());
  const before = await direction();
  await page.focus("#show-mesh");
  await page.keyboard.press("ArrowLeft");
  await frame(page);
  assert.notDeepEqual(await direction(), before);
  const distance = () => page.evaluate(() => globalThis.palpateViewer.view.camera.controls.getDistance());
  const far = await distance();
  await page.keyboard.press("+");
  await frame(page);
  assert.ok(Math.abs((await distance()) / far - 0.92) < 1e-3);
  const pushed = async () => {
    await page.keyboard.down("Space");
    await pressesWith(page, 0.1);
    const { point } = await page.evaluate(() => globalThis.palpateViewer.shown.tools[0]);
    await page.keyboard.up("Space");
    await noTools(page);
    return point;
  };
  await page.evaluate(() => document.activeElement.blur());
  const first = await pushed();
  assert.equal(await page.isVisible("#cross"), true);
  for (let i = 0; i < 3; ++i) await page.keyboard.press("Shift+ArrowRight");
  const second = await pushed();
  assert.ok(Math.hypot(...first.map((x, d) => x - second[d])) > 0.003, "the push is elsewhere");
  await page.focus("#show-mesh");
  await page.keyboard.press("Space");
  assert.equal(await page.isChecked("#show-mesh"), true, "a switch keeps its own key");
  await page.check("#keep", { force: true });
  await page.focus("#organ");
  await page.keyboard.down("Space");
  await page.waitForFunction(() => globalThis.palpateViewer.shown.tools[0]?.depth > 0.002);
  await page.keyboard.up("Space");
  await steady(page);
  assert.ok(await page.evaluate(() => globalThis.palpateViewer.shown.tools[0].depth > 0.002), "it stays");
  await page.keyboard.press("Escape");
  await noTools(page);
  await page.close();
});

test("space held for long stays in contact, also on a small organ", async () => {
  const page = await ready();
  await page.keyboard.down("Space");
  await page.waitForFunction(() => {
    const { pointer } = globalThis.palpateViewer, [held] = pointer.held, away = held.place.map((x, d) => held.target.point[d] - x);
    return Math.hypot(...away) > pointer.deepest(held.hit) - 1e-9;
  });
  await steady(page);
  const { contacts, force } = await page.evaluate(() => globalThis.palpateViewer.shown.tools[0]);
  assert.ok(contacts > 0 && Math.hypot(...force) > 0.1);
  await page.keyboard.up("Space");
  await page.close();
});

test("a pen presses as deep as its pressure says; a pen that does not measure pressure presses as the mouse does", async () => {
  const page = await ready();
  const box = await page.locator("#organ").boundingBox(), client = await page.context().newCDPSession(page);
  const pen = (type, force, away = 0) => client.send("Input.dispatchMouseEvent", { type, force, pointerType: "pen", button: "left",
    buttons: type === "mouseReleased" ? 0 : 1, clickCount: 1, x: box.x + box.width / 2 + away, y: box.y + box.height / 2 });
  await pen("mousePressed", 0.1);
  for (const [force, mm] of [[0.2, 5], [0.4, 9], [0.25, 6]]) {
    await pen("mouseMoved", force);
    await pressedTo(page, mm);
  }
  await pen("mouseReleased", 0);
  await noTools(page);
  await pen("mousePressed", 0.5);
  await pen("mouseMoved", 0.5);
  await pressedTo(page, 1);
  await pen("mouseMoved", 0.5, 40);
  await page.waitForFunction(() => globalThis.palpateViewer.shown.tools[0].depth > 0.002);
  await pen("mouseReleased", 0);
  await closed(page);
});

test("on the empty page the first Tab comes to its button", async () => {
  const page = await open({}, (p) => p.route(/bundle\.h5|render\.ply/, (route) => route.fulfill({ status: 404, body: "" })));
  await inState(page, "empty");
  await page.keyboard.press("Tab");
  assert.equal(await page.evaluate(() => document.activeElement.closest("#empty-card")?.id), "empty-card");
  await page.close();
});

test("a finger's way of 47 px goes 6 mm deep at the most, however small the organ is drawn", async () => {
  const page = await ready({ viewport: { width: 390, height: 780 }, hasTouch: true, isMobile: true });
  for (let i = 0; i < 4; ++i) await page.evaluate(() => globalThis.palpateViewer.view.camera.nearer(2)).then(() => frame(page));
  const scale = await page.evaluate(() => globalThis.palpateViewer.view.metresPerPixel(globalThis.palpateViewer.front().point));
  assert.ok(scale > 3e-4, `${scale} m for each pixel`);
  const client = await page.context().newCDPSession(page), [x, y] = await page.evaluate(() => {
    const { view: { camera: { camera } } } = globalThis.palpateViewer, box = document.getElementById("organ").getBoundingClientRect(), p = camera.position.clone().set(...globalThis.palpateViewer.front().point).project(camera);
    return [box.x + ((p.x + 1) / 2) * box.width, box.y + ((1 - p.y) / 2) * box.height];
  });
  const finger = (type, ...at) => client.send("Input.dispatchTouchEvent", { type, touchPoints: at.map(([fx, fy], id) => ({ x: fx, y: fy, id })) });
  await finger("touchStart", [x, y]);
  await finger("touchMove", [x + 20, y]);
  await finger("touchMove", [x + 47, y]);
  await pressedTo(page, 5.7);
  await finger("touchEnd");
  await closed(page);
});

test("the panel closes and opens at every size, and nothing that is shown lies over another", async () => {
  const page = await ready();
  await page.evaluate(() => (document.getElementById("hint").dataset.words = "hint.plays")); // the longest hint
  for (const language of ["en", "de"]) {
    await page.selectOption("#language", language, { force: true });
    await page.evaluate(() => (document.getElementById("hint").dataset.words = "hint.plays"));
    for (const [width, height] of [[1440, 900], [820, 1180], [844, 390], [390, 844]]) {
      await page.setViewportSize({ width, height });
      for (const isOpen of width > 760 && height > 500 ? [true, false] : [false, true]) {
        await frame(page);
        assert.equal(await page.isVisible("#panel"), isOpen, `${width} x ${height}`);
        const over = await page.evaluate(() => {
          const parts = ["#title", "#readout", "#purpose", "#trust", "#legends", "#corner", "#hint", "#tools"].map((name) => document.querySelector(name)).filter((one) => one.checkVisibility({ visibilityProperty: true }));
          const boxes = parts.map((one) => [one.id, one.getBoundingClientRect()]);
          const meet = (a, b) => a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 1 && b.top < a.bottom - 1;
          const pairs = boxes.flatMap(([a, of], i) => boxes.slice(i + 1).filter(([, other]) => meet(of, other)).map(([b]) => `${a} over ${b}`));
          return [...pairs, ...boxes.filter(([, { left, right }]) => left < -1 || right > innerWidth + 1).map(([a]) => `${a} beyond the page`)];
        });
        assert.deepEqual(over, [], `${language}, ${width} x ${height}, ${isOpen ? "open" : "closed"}`);
        await picture(page, `layout-${language}-${width}-${isOpen ? "open" : "closed"}`);
        await page.click("#more");
      }
    }
  }
  await closed(page);
});

test("on a phone every control is 44 px high or more", async () => {
  const page = await ready({ viewport: { width: 390, height: 780 }, hasTouch: true, isMobile: true });
  await page.click("#more");
  await frame(page);
  const small = await page.evaluate(() => [...document.querySelectorAll("button, select, input[role=switch], .choice span, .toggle span, #radius")]
    .filter((control) => control.checkVisibility({ visibilityProperty: true })).map((control) => [control.id || control.textContent || control.dataset.effect, control.getBoundingClientRect().height])
    .filter(([, height]) => height < 44));
  assert.deepEqual(small, []);
  await page.close();
});

test("the page speaks the address's language, else the browser's; a switch changes every text, keeps the organ, and lasts", async () => {
  const page = await open({ locale: "de-DE" });
  await inState(page, "ready");
  const heading = () => page.textContent('[data-words="effects.heading"]');
  assert.equal(await heading(), "Effekte");
  assert.equal(await page.getAttribute("html", "lang"), "de");
  assert.match(await page.textContent("#facts"), /Netzpunkte/);
  await page.selectOption('[data-effect="law"]', "sliding");
  await page.waitForFunction(() => location.hash.includes("law=sliding"));
  await page.selectOption("#language", "en");
  assert.equal(await heading(), "Effects");
  assert.match(await page.textContent("#facts"), /mesh points/);
  assert.equal(await page.textContent("#legend-name"), "Dent");
  assert.equal(await page.inputValue('[data-effect="law"]'), "sliding", "the effects stay");
  assert.match(await page.evaluate(() => location.href), /language=en.*law=sliding/);
  await page.reload();
  await inState(page, "ready");
  assert.equal(await heading(), "Effects", "kept in the address");
  await page.evaluate(() => history.replaceState(null, "", location.pathname));
  await page.reload();
  await inState(page, "ready");
  assert.equal(await heading(), "Effects", "kept in the browser");
  await page.close();
  const asked = await open({ locale: "fr-FR" }, undefined, "?language=de");
  await inState(asked, "ready");
  assert.equal(await asked.textContent('[data-words="effects.heading"]'), "Effekte");
  await asked.selectOption("#language", "en");
  for (const [width, language] of [[1280, "de"], [390, "de"], [390, "en"]]) {
    await asked.selectOption("#language", language);
    await asked.setViewportSize({ width, height: 844 });
    await frame(asked);
    assert.deepEqual(await violations(asked), []);
    const inside = await asked.evaluate(() => [...document.querySelectorAll("#tools button, #tools span, #corner button, #title, #readout dd")]
      .filter((one) => one.checkVisibility({ visibilityProperty: true })).every((one) => one.getBoundingClientRect().left >= 0 && one.getBoundingClientRect().right <= innerWidth));
    assert.ok(inside, `${language} fits into ${width} px`);
  }
  await asked.close();
  const french = await open({ locale: "fr-FR" });
  assert.equal(await french.textContent('[data-words="effects.heading"]'), "Effects");
  assert.deepEqual([...page.failures, ...asked.failures, ...french.failures], []);
  await french.close();
});
