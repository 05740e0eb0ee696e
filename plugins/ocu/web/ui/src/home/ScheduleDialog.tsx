// A mission of the folder: when it starts, what it waits for, and what the check finds in it.
import type { ComponentChildren } from "preact";
import { useEffect, useState } from "preact/hooks";
import { ApiError, get, post } from "../shared/api";
import { Dialog } from "../shared/Dialog";
import type { Check, Fleet, MissionLine, RunLine, Schedule } from "../shared/types";
import { fill, strings } from "../strings";
import {
  dataOf,
  EMPTY,
  errorsOf,
  refusalOf,
  requestOf,
  type Errors,
  type Field,
  type Form,
  type Kind,
  type Outcome,
} from "./scheduling";

const words = strings.home.schedule.dialog;
const ZONE = Intl.DateTimeFormat().resolvedOptions().timeZone;
const KINDS: readonly Kind[] = ["free", "at", "cron"];
const OUTCOMES: readonly Outcome[] = ["completed", "terminated", "failed", "stopped"];
const CHECK_AFTER_MS = 300;

export function ScheduleDialog({ close }: { close(): void }) {
  const { missions, fleet, before } = useOffered();
  const [form, setForm] = useState<Form>(EMPTY);
  const [errors, setErrors] = useState<Errors>({});
  const [refusal, setRefusal] = useState("");
  const [isSending, setSending] = useState(false);
  useEffect(() => {
    // The first one, unless another was chosen before this runs.
    if (missions[0]) setForm((last) => ({ ...last, mission: last.mission || missions[0]!.name }));
  }, [missions]);
  const { check, setCheck } = useCheck(form);
  const change = (fields: Partial<Form>) => {
    setForm((last) => ({ ...last, ...fields }));
    const still = Object.entries(errors).filter(([name]) => !(name in fields));
    setErrors(Object.fromEntries(still) as Errors);
  };

  const submit = async () => {
    if (isSending) return;
    const wrong = errorsOf(form, words.errors);
    setErrors(wrong);
    setRefusal("");
    if (Object.keys(wrong).length > 0) return;
    setSending(true);
    try {
      await post("/schedule", requestOf(form, ZONE));
      close();
    } catch (error) {
      if (!(error instanceof ApiError)) {
        setRefusal(strings.shell.offline);
        return;
      }
      const { errors: refused, rest } = refusalOf(error);
      setErrors(refused);
      setRefusal(rest);
      const { findings } = error.problem;
      if (findings) setCheck((last) => ({ outline: last?.outline ?? null, findings }));
    } finally {
      setSending(false);
    }
  };
  const text = (name: Field & ("at" | "cron" | "until" | "condition" | "heldForS")) => ({
    value: form[name],
    onInput: (event: { currentTarget: HTMLInputElement }) =>
      change({ [name]: event.currentTarget.value }),
  });
  const processes = check?.outline?.processes.filter((each) => each.executable) ?? [];
  return (
    <Dialog
      title={words.title}
      onClose={close}
      actions={
        <>
          <button type="button" class="secondary" onClick={close}>
            {strings.home.cancel}
          </button>
          <button type="submit" form="schedule-mission" class="primary" disabled={isSending}>
            {words.submit}
          </button>
        </>
      }
    >
      <form
        id="schedule-mission"
        class="home-form"
        noValidate
        onSubmit={(event) => {
          event.preventDefault();
          void submit();
        }}
      >
        <Labelled name="mission" label={words.mission} error={errors.mission}>
          {(aria) => (
            <select
              {...aria}
              value={form.mission}
              onChange={(event) => change({ mission: event.currentTarget.value, process: "" })}
            >
              {missions.map(({ name }) => (
                <option key={name} value={name}>
                  {name}
                </option>
              ))}
            </select>
          )}
        </Labelled>
        {check && check.findings.length > 0 && <Findings check={check} />}
        <fieldset class="home-kinds">
          <legend>{words.start}</legend>
          {KINDS.map((each) => (
            <label key={each}>
              <input
                type="radio"
                name="kind"
                checked={form.kind === each}
                onChange={() => change({ kind: each })}
              />
              {words[each]}
            </label>
          ))}
        </fieldset>
        {form.kind === "at" && (
          <Labelled name="at" label={words.time} error={errors.at}>
            {(aria) => <input {...aria} type="datetime-local" step={1} {...text("at")} />}
          </Labelled>
        )}
        {form.kind === "cron" && (
          <Labelled name="cron" label={words.cronText} error={errors.cron}>
            {(aria) => (
              <input {...aria} type="text" placeholder="0 8 * * MON-FRI" {...text("cron")} />
            )}
          </Labelled>
        )}
        <More label={words.waits} errors={errors} of={["after", "outcomes", "condition", "vehicles", "heldForS"]}>
          {form.kind !== "cron" && (
            <Labelled name="after" label={words.after} error={errors.after}>
              {(aria) => (
                <select
                  {...aria}
                  value={form.after}
                  onChange={(event) => change({ after: event.currentTarget.value })}
                >
                  <option value="">{words.afterNothing}</option>
                  {before.map(({ id, label }) => (
                    <option key={id} value={id}>
                      {label}
                    </option>
                  ))}
                </select>
              )}
            </Labelled>
          )}
          {form.after && form.kind !== "cron" && (
            <Boxes
              label={words.outcomes}
              error={errors.outcomes}
              all={OUTCOMES.map((each) => ({ value: each, label: words.outcome[each] }))}
              chosen={form.outcomes}
              choose={(outcomes) => change({ outcomes: outcomes as Outcome[] })}
            />
          )}
          <Labelled name="condition" label={words.condition} error={errors.condition}>
            {(aria) => (
              <input
                {...aria}
                type="text"
                placeholder="vehicle.battery > 0.9"
                spellcheck={false}
                {...text("condition")}
              />
            )}
          </Labelled>
          {form.condition.trim() && (
            <>
              <Boxes
                label={words.vehicles}
                error={errors.vehicles}
                all={fleet.map((each) => ({ value: each, label: each }))}
                chosen={form.vehicles}
                choose={(vehicles) => change({ vehicles })}
              />
              <Labelled name="heldForS" label={words.heldFor} error={errors.heldForS}>
                {(aria) => <input {...aria} type="number" min={0} step="any" {...text("heldForS")} />}
              </Labelled>
            </>
          )}
        </More>
        <More label={words.missing} errors={errors} of={["until", "deadlineMin"]}>
          <Labelled name="until" label={words.until} error={errors.until}>
            {(aria) => <input {...aria} type="datetime-local" step={1} {...text("until")} />}
          </Labelled>
          <Labelled name="deadlineMin" label={words.deadline} error={errors.deadlineMin}>
            {(aria) => (
              <input
                {...aria}
                type="number"
                min={0}
                step="any"
                placeholder={form.kind === "free" ? words.noDeadline : "10"}
                value={form.deadlineMin}
                onInput={(event) => change({ deadlineMin: event.currentTarget.value })}
              />
            )}
          </Labelled>
          <Labelled name="missed" label={words.missed} error={errors.missed}>
            {(aria) => (
              <select
                {...aria}
                value={form.missed}
                onChange={(event) =>
                  change({ missed: event.currentTarget.value as Form["missed"] })
                }
              >
                <option value="skip">{words.skip}</option>
                <option value="run-once">{words.runOnce}</option>
              </select>
            )}
          </Labelled>
          {form.kind === "cron" && (
            <Labelled name="concurrency" label={words.concurrency} error={errors.concurrency}>
              {(aria) => (
                <select
                  {...aria}
                  value={form.concurrency}
                  onChange={(event) =>
                    change({ concurrency: event.currentTarget.value as Form["concurrency"] })
                  }
                >
                  <option value="forbid">{words.forbid}</option>
                  <option value="allow">{words.allow}</option>
                </select>
              )}
            </Labelled>
          )}
        </More>
        <More label={words.begins} errors={errors} of={["process", "data", "priority"]}>
          <Labelled name="priority" label={words.priority} error={errors.priority}>
            {(aria) => (
              <input
                {...aria}
                type="number"
                step={1}
                value={form.priority}
                onInput={(event) => change({ priority: event.currentTarget.value })}
              />
            )}
          </Labelled>
          <Labelled name="process" label={words.process} error={errors.process}>
            {(aria) => (
              <select
                {...aria}
                value={form.process}
                onChange={(event) => change({ process: event.currentTarget.value })}
              >
                <option value="">{words.mainProcess}</option>
                {processes.map(({ id, name }) => (
                  <option key={id} value={id}>
                    {name && name !== id ? `${name} (${id})` : id}
                  </option>
                ))}
              </select>
            )}
          </Labelled>
          <Labelled name="data" label={words.data} error={errors.data}>
            {(aria) => (
              <textarea
                {...aria}
                rows={2}
                placeholder="speed = 3"
                spellcheck={false}
                value={form.data}
                onInput={(event) => change({ data: event.currentTarget.value })}
              />
            )}
          </Labelled>
        </More>
        {refusal && (
          <p role="alert" class="home-error">
            {refusal}
          </p>
        )}
        <p class="home-note">{fill(words.note, { zone: ZONE })}</p>
      </form>
    </Dialog>
  );
}

interface Aria {
  id: string;
  "aria-invalid"?: "true";
  "aria-describedby"?: string;
}

interface LabelledProps {
  name: Field;
  label: string;
  error: string | undefined;
  children(aria: Aria): ComponentChildren;
}

/** A field with its label, and what is wrong with it. */
function Labelled({ name, label, error, children }: LabelledProps) {
  const id = `schedule-field-${name}`;
  const aria: Aria = error
    ? { id, "aria-invalid": "true", "aria-describedby": `${id}-error` }
    : { id };
  return (
    <div class="home-field">
      <label for={id}>{label}</label>
      {children(aria)}
      {error && (
        <p class="home-error" id={`${id}-error`} role="alert">
          {error}
        </p>
      )}
    </div>
  );
}

interface BoxesProps {
  label: string;
  error: string | undefined;
  all: readonly { value: string; label: string }[];
  chosen: readonly string[];
  choose(chosen: string[]): void;
}

function Boxes({ label, error, all, chosen, choose }: BoxesProps) {
  const without = (value: string) => chosen.filter((each) => each !== value);
  return (
    <fieldset class="home-kinds home-boxes">
      <legend>{label}</legend>
      {all.map(({ value, label: name }) => (
        <label key={value}>
          <input
            type="checkbox"
            checked={chosen.includes(value)}
            onChange={(event) =>
              choose(event.currentTarget.checked ? [...chosen, value] : without(value))
            }
          />
          {name}
        </label>
      ))}
      {error && (
        <p class="home-error" role="alert">
          {error}
        </p>
      )}
    </fieldset>
  );
}

interface MoreProps {
  label: string;
  errors: Errors;
  /** Opens when one of these fields is wrong. */
  of: readonly Field[];
  children: ComponentChildren;
}

function More({ label, errors, of, children }: MoreProps) {
  const [isOpen, setOpen] = useState(false);
  const hasError = of.some((each) => errors[each] !== undefined);
  return (
    <details
      class="home-more"
      open={isOpen || hasError}
      onToggle={(event) => setOpen(event.currentTarget.open)}
    >
      <summary>{label}</summary>
      <div class="home-form">{children}</div>
    </details>
  );
}

function Findings({ check }: { check: Check }) {
  const count = check.findings.filter(({ severity }) => severity === "error").length;
  return (
    <div class="home-findings" role="status">
      <strong>{count > 0 ? words.refused : words.warnings}</strong>
      <ul>
        {check.findings.map(({ severity, rule, element, message, remedy }) => (
          <li key={`${rule} ${element} ${message}`} class={`home-finding-${severity}`}>
            {element && <code>{element}</code>} {message}
            {remedy && <span class="home-remedy"> {remedy}</span>}
          </li>
        ))}
      </ul>
    </div>
  );
}

/** What may be chosen: missions of the folder, vehicles, and what a mission may come after. */
function useOffered() {
  const [missions, setMissions] = useState<readonly MissionLine[]>([]);
  const [fleet, setFleet] = useState<readonly string[]>([]);
  const [before, setBefore] = useState<readonly { id: string; label: string }[]>([]);
  useEffect(() => {
    void get<MissionLine[]>("/missions").then(setMissions, () => undefined);
    void get<Fleet>("/fleet").then(
      ({ vehicles }) => setFleet(vehicles.map(({ id }) => id)),
      () => undefined,
    );
    void Promise.all([get<Schedule>("/schedule"), get<RunLine[]>("/runs")]).then(
      ([{ entries }, runs]) =>
        setBefore([
          ...entries.map(({ entry, mission, status }) => ({
            id: entry,
            label: `${entry} ${fileOf(mission)} (${status})`,
          })),
          ...runs.map(({ run, mission, status }) => ({
            id: run,
            label: `${run} ${fileOf(mission)} (${status})`,
          })),
        ]),
      () => undefined,
    );
  }, []);
  return { missions, fleet, before };
}

const fileOf = (mission: string): string => mission.replace(/^.*[\\/]/, "");

/** What the check finds in the chosen mission; it follows the choice, and what begins it. */
function useCheck({ mission, process, data }: Form) {
  const [check, setCheck] = useState<Check | null>(null);
  const names = JSON.stringify(Object.keys(dataOf(data) ?? {}));
  useEffect(() => {
    if (!mission) return;
    let isOld = false;
    const given = Object.fromEntries((JSON.parse(names) as string[]).map((name) => [name, null]));
    const timer = setTimeout(() => {
      void post<Check>("/checks", { mission, process: process || null, data: given }).then(
        (found) => {
          if (!isOld) setCheck(found);
        },
        () => undefined,
      );
    }, CHECK_AFTER_MS);
    return () => {
      isOld = true;
      clearTimeout(timer);
    };
  }, [mission, process, names]);
  return { check, setCheck };
}
