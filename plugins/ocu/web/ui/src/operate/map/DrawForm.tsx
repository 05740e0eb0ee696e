// To draw with the keyboard: the vertices as numbers, and what the geometry is called.
import { useSignal } from "@preact/signals";
import { fill, strings } from "../../strings";
import { added, moved, problemOf, removed, undone, type Draft, type Vertex } from "./draft";

const text = strings.operate.map;

export interface DrawFormProps {
  draft: Draft;
  /** A run that it can be for alone. */
  run: string;
  onChange: (draft: Draft) => void;
  onSave: (runOnly: boolean) => void;
  onCancel: () => void;
  middle: () => Vertex;
}

export function DrawForm({ draft, run, onChange, onSave, onCancel, middle }: DrawFormProps) {
  const runOnly = useSignal(false);
  const problem = problemOf(draft);
  return (
    <form
      class="draw-form"
      aria-label={`${text.draw}: ${text.kinds[draft.kind]}`}
      onSubmit={(event) => {
        event.preventDefault();
        if (!problem) onSave(runOnly.value);
      }}
      onKeyDown={(event) => {
        if (event.key === "Escape" && !event.shiftKey) onCancel();
      }}
    >
      <p class="hint">{text.clickHint}</p>
      <div class="draw-row">
        <label>
          {text.name}
          <input
            value={draft.name}
            placeholder={text.nameHint}
            spellcheck={false}
            onInput={(event) => onChange({ ...draft, name: event.currentTarget.value })}
          />
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
      <ol class="draw-vertices">
        {draft.vertices.map((vertex, index) => (
          <li key={index}>
            <VertexFields
              vertex={vertex}
              label={fill(text.vertex, { number: index + 1 })}
              onChange={(to) => onChange(moved(draft, index, to))}
            />
            <button
              type="button"
              class="plain"
              aria-label={fill(text.removeVertex, { number: index + 1 })}
              onClick={() => onChange(removed(draft, index))}
            >
              ×
            </button>
          </li>
        ))}
      </ol>
      <div class="draw-row">
        <button type="button" class="secondary" onClick={() => onChange(added(draft, middle()))}>
          {text.addCentre}
        </button>
        <button
          type="button"
          class="secondary"
          disabled={draft.before.length === 0}
          onClick={() => onChange(undone(draft))}
        >
          {text.undo}
        </button>
        <span class="space" />
        <button type="button" class="secondary" onClick={onCancel}>
          {text.cancel}
        </button>
        <button class="primary" disabled={problem !== null}>
          {text.finish}
        </button>
      </div>
      <p class="hint" role="status">
        {problem === "vertices" && text.needs[draft.kind]}
        {problem === "name" && text.needsName}
      </p>
    </form>
  );
}

interface VertexFieldsProps {
  vertex: Vertex;
  label: string;
  onChange: (to: Partial<Vertex>) => void;
}

function VertexFields({ vertex, label, onChange }: VertexFieldsProps) {
  const number = (name: string, value: number | null, limit: number, set: (value: number | null) => void) => (
    <input
      type="number"
      step="any"
      min={-limit}
      max={limit}
      aria-label={`${label}: ${name}`}
      placeholder={name}
      value={value ?? ""}
      onChange={({ currentTarget: { value: typed, valueAsNumber, validity } }) => {
        if (typed === "") set(null);
        else if (validity.valid) set(valueAsNumber);
      }}
    />
  );
  return (
    <>
      {number(text.latitude, Number(vertex.latitude.toFixed(7)), 90, (latitude) => {
        if (latitude !== null) onChange({ latitude });
      })}
      {number(text.longitude, Number(vertex.longitude.toFixed(7)), 180, (longitude) => {
        if (longitude !== null) onChange({ longitude });
      })}
      {number(text.altitude, vertex.altitude, 20_000, (altitude) => onChange({ altitude }))}
    </>
  );
}
