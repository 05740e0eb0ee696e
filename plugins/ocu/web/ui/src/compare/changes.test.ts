import { BpmnModdle } from "bpmn-moddle";
import { describe, expect, it } from "vitest";
import { m2pemDescriptor } from "../editor/moddle/descriptor";
import type { Geometry } from "../shared/types";
import { changesOf } from "./changes";
import { geometryChanges } from "./geometryChanges";

const MISSIONS = import.meta.glob<string>("../../../../../../missions/*.bpmn", {
  query: "?raw",
  import: "default",
  eager: true,
});

const read = async (xml: string) =>
  (await new BpmnModdle({ m2pem: m2pemDescriptor }).fromXML(xml)).rootElement;

const compared = async (before: string, after: string) =>
  changesOf(await read(before), await read(after));

const DRIVE = `<bpmn:scriptTask id="Drive" name="Drive"><bpmn:extensionElements>
  <m2pem:behavior type="vehicle" name="drive_route"><m2pem:properties>
  <m2pem:property name="route" value="alpha"/><m2pem:property name="speed" value="3 m/s"/>
  </m2pem:properties><m2pem:resources><m2pem:role name="v" vehicle="ugv1"/></m2pem:resources>
  </m2pem:behavior></bpmn:extensionElements></bpmn:scriptTask>`;

const mission = (inside: string, x = 100) => `<?xml version="1.0" encoding="UTF-8"?>
<bpmn:definitions xmlns:bpmn="http://www.omg.org/spec/BPMN/20100524/MODEL"
  xmlns:bpmndi="http://www.omg.org/spec/BPMN/20100524/DI"
  xmlns:dc="http://www.omg.org/spec/DD/20100524/DC" xmlns:m2pem="https://m2pem.org/schema/1"
  id="D" targetNamespace="urn:x"><bpmn:process id="P" name="Patrol">
  <bpmn:startEvent id="Start"/>${inside}</bpmn:process>
  <bpmndi:BPMNDiagram id="Di"><bpmndi:BPMNPlane id="Pl" bpmnElement="P">
  <bpmndi:BPMNShape id="S_di" bpmnElement="Start"><dc:Bounds x="${x}" y="80" width="36"
  height="36"/></bpmndi:BPMNShape></bpmndi:BPMNPlane></bpmndi:BPMNDiagram></bpmn:definitions>`;

const TIMER = (duration: string) => `<bpmn:intermediateCatchEvent id="Wait" name="Wait">
  <bpmn:timerEventDefinition id="T"><bpmn:timeDuration>${duration}</bpmn:timeDuration>
  </bpmn:timerEventDefinition></bpmn:intermediateCatchEvent>`;

describe("changes of a mission", () => {
  it("is tried with the missions of this repository", () => {
    expect(Object.keys(MISSIONS).length).toBeGreaterThan(5);
  });

  it.each(Object.entries(MISSIONS))("are none between %s and itself", async (_, xml) => {
    expect(await compared(xml, xml)).toEqual([]);
  });

  it("say what m2pem's own properties were and are", async () => {
    const after = DRIVE.replace("3 m/s", "5 m/s").replace("ugv1", "ugv2");
    expect(await compared(mission(DRIVE), mission(after))).toEqual([
      {
        kind: "changed",
        id: "Drive",
        label: "Drive",
        details: [
          "behavior, speed: 3 m/s → 5 m/s",
          "behavior, role v, vehicle: ugv1 → ugv2",
        ],
      },
    ]);
  });

  it("are none of what refers to an element that has another name", async () => {
    const flow = '<bpmn:sequenceFlow id="F" sourceRef="Start" targetRef="Drive"/>';
    const after = DRIVE.replace('name="Drive"', 'name="To the gate"');
    const changes = await compared(mission(DRIVE + flow), mission(after + flow));
    expect(changes.map(({ id }) => id)).toEqual(["Drive"]);
  });

  it("say that another behavior is commanded, and what of it is left out", async () => {
    const after = DRIVE.replace('name="drive_route"', 'name="hold"').replace(
      '<m2pem:property name="route" value="alpha"/>',
      "",
    );
    const [change] = await compared(mission(DRIVE), mission(after));
    expect(change?.details).toEqual([
      "behavior: drive_route → hold",
      "behavior, route: alpha is left out",
    ]);
  });

  it("say a duration, and what was added and removed", async () => {
    const timed = await compared(mission(TIMER("PT5M")), mission(TIMER("PT10M")));
    expect(timed.map(({ details }) => details)).toEqual([["duration: PT5M → PT10M"]]);
    const other = await compared(mission(DRIVE), mission(TIMER("PT5M")));
    expect(other.map(({ kind, id }) => [kind, id])).toEqual([
      ["added", "Wait"],
      ["removed", "Drive"],
    ]);
  });

  it("say what was only moved", async () => {
    const found = await compared(mission(""), mission("", 160));
    expect(found).toEqual([
      { kind: "moved", id: "Start", label: "start event Start", details: [] },
    ]);
  });
});

const route = (name: string, coordinates: number[][]): Geometry => ({
  name,
  kind: "route",
  geometry: { type: "LineString", coordinates },
  altitude_frame: "relative",
  from: "mission",
  by: "",
  at_us: null,
});

describe("changes of routes", () => {
  it("say which vertices are in other places", () => {
    const before = [[0, 0], [0, 0.001], [0, 0.002]];
    const after = [[0, 0], [0.001, 0.001], [0, 0.002]];
    const [change] = geometryChanges([route("a", before)], [route("a", after)]);
    expect(change?.kind).toBe("changed");
    expect(change?.details[0]).toBe("1 vertex is in another place");
    expect(change?.gone).toHaveLength(1);
    expect(change?.come[0]?.longitude).toBe(0.001);
  });

  it("say what is new, gone and the same, and other heights", () => {
    const line = [[0, 0, 10], [0, 0.001, 10]];
    const higher = [[0, 0, 20], [0, 0.001, 20]];
    const found = geometryChanges(
      [route("a", line), route("b", line), route("c", line)],
      [route("b", line), route("c", higher), route("d", line)],
    );
    expect(found.map(({ name, kind }) => [name, kind])).toEqual([
      ["b", "same"],
      ["c", "changed"],
      ["d", "added"],
      ["a", "removed"],
    ]);
    expect(found[1]?.details).toEqual(["heights of vertices are others"]);
  });
});
