// All vehicles and payloads, line by line. A thousand of them are no more work than those seen.
import { useSignal } from "@preact/signals";
import { useEffect, useLayoutEffect, useRef, useState } from "preact/hooks";
import { DomainSymbol } from "../operate/vehicles/DomainSymbol";
import { useUniqueId } from "../shared/uniqueId";
import { fill, strings } from "../strings";
import { Holder } from "./CommandPanel";
import type { Column, Grouping, Line, Row } from "./rows";
import { centred, focused, select, selected, sorting } from "./state";
import { cellOf } from "./text";
import { scrolledTo, windowOf } from "./virtualRows";
import { controls } from "../shared/settings";
import { textScale } from "../shared/textScale";

const text = strings.fleet;

const COLUMNS: readonly Column[] = [
  "name",
  "health",
  "holder",
  "doing",
  "link",
  "battery",
  "mode",
  "speed",
  "height",
  "failsafe",
  "position",
];
/** As in the style sheet: every line is as high as the others. At the usual text size. */
const LINE_PX = matchMedia("(pointer: coarse)").matches ? 44 : 34;
const LARGE_LINE_PX = 48;
const HEAD_PX = 36;

const linePx = (): number =>
  (controls.value === "large" ? LARGE_LINE_PX : LINE_PX) * textScale.value;

export interface FleetTableProps {
  lines: readonly Line[];
  grouping: Grouping;
  onCommands: () => void;
}

export function FleetTable({ lines, grouping, onCommands }: FleetTableProps) {
  const id = useUniqueId();
  const box = useRef<HTMLDivElement>(null);
  const scrolled = useSignal(0);
  const [seen_px, setSeen] = useState(600);
  /** The line that the keys are at. */
  const active = useSignal("");
  useLayoutEffect(() => {
    const element = box.current!;
    const measure = () => setSeen(element.clientHeight);
    const observer = new ResizeObserver(measure);
    observer.observe(element);
    return () => observer.disconnect();
  }, []);

  const at = lines.findIndex((line) => line.kind === "row" && line.row.id === active.value);
  const { from, to } = windowOf(lines.length, {
    scrolled_px: scrolled.value,
    seen_px,
    line_px: linePx(),
  });
  const goTo = (index: number) => {
    const line = lines[index];
    if (line?.kind !== "row") return;
    active.value = line.row.id;
    focused.value = line.row.id;
    const element = box.current!;
    element.scrollTop = scrolledTo(index, {
      scrolled_px: element.scrollTop,
      seen_px: element.clientHeight,
      line_px: linePx(),
      head_px: HEAD_PX * textScale.value,
    });
    scrolled.value = element.scrollTop;
  };
  // What was chosen on the map is seen here too.
  useEffect(
    () =>
      focused.subscribe((resource) => {
        if (!resource || resource === active.peek()) return;
        goTo(lines.findIndex((line) => line.kind === "row" && line.row.id === resource));
      }),
    [lines],
  );

  const key = (event: KeyboardEvent) => {
    if (event.target instanceof HTMLButtonElement || event.target instanceof HTMLAnchorElement) {
      return;
    }
    const page = Math.max(1, Math.floor(seen_px / linePx()) - 2);
    const step = { ArrowDown: 1, ArrowUp: -1, PageDown: page, PageUp: -page }[event.key];
    if (step !== undefined) goTo(stepped(lines, at, step));
    else if (event.key === "Home") goTo(stepped(lines, -1, 1));
    else if (event.key === "End") goTo(stepped(lines, lines.length, -1));
    else if (event.key === " " && active.value) {
      select([active.value], !selected.value.has(active.value));
    } else if (event.key === "Enter" && active.value) onCommands();
    else return;
    event.preventDefault();
  };

  const shown = lines.slice(from, to);
  const rows = lines.flatMap((line) => (line.kind === "row" ? line.row.id : []));
  const areAllSelected = rows.length > 0 && rows.every((each) => selected.value.has(each));
  const lineId = (index: number) => `${id}-${index}`;
  return (
    <div
      ref={box}
      class="fleet-scroll"
      onScroll={(event) => (scrolled.value = event.currentTarget.scrollTop)}
    >
      <table
        class="fleet-table"
        role="grid"
        aria-label={text.panes.table}
        aria-describedby={`${id}-hint`}
        aria-multiselectable
        aria-rowcount={lines.length + 1}
        aria-colcount={COLUMNS.length + 1}
        aria-activedescendant={at >= from && at < to ? lineId(at) : undefined}
        tabIndex={0}
        onKeyDown={key}
      >
        <thead>
          <tr aria-rowindex={1}>
            <th scope="col" class="fleet-check">
              <input
                type="checkbox"
                aria-label={text.selectAll}
                title={text.selectAll}
                checked={areAllSelected}
                onChange={() => select(rows, !areAllSelected)}
              />
            </th>
            {COLUMNS.map((column) => (
              <Head key={column} column={column} />
            ))}
          </tr>
        </thead>
        <tbody>
          <Space lines={from} />
          {shown.map((line, offset) =>
            line.kind === "group" ? (
              <Group
                key={`group ${line.group}`}
                {...line}
                grouping={grouping}
                index={from + offset}
              />
            ) : (
              <RowLine
                key={line.row.id}
                row={line.row}
                id={lineId(from + offset)}
                index={from + offset}
                isActive={from + offset === at}
                onChoose={() => {
                  active.value = line.row.id;
                  focused.value = line.row.id;
                }}
                onCommands={onCommands}
              />
            ),
          )}
          <Space lines={lines.length - to} />
        </tbody>
      </table>
      <p id={`${id}-hint`} class="for-readers">
        {text.hint}
      </p>
    </div>
  );
}

/** The next line that is a row. */
function stepped(lines: readonly Line[], at: number, step: number): number {
  const sign = Math.sign(step);
  let index = Math.max(0, Math.min(lines.length - 1, at + step));
  while (lines[index] && lines[index]!.kind !== "row") index += sign;
  return lines[index] ? index : at;
}

const Space = ({ lines }: { lines: number }) =>
  lines > 0 ? (
    <tr aria-hidden="true">
      <td style={{ height: `${lines * linePx()}px`, padding: 0 }} />
    </tr>
  ) : null;

function Head({ column }: { column: Column }) {
  const isSorted = sorting.value.column === column;
  const { descending } = sorting.value;
  return (
    <th
      scope="col"
      class={`fleet-${column}`}
      aria-sort={isSorted ? (descending ? "descending" : "ascending") : "none"}
    >
      <button
        type="button"
        onClick={() => (sorting.value = { column, descending: isSorted && !descending })}
      >
        {text.columns[column]}
        <span aria-hidden="true">{isSorted ? (descending ? " ▼" : " ▲") : ""}</span>
      </button>
    </th>
  );
}

interface GroupProps {
  group: string;
  count: number;
  grouping: Grouping;
  index: number;
}

function Group({ group, count, grouping, index }: GroupProps) {
  return (
    <tr class="fleet-group" aria-rowindex={index + 2}>
      <td colSpan={COLUMNS.length + 1}>
        {groupName(grouping, group)} <small>{count}</small>
      </td>
    </tr>
  );
}

function groupName(grouping: Grouping, group: string): string {
  if (grouping === "health") return text.health[group as Row["health"]];
  if (grouping === "domain") return strings.operate.vehicles.domain[group as Row["domain"]];
  if (grouping === "host") return group || text.executiveHost;
  if (grouping === "holder" && group === "") return text.free;
  return group;
}

interface RowLineProps {
  row: Row;
  id: string;
  index: number;
  isActive: boolean;
  onChoose: () => void;
  onCommands: () => void;
}

function RowLine({ row, id, index, isActive, onChoose, onCommands }: RowLineProps) {
  const isSelected = selected.value.has(row.id);
  const isStale = ["lost", "unheard", "unknown"].includes(row.health);
  const classes = [
    row.isPayload && "fleet-payload",
    isActive && "fleet-active",
    focused.value === row.id && "fleet-focused",
    isStale && "fleet-stale",
  ];
  return (
    <tr
      id={id}
      class={classes.filter(Boolean).join(" ")}
      aria-rowindex={index + 2}
      aria-selected={isSelected}
      onClick={onChoose}
      onDblClick={() => {
        centred.value = { resource: row.id };
        onCommands();
      }}
    >
      <td class="fleet-check">
        <input
          type="checkbox"
          tabIndex={-1}
          aria-label={fill(text.selectRow, { name: row.id })}
          checked={isSelected}
          onClick={(event) => event.stopPropagation()}
          onChange={() => select([row.id], !isSelected)}
        />
      </td>
      {COLUMNS.map((column) => (
        <Cell key={column} row={row} column={column} />
      ))}
    </tr>
  );
}

function Cell({ row, column }: { row: Row; column: Column }) {
  const content = cellOf(row, column);
  switch (column) {
    case "name":
      return (
        <th scope="row" class="fleet-name" title={row.id}>
          <DomainSymbol domain={row.domain} />
          <span>{row.id}</span>
        </th>
      );
    case "health":
      return (
        <td class="fleet-health-cell" title={row.reasons.join("\n") || undefined}>
          <span class={`fleet-pill fleet-${row.health}`}>{content}</span>
        </td>
      );
    case "holder":
      return (
        <td class="fleet-holder" title={row.status?.unavailable || undefined}>
          <Holder row={row} />
        </td>
      );
    case "battery":
      return (
        <td class={row.flags.lowBattery ? "fleet-battery bad" : "fleet-battery"}>{content}</td>
      );
    case "link":
      return <td class={row.health === "lost" ? "fleet-link bad" : "fleet-link"}>{content}</td>;
    case "failsafe": {
      const differs = (row.failsafeProblems?.length ?? 0) > 0;
      const why = [content, ...(row.failsafeProblems ?? [])].join("\n");
      return (
        <td class={differs ? "fleet-failsafe bad" : "fleet-failsafe"} title={why}>
          {content}
        </td>
      );
    }
    default:
      return (
        <td class={`fleet-${column}`} title={content || undefined}>
          {content}
        </td>
      );
  }
}
