import { BpmnModdle } from "bpmn-moddle";
import { describe, expect, it } from "vitest";
import { m2pemDescriptor } from "./descriptor";

const MISSIONS = import.meta.glob<string>("../../../../../../../missions/*.bpmn", {
  query: "?raw",
  import: "default",
  eager: true,
});

async function rewritten(xml: string) {
  const moddle = new BpmnModdle({ m2pem: m2pemDescriptor });
  const { rootElement, warnings } = await moddle.fromXML(xml);
  const written = await moddle.toXML(rootElement, { format: true });
  return { xml: written.xml, warnings };
}

/** What stands in a file, whatever the order of attributes and children of one tag. */
function parts(xml: string): string[] {
  const found = xml.replace(/<!--[\s\S]*?-->/g, "").match(/<[\w:]+[^>]*>/g) ?? [];
  return found
    .map((tag) => {
      const [, name = "", rest = ""] = /^<([\w:]+)([\s\S]*?)\/?>$/.exec(tag) ?? [];
      return [name, ...(rest.match(/[\w:]+="[^"]*"/g) ?? []).sort()].join(" ");
    })
    .sort();
}

describe("missions as the editor reads and writes them", () => {
  it("are found", () => expect(Object.keys(MISSIONS).length).toBeGreaterThan(5));

  for (const [file, xml] of Object.entries(MISSIONS)) {
    it(`keeps everything of ${file.split("/").at(-1)}`, async () => {
      const once = await rewritten(xml);
      expect(once.warnings).toEqual([]);
      expect(parts(once.xml).filter((part) => !part.startsWith("bpmn:definitions"))).toEqual(
        parts(xml.replace(/<!\[CDATA\[[\s\S]*?\]\]>/g, "")).filter(
          (part) => !part.startsWith("bpmn:definitions"),
        ),
      );
      expect((await rewritten(once.xml)).xml).toBe(once.xml);
    });
  }

  it("keeps what only m2pem writes, and what it does not know", async () => {
    const inside = [
      '<m2pem:behavior type="team" name="escort" note="x">',
      '<m2pem:property name="type" value="team" />',
      '<m2pem:properties><m2pem:property name="speed">2 m/s</m2pem:property></m2pem:properties>',
      '<m2pem:resources><m2pem:role name="s" team="section" optional="1" /></m2pem:resources>',
      '<other:thing xmlns:other="urn:other" a="b"><other:more>text</other:more></other:thing>',
      "</m2pem:behavior>",
      '<m2pem:service class="Detector"><m2pem:role name="a" payload="v/p" />',
      '<m2pem:property name="type" value="gpr" /></m2pem:service>',
      '<m2pem:userTask store="a.b" role="commander" timeout="PT5M">',
      '<m2pem:prompt>Go?</m2pem:prompt><m2pem:decision value="y" label="Yes" /></m2pem:userTask>',
      '<m2pem:in source="a" target="b" /><m2pem:out source="c" target="d" />',
      '<m2pem:requirement id="r" pattern="visit"><m2pem:arg name="n" value="v" />',
      "</m2pem:requirement>",
    ].join("");
    const xml = `<?xml version="1.0" encoding="UTF-8"?>
<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
  xmlns:m2pem="https://m2pem.org/schema/1" xmlns:camunda="http://camunda.org/schema/1.0/bpmn"
  targetNamespace="urn:x">
  <signal id="s" name="Stop" m2pem:from="operator" m2pem:returned="v" />
  <message id="m" m2pem:correlationKey="order.id" />
  <process id="P"><task id="T"><extensionElements>${inside}</extensionElements></task>
    <userTask id="U" m2pem:store="a.b" />
    <serviceTask id="V" camunda:class="Detector" m2pem:service="Detector"/>
    <subProcess id="S"><multiInstanceLoopCharacteristics m2pem:collection="fields"
      m2pem:elementVariable="field" /></subProcess>
    <adHocSubProcess id="A" m2pem:activeElements="list" />
  </process></definitions>`;
    const { xml: written } = await rewritten(xml);
    const inFile = parts(xml).filter((part) => !part.startsWith("definitions"));
    const kept = parts(written).filter((part) => !part.startsWith("definitions"));
    expect(kept).toEqual(inFile);
    expect(written).toContain("2 m/s");
    expect(written).toContain(">text<");
  });
});
