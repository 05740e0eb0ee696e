// Another operator has it and is gone: it goes back to the missions, with a reason that all see.
import { useSignal } from "@preact/signals";
import { start } from "../shared/command";
import { Dialog } from "../shared/Dialog";
import { toast } from "../shared/Toasts";
import { fill, strings } from "../strings";

const words = strings.people.force;
const LONGEST = 1000;

interface Held {
  resource: string;
  holder: string;
}

interface Result {
  resource: string;
  problem: string;
}

export function ForceGiveBack({ held, kind }: { held: readonly Held[]; kind: string }) {
  const open = useSignal(false);
  const holders = [...new Set(held.map(({ holder }) => holder))];
  const label = holders.length === 1 ? words.open : words.openMany;
  return (
    <>
      <button type="button" class={kind} onClick={() => (open.value = true)}>
        {fill(label, { holder: holders[0] ?? "" })}
      </button>
      {open.value && (
        <Reason held={held} holders={holders} onClose={() => (open.value = false)} />
      )}
    </>
  );
}

interface ReasonProps {
  held: readonly Held[];
  holders: readonly string[];
  onClose: () => void;
}

function Reason({ held, holders, onClose }: ReasonProps) {
  const reason = useSignal("");
  const busy = useSignal(false);
  const problems = useSignal<readonly string[]>([]);
  const resources = held.map(({ resource }) => resource);
  const title = fill(holders.length === 1 ? words.title : words.titleMany, {
    names: resources.join(", "),
    holder: holders[0] ?? "",
  });
  const give = async () => {
    busy.value = true;
    try {
      const body = { resources, reason: reason.value.trim() };
      const { results } = await start<{ results: Result[] }>("/fleet/give-back", body);
      const done = results.filter(({ problem }) => !problem).map(({ resource }) => resource);
      problems.value = results.flatMap(({ problem }) => (problem ? [problem] : []));
      if (done.length > 0) toast(fill(words.done, { names: done.join(", ") }), "good");
      if (problems.value.length === 0) onClose();
    } catch (error) {
      problems.value = [error instanceof Error ? error.message : String(error)];
    }
    busy.value = false;
  };
  return (
    <Dialog
      title={title}
      onClose={onClose}
      actions={
        <>
          <button type="button" class="secondary" onClick={onClose}>
            {words.cancel}
          </button>
          <button
            type="button"
            class="primary"
            disabled={busy.value || !reason.value.trim()}
            onClick={() => void give()}
          >
            {words.act}
          </button>
        </>
      }
    >
      <p>{words.hint}</p>
      <label class="m2-field">
        {words.reason}
        <input
          type="text"
          maxLength={LONGEST}
          value={reason.value}
          onInput={(event) => (reason.value = event.currentTarget.value)}
        />
      </label>
      <div role="alert">
        {problems.value.map((problem) => (
          <p key={problem} class="bad">
            {problem}
          </p>
        ))}
      </div>
    </Dialog>
  );
}
