// A text with what may come next below it: a formula, a condition, a script.
import type { ComponentChildren } from "preact";
import { useRef, useState } from "preact/hooks";
import { described, Field } from "./Field";
import { Listbox, moved, optionId, type Suggestion } from "./Listbox";
import { useDraft } from "./useDraft";

export interface Suggestions {
  /** What is replaced: from here to the cursor. */
  from: number;
  options: Suggestion[];
}

export interface SuggestingFieldProps {
  id: string;
  label: string;
  value: string;
  write(value: string): void;
  suggest(typed: string, cursor: number): Suggestions;
  /** What the list of suggestions is called. */
  offered: string;
  rows: number;
  isOneLine?: boolean | undefined;
  required?: boolean | undefined;
  hint?: string | undefined;
  error?: string | undefined;
  /** What is shown below the text. */
  below?(typed: string): ComponentChildren;
}

const MOST = 50;

export function SuggestingField(props: SuggestingFieldProps) {
  const { id, hint, error, required } = props;
  const area = useRef<HTMLTextAreaElement>(null);
  const [cursor, setCursor] = useState<number | null>(null);
  const [active, setActive] = useState(-1);
  const draft = useDraft(props.value, props.write);
  const suggested = cursor === null ? null : props.suggest(draft.value, cursor);
  const options = suggested?.options.slice(0, MOST) ?? [];
  const isOpen = options.length > 0;

  const close = () => {
    setCursor(null);
    setActive(-1);
  };
  const look = (element: HTMLTextAreaElement) => {
    setCursor(element.selectionStart);
    setActive(-1);
  };
  const choose = ({ value }: Suggestion) => {
    const element = area.current;
    if (!suggested || cursor === null || !element) return;
    const next = draft.value.slice(0, suggested.from) + value + draft.value.slice(cursor);
    const end = suggested.from + value.length;
    draft.type(next);
    element.value = next;
    element.setSelectionRange(end, end);
    look(element);
  };
  const keyDown = (event: KeyboardEvent & { currentTarget: HTMLTextAreaElement }) => {
    if (event.key === " " && event.ctrlKey) {
      event.preventDefault();
      look(event.currentTarget);
    } else if ((event.key === "ArrowDown" || event.key === "ArrowUp") && isOpen) {
      event.preventDefault();
      setActive(moved(active, options.length, event.key));
    } else if ((event.key === "Enter" || event.key === "Tab") && active >= 0) {
      event.preventDefault();
      choose(options[active]!);
    } else if (event.key === "Enter" && props.isOneLine) {
      event.preventDefault();
    } else if (event.key === "Escape" && isOpen) {
      event.stopPropagation();
      close();
    }
  };

  return (
    <Field id={id} label={props.label} required={required ?? false} hint={hint} error={error}>
      <div class="m2-combo">
        <textarea
          id={id}
          ref={area}
          class="m2-input m2-mono"
          rows={props.rows}
          // A text of several lines may be no combobox (ARIA in HTML), but may have suggestions.
          aria-controls={isOpen ? `${id}-list` : undefined}
          aria-autocomplete="list"
          aria-activedescendant={active >= 0 ? optionId(id, active) : undefined}
          aria-required={required}
          {...described(id, error, hint)}
          value={draft.value}
          spellcheck={false}
          autocomplete="off"
          onInput={(event) => {
            draft.type(event.currentTarget.value);
            look(event.currentTarget);
          }}
          onClick={(event) => look(event.currentTarget)}
          onKeyDown={keyDown}
          onBlur={() => {
            draft.commit();
            close();
          }}
        />
        {isOpen && (
          <Listbox
            id={id}
            label={props.offered}
            suggestions={options}
            active={active}
            choose={choose}
          />
        )}
      </div>
      {props.below?.(draft.value)}
    </Field>
  );
}
