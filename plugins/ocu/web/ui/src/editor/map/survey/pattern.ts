// A survey as its form has it, as the server takes it, and as the mission's file keeps it.
import type { AltitudeFrame } from "../../../shared/types";

export interface Camera {
  sensor_width_mm: number;
  sensor_height_mm: number;
  focal_length_mm: number;
  image_width_px: number;
  image_height_px: number;
}

export interface KnownCamera extends Camera {
  name: string;
}

/** `POST /api/survey-patterns`, with the names of areas (docs/survey-patterns.md). */
export interface Pattern {
  area: string;
  spacing_m?: number;
  camera?: Camera & { front_overlap: number; side_overlap: number };
  altitude_m: number | null;
  altitude_frame: AltitudeFrame;
  /** Null: that with the fewest turns. */
  heading_deg: number | null;
  margin_m: number;
  turn_around_m: number;
  corner: number;
  cross_hatch: boolean;
  keep_out: string[];
  clearance_m: number;
  vehicles: string[];
  speed_m_s: number | null;
}

/** The answer; see the server's SurveyRoutesModel. */
export interface SurveyRoutes {
  spacing_m: number;
  best_heading_deg: number;
  trigger_distance_m: number | null;
  ground_resolution_m: number | null;
  routes: SurveyRoute[];
  problems: string[];
}

export interface SurveyRoute {
  vehicle: string;
  geojson: GeoJSON.Feature<GeoJSON.LineString | GeoJSON.MultiPoint>;
  passes: number;
  length_m: number;
  surveyed_m: number;
  time_s: number | null;
  lasts_s: number | null;
  battery_fraction: number | null;
  images: number | null;
}

const SPACING_M = 20;
const ALTITUDE_M = 40;

export const CAMERA: Pattern["camera"] = {
  sensor_width_mm: 13.2,
  sensor_height_mm: 8.8,
  focal_length_mm: 8.8,
  image_width_px: 5472,
  image_height_px: 3648,
  front_overlap: 0.75,
  side_overlap: 0.65,
};

export const patternOf = (area: string): Pattern => ({
  area,
  spacing_m: SPACING_M,
  altitude_m: ALTITUDE_M,
  altitude_frame: "relative",
  heading_deg: null,
  margin_m: 0,
  turn_around_m: 0,
  corner: 0,
  cross_hatch: false,
  keep_out: [],
  clearance_m: 0,
  vehicles: [],
  speed_m_s: null,
});

/** With a camera in place of a distance, or the other way round; both are remembered by who asks. */
export function spacedBy(pattern: Pattern, by: "spacing" | "camera", other?: Pattern): Pattern {
  const { spacing_m, camera, ...rest } = pattern;
  if (by === "spacing") return { ...rest, spacing_m: spacing_m ?? other?.spacing_m ?? SPACING_M };
  return {
    ...rest,
    camera: camera ?? other?.camera ?? CAMERA!,
    altitude_m: rest.altitude_m ?? ALTITUDE_M,
    altitude_frame: rest.altitude_frame === "amsl" ? "relative" : rest.altitude_frame,
  };
}

/** What the file has; null: it is none that this page can change. */
export function readPattern(text: string): Pattern | null {
  try {
    const read = JSON.parse(text) as Partial<Pattern> | null;
    if (typeof read?.area !== "string") return null;
    if ((read.spacing_m === undefined) === (read.camera === undefined)) return null;
    const { spacing_m: _, ...usual } = patternOf(read.area);
    return { ...usual, ...read };
  } catch {
    return null;
  }
}

export const writePattern = (pattern: Pattern): string => JSON.stringify(pattern);

/** The text with a new name of an area; null: it does not name that one. */
export function renamedIn(text: string, before: string, name: string): string | null {
  const pattern = readPattern(text);
  if (!pattern || !namesArea(pattern, before)) return null;
  const renamed = (each: string) => (each === before ? name : each);
  return writePattern({
    ...pattern,
    area: renamed(pattern.area),
    keep_out: pattern.keep_out.map(renamed),
  });
}

export const namesArea = ({ area, keep_out }: Pattern, name: string): boolean =>
  area === name || keep_out.includes(name);

/** What the server is asked: areas of the mission are not saved yet, so each goes as GeoJSON. Null:
 * there is no such area. */
export function requestOf(
  pattern: Pattern,
  find: (name: string) => GeoJSON.Geometry | undefined,
): object | string {
  for (const name of [pattern.area, ...pattern.keep_out]) if (!find(name)) return name;
  return {
    ...pattern,
    area: find(pattern.area),
    keep_out: pattern.keep_out.map(find),
  };
}
