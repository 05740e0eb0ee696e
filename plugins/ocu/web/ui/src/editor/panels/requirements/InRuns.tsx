// Whether runs are monitored for a requirement, and what a violation throws in them.
import { fill, strings } from "../../../strings";
import type { Finding } from "../../../shared/types";
import type { Requirement } from "../../moddle/requirements";
import { SelectField } from "../../properties/fields/SelectField";
import { TextField } from "../../properties/fields/TextField";
import { faultOf, KINDS, needsSteps, signalMeant, thrownBy, type Signal } from "./violation";

const words = strings.requirements.runs;

export interface InRunsProps {
  prefix: string;
  requirement: Requirement;
  signals: readonly Signal[];
  /** Those of the check that are about what a violation throws. */
  findings: readonly Finding[];
  write(next: Requirement): void;
}

export function InRuns({ prefix, requirement, signals, findings, write }: InRunsProps) {
  const { kind, name } = thrownBy(requirement);
  const fault = faultOf(requirement, signals);
  const [found] = findings;
  const error = fault
    ? fill(words.faults[fault], { name })
    : found && [found.message, found.remedy].filter(Boolean).join(" ");
  const monitored = requirement.monitor !== "false" && !needsSteps(requirement);
  const isOfName = fault === "noCode" || fault === "noSignal" || fault === "unknownSignal";
  const throwing = (onViolation: string) => write({ ...requirement, onViolation });
  return (
    <>
      <SelectField
        id={`${prefix}-monitor`}
        label={words.monitor}
        hint={hintOf(requirement)}
        value={requirement.monitor === "false" ? "false" : ""}
        options={[
          { value: "", label: words.monitored },
          { value: "false", label: words.unmonitored },
        ]}
        write={(monitor) =>
          write({ ...requirement, monitor: monitor as Requirement["monitor"] })
        }
      />
      <SelectField
        id={`${prefix}-thrown`}
        label={words.violation}
        hint={monitored ? words.violationHint : undefined}
        value={kind ?? requirement.onViolation}
        error={isOfName ? undefined : error}
        options={[
          { value: "", label: words.nothing },
          ...KINDS.map((each) => ({ value: each, label: words.kinds[each] })),
        ]}
        write={(next) => throwing(next === "" ? "" : `${next}:`)}
      />
      {kind === "error" && (
        <TextField
          id={`${prefix}-code`}
          label={words.code}
          hint={words.codeHint}
          required
          mono
          placeholder={words.codeExample}
          value={name}
          error={isOfName ? error : undefined}
          write={(code) => throwing(`error:${code.trim()}`)}
        />
      )}
      {kind === "signal" && signals.length > 0 && (
        <SelectField
          id={`${prefix}-signal`}
          label={words.signal}
          hint={words.signalHint}
          required
          value={signalMeant(name, signals)?.id ?? name}
          error={isOfName ? error : undefined}
          options={[
            ...(name === "" ? [{ value: "", label: strings.requirements.choose }] : []),
            ...signals.map((each) => ({ value: each.id, label: each.name || each.id })),
          ]}
          write={(id) => throwing(`signal:${id}`)}
        />
      )}
    </>
  );
}

function hintOf(requirement: Requirement): string {
  if (requirement.monitor === "false") return words.unmonitoredHint;
  return needsSteps(requirement) ? words.steps : words.monitorHint;
}
