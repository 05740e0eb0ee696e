// The diagrams of a file; one alone needs no tabs, but others can be added.
import { useState } from "preact/hooks";
import { Dialog } from "../../shared/Dialog";
import { fill, strings } from "../../strings";
import type { Diagram } from "../session/diagrams";
import type { EditorSession } from "../session/EditorSession";

const words = strings.editor.diagrams;

export function DiagramTabs({ session }: { session: EditorSession }) {
  const { diagrams } = session;
  const [leaving, setLeaving] = useState<Diagram | null>(null);
  const [isNaming, setNaming] = useState(false);
  const all = diagrams.all.value;
  const step = (event: KeyboardEvent, index: number) => {
    const offset = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!offset) return;
    const next = all[(index + offset + all.length) % all.length];
    if (!next) return;
    void diagrams.open(next.id);
    document.getElementById(`m2-tab-${next.id}`)?.focus();
  };
  return (
    <div class="m2-tabs">
      <div role="tablist" aria-label={words.label} class="m2-tablist">
        {all.map((diagram, index) => {
          const isShown = diagram.id === diagrams.current.value;
          return (
            <button
              key={diagram.id}
              id={`m2-tab-${diagram.id}`}
              type="button"
              role="tab"
              aria-selected={isShown}
              aria-controls="m2-canvas"
              tabIndex={isShown ? 0 : -1}
              onClick={() => void diagrams.open(diagram.id)}
              onKeyDown={(event) => step(event, index)}
            >
              {diagram.title}
            </button>
          );
        })}
      </div>
      <button
        type="button"
        class="plain"
        title={words.add}
        aria-label={words.add}
        onClick={() => setNaming(true)}
      >
        +
      </button>
      {all.length > 1 && <RemoveButton session={session} choose={setLeaving} />}
      {leaving && (
        <Dialog
          title={fill(words.removeTitle, { name: leaving.title })}
          onClose={() => setLeaving(null)}
          actions={
            <>
              <button type="button" class="secondary" onClick={() => setLeaving(null)}>
                {strings.home.cancel}
              </button>
              <button
                type="button"
                class="primary"
                onClick={() => {
                  setLeaving(null);
                  diagrams.remove(leaving.id);
                }}
              >
                {words.removeAct}
              </button>
            </>
          }
        >
          <p>{words.removeText}</p>
        </Dialog>
      )}
      {isNaming && <NewProcess session={session} close={() => setNaming(false)} />}
    </div>
  );
}

interface RemoveProps {
  session: EditorSession;
  choose(diagram: Diagram): void;
}

function RemoveButton({ session, choose }: RemoveProps) {
  const shown = session.diagrams.all.value.find(({ id }) => id === session.diagrams.current.value);
  if (!shown || !session.diagrams.isRemovable(shown.id)) return null;
  const label = fill(words.remove, { name: shown.title });
  return (
    <button
      type="button"
      class="plain"
      title={label}
      aria-label={label}
      onClick={() => choose(shown)}
    >
      ×
    </button>
  );
}

function NewProcess({ session, close }: { session: EditorSession; close(): void }) {
  const [name, setName] = useState("");
  const make = () => {
    close();
    session.diagrams.add(name.trim());
  };
  return (
    <Dialog
      title={words.add}
      onClose={close}
      actions={
        <button type="submit" form="m2-new-process" class="primary" disabled={name.trim() === ""}>
          {words.add}
        </button>
      }
    >
      <form
        id="m2-new-process"
        onSubmit={(event) => {
          event.preventDefault();
          make();
        }}
      >
        <label class="m2-stacked">
          {words.newName}
          <input value={name} onInput={(event) => setName(event.currentTarget.value)} />
        </label>
      </form>
    </Dialog>
  );
}
