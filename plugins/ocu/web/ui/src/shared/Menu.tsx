// A button that opens a menu (WAI-ARIA menu button pattern).
import type { ComponentChildren } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import { useUniqueId } from "./uniqueId";
import "./menu.css";

export interface MenuItem {
  label: string;
  act(): void;
  disabled?: boolean;
}

export interface MenuProps {
  label: string;
  children: ComponentChildren;
  items: readonly MenuItem[];
  class?: string;
}

export function Menu({ label, children, items, class: className }: MenuProps) {
  const [isOpen, setOpen] = useState(false);
  const outer = useRef<HTMLDivElement>(null);
  const button = useRef<HTMLButtonElement>(null);
  const id = useUniqueId();
  useEffect(() => {
    if (!isOpen) return undefined;
    outer.current?.querySelector<HTMLElement>('[role="menuitem"]')?.focus();
    const away = (event: Event) => {
      if (!outer.current?.contains(event.target as Node)) setOpen(false);
    };
    addEventListener("pointerdown", away);
    return () => removeEventListener("pointerdown", away);
  }, [isOpen]);

  const close = () => {
    setOpen(false);
    button.current?.focus();
  };
  const keyDown = (event: KeyboardEvent) => {
    if (event.key === "Escape" && isOpen) {
      event.stopPropagation();
      close();
    }
    if (!["ArrowDown", "ArrowUp", "Home", "End"].includes(event.key) || !isOpen) return;
    event.preventDefault();
    const all = [...(outer.current?.querySelectorAll<HTMLElement>('[role="menuitem"]') ?? [])];
    const at = all.indexOf(document.activeElement as HTMLElement);
    const steps = { ArrowDown: at + 1, ArrowUp: at - 1 + all.length, Home: 0, End: all.length - 1 };
    all[steps[event.key as keyof typeof steps] % all.length]?.focus();
  };
  return (
    <div class="menu" ref={outer} onKeyDown={keyDown}>
      <button
        type="button"
        ref={button}
        class={className ?? "m2-button"}
        aria-haspopup="menu"
        aria-expanded={isOpen}
        aria-controls={id}
        aria-label={label}
        title={label}
        onClick={() => setOpen(!isOpen)}
      >
        {children}
      </button>
      {isOpen && (
        <div class="menu-items" id={id} role="menu" aria-label={label}>
          {items.map((item) => (
            <button
              key={item.label}
              type="button"
              role="menuitem"
              tabIndex={-1}
              disabled={item.disabled}
              onClick={() => {
                close();
                item.act();
              }}
            >
              {item.label}
            </button>
          ))}
        </div>
      )}
    </div>
  );
}
