// The breakpoints of a run and its data; of what is over, the stops that it made.
import { useSignal } from "@preact/signals";
import { command, replace } from "../../shared/command";
import { clockTenths } from "../../shared/format";
import { fill, strings } from "../../strings";
import { useOperating } from "../context";
import { Icon } from "../layout/icons";
import { Pane } from "../layout/Pane";
import { breakpointsOf, placesOf, turned, type Breakpoints } from "./breakpoints";
import { RunData } from "./RunData";
import { mayHaveOne, pathOf, refusalOf } from "./setting";
import { reasonOf } from "./StopBanner";
import "./debug.css";

const text = strings.debug;

export default function DebugPane() {
  const shown = useOperating();
  const { scene } = shown;
  if (scene.mode === "replay") {
    return (
      <Pane title={fill(text.stops, { count: scene.stops.length })} class="debug-pane" scrolls>
        <Stops />
      </Pane>
    );
  }
  const refusal = refusalOf(shown);
  const isPaused = scene.status.value === "paused";
  const data = refusal !== null && <RunData mayChange={refusal === "" && isPaused} />;
  const steps = refusal === "" && isPaused && (
    <button
      type="button"
      class="secondary"
      title={text.stepHint}
      onClick={() => void command(`${pathOf(shown)}/step`)}
    >
      <Icon name="forward" />
      {text.step}
    </button>
  );
  return (
    <Pane title={text.title} class="debug-pane" tools={steps} scrolls>
      {isPaused && data}
      {isPaused && <strong>{text.title}</strong>}
      <p class="hint">{text.hint}</p>
      {refusal && <p class="hint">{refusal}</p>}
      <List mayChange={refusal === ""} />
      {!isPaused && data}
    </Pane>
  );
}

function List({ mayChange }: { mayChange: boolean }) {
  const shown = useOperating();
  const { scene, mission, selected } = shown;
  const typed = useSignal("");
  const problem = useSignal("");
  const there = breakpointsOf(scene.debugging.value);
  const chosen = selected.value;
  const isSet = !!chosen && there.elements.includes(chosen.element);

  const set = async (wanted: Breakpoints): Promise<boolean> => {
    problem.value = "";
    try {
      await replace(`${pathOf(shown)}/breakpoints`, wanted);
      return true;
    } catch (error) {
      problem.value = error instanceof Error ? error.message : String(error);
      return false;
    }
  };
  const addCondition = async (event: Event) => {
    event.preventDefault();
    const condition = typed.value.trim();
    if (!condition || there.conditions.includes(condition)) return;
    if (await set({ ...there, conditions: [...there.conditions, condition] })) typed.value = "";
  };
  const turnElement = (id: string) =>
    void set({ ...there, elements: turned(there.elements, id) });
  const count = there.elements.length + there.conditions.length;
  return (
    <>
      {count === 0 && <p>{text.none}</p>}
      <ul class="breakpoints" aria-label={text.title}>
        {there.elements.map((id) => {
          const [place] = placesOf([id], mission);
          const name = place?.label ?? id;
          return (
            <li key={id}>
              <button
                type="button"
                class="plain"
                disabled={!place}
                onClick={() => {
                  if (place) selected.value = { process: place.process, element: id, show: true };
                }}
              >
                {name}
              </button>
              {mayChange && <Remove name={name} act={() => turnElement(id)} />}
            </li>
          );
        })}
        {there.conditions.map((condition) => (
          <li key={condition}>
            <code>{fill(text.when, { condition })}</code>
            {mayChange && (
              <Remove
                name={fill(text.when, { condition })}
                act={() => void set({ ...there, conditions: turned(there.conditions, condition) })}
              />
            )}
          </li>
        ))}
      </ul>
      {mayChange && (
        <>
          <p class="hint">{text.how}</p>
          <div class="breakpoint-acts">
            {chosen && !isSet && mayHaveOne(mission, chosen) && (
              <button
                type="button"
                class="secondary"
                onClick={() => turnElement(chosen.element)}
              >
                {fill(text.addAt, { element: mission.label(chosen.process, chosen.element) })}
              </button>
            )}
            {count > 0 && (
              <button
                type="button"
                class="secondary"
                onClick={() => void set({ elements: [], conditions: [] })}
              >
                {text.removeAll}
              </button>
            )}
          </div>
          <form class="breakpoint-condition" onSubmit={(event) => void addCondition(event)}>
            <label>
              {text.condition}
              <input
                value={typed.value}
                placeholder={text.conditionHint}
                spellcheck={false}
                autocomplete="off"
                aria-invalid={problem.value !== ""}
                onInput={(event) => (typed.value = event.currentTarget.value)}
              />
            </label>
            <button class="secondary" disabled={!typed.value.trim()}>
              {text.add}
            </button>
          </form>
          <p role="alert" class="problem">
            {problem.value}
          </p>
        </>
      )}
    </>
  );
}

function Remove({ name, act }: { name: string; act: () => void }) {
  const label = fill(text.removeOf, { name });
  return (
    <button type="button" class="plain" aria-label={label} title={label} onClick={act}>
      ×
    </button>
  );
}

/** Where a run that is over was stopped; the replay goes there. */
function Stops() {
  const { scene, mission } = useOperating();
  return (
    <ul class="breakpoints" aria-label={text.title}>
      {scene.stops.map((stop) => {
        const label = mission.label(stop.process, stop.element);
        const where = stop.element ? fill(text.stopped, { element: label }) : text.stoppedOutside;
        return (
          <li key={stop.seq}>
            <button type="button" class="plain" onClick={() => scene.seekRecord?.(stop.seq)}>
              {clockTenths(stop.t)} {where} <small>{reasonOf(stop)}</small>
            </button>
          </li>
        );
      })}
    </ul>
  );
}
