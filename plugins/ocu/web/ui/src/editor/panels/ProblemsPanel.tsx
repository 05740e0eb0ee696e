// What is wrong with the mission; a click shows where.
import { useState } from "preact/hooks";
import type { Finding } from "../../shared/types";
import { toast } from "../../shared/Toasts";
import { counted, fill, strings } from "../../strings";
import type { EditorContext, Panel } from "./panel";

const words = strings.editor.problems;

export const problemsPanel: Panel = {
  id: "problems",
  title: strings.editor.panels.problems,
  badge: (editor) => editor.checks.findings.value.length,
  render: (editor) => <Problems editor={editor} />,
};

type Filter = Finding["severity"] | "all";

function Problems({ editor }: { editor: EditorContext }) {
  const [filter, setFilter] = useState<Filter>("all");
  const { findings, state } = editor.checks;
  const errors = findings.value.filter((each) => each.severity === "error");
  const warnings = findings.value.filter((each) => each.severity === "warning");
  const shown = { all: [...errors, ...warnings], error: errors, warning: warnings }[filter];
  return (
    <div class="m2-problems">
      <div class="m2-problems-head">
        <p role="status">{statusText(state.value, errors.length, warnings.length)}</p>
        <div role="group" aria-label={words.filter} class="m2-segments">
          {(["all", "error", "warning"] as const).map((each) => (
            <button
              key={each}
              type="button"
              aria-pressed={filter === each}
              onClick={() => setFilter(each)}
            >
              {{ all: words.all, error: words.errors, warning: words.warnings }[each]}
            </button>
          ))}
        </div>
      </div>
      <ul>
        {shown.map((finding, index) => (
          <li key={index}>
            <Problem editor={editor} finding={finding} />
          </li>
        ))}
      </ul>
    </div>
  );
}

function Problem({ editor, finding }: { editor: EditorContext; finding: Finding }) {
  const { severity, element, message, remedy, rule, number } = finding;
  const name = nameOf(editor, element);
  const choose = async () => {
    if (element && !(await editor.select(element))) {
      toast(fill(strings.editor.notDrawn, { element: name }));
    }
  };
  return (
    <button type="button" class={`m2-problem m2-problem-${severity}`} onClick={() => void choose()}>
      <span class="m2-problem-where">
        <span class="m2-problem-mark" aria-hidden="true">
          {severity === "error" ? "✕" : "!"}
        </span>
        <span class="m2-hidden">{severity === "error" ? words.errors : words.warnings}: </span>
        {name || words.ofFile}
      </span>
      <span>{message}</span>
      {remedy && <span class="m2-problem-remedy">{remedy}</span>}
      <span class="m2-problem-rule">{[number, rule].filter(Boolean).join(" ")}</span>
    </button>
  );
}

function nameOf(editor: EditorContext, element: string): string {
  const drawn = editor.service("elementRegistry").get(element)?.businessObject?.name as unknown;
  const known = editor.checks.outline.value?.elements.find(({ id }) => id === element);
  return String(drawn || known?.name || element);
}

function statusText(state: string, errors: number, warnings: number): string {
  if (state === "failed") return words.failed;
  if (state !== "checked") return words.checking;
  if (errors + warnings === 0) return words.none;
  return [counted(words.errorCount, errors), counted(words.warningCount, warnings)].join(", ");
}
