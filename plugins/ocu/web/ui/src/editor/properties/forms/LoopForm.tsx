// How often an activity is done: a loop, or once for each item of a list.
import { strings } from "../../../strings";
import { child, isA, text } from "../../moddle/moddle";
import { expressionLanguage, expressionProperties, expressionText } from "../expressions";
import { ComboField } from "../fields/ComboField";
import { CheckField } from "../fields/SelectField";
import { TextField } from "../fields/TextField";
import { factoryOf, objectOf, set, type FormProps } from "../form";
import { ExpressionField } from "./ExpressionField";

const words = strings.editor.loop;

export function LoopForm(form: FormProps) {
  const loop = child(objectOf(form), "loopCharacteristics");
  if (!loop) return null;
  const write = (properties: Record<string, unknown>) => set(form, loop, properties);
  const writeExpression = (name: string) => (body: string) =>
    write(expressionProperties(factoryOf(form), loop, name, body));
  if (isA(loop, "bpmn:StandardLoopCharacteristics")) {
    return (
      <>
        <ExpressionField
          form={form}
          id="m2-loop-condition"
          label={words.condition}
          hint={words.conditionHint}
          value={expressionText(loop, "loopCondition")}
          language={expressionLanguage(loop, "loopCondition")}
          write={writeExpression("loopCondition")}
        />
        <TextField
          id="m2-loop-maximum"
          label={words.maximum}
          value={loop.get("loopMaximum") === undefined ? "" : String(loop.get("loopMaximum"))}
          error={/^\d*$/.test(String(loop.get("loopMaximum") ?? "")) ? undefined : words.noNumber}
          write={(value) => write({ loopMaximum: value.trim() || undefined })}
        />
        <CheckField
          id="m2-loop-before"
          label={words.testBefore}
          value={loop.get("testBefore") === true}
          write={(testBefore) => write({ testBefore })}
        />
      </>
    );
  }
  const collection = text(loop, "m2pem:collection");
  const cardinality = expressionText(loop, "loopCardinality");
  const counted = collection !== "" || loop.get("loopDataInputRef") !== undefined;
  const names = form.editor.checks.outline.value?.names ?? [];
  return (
    <>
      <TextField
        id="m2-loop-cardinality"
        label={words.cardinality}
        mono
        value={cardinality}
        error={
          cardinality && counted ? words.both : !cardinality && !counted ? words.neither : undefined
        }
        hint={words.cardinalityHint}
        write={writeExpression("loopCardinality")}
      />
      <ComboField
        id="m2-loop-collection"
        label={words.collection}
        mono
        value={collection}
        suggestions={names.map(({ name }) => ({ value: name }))}
        hint={words.collectionHint}
        write={(value) => write({ "m2pem:collection": value.trim() || undefined })}
      />
      <TextField
        id="m2-loop-item"
        label={words.item}
        mono
        value={text(loop, "m2pem:elementVariable")}
        hint={words.itemHint}
        write={(value) => write({ "m2pem:elementVariable": value.trim() || undefined })}
      />
      <ExpressionField
        form={form}
        id="m2-loop-completion"
        label={words.completion}
        hint={words.completionHint}
        value={expressionText(loop, "completionCondition")}
        language={expressionLanguage(loop, "completionCondition")}
        write={writeExpression("completionCondition")}
      />
      <CheckField
        id="m2-loop-sequential"
        label={words.sequential}
        hint={words.sequentialHint}
        value={loop.get("isSequential") === true}
        write={(isSequential) => write({ isSequential })}
      />
    </>
  );
}
