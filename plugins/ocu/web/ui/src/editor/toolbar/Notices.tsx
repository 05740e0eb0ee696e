// What one must know before going on: what the editor cannot keep, what the file had wrong.
import { fill, strings } from "../../strings";
import { present } from "../../people/people";
import { othersEditing } from "../../people/persons";
import { session as signedIn } from "../../shared/session";
import type { MissionWork } from "../session/MissionWork";

const words = strings.editor;

export function Notices({ work }: { work: MissionWork }) {
  const { notes, session, putBack } = work;
  const warnings = session.warnings.value;
  const undo = putBack.value;
  const others = othersEditing(present.value, work.mission, signedIn.value?.user ?? "");
  const { alsoEdits, alsoEditMany } = strings.people;
  return (
    <>
      {others.length > 0 && (
        <p class="m2-notice" role="status">
          {fill(others.length === 1 ? alsoEdits : alsoEditMany, { names: others.join(", ") })}
        </p>
      )}
      {undo && (
        <Notice
          text={undo.text}
          action={words.file.putBack}
          act={() => {
            putBack.value = null;
            void undo.act();
          }}
          close={() => (putBack.value = null)}
        />
      )}
      {notes.value.length > 0 && (
        <Notice
          text={`${words.notes}: ${notes.value.join(" ")}`}
          close={() => (notes.value = [])}
        />
      )}
      {warnings.length > 0 && (
        <Notice
          text={fill(words.importWarnings, { warnings: warnings.slice(0, 3).join("; ") })}
          close={() => (session.warnings.value = [])}
        />
      )}
    </>
  );
}

interface NoticeProps {
  text: string;
  action?: string;
  act?(): void;
  close(): void;
}

function Notice({ text, action, act, close }: NoticeProps) {
  return (
    <div class="m2-notice" role="note">
      <span>{text}</span>
      {action && (
        <button type="button" class="secondary" onClick={act}>
          {action}
        </button>
      )}
      <button type="button" class="plain" aria-label={strings.shell.close} onClick={close}>
        ×
      </button>
    </div>
  );
}
