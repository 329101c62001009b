// node screenshots.mjs PACKAGE_FOLDER PALPATE_RUN BUNDLE FOLDER [RENDER_MESH] (page.mjs): pictures of every page at 1440, 820 and 390 px, light
// and dark, to be looked at: FOLDER/PAGE-SCHEME-WIDTH.png. Fails where a page is wider than its window. PALPATE_DATA: the gallery's folder.
import { mkdirSync, writeFileSync } from "node:fs";
import { test } from "node:test";
import { looksRight } from "./axe.mjs";
import { bundle, closed, drag, folder, inState, open, settled, steady } from "./page.mjs";

// The bundle twice, for the page of several organs.
mkdirSync(folder, { recursive: true });
process.env.PALPATE_WORLD = `${folder}/twice.toml`;
process.env.PALPATE_WORLD_BUNDLES = `left=${bundle} right=${bundle}`;
writeFileSync(process.env.PALPATE_WORLD, `name = "twice"\nunit = "mm"\n[[organ]]\nname = "left"\n[[organ]]\nname = "right"\nposition = [250, 0, 0]\n`);

for (const colorScheme of ["light", "dark"]) {
  const options = { colorScheme, deviceScaleFactor: 1 };
  test(`the viewer, ${colorScheme}: at rest, pressed, its details on a phone, in German, without an organ`, async () => {
    const page = await open(options);
    await inState(page, "ready");
    await settled(page);
    await looksRight(page, `viewer-${colorScheme}`, { axe: false, fullPage: false });
    await page.setViewportSize({ width: 1440, height: 900 });
    await page.click("#keep + span");
    await drag(page, [40, -40], [130, -130]);
    await steady(page);
    await looksRight(page, `pressed-${colorScheme}`, { axe: false, fullPage: false });
    await page.click("#more");
    await looksRight(page, `details-${colorScheme}`, { axe: false, fullPage: false });
    await page.selectOption("#language", "de");
    await looksRight(page, `german-${colorScheme}`, { axe: false, fullPage: false });
    await closed(page);
    const empty = await open(options, (p) => p.route(/bundle\.h5|render\.ply/, (route) => route.fulfill({ status: 404, body: "" })));
    await inState(empty, "empty");
    await looksRight(empty, `empty-${colorScheme}`, { axe: false, fullPage: false });
    await closed(empty);
  });

  test(`Compare, ${colorScheme}`, async () => {
    const page = await open(options, undefined, "compare.html?language=en#b=contact%3Dpoint");
    await page.waitForFunction(() => globalThis.palpateCompare?.areOpen && globalThis.palpateCompare.sides.every((side) => side.frame));
    await page.click("#press");
    await page.waitForFunction(() => globalThis.palpateCompare.differences && !globalThis.palpateCompare.trying);
    await looksRight(page, `compare-${colorScheme}`, { axe: false });
    await closed(page);
  });

  test(`several organs, ${colorScheme}`, async () => {
    const page = await open(options, undefined, "world.html?language=en");
    await inState(page, "ready");
    await page.waitForFunction(() => globalThis.palpateWorld.shown.positions);
    await looksRight(page, `world-${colorScheme}`, { axe: false, fullPage: false });
    await closed(page);
  });

  test(`gallery, ${colorScheme}`, async () => {
    const page = await open(options, undefined, "gallery.html?language=en");
    await inState(page, "ready");
    await looksRight(page, `gallery-${colorScheme}`, { axe: false });
    await closed(page);
  });
}
