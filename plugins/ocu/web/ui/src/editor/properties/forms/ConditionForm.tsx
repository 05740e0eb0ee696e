// When a sequence flow is taken, a gateway's default, and what conditional events wait for.
import { strings } from "../../../strings";
import { child, isA, list, text, type ModdleElement } from "../../moddle/moddle";
import { expressionLanguage, expressionProperties, expressionText } from "../expressions";
import { CheckField } from "../fields/SelectField";
import { factoryOf, objectOf, set, type FormProps } from "../form";
import { ExpressionField } from "./ExpressionField";

const words = strings.editor.condition;
const CHOOSING = [
  "bpmn:ExclusiveGateway",
  "bpmn:InclusiveGateway",
  "bpmn:ComplexGateway",
  "bpmn:Activity",
];

/** Whether a condition may stand on a flow. */
export function isConditional(flow: ModdleElement): boolean {
  const source = child(flow, "sourceRef");
  return CHOOSING.some((type) => isA(source, type));
}

export function conditionalEventOf(element: ModdleElement): ModdleElement | undefined {
  return list(element, "eventDefinitions").find((each) =>
    isA(each, "bpmn:ConditionalEventDefinition"),
  );
}

export function ConditionForm(form: FormProps) {
  const flow = objectOf(form);
  const source = child(flow, "sourceRef")!;
  const isDefault = source.get("default") === flow;
  const findings = form.editor.checks.of(text(flow, "id"));
  return (
    <>
      <ExpressionField
        form={form}
        id="m2-condition"
        label={words.label}
        value={expressionText(flow, "conditionExpression")}
        hint={isDefault ? words.defaultHint : words.hint}
        rows={3}
        findings={findings}
        language={expressionLanguage(flow, "conditionExpression")}
        write={(body) =>
          set(form, flow, expressionProperties(factoryOf(form), flow, "conditionExpression", body))
        }
      />
      <CheckField
        id="m2-default"
        label={words.isDefault}
        hint={words.isDefaultHint}
        value={isDefault}
        write={(chosen) => set(form, source, { default: chosen ? flow : undefined })}
      />
    </>
  );
}

/** When a complex gateway goes on. */
export function ActivationForm(form: FormProps) {
  const gateway = objectOf(form);
  return (
    <ExpressionField
      form={form}
      id="m2-activation"
      label={words.activation}
      value={expressionText(gateway, "activationCondition")}
      language={expressionLanguage(gateway, "activationCondition")}
      hint={words.activationHint}
      rows={3}
      write={(body) =>
        set(
          form,
          gateway,
          expressionProperties(factoryOf(form), gateway, "activationCondition", body),
        )
      }
    />
  );
}

export function ConditionalEventForm(form: FormProps) {
  const event = conditionalEventOf(objectOf(form));
  if (!event) return null;
  return (
    <ExpressionField
      form={form}
      id="m2-event-condition"
      label={words.event}
      value={expressionText(event, "condition")}
      language={expressionLanguage(event, "condition")}
      hint={words.eventHint}
      rows={3}
      write={(body) =>
        set(form, event, expressionProperties(factoryOf(form), event, "condition", body))
      }
    />
  );
}
