// What axe-core (https://github.com/dequelabs/axe-core) finds wrong with a page, and controls whose words have the colour of their ground, which
// axe-core leaves open where there is a picture or a gradient behind them.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { folder, frame, require } from "./page.mjs";

const axe = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");

export async function violations(page) {
  await page.evaluate(axe);
  const { violations: found } = await page.evaluate(() => globalThis.axe.run(document));
  return [...found.flatMap(({ id, nodes }) => nodes.map((node) => `${id}: ${node.target.join(" ")}: ${node.any[0]?.message ?? node.failureSummary}`)), ...(await unreadable(page))];
}

// Controls with a contrast below 4.5 between their words and the colours that lie behind them, painted one over the other.
const unreadable = (page) => page.evaluate(() => {
  const pen = Object.assign(document.createElement("canvas"), { width: 1, height: 1 }).getContext("2d", { willReadFrequently: true });
  const painted = (colours) => {
    pen.fillStyle = matchMedia("(prefers-color-scheme: dark)").matches ? "black" : "white";
    pen.fillRect(0, 0, 1, 1);
    for (const colour of colours) {
      pen.fillStyle = colour;
      pen.fillRect(0, 0, 1, 1);
    }
    const [r, g, b] = [...pen.getImageData(0, 0, 1, 1).data].map((byte) => (byte / 255 <= 0.04045 ? byte / 255 / 12.92 : ((byte / 255 + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const controls = [...document.querySelectorAll("a, button:enabled, select:enabled, summary, .choice span, .toggle span")].filter((one) => one.checkVisibility({ visibilityProperty: true, opacityProperty: true }) && one.innerText.trim());
  return controls.flatMap((one) => {
    const grounds = [];
    for (let at = one; at; at = at.parentElement) grounds.unshift(getComputedStyle(at).backgroundColor);
    const [low, high] = [painted(grounds), painted([...grounds, getComputedStyle(one).color])].sort((a, b) => a - b), contrast = (high + 0.05) / (low + 0.05);
    return contrast < 4.5 ? [`${one.id || one.className || one.tagName} "${one.innerText.trim().slice(0, 30)}": contrast ${contrast.toFixed(2)}`] : [];
  });
});

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
