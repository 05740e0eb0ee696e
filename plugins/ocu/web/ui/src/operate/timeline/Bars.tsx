// The bars of a time line; arrow keys go from one to the other.
import { useSignal } from "@preact/signals";
import { useRef } from "preact/hooks";
import type { Span } from "../../records/spans";
import { clock } from "../../shared/format";
import { fill, strings } from "../../strings";
import { useOperating } from "../context";
import type { Window } from "./scale";
import type { Row } from "./TimelinePane";

const text = strings.operate.timeline;

/** Narrower ones can hardly be seen, or hit. */
const LEAST_PX = 3;

/** What tells how it ended without its colour; the lines around bars do so, too. */
const SIGNS: Partial<Record<Span["end"], string>> = { failed: "✕ ", cancelled: "– ", unknown: "? " };

export interface BarsProps {
  rows: Row[];
  window: Window;
  width: number;
  now: number;
  lane_px: number;
  onSeek?: ((t: number) => void) | undefined;
}

export function Bars({ rows, window, width, now, lane_px, onSeek }: BarsProps) {
  const { selected, mission } = useOperating();
  const current = useSignal("");
  const group = useRef<SVGGElement>(null);
  const last_s = window.from_s + width / window.px_per_s;
  const seen = rows.flatMap((row) =>
    row.bars
      .filter(({ span }) => (span.to ?? now) >= window.from_s && span.from <= last_s)
      .map((bar) => ({ row, ...bar })),
  );
  const reached = seen.some(({ span }) => span.id === current.value)
    ? current.value
    : seen[0]?.span.id;

  const choose = ({ id, process, element, from }: Span) => {
    current.value = id;
    if (element) selected.value = { process, element, show: true };
    onSeek?.(from);
  };
  const press = (event: KeyboardEvent, index: number) => {
    if (event.key === "Enter" || event.key === " ") {
      event.preventDefault();
      choose(seen[index]!.span);
      return;
    }
    const to = nextOf(seen, index, event.key);
    if (to === null) return;
    event.preventDefault();
    current.value = seen[to]!.span.id;
    group.current?.querySelectorAll<SVGElement>(".bar")[to]?.focus();
  };

  return (
    <g ref={group}>
      {seen.map(({ row, span, lane }, index) => {
        const from = Math.max(0, (span.from - window.from_s) * window.px_per_s);
        const to = Math.min(width, ((span.to ?? now) - window.from_s) * window.px_per_s);
        const wide = Math.max(LEAST_PX, to - from);
        const label = mission.label(span.process, span.element);
        const shown = shownOf(span, label);
        return (
          <g
            key={span.id + span.from}
            class={`bar bar-${span.kind} bar-${span.end || "open"}`}
            transform={`translate(${from} ${row.top + lane * lane_px + 3})`}
            role="button"
            tabIndex={span.id === reached ? 0 : -1}
            aria-label={`${row.title}: ${shown}, ${saidOf(span)}`}
            onKeyDown={(event) => press(event, index)}
            onClick={(event) => {
              event.stopPropagation();
              choose(span);
            }}
          >
            <title>{`${shown}\n${saidOf(span)}`}</title>
            <rect width={wide} height={lane_px - 4} rx={3} />
            {wide > 40 && (
              <svg width={wide - 4} height={lane_px - 4} aria-hidden="true">
                <text x={6} y={(lane_px - 4) * 0.72}>
                  {SIGNS[span.end]}
                  {shown}
                </text>
              </svg>
            )}
          </g>
        );
      })}
    </g>
  );
}

/** `label`: of its element. A bar that replaces many says how many, of what they share. */
function shownOf(span: Span, label: string): string {
  const both = span.kind === "behavior" ? [label, span.label] : [label];
  const said = both.filter(Boolean).join(" · ");
  return (span.count ?? 1) > 1 ? fill(text.merged, { count: span.count!, what: said }) : said;
}

type Seen = { row: Row; span: Span };

/** Left and right: in the row; up and down: the nearest in another. */
function nextOf(seen: readonly Seen[], at: number, key: string): number | null {
  const { row, span } = seen[at]!;
  const indices = seen.map((_, index) => index);
  if (key === "ArrowRight" || key === "ArrowLeft") {
    const to = at + (key === "ArrowRight" ? 1 : -1);
    return seen[to]?.row === row ? to : null;
  }
  if (key !== "ArrowDown" && key !== "ArrowUp") return null;
  const below = key === "ArrowDown";
  const beyond = indices.filter((index) =>
    below ? seen[index]!.row.top > row.top : seen[index]!.row.top < row.top,
  );
  const next = below ? seen[beyond[0] ?? -1]?.row : seen[beyond.at(-1) ?? -1]?.row;
  const away = (index: number) => Math.abs(seen[index]!.span.from - span.from);
  return (
    beyond
      .filter((index) => seen[index]!.row === next)
      .sort((one, other) => away(one) - away(other))[0] ?? null
  );
}

function saidOf({ from, to, end, reason, kind, label }: Span): string {
  const when = `${clock(from)} – ${to === null ? text.goesOn : clock(to)}`;
  const how = end ? text.ends[end] : "";
  return [kind === "prompt" ? label : "", when, how, reason].filter(Boolean).join(", ");
}
