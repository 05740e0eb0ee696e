// The map beside the diagram: routes, areas and points are drawn, named and changed on it, and what
// the mission commands is numbered.
import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { added, draftOf, LEAST, undone, type Draft, type Kind } from "../../map/draft";
import { session } from "../../shared/session";
import { Menu } from "../../shared/Menu";
import { fill, strings } from "../../strings";
import type { EditorContext } from "../panels/panel";
import { IconButton } from "../toolbar/icons";
import { DraftForm } from "./DraftForm";
import { exportAs, FORMATS, readFile } from "./files";
import { GeometryForm } from "./GeometryForm";
import { IncomingForm } from "./IncomingForm";
import { RehearsalPlayer } from "./RehearsalPlayer";
import { colourOf } from "./colours";
import { Estimates } from "./estimates/Estimates";
import { PlanMap } from "./planMap";
import { middleOfArea } from "./survey/SurveyLayer";
import { SurveyForm } from "./survey/SurveyForm";
import "./plan.css";

const words = strings.plan;
const KINDS: readonly Kind[] = ["route", "area", "point"];
const ICONS: Record<Kind, string> = {
  route: "M3 15 8 6l4 6 4-8",
  area: "M4 6l8-2 5 6-4 7-9-3z",
  point: "M10 17s5-6 5-9.500a5 5 0 0 0-10 0C5 11 10 17 10 17z",
};

export default function MapPanel({ editor }: { editor: EditorContext }) {
  const { plan, catalogue } = editor;
  const host = useRef<HTMLDivElement>(null);
  const view = useRef<PlanMap>();
  const isOver = useSignal(false);

  useEffect(() => {
    const { fleet } = catalogue;
    const made = new PlanMap(host.current!, fleet, session.peek()?.tiles ?? null, {
      chosen: (name) => choose(editor, name),
      commandChosen: (task) => void editor.select(task),
      clicked: (at) => {
        const draft = plan.draft.value;
        if (!draft) return plan.pick(`[${at.latitude.toFixed(7)}, ${at.longitude.toFixed(7)}]`);
        const next = added(draft, at);
        if (draft.kind === "point") plan.finish(next);
        else plan.draft.value = next;
      },
      finished: () => plan.draft.value && finish(editor, plan.draft.value),
      edited: (draft) => {
        if (plan.draft.value) plan.draft.value = draft;
        else plan.change(draft);
      },
    });
    view.current = made;
    let first = true;
    const show = () => {
      const tasks = editor.selected.value.map(({ id }) => id);
      made.show({
        geometries: catalogue.geometries.value,
        commands: plan.commands.value,
        selected: plan.selected.value,
        tasks,
        colour: (who) => colourOf(fleet.vehicles, who),
      });
      const own = catalogue.own.value.find(({ name }) => name === plan.selected.value);
      const { value: draft } = plan.draft;
      const isSurveyed = plan.surveys.open.peek() !== null;
      made.edit(isSurveyed ? null : (draft ?? (own ? draftOf(own) : null)), draft !== null);
      if (first && catalogue.geometries.value.length > 0) {
        first = editor.changes.peek() === 0; // the mission's own come when it has been opened
        made.fit();
      }
    };
    const survey = () => {
      const { open, preview } = plan.surveys;
      const area = open.value && plan.find(open.value.pattern.area);
      if (!open.value || !area) return made.survey.show(null, () => undefined);
      const { routes } = preview.value;
      const heading_deg = open.value.pattern.heading_deg ?? routes?.best_heading_deg ?? 0;
      const middle = middleOfArea(draftOf(area).vertices);
      made.survey.show({ routes, heading_deg, middle }, (turned) =>
        plan.surveys.set({ heading_deg: turned }),
      );
    };
    const looked = () => {
      const [task] = editor.selected.value;
      const [command] = plan.commands.value.filter((each) => each.task === task?.id);
      const geometry = command && plan.find(command.geometry);
      if (geometry) made.look(geometry);
    };
    const mark = () => {
      const chosen = editor.selected.value.map(({ id }) => id);
      made.mark(editor.checks.findings.value.filter(({ element }) => chosen.includes(element)));
    };
    const stops = [
      ...[editor.selected, editor.checks.findings].map((each) => each.subscribe(mark)),
      ...[plan.commands, plan.selected, plan.draft, catalogue.geometries].map((each) =>
        each.subscribe(show),
      ),
      editor.selected.subscribe(() => {
        show();
        looked();
      }),
      ...[plan.surveys.open, plan.surveys.preview].map((each) => each.subscribe(survey)),
      plan.surveys.open.subscribe(show),
      plan.picking.subscribe((now) => made.pickPlace(now?.kind === "position")),
      plan.incoming.subscribe((now) =>
        made.propose((now?.drawings ?? []).filter(({ taken }) => taken).map((each) => each.feature)),
      ),
    ];
    return () => {
      for (const stop of stops) stop();
      made.dispose();
    };
  }, [editor]);

  const draft = plan.draft.value;
  const incoming = plan.incoming.value;
  const selected = plan.find(plan.selected.value);
  const isSurveying = !draft && !incoming && plan.surveys.open.value !== null;
  const take = (files: FileList | null | undefined) => {
    const [file] = files ?? [];
    if (file) void readFile(plan, file);
  };
  return (
    <section
      class={`plan${isOver.value ? " plan-over" : ""}`}
      aria-label={words.map}
      onKeyDown={(event) => keyDown(editor, event)}
      onDragOver={(event) => {
        if (!event.dataTransfer?.types.includes("Files")) return;
        event.preventDefault();
        isOver.value = true;
      }}
      onDragLeave={() => (isOver.value = false)}
      onDrop={(event) => {
        event.preventDefault();
        isOver.value = false;
        take(event.dataTransfer?.files);
      }}
    >
      <Tools editor={editor} take={take} fit={() => view.current?.fit()} />
      <Picks editor={editor} />
      <div ref={host} class="map" role="application" aria-label={words.label} />
      {plan.rehearsal.value && (
        <RehearsalPlayer
          key={plan.rehearsal.value.id}
          editor={editor}
          rehearsal={plan.rehearsal.value}
          map={() => view.current}
        />
      )}
      <Estimates editor={editor} />
      {isOver.value && <p class="plan-drop">{words.dropHint}</p>}
      {draft && (
        <DraftForm
          draft={draft}
          change={(next) => (plan.draft.value = next)}
          addMiddle={() => view.current && (plan.draft.value = added(draft, view.current.middle()))}
          undo={() => (plan.draft.value = undone(draft))}
          done={() => finish(editor, draft)}
          cancel={() => plan.cancel()}
        />
      )}
      {!draft && incoming && <IncomingForm plan={plan} incoming={incoming} />}
      {isSurveying && <SurveyForm editor={editor} />}
      {!draft && !incoming && !isSurveying && selected && (
        <GeometryForm key={selected.name} editor={editor} geometry={selected} />
      )}
    </section>
  );
}

function finish({ plan }: EditorContext, draft: Draft): void {
  if (draft.vertices.length >= LEAST[draft.kind]) plan.finish(draft);
}

/** What is clicked is what was to be picked; else it is looked at, and its first task is selected. */
function choose(editor: EditorContext, name: string): void {
  const { plan } = editor;
  const geometry = plan.find(name);
  if (geometry && plan.fits(geometry)) return plan.pick(name);
  plan.selected.value = name;
  const [user] = name ? plan.usedBy(name) : [];
  if (user) void editor.select(user.task);
}

/** Keys of the canvas would delete what is selected there. */
function keyDown({ plan }: EditorContext, event: KeyboardEvent): void {
  if (event.key !== "Escape" || event.shiftKey) return;
  const { draft, picking, incoming, surveys } = plan;
  if (draft.value ?? picking.value ?? incoming.value ?? surveys.open.value) plan.cancel();
  else plan.selected.value = "";
}

function Picks({ editor: { plan } }: { editor: EditorContext }) {
  const picking = plan.picking.value;
  if (!picking || plan.draft.value) return null;
  const text = picking.kind === "position" ? words.pickingPlace : words.picking;
  return (
    <p class="plan-picking" role="status">
      <span>{fill(text, { label: picking.label })}</span>
      <button type="button" class="secondary" onClick={() => plan.cancel()}>
        {words.cancel}
      </button>
    </p>
  );
}

interface ToolsProps {
  editor: EditorContext;
  take(files: FileList | null): void;
  fit(): void;
}

function Tools({ editor, take, fit }: ToolsProps) {
  const { plan, catalogue } = editor;
  const file = useRef<HTMLInputElement>(null);
  const all = catalogue.geometries.value;
  const drawn = plan.draft.value?.kind;
  return (
    <div class="plan-tools" role="toolbar" aria-label={words.tools}>
      {KINDS.map((kind) => (
        <button
          key={kind}
          type="button"
          class="plain"
          aria-pressed={drawn === kind}
          title={words.drawHint[kind]}
          onClick={() => (drawn === kind ? plan.cancel() : plan.begin(kind))}
        >
          <svg viewBox="0 0 20 20" width="18" height="18" aria-hidden="true" focusable="false">
            <path d={ICONS[kind]} fill="none" stroke="currentColor" stroke-width="1.8" />
          </svg>
          {words.draw[kind]}
        </button>
      ))}
      <select
        aria-label={words.geometries}
        value={plan.selected.value}
        onChange={({ currentTarget: { value } }) => choose(editor, value)}
      >
        <option value="">{words.none}</option>
        {(["mission", "fleet", "operator"] as const).map((from) => {
          const those = all.filter((each) => each.from === from);
          return those.length === 0 ? null : (
            <optgroup key={from} label={words.groups[from]}>
              {those.map(({ name }) => (
                <option key={name} value={name}>
                  {name}
                </option>
              ))}
            </optgroup>
          );
        })}
      </select>
      <IconButton icon="fit" label={words.fit} act={fit} />
      <Menu
        label={words.files}
        class="plain"
        items={[
          { label: words.import, act: () => file.current?.click() },
          ...FORMATS.map((format) => ({
            label: `${words.export}: ${words.formats[format]}`,
            disabled: all.length === 0,
            act: () => void exportAs(editor, format),
          })),
        ]}
      >
        {words.files} ▾
      </Menu>
      <input
        ref={file}
        type="file"
        hidden
        aria-label={words.import}
        onChange={({ currentTarget }) => {
          take(currentTarget.files);
          currentTarget.value = "";
        }}
      />
    </div>
  );
}
