// A button that stops something: click twice, or hold.
import { useEffect, useMemo, useRef } from "preact/hooks";
import { HOLD_MS, TwoPresses } from "./stop";

export interface StopButtonProps {
  label: string;
  again: string;
  hint: string;
  disabled?: boolean;
  class?: string;
  /** Shift+Escape presses it, wherever the focus is. */
  hotkey?: boolean;
  onStop: () => void;
}

export function StopButton(props: StopButtonProps) {
  const { label, again, hint, disabled = false, hotkey = false, onStop } = props;
  const act = useRef(onStop);
  act.current = onStop;
  const presses = useMemo(() => new TwoPresses(() => act.current()), []);
  const hold = useRef<ReturnType<typeof setTimeout>>();
  const wasHeld = useRef(false);

  useEffect(() => {
    if (!hotkey || disabled) return;
    const press = (event: KeyboardEvent) => {
      if (event.key !== "Escape" || !event.shiftKey || event.repeat) return;
      event.preventDefault();
      event.stopPropagation();
      presses.press();
    };
    addEventListener("keydown", press, { capture: true });
    return () => removeEventListener("keydown", press, { capture: true });
  }, [hotkey, disabled]);
  useEffect(() => () => presses.disarm(), []);

  const release = () => clearTimeout(hold.current);
  return (
    <button
      type="button"
      class={`stop ${presses.armed.value ? "stop-armed" : ""} ${props.class ?? ""}`}
      title={hint}
      disabled={disabled}
      aria-keyshortcuts={hotkey ? "Shift+Escape" : undefined}
      onPointerDown={() => {
        wasHeld.current = false;
        hold.current = setTimeout(() => {
          wasHeld.current = true;
          presses.held();
        }, HOLD_MS);
      }}
      onPointerUp={release}
      onPointerLeave={release}
      onPointerCancel={release}
      onClick={() => {
        if (!wasHeld.current) presses.press();
        wasHeld.current = false;
      }}
    >
      <span aria-live="assertive">{presses.armed.value ? again : label}</span>
    </button>
  );
}
