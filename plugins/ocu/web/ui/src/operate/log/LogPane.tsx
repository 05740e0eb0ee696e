// What happened, newest last. Only the lines that are seen are made.
import { useSignal } from "@preact/signals";
import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import { NoteForm } from "../../people/NoteForm";
import { LOG_KINDS, type LogKind, type LogLine } from "../../records/logLine";
import { clockTenths, grouped } from "../../shared/format";
import { remember, remembered } from "../../shared/memory";
import { may } from "../../shared/session";
import { fill, strings } from "../../strings";
import { useOperating } from "../context";
import { Pane } from "../layout/Pane";
import { usePaced } from "../layout/pace";
import { Lines, type Wanted } from "./filter";
import "./log.css";
import { controls } from "../../shared/settings";
import { textScale } from "../../shared/textScale";

const text = strings.operate.log;

/** At the usual text size, as in the style sheet; with large controls, a finger finds each. */
const LINE_PX = { usual: 24, large: 48 };
const MARGIN_LINES = 10;
const PAGE = 2000;

export function LogPane() {
  const { scene } = useOperating();
  const page = usePaced(scene.log, 250);
  const words = useSignal("");
  const hidden = useSignal<ReadonlySet<LogKind>>(
    new Set(remembered<LogKind[]>("log.hidden", ["tokens", "data"])),
  );
  const urgentOnly = useSignal(false);
  const most = useSignal(PAGE);
  const loading = useSignal(false);
  const lines = useMemo(() => new Lines(), []);
  const wanted: Wanted = {
    words: words.value,
    hidden: hidden.value,
    urgentOnly: urgentOnly.value,
  };
  const shown = useMemo(
    () => lines.wanted(page.records, wanted, most.value),
    [lines, page, words.value, hidden.value, urgentOnly.value, most.value],
  );

  const older = async () => {
    most.value += PAGE;
    if (!page.more || page.records.length > most.value) return;
    loading.value = true;
    await scene.older().finally(() => (loading.value = false));
  };
  const turn = (kind: LogKind) => {
    const next = new Set(hidden.value);
    if (!next.delete(kind)) next.add(kind);
    hidden.value = next;
    remember("log.hidden", [...next]);
  };
  const hasOlder = page.more || page.records.length > most.value;

  return (
    <Pane
      title={strings.operate.panes.log}
      class="log-pane"
      tools={
        <input
          type="search"
          aria-label={text.filter}
          placeholder={text.filter}
          value={words.value}
          onInput={(event) => (words.value = event.currentTarget.value)}
        />
      }
    >
      <div class="log-kinds" role="group" aria-label={text.filter}>
        <button
          type="button"
          aria-pressed={urgentOnly.value}
          onClick={() => (urgentOnly.value = !urgentOnly.value)}
        >
          {text.urgentOnly}
        </button>
        {LOG_KINDS.map((kind) => (
          <button
            key={kind}
            type="button"
            aria-pressed={!hidden.value.has(kind)}
            onClick={() => turn(kind)}
          >
            {text.kinds[kind]}
          </button>
        ))}
        {hasOlder && (
          <button
            type="button"
            class="log-older"
            disabled={loading.value}
            onClick={() => void older()}
          >
            {loading.value ? text.loading : text.older}
          </button>
        )}
        {page.cut && <span>{text.cut}</span>}
        {words.value && (hasOlder || page.cut) && (
          <span>
            {fill(text.covers, {
              count: grouped(Math.min(most.value, page.records.length)),
            })}
          </span>
        )}
        {page.skipped > 0 && <span>{fill(text.skipped, { count: page.skipped })}</span>}
      </div>
      <LineList lines={shown} />
      {scene.mode === "live" && scene.run && may("operator") && <NoteForm run={scene.run} />}
    </Pane>
  );
}

function LineList({ lines }: { lines: LogLine[] }) {
  const box = useRef<HTMLDivElement>(null);
  const [top, setTop] = useState(0);
  const [height, setHeight] = useState(400);
  const [atEnd, setAtEnd] = useState(true);

  useEffect(() => {
    const observer = new ResizeObserver(() => setHeight(box.current!.clientHeight));
    observer.observe(box.current!);
    return () => observer.disconnect();
  }, []);
  useEffect(() => {
    if (atEnd && box.current) box.current.scrollTop = box.current.scrollHeight;
  }, [lines, atEnd, height]);

  const line_px = LINE_PX[controls.value] * textScale.value;
  const from = Math.max(0, Math.floor(top / line_px) - MARGIN_LINES);
  const to = Math.min(lines.length, Math.ceil((top + height) / line_px) + MARGIN_LINES);
  return (
    <div class="log-box">
      <div
        ref={box}
        class="log-lines"
        role="log"
        aria-live="off"
        aria-label={strings.operate.panes.log}
        tabIndex={0}
        onScroll={(event) => {
          const { scrollTop, scrollHeight, clientHeight } = event.currentTarget;
          setTop(scrollTop);
          setAtEnd(scrollHeight - scrollTop - clientHeight < line_px);
        }}
      >
        {lines.length === 0 && <p class="nothing">{text.none}</p>}
        <div style={`height: ${lines.length * line_px}px`}>
          <div style={`transform: translateY(${from * line_px}px)`}>
            {lines.slice(from, to).map((line) => (
              <Line key={line.seq} line={line} />
            ))}
          </div>
        </div>
      </div>
      {!atEnd && (
        <button type="button" class="log-newest" onClick={() => setAtEnd(true)}>
          ↓ {text.newest}
        </button>
      )}
    </div>
  );
}

function Line({ line }: { line: LogLine }) {
  const { selected } = useOperating();
  const { t, process, element } = line;
  const where = element ? { process, element, show: true } : null;
  return (
    <div
      class={line.urgent ? "log-line log-urgent" : "log-line"}
      title={`${line.record} ${line.seq}`}
    >
      <time>{clockTenths(t)}</time>
      <span class="log-mark" aria-hidden="true">
        {line.urgent ? "!" : ""}
      </span>
      {where ? (
        <button type="button" tabIndex={-1} onClick={() => (selected.value = where)}>
          {line.text}
        </button>
      ) : (
        <span>{line.text}</span>
      )}
    </div>
  );
}
