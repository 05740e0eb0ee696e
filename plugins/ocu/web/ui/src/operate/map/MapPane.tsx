// Where everybody is; and routes, areas and points, which operators draw for the mission.
import { useComputed, useSignal } from "@preact/signals";
import { useEffect, useRef, useState } from "preact/hooks";
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
const DetectionCard = loaded(() => import("../detections/DetectionCard"));

const SHOWS: MapShows = {
  trails: true,
  names: true,
  footprints: true,
  detections: true,
  geometries: true,
};

const AGES_MS = 500;

/** `formInside`: what is drawn is shown as numbers below the map. */
export function MapPane({ formInside }: { formInside: boolean }) {
  const { scene, fleet, geometries, followed, centred, selected, draft, middle, detection } =
    useOperating();
  const detected = useComputed(() => {
    const { all } = scene.detections.value;
    // What a replay has not come to yet is not on the map.
    return scene.mode === "live" ? all : all.filter(({ t_s }) => t_s <= scene.time.value);
  });
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
      detected: (number) => (detection.value = number),
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
      detected.subscribe((now) => made.detections.show(now)),
      detection.subscribe((number) => {
        if (number !== null) followed.value = ""; // the map would leave it at once
        made.detections.choose(number);
      }),
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
        made.detections.turn(now.detections);
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
          onFit={() => view.current?.fitAll(true)}
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
      {detection.value !== null && (
        <DetectionCard
          onLayout={(card) => view.current?.detections.clear(card.getBoundingClientRect())}
        />
      )}
      {formInside && draft.value && <DrawForm draft={draft.value} />}
      {!draft.value && versionsOf.value && (
        <VersionsPanel name={versionsOf} compared={compared} />
      )}
      <Newest />
      <Nobody />
    </Pane>
  );
}

/** What was detected last, read aloud as it comes. */
function Newest() {
  const { scene } = useOperating();
  const [before] = useState(() => scene.detections.peek().all.at(-1)?.number ?? 0);
  const newest = scene.mode === "live" ? scene.detections.value.all.at(-1) : undefined;
  const { type = "", source = "" } = newest ?? {};
  return (
    <p class="for-readers" role="status">
      {newest && newest.number > before && fill(strings.operate.detections.card, { type, source })}
    </p>
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
