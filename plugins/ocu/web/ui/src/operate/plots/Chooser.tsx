// A folder of things that can be chosen, several at a time; long lists are searched.
import { useSignal } from "@preact/signals";
import { strings } from "../../strings";

const text = strings.plots;
const SEARCHED = 8;

export interface ChooserProps {
  label: string;
  all: readonly { id: string; title: string }[];
  chosen: readonly string[];
  onChange: (chosen: string[]) => void;
}

export function Chooser({ label, all, chosen, onChange }: ChooserProps) {
  const sought = useSignal("");
  const wanted = sought.value.trim().toLowerCase();
  const found = all.filter(({ title }) => title.toLowerCase().includes(wanted));
  const turn = (id: string, on: boolean) =>
    onChange(all.map((each) => each.id).filter((each) => (each === id ? on : chosen.includes(each))));
  return (
    <details class="folder chooser" onKeyDown={closeOnEscape} ref={closeFromOutside}>
      <summary>
        {label} <small>{chosen.length}</small>
      </summary>
      <div>
        {all.length > SEARCHED && (
          <input
            type="search"
            aria-label={text.find}
            placeholder={text.find}
            value={sought.value}
            onInput={(event) => (sought.value = event.currentTarget.value)}
          />
        )}
        <div class="chooser-all">
          <button
            type="button"
            class="plain"
            onClick={() =>
              onChange([...new Set([...chosen, ...found.map(({ id }) => id)])])
            }
          >
            {text.allOfThem}
          </button>
          <button
            type="button"
            class="plain"
            onClick={() => onChange(chosen.filter((id) => !found.some((each) => each.id === id)))}
          >
            {text.noneOfThem}
          </button>
        </div>
        <div class="chooser-list" role="group" aria-label={label}>
          {found.map(({ id, title }) => (
            <label key={id} class="switch">
              <input
                type="checkbox"
                checked={chosen.includes(id)}
                onChange={(event) => turn(id, event.currentTarget.checked)}
              />
              {title}
            </label>
          ))}
          {found.length === 0 && <p>{text.nothingFound}</p>}
        </div>
      </div>
    </details>
  );
}

function closeOnEscape(event: KeyboardEvent & { currentTarget: HTMLDetailsElement }): void {
  if (event.key !== "Escape" || event.shiftKey || !event.currentTarget.open) return;
  event.stopPropagation();
  event.currentTarget.open = false;
  event.currentTarget.querySelector("summary")?.focus();
}

const watched = new WeakSet<HTMLDetailsElement>();

/** A press elsewhere closes it, as it closes menus. */
function closeFromOutside(folder: HTMLDetailsElement | null): void {
  if (!folder || watched.has(folder)) return;
  watched.add(folder);
  const away = (event: Event) => {
    if (!folder.isConnected) removeEventListener("pointerdown", away);
    else if (!folder.contains(event.target as Node)) folder.open = false;
  };
  addEventListener("pointerdown", away);
}
