// Two panes with a border between them that can be moved, with the mouse, a finger or the keyboard.
import { useComputed, useSignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { remember, remembered } from "./memory";
import "./split.css";

export interface SplitProps {
  /** Under which the position is remembered; with another name it has that one's position. */
  name: string;
  direction: "row" | "column";
  /** The first pane's part of the room, in percent. */
  initial: number;
  label: string;
  /** The first pane has all of the room; the second one stays as it is. */
  alone?: boolean;
  children: [ComponentChildren, ComponentChildren];
}

const LEAST = 8;
const STEP = 2;

const within = (part: number): number => Math.max(LEAST, Math.min(100 - LEAST, part));

export function Split({ name, direction, initial, label, alone, children }: SplitProps) {
  const box = useRef<HTMLDivElement>(null);
  const part = useSignal(within(remembered(`split.${name}`, initial)));
  useEffect(() => {
    part.value = within(remembered(`split.${name}`, initial));
  }, [name]);
  const style = useComputed(() => `flex-basis: ${part.value}%`);

  const place = (value: number) => {
    part.value = within(value);
    remember(`split.${name}`, part.value);
  };
  const move = (event: PointerEvent) => {
    if (!(event.buttons & 1) || !box.current) return;
    const { left, top, width, height } = box.current.getBoundingClientRect();
    const [at, room] =
      direction === "row" ? [event.clientX - left, width] : [event.clientY - top, height];
    place((at / room) * 100);
  };
  const key = (event: KeyboardEvent) => {
    const by = { ArrowLeft: -STEP, ArrowUp: -STEP, ArrowRight: STEP, ArrowDown: STEP }[event.key];
    if (by === undefined && event.key !== "Home") return;
    event.preventDefault();
    place(by === undefined ? initial : part.value + by);
  };

  return (
    <div ref={box} class={`split split-${direction}${alone ? " split-alone" : ""}`}>
      <div class="split-first" style={style}>
        {children[0]}
      </div>
      <div
        class="split-bar"
        role="separator"
        tabIndex={0}
        aria-label={label}
        aria-orientation={direction === "row" ? "vertical" : "horizontal"}
        aria-valuenow={Math.round(part.value)}
        aria-valuemin={LEAST}
        aria-valuemax={100 - LEAST}
        onPointerDown={(event) => event.currentTarget.setPointerCapture(event.pointerId)}
        onPointerMove={move}
        onDblClick={() => place(initial)}
        onKeyDown={key}
      />
      <div class="split-second">{children[1]}</div>
    </div>
  );
}
