// When a timer fires.
import { strings } from "../../../strings";
import { isA, list, type ModdleElement } from "../../moddle/moddle";
import { expressionLanguage, expressionProperties, expressionText } from "../expressions";
import { isoCycleOf, shownCycle } from "../../session/durations";
import { DurationField } from "../fields/DurationField";
import { SelectField } from "../fields/SelectField";
import { TextField } from "../fields/TextField";
import { factoryOf, objectOf, set, type FormProps } from "../form";
import { ValueField } from "./ValueField";

const words = strings.editor.timer;
const KINDS = ["timeDuration", "timeDate", "timeCycle"] as const;
type Kind = (typeof KINDS)[number];

export function timerOf(element: ModdleElement): ModdleElement | undefined {
  return list(element, "eventDefinitions").find((each) => isA(each, "bpmn:TimerEventDefinition"));
}

export function TimerForm(form: FormProps) {
  const timer = timerOf(objectOf(form));
  if (!timer) return null;
  const kind: Kind = KINDS.find((each) => timer.get(each) !== undefined) ?? "timeDuration";
  const body = expressionText(timer, kind);
  const write = (next: Kind, said: string) => {
    const cleared = Object.fromEntries(KINDS.map((each) => [each, undefined]));
    const written = expressionProperties(factoryOf(form), timer, next, said || " ");
    set(form, timer, { ...cleared, ...(said === "" && next === kind ? {} : written) });
  };
  const isCycle = kind === "timeCycle";
  const field = {
    id: "m2-timer-value",
    label: words.kinds[kind],
    required: true,
    value: isCycle ? shownCycle(body) : body,
    placeholder: words.shown[kind],
    hint: words.hints[kind],
    error: body === "" ? words.missing : undefined,
    write: (said: string) => write(kind, isCycle ? isoCycleOf(said) : said.trim()),
  };
  return (
    <>
      <SelectField
        id="m2-timer-kind"
        label={words.kind}
        value={kind}
        options={KINDS.map((value) => ({ value, label: words.kinds[value] }))}
        write={(next) => write(next as Kind, words.examples[next as Kind])}
      />
      <ValueField key={kind} form={form} language={expressionLanguage(timer, kind)} {...field}>
        {kind === "timeDuration" ? <DurationField {...field} /> : <TextField {...field} mono />}
      </ValueField>
    </>
  );
}
