// To draw with the keyboard: the vertices as numbers, and what the geometry is called.
import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { ApiError, get } from "../../shared/api";
import { replace } from "../../shared/command";
import { attempt, toast } from "../../shared/Toasts";
import { fill, strings } from "../../strings";
import type { AltitudeFrame, Geometry } from "../../shared/types";
import { useOperating } from "../context";
import {
  added,
  featureOf,
  moved,
  problemOf,
  removed,
  undone,
  type Draft,
} from "../../map/draft";
import { withOwn } from "../../map/ownGeometry";
import { VertexList } from "../../map/VertexList";
import "./draw.css";

const text = strings.operate.map;

const FRAMES: AltitudeFrame[] = ["relative", "amsl", "terrain"];

export function DrawForm({ draft }: { draft: Draft }) {
  const { scene, geometries, draft: drawn, middle } = useOperating();
  const runOnly = useSignal(false);
  const saving = useSignal(false);
  // The runs that use the name, once the executive has said so.
  const usedBy = useSignal<string[]>([]);
  const name = useRef<HTMLInputElement>(null);
  useEffect(() => name.current?.focus(), []);
  const problem = problemOf(draft);
  const run = scene.mode === "live" ? scene.run : "";
  const change = (to: Draft) => (drawn.value = to);
  const cancel = () => (drawn.value = null);

  const save = async () => {
    const { name } = draft;
    const body = {
      geometry: featureOf(draft),
      force: usedBy.value.length > 0,
      ...(runOnly.value && run ? { run } : {}),
    };
    saving.value = true;
    try {
      await replace(`/geometries/${encodeURIComponent(name)}`, body);
    } catch (error) {
      const runs = error instanceof ApiError ? error.problem.runs : undefined;
      if (Array.isArray(runs)) usedBy.value = runs.map(String);
      else toast(error instanceof Error ? error.message : String(error), "bad");
      return;
    } finally {
      saving.value = false;
    }
    toast(fill(text.saved, { name }), "good");
    drawn.value = null;
    const own = geometries.value.filter(({ from }) => from === "mission");
    await attempt(
      async () => (geometries.value = withOwn(own, await get<Geometry[]>("/geometries"))),
    );
  };

  return (
    <form
      class="draw-form"
      aria-label={`${text.draw}: ${text.kinds[draft.kind]}`}
      onSubmit={(event) => {
        event.preventDefault();
        if (!problem) void save();
      }}
      onKeyDown={(event) => {
        if (event.key === "Escape" && !event.shiftKey) cancel();
      }}
    >
      <p class="hint">{text.clickHint}</p>
      <div class="draw-row">
        <label>
          {text.name}
          <input
            ref={name}
            value={draft.name}
            placeholder={text.nameHint}
            spellcheck={false}
            onInput={(event) => {
              usedBy.value = [];
              change({ ...draft, name: event.currentTarget.value });
            }}
          />
        </label>
        <label>
          {text.above}
          <select
            value={draft.frame}
            onChange={(event) =>
              change({ ...draft, frame: event.currentTarget.value as AltitudeFrame })
            }
          >
            {FRAMES.map((frame) => (
              <option key={frame} value={frame}>
                {text.frames[frame]}
              </option>
            ))}
          </select>
        </label>
        {run && (
          <label>
            {text.scope}
            <select
              value={runOnly.value ? "run" : "all"}
              onChange={(event) => (runOnly.value = event.currentTarget.value === "run")}
            >
              <option value="all">{text.scopeAll}</option>
              <option value="run">{text.scopeRun}</option>
            </select>
          </label>
        )}
      </div>
      <VertexList
        vertices={draft.vertices}
        hasSpeeds={draft.kind === "route"}
        move={(index, to) => change(moved(draft, index, to))}
        remove={(index) => change(removed(draft, index))}
      />
      {usedBy.value.length > 0 && !runOnly.value && (
        <p role="alert">{fill(text.used, { name: draft.name, runs: usedBy.value.join(", ") })}</p>
      )}
      <div class="draw-row draw-actions">
        <button
          type="button"
          class="secondary"
          onClick={() => change(added(draft, middle.current()))}
        >
          {text.addCentre}
        </button>
        <button
          type="button"
          class="secondary"
          disabled={draft.before.length === 0}
          onClick={() => change(undone(draft))}
        >
          {text.undo}
        </button>
        <span class="space" />
        <button type="button" class="secondary" onClick={cancel}>
          {text.cancel}
        </button>
        <button class="primary" disabled={problem !== null || saving.value}>
          {usedBy.value.length > 0 && !runOnly.value ? text.replace : text.finish}
        </button>
      </div>
      <p class="hint" role="status">
        {problem === "vertices" && text.needs[draft.kind]}
        {problem === "name" && text.needsName}
      </p>
    </form>
  );
}
