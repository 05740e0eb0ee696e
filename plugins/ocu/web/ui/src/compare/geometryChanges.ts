// What is other in a later version about the routes, areas and points of a mission's file.
import { draftOf, type Vertex } from "../map/draft";
import { distance_m, length_m, writtenLength } from "../map/measure";
import type { Geometry } from "../shared/types";
import { counted, fill, strings } from "../strings";
import type { ChangeKind } from "./changes";

const words = strings.compare;

/** Nearer ones are in the same place: files have seven decimals of a degree. */
const SAME_M = 0.05;

export interface GeometryChange {
  kind: Exclude<ChangeKind, "moved"> | "same";
  name: string;
  before: Geometry | null;
  after: Geometry | null;
  /** Vertices that are in one of both alone: of a moved one, its old place and its new one. */
  gone: Vertex[];
  come: Vertex[];
  details: string[];
}

export function geometryChanges(
  before: readonly Geometry[],
  after: readonly Geometry[],
): GeometryChange[] {
  const names = [...new Set([...after, ...before].map(({ name }) => name))];
  const one = (all: readonly Geometry[], name: string) =>
    all.find((each) => each.name === name) ?? null;
  return names.map((name) => changeOf(name, one(before, name), one(after, name)));
}

function changeOf(name: string, before: Geometry | null, after: Geometry | null): GeometryChange {
  const old = before ? draftOf(before).vertices : [];
  const now = after ? draftOf(after).vertices : [];
  if (!before || !after) {
    const kind = before ? "removed" : "added";
    return { kind, name, before, after, gone: [], come: [], details: [] };
  }
  const gone = without(old, now);
  const come = without(now, old);
  const details: string[] = [];
  if (before.kind !== after.kind) {
    const [one, other] = [words.geometries[before.kind], words.geometries[after.kind]];
    details.push(`${one} → ${other}`);
  }
  const moved = Math.min(gone.length, come.length);
  if (moved > 0) details.push(counted(words.vertices, moved));
  if (come.length > moved) details.push(counted(words.more, come.length - moved));
  if (gone.length > moved) details.push(counted(words.fewer, gone.length - moved));
  if (before.altitude_frame !== after.altitude_frame) {
    const frames = { before: before.altitude_frame, after: after.altitude_frame };
    details.push(fill(words.frame, frames));
  }
  const heights = (all: readonly Vertex[]) => all.map(({ altitude, frame }) => [altitude, frame]).join();
  if (details.length === 0 && heights(old) !== heights(now)) details.push(words.altitudes);
  const isClosed = after.kind === "area";
  const lengths = [old, now].map((all) => writtenLength(length_m(all, isClosed)));
  if (details.length > 0 && lengths[0] !== lengths[1]) {
    details.push(fill(words.length, { before: lengths[0]!, after: lengths[1]! }));
  }
  const isSame = JSON.stringify(before.geometry) === JSON.stringify(after.geometry);
  const kind = details.length === 0 && isSame ? "same" : "changed";
  return { kind, name, before, after, gone, come, details };
}

const without = (all: readonly Vertex[], others: readonly Vertex[]): Vertex[] =>
  all.filter((each) => others.every((other) => distance_m(each, other) > SAME_M));
