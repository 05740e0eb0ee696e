// The mission's diagrams, with what is active in them; tabs for the others, and for what is inside.
import { useComputed, useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { fill, strings } from "../../strings";
import { remember, remembered } from "../../shared/memory";
import { TabList } from "../../shared/Tabs";
import { useUniqueId } from "../../shared/uniqueId";
import { useOperating } from "../context";
import { openMenu } from "../debug/menu";
import { Pane } from "../layout/Pane";
import { DiagramTools } from "./DiagramTools";
import { Drawings } from "./drawings";
import { activityOf, follow, type Activity } from "./follow";
import { Legend } from "./Legend";
import "bpmn-js/dist/assets/diagram-js.css";
import "bpmn-js/dist/assets/bpmn-js.css";
import "./diagram.css";

const text = strings.operate.diagram;

export function DiagramPane() {
  const context = useOperating();
  const { scene, mission, selected, surrounded } = context;
  const host = useRef<HTMLDivElement>(null);
  const drawings = useRef<Drawings>();
  const panel = useUniqueId();
  const shown = useSignal(mission.views[0]?.key ?? "");
  const following = useSignal(remembered("follow", true));
  const activity = useComputed<Map<string, Activity>>(() => {
    scene.elements.slow.value;
    return activityOf(mission, scene.elements);
  });

  useEffect(() => {
    const made = new Drawings(host.current!, mission, scene, {
      chosen: (process, element) => {
        selected.value = { process, element, show: false };
      },
      menu: (process, element, x, y) => {
        selected.value = { process, element, show: false };
        openMenu(context, { process, element }, x, y);
      },
      wentTo: (view) => {
        if (view.key === shown.value) return;
        shown.value = view.key;
        stopFollowing();
      },
    });
    drawings.current = made;
    const stops = [
      shown.subscribe((key) => void made.show(key)),
      selected.subscribe((place) => {
        if (place?.show) {
          const view = mission.viewOf(place.process, place.element);
          if (view && view.key !== shown.peek()) stopFollowing();
          if (view) shown.value = view.key;
        }
        void made.select(place);
      }),
      surrounded.subscribe((places) => made.surround(places)),
    ];
    return () => {
      for (const stop of stops) stop();
      made.dispose();
    };
  }, [mission, scene]);

  useEffect(
    () =>
      activity.subscribe((now) => {
        if (following.value) shown.value = follow(now, shown.peek());
      }),
    [activity],
  );

  function stopFollowing(): void {
    following.value = false;
    remember("follow", false);
  }

  if (mission.views.length === 0) return <p class="nothing">{text.noDiagram}</p>;
  return (
    <Pane
      title={strings.operate.panes.diagram}
      class="diagram-pane"
      tools={
        <DiagramTools
          following={following}
          several={mission.views.length > 1}
          onZoom={(factor) => drawings.current?.zoom(factor)}
          onFit={() => drawings.current?.fit()}
        />
      }
    >
      {mission.views.length > 1 && (
        <TabList
          label={strings.operate.panes.diagram}
          panel={panel}
          chosen={shown.value}
          tabs={mission.views.map(({ key, title, inside }) => ({
            id: key,
            title: (
              <ViewTitle title={title} inside={inside !== ""} activity={activity.value.get(key)} />
            ),
          }))}
          onChoose={(key) => {
            stopFollowing();
            shown.value = key;
          }}
        />
      )}
      <div id={panel} class="drawings" ref={host} />
      <Legend />
    </Pane>
  );
}

interface ViewTitleProps {
  title: string;
  inside: boolean;
  activity: Activity | undefined;
}

function ViewTitle({ title, inside, activity }: ViewTitleProps) {
  return (
    <>
      {inside && <span aria-hidden="true">▸</span>}
      {title}
      {activity?.asks ? (
        <span class="view-badge view-asks" title={text.asks}>
          ?<span class="for-readers"> {text.asks}</span>
        </span>
      ) : (
        activity !== undefined &&
        activity.active > 0 && (
          <span class="view-badge" title={fill(text.active, { count: activity.active })}>
            {activity.active}
          </span>
        )
      )}
    </>
  );
}
