// Splits a stream of multipart/x-mixed-replace into its parts, as Motion JPEG has them.

/** A part that is larger is no picture. */
const MOST_BYTES = 16_000_000;

const text = new TextDecoder("latin1");
const bytes = new TextEncoder();

export class Multipart {
  private buffer = new Uint8Array(0);
  private readonly delimiter: Uint8Array;

  /** `boundary`: of the content type, with or without its leading hyphens. */
  constructor(boundary: string) {
    this.delimiter = bytes.encode(`--${boundary.replace(/^--/, "")}`);
  }

  /** The parts that are whole now. Throws an Error if the stream has none. */
  push(chunk: Uint8Array): Uint8Array[] {
    const joined = new Uint8Array(this.buffer.length + chunk.length);
    joined.set(this.buffer);
    joined.set(chunk, this.buffer.length);
    this.buffer = joined;
    const found: Uint8Array[] = [];
    for (;;) {
      const part = this.next();
      if (!part) break;
      found.push(part);
    }
    if (this.buffer.length > MOST_BYTES) throw new Error("no boundary");
    return found;
  }

  private next(): Uint8Array | null {
    const begin = indexOf(this.buffer, this.delimiter, 0);
    const head = begin < 0 ? -1 : indexOf(this.buffer, HEAD_END, begin);
    if (head < 0) return null;
    const from = head + HEAD_END.length;
    const headers = text.decode(this.buffer.subarray(begin, head));
    const length = /^content-length:\s*(\d+)/im.exec(headers)?.[1];
    const to = length === undefined ? this.untilDelimiter(from) : from + Number(length);
    if (to === null || to > this.buffer.length) return null;
    const part = this.buffer.slice(from, to);
    this.buffer = this.buffer.slice(to);
    return part;
  }

  private untilDelimiter(from: number): number | null {
    const at = indexOf(this.buffer, this.delimiter, from);
    if (at < 0) return null;
    const endsLine = this.buffer[at - 2] === 13 && this.buffer[at - 1] === 10;
    return endsLine ? at - 2 : at;
  }
}

const HEAD_END = bytes.encode("\r\n\r\n");

function indexOf(whole: Uint8Array, part: Uint8Array, from: number): number {
  for (let at = whole.indexOf(part[0]!, from); at >= 0; at = whole.indexOf(part[0]!, at + 1)) {
    if (part.every((byte, index) => whole[at + index] === byte)) return at;
  }
  return -1;
}
