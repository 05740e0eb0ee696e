// A field with suggestions: what fits can be chosen, anything can be typed (an expression, say).
import { useState } from "preact/hooks";
import { described, Field } from "./Field";
import { Listbox, moved, optionId, type Suggestion } from "./Listbox";
import type { TextFieldProps } from "./TextField";
import { useDraft } from "./useDraft";

export interface ComboFieldProps extends Omit<TextFieldProps, "rows"> {
  suggestions: readonly Suggestion[];
  /** Only what is suggested counts: what else is typed is a search, and is forgotten. */
  strict?: boolean;
}

export function ComboField(props: ComboFieldProps) {
  const { id, required, placeholder, hint, error, mono, strict } = props;
  const [search, setSearch] = useState<string | null>(null);
  const [active, setActive] = useState(-1);
  const isKnown = (value: string) => props.suggestions.some((each) => each.value === value);
  const draft = useDraft(props.value, (value) => {
    if (!strict || isKnown(value)) props.write(value);
  });
  const isOpen = search !== null;
  const suggestions = isOpen ? found(props.suggestions, search) : [];
  const shown = props.suggestions.find((each) => each.value === draft.value);
  const value = strict ? (search ?? shown?.label ?? draft.value) : draft.value;

  const close = () => {
    setSearch(null);
    setActive(-1);
  };
  const choose = (suggestion: Suggestion) => {
    draft.type(suggestion.value);
    draft.commit();
    close();
  };
  const open = () => setSearch("");
  const keyDown = (event: KeyboardEvent) => {
    if (event.key === "ArrowDown" || event.key === "ArrowUp") {
      event.preventDefault();
      if (!isOpen) open();
      setActive(moved(active, isOpen ? suggestions.length : props.suggestions.length, event.key));
    } else if (event.key === "Enter" && isOpen) {
      const suggestion = suggestions[active];
      if (suggestion) choose(suggestion);
      else close();
      event.preventDefault();
    } else if (event.key === "Escape" && isOpen) {
      event.stopPropagation();
      close();
    }
  };
  const typed = (next: string) => {
    if (!strict) draft.type(next);
    setSearch(next);
    setActive(strict ? 0 : -1);
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
      <div class="m2-combo">
        <input
          id={id}
          type="text"
          class={mono ? "m2-input m2-mono" : "m2-input"}
          role="combobox"
          aria-expanded={isOpen && suggestions.length > 0}
          aria-controls={`${id}-list`}
          aria-autocomplete="list"
          aria-activedescendant={active >= 0 ? optionId(id, active) : undefined}
          aria-required={required}
          {...described(id, error, hint)}
          value={value}
          placeholder={placeholder}
          autocomplete="off"
          spellcheck={false}
          onInput={(event) => typed(event.currentTarget.value)}
          onKeyDown={keyDown}
          onClick={() => (isOpen ? undefined : open())}
          onFocus={(event) => event.currentTarget.select()}
          onBlur={() => {
            draft.commit();
            close();
          }}
        />
        {isOpen && suggestions.length > 0 && (
          <Listbox
            id={id}
            label={props.label}
            suggestions={suggestions}
            active={active}
            choose={choose}
          />
        )}
      </div>
    </Field>
  );
}

function found(suggestions: readonly Suggestion[], search: string): Suggestion[] {
  const words = search.toLowerCase().split(/\s+/).filter(Boolean);
  const matching = suggestions.filter(({ value, label = "", note = "", group = "" }) => {
    const text = `${value} ${label} ${note} ${group}`.toLowerCase();
    return words.every((word) => text.includes(word));
  });
  return matching;
}
