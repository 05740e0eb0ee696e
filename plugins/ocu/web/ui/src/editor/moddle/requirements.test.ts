import { BpmnModdle } from "bpmn-moddle";
import { describe, expect, it } from "vitest";
import { m2pemDescriptor } from "./descriptor";
import { list, type Factory, type ModdleElement } from "./moddle";
import {
  freeId,
  requirementsOf,
  setRequirements,
  splitList,
  type Requirement,
} from "./requirements";

const moddle = new BpmnModdle({ m2pem: m2pemDescriptor });
const factory: Factory = {
  create: (type, attributes) => moddle.create(type, attributes) as ModdleElement,
};

async function read(inside: string) {
  const xml = `<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
    xmlns:m2pem="https://m2pem.org/schema/1" xmlns:tool="urn:tool"><process id="P">
    <extensionElements>${inside}</extensionElements></process></definitions>`;
  const { rootElement, warnings } = await moddle.fromXML(xml);
  expect(warnings).toEqual([]);
  const definitions = rootElement as ModdleElement;
  return { definitions, process: list(definitions, "rootElements")[0]! };
}

async function put(process: ModdleElement, requirements: Requirement[]) {
  for (const { target, properties } of setRequirements(factory, process, requirements)) {
    for (const [name, value] of Object.entries(properties)) target.set(name, value);
  }
}

const BOTH = `<m2pem:requirement id="asked" ltl="[] !active(Drive)" fair="true"/>
  <m2pem:requirement id="both" pattern="visit" text="both fields" tool:note="n"
    assume="no-failures, operators-answer" monitor="false" onViolation="error:UNSAFE">
    <m2pem:arg name="locations" value="North"/><m2pem:arg name="locations" value="South"/>
  </m2pem:requirement>`;

describe("requirements", () => {
  it("are formulas, or patterns with arguments", async () => {
    const { process } = await read(BOTH);
    expect(requirementsOf(process)).toEqual([
      {
        id: "asked",
        text: "",
        ltl: "[] !active(Drive)",
        pattern: "",
        args: {},
        fair: "true",
        assume: "",
        monitor: "",
        onViolation: "",
      },
      {
        id: "both",
        text: "both fields",
        ltl: null,
        pattern: "visit",
        args: { locations: ["North", "South"] },
        fair: "",
        assume: "no-failures, operators-answer",
        monitor: "false",
        onViolation: "error:UNSAFE",
      },
    ]);
  });

  it("are written as they were read, with what this editor does not know", async () => {
    const { definitions, process } = await read(BOTH);
    const [asked, both] = requirementsOf(process) as [Requirement, Requirement];
    await put(process, [{ ...both, text: "each field" }, asked]);
    const { xml } = await moddle.toXML(definitions);
    expect(xml).toContain('text="each field"');
    expect(xml).toContain('tool:note="n"');
    expect(xml).toContain('monitor="false"');
    expect(xml).toContain('onViolation="error:UNSAFE"');
    expect(xml).toContain('fair="true"');
    expect(xml).toContain('assume="no-failures, operators-answer"');
    expect(xml).not.toContain('assume=""');
    expect(xml).not.toContain('ltl=""');
    expect(requirementsOf(process).map(({ id }) => id)).toEqual(["both", "asked"]);
  });

  it("leave nothing behind when the last one goes", async () => {
    const { definitions, process } = await read(BOTH);
    await put(process, []);
    expect((await moddle.toXML(definitions)).xml).not.toContain("extensionElements");
  });
});

it("splits lists at commas that stand in no parentheses", () => {
  expect(splitList("North, commanded(uav1, goto) ,South")).toEqual([
    "North",
    "commanded(uav1, goto)",
    "South",
  ]);
});

it("gives each requirement an id of its own", () => {
  expect(freeId("visit", ["visit", "visit-2"])).toBe("visit-3");
});
