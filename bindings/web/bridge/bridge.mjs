// node bridge.mjs [DEVICES [PAGE]]: lets a haptic device or a tracker move the tools of the viewer, and sends it the forces. To devices it
// is what palpate-igtl is, an OpenIGTLink server, on the port DEVICES (18944) of the loopback address; the page connects by WebSocket to
// the port PAGE (18945). Between both: {"tool", "position": [x, y, z]} in metres and {"gone": [tools]} to the page, {"tool", "force": [x, y,
// z]} in newtons from it, in the bundle's frame.
import { createServer } from "node:net";
import { pathToFileURL } from "node:url";
import { WebSocketServer } from "ws";
import { forceMessages, IgtlStream } from "./igtl.mjs";

const HERE = "127.0.0.1";
const MOST_QUEUED = 1 << 20; // bytes, of a device that does not read, or a page that does not
const MOST_DEVICES = 16;
const LARGEST = 4096; // bytes of a message of the page
const OWN_PAGES = /^https?:\/\/(localhost|127\.0\.0\.1|\[::1\])(:\d+)?$/; // no other site may move the tools or read the forces
export const REPLACED = 4000; // the code with which a page's connection ends when another page connects

/** Port 0: a free one. @param {{devices?: number, page?: number, say?: (line: string) => void}} [options]
 *  @returns {Promise<{devices: number, page: number, close: () => void}>} the ports */
export async function startBridge({ devices = 18944, page = 18945, say = console.log } = {}) {
  /** @type {Set<import("node:net").Socket>} */
  const clients = new Set();
  /** @type {import("ws").WebSocket | null} */
  let viewer = null;
  const tell = (/** @type {object} */ news) => {
    if (viewer && viewer.bufferedAmount < MOST_QUEUED) viewer.send(JSON.stringify(news)); // the newest position counts, not each one
  };

  const server = createServer((client) => {
    if (clients.size === MOST_DEVICES) return client.destroy();
    const stream = new IgtlStream(), tools = new Set(), said = new Set(), name = `${client.remoteAddress}:${client.remotePort}`;
    clients.add(client);
    say(`${name}: connected`);
    client.setNoDelay(true);
    client.on("error", () => client.destroy());
    client.on("data", (bytes) => {
      for (const request of stream.take(bytes)) {
        if (request.kind === "pose") {
          tools.add(request.tool);
          tell({ tool: request.tool, position: request.position });
          continue;
        }
        if (!said.has(request.why)) say(`${name}: refused: ${request.why}`); // once
        if (said.size < 100) said.add(request.why);
        if (request.closing) client.destroy();
      }
    });
    client.on("close", () => {
      clients.delete(client);
      say(`${name}: gone`);
      if (tools.size) tell({ gone: [...tools] });
    });
  });

  const pages = new WebSocketServer({ host: HERE, port: page, maxPayload: LARGEST, perMessageDeflate: false, verifyClient: ({ origin }) => OWN_PAGES.test(origin ?? "") });
  pages.on("connection", (socket) => {
    viewer?.close(REPLACED, "another page took the devices");
    viewer = socket;
    say("the page: connected");
    socket.on("error", () => socket.terminate());
    socket.on("close", () => {
      if (viewer === socket) viewer = null;
      say("the page: gone");
    });
    socket.on("message", (text) => {
      const felt = forceOf(String(text));
      if (!felt) return socket.close(1008, "expected {tool, force: [x, y, z]}");
      const messages = forceMessages(felt.tool, felt.force);
      for (const client of clients) if (client.writableLength < MOST_QUEUED) client.write(messages);
    });
  });

  await Promise.all([listening(server.listen(devices, HERE)), listening(pages)]);
  const portOf = (/** @type {{address: () => any}} */ of) => of.address().port;
  const close = () => {
    for (const client of clients) client.destroy();
    for (const socket of pages.clients) socket.terminate();
    server.close();
    pages.close();
  };
  return { devices: portOf(server), page: portOf(pages), close };
}

/** @param {string} text @returns {{tool: string, force: number[]} | null} */
function forceOf(text) {
  try {
    const { tool, force } = JSON.parse(text);
    const isForce = Array.isArray(force) && force.length === 3 && force.every(Number.isFinite);
    return typeof tool === "string" && isForce ? { tool, force } : null;
  } catch {
    return null;
  }
}

// Rejects where the port is taken.
const listening = (/** @type {import("node:events").EventEmitter} */ server) =>
  new Promise((done, failed) => server.once("listening", () => done(server)).once("error", failed));

if (process.argv[1] && import.meta.url === pathToFileURL(process.argv[1]).href) {
  const [devices, page] = process.argv.slice(2).map(Number), isPort = (/** @type {number | undefined} */ of) => of === undefined || (Number.isInteger(of) && of >= 0 && of < 65536);
  if (!isPort(devices) || !isPort(page)) {
    console.error(`bridge: expected ports from 0 to 65535, found ${process.argv.slice(2).join(" ")}; for example: bridge.mjs 18944 18945`);
    process.exit(2);
  }
  const ports = await startBridge({ devices, page }).catch((error) => {
    console.error(`bridge: ${error.code === "EADDRINUSE" ? `port ${error.port} is taken: stop what listens there, or name other ports: bridge.mjs DEVICES PAGE` : error.message}`);
    process.exit(2);
  });
  console.log(`devices: OpenIGTLink on ${HERE}:${ports.devices}; the page: ws://${HERE}:${ports.page}`);
}
