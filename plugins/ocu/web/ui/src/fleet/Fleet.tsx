// The fleet without a run: all vehicles and payloads, who has them, and commands to them.
import { useComputed, useSignal } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect, useMemo } from "preact/hooks";
import { Catalogue } from "../editor/session/catalogue";
import { usePaced } from "../operate/layout/pace";
import { connection, payloads, silentFor_s, unknownSince, vehicles, watch } from "../shared/executive";
import { Split } from "../shared/Split";
import { TabList } from "../shared/Tabs";
import { useMedia } from "../shared/useMedia";
import { strings } from "../strings";
import { CommandPanel } from "./CommandPanel";
import { ConfirmOrder } from "./ConfirmOrder";
import { FleetMap } from "./FleetMap";
import { FleetTable } from "./FleetTable";
import { FleetTools } from "./FleetTools";
import { offersOf } from "./offers";
import { counts, linesOf, matching, rowsOf, sorted, type Row } from "./rows";
import {
  filters,
  followStatus,
  grouping,
  keepKnown,
  picking,
  search,
  sorting,
  status,
  targets,
  withPayloads,
} from "./state";
import "./fleet.css";

const text = strings.fleet;

/** Nobody reads a table that changes faster. */
const PACE_MS = 500;
const AGES_MS = 1000;
const WIDE = "(width >= 900px)";

export default function Fleet() {
  const catalogue = useSignal<Catalogue | null>(null);
  const failed = useSignal(false);
  const read = async () => {
    try {
      const now = await Catalogue.load();
      keepKnown(new Set([...now.fleet.vehicles, ...now.fleet.payloads].map(({ id }) => id)));
      catalogue.value = now;
      failed.value = false;
    } catch {
      failed.value = catalogue.peek() === null;
    }
  };
  useEffect(() => {
    watch(null);
    const stopFollowing = followStatus();
    // After a break the executive may be another one, with another fleet.
    let before = "";
    const stop = connection.subscribe((now) => {
      if (now !== before && (now === "open" || catalogue.peek() === null)) void read();
      before = now;
    });
    return () => {
      stop();
      stopFollowing();
    };
  }, []);
  if (!catalogue.value) {
    return <p class="nothing">{failed.value ? text.failed : text.loading}</p>;
  }
  return <Loaded catalogue={catalogue.value} />;
}

function Loaded({ catalogue }: { catalogue: Catalogue }) {
  const { fleet, behaviors } = catalogue;
  const rows = useRows(catalogue);
  const offers = useMemo(() => offersOf(fleet, behaviors), [catalogue]);
  const byName = useMemo(() => new Map(rows.map((row) => [row.id, row])), [rows]);
  const wanted = {
    search: search.value,
    filters: filters.value,
    withPayloads: withPayloads.value,
  };
  const shown = useMemo(
    () => sorted(matching(rows, wanted), sorting.value),
    [rows, search.value, filters.value, withPayloads.value, sorting.value],
  );
  const lines = useMemo(() => linesOf(shown, grouping.value), [shown, grouping.value]);
  const onMap = useMemo(() => shown.filter(({ isPayload }) => !isPayload), [shown]);
  const tab = useSignal("table");
  const wide = useMedia(WIDE);
  const isStale = useComputed(() => unknownSince.value !== null);

  const table = (
    <section class="fleet-pane" aria-label={text.panes.table}>
      <FleetTools
        counts={counts(rows, withPayloads.value)}
        shown={shown.length}
        all={rows.filter(({ isPayload }) => withPayloads.value || !isPayload).length}
        hasPayloads={fleet.payloads.length > 0}
      />
      {lines.length === 0 ? (
        <p class="nothing">{fleet.vehicles.length === 0 ? text.none : text.nothingMatches}</p>
      ) : (
        <FleetTable
          lines={lines}
          grouping={grouping.value}
          onCommands={() => {
            tab.value = "commands";
            const first = document.querySelector<HTMLElement>(
              ".fleet-commands button:not(:disabled)",
            );
            first?.focus();
          }}
        />
      )}
    </section>
  );
  const map = (
    <FleetMap
      fleet={fleet}
      geometries={catalogue.geometries.value}
      rows={onMap}
      picksOnce={!wide}
    />
  );
  const commands = <CommandPanel catalogue={catalogue} offers={offers} rows={byName} />;
  return (
    <div class={isStale.value ? "fleet-page stale" : "fleet-page"}>
      <h1 class="for-readers">{text.title}</h1>
      {wide ? (
        <Split
          name="fleet"
          direction="row"
          initial={58}
          label={`${text.panes.resize}: ${text.panes.table}`}
        >
          {table}
          <Split
            name="fleet.map"
            direction="column"
            initial={52}
            label={`${text.panes.resize}: ${text.panes.map}`}
          >
            {map}
            {commands}
          </Split>
        </Split>
      ) : (
        <Narrow tab={tab} {...{ table, map, commands }} />
      )}
      <ConfirmOrder />
    </div>
  );
}

interface NarrowProps {
  tab: { value: string };
  table: JSX.Element;
  map: JSX.Element;
  commands: JSX.Element;
}

/** Commands stay while the map is looked at: they ask for a position there. */
function Narrow({ tab, table, map, commands }: NarrowProps) {
  const isPicking = picking.value !== null;
  useEffect(() => {
    if (isPicking) tab.value = "map";
    else if (tab.value === "map" && targets().length > 0) tab.value = "commands";
  }, [isPicking]);
  const count = targets().length;
  const tabs = [
    { id: "table", title: text.panes.table, content: table },
    { id: "map", title: text.panes.map, content: map },
    {
      id: "commands",
      title: count > 0 ? `${text.commands.title} (${count})` : text.commands.title,
      content: commands,
    },
  ];
  return (
    <div class="tabs">
      <TabList
        label={text.title}
        tabs={tabs}
        chosen={tab.value}
        panel="fleet-panel"
        onChoose={(id) => (tab.value = id)}
      />
      <div id="fleet-panel" class="tab-panel" role="tabpanel" aria-label={text.title}>
        {tabs.map(({ id, content }) => (
          <div key={id} class="fleet-tab" hidden={id !== tab.value}>
            {content}
          </div>
        ))}
      </div>
    </div>
  );
}

/** Made anew a few times a second, however many states come. */
function useRows(catalogue: Catalogue): readonly Row[] {
  const states = usePaced(vehicles, PACE_MS);
  const looks = usePaced(payloads, PACE_MS);
  const second = useSignal(0);
  useEffect(() => {
    // Ages grow without any message.
    const timer = setInterval(() => (second.value += 1), AGES_MS);
    return () => clearInterval(timer);
  }, []);
  return useMemo(
    () =>
      rowsOf({
        fleet: catalogue.fleet,
        vehicles: states,
        payloads: looks,
        status: status.value,
        silentFor_s,
        unknownSince: unknownSince.value,
      }),
    [catalogue, states, looks, status.value, second.value, unknownSince.value],
  );
}
