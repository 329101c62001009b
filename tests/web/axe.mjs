// What axe-core (https://github.com/dequelabs/axe-core) finds wrong with a page.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { folder, frame, require } from "./page.mjs";

const axe = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");

export async function violations(page) {
  await page.evaluate(axe);
  const { violations: found } = await page.evaluate(() => globalThis.axe.run(document));
  return found.flatMap(({ id, nodes }) => nodes.map((node) => `${id}: ${node.target.join(" ")}: ${node.any[0]?.message ?? node.failureSummary}`));
}

// At each width nothing is wider than the page, axe-core finds nothing, and NAME-WIDTH.png shows it. before: what comes first, by the width.
export async function looksRight(page, name, { fullPage = true, before = async () => {} } = {}) {
  for (const width of [1440, 820, 390]) {
    await page.setViewportSize({ width, height: 900 });
    await before(width);
    await frame(page);
    assert.deepEqual(await violations(page), []);
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), `${name} at ${width} px: nothing is wider than the page`);
    await frame(page);
    await page.screenshot({ path: `${folder}/${name}-${width}.png`, fullPage });
  }
}
