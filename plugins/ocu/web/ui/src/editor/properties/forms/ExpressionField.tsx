// A condition or script, with what may come next, and with what the check says of it.
import { useRef, useState } from "preact/hooks";
import { strings } from "../../../strings";
import { complete, type Completion, type Decided } from "../../condition/completion";
import { isA, list, text, type ModdleElement } from "../../moddle/moddle";
import { DEFAULT_STORE, promptOf } from "../../moddle/prompts";
import { described, Field } from "../fields/Field";
import { Listbox, moved, optionId } from "../fields/Listbox";
import { useDraft } from "../fields/useDraft";
import { definitionsOf, type FormProps } from "../form";

const words = strings.editor.expression;

export interface ExpressionFieldProps {
  form: FormProps;
  id: string;
  label: string;
  value: string;
  write(value: string): void;
  hint?: string;
  rows?: number;
  error?: string | undefined;
}

export function ExpressionField(props: ExpressionFieldProps) {
  const { form, id, hint, error } = props;
  const area = useRef<HTMLTextAreaElement>(null);
  const [cursor, setCursor] = useState<number | null>(null);
  const [active, setActive] = useState(-1);
  const draft = useDraft(props.value, props.write);
  const names = form.editor.checks.outline.value?.names ?? [];
  const line = cursor === null ? null : lineAt(draft.value, cursor);
  const offered = line && complete(line.text, line.cursor, names, decidedIn(form));
  const options = offered?.options.slice(0, 50) ?? [];

  const close = () => {
    setCursor(null);
    setActive(-1);
  };
  const look = (element: HTMLTextAreaElement) => {
    setCursor(element.selectionStart);
    setActive(-1);
  };
  const choose = ({ value }: { value: string }) => {
    if (!line || !offered) return;
    const start = line.start + offered.from;
    const next = draft.value.slice(0, start) + value + draft.value.slice(line.start + line.cursor);
    draft.type(next);
    const end = start + value.length;
    const element = area.current;
    if (element) {
      element.value = next;
      element.setSelectionRange(end, end);
      look(element);
    }
  };
  const keyDown = (event: KeyboardEvent) => {
    const isArrow = event.key === "ArrowDown" || event.key === "ArrowUp";
    if (event.key === " " && event.ctrlKey) {
      event.preventDefault();
      if (area.current) look(area.current);
    } else if (isArrow && options.length > 0) {
      event.preventDefault();
      setActive(moved(active, options.length, event.key));
    } else if ((event.key === "Enter" || event.key === "Tab") && active >= 0) {
      event.preventDefault();
      choose(options[active]!);
    } else if (event.key === "Escape" && options.length > 0) {
      event.stopPropagation();
      close();
    }
  };

  return (
    <Field id={id} label={props.label} hint={hint} error={error}>
      <div class="m2-combo">
        <textarea
          id={id}
          ref={area}
          class="m2-input m2-mono"
          rows={props.rows ?? 2}
          aria-haspopup="listbox"
          aria-controls={options.length > 0 ? `${id}-list` : undefined}
          aria-autocomplete="list"
          aria-activedescendant={active >= 0 ? optionId(id, active) : undefined}
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
        {options.length > 0 && (
          <Listbox
            id={id}
            label={words.offered}
            suggestions={options.map(shown)}
            active={active}
            choose={choose}
          />
        )}
      </div>
    </Field>
  );
}

function shown({ value, note, group }: Completion) {
  return { value, ...(note ? { note } : {}), group: words.groups[group] };
}

function lineAt(value: string, cursor: number) {
  const start = value.lastIndexOf("\n", cursor - 1) + 1;
  const end = value.indexOf("\n", cursor);
  return { start, text: value.slice(start, end < 0 ? undefined : end), cursor: cursor - start };
}

/** What the prompts of the file let operators decide, by the name that is written. */
function decidedIn(form: FormProps): Decided[] {
  const found: Decided[] = [];
  const waiting: ModdleElement[] = [...list(definitionsOf(form), "rootElements")];
  for (let each = waiting.pop(); each; each = waiting.pop()) {
    if (isA(each, "bpmn:UserTask")) {
      const { prompt } = promptOf(each);
      found.push({ store: prompt.store || DEFAULT_STORE, values: prompt.decisions });
    }
    if (text(each, "id")) waiting.push(...list(each, "flowElements"));
  }
  return found;
}
