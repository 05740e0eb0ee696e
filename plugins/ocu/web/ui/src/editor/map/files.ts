// Files of drawings that come in and go out.
import { post, postForFile } from "../../shared/api";
import { toast } from "../../shared/Toasts";
import { featureOf, draftOf, type Kind } from "../../map/draft";
import { fill, strings } from "../../strings";
import type { EditorContext } from "../panels/panel";
import { download } from "../session/pictures";
import type { Incoming, MapPlan } from "./plan";

const words = strings.plan;

export const FORMATS = ["geojson", "kml", "csv", "plan", "waypoints"] as const;
export type Format = (typeof FORMATS)[number];

interface Read {
  geometries: { name: string; kind: Kind; geojson: GeoJSON.Feature }[];
  problems: { feature: string; message: string; remedy: string }[];
}

/** Shows what is in a file, to be taken or not. */
export async function readFile(plan: MapPlan, file: File): Promise<void> {
  try {
    const read = await post<Read>(`/geometry-files/read?name=${encodeURIComponent(file.name)}`, file);
    if (read.geometries.length === 0 && read.problems.length === 0) {
      toast(fill(words.nothingIn, { file: file.name }), "bad");
      return;
    }
    plan.cancel();
    plan.incoming.value = incomingOf(plan, file.name, read);
  } catch (error) {
    const reason = error instanceof Error ? error.message : String(error);
    toast(fill(words.importFailed, { file: file.name, reason }), "bad");
  }
}

/** With names that are free. */
export function incomingOf(plan: MapPlan, file: string, read: Read): Incoming {
  const taken: string[] = [];
  const drawings = read.geometries.map(({ name, kind, geojson: feature }) => {
    const isFree = plan.isFree(name) && !taken.includes(name);
    const free = isFree ? name : plan.freeName(`${name}-`, taken);
    taken.push(free);
    return { name: free, kind, feature, taken: true };
  });
  const problems = read.problems.map(({ feature, message, remedy }) =>
    [feature && `${feature}: `, message, remedy && `; ${remedy}`].join(""),
  );
  return { file, drawings, problems };
}

/** All that the map shows, in one file. */
export async function exportAs({ catalogue, mission }: EditorContext, format: Format): Promise<void> {
  const geometries = catalogue.geometries.value.map((each) => ({
    name: each.name,
    geojson: featureOf(draftOf(each)),
  }));
  try {
    const content = await postForFile("/geometry-files/export", { format, geometries });
    download(`${mission}.${format}`, content);
  } catch (error) {
    const reason = error instanceof Error ? error.message : String(error);
    toast(fill(words.exportFailed, { reason }), "bad");
  }
}
