import { described, Field } from "./Field";

export interface Option {
  value: string;
  label: string;
  group?: string;
}

export interface SelectFieldProps {
  id: string;
  label: string;
  value: string;
  options: readonly Option[];
  write(value: string): void;
  required?: boolean;
  hint?: string | undefined;
  error?: string | undefined;
}

export function SelectField(props: SelectFieldProps) {
  const { id, value, options, required, hint, error } = props;
  const groups = [...new Set(options.map((each) => each.group ?? ""))];
  const shown = options.some((each) => each.value === value);
  return (
    <Field id={id} label={props.label} required={required ?? false} hint={hint} error={error}>
      <select
        id={id}
        class="m2-input"
        value={value}
        aria-required={required}
        {...described(id, error, hint)}
        onChange={(event) => props.write(event.currentTarget.value)}
      >
        {!shown && <option value={value}>{value}</option>}
        {groups.map((group) => {
          const inside = options
            .filter((each) => (each.group ?? "") === group)
            .map((each) => (
              <option key={each.value} value={each.value}>
                {each.label}
              </option>
            ));
          return group ? (
            <optgroup key={group} label={group}>
              {inside}
            </optgroup>
          ) : (
            inside
          );
        })}
      </select>
    </Field>
  );
}

export interface CheckFieldProps {
  id: string;
  label: string;
  value: boolean;
  write(value: boolean): void;
  hint?: string;
}

export function CheckField({ id, label, value, write, hint }: CheckFieldProps) {
  return (
    <div class="m2-field m2-check" data-field={id}>
      <label for={id}>
        <input
          id={id}
          type="checkbox"
          checked={value}
          {...described(id, undefined, hint)}
          onChange={(event) => write(event.currentTarget.checked)}
        />
        {label}
      </label>
      {hint && (
        <p class="m2-field-hint" id={`${id}-hint`}>
          {hint}
        </p>
      )}
    </div>
  );
}
