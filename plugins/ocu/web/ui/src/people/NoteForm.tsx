// Below the log of a run that goes on: a note for it, which every operator sees.
import { useSignal } from "@preact/signals";
import { command } from "../shared/command";
import { strings } from "../strings";
import "./people.css";

const words = strings.people;
const LONGEST = 2000;

export function NoteForm({ run }: { run: string }) {
  const note = useSignal("");
  const busy = useSignal(false);
  const add = async () => {
    busy.value = true;
    if (await command(`/runs/${encodeURIComponent(run)}/notes`, { text: note.value.trim() })) {
      note.value = "";
    }
    busy.value = false;
  };
  return (
    <form
      class="note-form"
      onSubmit={(event) => {
        event.preventDefault();
        if (note.value.trim() && !busy.value) void add();
      }}
    >
      <input
        type="text"
        aria-label={words.note}
        placeholder={words.note}
        maxLength={LONGEST}
        value={note.value}
        onInput={(event) => (note.value = event.currentTarget.value)}
      />
      <button type="submit" class="secondary" disabled={busy.value || !note.value.trim()}>
        {words.noteAdd}
      </button>
    </form>
  );
}
