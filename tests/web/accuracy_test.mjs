// node accuracy_test.mjs PACKAGE_FOLDER PALPATE_RUN BUNDLE FOLDER [RENDER_MESH] (page.mjs): the page of the fronts, on a study that this
// test makes up.
import assert from "node:assert/strict";
import { cpSync, mkdirSync, rmSync, writeFileSync } from "node:fs";
import { test } from "node:test";
import { looksRight } from "./axe.mjs";
import { bundle, closed, folder, frame, inState, open } from "./page.mjs";

const setting = (name, touch, error, more = {}) => ({
  name, is_reference: false, vertices: 1000, element: name.split(" ")[1], own_material: true, columns_everywhere: true, solver: "auto", storage: "f32", exercise: "press",
  law: "sticking", contact: "patch", contacts: 1, force_error: error, force_error_worst: 2 * error, field_error: error / 2, field_error_mm: 0.123,
  reference_force_error: 0.06, reference_field_error: null, touch_us: touch, shape_us: 10 * touch, precompute_s: touch, precompute_GB: 0.5, bundle_MB: touch, bundle: "bundles/none.h5", ...more,
});
const points = [
  setting("200 p1", 1, 0.2), setting("600 p1", 3, 0.3), // 600 p1 costs more than 200 p1 and is worse
  setting("200 p2-p0", 2, 0.1, { shape_us: 1 }), // of shape, the cheapest and better than 200 p1
  setting("600 p1-anp, node contact", 4, 0.05, { contact: "node", bundle: "bundles/there.h5" }), setting("600 p1-anp", 5, 0.05),
  setting("600 p1-anp f64", 0.1, 0.001, { storage: "f64" }), setting("1700 p2-p0", 0.1, 0.001, { is_reference: true }), setting("1700 p1", 0.1, 0.001, { law: "coulomb" }),
];
const data = `${folder}/studies`, study = `${data}/liver/accuracy/abdomen`;
rmSync(data, { recursive: true, force: true });
mkdirSync(`${study}/bundles`, { recursive: true });
mkdirSync(`${data}/plate/accuracy/corners`, { recursive: true });
cpSync(bundle, `${study}/bundles/there.h5`);
writeFileSync(`${study}/accuracy.json`, JSON.stringify({ organ: "liver", boundary: "abdomen", radius_mm: 10, points }));
writeFileSync(`${data}/plate/accuracy/corners/accuracy.json`, "{ cut");

async function fronts(options = {}, folderOfData = data, language = "en") {
  process.env.PALPATE_DATA = folderOfData;
  const page = await open({ viewport: { width: 1440, height: 1000 }, ...options }, undefined, `accuracy.html?language=${language}`);
  await inState(page, "ready");
  return page;
}
const marker = (chart, name) => `#fronts figure:nth-child(${chart}) [aria-label^="${name}:"]`;
const namesOf = (page, chart, which = "") => page.$$eval(`#fronts figure:nth-child(${chart}) [aria-label*=":"]${which}`, (all) => all.map((one) => one.getAttribute("aria-label").replace(/:.*/, "")));

test("each chart draws the settings that can be baked, and its front is those that no other one beats", async () => {
  const page = await fronts();
  const drawn = ["200 p1", "200 p2-p0", "600 p1", "600 p1-anp", "600 p1-anp, node contact"];
  for (const chart of [1, 2, 3, 4]) assert.deepEqual((await namesOf(page, chart)).sort(), drawn);
  const byTouch = ["200 p1", "200 p2-p0", "600 p1-anp, node contact"];
  for (const [chart, front] of [[1, byTouch], [2, ["200 p2-p0", "600 p1-anp, node contact"]], [3, byTouch], [4, byTouch]])
    assert.deepEqual(await namesOf(page, chart, "[tabindex='0']"), front);
  // Logarithmic axes: equal factors are equal distances.
  const at = (name) => page.evaluate((selector) => document.querySelector(`${selector} .marker`).getAttribute("transform"), marker(1, name)).then((text) => text.match(/[\d.]+/g).map(Number));
  const [[x1, y1], [x2, y2], [x4, y4]] = [await at("200 p1"), await at("200 p2-p0"), await at("600 p1-anp, node contact")];
  assert.ok(Math.abs(x2 - x1 - (x4 - x2)) < 1e-6 && x2 > x1 && Math.abs(y2 - y1 - (y4 - y2)) < 1e-6 && y2 > y1, "1, 2, 4 us and 20, 10, 5 %");
  assert.deepEqual(await page.$$eval("#fronts figure", (all) => all.map((one) => one.querySelectorAll(".band rect").length)), [1, 0, 1, 1], "the reference's own error is known of the force alone");
  await closed(page);
});

test("the pointer names a setting with its figures and marks it in every chart; so does the keyboard", async () => {
  const page = await fronts();
  await page.hover(marker(2, "600 p1"));
  const details = await page.textContent("#setting");
  for (const figure of ["600 p1", "force error", "30 %, worst 60 %", "15 %, at most 0.123 mm", "touch3 µs", "shape30 µs", "3 s, 0.5 GB", "3 MB"]) assert.ok(details.includes(figure), `${figure} in ${details}`);
  assert.equal(await page.locator(".marker.on").count(), 4);
  assert.match(details, /no longer has its bundle.*make -f Makefile\.data accuracy ORGAN=liver BC=abdomen/);
  assert.equal(await page.locator("#setting a").count(), 0);
  await page.focus("#study");
  await page.keyboard.press("Tab");
  assert.match(await page.textContent("#setting h2"), /^200 p1$/);
  await closed(page);
});

test("a click on a setting opens its bundle with its contact and the study's disc", async () => {
  const page = await fronts();
  await page.click(marker(4, "600 p1-anp, node contact"));
  await page.waitForURL(/index\.html/);
  await inState(page, "ready");
  assert.match(await page.textContent("#facts"), /64 mesh points/);
  assert.equal(await page.inputValue('[data-effect="contact"]'), "node");
  assert.equal(await page.textContent("#radius-mm"), "10 mm");
  await page.waitForFunction(() => /bundle=[\da-f]{16}/.test(location.hash) && location.hash.includes("contact=node"));
  await closed(page);
});

test("a study that cannot be read is named; without a study the page says what makes one", async () => {
  const page = await fronts();
  await page.selectOption("#study", { label: "plate, corners" });
  await page.waitForFunction(() => /plate\/accuracy\/corners\/accuracy\.json: expected/.test(document.getElementById("said").textContent));
  await closed(page);
  const none = await fronts({}, `${folder}/none`);
  assert.match(await none.textContent("#none"), /make -f Makefile\.data accuracy/);
  assert.deepEqual([await none.isVisible("#none"), await none.isVisible("#some")], [true, false]);
  await closed(none);
});

for (const [colorScheme, language, touch] of [["light", "en", "touch"], ["dark", "de", "Berührung"]])
  test(`axe-core finds nothing in the fronts, ${colorScheme}, ${language}, at 1440, 820 and 390 px`, async () => {
    const page = await fronts({ colorScheme }, data, language);
    await page.hover(marker(2, "600 p1"));
    assert.ok((await page.textContent("#setting")).includes(`${touch}3 µs`));
    assert.equal(await page.textContent("figcaption"), language === "de" ? "Fehler der Kraft über der Zeit einer Berührung" : "Force error against the time of a touch");
    await looksRight(page, `fronts-${colorScheme}`, { before: async () => (await frame(page), page.focus(marker(1, "200 p2-p0"))) });
    await closed(page);
  });
