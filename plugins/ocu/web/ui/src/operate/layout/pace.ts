// Signals that change faster than people read: followed a few times a second.
import { useSignal, type ReadonlySignal } from "@preact/signals";
import { useEffect } from "preact/hooks";

/** The value of a signal, renewed at most once in `every_ms`. */
export function usePaced<T>(source: ReadonlySignal<T>, every_ms: number): T {
  const shown = useSignal(source.peek());
  useEffect(() => {
    let timer: ReturnType<typeof setTimeout> | undefined;
    let shown_ms = -Infinity;
    const renew = () => {
      timer = undefined;
      shown_ms = performance.now();
      shown.value = source.peek();
    };
    const stop = source.subscribe(() => {
      if (timer !== undefined) return;
      const wait_ms = shown_ms + every_ms - performance.now();
      if (wait_ms <= 0) renew();
      else timer = setTimeout(renew, wait_ms);
    });
    return () => {
      stop();
      clearTimeout(timer);
    };
  }, [source]);
  return shown.value;
}
