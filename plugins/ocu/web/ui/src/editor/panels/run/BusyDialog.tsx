// A mission was not started, as others have its vehicles: who has which, with which task, and what
// can be done. It waits, other vehicles are chosen, the other run is stopped, or it starts anyway.
import { useEffect, useState } from "preact/hooks";
import { get } from "../../../shared/api";
import { command, start } from "../../../shared/command";
import { Dialog } from "../../../shared/Dialog";
import { go } from "../../../shared/router";
import { toast } from "../../../shared/Toasts";
import { fill, strings } from "../../../strings";
import { standing, type Standing } from "./holding";
import type { Busy } from "./starting";

const words = strings.busy;
const EVERY_MS = 1000;

interface Resources {
  holders: Record<string, string>;
  labels: Record<string, string>;
}

interface BusyDialogProps {
  mission: string;
  busy: Busy;
  /** Something real moves when it starts. */
  real: boolean;
  startNow(evenIfBusy: boolean): void;
  close(): void;
}

export function BusyDialog({ mission, busy, real, startNow, close }: BusyDialogProps) {
  const resources = useResources();
  const [sure, setSure] = useState("");
  const [stopped, setStopped] = useState<readonly string[]>([]);
  const lines = standing(busy.holders, resources?.holders ?? null, resources?.labels ?? {}, stopped);
  const runs = [...new Set(lines.flatMap(({ run }) => (run ? [run] : [])))];
  const isFree = resources !== null && lines.every(({ free }) => free);
  const queue = async () => {
    try {
      const { entry } = await start<{ entry: string }>("/schedule", busy.request);
      toast(fill(words.queued, { mission, entry }), "good");
      close();
      go("/");
    } catch (error) {
      toast(error instanceof Error ? error.message : String(error), "bad");
    }
  };
  const stop = async (run: string) => {
    setSure("");
    if (await command(`/runs/${encodeURIComponent(run)}/stop`, {})) setStopped([...stopped, run]);
  };
  return (
    <Dialog
      title={words.title}
      wide
      onClose={close}
      actions={
        <>
          <button type="button" class="secondary" onClick={close}>
            {words.no}
          </button>
          {!isFree && (
            <button type="button" class="secondary m2r-caution" onClick={() => startNow(true)}>
              {words.yes}
            </button>
          )}
          {isFree ? (
            <button
              type="button"
              class={real ? "primary m2r-real" : "primary"}
              onClick={() => startNow(false)}
            >
              {words.start}
            </button>
          ) : (
            <button type="button" class="primary" onClick={() => void queue()}>
              {words.wait}
            </button>
          )}
        </>
      }
    >
      {/* It has the focus first: Enter decides nothing. */}
      <div role="region" aria-label={words.title} tabIndex={0}>
        <p>{fill(words.text, { mission })}</p>
        <table class="m2r-holders">
          <thead>
            <tr>
              <th scope="col">{words.vehicle}</th>
              <th scope="col">{words.holder}</th>
              <th scope="col">{words.does}</th>
            </tr>
          </thead>
          <tbody>
            {lines.map((line) => (
              <Line key={line.resource} line={line} />
            ))}
          </tbody>
        </table>
      </div>
      <ul class="m2r-choices">
        {!isFree && <li>{words.waitHint}</li>}
        {!isFree && <li>{words.startHint}</li>}
        <li>
          <button type="button" class="secondary" onClick={close}>
            {words.choose}
          </button>{" "}
          {words.chooseHint}
        </li>
        {runs.map((run) => (
          <li key={run}>
            <span role="status">
              {stopped.includes(run) ? (
                fill(words.stopping, { run })
              ) : (
                <button
                  type="button"
                  class={sure === run ? "primary m2r-real" : "secondary"}
                  onClick={() => (sure === run ? void stop(run) : setSure(run))}
                >
                  {fill(sure === run ? words.stopSure : words.stop, { run })}
                </button>
              )}
            </span>
          </li>
        ))}
      </ul>
    </Dialog>
  );
}

function Line({ line: { resource, who, run, task, free } }: { line: Standing }) {
  return (
    <tr>
      <td>
        <b>{resource}</b>
      </td>
      <td>{free ? words.free : run || fill(words.operator, { who })}</td>
      <td>{free ? "–" : run ? task || words.nothing : "–"}</td>
    </tr>
  );
}

/** Who has what, again and again while it is looked at. */
function useResources(): Resources | null {
  const [resources, setResources] = useState<Resources | null>(null);
  useEffect(() => {
    const read = async () => {
      try {
        setResources(await get<Resources>("/resources"));
      } catch {
        // The page says that the executive does not answer.
      }
    };
    void read();
    const timer = setInterval(() => void read(), EVERY_MS);
    return () => clearInterval(timer);
  }, []);
  return resources;
}
