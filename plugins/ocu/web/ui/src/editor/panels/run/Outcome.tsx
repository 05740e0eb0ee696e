// What a rehearsal came to: how it ended, who did what when, and where to watch it.
import { counted, fill, strings } from "../../../strings";
import type { RunSummary } from "../../../shared/types";
import { isViolated } from "../../../operate/requirements/violations";
import { PROMPTS, SERVICES, WAITS, type Span } from "../../../records/spans";
import type { EditorContext } from "../panel";
import { Explained } from "./Explained";
import type { Read } from "./rehearsal";
import { Verdicts } from "./Verdicts";
import { locale } from "../../../strings/language";

const words = strings.run;
const STATUS = strings.operate.run.status;

export interface OutcomeProps {
  editor: EditorContext;
  id: string;
  summary: RunSummary;
  read: Read;
}

export default function Outcome({ editor, id, summary, read }: OutcomeProps) {
  const { spans, unsaid, requirements, count } = read;
  const { status, detail, records, started_us, ended_us } = summary;
  const seconds = ended_us === null ? 0 : (ended_us - started_us) / 1e6;
  const violated = Object.values(requirements).filter(isViolated).length;
  const good = (status === "completed" || status === "terminated") && violated === 0;
  return (
    <section class="m2r-outcome" aria-label={words.outcome}>
      <div class={`m2v-summary ${good ? "m2v-holds" : "m2v-violated"}`}>
        <h2>
          <span class={`m2v-sign m2v-sign-${good ? "holds" : "violated"}`} aria-hidden="true">
            {good ? "✓" : "✗"}
          </span>
          {STATUS[status]}
        </h2>
        {detail && <p>{detail}</p>}
        {violated > 0 && <p>{counted(strings.monitors.violated, violated)}</p>}
        <p class="m2v-faint">{fill(words.took, { duration: duration(seconds), records })}</p>
        <a class="m2r-watch" href={`/rehearsals/${encodeURIComponent(id)}`} target="_blank">
          {words.watch}
        </a>
        <button
          type="button"
          class="secondary m2r-play"
          onClick={() => editor.plan.play({ id, summary })}
        >
          {strings.plan.play}
        </button>
      </div>
      <Verdicts editor={editor} id={id} summary={summary} requirements={requirements} />
      {count > 0 && count < records && (
        <p class="m2-note">{fill(words.begun, { count })}</p>
      )}
      <Explained editor={editor} summary={summary} unsaid={unsaid} />
      {spans.length > 0 && <Bars editor={editor} spans={spans} end={seconds} />}
    </section>
  );
}

/** A row for each vehicle and payload, and for questions and services. */
function Bars({
  editor,
  spans,
  end,
}: {
  editor: EditorContext;
  spans: readonly Span[];
  end: number;
}) {
  const rows = [...new Set(spans.map(({ row }) => row))];
  const last = Math.max(end, ...spans.map(({ from, to }) => to ?? from), 0.001);
  const titles: Record<string, string> = {
    [PROMPTS]: words.questions,
    [WAITS]: words.waits,
    [SERVICES]: words.services,
  };
  const title = (row: string) => titles[row] ?? row;
  return (
    <>
      <h3>{words.timeline}</h3>
      <ul class="m2r-bars">
        {rows.map((row) => (
          <li key={row}>
            <span class="m2r-row">{title(row)}</span>
            <div class="m2r-track">
              {spans
                .filter((span) => span.row === row)
                .map((span) => (
                  <Bar key={span.id} editor={editor} span={span} last={last} />
                ))}
            </div>
          </li>
        ))}
      </ul>
      <p class="m2r-scale" aria-hidden="true">
        <span>0 s</span>
        <span>{duration(last)}</span>
      </p>
    </>
  );
}

function Bar({ editor, span, last }: { editor: EditorContext; span: Span; last: number }) {
  const { from, to, label, end, reason, element } = span;
  const until = to ?? last;
  const said = fill(words.bar, { label, from: duration(from), to: duration(until) });
  const title = [said, end && strings.operate.timeline.ends[end], reason]
    .filter(Boolean)
    .join(", ");
  return (
    <button
      type="button"
      class={`m2r-bar m2r-bar-${end || "unknown"}`}
      style={{ left: `${(100 * from) / last}%`, width: `${(100 * (until - from)) / last}%` }}
      title={title}
      aria-label={title}
      onClick={() => void editor.select(element)}
    />
  );
}

const tenths = new Intl.NumberFormat(locale, { maximumFractionDigits: 1 });

export function duration(seconds: number): string {
  if (seconds < 60) return `${tenths.format(seconds)} s`;
  const whole = Math.round(seconds);
  const [hours, minutes] = [Math.floor(whole / 3600), Math.floor((whole % 3600) / 60)];
  const rest = String(whole % 60).padStart(2, "0");
  return hours
    ? `${hours}:${String(minutes).padStart(2, "0")}:${rest} h`
    : `${minutes}:${rest} min`;
}
