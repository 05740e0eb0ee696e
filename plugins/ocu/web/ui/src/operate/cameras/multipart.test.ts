import { describe, expect, it } from "vitest";
import { Multipart } from "./multipart";

const bytes = (text: string) => new TextEncoder().encode(text);
const read = (boundary: string, stream: string, size: number): string[] => {
  const parts = new Multipart(boundary);
  const whole = bytes(stream);
  const found: string[] = [];
  for (let at = 0; at < whole.length; at += size) {
    for (const part of parts.push(whole.slice(at, at + size))) found.push(new TextDecoder().decode(part));
  }
  return found;
};

const withLengths = ["one", "--b is in it", "three"]
  .map((body) => `--b\r\nContent-Type: image/jpeg\r\nContent-Length: ${body.length}\r\n\r\n${body}\r\n`)
  .join("");
const without = ["one", "two"].map((body) => `--b\r\nX: y\r\n\r\n${body}\r\n`).join("") + "--b--\r\n";

describe("parts of Motion JPEG", () => {
  it.each([1, 3, 1000])("are read in chunks of %d bytes", (size) => {
    expect(read("b", withLengths, size)).toEqual(["one", "--b is in it", "three"]);
    expect(read("--b", without, size)).toEqual(["one", "two"]);
  });

  it("are not kept without end", () => {
    const parts = new Multipart("b");
    parts.push(new Uint8Array(10_000_000));
    expect(() => parts.push(new Uint8Array(10_000_000))).toThrow("no boundary");
  });
});
