// What is and was run: filtered, sorted, by pages, and several of them paused or stopped together.
import { useEffect, useRef, useState } from "preact/hooks";
import { get } from "../shared/api";
import { vehicles } from "../shared/executive";
import { go } from "../shared/router";
import { moment } from "../shared/moments";
import { titleOf } from "../shared/runs";
import { may } from "../shared/session";
import type { RunLine, RunStatus, WaitingTask } from "../shared/types";
import { counted, fill, strings } from "../strings";
import { BulkDialog } from "./BulkDialog";
import { Link } from "./Link";
import { heldFor, type IncidentLine } from "./blocking";
import { useIncidents, type Incidents } from "./incidents";
import {
  ALL_RUNS,
  mayDo,
  PAGE,
  pathOf,
  sortedBy,
  type Deed,
  type RunQuery,
  type SortedBy,
} from "./runQuery";
import { grouped } from "../shared/format";

const words = strings.home;
const texts = strings.runs;
const EVERY_MS = 5000;
/** More is read with each answer. */
const UNREAD_MS = 250;
const TYPED_MS = 250;
const STATUSES = Object.keys(strings.operate.run.status) as RunStatus[];
const TIMES = [
  [0, texts.anyTime],
  [3600, texts.lastHour],
  [86_400, texts.lastDay],
  [7 * 86_400, texts.lastWeek],
] as const;
const DEEDS: readonly Deed[] = ["pause", "resume", "stop"];

interface RunsPage {
  runs: RunLine[];
  total: number;
  all: number;
  /** Of so many runs it is not known yet which vehicles they had. */
  unread: number;
}

export function RunList() {
  const [query, setQuery] = useState<RunQuery>(ALL_RUNS);
  const [selected, setSelected] = useState<ReadonlyMap<string, RunLine>>(new Map());
  const [asked, setAsked] = useState<Deed | null>(null);
  const { page, failed, refresh } = usePage(query);
  const incidents = useIncidents();
  // What was typed is asked for later: it must not bring back the filters of before.
  const change = (more: Partial<RunQuery>) => setQuery((now) => ({ ...now, page: 0, ...more }));
  const lines = page?.runs ?? [];
  const total = page?.total ?? 0;
  const chosen = [...selected.values()].map(
    (run) => lines.find((each) => each.run === run.run) ?? run,
  );
  const select = (run: RunLine, on: boolean) => {
    const next = new Map(selected);
    if (on) next.set(run.run, run);
    else next.delete(run.run);
    setSelected(next);
  };
  const steers = may("operator");
  const selectable = lines.filter(({ status }) => mayDo("stop", status));
  return (
    <section aria-labelledby="runs-head">
      <div class="home-head">
        <h1 id="runs-head">{texts.title}</h1>
        <Filters query={query} change={change} />
      </div>
      {failed && <p role="alert">{words.failed}</p>}
      {page?.all === 0 && <p class="home-none">{texts.none}</p>}
      {page && page.all > 0 && total === 0 && <p class="home-none">{texts.noneFound}</p>}
      {page && page.unread > 0 && (
        <p class="home-none" role="status">
          {counted(texts.unread, page.unread)}
        </p>
      )}
      {steers && chosen.length > 0 && (
        <div class="home-bulk" role="group" aria-label={counted(texts.selected, chosen.length)}>
          <span role="status">{counted(texts.selected, chosen.length)}</span>
          {DEEDS.map((deed) => (
            <button
              key={deed}
              type="button"
              class="secondary"
              disabled={!chosen.some(({ status }) => mayDo(deed, status))}
              onClick={() => setAsked(deed)}
            >
              {texts[deed]}
            </button>
          ))}
          <button type="button" class="plain" onClick={() => setSelected(new Map())}>
            {texts.clear}
          </button>
        </div>
      )}
      {lines.length > 0 && (
        <div class="home-scroll">
          <table class="home-table">
            <thead>
              <tr>
                {steers && (
                  <th scope="col" class="home-select">
                    <input
                      type="checkbox"
                      aria-label={texts.selectAll}
                      disabled={selectable.length === 0}
                      checked={
                        selectable.length > 0 && selectable.every(({ run }) => selected.has(run))
                      }
                      onChange={(event) => {
                        const next = new Map(selected);
                        for (const run of selectable)
                          if (event.currentTarget.checked) next.set(run.run, run);
                          else next.delete(run.run);
                        setSelected(next);
                      }}
                    />
                  </th>
                )}
                <th scope="col">{words.run}</th>
                <Sorted by="mission" query={query} sort={setQuery} name={words.mission} />
                <Sorted by="status" query={query} sort={setQuery} name={words.status} />
                <Sorted by="began" query={query} sort={setQuery} name={words.started} />
                <Sorted by="took" query={query} sort={setQuery} name={words.took} />
              </tr>
            </thead>
            <tbody>
              {lines.map((run) => (
                <RunRow
                  key={run.run}
                  run={run}
                  incidents={incidents}
                  selected={steers ? selected.has(run.run) : null}
                  select={(on) => select(run, on)}
                />
              ))}
            </tbody>
          </table>
        </div>
      )}
      {total > PAGE && <Pages query={query} total={total} turn={(to) => change({ page: to })} />}
      {asked && (
        <BulkDialog
          deed={asked}
          runs={chosen.filter(({ status }) => mayDo(asked, status))}
          close={() => {
            setAsked(null);
            setSelected(new Map());
            void refresh();
          }}
        />
      )}
    </section>
  );
}

interface FiltersProps {
  query: RunQuery;
  change(more: Partial<RunQuery>): void;
}

function Filters({ query, change }: FiltersProps) {
  const typing = useRef<ReturnType<typeof setTimeout>>();
  return (
    <div class="home-filters" role="search" aria-label={texts.find}>
      <input
        type="search"
        aria-label={texts.find}
        placeholder={texts.find}
        defaultValue={query.text}
        onInput={(event) => {
          const text = event.currentTarget.value;
          clearTimeout(typing.current);
          typing.current = setTimeout(() => change({ text }), TYPED_MS);
        }}
      />
      <select
        aria-label={texts.status}
        value={query.status}
        onChange={(event) => change({ status: event.currentTarget.value })}
      >
        <option value="">{texts.anyStatus}</option>
        <option value="goingOn">{texts.goingOn}</option>
        <option value="ended">{texts.ended}</option>
        {STATUSES.map((each) => (
          <option key={each} value={each}>
            {strings.operate.run.status[each]}
          </option>
        ))}
      </select>
      <select
        aria-label={texts.vehicle}
        value={query.vehicle}
        onChange={(event) => change({ vehicle: event.currentTarget.value })}
      >
        <option value="">{texts.anyVehicle}</option>
        {Object.keys(vehicles.value)
          .sort()
          .map((each) => (
            <option key={each} value={each}>
              {each}
            </option>
          ))}
      </select>
      <select
        aria-label={texts.began}
        value={String(query.within_s)}
        onChange={(event) => change({ within_s: Number(event.currentTarget.value) })}
      >
        {TIMES.map(([seconds, name]) => (
          <option key={seconds} value={String(seconds)}>
            {name}
          </option>
        ))}
      </select>
    </div>
  );
}

interface SortedProps {
  by: SortedBy;
  query: RunQuery;
  name: string;
  sort(query: RunQuery): void;
}

function Sorted({ by, query, name, sort }: SortedProps) {
  const isIt = query.sort === by;
  const now = isIt ? (query.descending ? "descending" : "ascending") : "none";
  return (
    <th scope="col" aria-sort={now}>
      <button type="button" class="home-sort" onClick={() => sort(sortedBy(query, by))}>
        {name}
        <span aria-hidden="true">{isIt ? (query.descending ? " ▼" : " ▲") : ""}</span>
      </button>
    </th>
  );
}

interface PagesProps {
  query: RunQuery;
  total: number;
  turn(page: number): void;
}

function Pages({ query: { page }, total, turn }: PagesProps) {
  const from = page * PAGE + 1;
  const to = Math.min(total, from + PAGE - 1);
  return (
    <div class="home-pages">
      <button type="button" class="secondary" disabled={page === 0} onClick={() => turn(page - 1)}>
        {texts.previous}
      </button>
      <span role="status">
        {fill(texts.page, { from, to, total: grouped(total) })}
      </span>
      <button
        type="button"
        class="secondary"
        disabled={to >= total}
        onClick={() => turn(page + 1)}
      >
        {texts.next}
      </button>
    </div>
  );
}

interface RunRowProps {
  run: RunLine;
  incidents: Incidents;
  /** null: it cannot be. */
  selected: boolean | null;
  select(on: boolean): void;
}

function RunRow({ run, incidents: { open, blocked }, selected, select }: RunRowProps) {
  const incidents = open.filter((each) => each.run === run.run);
  const blocking = open.flatMap((each) =>
    (blocked.get(each.incident) ?? [])
      .filter((waiting) => waiting.run === run.run)
      .map(({ task }) => ({ task, run: each.run, incident: each.incident })),
  );
  const path = `/runs/${encodeURIComponent(run.run)}`;
  return (
    <tr onDblClick={() => go(path)} aria-selected={selected || undefined}>
      {selected !== null && (
        <td class="home-select">
          {mayDo("stop", run.status) && (
            <input
              type="checkbox"
              aria-label={fill(texts.select, { run: run.run })}
              checked={selected}
              onChange={(event) => select(event.currentTarget.checked)}
            />
          )}
        </td>
      )}
      <td>
        <Link to={path}>{run.run}</Link>
      </td>
      <td>
        {titleOf(run)}
        {run.process && <span class="home-title">{run.process}</span>}
      </td>
      <td>
        <span class={`home-chip home-run-${run.status}`} title={run.detail || undefined}>
          {strings.operate.run.status[run.status]}
        </span>
        {incidents.length > 0 && (
          <span class="home-chip home-chip-bad">
            {counted(texts.incidents, incidents.length)}
          </span>
        )}
        {incidents.map((each) => (
          <span key={each.incident} class="home-title">
            {saidOf(each, blocked.get(each.incident) ?? [])}
          </span>
        ))}
        {blocking.map(({ task, run: other, incident }) => (
          <span key={`${incident} ${task}`} class="home-title">
            {fill(texts.blockedBy, { task, run: other })}
          </span>
        ))}
      </td>
      <td class="home-when">{moment(run.began_us / 1000)}</td>
      <td>{run.took_s === null ? "–" : duration(run.took_s)}</td>
    </tr>
  );
}

const saidOf = (incident: IncidentLine, blocked: readonly WaitingTask[]): string =>
  [`${incident.task}: ${incident.code}`, heldFor(incident, blocked)].filter(Boolean).join("; ");

function usePage(query: RunQuery) {
  const [page, setPage] = useState<RunsPage | null>(null);
  const [failed, setFailed] = useState(false);
  const newest = useRef(0);
  /** Returns of how many runs more is to be read. */
  const refresh = async (): Promise<number> => {
    const number = ++newest.current;
    try {
      const found = await get<RunsPage>(pathOf(query, Date.now()));
      // Answers may come in another order than they were asked for.
      if (number !== newest.current) return 0;
      setPage(found);
      setFailed(false);
      return found.unread;
    } catch {
      if (number === newest.current) setFailed(true);
      return 0;
    }
  };
  useEffect(() => {
    let timer: ReturnType<typeof setTimeout>;
    let isOver = false;
    const again = async () => {
      const unread = document.hidden ? 0 : await refresh();
      if (!isOver) timer = setTimeout(() => void again(), unread > 0 ? UNREAD_MS : EVERY_MS);
    };
    void again();
    return () => {
      isOver = true;
      clearTimeout(timer);
    };
  }, [query]);
  return { page, failed, refresh };
}

function duration(seconds: number): string {
  const whole = Math.max(0, Math.round(seconds));
  const parts = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  const [hours = 0, ...rest] = parts;
  const clock = rest.map((part) => String(part).padStart(2, "0")).join(":");
  return hours ? `${hours}:${clock}` : clock;
}
