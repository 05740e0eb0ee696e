// @ts-ignore: the package may have no types.
import { BpmnModdle } from "bpmn-moddle";
import vignette1 from "../../../../../../../missions/vignette1.bpmn?raw";
import { describe, expect, it } from "vitest";
import { missionModel } from "./missionModel";
import { drawnAs, keyOf } from "./names";
import type { Definitions } from "./moddle";

async function modelOf(xml: string, first = "", qualifier = "") {
  const { rootElement } = await new BpmnModdle().fromXML(xml);
  return missionModel(
    [{ name: "m.bpmn", qualifier, xml, definitions: rootElement as unknown as Definitions }],
    first,
  );
}

const HEAD = `<bpmn:definitions xmlns:bpmn="http://www.omg.org/spec/BPMN/20100524/MODEL"
  xmlns:bpmndi="http://www.omg.org/spec/BPMN/20100524/DI" xmlns:m2pem="https://m2pem.org/schema/1"
  xmlns:dc="http://www.omg.org/spec/DD/20100524/DC" id="D">`;

const shape = (id: string, expanded = "") =>
  `<bpmndi:BPMNShape id="${id}_di" bpmnElement="${id}" ${expanded}>
     <dc:Bounds x="0" y="0" width="9" height="9"/></bpmndi:BPMNShape>`;

const diagram = (about: string, shapes: string) =>
  `<bpmndi:BPMNDiagram id="${about}_diagram">
     <bpmndi:BPMNPlane id="${about}_pl" bpmnElement="${about}">${shapes}</bpmndi:BPMNPlane>
   </bpmndi:BPMNDiagram>`;

const NESTED = `${HEAD}
  <bpmn:signal id="s1" name="Dust"/>
  <bpmn:signal id="s2" name="Go" m2pem:from="operator"/>
  <bpmn:process id="P" name="Main">
    <bpmn:task id="B"><bpmn:incoming>f</bpmn:incoming></bpmn:task>
    <bpmn:startEvent id="A"><bpmn:outgoing>f</bpmn:outgoing></bpmn:startEvent>
    <bpmn:sequenceFlow id="f" sourceRef="A" targetRef="B"/>
    <bpmn:subProcess id="S" name="Inside">
      <bpmn:task id="C"/>
      <bpmn:subProcess id="T" name="Deeper"><bpmn:task id="E"/></bpmn:subProcess>
    </bpmn:subProcess>
    <bpmn:callActivity id="K" calledElement="Q"/>
    <bpmn:boundaryEvent id="X" attachedToRef="B"/>
  </bpmn:process>
  <bpmn:process id="Q"><bpmn:task id="B" name="Other B"/></bpmn:process>
`;

describe("mission model", () => {
  it("has the elements in the order in which tokens come to them", async () => {
    const model = await modelOf(`${NESTED}</bpmn:definitions>`);
    expect(model.trees[0]!.children.map(({ id }) => id)).toEqual(["A", "B", "X", "S", "K"]);
    expect(model.node("P", "T")!.children[0]!.id).toBe("E");
    expect(model.node("P", "K")!.calls).toBe("Q");
    expect(model.label("P", "A")).toBe("Start");
  });

  it("begins with the process that the run began with", async () => {
    const model = await modelOf(`${NESTED}</bpmn:definitions>`, "Q");
    expect(model.trees.map(({ id }) => id)).toEqual(["Q", "P"]);
  });

  it("names signals, those of operators first", async () => {
    const model = await modelOf(`${NESTED}</bpmn:definitions>`);
    expect(model.signals.map(({ name, operators }) => [name, operators])).toEqual([
      ["Go", true],
      ["Dust", false],
    ]);
    expect(model.definition("s1")).toBe("Dust");
  });

  it("has a view for each diagram and for the inside of each collapsed subprocess", async () => {
    const drawn = ["A", "B", "S", "K"].map((id) => shape(id)).join("");
    const model = await modelOf(
      `${NESTED}${diagram("P", drawn)}${diagram("S", shape("C") + shape("T", 'isExpanded="true"') + shape("E"))}
       ${diagram("Q", "")}</bpmn:definitions>`,
    );
    expect(
      model.views.map(({ root, title, inside, diagram }) => [root, title, inside, diagram]),
    ).toEqual([
      ["P", "Main", "", "P_diagram"],
      ["S_plane", "Inside", "0/P", "P_diagram"],
    ]);
    expect(model.viewOf("P", "E")!.root).toBe("S_plane");
    expect(model.viewOf("P", "K")!.root).toBe("P");
    expect(model.viewOf("Q", "B")).toBeUndefined();
  });

  it("finds what is inside a collapsed subprocess though it is drawn in the same plane", async () => {
    const drawn = ["S", "C", "T", "E"].map((id) => shape(id)).join("");
    const model = await modelOf(`${NESTED}${diagram("P", drawn)}</bpmn:definitions>`);
    expect(model.viewOf("P", "S")!.root).toBe("P");
    expect(model.viewOf("P", "C")!.root).toBe("S_plane");
    expect(model.viewOf("P", "E")!.root).toBe("T_plane");
    expect(model.viewOf("P", "E")!.inside).toBe("0/S_plane");
  });

  it("names what is in a called file as records do", async () => {
    const model = await modelOf(
      `${NESTED}${diagram("P", shape("A"))}</bpmn:definitions>`,
      "",
      "sub",
    );
    expect(model.trees.map(({ id }) => id)).toEqual(["sub:P", "sub:Q"]);
    expect(model.node("sub:P", "sub:E")!.label).toBe("E");
    expect(model.viewOf("sub:P", "sub:A")!.root).toBe("P");
    expect(model.definition("sub:s1")).toBe("Dust");
  });

  it("shows pools in one view", async () => {
    const model = await modelOf(vignette1, "VIGNETTE1");
    expect(model.views.map(({ title }) => title)).toEqual(["VIGNETTE1 + DETECTION"]);
    expect(model.viewOf("DETECTION", "DriveRoute")).toBe(model.views[0]);
  });
});

describe("names of records", () => {
  it("are those of the drawing, also where it must have others", () => {
    expect(drawnAs("sub:1f3c-99")).toBe("sub:_1f3c-99");
    expect(drawnAs("a~b")).toBe("_a_b");
    expect(drawnAs("sub:Task_1")).toBe("sub:Task_1");
    expect(keyOf("P", "9a")).toBe(keyOf("P", "_9a"));
  });
});
