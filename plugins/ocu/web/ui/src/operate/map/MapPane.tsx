// Where everybody is; and routes, areas and points, which operators draw for the mission.
import { useComputed, useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { clock, STALE_S } from "../../shared/format";
import { unknownSince } from "../../shared/executive";
import { remember, remembered } from "../../shared/memory";
import { may, session } from "../../shared/session";
import { loaded } from "../../shared/loaded";
import { fill, strings } from "../../strings";
import { useOperating } from "../context";
import { Pane } from "../layout/Pane";
import { resources } from "../vehicles/resources";
import { workOf } from "../vehicles/work";
import { DrawForm } from "./DrawForm";
import { added, draftOf, emptyDraft, moved, type Kind } from "../../map/draft";
import { MapTools, type MapShows } from "./MapTools";
import { VehicleList } from "../../map/VehicleList";
import { MapView } from "./mapView";
import type { VehicleMark } from "./vehicleLayer";
import "./map.css";

const text = strings.operate.map;

/** Few operators look at it in a run. */
const VersionsPanel = loaded(() => import("./VersionsPanel"));

const SHOWS: MapShows = { trails: true, names: true, footprints: true, geometries: true };
const AGES_MS = 500;

/** `formInside`: what is drawn is shown as numbers below the map. */
export function MapPane({ formInside }: { formInside: boolean }) {
  const { scene, fleet, geometries, followed, centred, selected, draft, middle } = useOperating();
  const host = useRef<HTMLDivElement>(null);
  const view = useRef<MapView>();
  const listed = useSignal<readonly VehicleMark[]>([]);
  const versionsOf = useSignal("");
  const compared = useSignal<GeoJSON.Geometry | null>(null);
  const shows = useSignal<MapShows>({ ...SHOWS, ...remembered<Partial<MapShows>>("map", {}) });

  useEffect(() => {
    const made = new MapView(host.current!, fleet, session.peek()?.tiles ?? null, {
      chosen: (resource) => {
        const [work] = workOf(resource, scene.commands.peek());
        if (work) selected.value = { ...work.command, show: true };
      },
      clicked: (vertex) => {
        if (draft.value) draft.value = added(draft.value, vertex);
      },
      dragged: (index, { latitude, longitude }) => {
        if (draft.value) draft.value = moved(draft.value, index, { latitude, longitude });
      },
      moved: () => (followed.value = ""),
    });
    view.current = made;
    middle.current = () => made.middle();
    let fitted = false;
    const stops = [
      geometries.subscribe((now) => {
        made.showGeometries(now);
        if (!fitted) made.fitAll();
      }),
      resources.subscribe((now) => made.showSpaces(now.shared_space)),
      scene.vehicles.subscribe((states) => {
        made.vehicles.vehicles(states, scene.pace.peek());
        if (!fitted && made.vehicles.positions().length > 0) {
          made.fitAll();
          fitted = true;
        }
        if (followed.value) made.follow(followed.value);
      }),
      scene.jumps.subscribe(() => made.vehicles.retrace((resource) => scene.trail(resource))),
      scene.payloads.subscribe((states) => made.vehicles.payloads(states)),
      made.vehicles.listed.subscribe((now) => (listed.value = now)),
      followed.subscribe((resource) => {
        made.vehicles.choose(resource);
        made.centre(resource);
      }),
      centred.subscribe((wanted) => wanted && made.centre(wanted.resource)),
      draft.subscribe((now) => made.draw(now)),
      compared.subscribe((now) => made.compare(now)),
      shows.subscribe((now) => {
        made.vehicles.show(now);
        made.turnGeometries(now.geometries);
        remember("map", now);
      }),
    ];
    const aging = setInterval(() => {
      made.vehicles.ages((resource) => {
        if (scene.mode === "live" && unknownSince.peek() !== null) return "unknown";
        return (scene.silentFor_s(resource) ?? Infinity) > STALE_S ? "stale" : "current";
      });
    }, AGES_MS);
    return () => {
      clearInterval(aging);
      for (const stop of stops) stop();
      made.dispose();
    };
  }, [scene, fleet]);

  return (
    <Pane
      title={strings.operate.panes.map}
      class="map-pane"
      tools={
        <MapTools
          fleet={fleet}
          followed={followed}
          shows={shows}
          geometries={geometries.value}
          mayDraw={may("operator") && draft.value === null}
          onFit={() => view.current?.fitAll()}
          onDraw={(kind: Kind) => (draft.value = emptyDraft(kind))}
          onEdit={(geometry) => (draft.value = draftOf(geometry))}
          onVersions={(name) => (versionsOf.value = name)}
        />
      }
    >
      <div
        ref={host}
        class="map"
        role="application"
        aria-label={text.label}
        onKeyDown={(event) => {
          if (!draft.value) return;
          if (event.key === "Escape" && !event.shiftKey) draft.value = null;
        }}
      />
      <VehicleList vehicles={listed} />
      {formInside && draft.value && <DrawForm draft={draft.value} />}
      {!draft.value && versionsOf.value && (
        <VersionsPanel name={versionsOf} compared={compared} />
      )}
      <Nobody />
    </Pane>
  );
}

/** Why a replay shows no vehicles. */
function Nobody() {
  const { scene } = useOperating();
  const early = useComputed(() => scene.time.value < scene.knownFrom_s);
  const why = scene.telemetryProblem && fill(text.problem, { problem: scene.telemetryProblem });
  if (!early.value) return why ? <p class="map-nobody">{why}</p> : null;
  const known = scene.hasTelemetry
    ? fill(text.notKnownYet, { time: clock(scene.knownFrom_s) })
    : text.notKnown;
  return <p class="map-nobody">{[known, why].filter(Boolean).join(" ")}</p>;
}
