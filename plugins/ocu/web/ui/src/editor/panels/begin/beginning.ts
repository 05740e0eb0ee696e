// What a run begins with, be it verified, rehearsed or started: a process, and data.
import { signal } from "@preact/signals";
import type { Outline } from "../../../shared/types";
import { keptOf } from "../kept";
import type { EditorContext } from "../panel";
import { readValue, type Value } from "./values";

export interface Given {
  name: string;
  written: string;
}

export class Beginning {
  /** "": the one that the mission says. */
  readonly process = signal("");
  readonly given = signal<readonly Given[]>([]);

  /** As the server takes it. */
  request(): { process?: string; data?: Record<string, Value> } {
    const rows = this.given.value.filter(({ name }) => name.trim() !== "");
    const data = Object.fromEntries(
      rows.map((row) => [row.name.trim(), readValue(row.written).value]),
    );
    return {
      ...(this.process.value ? { process: this.process.value } : {}),
      ...(rows.length ? { data } : {}),
    };
  }

  /** Whether all that was typed can be read. */
  isReadable(): boolean {
    return this.given.value.every((_, index) => problemOf(this.given.value, index) === undefined);
  }
}

export type GivenProblem = "name" | "twice" | "value";

const NAME = /^[\p{L}_][\p{L}\p{N}_]*(?:[.-][\p{L}\p{N}_]+)*$/u;

/** What is wrong with a row. One that is empty altogether is left out. */
export function problemOf(rows: readonly Given[], index: number): GivenProblem | undefined {
  const row = rows[index];
  if (!row) return undefined;
  const name = row.name.trim();
  if (name === "") return row.written.trim() === "" ? undefined : "name";
  if (!NAME.test(name)) return "name";
  if (rows.some((other, at) => at < index && other.name.trim() === name)) return "twice";
  return readValue(row.written).kind === "unreadable" ? "value" : undefined;
}

/** Names that the mission reads and nothing in it writes, as far as they are not given yet. */
export function wanted(outline: Outline | null, rows: readonly Given[]): string[] {
  const given = new Set(rows.map(({ name }) => name.trim()));
  const names = outline?.names ?? [];
  const written = new Set(names.filter(({ from }) => from !== "").map(({ name }) => name));
  const missing = names
    .map(({ name }) => name)
    .filter((name) => !written.has(name) && !given.has(name));
  return [...new Set(missing)];
}

export const beginningOf = (editor: EditorContext): Beginning =>
  keptOf(editor, "beginning", () => new Beginning());
