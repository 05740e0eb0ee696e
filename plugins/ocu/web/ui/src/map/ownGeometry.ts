// The routes, areas and points that a mission's file has itself (m2pem:geometry, docs/missions.md).
import type { AltitudeFrame, Geometry } from "../shared/types";

const NAMESPACE = "https://m2pem.org/schema/1";
const FRAMES: readonly string[] = ["relative", "amsl", "terrain", "ellipsoid"];
const KINDS: Record<string, Geometry["kind"]> = {
  Point: "point",
  LineString: "route",
  MultiPoint: "route",
  Polygon: "area",
};

/** Of its name and its GeoJSON; undefined: it cannot be drawn, which the check says. */
export function ownGeometry(name: string, text: string): Geometry | undefined {
  try {
    const read = JSON.parse(text) as GeoJSON.Feature | GeoJSON.Geometry;
    const feature = read.type === "Feature" ? read : null;
    const geometry = feature ? feature.geometry : (read as GeoJSON.Geometry);
    const kind = KINDS[geometry.type];
    const frame = String(feature?.properties?.altitude_frame ?? "relative");
    if (!kind || !name || !FRAMES.includes(frame)) return undefined;
    if (!("coordinates" in geometry) || !isPlaced(geometry.coordinates)) return undefined;
    const altitude_frame = frame as AltitudeFrame;
    const own: Geometry = {
      name,
      kind,
      geometry,
      altitude_frame,
      from: "mission",
      by: "",
      at_us: null,
    };
    const { speeds_m_s: speeds, altitude_frames: frames } = feature?.properties ?? {};
    return {
      ...own,
      ...(Array.isArray(speeds) && { speeds_m_s: speeds as (number | null)[] }),
      ...(Array.isArray(frames) && { altitude_frames: frames as AltitudeFrame[] }),
    };
  } catch {
    return undefined;
  }
}

/** Those of a file, as its text. */
export function geometriesInFile(xml: string): Geometry[] {
  const file = new DOMParser().parseFromString(xml, "application/xml");
  return [...file.getElementsByTagNameNS(NAMESPACE, "geometry")].flatMap(
    (each) => ownGeometry(each.getAttribute("name") ?? "", each.textContent ?? "") ?? [],
  );
}

/** What tasks of a mission may name: its own stand in place of others of their names. */
export function withOwn(own: readonly Geometry[], shared: readonly Geometry[]): Geometry[] {
  const names = new Set(own.map(({ name }) => name));
  return [...own, ...shared.filter(({ name }) => !names.has(name))];
}

/** Whether all of it are numbers: Leaflet throws at anything else. */
function isPlaced(coordinates: unknown): boolean {
  if (!Array.isArray(coordinates) || coordinates.length === 0) return false;
  if (typeof coordinates[0] === "number")
    return coordinates.length >= 2 && coordinates.every((each) => Number.isFinite(each));
  return coordinates.every(isPlaced);
}
