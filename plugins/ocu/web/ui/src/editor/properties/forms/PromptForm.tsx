// What a user task asks the operators, and what they may answer.
import { fill, strings } from "../../../strings";
import { text } from "../../moddle/moddle";
import {
  DEFAULT_STORE,
  promptOf,
  setPrompt,
  type Decision,
  type PromptUse,
} from "../../moddle/prompts";
import { ComboField } from "../fields/ComboField";
import { DurationField } from "../fields/DurationField";
import { TextField } from "../fields/TextField";
import { apply, factoryOf, objectOf, type FormProps } from "../form";
import { Rows } from "./Rows";
import { ValueField } from "./ValueField";

const words = strings.editor.prompt;
const ROLES = ["viewer", "operator", "commander"];

export function PromptForm(form: FormProps) {
  const task = objectOf(form);
  const { carrier, prompt } = promptOf(task);
  const write = (next: Partial<PromptUse>) =>
    apply(form, setPrompt(factoryOf(form), carrier, { ...prompt, ...next }));
  const names = form.editor.checks.outline.value?.names ?? [];
  const timeout = {
    id: "m2-prompt-timeout",
    label: words.timeout,
    value: prompt.timeout,
    hint: words.timeoutHint,
    write: (said: string) => write({ timeout: said }),
  };
  return (
    <>
      {carrier !== task && (
        <p class="m2-note">
          {fill(words.inDataObject, { name: text(carrier, "name") || text(carrier, "id") })}
        </p>
      )}
      <TextField
        id="m2-prompt"
        label={words.text}
        rows={3}
        value={prompt.text}
        placeholder={text(task, "name")}
        hint={words.textHint}
        write={(value) => write({ text: value })}
      />
      <h2 class="m2-heading">{words.decisions}</h2>
      <Rows
        rows={prompt.decisions}
        write={(decisions) => write({ decisions })}
        add={() => newDecision(prompt.decisions)}
        addLabel={words.addDecision}
        empty={words.noDecisions}
        label={(decision) => decision.label || decision.value || words.unnamed}
        sortable
        render={(decision, index) => (
          <DecisionFields
            decision={decision}
            index={index}
            all={prompt.decisions}
            write={(next) => write({ decisions: prompt.decisions.with(index, next) })}
          />
        )}
      />
      <ComboField
        id="m2-prompt-store"
        label={words.store}
        mono
        value={prompt.store}
        placeholder={DEFAULT_STORE}
        hint={words.storeHint}
        suggestions={names.map(({ name }) => ({ value: name }))}
        write={(store) => write({ store: store.trim() })}
      />
      <ComboField
        id="m2-prompt-role"
        label={words.role}
        value={prompt.role}
        placeholder={words.anybody}
        suggestions={ROLES.slice(1).map((value) => ({ value }))}
        write={(role) => write({ role: role.trim() })}
      />
      <ValueField form={form} {...timeout}>
        <DurationField {...timeout} />
      </ValueField>
    </>
  );
}

interface DecisionFieldsProps {
  decision: Decision;
  index: number;
  all: readonly Decision[];
  write(decision: Decision): void;
}

function DecisionFields({ decision, index, all, write }: DecisionFieldsProps) {
  const isTwice = all.some((other, at) => at !== index && other.value === decision.value);
  // The value follows the label until the user writes another one.
  const follows = decision.value === valueFrom(decision.label);
  return (
    <>
      <TextField
        id={`m2-decision-label-${index}`}
        label={words.label}
        value={decision.label}
        write={(label) => write({ label, value: follows ? valueFrom(label) : decision.value })}
      />
      <TextField
        id={`m2-decision-value-${index}`}
        label={words.value}
        required
        mono
        value={decision.value}
        error={decision.value === "" ? words.noValue : isTwice ? words.twice : undefined}
        write={(value) => write({ ...decision, value: value.trim() })}
      />
    </>
  );
}

function newDecision(all: readonly Decision[]): Decision {
  const taken = new Set(all.map(({ value }) => value));
  const fresh = words.usual.find(({ value }) => !taken.has(value));
  if (fresh) return { ...fresh };
  let number = all.length + 1;
  while (taken.has(`choice_${number}`)) number += 1;
  return { value: `choice_${number}`, label: fill(words.choice, { number }) };
}

/** "Take route B!" as a value: take_route_b. */
export function valueFrom(label: string): string {
  const joined = label
    .trim()
    .toLowerCase()
    .replace(/[^\p{L}\p{N}]+/gu, "_");
  return joined.replace(/^_+|_+$/g, "");
}
