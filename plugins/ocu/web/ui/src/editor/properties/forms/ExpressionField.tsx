// A condition or script, with what may come next, and with what the check says of it.
import type { Finding } from "../../../shared/types";
import { fill, strings } from "../../../strings";
import { complete, type Decided } from "../../condition/completion";
import { dialectOf, stoppedAt, tokensOf, type Token } from "../../condition/dialect";
import { isA, list, text, type ModdleElement } from "../../moddle/moddle";
import { DEFAULT_STORE, promptOf } from "../../moddle/prompts";
import { CodeField } from "../fields/CodeField";
import { definitionsOf, type FormProps } from "../form";

const words = strings.editor.expression;

export interface ExpressionFieldProps {
  form: FormProps;
  id: string;
  label: string;
  value: string;
  write(value: string): void;
  /** That the file gives the expression. */
  language?: string;
  hint?: string | undefined;
  rows?: number;
  required?: boolean | undefined;
  /** What is wrong with it besides the findings. */
  error?: string | undefined;
  /** What the check says of the element. */
  findings?: readonly Finding[];
}

export function ExpressionField({ form, rows, language, findings = [], error, ...field }: ExpressionFieldProps) {
  const { checks, catalogue } = form.editor;
  const names = checks.outline.value?.names ?? [];
  const dialectIn = (typed: string) => catalogue.dialects[dialectOf(typed, language)];
  const explain = (typed: string, { kind, from, to }: Token): string[] => {
    const name = typed.slice(from, to).replace(/\s+/g, " ");
    if (kind === "function") {
      const called = dialectIn(typed).functions.find((each) => each.name === name);
      return called ? [...called.signatures, called.doc] : [];
    }
    const writers = names.filter((each) => each.name === name).map((each) => each.from);
    if (kind !== "name" || writers.length === 0) return [];
    const by = writers.filter(Boolean).join(", ");
    return [by ? fill(words.writtenBy, { name, by }) : fill(words.notWritten, { name })];
  };
  return (
    <CodeField
      {...field}
      rows={rows ?? 2}
      offered={words.offered}
      error={findings.map(said).join("\n") || error}
      wrongAt={findings.flatMap(({ message }) => stoppedAt(message, field.value) ?? [])}
      tokens={(typed) => tokensOf(typed, dialectIn(typed))}
      explain={explain}
      suggest={async (typed, cursor) => {
        const known = await checks.known();
        const line = lineAt(typed, cursor);
        const name = dialectOf(typed, language);
        const dialect = catalogue.dialects[name];
        const { from, options } = complete(
          line.text,
          line.cursor,
          known.names,
          decidedIn(form),
          name,
          dialect,
        );
        return {
          from: line.start + from,
          options: options.map((each) => ({ ...each, group: words.groups[each.group] })),
        };
      }}
    />
  );
}

function said({ message, remedy }: Finding): string {
  return [message, remedy].filter(Boolean).join("; ");
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
