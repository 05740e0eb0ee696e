import { BpmnModdle } from "bpmn-moddle";
import { describe, expect, it } from "vitest";
import { emptyMission, freeName, isName, nameOfFile } from "./files";

describe("names of missions", () => {
  it("are names of files without a path", () => {
    for (const name of ["vignette1", "Bridge 2", "a.b-c_d", "Brücke"])
      expect(isName(name)).toBe(true);
    for (const name of ["", ".hidden", "a/b", "..", "a ", "a.", "a.bpmn", "x".repeat(101)]) {
      expect(isName(name)).toBe(false);
    }
  });

  it("come from the names of files", () => {
    expect(nameOfFile("patrol.bpmn")).toBe("patrol");
    expect(nameOfFile("search.bpmn20.xml")).toBe("search");
    expect(nameOfFile("../a:b.bpmn")).toBe("a_b");
    expect(nameOfFile(".bpmn")).toBe("mission");
  });

  it("are counted up until one is free", () => {
    expect(freeName("a", ["b"])).toBe("a");
    expect(freeName("a", ["a", "a 2"])).toBe("a 3");
  });
});

describe("an empty mission", () => {
  it("can be read, whatever its name", async () => {
    const { warnings } = await new BpmnModdle().fromXML(emptyMission('R&D <"1">'));
    expect(warnings).toEqual([]);
  });
});
