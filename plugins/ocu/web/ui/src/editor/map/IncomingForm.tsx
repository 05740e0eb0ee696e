// What is in a file, before it becomes the mission's: which of it, and under which names.
import { strings, fill } from "../../strings";
import type { Incoming, MapPlan } from "./plan";

const words = strings.plan;
const kinds = strings.operate.map.kinds;

export function IncomingForm({ plan, incoming }: { plan: MapPlan; incoming: Incoming }) {
  const { file, drawings, problems } = incoming;
  const change = (at: number, to: Partial<Incoming["drawings"][number]>) => {
    const next = drawings.map((each, index) => (index === at ? { ...each, ...to } : each));
    plan.incoming.value = { ...incoming, drawings: next };
  };
  const taken = drawings.filter((each) => each.taken);
  const names = taken.map(({ name }) => name);
  const isUsable = (name: string) =>
    /^[\w.-]{1,100}$/.test(name) &&
    plan.isFree(name) &&
    names.filter((each) => each === name).length < 2;
  const usable = taken.length > 0 && names.every(isUsable);
  return (
    <form
      class="plan-form"
      aria-label={fill(words.incoming, { file })}
      onSubmit={(event) => {
        event.preventDefault();
        if (!usable) return;
        plan.put(taken);
        plan.incoming.value = null;
        plan.selected.value = names[0] ?? "";
      }}
    >
      <p class="plan-sizes">
        <strong>{fill(words.incoming, { file })}</strong>
      </p>
      <ul class="plan-incoming">
        {drawings.map(({ name, kind, taken: isTaken }, at) => (
          <li key={at}>
            <label>
              <input
                type="checkbox"
                checked={isTaken}
                onChange={({ currentTarget }) => change(at, { taken: currentTarget.checked })}
              />
              {kinds[kind]}
            </label>
            <input
              value={name}
              spellcheck={false}
              aria-label={`${words.name}: ${kinds[kind]} ${at + 1}`}
              aria-invalid={isTaken && !isUsable(name)}
              onInput={({ currentTarget }) => change(at, { name: currentTarget.value.trim() })}
            />
          </li>
        ))}
      </ul>
      {problems.length > 0 && (
        <details open>
          <summary>{words.problems}</summary>
          <ul>
            {problems.map((each) => (
              <li key={each}>{each}</li>
            ))}
          </ul>
        </details>
      )}
      <div class="plan-actions">
        <span class="plan-space" />
        <button type="button" class="secondary" onClick={() => plan.cancel()}>
          {words.cancel}
        </button>
        <button class="primary" disabled={!usable}>
          {words.takeAll}
        </button>
      </div>
    </form>
  );
}
