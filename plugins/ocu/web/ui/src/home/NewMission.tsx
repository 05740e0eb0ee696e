// A mission that does not exist yet: an empty page, a template, or a file of this machine.
import { useEffect, useState } from "preact/hooks";
import { emptyMission, freeName, makeEditable, nameOfFile, saveMission } from "../missions/files";
import { NameInput, nameProblem } from "../missions/NameInput";
import { get } from "../shared/api";
import { Dialog } from "../shared/Dialog";
import { go } from "../shared/router";
import { attempt } from "../shared/Toasts";
import { strings } from "../strings";

const words = strings.home.newDialog;
const EMPTY = "";

/** A file, or neither: then there is a choice. */
export interface Beginning {
  file?: string;
  content?: string;
}

interface Template {
  name: string;
  title: string;
  doc: string;
}

export interface NewMissionProps {
  beginning: Beginning;
  taken: readonly string[];
  close(): void;
}

export function NewMission({ beginning, taken, close }: NewMissionProps) {
  const { file, content } = beginning;
  const [templates, setTemplates] = useState<readonly Template[]>([]);
  const [template, setTemplate] = useState(EMPTY);
  const [name, setName] = useState(() => freeName(file ? nameOfFile(file) : "mission", taken));
  const [isMaking, setMaking] = useState(false);
  useEffect(() => {
    if (file === undefined) void get<Template[]>("/templates").then(setTemplates, () => undefined);
  }, [file]);
  const wrong = nameProblem(name, taken);

  const make = async () => {
    if (wrong || isMaking) return;
    setMaking(true);
    const said = name.trim();
    const made = await attempt(async () => {
      const outcome = await saveMission(said, await drawn(said, template, content), null);
      if (outcome.kind === "conflict") throw new Error(words.taken);
    });
    setMaking(false);
    if (!made) return;
    close();
    go(`/missions/${encodeURIComponent(said)}`);
  };
  const choices = [{ name: EMPTY, title: words.empty, doc: words.emptyDoc }, ...templates];
  return (
    <Dialog
      title={words.title}
      onClose={close}
      wide={file === undefined}
      actions={
        <>
          <button type="button" class="secondary" onClick={close}>
            {strings.home.cancel}
          </button>
          <button
            type="submit"
            form="new-mission"
            class="primary"
            disabled={wrong !== "" || isMaking}
          >
            {words.make}
          </button>
        </>
      }
    >
      <form
        id="new-mission"
        onSubmit={(event) => {
          event.preventDefault();
          void make();
        }}
      >
        <NameInput label={words.name} name={name} wrong={wrong} write={setName} />
        {file === undefined && (
          <fieldset class="home-choices">
            <legend>{words.begin}</legend>
            {choices.map((choice) => (
              <label key={choice.name} class="home-choice">
                <input
                  type="radio"
                  name="template"
                  checked={template === choice.name}
                  onChange={() => {
                    setTemplate(choice.name);
                    if (name.trim() === "" || isSuggested(name)) {
                      setName(freeName(choice.name || "mission", taken));
                    }
                  }}
                />
                <span>
                  <strong>{choice.title}</strong>
                  <span class="home-choice-doc">{choice.doc}</span>
                </span>
              </label>
            ))}
          </fieldset>
        )}
      </form>
    </Dialog>
  );

  /** Whether the user has written no other name yet. */
  function isSuggested(said: string): boolean {
    return choices.some((choice) => freeName(choice.name || "mission", taken) === said);
  }
}

async function drawn(name: string, template: string, content: string | undefined): Promise<string> {
  if (content !== undefined) return (await makeEditable(content)).xml;
  if (template === EMPTY) return emptyMission(name);
  const { xml } = await get<{ xml: string }>(`/templates/${encodeURIComponent(template)}`);
  return xml;
}
