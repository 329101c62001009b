// How the engine's worker starts where the package's own file cannot be one: from another origin, or under a bundler that did not take the
// file along.
import type { WayToStart } from "../viewer/src/engine_start";

const here = import.meta.url; // by a name of its own, so that no bundler follows it
const ENGINE = "palpate-engine.js";

const ofText = (text: string): Worker => {
  const address = URL.createObjectURL(new Blob([text], { type: "text/javascript" })), worker = new Worker(address, { type: "module" });
  worker.addEventListener("message", () => URL.revokeObjectURL(address), { once: true });
  return worker;
};

export const waysToStart: WayToStart[] = [
  () => {
    const address = new URL(ENGINE, here);
    if (address.origin === location.origin) throw new Error(address.href);
    return ofText(`import ${JSON.stringify(address.href)};`);
  },
  async () => ofText((await import("./palpate-engine-inline.js")).default), // the engine with its WebAssembly, as text
];
