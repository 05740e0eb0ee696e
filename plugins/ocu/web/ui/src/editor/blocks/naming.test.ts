import { BpmnModdle } from "bpmn-moddle";
import { describe, expect, it } from "vitest";
import type { Behavior, Parameter } from "../../shared/types";
import { m2pemDescriptor } from "../moddle/descriptor";
import { setBehavior } from "../moddle/behavior";
import type { Factory } from "../moddle/moddle";
import { setPrompt } from "../moddle/prompts";
import { Catalogue } from "../session/catalogue";
import { written } from "./making";
import { isNamedByItself, nameOf } from "./naming";

const moddle = new BpmnModdle({ m2pem: m2pemDescriptor });
const factory: Factory = { create: (type, attributes) => moddle.create(type, attributes) };
const survey = {
  name: "area_survey",
  type: "vehicle",
  parameters: [{ name: "area", kind: "area" } as Parameter],
  resources: ["uav1"],
  teams: [],
} as unknown as Behavior;
const catalogue = new Catalogue({ vehicles: [] } as never, [survey], [], [], {} as never);

function surveying(area: string, vehicle: string) {
  const task = factory.create("bpmn:ScriptTask");
  const role = { name: "pilot", kind: "vehicle" as const, resource: vehicle, optional: false };
  const parameters = area ? [{ name: "area", value: area }] : [];
  const use = { type: "vehicle", name: "area_survey", parameters, roles: [role] };
  written(setBehavior(factory, task, use));
  return task;
}

describe("what elements are called by themselves", () => {
  it.each([
    ["field", "uav1", "Area survey field by uav1"],
    ["", "uav1", "Area survey by uav1"],
    ["${chosen}", "", "Area survey"],
  ])("a behavior: %s, %s", (area, vehicle, name) => {
    expect(nameOf(catalogue, surveying(area, vehicle))).toBe(name);
  });

  it("a question, a call, a timer", () => {
    const ask = factory.create("bpmn:UserTask");
    expect(nameOf(catalogue, ask)).toBe("Ask the operator");
    const prompt = { text: "Go on?", decisions: [], store: "", role: "", timeout: "" };
    written(setPrompt(factory, ask, prompt));
    expect(nameOf(catalogue, ask)).toBe("Ask: Go on?");
    const call = factory.create("bpmn:CallActivity", { calledElement: "Detect" });
    expect(nameOf(catalogue, call)).toBe("Call Detect");
    const timeDuration = factory.create("bpmn:FormalExpression", { body: "PT90S" });
    const timer = factory.create("bpmn:TimerEventDefinition", { timeDuration });
    const wait = factory.create("bpmn:IntermediateCatchEvent", { eventDefinitions: [timer] });
    expect(nameOf(catalogue, wait)).toBe("Wait 90 s");
  });

  it("are theirs until their author names them", () => {
    const task = surveying("field", "uav1");
    expect(isNamedByItself(catalogue, task)).toBe(false);
    task.set("name", "Area survey field by uav1");
    expect(isNamedByItself(catalogue, task)).toBe(true);
    task.set("name", "My survey");
    expect(isNamedByItself(catalogue, task)).toBe(false);
  });
});
