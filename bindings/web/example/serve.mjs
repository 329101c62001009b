// node serve.mjs PACKAGE BUNDLE [SURFACE]: serves the example page of <palpate-viewer> at http://127.0.0.1:5173 (PORT), until
// interrupted. PACKAGE: the folder of the npm package; BUNDLE, SURFACE: what the page asks for as bundle.h5 and render.ply.
import { createReadStream, statSync } from "node:fs";
import { createServer } from "node:http";
import { join, normalize } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";

const PACKAGE_AT = "/node_modules/palpate/";
const TYPES = { ".html": "text/html; charset=utf-8", ".js": "text/javascript", ".wasm": "application/wasm" };

/** A server of the page on the loopback address; port 0: a free one. @param {string} packageFolder @param {string} bundle
 *  @param {string} [surface] @param {number} [port] @returns {Promise<import("node:http").Server>} */
export function serveExample(packageFolder, bundle, surface, port = 0) {
  /** @type {Record<string, string | undefined>} */
  const files = { "/": fileURLToPath(new URL("index.html", import.meta.url)), "/bundle.h5": bundle, "/render.ply": surface };
  const server = createServer(({ url = "/" }, response) => {
    const path = normalize(decodeURI(url.replace(/[?#].*/, "")));
    const file = path.startsWith(PACKAGE_AT) ? join(packageFolder, path.slice(PACKAGE_AT.length)) : files[path];
    const size = file && statSync(file, { throwIfNoEntry: false })?.size;
    if (!size) return response.writeHead(404).end(`no ${path}`);
    const [ending] = /\.\w+$/.exec(file) ?? [""];
    response.writeHead(200, { "Content-Type": TYPES[ending] ?? "application/octet-stream", "Content-Length": size });
    createReadStream(file).pipe(response);
  });
  return new Promise((done) => server.listen(port, "127.0.0.1", () => done(server)));
}

if (import.meta.url === pathToFileURL(process.argv[1]).href) {
  const [packageFolder, bundle, surface] = process.argv.slice(2), port = Number(process.env.PORT ?? 5173);
  await serveExample(packageFolder, bundle, surface, port);
  console.log(`http://127.0.0.1:${port}`);
}
