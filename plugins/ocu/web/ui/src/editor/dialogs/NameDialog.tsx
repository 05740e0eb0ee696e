// Asks for the name of a mission that does not exist yet.
import { useEffect, useState } from "preact/hooks";
import { get } from "../../shared/api";
import { Dialog } from "../../shared/Dialog";
import type { MissionLine } from "../../shared/types";
import { strings } from "../../strings";
import { freeName, isName } from "../session/files";

const words = strings.home.newDialog;

export interface NameDialogProps {
  title: string;
  label: string;
  act: string;
  suggested: string;
  close(): void;
  chosen(name: string): void;
}

export function NameDialog({ title, label, act, suggested, close, chosen }: NameDialogProps) {
  const [taken, setTaken] = useState<string[]>([]);
  const [name, setName] = useState(suggested);
  useEffect(() => {
    void get<MissionLine[]>("/missions").then((missions) => {
      const names = missions.map((each) => each.name);
      setTaken(names);
      setName((before) => freeName(before, names));
    });
  }, []);
  const wrong = nameProblem(name, taken);
  return (
    <Dialog
      title={title}
      onClose={close}
      actions={
        <>
          <button type="button" class="secondary" onClick={close}>
            {strings.home.cancel}
          </button>
          <button type="submit" form="m2-name-form" class="primary" disabled={wrong !== ""}>
            {act}
          </button>
        </>
      }
    >
      <form
        id="m2-name-form"
        onSubmit={(event) => {
          event.preventDefault();
          if (!wrong) chosen(name.trim());
        }}
      >
        <NameInput label={label} name={name} wrong={wrong} write={setName} />
      </form>
    </Dialog>
  );
}

export function nameProblem(name: string, taken: readonly string[]): string {
  const said = name.trim();
  if (!isName(said)) return words.badName;
  return taken.includes(said) ? words.taken : "";
}

interface NameInputProps {
  label: string;
  name: string;
  wrong: string;
  write(name: string): void;
}

export function NameInput({ label, name, wrong, write }: NameInputProps) {
  return (
    <label class="m2-stacked">
      {label}
      <input
        value={name}
        maxLength={100}
        aria-invalid={wrong !== "" && name !== "" ? "true" : undefined}
        aria-describedby="m2-name-note"
        onInput={(event) => write(event.currentTarget.value)}
      />
      <span id="m2-name-note" class={wrong && name ? "m2-field-error" : "m2-field-hint"}>
        {name && wrong ? wrong : words.nameHint}
      </span>
    </label>
  );
}
