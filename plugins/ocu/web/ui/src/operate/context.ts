// What all parts of the page look at together.
import { signal, type Signal } from "@preact/signals";
import { createContext } from "preact";
import { useContext } from "preact/hooks";
import type { Fleet, Geometry } from "../shared/types";
import type { Draft, Vertex } from "../map/draft";
import type { MissionModel } from "./mission/missionModel";
import type { Range } from "./plots/series";
import type { Scene } from "./scene/scene";

export interface Place {
  process: string;
  element: string;
}

export interface OperateContext {
  scene: Scene;
  mission: MissionModel;
  fleet: Fleet;
  geometries: Signal<Geometry[]>;
  /** The element that everybody looks at; `show`: bring it into view. */
  selected: Signal<(Place & { show: boolean }) | null>;
  /** Elements that something is about, which the diagram surrounds. */
  surrounded: Signal<readonly Place[]>;
  /** A vehicle that the map follows; "": none. */
  followed: Signal<string>;
  /** A vehicle that the map shows, once; a new object each time. */
  centred: Signal<{ resource: string } | null>;
  /** The number of the detection that is looked at; null: none. */
  detection: Signal<number | null>;
  /** What the time line and the plots show of the run's time; null: all of it. */
  range: Signal<Range | null>;
  /** The time that is pointed at, on the time line or the plots. */
  pointed: Signal<number | null>;
  /** What is drawn on the map. */
  draft: Signal<Draft | null>;
  /** The middle of the map, while there is one. */
  middle: { current: () => Vertex };
  /** Show the run from its records, once it is over. */
  replay: () => void;
}

const Operating = createContext<OperateContext | null>(null);

export const OperatingProvider = Operating.Provider;

export function useOperating(): OperateContext {
  const found = useContext(Operating);
  if (!found) throw new Error("there is no run around this");
  return found;
}

export function operateContext(
  parts: Pick<OperateContext, "scene" | "mission" | "fleet" | "geometries" | "replay">,
): OperateContext {
  const { lat: latitude, lon: longitude } = parts.fleet.origin;
  return {
    ...parts,
    middle: { current: () => ({ latitude, longitude, altitude: null }) },
    selected: signal(null),
    surrounded: signal([]),
    followed: signal(""),
    centred: signal(null),
    detection: signal(null),
    range: signal(null),
    pointed: signal(null),
    draft: signal(null),
  };
}
