// Why the server would not do something: in its words, with all that it found.
import type { Finding } from "../../shared/types";
import { useUniqueId } from "../../shared/uniqueId";
import { strings } from "../../strings";
import type { Refusal } from "./job";
import type { EditorContext } from "./panel";
import { pointedAt, scalarIn } from "./pointed";

const words = strings.verify;

export interface ProblemViewProps {
  editor: EditorContext;
  title: string;
  refusal: Refusal;
  /** What was typed, and what findings call it, so that their lines are shown. */
  typed?: Typed;
}

export interface Typed {
  file: "answers.yaml" | "requirements.yaml";
  text: string;
}

export function ProblemView({ editor, title, refusal, typed }: ProblemViewProps) {
  const heading = useUniqueId();
  return (
    <section class="m2v-problem" role="alert" aria-labelledby={heading}>
      <h2 id={heading}>{title}</h2>
      <p>{refusal.text}</p>
      <ul>
        {refusal.findings.map((finding, index) => (
          <FindingLine key={index} editor={editor} finding={finding} typed={typed} />
        ))}
      </ul>
    </section>
  );
}

interface FindingLineProps {
  editor: EditorContext;
  finding: Finding;
  typed: Typed | undefined;
}

function FindingLine({ editor, finding, typed }: FindingLineProps) {
  const { element, message, remedy } = finding;
  const isDrawn = editor.checks.outline.value?.elements.some(({ id }) => id === element);
  return (
    <li>
      {isDrawn ? (
        <button type="button" class="m2v-link" onClick={() => void editor.select(element)}>
          {element}
        </button>
      ) : (
        element && <b>{element}</b>
      )}{" "}
      {message}
      {remedy && <span class="m2v-remedy"> {remedy}</span>}
      {typed && <OfTyped finding={finding} typed={typed} />}
    </li>
  );
}

/** The line of the YAML text that a finding is about, with the character of a formula pointed at. */
function OfTyped({ finding, typed }: { finding: Finding; typed: Typed }) {
  if (finding.file !== typed.file) return null;
  const line = typed.text.split("\n")[finding.line - 1];
  if (line === undefined) return null;
  const key = /^requirements\[\d+\].*?([\w-]+)$/.exec(finding.element)?.[1];
  const formula = key ? scalarIn(line, key) : undefined;
  return (
    <>
      <p class="m2v-where">
        {words.specLine} {finding.line}
        {line.trim() !== "" && (
          <>
            : <code>{line.trim()}</code>
          </>
        )}
      </p>
      {formula !== undefined && <Caret message={finding.message} formula={formula} />}
    </>
  );
}

/** The formula with a `^` below the character that is meant. */
export function Caret({ message, formula }: { message: string; formula: string }) {
  const pointed = pointedAt(message, formula);
  if (!pointed) return null;
  return (
    <pre class="m2v-caret" aria-hidden="true">
      {pointed.line}
      {"\n"}
      {" ".repeat(pointed.column)}^
    </pre>
  );
}
