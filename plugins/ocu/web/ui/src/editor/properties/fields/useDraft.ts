// What is typed into a field, before it is part of the mission.
import { useEffect, useRef, useState } from "preact/hooks";

const PAUSE_MS = 300;

export interface Draft {
  value: string;
  type(value: string): void;
  /** Makes it part of the mission now. */
  commit(): void;
}

export function useDraft(value: string, write: (value: string) => void): Draft {
  const [typed, setTyped] = useState<string | null>(null);
  const state = useRef({ typed, value, write, timer: 0 });
  Object.assign(state.current, { typed, value, write });

  const commit = () => {
    const { typed: now, value: before, write: put, timer } = state.current;
    clearTimeout(timer);
    if (now !== null && now !== before) put(now);
    state.current.typed = null;
    setTyped(null);
  };
  // Another element may be selected before the pause is over: nothing that was typed is lost.
  useEffect(() => commit, []);

  return {
    value: typed ?? value,
    type(next) {
      state.current.typed = next;
      setTyped(next);
      clearTimeout(state.current.timer);
      state.current.timer = window.setTimeout(() => {
        const { typed: now, value: before, write: put } = state.current;
        if (now !== null && now !== before) put(now);
      }, PAUSE_MS);
    },
    commit,
  };
}
