// Several runs are paused, resumed or stopped at once: named before, with what became of each after.
import { useState } from "preact/hooks";
import { post } from "../shared/api";
import { givenNow } from "../shared/command";
import { Dialog } from "../shared/Dialog";
import { titleOf } from "../shared/runs";
import type { RunLine } from "../shared/types";
import { counted, fill, strings } from "../strings";
import type { Deed } from "./runQuery";

const texts = strings.runs;
const ANSWER_MS = 5000;

interface BulkDialogProps {
  deed: Deed;
  runs: readonly RunLine[];
  close(): void;
}

export function BulkDialog({ deed, runs: given, close }: BulkDialogProps) {
  // Those that were named stay, whatever becomes of them meanwhile.
  const [runs] = useState(given);
  const [results, setResults] = useState<Record<string, string> | null>(null);
  const act = () => {
    setResults(Object.fromEntries(runs.map(({ run }) => [run, texts.doing])));
    const headers = givenNow();
    for (const { run } of runs) {
      const path = `/runs/${encodeURIComponent(run)}/${deed}`;
      post(path, {}, { limit_ms: ANSWER_MS, headers })
        .then(() => texts.done[deed] as string)
        .catch((error: unknown) =>
          fill(texts.notDone, { why: error instanceof Error ? error.message : String(error) }),
        )
        .then((said) => setResults((known) => ({ ...known, [run]: said })));
    }
  };
  return (
    <Dialog
      title={counted(texts.ask[deed], runs.length)}
      onClose={close}
      actions={
        results ? (
          <button type="button" class="primary" onClick={close}>
            {texts.close}
          </button>
        ) : (
          <>
            <button type="button" class="secondary" onClick={close}>
              {texts.cancel}
            </button>
            <button type="button" class={deed === "stop" ? "stop-runs" : "primary"} onClick={act}>
              {texts[deed]}
            </button>
          </>
        )
      }
    >
      <p>{texts.text[deed]}</p>
      <ul class="home-named" aria-live="polite">
        {runs.map((run) => (
          <li key={run.run}>
            <b>{run.run}</b> {titleOf(run)}
            {results && <span class="home-result"> {results[run.run]}</span>}
          </li>
        ))}
      </ul>
    </Dialog>
  );
}
