// The data of a run that goes on, by process and subprocess; it is changed while the run is paused.
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { get } from "../../shared/api";
import { order } from "../../shared/command";
import { fill, strings } from "../../strings";
import { useOperating } from "../context";
import { usePaced } from "../layout/pace";
import { pathOf } from "./setting";
import { valueOf } from "./values";

const text = strings.debug;

const AGAIN_MS = 500;

/** As `GET /api/runs/{run}/data` has it; both ids "": data stores. `scope` null: it stays. */
interface ScopeData {
  process: string;
  element: string;
  data: Record<string, unknown>;
  scope: number | null;
  instance: number | null;
  token: number | null;
}

/** As `GET /api/runs/{run}/value` has it. `reason`: which name is not set. */
interface ExpressionValue {
  value: unknown;
  kind: string;
  reason: string;
}

export function RunData({ mayChange }: { mayChange: boolean }) {
  const shown = useOperating();
  const { scene } = shown;
  const found = useSignal<ScopeData[]>([]);
  const problem = useSignal("");
  const events = usePaced(scene.events, AGAIN_MS);
  useEffect(() => {
    let left = false;
    get<ScopeData[]>(`${pathOf(shown)}/data`).then(
      (data) => {
        if (left) return;
        found.value = data;
        problem.value = "";
      },
      (error: unknown) => {
        if (!left) problem.value = error instanceof Error ? error.message : String(error);
      },
    );
    return () => {
      left = true;
    };
  }, [events, scene]);
  return (
    <section class="run-data" aria-label={text.data}>
      <strong>{text.data}</strong>
      {!mayChange && <p class="hint">{text.dataRuns}</p>}
      {problem.value && <p role="alert">{fill(text.dataFailed, { why: problem.value })}</p>}
      {found.value.map((each) => (
        <Scope key={`${each.element} ${each.scope} ${each.token}`} of={each} mayChange={mayChange} />
      ))}
      <Evaluate />
    </section>
  );
}

/** The value of an expression, as the element sees the data that is next; nothing changes. */
function Evaluate() {
  const shown = useOperating();
  const typed = useSignal("");
  const answer = useSignal("");
  const evaluate = async (event: Event) => {
    event.preventDefault();
    const token = String(shown.scene.debugging.value?.reached?.token ?? 0);
    const query = new URLSearchParams({ expression: typed.value.trim(), token });
    try {
      const { value, kind, reason } = await get<ExpressionValue>(`${pathOf(shown)}/value?${query}`);
      answer.value = `${JSON.stringify(value)} ${value === null ? reason : kind}`;
    } catch (error) {
      answer.value = error instanceof Error ? error.message : String(error);
    }
  };
  return (
    <form class="value-form" onSubmit={(event) => void evaluate(event)}>
      <input
        aria-label={text.expression}
        placeholder={text.expression}
        value={typed.value}
        spellcheck={false}
        onInput={(event) => (typed.value = event.currentTarget.value)}
      />
      <button class="secondary" disabled={!typed.value.trim()}>
        {text.evaluate}
      </button>
      <output class="problem">{answer.value}</output>
    </form>
  );
}

function Scope({ of, mayChange }: { of: ScopeData; mayChange: boolean }) {
  const { mission } = useOperating();
  const named = of.element ? mission.label(of.process, of.element) : text.stores;
  const title =
    of.instance === null
      ? named
      : fill(text.instance, { element: named, number: of.instance + 1 });
  const names = Object.keys(of.data);
  return (
    <section aria-label={title}>
      <p>
        <strong>{title}</strong> {of.scope === null && <small>{text.fixed}</small>}
      </p>
      {names.length === 0 && <p class="hint">{text.noData}</p>}
      <dl>
        {names.map((name) => (
          <Value
            key={name}
            name={name}
            value={of.data[name]}
            scope={mayChange ? of.scope : null}
          />
        ))}
      </dl>
      {mayChange && of.scope !== null && of.token === null && of.element && (
        <NewValue scope={of.scope} />
      )}
    </section>
  );
}

interface ValueProps {
  name: string;
  value: unknown;
  /** null: it cannot be changed. */
  scope: number | null;
}

function Value({ name, value, scope }: ValueProps) {
  const changing = useSignal(false);
  const written = JSON.stringify(value);
  return (
    <>
      <dt>{name}</dt>
      <dd>
        {changing.value && scope !== null ? (
          <ValueForm
            label={fill(text.value, { name })}
            before={written}
            scope={scope}
            name={name}
            onClose={() => (changing.value = false)}
          />
        ) : (
          <>
            <code>{written}</code>
            {scope !== null && (
              <button
                type="button"
                class="plain"
                aria-label={fill(text.changeOf, { name })}
                onClick={() => (changing.value = true)}
              >
                {text.change}
              </button>
            )}
          </>
        )}
      </dd>
    </>
  );
}

function NewValue({ scope }: { scope: number }) {
  const open = useSignal(false);
  const name = useSignal("");
  if (!open.value) {
    return (
      <button type="button" class="plain" onClick={() => (open.value = true)}>
        {text.addValue}
      </button>
    );
  }
  return (
    <div class="new-value">
      <label>
        {text.name}
        <input
          value={name.value}
          spellcheck={false}
          onInput={(event) => (name.value = event.currentTarget.value)}
        />
      </label>
      <ValueForm
        label={text.newValue}
        before=""
        scope={scope}
        name={name.value.trim()}
        onClose={() => {
          open.value = false;
          name.value = "";
        }}
      />
    </div>
  );
}

interface FormProps {
  label: string;
  /** The text of the field at first. */
  before: string;
  scope: number;
  name: string;
  onClose: () => void;
}

function ValueForm({ label, before, scope, name, onClose }: FormProps) {
  const shown = useOperating();
  const typed = useSignal(before);
  const problem = useSignal("");
  const save = async (event: Event) => {
    event.preventDefault();
    const value = valueOf(typed.value);
    if (value === undefined) {
      problem.value = text.wrong;
      return;
    }
    try {
      await order(`${pathOf(shown)}/data`, { data: { [name]: value }, scope });
      onClose();
    } catch (error) {
      problem.value = error instanceof Error ? error.message : String(error);
    }
  };
  return (
    <form class="value-form" onSubmit={(event) => void save(event)}>
      <input
        aria-label={label}
        placeholder={label}
        value={typed.value}
        spellcheck={false}
        autocomplete="off"
        aria-invalid={problem.value !== ""}
        onInput={(event) => {
          typed.value = event.currentTarget.value;
          problem.value = "";
        }}
      />
      <button class="secondary" disabled={!name || !typed.value.trim()}>
        {text.save}
      </button>
      <button type="button" class="plain" onClick={onClose}>
        {text.cancel}
      </button>
      <p role="alert" class="problem">
        {problem.value}
      </p>
    </form>
  );
}
