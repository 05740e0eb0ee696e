// A route, area or point while it is drawn.
import type { AltitudeFrame, Geometry } from "../shared/types";

export type Kind = Geometry["kind"];

/** WGS-84 degrees, and metres in the draft's frame where they were given. */
export interface Vertex {
  latitude: number;
  longitude: number;
  altitude: number | null;
  /** Of a route: how fast vehicles go from here on, in m/s; left out: as fast as before. */
  speed?: number | null;
  /** Of a route: what its altitude is above; left out: as the draft says. */
  frame?: AltitudeFrame;
}

export interface Draft {
  kind: Kind;
  name: string;
  frame: AltitudeFrame;
  vertices: readonly Vertex[];
  /** Of an area: what it goes around. They stay as they are. */
  holes: readonly GeoJSON.Position[][];
  /** Earlier vertices, newest last. */
  before: readonly (readonly Vertex[])[];
}

export const emptyDraft = (kind: Kind): Draft => ({
  kind,
  name: "",
  frame: "relative",
  vertices: [],
  holes: [],
  before: [],
});

export function draftOf(of: Geometry): Draft {
  const { kind, name, geometry, altitude_frame: frame, speeds_m_s: speeds } = of;
  const frames = of.altitude_frames;
  const holes = geometry.type === "Polygon" ? geometry.coordinates.slice(1) : [];
  const vertices = verticesOf(geometry).map((vertex, index) => {
    const speed = speeds?.[index];
    const own = frames?.[index];
    return { ...vertex, ...(speed && { speed }), ...(own && { frame: own }) };
  });
  return { kind, name, frame, vertices, holes, before: [] };
}

const changed = (draft: Draft, vertices: readonly Vertex[]): Draft => ({
  ...draft,
  vertices,
  before: [...draft.before, draft.vertices],
});

/** A point has but one vertex: the new one takes its place. */
export function added(draft: Draft, vertex: Vertex): Draft {
  return changed(draft, draft.kind === "point" ? [vertex] : [...draft.vertices, vertex]);
}

export function moved(draft: Draft, index: number, to: Partial<Vertex>): Draft {
  return changed(
    draft,
    draft.vertices.map((vertex, at) => (at === index ? { ...vertex, ...to } : vertex)),
  );
}

export function removed(draft: Draft, index: number): Draft {
  return changed(
    draft,
    draft.vertices.filter((_, at) => at !== index),
  );
}

/** A new vertex before another one. */
export function inserted(draft: Draft, index: number, vertex: Vertex): Draft {
  return changed(draft, draft.vertices.toSpliced(index, 0, vertex));
}

/** The whole of it, by so many degrees. Holes go along. */
export function shifted(draft: Draft, latitude: number, longitude: number): Draft {
  const vertices = draft.vertices.map((each) => ({
    ...each,
    latitude: each.latitude + latitude,
    longitude: each.longitude + longitude,
  }));
  const holes = draft.holes.map((ring) =>
    ring.map(([x = 0, y = 0, ...more]) => [round(x + longitude), round(y + latitude), ...more]),
  );
  return { ...changed(draft, vertices), holes };
}

export function undone(draft: Draft): Draft {
  const vertices = draft.before.at(-1);
  return vertices ? { ...draft, vertices, before: draft.before.slice(0, -1) } : draft;
}

/** What altitudes are above, at each vertex. */
export const framesOf = ({ frame, vertices }: Draft): AltitudeFrame[] =>
  vertices.map((vertex) => vertex.frame ?? frame);

export const isMixed = (draft: Draft): boolean => new Set(framesOf(draft)).size > 1;

/** All altitudes above the same. */
export function inFrame(draft: Draft, frame: AltitudeFrame): Draft {
  return { ...draft, frame, vertices: draft.vertices.map(({ frame: _, ...vertex }) => vertex) };
}

export const LEAST: Record<Kind, number> = { route: 2, area: 3, point: 1 };

export type Problem = "vertices" | "name";

/** What keeps it from being saved. */
export function problemOf({ kind, name, vertices }: Draft): Problem | null {
  if (vertices.length < LEAST[kind]) return "vertices";
  return /^[\w.-]{1,100}$/.test(name) ? null : "name";
}

/** As the server takes it: a Feature, which says what its altitudes are above, and the speeds of a
 * route's waypoints, if any has one. */
export function featureOf(draft: Draft): GeoJSON.Feature {
  const speeds_m_s = draft.vertices.map(({ speed }) => speed ?? null);
  const hasSpeeds = draft.kind === "route" && speeds_m_s.some((speed) => speed !== null);
  const altitude_frames = framesOf(draft);
  return {
    type: "Feature",
    properties: {
      altitude_frame: altitude_frames[0] ?? draft.frame,
      ...(hasSpeeds && { speeds_m_s }),
      ...(isMixed(draft) && { altitude_frames }),
    },
    geometry: geometryOf(draft),
  };
}

export function geometryOf({ kind, vertices, holes }: Draft): GeoJSON.Geometry {
  const positions = vertices.map(({ latitude, longitude, altitude }) => {
    const flat = [round(longitude), round(latitude)];
    return altitude === null ? flat : [...flat, altitude];
  });
  switch (kind) {
    case "point":
      return { type: "Point", coordinates: positions[0]! };
    case "route":
      return { type: "LineString", coordinates: positions };
    case "area":
      return { type: "Polygon", coordinates: [[...positions, positions[0]!], ...holes] };
  }
}

function verticesOf(geometry: GeoJSON.Geometry): Vertex[] {
  switch (geometry.type) {
    case "Point":
      return [vertexOf(geometry.coordinates)];
    case "LineString":
    case "MultiPoint":
      return geometry.coordinates.map(vertexOf);
    case "Polygon":
      return (geometry.coordinates[0] ?? []).slice(0, -1).map(vertexOf);
    default:
      return [];
  }
}

const vertexOf = ([longitude = 0, latitude = 0, altitude]: GeoJSON.Position): Vertex => ({
  latitude,
  longitude,
  altitude: altitude ?? null,
});

/** A centimetre or so. */
const round = (degrees: number): number => Math.round(degrees * 1e7) / 1e7;
