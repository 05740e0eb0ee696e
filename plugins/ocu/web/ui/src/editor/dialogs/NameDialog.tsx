// Asks for the name of a mission that does not exist yet.
import { useEffect, useState } from "preact/hooks";
import { get } from "../../shared/api";
import { Dialog } from "../../shared/Dialog";
import type { MissionLine } from "../../shared/types";
import { strings } from "../../strings";
import { freeName } from "../../missions/files";
import { NameInput, nameProblem } from "../../missions/NameInput";

export interface NameDialogProps {
  title: string;
  label: string;
  act: string;
  suggested: string;
  close(): void;
  chosen(name: string): void;
}

export function NameDialog({ title, label, act, suggested, close, chosen }: NameDialogProps) {
  // Until it is known, the name that is suggested may be another mission's.
  const [taken, setTaken] = useState<string[] | null>(null);
  const [name, setName] = useState(suggested);
  useEffect(() => {
    void get<MissionLine[]>("/missions")
      .catch((): MissionLine[] => [])
      .then((missions) => {
        const names = missions.map((each) => each.name);
        setTaken(names);
        setName((before) => freeName(before, names));
      });
  }, []);
  const wrong = nameProblem(name, taken ?? []);
  const usable = taken !== null && wrong === "";
  return (
    <Dialog
      title={title}
      onClose={close}
      actions={
        <>
          <button type="button" class="secondary" onClick={close}>
            {strings.home.cancel}
          </button>
          <button type="submit" form="m2-name-form" class="primary" disabled={!usable}>
            {act}
          </button>
        </>
      }
    >
      <form
        id="m2-name-form"
        onSubmit={(event) => {
          event.preventDefault();
          if (usable) chosen(name.trim());
        }}
      >
        <NameInput label={label} name={name} wrong={wrong} write={setName} />
      </form>
    </Dialog>
  );
}
