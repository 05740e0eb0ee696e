// The elements of the mission as a tree, with how they stand: for the keyboard, for screen readers,
// and for users who look for one.
import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { fill, strings } from "../../strings";
import type { ElementState } from "../../shared/types";
import { lookOf, SIGNS, type Look } from "../diagram/colours";
import { statesOf, violationOf, visitsOf } from "../diagram/spoken";
import { useOperating } from "../context";
import { markInWords, marksIn, signOf, type Mark } from "../debug/breakpoints";
import { isBreakpointKey, openMenu } from "../debug/menu";
import { turn as turnBreakpoint } from "../debug/setting";
import { Pane } from "../layout/Pane";
import type { MissionNode } from "../mission/missionModel";
import { keyOf } from "../mission/names";
import { VIOLATION, violationsIn } from "../requirements/violations";
import { moved, rowsOf, type Row } from "./rows";
import "./outline.css";

const text = strings.operate.outline;

/** Rows have no ring around them that tells states without colours. */
const ROW_SIGNS: Record<Look, string> = { ...SIGNS, active: "●", done: "✓" };

export function OutlinePane() {
  const shown = useOperating();
  const { scene, mission, selected } = shown;
  const folded = useSignal<ReadonlySet<string>>(new Set());
  const wanted = useSignal("");
  const current = useSignal("");
  const tree = useRef<HTMLUListElement>(null);
  scene.elements.slow.value;

  const violations = violationsIn(scene.requirements.value, mission);
  const marks = marksIn(scene.debugging.value, mission);
  const rows = rowsOf(mission.trees, folded.value, wanted.value);
  const chosen = selected.value ? keyOf(selected.value.process, selected.value.element) : "";
  const reached = rows.some(({ key }) => key === current.value) ? current.value : rows[0]?.key;

  useEffect(() => {
    if (!chosen) return;
    current.value = chosen;
    tree.current?.querySelector("[aria-selected=true]")?.scrollIntoView({ block: "nearest" });
  }, [chosen]);

  const focus = (key: string) => {
    current.value = key;
    const index = rows.findIndex((row) => row.key === key);
    tree.current?.querySelectorAll<HTMLElement>("[role=treeitem]")[index]?.focus();
  };
  const choose = (node: MissionNode) => {
    selected.value = { process: node.process, element: node.id, show: true };
  };
  const turn = (key: string, fold: boolean) => {
    const next = new Set(folded.value);
    if (fold) next.add(key);
    else next.delete(key);
    folded.value = next;
  };
  const press = (event: KeyboardEvent, row: Row) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    if (event.key === "Enter" || event.key === " ") {
      event.preventDefault();
      choose(row.node);
      return;
    }
    if (isBreakpointKey(event) && row.node.type !== "Process") {
      event.stopPropagation();
      turnBreakpoint(shown, row.node.id);
      return;
    }
    const move = moved(rows, row.key, event.key);
    if (!move) return;
    event.preventDefault();
    if (move.fold !== undefined) turn(row.key, move.fold);
    else focus(move.to);
  };

  const showMenu = (event: MouseEvent, { node, key }: Row) => {
    if (scene.mode !== "live" || node.type === "Process") return;
    event.preventDefault();
    current.value = key;
    const { left, bottom } = (event.currentTarget as HTMLElement).getBoundingClientRect();
    // A key has no place.
    const [x, y] = event.button === 2 ? [event.clientX, event.clientY] : [left + 24, bottom];
    openMenu(shown, { process: node.process, element: node.id }, x, y);
  };

  return (
    <Pane title={strings.operate.panes.outline} class="outline-pane">
      <input
        type="search"
        aria-label={text.search}
        placeholder={text.search}
        value={wanted.value}
        onInput={(event) => (wanted.value = event.currentTarget.value)}
        onKeyDown={(event) => {
          if (event.key === "ArrowDown" && reached) focus(reached);
        }}
      />
      {rows.length === 0 && <p class="nothing">{text.none}</p>}
      <ul ref={tree} role="tree" aria-label={strings.operate.panes.outline}>
        {rows.map((row) => (
          <Item
            key={row.key}
            row={row}
            state={scene.elements.get(row.node.process, row.node.id)}
            violated={violations.get(keyOf(row.node.process, row.node.id)) ?? []}
            mark={marks.get(keyOf(row.node.process, row.node.id))}
            selected={row.key === chosen}
            reached={row.key === reached}
            onKeyDown={(event) => press(event, row)}
            onClick={() => {
              current.value = row.key;
              choose(row.node);
            }}
            onMenu={(event) => showMenu(event, row)}
            onTurn={() => turn(row.key, row.open === true)}
          />
        ))}
      </ul>
    </Pane>
  );
}

interface ItemProps {
  row: Row;
  state: ElementState | undefined;
  /** The requirements that are violated, and about it. */
  violated: readonly string[];
  mark: Mark | undefined;
  selected: boolean;
  reached: boolean;
  onKeyDown: (event: KeyboardEvent) => void;
  onClick: () => void;
  onMenu: (event: MouseEvent) => void;
  onTurn: () => void;
}

function Item(props: ItemProps) {
  const { row, state, violated, mark, selected, reached, onKeyDown, onClick, onMenu, onTurn } = props;
  const { node, level, open } = row;
  const look: Look = state ? lookOf(state) : "idle";
  const isProcess = node.type === "Process";
  const said = [
    node.label,
    node.kind,
    node.calls && fill(text.calls, { process: node.calls }),
    ...(isProcess ? visitsOf(state) : statesOf(state)),
    violationOf(violated),
    markInWords(mark),
  ];
  return (
    <li
      role="treeitem"
      class={`item item-${look} ${isProcess ? "item-process" : ""}`}
      style={`padding-left: ${(level - 1) * 14 + 6}px`}
      aria-level={level}
      aria-selected={selected}
      aria-expanded={open ?? undefined}
      aria-label={said.filter(Boolean).join(", ")}
      tabIndex={reached ? 0 : -1}
      onKeyDown={onKeyDown}
      onClick={onClick}
      onContextMenu={onMenu}
    >
      <span
        class="fold"
        aria-hidden="true"
        onClick={(event) => {
          if (open === null) return;
          event.stopPropagation();
          onTurn();
        }}
      >
        {open === null ? "" : open ? "▾" : "▸"}
      </span>
      {!isProcess && (
        <i class="dot" aria-hidden="true">
          {ROW_SIGNS[look]}
        </i>
      )}
      <span class="name">{node.label}</span>
      {violated.length > 0 && (
        <i class="violates" aria-hidden="true" title={violationOf(violated)}>
          {VIOLATION}
        </i>
      )}
      {mark && (
        <i class="marked" aria-hidden="true" title={markInWords(mark)}>
          {signOf(mark)}
        </i>
      )}
      {state && state.hits > 0 && <span class="hits" data-hits={state.hits} />}
    </li>
  );
}
