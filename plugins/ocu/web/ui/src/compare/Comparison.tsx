// Two versions of a mission side by side: what was added, removed, changed and moved, on the
// diagrams, on the map, and in words.
import { useSignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import { IconButton } from "../editor/toolbar/icons";
import { geometriesInFile } from "../map/ownGeometry";
import { loaded } from "../shared/loaded";
import type { Fleet } from "../shared/types";
import { fill, strings } from "../strings";
import type { ChangeKind } from "./changes";
import { geometryChanges, type GeometryChange } from "./geometryChanges";
import { SideBySide, type DiagramChoice } from "./SideBySide";
import "./compare.css";

const words = strings.compare;

const ZOOM = 1.25;

const RouteMap = loaded(() => import("./RouteMap"));

interface Line {
  kind: ChangeKind;
  /** Of an element; "": it is a geometry. */
  id: string;
  label: string;
  details: readonly string[];
}

interface Compared {
  lines: readonly Line[];
  geometries: readonly GeometryChange[];
  diagrams: readonly DiagramChoice[];
  fleet: Fleet;
}

/** What is compared: files of BPMN with diagrams, and the fleet that the map shows. */
export interface Versions {
  before: string;
  after: string;
  fleet: Fleet;
}

export interface ComparisonProps {
  read(): Promise<Versions>;
  /** What `read` reads: it is read again when this is another one. */
  of: string;
  /** What says, or chooses, which versions these are. */
  children?: ComponentChildren;
}

export function Comparison({ read, of, children }: ComparisonProps) {
  const [compared, setCompared] = useState<Compared | null>(null);
  const problem = useSignal("");
  const diagram = useSignal("");
  const has = useSignal({ before: true, after: true });
  const chosen = useSignal<Line | null>(null);
  const hosts = { before: useRef<HTMLDivElement>(null), after: useRef<HTMLDivElement>(null) };
  const sides = useRef<SideBySide | null>(null);

  const show = async (id: string) => {
    diagram.value = id;
    if (sides.current) has.value = await sides.current.show(id);
  };
  const choose = async (line: Line) => {
    chosen.value = line;
    const here = line.id && sides.current?.diagramOf(line.id);
    if (!here) return;
    if (here !== diagram.value) await show(here);
    sides.current?.select(line.id);
  };

  useEffect(() => {
    let ended = false;
    const made = new SideBySide(hosts.before.current!, hosts.after.current!, (id) => {
      const line = lines.find((each) => each.id === id);
      if (line) void choose(line);
    });
    let lines: readonly Line[] = [];
    sides.current = made;
    const begin = async () => {
      setCompared(null);
      const { before: old, after: now, fleet } = await read();
      if (ended) return;
      const diagrams = await made.open(old, now);
      if (ended) return;
      const geometries = geometryChanges(geometriesInFile(old), geometriesInFile(now));
      lines = [...made.changes, ...geometries.flatMap(lineOf)];
      setCompared({ lines, geometries, diagrams, fleet });
      const [first] = made.changes.map(({ id }) => made.diagramOf(id)).filter(Boolean);
      await show(first ?? diagrams[0]?.id ?? "");
    };
    problem.value = "";
    chosen.value = null;
    begin().catch((error: unknown) => {
      problem.value = error instanceof Error ? error.message : String(error);
    });
    return () => {
      ended = true;
      made.dispose();
    };
  }, [of]);

  const changed = compared?.geometries.some(({ kind }) => kind !== "same") ?? false;
  return (
    <div class="cmp">
      <div class="cmp-heads">
        {children}
        {(compared?.diagrams.length ?? 0) > 1 && (
          <label>
            {words.diagram}{" "}
            <select
              value={diagram.value}
              onChange={(event) => void show(event.currentTarget.value)}
            >
              {compared!.diagrams.map(({ id, label }) => (
                <option key={id} value={id}>
                  {label}
                </option>
              ))}
            </select>
          </label>
        )}
        <span class="cmp-zoom">
          <IconButton
            icon="minus"
            label={words.zoomOut}
            act={() => sides.current?.zoom(1 / ZOOM)}
          />
          <IconButton icon="plus" label={words.zoomIn} act={() => sides.current?.zoom(ZOOM)} />
          <IconButton icon="fit" label={words.fit} act={() => sides.current?.fit()} />
        </span>
      </div>
      {problem.value && (
        <p role="alert" class="bad">
          {fill(words.failed, { reason: problem.value })}
        </p>
      )}
      <div class={changed ? "cmp-body cmp-with-map" : "cmp-body"}>
        {(["before", "after"] as const).map((where) => (
          <section key={where} class="cmp-half" aria-label={words[where]}>
            <div ref={hosts[where]} class="cmp-sheet m2-canvas" />
            {!has.value[where] && <p class="cmp-absent">{words.absent}</p>}
          </section>
        ))}
        {changed && compared && (
          <RouteMap
            fleet={compared.fleet}
            changes={compared.geometries}
            selected={chosen.value && !chosen.value.id ? chosen.value.label : ""}
          />
        )}
        <section class="cmp-list" aria-label={words.list}>
          <p role="status">{compared ? summary(compared.lines) : words.loading}</p>
          <ul>
            {compared?.lines.map((line) => (
              <li key={`${line.kind} ${line.id} ${line.label}`}>
                <button
                  type="button"
                  class="cmp-line"
                  aria-pressed={chosen.value === line}
                  onClick={() => void choose(line)}
                >
                  <span class={`cmp-sign cmp-sign-${line.kind}`} aria-hidden="true">
                    {words.signs[line.kind]}
                  </span>
                  <span>
                    <b>{line.label}</b> <small>{words.kinds[line.kind]}</small>
                    {line.details.map((detail) => (
                      <span key={detail} class="cmp-detail">
                        {detail}
                      </span>
                    ))}
                  </span>
                </button>
              </li>
            ))}
          </ul>
        </section>
      </div>
    </div>
  );
}

const lineOf = ({ kind, name, details }: GeometryChange): Line[] =>
  kind === "same" ? [] : [{ kind, id: "", label: name, details }];

function summary(lines: readonly Line[]): string {
  if (lines.length === 0) return words.none;
  const count = (kind: ChangeKind) => lines.filter((line) => line.kind === kind).length;
  return fill(words.summary, {
    added: count("added"),
    removed: count("removed"),
    changed: count("changed"),
    moved: count("moved"),
  });
}
