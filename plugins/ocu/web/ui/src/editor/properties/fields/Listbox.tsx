// What may be chosen below a field. The field keeps the focus (WAI-ARIA combobox pattern).
import { useEffect, useRef } from "preact/hooks";

export interface Suggestion {
  value: string;
  label?: string;
  note?: string;
  group?: string;
}

export interface ListboxProps {
  id: string;
  label: string;
  suggestions: readonly Suggestion[];
  active: number;
  choose(suggestion: Suggestion): void;
}

export function Listbox({ id, label, suggestions, active, choose }: ListboxProps) {
  const list = useRef<HTMLUListElement>(null);
  useEffect(() => {
    list.current?.querySelector('[aria-selected="true"]')?.scrollIntoView({ block: "nearest" });
  }, [active]);
  return (
    <ul class="m2-listbox" id={`${id}-list`} role="listbox" aria-label={label} ref={list}>
      {suggestions.map((each, index) => (
        <li
          key={`${each.group ?? ""} ${each.value}`}
          id={optionId(id, index)}
          role="option"
          aria-selected={index === active}
          // The field would lose the focus, and close the list, before the click.
          onMouseDown={(event) => event.preventDefault()}
          onClick={() => choose(each)}
        >
          {each.group && each.group !== suggestions[index - 1]?.group && (
            <span class="m2-listbox-group">{each.group}</span>
          )}
          <span class="m2-listbox-value">{each.label ?? each.value}</span>
          {each.note && <span class="m2-listbox-note">{each.note}</span>}
        </li>
      ))}
    </ul>
  );
}

export function optionId(id: string, index: number): string {
  return `${id}-option-${index}`;
}

/** Which suggestion is next when an arrow key is pressed; -1: none is. */
export function moved(active: number, count: number, key: string): number {
  if (count === 0) return -1;
  if (key === "ArrowDown") return active + 1 >= count ? 0 : active + 1;
  return active <= 0 ? count - 1 : active - 1;
}
