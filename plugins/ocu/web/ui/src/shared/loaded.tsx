// Parts of the page that are loaded when they are first shown.
//
// Preact's Suspense leaves the page blank if another part is shown before the first one has come,
// and takes a failed download for an error of the page. Here what is left is forgotten, and what
// could not be loaded is asked for again when the executive answers.
import type { ComponentType } from "preact";
import { useEffect, useState } from "preact/hooks";
import { strings } from "../strings";
import { connection } from "./executive";

const text = strings.shell;

export function loaded<P extends object>(
  load: () => Promise<{ default: ComponentType<P> }>,
): ComponentType<P> {
  let Part: ComponentType<P> | null = null;
  return function Loaded(props: P) {
    const [, renew] = useState(0);
    const [failed, setFailed] = useState(false);
    const isWaiting = Part === null;
    useEffect(() => {
      if (!isWaiting) return;
      let left = false;
      const read = () =>
        load().then(
          (found) => {
            Part = found.default;
            if (!left) renew((count) => count + 1);
          },
          (error: unknown) => {
            console.warn(error);
            if (!left) setFailed(true);
          },
        );
      void read();
      let before = connection.peek();
      const stop = connection.subscribe((now) => {
        if (now === "open" && before !== "open" && Part === null) void read();
        before = now;
      });
      return () => {
        left = true;
        stop();
      };
    }, [isWaiting]);
    if (Part !== null) return <Part {...props} />;
    return (
      <p class="nothing" role={failed ? "alert" : "status"}>
        {failed ? text.notLoaded : text.loading}
      </p>
    );
  };
}
