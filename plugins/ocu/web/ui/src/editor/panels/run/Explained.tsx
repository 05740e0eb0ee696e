// Beside what came of a rehearsal: what its script did not say, and what a verification says of it.
import type { RunSummary } from "../../../shared/types";
import { fill, strings } from "../../../strings";
import type { EditorContext } from "../panel";
import { showPanel } from "../shown";
import { ElementLink } from "../verify/Answers";
import { verificationOf } from "../verify/verification";
import { causeOf, type Unsaid } from "./unsaid";

const words = strings.run.explained;

interface ExplainedProps {
  editor: EditorContext;
  summary: RunSummary;
  unsaid: Unsaid;
}

export function Explained({ editor, summary, unsaid }: ExplainedProps) {
  const cause = causeOf(summary);
  return (
    <>
      {cause && <CauseView editor={editor} {...cause} />}
      <details class="m2r-unsaid" open={summary.status === "failed"}>
        <summary>{words.unsaid}</summary>
        <ul class="m2v-assumed">
          {unsaid.answers.map(({ element, decision, times }) => (
            <li key={`${element} ${decision}`}>
              <ElementLink editor={editor} id={element} class="m2v-link" />
              {`: ${fill(times > 1 ? words.firstAnswers : words.firstAnswer, { decision, times })}`}
            </li>
          ))}
          {unsaid.behaviors > 0 && <li>{words.behaviors}</li>}
          {unsaid.services > 0 && <li>{words.services}</li>}
          <li>{words.sends}</li>
        </ul>
      </details>
    </>
  );
}

interface CauseProps {
  editor: EditorContext;
  property: string;
  element: string;
  reason: keyof typeof words.reasons;
}

function CauseView({ editor, property, element, reason }: CauseProps) {
  const verification = verificationOf(editor);
  const look = () => {
    verification.pointed.value = property;
    showPanel("verify");
    if (!verification.made.value || verification.isStale.value) void verification.begin(editor);
  };
  return (
    <div class="m2r-cause">
      <p>
        {element && (
          <>
            <ElementLink editor={editor} id={element} class="m2v-link" />
            {": "}
          </>
        )}
        {words.reasons[reason]}
      </p>
      <button type="button" class="secondary" onClick={look}>
        {fill(words.look, { property })}
      </button>
    </div>
  );
}
