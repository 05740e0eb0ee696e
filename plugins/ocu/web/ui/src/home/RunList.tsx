// What is and was run, the newest first.
import { useState } from "preact/hooks";
import { go } from "../shared/router";
import { moment } from "../shared/moments";
import { titleOf } from "../shared/runs";
import type { RunLine } from "../shared/types";
import { fill, strings } from "../strings";
import { Link } from "./Link";
import { useList } from "./useList";

const words = strings.home;
const SHOWN = 12;
const GOING_ON = new Set(["running", "paused"]);

export function RunList() {
  const { lines, failed } = useList<RunLine>("/runs");
  const [all, setAll] = useState(false);
  const sorted = [...(lines ?? [])].sort(
    (a, b) =>
      Number(GOING_ON.has(b.status)) - Number(GOING_ON.has(a.status)) ||
      b.began_us - a.began_us,
  );
  const shown = all ? sorted : sorted.slice(0, SHOWN);
  return (
    <section aria-labelledby="runs-head">
      <div class="home-head">
        <h1 id="runs-head">{words.runs}</h1>
      </div>
      {failed && <p role="alert">{words.failed}</p>}
      {lines?.length === 0 && <p class="home-none">{words.noRuns}</p>}
      {shown.length > 0 && (
        <div class="home-scroll">
          <table class="home-table">
            <thead>
              <tr>
                <th scope="col">{words.run}</th>
                <th scope="col">{words.mission}</th>
                <th scope="col">{words.status}</th>
                <th scope="col">{words.started}</th>
                <th scope="col">{words.took}</th>
              </tr>
            </thead>
            <tbody>
              {shown.map((run) => (
                <RunRow key={run.run} run={run} />
              ))}
            </tbody>
          </table>
        </div>
      )}
      {sorted.length > shown.length && (
        <button type="button" class="secondary" onClick={() => setAll(true)}>
          {fill(words.allRuns, { count: sorted.length })}
        </button>
      )}
    </section>
  );
}

function RunRow({ run }: { run: RunLine }) {
  const path = `/runs/${encodeURIComponent(run.run)}`;
  return (
    <tr onDblClick={() => go(path)}>
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
      </td>
      <td class="home-when">{moment(run.began_us / 1000)}</td>
      <td>{run.took_s === null ? "–" : duration(run.took_s)}</td>
    </tr>
  );
}

function duration(seconds: number): string {
  const whole = Math.max(0, Math.round(seconds));
  const parts = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  const [hours = 0, ...rest] = parts;
  const clock = rest.map((part) => String(part).padStart(2, "0")).join(":");
  return hours ? `${hours}:${clock}` : clock;
}
