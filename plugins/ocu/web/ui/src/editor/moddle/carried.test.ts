import { BpmnModdle } from "bpmn-moddle";
import { describe, expect, it } from "vitest";
import { behaviorOf, isByNeed, serviceOf, setBehavior, setService } from "./behavior";
import { m2pemDescriptor } from "./descriptor";
import type { Change } from "./extensions";
import { mappingsOf, setMappings } from "./mappings";
import { list, type Factory, type ModdleElement } from "./moddle";
import { promptOf, setPrompt } from "./prompts";
import { codeOf, makeRoot, referencesOf, rootNamed, uuid } from "./roots";

const moddle = new BpmnModdle({ m2pem: m2pemDescriptor });
const factory: Factory = {
  create: (type, attributes) => moddle.create(type, attributes) as ModdleElement,
};

async function read(inside: string, roots = "") {
  const xml = `<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
    xmlns:m2pem="https://m2pem.org/schema/1" xmlns:camunda="http://camunda.org/schema/1.0/bpmn">
    ${roots}<process id="P">${inside}</process></definitions>`;
  const { rootElement } = await moddle.fromXML(xml);
  const definitions = rootElement as ModdleElement;
  const process = list(definitions, "rootElements").at(-1)!;
  return { definitions, element: list(process, "flowElements")[0]! };
}

async function written(definitions: ModdleElement): Promise<string> {
  return (await moddle.toXML(definitions)).xml;
}

function apply(changes: readonly Change[]): void {
  for (const { target, properties } of changes) {
    for (const [name, value] of Object.entries(properties)) target.set(name, value);
  }
}

const task = (inside: string, attributes = "") =>
  `<scriptTask id="T" ${attributes}><extensionElements>${inside}</extensionElements></scriptTask>`;

describe("behaviors", () => {
  it("reads the head as attributes or as properties", async () => {
    const { element } = await read(
      task(`<m2pem:behavior><m2pem:property name="type" value="vehicle"/>
        <m2pem:property name="name" value="goto"/>
        <m2pem:resources><m2pem:role name="driver" vehicle="evsg1"/></m2pem:resources>
        </m2pem:behavior>`),
    );
    expect(behaviorOf(element)).toEqual({
      type: "vehicle",
      name: "goto",
      parameters: [],
      roles: [{ name: "driver", kind: "vehicle", resource: "evsg1", optional: false }],
    });
  });

  it("keeps other extensions, unknown attributes and the id of a parameter", async () => {
    const { definitions, element } = await read(
      task(`<m2pem:behavior type="vehicle" name="goto" tool:note="n" xmlns:tool="urn:tool">
        <m2pem:properties><m2pem:property id="p1" name="speed" value="1"/></m2pem:properties>
        </m2pem:behavior><camunda:properties/>`),
    );
    const use = behaviorOf(element)!;
    apply(setBehavior(factory, element, { ...use, parameters: [{ name: "speed", value: "2" }] }));
    const xml = await written(definitions);
    expect(xml).toContain('<m2pem:property id="p1" name="speed" value="2"');
    expect(xml).toContain('tool:note="n"');
    expect(xml).toContain("camunda:properties");
  });

  it("keeps and writes what a role needs", async () => {
    const role = `<m2pem:role name="surveyor" requires="vehicle.battery &gt; 0.4" count="1..3"
      store="s" wait="PT10M" onLoss="reassign"/>`;
    const { definitions, element } = await read(
      task(`<m2pem:behavior type="vehicle" name="goto"><m2pem:resources>${role}</m2pem:resources>
        </m2pem:behavior>`),
    );
    const use = behaviorOf(element)!;
    const [read_] = use.roles;
    expect(read_).toMatchObject({ kind: "vehicle", resource: "" });
    expect(isByNeed(read_!)).toBe(true);
    const need = { ...read_!.need, count: "2", priority: "1" };
    apply(setBehavior(factory, element, { ...use, roles: [{ ...read_!, need }] }));
    expect(await written(definitions)).toContain(
      '<m2pem:role name="surveyor" requires="vehicle.battery &#62; 0.4" count="2" store="s"' +
        ' wait="PT10M" priority="1" onLoss="reassign" />',
    );
    const named = { ...read_!, resource: "uav1", need: { wait: "PT1M", keep: "process" } };
    apply(setBehavior(factory, element, { ...use, roles: [named] }));
    expect(await written(definitions)).toContain(
      '<m2pem:role name="surveyor" vehicle="uav1" wait="PT1M" keep="process" />',
    );
  });

  it("leaves no empty extension elements behind", async () => {
    const { definitions, element } = await read(
      task('<m2pem:behavior type="vehicle" name="goto"/>'),
    );
    apply(setBehavior(factory, element, undefined));
    expect(await written(definitions)).not.toContain("extensionElements");
  });
});

describe("services", () => {
  it("moves another engine's class into m2pem:service when it is edited", async () => {
    const { definitions, element } = await read('<serviceTask id="T" camunda:class="Detector"/>');
    const use = serviceOf(element)!;
    expect(use.name).toBe("Detector");
    const role = { name: "sensor", kind: "payload" as const, resource: "v/p", optional: true };
    apply(setService(factory, element, { ...use, roles: [role] }));
    const xml = await written(definitions);
    expect(xml).not.toContain("camunda:class");
    expect(xml).toContain(
      '<m2pem:service class="Detector"><m2pem:role name="sensor" payload="v/p" optional="true" />',
    );
    expect(serviceOf(element)?.roles).toEqual([role]);
  });
});

describe("prompts", () => {
  const asks = `<m2pem:prompt>Go?</m2pem:prompt><m2pem:decision value="yes" label="Yes"/>`;

  it("are read from the task, in every form", async () => {
    const { element } = await read(
      `<userTask id="U" m2pem:store="a.b"><extensionElements>
       <m2pem:userTask role="commander">${asks}</m2pem:userTask></extensionElements></userTask>`,
    );
    expect(promptOf(element).prompt).toEqual({
      text: "Go?",
      decisions: [{ value: "yes", label: "Yes" }],
      store: "a.b",
      role: "commander",
      timeout: "",
    });
    apply(setPrompt(factory, element, { ...promptOf(element).prompt, timeout: "PT5M" }));
    expect(promptOf(element).prompt.timeout).toBe("PT5M");
    expect(element.get("m2pem:store")).toBeUndefined();
  });

  it("are read from the data object that the task reads, and changed there", async () => {
    const { definitions, element } = await read(`<userTask id="U">
      <dataInputAssociation><sourceRef>R</sourceRef></dataInputAssociation></userTask>
      <dataObjectReference id="R" dataObjectRef="O"/>
      <dataObject id="O"><extensionElements>${asks}</extensionElements></dataObject>`);
    const { carrier, prompt } = promptOf(element);
    expect(prompt.text).toBe("Go?");
    apply(setPrompt(factory, carrier, { ...prompt, text: "Stay?" }));
    const xml = await written(definitions);
    expect(xml).toContain('<dataObject id="O"><extensionElements><m2pem:prompt>Stay?');
    expect(xml).toContain('<userTask id="U"><dataInputAssociation>');
  });
});

describe("mappings of a call", () => {
  it("are replaced without touching those of the other direction", async () => {
    const { element } = await read(
      `<callActivity id="C"><extensionElements><m2pem:in source="a" target="b"/>
       <m2pem:out source="c" target="d"/></extensionElements></callActivity>`,
    );
    apply(setMappings(factory, element, "in", [{ source: "x", target: "y" }]));
    expect(mappingsOf(element, "in")).toEqual([{ source: "x", target: "y" }]);
    expect(mappingsOf(element, "out")).toEqual([{ source: "c", target: "d" }]);
  });
});

describe("signals, messages, errors and escalations", () => {
  it("are shared by name, and get an id that XML allows", async () => {
    const { definitions, element } = await read(
      '<endEvent id="E"><signalEventDefinition id="d"/></endEvent>',
    );
    const made = makeRoot(factory, definitions, "signal", "Stop driving");
    apply([made.change]);
    expect(rootNamed(definitions, "signal", "Stop driving")).toBe(made.root);
    expect(referencesOf(element)).toMatchObject([{ kind: "signal", root: undefined }]);
    expect(await written(definitions)).toMatch(
      /<signal id="[a-f][0-9a-f-]{35}" name="Stop driving"/,
    );
    for (let count = 0; count < 100; count += 1) expect(uuid()).toMatch(/^[a-f]/);
  });

  it("have their name as their code", () => {
    expect(codeOf("Route blocked!")).toBe("ROUTE_BLOCKED");
    expect(codeOf("TAKEN_OVER")).toBe("TAKEN_OVER");
  });
});
