// What a rehearsal says of the requirements that runs are monitored for. A choice leads to the moment
// of the verdict, on the map and in the diagram.
import { Verdict } from "../../../operate/requirements/Verdict";
import { inOrder } from "../../../operate/requirements/violations";
import { clockTenths } from "../../../shared/format";
import type { Requirement, RunSummary } from "../../../shared/types";
import { fill, strings } from "../../../strings";
import type { EditorContext } from "../panel";
import { ElementLink } from "../verify/Answers";
import type { Read } from "./rehearsal";

const words = strings.run;
const text = strings.monitors;

interface VerdictsProps {
  editor: EditorContext;
  id: string;
  summary: RunSummary;
  requirements: Read["requirements"];
}

export function Verdicts({ editor, id, summary, requirements }: VerdictsProps) {
  const all = inOrder(requirements);
  if (all.length === 0) return null;
  const show = ({ recorded, elements }: Requirement) => {
    const [first] = elements;
    if (first) void editor.select(first);
    // Just before its record the verdict is not shown, although it was certain.
    if (recorded !== null) editor.plan.play({ id, summary, at: recorded });
  };
  return (
    <>
      <h3>{words.requirements}</h3>
      <ul class="verdicts">
        {all.map(([name, requirement]) => (
          <Verdict
            key={name}
            name={name}
            requirement={requirement}
            status={summary.status}
            hint={hintOf(requirement)}
            onShow={() => show(requirement)}
          >
            {requirement.elements.length > 0 && (
              <p class="verdict-elements">
                {text.elements}:{" "}
                {requirement.elements.map((element) => (
                  <ElementLink key={element} editor={editor} id={element} class="plain" />
                ))}
              </p>
            )}
          </Verdict>
        ))}
      </ul>
    </>
  );
}

const hintOf = ({ recorded: at }: Requirement): string =>
  at === null ? text.show : fill(text.showAt, { time: clockTenths(at) });
