// In the header: how many persons are present; a panel says who, and what they watch.
import { useEffect, useRef, useState } from "preact/hooks";
import { counted, fill, strings } from "../strings";
import { isSelf, present } from "./people";
import { persons, type Presence } from "./persons";
import "./people.css";
import { locale } from "../strings/language";

const words = strings.people;

export function Present() {
  const [open, setOpen] = useState(false);
  const outer = useRef<HTMLDivElement>(null);
  const button = useRef<HTMLButtonElement>(null);
  const all = persons(present.value);
  const close = () => {
    setOpen(false);
    button.current?.focus();
  };
  useEffect(() => {
    if (!open) return undefined;
    const away = (event: Event) => {
      if (!outer.current?.contains(event.target as Node)) setOpen(false);
    };
    addEventListener("pointerdown", away);
    return () => removeEventListener("pointerdown", away);
  }, [open]);
  const name = counted(words.present, all.length);
  return (
    <div
      class="present"
      ref={outer}
      onKeyDown={(event) => {
        if (event.key !== "Escape" || !open) return;
        event.stopPropagation();
        close();
      }}
    >
      <button
        type="button"
        ref={button}
        class="plain present-button"
        aria-expanded={open}
        aria-label={name}
        title={name}
        onClick={() => setOpen(!open)}
      >
        <svg viewBox="0 0 24 24" width="20" height="20" aria-hidden="true">
          <circle cx="9" cy="8" r="3.5" fill="currentColor" />
          <path d="M2.5 19a6.5 6.5 0 0 1 13 0z" fill="currentColor" />
          <path
            d="M15 5.2a3.4 3.4 0 0 1 0 6.1M17.5 13.6A6.4 6.4 0 0 1 21.5 19"
            fill="none"
            stroke="currentColor"
            stroke-width="2"
          />
        </svg>
        <b aria-hidden="true">{all.length}</b>
      </button>
      {open && (
        <section class="present-panel" aria-label={words.title}>
          <h2>{words.title}</h2>
          <ul>
            {all.map((each) => (
              <Person key={each.by} person={each} />
            ))}
          </ul>
        </section>
      )}
    </div>
  );
}

function Person({ person: { by, unit, role, run, editing, since_us } }: { person: Presence }) {
  const since = new Date(since_us / 1000).toLocaleTimeString(locale, { timeStyle: "short" });
  const known = strings.shell.roles[role as keyof typeof strings.shell.roles];
  return (
    <li>
      <strong>{by}</strong>
      {isSelf(by) && <span> ({words.you})</span>} {known && <small>{known}</small>}
      <div>
        {fill(words.since, { where: whereOf({ unit, run, editing }), since })}
      </div>
    </li>
  );
}

function whereOf({ unit, run, editing }: Pick<Presence, "unit" | "run" | "editing">): string {
  const texts = words.units[unit as keyof typeof words.units] ?? words.units.other;
  const text = (editing && texts.editing) || (run && texts.run) || texts.none;
  return fill(text, { unit, run, mission: editing });
}
