// The page on which a mission is drawn.
import { useEffect, useRef, useState } from "preact/hooks";
import { comparing } from "../compare/comparing";
import { ApiError } from "../shared/api";
import { edit } from "../shared/executive";
import { loaded } from "../shared/loaded";
import { remember, remembered } from "../shared/memory";
import { guardLeaving } from "../shared/router";
import { Split } from "../shared/Split";
import { fill, strings } from "../strings";
import { BlockLibrary } from "./blocks/BlockLibrary";
import { Questions } from "./dialogs/Questions";
import { SidePanel } from "./panels/SidePanel";
import { Catalogue } from "./session/catalogue";
import { followKeys, stepThrough } from "./session/keyboard";
import { MissionWork } from "./session/MissionWork";
import { DiagramTabs } from "./toolbar/DiagramTabs";
import { Notices } from "./toolbar/Notices";
import { Toolbar } from "./toolbar/Toolbar";
import "bpmn-js/dist/assets/diagram-js.css";
import "bpmn-js/dist/assets/bpmn-js.css";
import "bpmn-js/dist/assets/bpmn-font/css/bpmn-codes.css";
import "@bpmn-io/properties-panel/dist/assets/properties-panel.css";
import "diagram-js-minimap/assets/diagram-js-minimap.css";
import "./editor.css";
import "./canvas.css";
import "./forms.css";
import { textScale } from "../shared/textScale";

const words = strings.editor;

/** Leaflet, and what plays rehearsals: for those who look at the map. */
const MapPanel = loaded(() => import("./map/MapPanel"));

/** The viewer of diagrams and the differ: for those who compare versions. */
const CompareDialog = loaded(() => import("../compare/CompareDialog"));

/** Of a tablet held upright: blocks are then in the menus alone, until the user asks for more. */
const NARROW = 1000;

export default function Editor({ mission }: { mission: string }) {
  const [work, setWork] = useState<MissionWork | null>(null);
  const [problem, setProblem] = useState("");
  useEffect(() => {
    let ended = false;
    let made: MissionWork | undefined;
    const begin = async () => {
      const catalogue = await Catalogue.load();
      if (ended) return;
      made = new MissionWork(mission, catalogue);
      setWork(made);
    };
    begin().catch((error: unknown) => setProblem(described(mission, error)));
    return () => {
      ended = true;
      made?.end();
    };
  }, [mission]);
  if (problem) return <p class="nothing">{problem}</p>;
  if (!work) return <p class="nothing">{words.loading}</p>;
  return <Workplace work={work} fail={(error) => setProblem(described(mission, error))} />;
}

function described(mission: string, error: unknown): string {
  if (error instanceof ApiError && error.status === 404) {
    return fill(words.noMission, { name: mission });
  }
  const reason = error instanceof Error ? error.message : String(error);
  return fill(words.loadFailed, { reason });
}

interface WorkplaceProps {
  work: MissionWork;
  fail(error: unknown): void;
}

function Workplace({ work, fail }: WorkplaceProps) {
  const { session } = work;
  const canvas = useRef<HTMLDivElement>(null);
  const [showsBlocks, setBlocks] = useRemembered("editor-blocks", innerWidth > NARROW * textScale.value);
  const [showsPanel, setPanel] = useRemembered("editor-panel", true);
  useEffect(() => {
    if (!canvas.current) return undefined;
    // What is drawn must have a size before it can be fitted to it.
    session.modeler.attachTo(canvas.current);
    work.begin().catch(fail);
    // bpmn-js keeps the size that the canvas had.
    const resized = new ResizeObserver(() => session.service("canvas").resized());
    resized.observe(canvas.current);
    return () => resized.disconnect();
  }, [work]);
  const showsMap = session.plan.isShown.value;
  const sheets = useRef(showsMap);
  useEffect(() => {
    // The diagram has another room now.
    if (sheets.current === showsMap) return;
    sheets.current = showsMap;
    requestAnimationFrame(() => session.fit());
  }, [showsMap]);
  useEffect(() => followKeys(work), [work]);
  useEffect(() => {
    edit(work.mission);
    return () => {
      edit(null);
      comparing.value = null;
    };
  }, [work]);
  useEffect(() => {
    // Somebody may have drawn a route or area on the map in the meantime.
    const refresh = () => void session.catalogue.refreshGeometries().catch(() => undefined);
    addEventListener("focus", refresh);
    return () => removeEventListener("focus", refresh);
  }, [session]);
  useEffect(() => {
    const leave = guardLeaving(() => !session.isDirty.peek() || confirm(words.leave));
    const unload = (event: BeforeUnloadEvent) => {
      if (session.isDirty.peek()) event.preventDefault();
    };
    addEventListener("beforeunload", unload);
    return () => {
      leave();
      removeEventListener("beforeunload", unload);
    };
  }, [session]);
  useEffect(() => {
    document.title = `${session.isDirty.value ? "● " : ""}${work.mission} – m2pem`;
    return () => {
      document.title = strings.shell.title;
    };
  }, [session.isDirty.value]);

  return (
    <div class="m2-editor">
      <Toolbar
        work={work}
        showsBlocks={showsBlocks}
        toggleBlocks={() => setBlocks(!showsBlocks)}
        showsPanel={showsPanel}
        togglePanel={() => setPanel(!showsPanel)}
      />
      <Notices work={work} />
      <div class="m2-workplace">
        {showsBlocks && <BlockLibrary session={session} />}
        <div class="m2-drawing">
          <h2 class="m2-hidden">{words.canvas}</h2>
          <DiagramTabs session={session} />
          <div class={`m2-sheets${showsMap ? " m2-with-map" : ""}`}>
            <Split
              name="editor-map"
              direction="row"
              initial={46}
              label={strings.plan.resize}
              alone={!showsMap}
            >
              <div
                id="m2-canvas"
                class="m2-canvas"
                ref={canvas}
                role="region"
                aria-label={words.canvas}
                onKeyDown={(event) => stepThrough(session, event)}
              />
              {showsMap && <MapPanel editor={session} />}
            </Split>
          </div>
        </div>
        {showsPanel && <SidePanel editor={session} />}
      </div>
      <Questions work={work} />
      {comparing.value && <CompareDialog editor={session} />}
    </div>
  );
}

function useRemembered(key: string, usual: boolean): [boolean, (value: boolean) => void] {
  const [value, setValue] = useState(() => remembered(key, usual));
  return [
    value,
    (next) => {
      setValue(next);
      remember(key, next);
    },
  ];
}
