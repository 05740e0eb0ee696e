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
  /** The text that findings with a line may be of. */
  spec?: string;
}

export function ProblemView({ editor, title, refusal, spec = "" }: ProblemViewProps) {
  const heading = useUniqueId();
  return (
    <section class="m2v-problem" role="alert" aria-labelledby={heading}>
      <h2 id={heading}>{title}</h2>
      <p>{refusal.text}</p>
      <ul>
        {refusal.findings.map((finding, index) => (
          <FindingLine key={index} editor={editor} finding={finding} spec={spec} />
        ))}
      </ul>
    </section>
  );
}

interface FindingLineProps {
  editor: EditorContext;
  finding: Finding;
  spec: string;
}

function FindingLine({ editor, finding, spec }: FindingLineProps) {
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
      <OfSpec finding={finding} spec={spec} />
    </li>
  );
}

/** The line of the YAML text that a finding is about, with the character pointed at. */
function OfSpec({ finding, spec }: { finding: Finding; spec: string }) {
  const place = /^requirements\[\d+\].*?([\w-]+)$/.exec(finding.element);
  const line = place && finding.line > 0 ? spec.split("\n")[finding.line - 1] : undefined;
  if (line === undefined || !place) return null;
  const formula = scalarIn(line, place[1]!);
  return (
    <>
      <p class="m2v-where">
        {words.specLine} {finding.line}: <code>{line.trim()}</code>
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
