// Where the parts of the page are: beside each other where there is room, behind tabs on a tablet.
import { useComputed } from "@preact/signals";
import { loaded } from "../../shared/loaded";
import { Split } from "../../shared/Split";
import { Tabs, type Tab } from "../../shared/Tabs";
import { useMedia } from "../../shared/useMedia";
import { fill, strings } from "../../strings";
import { useOperating } from "../context";
import { detectionsShown } from "../detections/shown";
import { DiagramPane } from "../diagram/DiagramPane";
import { LogPane } from "../log/LogPane";
import { DrawForm } from "../map/DrawForm";
import { MapPane } from "../map/MapPane";
import { OutlinePane } from "../outline/OutlinePane";
import { plotsShown } from "../plots/shown";
import { RequirementsTitle } from "../requirements/RequirementsTitle";
import { DEBUGGING, lowerTab, narrowTab, REQUIREMENTS } from "./chosenTabs";
import { Pane } from "./Pane";
import { TimelinePane } from "../timeline/TimelinePane";
import { VehiclesPane } from "../vehicles/VehiclesPane";

const text = strings.operate.panes;
const kinds = strings.operate.map.kinds;

/** With what draws and plays them: only those who look at them load that. */
const Cameras = loaded(() => import("../cameras/CamerasPane"));
const Detections = loaded(() => import("../detections/DetectionsPane"));
const Requirements = loaded(() => import("../requirements/RequirementsPane"));
const Debugging = loaded(() => import("../debug/DebugPane"));
const Plots = loaded(() => import("../plots/PlotsPane"));

const WIDE = "(width >= 1180px)";

export function Layout({ onSeek }: { onSeek?: ((t: number) => void) | undefined }) {
  const wide = useMedia(WIDE);
  return <div class="panes">{wide ? <Wide onSeek={onSeek} /> : <Narrow onSeek={onSeek} />}</div>;
}

type Parts = { onSeek: ((t: number) => void) | undefined };

function Wide({ onSeek }: Parts) {
  const { draft } = useOperating();
  const cameras = useCameras();
  const bottom = plotsShown.value
    ? { name: "bottom-plots", initial: 44 }
    : { name: "bottom", initial: 68 };
  return (
    <Split {...bottom} direction="column" label={`${text.resize}: ${text.bottom}`}>
      <Split name="right" direction="row" initial={64} label={`${text.resize}: ${text.right}`}>
        <Split name="left" direction="row" initial={24} label={`${text.resize}: ${text.outline}`}>
          <OutlinePane />
          <DiagramPane />
        </Split>
        <Split name="map" direction="column" initial={54} label={`${text.resize}: ${text.map}`}>
          <MapPane formInside={false} />
          {draft.value ? (
            <Pane title={`${strings.operate.map.draw}: ${kinds[draft.value.kind]}`}>
              <DrawForm draft={draft.value} />
            </Pane>
          ) : cameras ? (
            <Tabs
              label={text.vehicles}
              tabs={[
                { id: "vehicles", title: text.vehicles, render: () => <VehiclesPane /> },
                CAMERAS,
              ]}
            />
          ) : (
            <VehiclesPane />
          )}
        </Split>
      </Split>
      <Split name="log" direction="row" initial={58} label={`${text.resize}: ${text.log}`}>
        <TimesPane onSeek={onSeek} />
        <LogPanes />
      </Split>
    </Split>
  );
}

/** The log; beside it what the run is monitored for, and its breakpoints, if there is anything. */
function LogPanes() {
  const others = [useRequirements(), useDebugging()].filter((tab) => tab !== undefined);
  if (others.length === 0) return <LogPane />;
  return <Tabs label={text.log} tabs={[LOG, ...others]} chosen={lowerTab} />;
}

const LOG: Tab = { id: "log", title: text.log, render: () => <LogPane /> };

/** The tab of what the run is monitored for; undefined: it is not monitored. */
function useRequirements(): Tab | undefined {
  const { scene } = useOperating();
  const all = Object.values(scene.requirements.value);
  if (all.length === 0) return undefined;
  return { id: REQUIREMENTS, title: <RequirementsTitle />, render: () => <Requirements /> };
}

/** The tab of breakpoints and data; undefined: the fleet allows none, or the run was not stopped. */
function useDebugging(): Tab | undefined {
  const { scene, fleet } = useOperating();
  const counted = useComputed(() => {
    const { elements = [], conditions = [] } = scene.debugging.value ?? {};
    return elements.length + conditions.length;
  });
  const there = scene.mode === "live" ? fleet.may_be_debugged : scene.stops.length > 0;
  if (!there) return undefined;
  const { stops, title, titleCount } = strings.debug;
  const count = scene.mode === "live" ? counted.value : scene.stops.length;
  return {
    id: DEBUGGING,
    title: count === 0 ? title : fill(scene.mode === "live" ? titleCount : stops, { count }),
    render: () => <Debugging />,
  };
}

/** The list of detections is beside the time line, which has the button that shows it. */
function TimesPane({ onSeek }: Parts) {
  const count = useDetectionCount();
  const shows = detectionsShown.value && count > 0;
  const label = `${text.resize}: ${fill(strings.operate.detections.title, { count })}`;
  return (
    <Split name="detections" direction="row" initial={66} label={label} alone={!shows}>
      <TimePanes onSeek={onSeek} />
      {shows && <Detections inside={false} />}
    </Split>
  );
}

/** Plots are below the time line, so that the same times are below each other. */
function TimePanes({ onSeek }: Parts) {
  if (!plotsShown.value) return <TimelinePane onSeek={onSeek} plots={plotsShown} />;
  return (
    <Split name="plots" direction="column" initial={38} label={`${text.resize}: ${text.plots}`}>
      <TimelinePane onSeek={onSeek} plots={plotsShown} />
      <Plots onSeek={onSeek} />
    </Split>
  );
}

const CAMERAS: Tab = {
  id: "cameras",
  title: text.cameras,
  render: () => <Cameras />,
};

/** Whether there are cameras to look through: they show what is now, not what was. */
function useCameras(): boolean {
  const { scene, fleet } = useOperating();
  return scene.mode === "live" && fleet.payloads.some(({ video }) => video);
}

/** How many detections there are, at the times when that number changes. */
function useDetectionCount(): number {
  const { scene } = useOperating();
  return useComputed(() => scene.detections.value.all.length + scene.detections.value.more).value;
}

function Narrow({ onSeek }: Parts) {
  const cameras = useCameras();
  const count = useDetectionCount();
  const requirements = useRequirements();
  const debugging = useDebugging();
  const detections: Tab = {
    id: "detections",
    title: fill(strings.operate.detections.title, { count }),
    render: () => <Detections inside />,
  };
  return (
    <Split name="narrow" direction="column" initial={52} label={text.resize}>
      <Tabs
        label={text.left}
        tabs={[
          { id: "diagram", title: text.diagram, render: () => <DiagramPane /> },
          { id: "outline", title: text.outline, render: () => <OutlinePane /> },
        ]}
      />
      <Tabs
        label={text.right}
        chosen={narrowTab}
        tabs={[
          { id: "map", title: text.map, render: () => <MapPane formInside /> },
          { id: "vehicles", title: text.vehicles, render: () => <VehiclesPane /> },
          ...(cameras ? [CAMERAS] : []),
          { id: "timeline", title: text.timeline, render: () => <TimelinePane onSeek={onSeek} /> },
          ...(count > 0 ? [detections] : []),
          { id: "plots", title: text.plots, render: () => <Plots onSeek={onSeek} /> },
          ...(requirements ? [requirements] : []),
          ...(debugging ? [debugging] : []),
          LOG,
        ]}
      />
    </Split>
  );
}
