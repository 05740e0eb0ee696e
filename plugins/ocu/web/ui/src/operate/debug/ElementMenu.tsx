// The menu at an element: a breakpoint is set or removed, or it is said why it cannot be.
import { useEffect, useLayoutEffect, useRef } from "preact/hooks";
import { fill, strings } from "../../strings";
import { useOperating } from "../context";
import { breakpointsOf } from "./breakpoints";
import { BREAKPOINT_KEY, elementMenu } from "./menu";
import { refusalOf, turn } from "./setting";
import "./debug.css";

const text = strings.debug;

export default function ElementMenu() {
  const shown = useOperating();
  const menu = useRef<HTMLDivElement>(null);
  const before = useRef(document.activeElement);
  const at = elementMenu.value;
  const close = () => {
    elementMenu.value = null;
    if (before.current instanceof HTMLElement) before.current.focus();
  };

  useEffect(() => {
    menu.current?.querySelector<HTMLElement>("button")?.focus();
    const away = (event: Event) => {
      if (!menu.current?.contains(event.target as Node)) elementMenu.value = null;
    };
    addEventListener("pointerdown", away);
    return () => removeEventListener("pointerdown", away);
  }, [at]);
  // It stays within the window, wherever the element is.
  useLayoutEffect(() => {
    const box = menu.current;
    if (!box || !at) return;
    box.style.left = `${Math.max(0, Math.min(at.x, innerWidth - box.offsetWidth - 4))}px`;
    box.style.top = `${Math.max(0, Math.min(at.y, innerHeight - box.offsetHeight - 4))}px`;
  }, [at]);

  if (!at) return null;
  const refusal = refusalOf(shown);
  const label = shown.mission.label(at.process, at.element);
  const isSet = breakpointsOf(shown.scene.debugging.value).elements.includes(at.element);
  return (
    <div
      ref={menu}
      class="menu-items element-menu"
      role="menu"
      aria-label={fill(text.menu, { element: label })}
      onKeyDown={(event) => {
        if (event.key !== "Escape" && event.key !== "Tab") return;
        event.preventDefault();
        event.stopPropagation();
        close();
      }}
    >
      <button
        type="button"
        role="menuitem"
        aria-disabled={refusal !== ""}
        aria-keyshortcuts={BREAKPOINT_KEY}
        onClick={() => {
          if (refusal !== "") return;
          close();
          turn(shown, at.element);
        }}
      >
        {isSet ? text.remove : text.set} <kbd aria-hidden="true">{BREAKPOINT_KEY.toUpperCase()}</kbd>
      </button>
      {refusal && <p>{refusal}</p>}
    </div>
  );
}
