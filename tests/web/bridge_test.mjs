// node bridge_test.mjs PACKAGE_FOLDER PALPATE_RUN BUNDLE FOLDER [RENDER_MESH] (page.mjs): a device that speaks OpenIGTLink moves a tool of
// the viewer through the bridge and receives the force.
import assert from "node:assert/strict";
import { execFile } from "node:child_process";
import { connect } from "node:net";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";
import { closed, inState, middle, noTools, open, packageFolder, require } from "./page.mjs";

const { startBridge, REPLACED } = await import(pathToFileURL(`${packageFolder}/bridge/bridge.mjs`));
const { crc64, forceMessages, IgtlStream, message } = await import(pathToFileURL(`${packageFolder}/bridge/igtl.mjs`));
const { WebSocket } = require("ws");

let bridge, said = [];
before(async () => (bridge = await startBridge({ devices: 0, page: 0, say: (line) => said.push(line) })));
after(() => bridge?.close());

// A TRANSFORM with the tool at a point of the bundle's frame, m: RAS, mm.
function transform(tool, [x, y, z]) {
  const body = Buffer.alloc(48);
  [1, 0, 0, 0, 1, 0, 0, 0, 1, -1000 * x, -1000 * y, 1000 * z].forEach((number, i) => body.writeFloatBE(number, 4 * i));
  return message("TRANSFORM", tool, body);
}

// A device: its connection, and the forces that it has received, N in the bundle's frame, by SENSOR and by STRING.
async function device() {
  const socket = connect(bridge.devices, "127.0.0.1"), felt = { sensor: [], string: [], wrong: 0 };
  let held = Buffer.alloc(0);
  await new Promise((done) => socket.once("connect", done));
  socket.on("error", () => {});
  socket.on("data", (bytes) => {
    held = Buffer.concat([held, bytes]);
    while (held.length >= 58 && held.length >= 58 + Number(held.readBigUInt64BE(42))) {
      const body = held.subarray(58, 58 + Number(held.readBigUInt64BE(42))), type = held.toString("latin1", 2, 14).replace(/\0.*/, "");
      if (crc64(body) !== held.readBigUInt64BE(50) || held.readUInt16BE(0) !== 1) ++felt.wrong;
      if (type === "SENSOR") felt.sensor.push([0, 1, 2].map((d) => [-1, -1, 1][d] * body.readDoubleBE(10 + 8 * d)));
      else if (type === "STRING") felt.string.push(body.toString("latin1", 4));
      else ++felt.wrong;
      held = held.subarray(58 + body.length);
    }
  });
  return { socket, felt, closed: new Promise((done) => socket.once("close", done)) };
}
const until = async (of) => {
  for (let i = 0; i < 1200 && !of(); ++i) await new Promise((done) => setTimeout(done, 100));
  assert.ok(of());
};

test("the checksum is the CRC-64 of ECMA-182, and a message has the protocol's layout", () => {
  assert.equal(crc64(Buffer.from("123456789")), 0x6c40df5f0b497347n); // the check value of the catalogue of CRCs
  const sent = message("TRANSFORM", "probe", Buffer.alloc(48));
  assert.equal(sent.length, 58 + 48);
  assert.deepEqual([sent.readUInt16BE(0), sent.toString("latin1", 2, 11), sent.toString("latin1", 14, 19), Number(sent.readBigUInt64BE(42))], [1, "TRANSFORM", "probe", 48]);
  const sensor = forceMessages("probe", [1, 2, 3]), unit = sensor.readBigUInt64BE(60);
  assert.deepEqual([sensor[58], unit >> 60n, (unit >> 54n) & 63n, (unit >> 50n) & 15n], [3, 0n, 0x0bn, 1n], "three numbers in newtons");
});

test("bytes in any pieces give the same messages; what is no position is refused by name, and what cannot be read closes the stream", () => {
  const good = transform("probe", [0.01, 0.02, 0.03]), all = Buffer.concat([good, message("STATUS", "x", Buffer.alloc(30)), good]);
  for (const size of [1, 7, 58, 1000]) {
    const stream = new IgtlStream(), found = [];
    for (let at = 0; at < all.length; at += size) found.push(...stream.take(all.subarray(at, at + size)));
    assert.equal(found.length, 2);
    for (const { kind, tool, position } of found) {
      assert.deepEqual([kind, tool], ["pose", "probe"]);
      position.forEach((x, d) => assert.ok(Math.abs(x - [0.01, 0.02, 0.03][d]) < 1e-8)); // float32, mm
    }
  }
  const changed = (change) => {
    const bytes = Buffer.from(good);
    change(bytes);
    return [...new IgtlStream().take(bytes)];
  };
  const [sum] = changed((bytes) => bytes.writeUInt8(bytes[60] ^ 1, 60));
  assert.match(sum.why, /TRANSFORM of "probe": its checksum/);
  assert.equal(sum.closing, false);
  const [none] = changed((bytes) => (bytes.writeFloatBE(NaN, 58 + 40), bytes.writeBigUInt64BE(crc64(bytes.subarray(58)), 50)));
  assert.match(none.why, /expected finite numbers/);
  for (const wrong of [(bytes) => bytes.writeUInt16BE(9, 0), (bytes) => bytes.writeBigUInt64BE(1n << 40n, 42)]) assert.equal(changed(wrong)[0].closing, true);
});

test("a device presses the organ and receives the force that the page shows, at last none; its tool leaves with it", async () => {
  const page = await open({}, undefined, `?device=${bridge.page}`);
  await inState(page, "ready");
  await page.waitForFunction(() => /^Connected to the bridge/.test(document.getElementById("linked").textContent));
  const { place, normal } = await middle(page), at = (height) => place.map((x, d) => x + height * normal[d]);
  const { socket, felt, closed: left } = await device(), tool = () => page.evaluate(() => globalThis.palpateViewer.shown.tools[1]);
  socket.write(Buffer.concat([message("STATUS", "x", Buffer.alloc(30)), transform("probe", at(0.003))]));
  await page.waitForFunction(() => /^Moved by a device: probe/.test(document.getElementById("linked").textContent));
  const steps = 40;
  for (let i = 1; i <= steps; ++i) {
    socket.write(transform("probe", at(0.003 - (0.008 * i) / steps)));
    await new Promise((done) => setTimeout(done, 5)); // as a device does
  }
  await page.waitForFunction(([x, y, z]) => {
    const point = globalThis.palpateViewer.shown.tools[1]?.point;
    return point && Math.hypot(point[0] - x, point[1] - y, point[2] - z) < 1e-6;
  }, at(-0.005));
  await until(() => Math.hypot(...(felt.sensor.at(-1) ?? [0])) > 0.05);
  const { force } = await tool();
  await until(() => felt.sensor.at(-1).every((x, d) => Math.abs(x - force[d]) < 1e-4)); // the tool comes nearer by less than 1e-6 m
  assert.ok(force.reduce((sum, x, d) => sum + x * normal[d], 0) > 0.05, "the organ pushes back");
  const [x, y, z] = felt.string.at(-1).match(/^(\S+) (\S+) (\S+) N$/).slice(1).map(Number);
  [-x, -y, z].forEach((value, d) => assert.ok(Math.abs(value - force[d]) < 2e-4));
  assert.equal(felt.wrong, 0);
  // The pointer has the first tool still.
  await page.focus("#organ");
  await page.keyboard.down("Space");
  await page.waitForFunction(() => globalThis.palpateViewer.shown.tools.every((one) => one?.depth > 0.001));
  await page.keyboard.up("Space");
  await page.waitForFunction(() => globalThis.palpateViewer.shown.tools[0] === null);
  socket.write(transform("probe", at(0.003)));
  await until(() => felt.sensor.at(-1).every((value) => value === 0));
  socket.end();
  await left;
  await noTools(page);
  await page.waitForFunction(() => /^Connected to the bridge/.test(document.getElementById("linked").textContent));
  await closed(page);
});

test("without a bridge the page says how to start one; a second page takes the devices", async () => {
  const page = await open({}, undefined, "?device=9"); // a port that nobody listens on
  await inState(page, "ready");
  await page.waitForFunction(() => /make -f Makefile\.data bridge/.test(document.getElementById("linked").textContent));
  assert.equal(await page.getAttribute("#device", "aria-pressed"), "false");
  await page.close();
  const first = await open({}, undefined, `?device=${bridge.page}`);
  await first.waitForFunction(() => /^Connected to the bridge/.test(document.getElementById("linked").textContent));
  const other = new WebSocket(`ws://127.0.0.1:${bridge.page}`, { origin: "http://localhost:1" });
  await new Promise((done) => other.once("open", done));
  await first.waitForFunction(() => /^Another page took/.test(document.getElementById("linked").textContent));
  const ended = new Promise((done) => other.once("close", (code) => done(code)));
  await first.click("#device");
  assert.equal(await ended, REPLACED);
  await closed(first);
});

test("another site cannot reach the devices; a page that sends nonsense, and a device of another version, are closed", async () => {
  for (const origin of ["https://example.com", "http://127.0.0.1.example.com", undefined]) {
    const stranger = new WebSocket(`ws://127.0.0.1:${bridge.page}`, { origin });
    const status = await new Promise((done) => stranger.once("unexpected-response", (_, answer) => done(answer.statusCode)).once("open", () => done("open")));
    assert.equal(status, 401, String(origin));
  }
  for (const nonsense of ["{", '{"tool":"probe","force":[1,2]}', '{"tool":"probe","force":[1,2,null]}']) {
    const page = new WebSocket(`ws://127.0.0.1:${bridge.page}`, { origin: "http://127.0.0.1:5173" });
    await new Promise((done) => page.once("open", done));
    page.send(nonsense);
    assert.equal(await new Promise((done) => page.once("close", done)), 1008);
  }
  const { socket, closed: left } = await device(), wrong = transform("probe", [0, 0, 0]);
  wrong.writeUInt16BE(9, 0);
  socket.write(wrong);
  await left;
  assert.ok(said.some((line) => /refused: expected an OpenIGTLink header of version 1 or 2, found version 9/.test(line)));
});

test("a bridge on a port that is taken says so and ends with 2", async () => {
  const { code, stderr } = await new Promise((done) => execFile(process.execPath, [`${packageFolder}/bridge/bridge.mjs`, String(bridge.devices), "0"], (error, _, text) => done({ code: error?.code, stderr: text })));
  assert.equal(code, 2);
  assert.match(stderr, new RegExp(`port ${bridge.devices} is taken`));
});
