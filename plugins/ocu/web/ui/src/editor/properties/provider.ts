// Which groups the properties panel shows for an element.
import { Group } from "@bpmn-io/properties-panel";
import type { ComponentType } from "preact";
import { strings } from "../../strings";
import { behaviorOf } from "../moddle/behavior";
import { child, isA, type ModdleElement } from "../moddle/moddle";
import { referencesOf } from "../moddle/roots";
import type { EditorContext } from "../panels/panel";
import type { Element, PropertiesPanel } from "../session/services";
import type { FormProps } from "./form";
import { AdHocForm } from "./forms/AdHocForm";
import { BehaviorForm } from "./forms/BehaviorForm";
import { CallForm } from "./forms/CallForm";
import {
  ActivationForm,
  ConditionalEventForm,
  conditionalEventOf,
  ConditionForm,
  isConditional,
} from "./forms/ConditionForm";
import { GeneralForm } from "./forms/GeneralForm";
import { LoopForm } from "./forms/LoopForm";
import { PromptForm } from "./forms/PromptForm";
import { ReferenceForm } from "./forms/ReferenceForm";
import { RolesForm } from "./forms/RolesForm";
import { ScriptForm } from "./forms/ScriptForm";
import { ServiceForm } from "./forms/ServiceForm";
import { TimerForm, timerOf } from "./forms/TimerForm";

/** After BPMN's own provider: what it offers for these is in words of another engine. */
const AFTER_BPMN = 500;
const REPLACED = new Set([
  ...["general", "documentation", "error", "message", "signal", "escalation", "timer"],
  ...["multiInstance", "adHocCompletion"],
]);

interface GroupDefinition {
  id: string;
  label: string;
  component: unknown;
  entries: ({ id: string; component: ComponentType<FormProps> } & Partial<FormProps>)[];
  shouldOpen?: boolean;
}

type GroupName = keyof typeof strings.editor.groups;

export class MissionProperties {
  static readonly $inject = ["propertiesPanel", "editorContext"];
  private revision = 0;

  constructor(
    propertiesPanel: PropertiesPanel,
    private readonly editor: EditorContext,
  ) {
    propertiesPanel.registerProvider(AFTER_BPMN, this);
  }

  getGroups(element: Element) {
    return (groups: GroupDefinition[]): GroupDefinition[] => [
      ...formsFor(element.businessObject).map(([name, form]) => this.group(name, form)),
      ...groups.filter(({ id }) => !REPLACED.has(id)),
    ];
  }

  private group(id: GroupName, component: ComponentType<FormProps>): GroupDefinition {
    const revision = ++this.revision;
    return {
      id: `m2-${id}`,
      label: strings.editor.groups[id],
      component: Group,
      entries: [{ id: `m2-${id}-form`, component, editor: this.editor, revision }],
      shouldOpen: true,
    };
  }
}

function formsFor(object: ModdleElement): [GroupName, ComponentType<FormProps>][] {
  const forms: [GroupName, ComponentType<FormProps>][] = [];
  if (isA(object, "bpmn:ScriptTask")) {
    forms.push(["behavior", BehaviorForm]);
    forms.push(behaviorOf(object) ? ["resources", RolesForm] : ["script", ScriptForm]);
  } else if (isA(object, "bpmn:ServiceTask") || isA(object, "bpmn:BusinessRuleTask")) {
    const forBehavior = behaviorOf(object) !== undefined;
    forms.push(forBehavior ? ["behavior", BehaviorForm] : ["service", ServiceForm]);
    forms.push(["resources", RolesForm]);
  } else if (isA(object, "bpmn:SendTask") && behaviorOf(object)) {
    forms.push(["behavior", BehaviorForm], ["resources", RolesForm]);
  }
  if (isA(object, "bpmn:UserTask")) forms.push(["prompt", PromptForm]);
  if (isA(object, "bpmn:CallActivity")) forms.push(["call", CallForm]);
  if (isA(object, "bpmn:SequenceFlow") && isConditional(object)) {
    forms.push(["condition", ConditionForm]);
  }
  if (isA(object, "bpmn:ComplexGateway")) forms.push(["condition", ActivationForm]);
  if (isA(object, "bpmn:AdHocSubProcess")) forms.push(["adHoc", AdHocForm]);
  if (conditionalEventOf(object)) forms.push(["condition", ConditionalEventForm]);
  if (referencesOf(object).length > 0) forms.push(["references", ReferenceForm]);
  if (timerOf(object)) forms.push(["timer", TimerForm]);
  if (isA(object, "bpmn:Activity") && child(object, "loopCharacteristics")) {
    forms.push(["loop", LoopForm]);
  }
  forms.push(["general", GeneralForm]);
  return forms;
}
