// How high a route is above the ground: a plot that follows the route as it changes, and a way to let
// the route follow the ground.
import { useSignal } from "@preact/signals";
import { useEffect, useMemo, useState } from "preact/hooks";
import { draftOf, featureOf, type Vertex } from "../../../map/draft";
import { writtenLength } from "../../../map/measure";
import { post } from "../../../shared/api";
import { Latest } from "../../../shared/latest";
import { remember, remembered } from "../../../shared/memory";
import { toast } from "../../../shared/Toasts";
import type { Geometry } from "../../../shared/types";
import { fill, strings } from "../../../strings";
import type { EditorContext } from "../../panels/panel";
import { NumberField } from "../survey/fields";
import { plotOf, type Profile } from "./profile";
import "./terrain.css";

const words = strings.terrain;
const PAUSE_MS = 300;
const SIZE = [600, 110] as const;
const OPEN = "editor-terrain";

type Found = { profile: Profile } | { problem: string } | null;

export function TerrainProfile({ editor, geometry }: { editor: EditorContext; geometry: Geometry }) {
  const isOpen = useSignal(remembered(OPEN, false));
  const found = useSignal<Found>(null);
  const latest = useMemo(
    () =>
      new Latest<GeoJSON.Feature, Profile>(
        (route) => post("/terrain/profile", { route }),
        {
          answer: (profile) => (found.value = { profile }),
          failed: (error) => (found.value = { problem: reasonOf(error) }),
        },
        PAUSE_MS,
      ),
    [],
  );
  useEffect(() => () => latest.end(), [latest]);
  useEffect(() => {
    if (isOpen.value) latest.soon(featureOf(draftOf(geometry)));
    else latest.clear();
  }, [geometry, isOpen.value]);
  return (
    <details
      class="terrain"
      open={isOpen.value}
      onToggle={({ currentTarget }) => {
        isOpen.value = currentTarget.open;
        remember(OPEN, currentTarget.open);
      }}
    >
      <summary>{words.title}</summary>
      {isOpen.value && <Shown found={found.value} />}
      {isOpen.value && geometry.from === "mission" && <Follow editor={editor} geometry={geometry} />}
    </details>
  );
}

function Shown({ found }: { found: Found }) {
  if (!found) return <p role="status">{words.working}</p>;
  if ("problem" in found)
    return (
      <p class="plan-wrong" role="alert">
        {fill(words.failed, { reason: found.problem })}
      </p>
    );
  const { profile } = found;
  return (
    <>
      <Picture profile={profile} />
      <Words profile={profile} />
    </>
  );
}

function Picture({ profile }: { profile: Profile }) {
  const [width, height] = SIZE;
  const plot = plotOf(profile, width, height);
  if (!plot) return null;
  const [low, high] = plot.range_m;
  const length = writtenLength(profile.points.at(-1)?.along_m ?? 0);
  return (
    <div class="terrain-plot">
      <span aria-hidden="true">{Math.round(high)} m</span>
      <svg
        viewBox={`0 0 ${width} ${height}`}
        preserveAspectRatio="none"
        role="img"
        aria-label={fill(words.plot, { length })}
      >
        {plot.ground && <polygon class="terrain-ground" points={plot.ground} />}
        <polyline class="terrain-route" points={plot.route} />
        {plot.low.map((each) => (
          <polyline key={each} class="terrain-low" points={each} />
        ))}
        {plot.waypoints.map(([x, y]) => (
          <rect key={`${x} ${y}`} class="terrain-waypoint" x={x - 2} y={y - 4} width="4" height="8" />
        ))}
      </svg>
      <span aria-hidden="true">
        {Math.round(low)} m<i>{length}</i>
      </span>
    </div>
  );
}

function Words({ profile: { points, lowest, clearance_m, missing } }: { profile: Profile }) {
  if (missing)
    return (
      <p class="plan-wrong" role="alert">
        {missing}
      </p>
    );
  const at = lowest === null ? null : points[lowest];
  if (!at || at.above_ground_m === null) return <p class="terrain-words">{words.noAltitude}</p>;
  const values = {
    height: Math.abs(Math.floor((at.above_ground_m + 1e-4) * 10) / 10),
    along: writtenLength(at.along_m),
    clearance: clearance_m ?? 0,
  };
  if (at.above_ground_m >= (clearance_m ?? 0))
    return <p class="terrain-words">{fill(words.lowest, values)}</p>;
  return (
    <p class="plan-wrong" role="alert">
      {fill(at.above_ground_m < 0 ? words.below : words.low, values)}
    </p>
  );
}

function Follow({ editor, geometry }: { editor: EditorContext; geometry: Geometry }) {
  const [height, setHeight] = useState<number | null>(null);
  const [tolerance, setTolerance] = useState(2);
  const [isBusy, setBusy] = useState(false);
  const follow = async () => {
    setBusy(true);
    try {
      const draft = draftOf(geometry);
      const { geojson } = await post<{ geojson: GeoJSON.Feature<GeoJSON.LineString> }>(
        "/terrain/follow",
        { route: featureOf(draft), height_m: height, tolerance_m: tolerance },
      );
      // It may have been changed, or deleted, while the ground was read.
      if (editor.plan.find(geometry.name) !== geometry) return;
      const vertices = geojson.geometry.coordinates.map(
        ([longitude = 0, latitude = 0, altitude = 0]): Vertex => ({ latitude, longitude, altitude }),
      );
      editor.plan.change({ ...draft, frame: "amsl", vertices });
      toast(fill(words.followed, { name: geometry.name, count: vertices.length }), "good");
    } catch (error) {
      toast(fill(words.failed, { reason: reasonOf(error) }), "bad");
    } finally {
      setBusy(false);
    }
  };
  return (
    <div class="plan-row">
      <NumberField
        label={words.height}
        value={height}
        min={0}
        max={10_000}
        optional
        placeholder={words.heightHint}
        set={setHeight}
      />
      <NumberField
        label={words.tolerance}
        value={tolerance}
        min={0.5}
        max={100}
        set={(value) => setTolerance(value ?? 2)}
      />
      <button type="button" class="secondary" disabled={isBusy} onClick={() => void follow()}>
        {words.follow}
      </button>
    </div>
  );
}

const reasonOf = (error: unknown): string =>
  error instanceof Error ? error.message : String(error);
