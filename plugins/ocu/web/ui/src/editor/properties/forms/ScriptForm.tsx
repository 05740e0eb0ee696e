// The statements of a script task that commands no behavior.
import { strings } from "../../../strings";
import { text } from "../../moddle/moddle";
import { objectOf, set, type FormProps } from "../form";
import { ExpressionField } from "./ExpressionField";

const words = strings.editor.script;

export function ScriptForm(form: FormProps) {
  const task = objectOf(form);
  return (
    <ExpressionField
      form={form}
      id="m2-script"
      label={words.label}
      value={text(task, "script")}
      language="m2pem"
      hint={words.hint}
      rows={5}
      findings={form.editor.checks.of(text(task, "id"))}
      write={(script) =>
        set(form, task, {
          script: script.trim() === "" ? undefined : script,
          scriptFormat: script.trim() === "" ? undefined : "m2pem",
        })
      }
    />
  );
}
