// What the editor asks, one question at a time.
import { Dialog } from "../../shared/Dialog";
import { toast } from "../../shared/Toasts";
import { moment } from "../../shared/moments";
import { fill, strings } from "../../strings";
import type { MissionWork, Question } from "../session/MissionWork";
import { NameDialog } from "./NameDialog";
import { ShortcutsDialog } from "./ShortcutsDialog";
import { VersionsDialog } from "./VersionsDialog";

const words = strings.editor;

interface QuestionProps<Kind extends Question["kind"] = Question["kind"]> {
  work: MissionWork;
  question: Extract<Question, { kind: Kind }>;
  close(): void;
}

export function Questions({ work }: { work: MissionWork }) {
  const question = work.question.value;
  const close = () => {
    work.question.value = null;
  };
  switch (question?.kind) {
    case undefined:
      return null;
    case "conflict":
      return <Conflict {...{ work, question, close }} />;
    case "recovery":
      return <Recovery {...{ work, question, close }} />;
    case "versions":
      return <VersionsDialog {...{ work, close }} />;
    case "saveAs":
      return <SaveAs {...{ work, close }} />;
    case "layout":
      return <Layout {...{ work, close }} />;
    case "shortcuts":
      return <ShortcutsDialog close={close} />;
  }
}

function Conflict({ work, question, close }: QuestionProps<"conflict">) {
  const { current } = question;
  const text = current
    ? fill(words.conflict.text, { by: current.by || "?", at: moment(current.saved_at_us / 1000) })
    : words.conflict.gone;
  return (
    <Dialog
      title={words.conflict.title}
      onClose={close}
      actions={
        <>
          {current && (
            <button
              type="button"
              class="secondary"
              onClick={() => {
                close();
                void work.takeTheirs();
              }}
            >
              {words.conflict.theirs}
            </button>
          )}
          <button
            type="button"
            class="secondary"
            onClick={() => {
              close();
              void work.overwrite(current);
            }}
          >
            {current ? words.conflict.overwrite : words.conflict.again}
          </button>
          <button
            type="button"
            class="primary"
            onClick={() => (work.question.value = { kind: "saveAs" })}
          >
            {words.conflict.mine}
          </button>
        </>
      }
    >
      <p>{text}</p>
      {current && (
        <p>
          <button type="button" class="secondary" onClick={() => void work.compareTheirs()}>
            {strings.compare.theirs}
          </button>
        </p>
      )}
      <p class="m2-note">{words.conflict.kept}</p>
    </Dialog>
  );
}

function Recovery({ work, question, close }: QuestionProps<"recovery">) {
  const { draft, isOlder } = question;
  const at = moment(draft.at);
  return (
    <Dialog
      title={words.recovery.title}
      onClose={close}
      actions={
        <>
          <button
            type="button"
            class="secondary"
            onClick={() => {
              work.discardDraft();
              close();
            }}
          >
            {words.recovery.discard}
          </button>
          <button
            type="button"
            class="primary"
            onClick={() => {
              close();
              void work.recover(draft);
            }}
          >
            {words.recovery.recover}
          </button>
        </>
      }
    >
      <p>{fill(words.recovery.text, { name: draft.mission, at })}</p>
      {isOlder && <p>{words.recovery.older}</p>}
    </Dialog>
  );
}

function SaveAs({ work, close }: Pick<QuestionProps, "work" | "close">) {
  return (
    <NameDialog
      title={words.saveAs.title}
      label={words.saveAs.name}
      act={words.saveAs.act}
      suggested={work.mission}
      close={close}
      chosen={async (name) => {
        if (await work.saveAs(name)) close();
      }}
    />
  );
}

function Layout({ work, close }: Pick<QuestionProps, "work" | "close">) {
  const layOut = async () => {
    close();
    try {
      await work.layOut();
    } catch (error) {
      toast(error instanceof Error ? error.message : String(error), "bad");
    }
  };
  return (
    <Dialog
      title={words.layoutDialog.title}
      onClose={close}
      actions={
        <>
          <button type="button" class="secondary" onClick={close}>
            {strings.home.cancel}
          </button>
          <button type="button" class="primary" onClick={() => void layOut()}>
            {words.layoutDialog.act}
          </button>
        </>
      }
    >
      <p>{words.layoutDialog.text}</p>
    </Dialog>
  );
}
