// A formula, with what may come next.
import { useRef, useState } from "preact/hooks";
import { strings } from "../../../strings";
import { described, Field } from "../../properties/fields/Field";
import { Listbox, moved, optionId } from "../../properties/fields/Listbox";
import { useDraft } from "../../properties/fields/useDraft";
import { Caret } from "../ProblemView";
import { completeFormula, type FormulaCompletion, type Vocabulary } from "./completion";

const words = strings.requirements;
const MOST = 40;

export interface FormulaFieldProps {
  id: string;
  label: string;
  value: string;
  write(value: string): void;
  vocabulary: Vocabulary;
  /** An element alone stands for its completion. */
  isCondition: boolean;
  required?: boolean;
  hint?: string | undefined;
  error?: string | undefined;
}

export function FormulaField(props: FormulaFieldProps) {
  const { id, hint, error, required, isCondition } = props;
  const area = useRef<HTMLTextAreaElement>(null);
  const [cursor, setCursor] = useState<number | null>(null);
  const [active, setActive] = useState(-1);
  const draft = useDraft(props.value, props.write);
  const offered =
    cursor === null ? null : completeFormula(draft.value, cursor, props.vocabulary, isCondition);
  const options = offered?.options.slice(0, MOST) ?? [];
  const isOpen = options.length > 0;

  const close = () => {
    setCursor(null);
    setActive(-1);
  };
  const look = (element: HTMLTextAreaElement) => {
    setCursor(element.selectionStart);
    setActive(-1);
  };
  const choose = ({ value }: { value: string }) => {
    const element = area.current;
    if (!offered || cursor === null || !element) return;
    const next = draft.value.slice(0, offered.from) + value + draft.value.slice(cursor);
    draft.type(next);
    element.value = next;
    element.setSelectionRange(offered.from + value.length, offered.from + value.length);
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
    } else if (event.key === "Enter" && isCondition) {
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
          rows={isCondition ? 1 : 3}
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
            label={words.offered}
            suggestions={options.map(shown)}
            active={active}
            choose={choose}
          />
        )}
      </div>
      {error && <Caret message={error} formula={draft.value} />}
    </Field>
  );
}

function shown({ value, note, group }: FormulaCompletion) {
  return { value, ...(note ? { note } : {}), group: words.groups[group] };
}
