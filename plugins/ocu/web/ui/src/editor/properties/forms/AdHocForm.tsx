// What is done in an ad-hoc subprocess, and when that is enough.
import { strings } from "../../../strings";
import { text } from "../../moddle/moddle";
import { expressionLanguage, expressionProperties, expressionText } from "../expressions";
import { CheckField } from "../fields/SelectField";
import { factoryOf, objectOf, set, type FormProps } from "../form";
import { ExpressionField } from "./ExpressionField";

const words = strings.editor.adHoc;

export function AdHocForm(form: FormProps) {
  const subprocess = objectOf(form);
  const write = (properties: Record<string, unknown>) => set(form, subprocess, properties);
  return (
    <>
      <ExpressionField
        form={form}
        id="m2-active-elements"
        label={words.active}
        hint={words.activeHint}
        value={text(subprocess, "m2pem:activeElements")}
        write={(value) => write({ "m2pem:activeElements": value.trim() || undefined })}
      />
      <ExpressionField
        form={form}
        id="m2-ad-hoc-completion"
        label={words.completion}
        hint={words.completionHint}
        value={expressionText(subprocess, "completionCondition")}
        language={expressionLanguage(subprocess, "completionCondition")}
        write={(body) =>
          write(expressionProperties(factoryOf(form), subprocess, "completionCondition", body))
        }
      />
      <CheckField
        id="m2-ad-hoc-cancel"
        label={words.cancel}
        value={subprocess.get("cancelRemainingInstances") !== false}
        write={(cancels) => write({ cancelRemainingInstances: cancels })}
      />
      <CheckField
        id="m2-ad-hoc-order"
        label={words.sequential}
        value={text(subprocess, "ordering") === "Sequential"}
        write={(sequential) => write({ ordering: sequential ? "Sequential" : "Parallel" })}
      />
    </>
  );
}
