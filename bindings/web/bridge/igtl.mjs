// The messages of OpenIGTLink that a device and the viewer exchange, as palpate-igtl reads and writes them
// (programs/link/igtl_messages.h): TRANSFORM in, SENSOR and STRING out. OpenIGTLink speaks RAS and millimetres, the page LPS and metres.

const HEADER = 58, MOST_BODY = 65536, EXTENDED = 12; // bytes
const FLIP = [-1, -1, 1]; // LPS <-> RAS
const NEWTON = (0x0bn << 54n) | (1n << 50n); // the protocol's word for the unit
const FARTHEST = 1e8; // mm
const ASCII = 3;

/** @typedef {{kind: "pose", tool: string, position: number[]} | {kind: "refused", why: string, closing: boolean}} Request
 *  position: x y z, m, LPS. closing: the bytes that follow cannot be told apart any more. */

/** A client's bytes, which come in any pieces, as messages. Types other than TRANSFORM are skipped without being stored. */
export class IgtlStream {
  #held = Buffer.alloc(0);
  #skip = 0; // bytes

  /** @param {Buffer} bytes @returns {Generator<Request>} */
  *take(bytes) {
    this.#held = this.#held.length ? Buffer.concat([this.#held, bytes]) : bytes;
    for (;;) {
      const skipped = Math.min(this.#skip, this.#held.length);
      this.#held = this.#held.subarray(skipped);
      this.#skip -= skipped;
      if (this.#held.length < HEADER) return;
      const version = this.#held.readUInt16BE(0), type = text(this.#held, 2, 12), tool = text(this.#held, 14, 20), body = Number(this.#held.readBigUInt64BE(42));
      const cannot = version !== 1 && version !== 2 ? `expected an OpenIGTLink header of version 1 or 2, found version ${version}`
        : type === "TRANSFORM" && body > MOST_BODY ? `expected a TRANSFORM of at most ${MOST_BODY} bytes, found ${body}` : "";
      if (cannot) return yield { kind: "refused", why: cannot, closing: true };
      if (type !== "TRANSFORM") {
        this.#skip = HEADER + body;
        continue;
      }
      if (this.#held.length < HEADER + body) return;
      const message = this.#held.subarray(HEADER, HEADER + body), crc = this.#held.readBigUInt64BE(50);
      this.#held = this.#held.subarray(HEADER + body);
      yield readTransform(message, version, crc, tool);
    }
  }
}

/** @param {Buffer} body @param {number} version @param {bigint} crc @param {string} tool @returns {Request} */
function readTransform(body, version, crc, tool) {
  const refuse = (/** @type {string} */ why) => /** @type {Request} */ ({ kind: "refused", why: `TRANSFORM of "${tool}": ${why}`, closing: false });
  if (crc64(body) !== crc) return refuse("its checksum does not fit its body");
  const content = version === 1 ? body : withoutExtension(body);
  if (!content) return refuse("its extended header does not fit its body");
  if (content.length !== 48) return refuse(`expected 48 bytes of content, found ${content.length}`);
  const numbers = Array.from({ length: 12 }, (_, i) => content.readFloatBE(4 * i));
  if (!numbers.every((x) => Math.abs(x) <= FARTHEST)) return refuse("expected finite numbers, positions within 100 km");
  return { kind: "pose", tool, position: FLIP.map((sign, d) => (sign * numbers[9 + d]) / 1000) };
}

/** The content between the extended header and the metadata of version 2. @param {Buffer} body @returns {Buffer | null} */
function withoutExtension(body) {
  if (body.length < EXTENDED) return null;
  const head = body.readUInt16BE(0), end = body.length - body.readUInt16BE(2) - body.readUInt32BE(4);
  return head < EXTENDED || head > end ? null : body.subarray(head, end);
}

/** The force of the organ on a tool: a SENSOR with three numbers in newtons, and a STRING with the same ones. @param {string} tool
 *  @param {number[]} force N, LPS @returns {Buffer} */
export function forceMessages(tool, force) {
  const turned = force.map((x, d) => FLIP[d] * x), sensor = Buffer.alloc(34);
  sensor.writeUInt8(3, 0);
  sensor.writeBigUInt64BE(NEWTON, 2);
  turned.forEach((x, d) => sensor.writeDoubleBE(x, 10 + 8 * d));
  const words = Buffer.from(`${turned.map((x) => Number(x.toPrecision(6))).join(" ")} N`), string = Buffer.alloc(4);
  string.writeUInt16BE(ASCII, 0);
  string.writeUInt16BE(words.length, 2);
  return Buffer.concat([message("SENSOR", tool, sensor), message("STRING", tool, Buffer.concat([string, words]))]);
}

/** A message of header version 1. @param {string} type @param {string} device @param {Buffer} body @returns {Buffer} */
export function message(type, device, body) {
  const header = Buffer.alloc(HEADER), now = Date.now();
  header.writeUInt16BE(1, 0);
  header.write(type, 2, 12, "ascii");
  header.write(device, 14, 20, "ascii");
  header.writeUInt32BE(Math.floor(now / 1000), 34);
  header.writeUInt32BE(Math.floor(((now % 1000) / 1000) * 2 ** 32), 38);
  header.writeBigUInt64BE(BigInt(body.length), 42);
  header.writeBigUInt64BE(crc64(body), 50);
  return Buffer.concat([header, body]);
}

// A name ends at a zero or at the end of its field.
function text(/** @type {Buffer} */ bytes, /** @type {number} */ at, /** @type {number} */ size) {
  const field = bytes.subarray(at, at + size), end = field.indexOf(0);
  return field.toString("latin1", 0, end < 0 ? size : end);
}

const POLYNOMIAL = 0x42f0e1eba9ea3693n, WORD = 2n ** 64n - 1n; // CRC-64 of ECMA-182
const TABLE = BigUint64Array.from({ length: 256 }, (_, i) => {
  let crc = BigInt(i) << 56n;
  for (let bit = 0; bit < 8; ++bit) crc = ((crc << 1n) & WORD) ^ (crc >> 63n ? POLYNOMIAL : 0n);
  return crc;
});

/** @param {Uint8Array} bytes @returns {bigint} */
export function crc64(bytes) {
  let crc = 0n;
  for (const byte of bytes) crc = ((crc << 8n) & WORD) ^ TABLE[Number(crc >> 56n) ^ byte];
  return crc;
}
