// A condition or script, with what may come next, and with what the check says of it.
import { strings } from "../../../strings";
import { complete, type Decided } from "../../condition/completion";
import { isA, list, text, type ModdleElement } from "../../moddle/moddle";
import { DEFAULT_STORE, promptOf } from "../../moddle/prompts";
import { SuggestingField } from "../fields/SuggestingField";
import { definitionsOf, type FormProps } from "../form";

const words = strings.editor.expression;

export interface ExpressionFieldProps {
  form: FormProps;
  id: string;
  label: string;
  value: string;
  write(value: string): void;
  hint?: string;
  rows?: number;
  error?: string | undefined;
}

export function ExpressionField({ form, rows, ...field }: ExpressionFieldProps) {
  const names = form.editor.checks.outline.value?.names ?? [];
  return (
    <SuggestingField
      {...field}
      rows={rows ?? 2}
      offered={words.offered}
      suggest={(typed, cursor) => {
        const line = lineAt(typed, cursor);
        const { from, options } = complete(line.text, line.cursor, names, decidedIn(form));
        return {
          from: line.start + from,
          options: options.map((each) => ({ ...each, group: words.groups[each.group] })),
        };
      }}
    />
  );
}

function lineAt(value: string, cursor: number) {
  const start = value.lastIndexOf("\n", cursor - 1) + 1;
  const end = value.indexOf("\n", cursor);
  return { start, text: value.slice(start, end < 0 ? undefined : end), cursor: cursor - start };
}

/** What the prompts of the file let operators decide, by the name that is written. */
function decidedIn(form: FormProps): Decided[] {
  const found: Decided[] = [];
  const waiting: ModdleElement[] = [...list(definitionsOf(form), "rootElements")];
  for (let each = waiting.pop(); each; each = waiting.pop()) {
    if (isA(each, "bpmn:UserTask")) {
      const { prompt } = promptOf(each);
      found.push({ store: prompt.store || DEFAULT_STORE, values: prompt.decisions });
    }
    if (text(each, "id")) waiting.push(...list(each, "flowElements"));
  }
  return found;
}
