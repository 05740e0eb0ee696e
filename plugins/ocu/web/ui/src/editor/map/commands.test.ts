import { BpmnModdle } from "bpmn-moddle";
import { describe, expect, it } from "vitest";
import { m2pemDescriptor } from "../moddle/descriptor";
import {
  geometriesOf,
  processesIn,
  putGeometries,
  removeGeometry,
  renameUses,
} from "../moddle/geometries";
import type { Change } from "../moddle/extensions";
import type { Factory, ModdleElement } from "../moddle/moddle";
import { commandsOf, inFlowOrder, placeIn } from "./commands";

const moddle = new BpmnModdle({ m2pem: m2pemDescriptor });
const factory: Factory = {
  create: (type, attributes) => moddle.create(type, attributes) as ModdleElement,
};
const LANE = '{"type":"LineString","coordinates":[[7,50],[7.001,50]]}';
const lane = (name: string) => `<m2pem:geometry name="${name}">${LANE}</m2pem:geometry>`;

async function read(processes: string): Promise<ModdleElement> {
  const xml = `<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
    xmlns:m2pem="https://m2pem.org/schema/1">${processes}</definitions>`;
  const { rootElement, warnings } = await moddle.fromXML(xml);
  expect(warnings).toEqual([]);
  return rootElement as ModdleElement;
}

const drive = (id: string, parameter: string, who = "ugv1") =>
  `<scriptTask id="${id}" name="${id} it"><extensionElements><m2pem:behavior type="vehicle" name="go">
    <m2pem:properties><m2pem:property name="where" value="${parameter}"/></m2pem:properties>
    <m2pem:resources><m2pem:role name="driver" vehicle="${who}"/></m2pem:resources>
   </m2pem:behavior></extensionElements></scriptTask>`;
const flow = (source: string, target: string) =>
  `<sequenceFlow id="${source}-${target}" sourceRef="${source}" targetRef="${target}"/>`;

function apply(changes: readonly Change[]): void {
  for (const { target, properties } of changes) {
    for (const [name, value] of Object.entries(properties)) target.set(name, value);
  }
}

const ids = (elements: readonly ModdleElement[]) => elements.map((each) => each.get("id"));

describe("geometries of a mission", () => {
  it("are read by name, but for those that cannot be drawn", async () => {
    const definitions = await read(
      `<process id="P"><extensionElements>${lane("b")}${lane("a")}
        <m2pem:geometry name="odd">{"type":"Point","coordinates":["x",1]}</m2pem:geometry>
        <m2pem:geometry name="no">no</m2pem:geometry></extensionElements></process>`,
    );
    expect(geometriesOf(definitions).map(({ name, kind, from }) => [name, kind, from])).toEqual([
      ["a", "route", "mission"],
      ["b", "route", "mission"],
    ]);
    expect(geometriesOf(undefined)).toEqual([]);
  });

  it("are written, changed, renamed and removed, and what else stands there is kept", async () => {
    const definitions = await read(
      `<process id="CALLED"/><process id="P" isExecutable="true"><extensionElements>
        <m2pem:requirement id="r" ltl="true"/></extensionElements>${drive("T", "lane")}</process>`,
    );
    const point: GeoJSON.Feature = {
      type: "Feature",
      properties: { altitude_frame: "amsl" },
      geometry: { type: "Point", coordinates: [7, 50, 120] },
    };
    apply(putGeometries(factory, definitions, [{ name: "lane", feature: point }]));
    apply(putGeometries(factory, definitions, [{ name: "gate", feature: point, before: "lane" }]));
    const [task] = inFlowOrder(definitions);
    apply(renameUses(factory, task!, "lane", "gate"));
    const { xml } = await moddle.toXML(definitions as never);
    const again = await read(xml.replace(/^[\s\S]*?<definitions[^>]*>|<\/definitions>/g, ""));
    expect(geometriesOf(again)).toMatchObject([
      { name: "gate", kind: "point", altitude_frame: "amsl" },
    ]);
    expect(xml).toContain('value="gate"');
    expect(xml).toContain('<m2pem:requirement id="r"');
    expect(processesIn(again)[0]!.get("extensionElements")).toBeUndefined();
    apply(removeGeometry(factory, definitions, "gate"));
    expect(geometriesOf(definitions)).toEqual([]);
  });
});

describe("commands on the map", () => {
  it("are numbered as the flow goes, through calls, and what follows a failure comes last", async () => {
    const definitions = await read(
      `<process id="INNER">${drive("Inside", "lane")}</process>
       <process id="P" isExecutable="true">${drive("Second", "[50, 7, 20]", "uav1")}
        <startEvent id="S"/>${drive("First", "lane")}<callActivity id="Call" calledElement="INNER"/>
        <boundaryEvent id="Fails" attachedToRef="First"><errorEventDefinition id="e"/></boundaryEvent>
        ${drive("Home", "lane")}
        ${flow("S", "First")}${flow("First", "Call")}${flow("Call", "Second")}${flow("Fails", "Home")}
        ${flow("Second", "First")}
       </process>`,
    );
    link(definitions);
    const geometries = geometriesOf(
      await read(`<process id="P"><extensionElements>${lane("lane")}</extensionElements></process>`),
    );
    const found = commandsOf(definitions, geometries);
    expect(found.map(({ task, number, who }) => [task, number, who])).toEqual([
      ["First", 1, "ugv1"],
      ["Inside", 2, "ugv1"],
      ["Second", 3, "uav1"],
      ["Home", 4, "ugv1"],
    ]);
    expect(found[2]!.at).toEqual({ latitude: 50, longitude: 7, altitude: null });
    expect(found[0]!.geometry).toBe("lane");
  });

  it("go through a thousand tasks that stand in a row", async () => {
    const names = Array.from({ length: 1000 }, (_, index) => `T${index}`);
    const flows = names.slice(1).map((name, index) => flow(names[index]!, name));
    const tasks = [...names].reverse().map((name) => `<task id="${name}"/>`);
    const definitions = await read(`<process id="P">${tasks.join("")}${flows.join("")}</process>`);
    link(definitions);
    expect(ids(inFlowOrder(definitions))).toEqual(names);
  });

  it("knows places that are written as coordinates", () => {
    expect(placeIn("[38.1, -77.3, 20]")).toEqual({
      latitude: 38.1,
      longitude: -77.3,
      altitude: null,
    });
    expect(["[95, 7]", "enu [1, 2]", "${x}", "lane"].map(placeIn)).toEqual([null, null, null, null]);
  });
});

/** As bpmn-js does when it draws: elements know the flows at their ends. */
function link(definitions: ModdleElement): void {
  for (const process of processesIn(definitions)) {
    for (const each of process.get("flowElements") as ModdleElement[]) {
      const [source, target] = ["sourceRef", "targetRef"].map((name) => each.get(name));
      if (!source || !target) continue;
      ends(source as ModdleElement, "outgoing").push(each);
      ends(target as ModdleElement, "incoming").push(each);
    }
  }
}

function ends(node: ModdleElement, name: string): ModdleElement[] {
  const known = node.get(name) as ModdleElement[];
  if (!known.length) node.set(name, known);
  return known;
}
