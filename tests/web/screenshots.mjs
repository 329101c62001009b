// node screenshots.mjs PACKAGE_FOLDER PALPATE_RUN BUNDLE FOLDER [RENDER_MESH] (page.mjs): pictures of every page at 1440, 820 and 390 px, light
// and dark, to be looked at: FOLDER/PAGE-SCHEME-WIDTH.png. Fails where a page is wider than its window. PALPATE_DATA: the gallery's folder.
import assert from "node:assert/strict";
import { mkdirSync, writeFileSync } from "node:fs";
import { test } from "node:test";
import { bundle, closed, drag, folder, frame, inState, open, settled, steady } from "./page.mjs";

const SCHEMES = ["light", "dark"], WIDTHS = [1440, 820, 390];

// The bundle twice, for the page of several organs.
mkdirSync(folder, { recursive: true });
process.env.PALPATE_WORLD = `${folder}/twice.toml`;
process.env.PALPATE_WORLD_BUNDLES = `left=${bundle} right=${bundle}`;
writeFileSync(process.env.PALPATE_WORLD, `name = "twice"\nunit = "mm"\n[[organ]]\nname = "left"\n[[organ]]\nname = "right"\nposition = [250, 0, 0]\n`);

// Each page at each width; fullPage: with what one scrolls to.
async function pictures(page, name, { fullPage = false, before = async () => {} } = {}) {
  for (const width of WIDTHS) {
    await page.setViewportSize({ width, height: 900 });
    await before(width);
    await frame(page);
    await frame(page);
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), `${name} at ${width} px is wider than its window`);
    await page.screenshot({ path: `${folder}/${name}-${width}.png`, fullPage });
  }
}

for (const colorScheme of SCHEMES) {
  const options = { colorScheme, deviceScaleFactor: 1 };
  test(`the viewer, ${colorScheme}: at rest, pressed, its details on a phone, in German, without an organ`, async () => {
    const page = await open(options);
    await inState(page, "ready");
    await settled(page);
    await pictures(page, `viewer-${colorScheme}`);
    await page.setViewportSize({ width: 1440, height: 900 });
    await page.click("#keep + span");
    await drag(page, [40, -40], [130, -130]);
    await steady(page);
    await pictures(page, `pressed-${colorScheme}`);
    await page.click("#more");
    await pictures(page, `details-${colorScheme}`);
    await page.selectOption("#language", "de");
    await pictures(page, `german-${colorScheme}`);
    await closed(page);
    const empty = await open(options, (p) => p.route(/bundle\.h5|render\.ply/, (route) => route.fulfill({ status: 404, body: "" })));
    await inState(empty, "empty");
    await pictures(empty, `empty-${colorScheme}`);
    await closed(empty);
  });

  test(`Compare, ${colorScheme}`, async () => {
    const page = await open(options, undefined, "compare.html?language=en#b=contact%3Dpoint");
    await page.waitForFunction(() => globalThis.palpateCompare?.areOpen && globalThis.palpateCompare.sides.every((side) => side.frame));
    await page.click("#press");
    await page.waitForFunction(() => globalThis.palpateCompare.differences && !globalThis.palpateCompare.trying);
    await pictures(page, `compare-${colorScheme}`, { fullPage: true });
    await closed(page);
  });

  test(`several organs, ${colorScheme}`, async () => {
    const page = await open(options, undefined, "world.html?language=en");
    await inState(page, "ready");
    await page.waitForFunction(() => globalThis.palpateWorld.shown.positions);
    await pictures(page, `world-${colorScheme}`);
    await closed(page);
  });

  for (const name of ["gallery", "accuracy"])
    test(`${name}, ${colorScheme}`, async () => {
      const page = await open(options, undefined, `${name}.html?language=en`);
      await inState(page, "ready");
      await pictures(page, `${name}-${colorScheme}`, { fullPage: true });
      await closed(page);
    });
}
