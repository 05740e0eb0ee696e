// What is typed into a field, before it is part of the mission.
import { useEffect, useRef, useState } from "preact/hooks";

const PAUSE_MS = 300;

export interface Draft {
  value: string;
  type(value: string): void;
  /** Makes it part of the mission now. */
  commit(): void;
}

const DRAWING = ".djs-container";
const APPROACHES = ["pointerover", "pointermove", "pointerdown"] as const;

export function useDraft(value: string, write: (value: string) => void): Draft {
  const [typed, setTyped] = useState<string | null>(null);
  const state = useRef({ typed, value, write, timer: 0 });
  Object.assign(state.current, { typed, value, write });

  const settle = () => {
    const { typed: now, value: before, write: put, timer } = state.current;
    clearTimeout(timer);
    state.current.timer = 0;
    if (now !== null && now !== before) put(now);
  };
  const commit = () => {
    settle();
    state.current.typed = null;
    setTyped(null);
  };
  useEffect(() => {
    // What changes in the mission draws the menu at an element anew: not under a click.
    const approach = ({ target }: PointerEvent) => {
      if (state.current.timer && (target as Element).closest?.(DRAWING)) settle();
    };
    for (const event of APPROACHES) addEventListener(event, approach, true);
    return () => {
      for (const event of APPROACHES) removeEventListener(event, approach, true);
      // Another element may be selected before the pause is over: nothing that was typed is lost.
      commit();
    };
  }, []);

  return {
    value: typed ?? value,
    type(next) {
      state.current.typed = next;
      setTyped(next);
      clearTimeout(state.current.timer);
      state.current.timer = window.setTimeout(settle, PAUSE_MS);
    },
    commit,
  };
}
