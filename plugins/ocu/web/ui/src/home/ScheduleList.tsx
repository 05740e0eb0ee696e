// What starts later: when, and what it waits for. Operators hold and cancel it.
import { useEffect, useState } from "preact/hooks";
import { get, post } from "../shared/api";
import { Dialog } from "../shared/Dialog";
import { scheduleChanges } from "../shared/executive";
import { moment } from "../shared/moments";
import { may } from "../shared/session";
import { attempt } from "../shared/Toasts";
import type { Schedule, ScheduledMission, ScheduledStatus } from "../shared/types";
import { fill, strings } from "../strings";
import { Link } from "./Link";
import { inOrder, isOver, nameOf, type Wanted } from "./queue";
import { ScheduleDialog } from "./ScheduleDialog";

const words = strings.home.schedule;
const EVERY_MS = 5000;
const STATUSES = Object.keys(words.status) as ScheduledStatus[];
/** So few need no search. */
const FEW = 3;

export function ScheduleList() {
  const { schedule, failed, refresh } = useSchedule();
  const [adding, setAdding] = useState(false);
  const [wanted, setWanted] = useState<Wanted>({ text: "", status: "" });
  const [asked, setAsked] = useState<Asked | null>(null);
  const act = async (path: string) => {
    await attempt(() => post(`/schedule${path}`));
    await refresh();
  };
  const entries = schedule?.entries ?? [];
  const hasActive = entries.some((each) => !isOver(each));
  const shown = inOrder(entries, wanted);
  if (schedule && !schedule.served && entries.length === 0) return null;
  return (
    <section class="home-wide" aria-labelledby="schedule-head">
      <div class="home-head">
        <h1 id="schedule-head">{words.title}</h1>
        {entries.length > FEW && (
          <div class="home-filters" role="search" aria-label={words.find}>
            <input
              type="search"
              aria-label={words.find}
              placeholder={words.find}
              value={wanted.text}
              onInput={(event) => setWanted({ ...wanted, text: event.currentTarget.value })}
            />
            <select
              aria-label={strings.home.status}
              value={wanted.status}
              onChange={(event) =>
                setWanted({ ...wanted, status: event.currentTarget.value as Wanted["status"] })
              }
            >
              <option value="">{strings.runs.anyStatus}</option>
              {STATUSES.map((each) => (
                <option key={each} value={each}>
                  {words.status[each]}
                </option>
              ))}
            </select>
          </div>
        )}
        <span class="home-stretch" />
        {may("commander") && schedule?.served && (
          <button type="button" class="secondary" onClick={() => setAdding(true)}>
            {words.add}
          </button>
        )}
        {may("commander") && schedule?.hold && (
          <button type="button" class="secondary" onClick={() => void act("/release")}>
            {words.releaseAll}
          </button>
        )}
        {may("operator") && hasActive && !schedule?.hold && (
          <button type="button" class="secondary" onClick={() => void act("/hold")}>
            {words.holdAll}
          </button>
        )}
      </div>
      {failed && <p role="alert">{strings.home.failed}</p>}
      {schedule?.hold && (
        <p role="status" class="home-held">
          {fill(words.held, { hold: schedule.hold })}
        </p>
      )}
      {schedule && entries.length === 0 && <p class="home-none">{words.none}</p>}
      {entries.length > 0 && shown.length === 0 && <p class="home-none">{words.noneFound}</p>}
      {shown.length > 0 && (
        <div class="home-scroll">
          <table class="home-table">
            <thead>
              <tr>
                <th scope="col">{words.entry}</th>
                <th scope="col">{strings.home.mission}</th>
                <th scope="col">{strings.home.status}</th>
                <th scope="col">{words.next}</th>
                <th scope="col">{words.when}</th>
                <th scope="col">{words.reason}</th>
                <th scope="col">{words.lastRun}</th>
                <th scope="col">
                  <span class="home-hidden">{words.actions}</span>
                </th>
              </tr>
            </thead>
            <tbody>
              {shown.map((each) => (
                <EntryRow key={each.entry} each={each} act={act} ask={setAsked} />
              ))}
            </tbody>
          </table>
        </div>
      )}
      {adding && (
        <ScheduleDialog
          close={() => {
            setAdding(false);
            void refresh();
          }}
        />
      )}
      {asked && (
        <Dialog
          title={fill(asked.what === "cancel" ? words.cancelTitle : words.runNowTitle, {
            entry: asked.each.entry,
          })}
          onClose={() => setAsked(null)}
          actions={
            <>
              <button type="button" class="secondary" onClick={() => setAsked(null)}>
                {asked.what === "cancel" ? words.keep : strings.home.cancel}
              </button>
              <button
                type="button"
                class="primary"
                onClick={() => {
                  setAsked(null);
                  void act(`/${asked.each.entry}/${asked.what}`);
                }}
              >
                {asked.what === "cancel" ? words.cancel : words.runNow}
              </button>
            </>
          }
        >
          <p>
            {fill(asked.what === "cancel" ? words.cancelText : words.runNowText, {
              mission: nameOf(asked.each),
            })}
          </p>
        </Dialog>
      )}
    </section>
  );
}

/** What is done with an entry once the operator has confirmed it. */
interface Asked {
  what: "cancel" | "start";
  each: ScheduledMission;
}

interface EntryRowProps {
  each: ScheduledMission;
  act(path: string): Promise<void>;
  ask(asked: Asked): void;
}

function EntryRow({ each, act, ask }: EntryRowProps) {
  const { entry, status, run, reason } = each;
  const hasEnded = isOver(each);
  const next = each.starts_us ?? each.next_us;
  const isHeld = status === "held";
  const name = isHeld ? words.releaseLabel : words.holdLabel;
  return (
    <tr>
      <td>{entry}</td>
      <td>{nameOf(each)}</td>
      <td>
        <span class={`home-chip home-schedule-${status}`}>{words.status[status]}</span>
        {each.priority !== 0 && (
          <span class="home-title">{fill(words.priority, { priority: each.priority })}</span>
        )}
      </td>
      <td class="home-when">{next === null || hasEnded ? "–" : moment(next / 1000)}</td>
      <td>{each.when}</td>
      <td title={reason || undefined}>{reason.split("\n")[0]}</td>
      <td>{run ? <Link to={`/runs/${encodeURIComponent(run)}`}>{run}</Link> : "–"}</td>
      <td class="home-actions">
        {!hasEnded && may(isHeld ? "commander" : "operator") && (
          <button
            type="button"
            class="plain"
            aria-label={fill(name, { entry })}
            onClick={() => void act(`/${entry}/${isHeld ? "release" : "hold"}`)}
          >
            {isHeld ? words.release : words.hold}
          </button>
        )}
        {!hasEnded && !isHeld && may("commander") && (
          <button
            type="button"
            class="plain"
            aria-label={fill(words.runNowLabel, { entry })}
            onClick={() => ask({ what: "start", each })}
          >
            {words.runNow}
          </button>
        )}
        {!hasEnded && may("operator") && (
          <button
            type="button"
            class="plain"
            aria-label={fill(words.cancelLabel, { entry })}
            onClick={() => ask({ what: "cancel", each })}
          >
            {words.cancel}
          </button>
        )}
      </td>
    </tr>
  );
}

function useSchedule() {
  const [schedule, setSchedule] = useState<Schedule | null>(null);
  const [failed, setFailed] = useState(false);
  const refresh = async () => {
    try {
      setSchedule(await get<Schedule>("/schedule"));
      setFailed(false);
    } catch {
      setFailed(true);
    }
  };
  useEffect(() => {
    const timer = setInterval(() => {
      if (!document.hidden) void refresh();
    }, EVERY_MS);
    const leave = scheduleChanges.subscribe(() => void refresh());
    return () => {
      clearInterval(timer);
      leave();
    };
  }, []);
  return { schedule, failed, refresh };
}
