// A question or form in front of the page, below the header: STOP stays in reach. What is behind it
// cannot be used meanwhile. Escape closes; the focus goes back to where it was.
import type { ComponentChildren } from "preact";
import { createPortal } from "preact/compat";
import { useLayoutEffect, useRef } from "preact/hooks";
import { strings } from "../strings";
import { useUniqueId } from "./uniqueId";
import "./dialog.css";

export interface DialogProps {
  title: string;
  onClose: () => void;
  children: ComponentChildren;
  /** Buttons at the foot. */
  actions?: ComponentChildren;
  wide?: boolean;
  /** As large as the page. */
  full?: boolean;
}

const FOCUSABLE = "input, select, textarea, button, a[href], [tabindex='0']";

let open = 0;

/** What is behind is out of use while a dialog is open. */
function keepBehind(): () => void {
  const main = document.getElementById("main");
  open += 1;
  main?.toggleAttribute("inert", true);
  return () => {
    open -= 1;
    if (open === 0) main?.toggleAttribute("inert", false);
  };
}

export function Dialog({ title, onClose, children, actions, wide = false, full = false }: DialogProps) {
  const dialog = useRef<HTMLDivElement>(null);
  const heading = useUniqueId();
  // At once: the next key is for the dialog.
  useLayoutEffect(() => {
    const before = document.activeElement;
    const release = keepBehind();
    const body = dialog.current?.querySelector(".dialog-body");
    const first = body?.querySelector<HTMLElement>(FOCUSABLE);
    (first ?? dialog.current)?.focus();
    return () => {
      release();
      if (before instanceof HTMLElement) before.focus();
    };
  }, []);
  return createPortal(
    <div class="dialog-layer">
      <div
        ref={dialog}
        class={`dialog${wide ? " dialog-wide" : ""}${full ? " dialog-full" : ""}`}
        role="dialog"
        tabIndex={-1}
        aria-labelledby={heading}
        onKeyDown={(event) => {
          event.stopPropagation();
          if (event.key === "Escape" && !event.shiftKey) onClose();
        }}
      >
        <div class="dialog-head">
          <h2 id={heading}>{title}</h2>
          <button type="button" class="plain" aria-label={strings.shell.close} onClick={onClose}>
            ×
          </button>
        </div>
        <div class="dialog-body">{children}</div>
        {actions && <div class="dialog-actions">{actions}</div>}
      </div>
    </div>,
    document.getElementById("dialogs")!,
  );
}
