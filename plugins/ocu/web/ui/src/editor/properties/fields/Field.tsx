// A label with what belongs to it: a mark when it is required, a hint, and what is wrong.
import type { ComponentChildren } from "preact";
import { strings } from "../../../strings";

export interface FieldProps {
  id: string;
  label: string;
  required?: boolean;
  unit?: string | undefined;
  hint?: ComponentChildren;
  error?: string | undefined;
  children: ComponentChildren;
}

export function Field({ id, label, required, unit, hint, error, children }: FieldProps) {
  return (
    <div class={error ? "m2-field m2-field-wrong" : "m2-field"} data-field={id}>
      {/* `for` reaches no editor of code, which is no form control. */}
      <label id={`${id}-label`} for={id} onClick={() => document.getElementById(id)?.focus()}>
        {label}{" "}
        {unit && <span class="m2-unit">{unit}</span>}
        {required && (
          <span class="m2-required" title={strings.editor.fields.required} aria-hidden="true">
            *
          </span>
        )}
      </label>
      {children}
      {error && (
        <p class="m2-field-error" id={`${id}-error`}>
          {error}
        </p>
      )}
      {hint && (
        <p class="m2-field-hint" id={`${id}-hint`}>
          {hint}
        </p>
      )}
    </div>
  );
}

/** The attributes by which a control refers to its hint and its error. */
export function described(id: string, error: unknown, hint: unknown) {
  const ids = [error ? `${id}-error` : "", hint ? `${id}-hint` : ""].filter(Boolean);
  return {
    "aria-invalid": error ? ("true" as const) : undefined,
    "aria-describedby": ids.length ? ids.join(" ") : undefined,
  };
}
