import type { ComponentChildren } from "preact";
import { described, Field } from "./Field";
import { useDraft } from "./useDraft";

export interface TextFieldProps {
  id: string;
  label: string;
  value: string;
  write(value: string): void;
  rows?: number;
  required?: boolean;
  unit?: string | undefined;
  placeholder?: string | undefined;
  hint?: ComponentChildren;
  error?: string | undefined;
  mono?: boolean;
}

export function TextField(props: TextFieldProps) {
  const { id, rows, required, placeholder, hint, error, mono } = props;
  const draft = useDraft(props.value, props.write);
  const common = {
    id,
    class: mono ? "m2-input m2-mono" : "m2-input",
    value: draft.value,
    placeholder,
    spellcheck: !mono,
    autocomplete: "off",
    "aria-required": required,
    ...described(id, error, hint),
    onInput: (event: { currentTarget: { value: string } }) => draft.type(event.currentTarget.value),
    onBlur: () => draft.commit(),
  };
  return (
    <Field
      id={id}
      label={props.label}
      required={required ?? false}
      unit={props.unit}
      hint={hint}
      error={error}
    >
      {rows ? <textarea rows={rows} {...common} /> : <input type="text" {...common} />}
    </Field>
  );
}
