// Values as people write them, read as YAML 1.2 reads a plain scalar: as `--data name=value` does.
export type Value = null | boolean | number | string | Value[] | { [key: string]: Value };

export type Kind = "nothing" | "yesno" | "number" | "text" | "list" | "map" | "unreadable";

export interface Read {
  kind: Kind;
  value: Value;
}

const INTEGER = /^[-+]?\d+$/;
const BASED = /^0(?:o[0-7]+|x[0-9a-fA-F]+)$/;
const FLOAT = /^[-+]?(?:\.\d+|\d+(?:\.\d*)?)(?:[eE][-+]?\d+)?$/;
const UNREADABLE: Read = { kind: "unreadable", value: null };

export function readValue(written: string): Read {
  const text = written.trim();
  if (text === "" || text === "~" || /^null$/i.test(text)) return { kind: "nothing", value: null };
  if (/^(true|True|TRUE)$/.test(text)) return { kind: "yesno", value: true };
  if (/^(false|False|FALSE)$/.test(text)) return { kind: "yesno", value: false };
  if (INTEGER.test(text) || FLOAT.test(text) || BASED.test(text)) {
    const value = Number(text.replace(/^\+/, ""));
    return Number.isFinite(value) ? { kind: "number", value } : UNREADABLE;
  }
  if (text.startsWith("'")) return singleQuoted(text);
  if (text.startsWith('"') || text.startsWith("[") || text.startsWith("{")) return nested(text);
  return { kind: "text", value: text };
}

function singleQuoted(text: string): Read {
  const inner = /^'((?:[^']|'')*)'$/.exec(text)?.[1];
  return inner === undefined ? UNREADABLE : { kind: "text", value: inner.replaceAll("''", "'") };
}

function nested(text: string): Read {
  try {
    const value = JSON.parse(text) as Value;
    if (typeof value === "string") return { kind: "text", value };
    return { kind: Array.isArray(value) ? "list" : "map", value };
  } catch {
    return UNREADABLE;
  }
}

/** How YAML is to be written so that it reads as this value. */
export function writtenValue(value: Value): string {
  if (typeof value !== "string") return JSON.stringify(value);
  const isPlain = /^[\p{L}_][\p{L}\p{N}_./-]*$/u.test(value) && readValue(value).kind === "text";
  return isPlain ? value : JSON.stringify(value);
}
