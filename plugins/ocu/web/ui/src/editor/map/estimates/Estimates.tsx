// What the mission takes as it is drawn, of each vehicle: live, while it is drawn.
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { writtenLength } from "../../../map/measure";
import { post } from "../../../shared/api";
import { clock } from "../../../shared/format";
import { Latest } from "../../../shared/latest";
import { remember, remembered } from "../../../shared/memory";
import { fill, strings } from "../../../strings";
import type { EditorContext } from "../../panels/panel";
import "../survey/survey.css";
import "./estimates.css";

const words = strings.estimates;
const PAUSE_MS = 600;
const PERCENT = 100;
const OPEN = "editor-estimates";

interface VehicleEstimate {
  vehicle: string;
  distance_m: number;
  time_s: number;
  battery_left: number;
  endurance_s: number | null;
  stated: boolean;
}

interface TaskEstimate {
  element: string;
  label: string;
  vehicle: string;
  begins_s: number;
  distance_m: number;
  time_s: number;
  battery_left: number;
}

interface MissionEstimate {
  time_s: number;
  reserve: number;
  vehicles: VehicleEstimate[];
  tasks: TaskEstimate[];
  left_out: { element: string; label: string; reason: string }[];
}

export function Estimates({ editor }: { editor: EditorContext }) {
  const isOpen = useSignal(remembered(OPEN, false));
  const found = useSignal<MissionEstimate | null>(null);
  const problem = useSignal("");
  useEffect(() => {
    if (!isOpen.value) return undefined;
    const latest = new Latest<number, MissionEstimate>(
      async () => post("/estimates", { xml: await editor.xml(), mission: editor.mission }),
      {
        answer: (estimate) => {
          found.value = estimate;
          problem.value = "";
        },
        failed: (error) => {
          found.value = null;
          problem.value = error instanceof Error ? error.message : String(error);
        },
      },
      PAUSE_MS,
    );
    const stop = editor.changes.subscribe((count) => latest.soon(count));
    return () => {
      stop();
      latest.end();
    };
  }, [editor, isOpen.value]);
  const estimate = found.value;
  return (
    <details
      class="estimates"
      open={isOpen.value}
      onToggle={({ currentTarget }) => {
        isOpen.value = currentTarget.open;
        remember(OPEN, currentTarget.open);
      }}
    >
      <summary>
        {words.title}
        {isOpen.value && estimate && estimate.vehicles.length > 0 && (
          <span> · {fill(words.sum, { time: clock(estimate.time_s) })}</span>
        )}
      </summary>
      {isOpen.value && (
        <div class="estimates-inside">
          {problem.value && (
            <p class="plan-wrong" role="alert">
              {fill(words.failed, { reason: problem.value })}
            </p>
          )}
          {estimate && <Found editor={editor} estimate={estimate} />}
        </div>
      )}
    </details>
  );
}

interface FoundProps {
  editor: EditorContext;
  estimate: MissionEstimate;
}

function Found({ editor, estimate: { vehicles, tasks, left_out, reserve } }: FoundProps) {
  const link = (element: string, label: string) => (
    <button type="button" class="m2-link-button" onClick={() => void editor.select(element)}>
      {label}
    </button>
  );
  return (
    <>
      {vehicles.length === 0 ? (
        <p class="terrain-words">{words.none}</p>
      ) : (
        <div class="survey-table" tabIndex={0} role="group" aria-label={words.table}>
          <table aria-label={words.table}>
            <thead>
              <tr>
                {[words.vehicle, words.distance, words.time, words.battery].map((each) => (
                  <th key={each} scope="col">
                    {each}
                  </th>
                ))}
              </tr>
            </thead>
            <tbody>
              {vehicles.map((each) => (
                <tr key={each.vehicle}>
                  <th scope="row">{each.vehicle}</th>
                  <td>{writtenLength(each.distance_m)}</td>
                  <td>{clock(each.time_s)}</td>
                  <td>
                    <Battery estimate={each} reserve={reserve} />
                  </td>
                </tr>
              ))}
            </tbody>
          </table>
        </div>
      )}
      {tasks.length > 0 && (
        <details>
          <summary>{words.tasks}</summary>
          <div class="survey-table" tabIndex={0} role="group" aria-label={words.tasks}>
            <table aria-label={words.tasks}>
              <thead>
                <tr>
                  {[words.task, words.vehicle, words.begins, words.distance, words.time].map((each) => (
                    <th key={each} scope="col">
                      {each}
                    </th>
                  ))}
                </tr>
              </thead>
              <tbody>
                {tasks.map((each) => (
                  <tr key={`${each.element} ${each.vehicle}`}>
                    <th scope="row">{link(each.element, each.label)}</th>
                    <td>{each.vehicle}</td>
                    <td>{clock(each.begins_s)}</td>
                    <td>{writtenLength(each.distance_m)}</td>
                    <td>{clock(each.time_s)}</td>
                  </tr>
                ))}
              </tbody>
            </table>
          </div>
        </details>
      )}
      {left_out.length > 0 && (
        <details>
          <summary>{fill(words.leftOut, { count: left_out.length })}</summary>
          <ul class="estimates-left">
            {left_out.map(({ element, label, reason }) => (
              <li key={`${element} ${reason}`}>
                {link(element, label)} {reason}
              </li>
            ))}
          </ul>
        </details>
      )}
    </>
  );
}

function Battery({ estimate, reserve }: { estimate: VehicleEstimate; reserve: number }) {
  const { battery_left, endurance_s, stated } = estimate;
  if (endurance_s === null) return <>{strings.survey.unknown}</>;
  const percent = Math.round(battery_left * PERCENT);
  const isLow = battery_left < reserve;
  const text =
    battery_left <= 0
      ? words.lacks
      : fill(isLow ? words.belowReserve : words.percent, {
          percent,
          reserve: Math.round(reserve * PERCENT),
        });
  return (
    <span
      class={`survey-used${isLow ? " survey-much" : ""}`}
      title={stated ? undefined : fill(words.assumed, { endurance: clock(endurance_s) })}
    >
      <meter
        min={0}
        max={1}
        low={reserve}
        optimum={1}
        value={Math.max(0, Math.min(1, battery_left))}
        aria-label={words.battery}
      />
      {text}
      {!stated && "*"}
    </span>
  );
}
