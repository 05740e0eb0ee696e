import { describe, expect, test } from "vitest";
import { described, kindOf, labelOf, type NamedElement } from "./elementNames";

const element = (type: string, more: Partial<NamedElement> = {}): NamedElement => ({
  $type: `bpmn:${type}`,
  id: "e1",
  ...more,
});

describe("an element in words", () => {
  test("is called by its name, on one line", () => {
    expect(labelOf(element("Task", { name: " Drive\n the  route " }))).toBe("Drive the route");
  });

  test("is called by what it is, or by its id, without a name", () => {
    expect(labelOf(element("ParallelGateway"))).toBe("Fork or join");
    expect(labelOf(element("Task"))).toBe("e1");
  });

  test("is called by its text if it is an annotation", () => {
    expect(labelOf(element("TextAnnotation", { text: "as rehearsed" }))).toBe("as rehearsed");
  });

  test("has the kind that BPMN gives it, with what an event is about", () => {
    const of = (...types: string[]) => ({
      eventDefinitions: types.map((type) => ({ $type: `bpmn:${type}EventDefinition` })),
    });
    expect(kindOf(element("ScriptTask"))).toBe("script task");
    expect(kindOf(element("BoundaryEvent", of("Timer")))).toBe("timer boundary event");
    expect(kindOf(element("StartEvent", of("Signal", "Message")))).toBe("multiple start event");
  });

  test("has its states behind", () => {
    const drawn = { businessObject: element("Task", { name: "Look" }) };
    expect(described(drawn, ["active", "", "2 problems"])).toBe("Look, task, active, 2 problems");
  });

  test("leads from one element to another", () => {
    const end = (name: string) => ({ businessObject: element("Task", { name }) });
    const flow = { source: end("Look"), target: end("Return") };
    const named = { ...flow, businessObject: element("SequenceFlow", { name: "found" }) };
    expect(described(named)).toBe("found, sequence flow from Look to Return");
    const bare = { ...flow, businessObject: element("SequenceFlow") };
    expect(described(bare)).toBe("sequence flow from Look to Return");
  });
});
