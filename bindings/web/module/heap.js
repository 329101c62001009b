// The memory of a WebAssembly module, and the errors of the runtime in it.

const STATUS = ["ok", "truncated", "magic", "version", "section", "checksum", "content", "argument", "memory", "file", "effect"];
export const ARGUMENT = 7;
const MEMORY = 8;

/** The reason why a bundle or a scene was refused. */
export class PalpateError extends Error {
  /** @param {number} status @param {string} text @param {number} byteOffset */
  constructor(status, text, byteOffset = 0) {
    super(text);
    this.name = "PalpateError";
    /** a word of palpate_status: "truncated", "magic", "checksum", ... */
    this.status = STATUS[status] ?? String(status);
    /** where in the bundle, or 0 */
    this.byteOffset = byteOffset;
  }
}

/** @param {any} api @param {Heap} heap @returns {Map<string, number>} */
export function readFields(api, heap) {
  const fields = new Map();
  for (let at = api.palpate_web_fields() >>> 0; heap.u32(at) !== 0; at += 8) fields.set(heap.text(heap.u32(at)), heap.i32(at + 4));
  return fields;
}

// The module's memory. Growing it detaches all arrays over it, so they are created again where the buffer has changed.
export class Heap {
  #data = new DataView(new ArrayBuffer(0));
  #bytes = new Uint8Array(0);

  /** @param {any} api */
  constructor(api) {
    this.api = api;
  }
  /** @returns {ArrayBuffer} */
  get buffer() {
    return this.api.memory.buffer;
  }
  get data() {
    if (this.#data.buffer !== this.buffer) this.#data = new DataView(this.buffer);
    return this.#data;
  }
  get bytes() {
    if (this.#bytes.buffer !== this.buffer) this.#bytes = new Uint8Array(this.buffer);
    return this.#bytes;
  }
  /** @param {number} bytes @returns {number} */
  take(bytes) {
    const at = this.api.malloc(bytes) >>> 0;
    if (at === 0)
      throw new PalpateError(MEMORY, `${bytes} bytes are more memory than the browser gives this page; make the bundle smaller with palpate-bundle pack`);
    return at;
  }
  /** @param {number} bytes @returns {number} */
  takeZeros(bytes) {
    const at = this.take(bytes);
    this.bytes.fill(0, at, at + bytes);
    return at;
  }
  /** @param {number} at */
  release(at) {
    this.api.free(at);
  }
  /** @param {number} at */
  u32(at) {
    return this.data.getUint32(at, true);
  }
  /** @param {number} at */
  i32(at) {
    return this.data.getInt32(at, true);
  }
  /** Text up to a zero. @param {number} at */
  text(at) {
    return this.utf8(at, this.bytes.indexOf(0, at) - at);
  }
  /** @param {number} at @param {number} count */
  utf8(at, count) {
    return new TextDecoder().decode(this.bytes.subarray(at, at + count));
  }
}

// The bytes of a bundle in the module's memory, 64-byte aligned as palpate_bundle_open demands. Grows where more bytes arrive than
// expected.
export class HeapBytes {
  /** @param {Heap} heap @param {number} capacity */
  constructor(heap, capacity) {
    this.heap = heap;
    this.count = 0;
    this.capacity = capacity;
    this.memory = heap.take(capacity + 64);
    this.start = Math.ceil(this.memory / 64) * 64;
  }
  /** @param {Uint8Array} bytes */
  append(bytes) {
    if (this.count + bytes.length > this.capacity) {
      const wider = new HeapBytes(this.heap, Math.max(2 * this.capacity, this.count + bytes.length));
      this.heap.bytes.copyWithin(wider.start, this.start, this.start + this.count);
      this.release();
      wider.count = this.count;
      Object.assign(this, wider);
    }
    this.heap.bytes.set(bytes, this.start + this.count);
    this.count += bytes.length;
  }
  release() {
    this.heap.release(this.memory);
  }
}
