import { describe, expect, it } from "vitest";
import type { Requirement } from "../../moddle/requirements";
import { faultOf, thrownBy } from "./violation";

const NONE: Requirement = {
  id: "safe",
  text: "",
  ltl: "[] true",
  pattern: "",
  args: {},
  fair: "",
  assume: "",
  monitor: "",
  onViolation: "",
};
const SIGNALS = [
  { id: "s1", name: "Abort" },
  { id: "s2", name: "Twice" },
  { id: "s3", name: "Twice" },
];

describe("what a violation throws", () => {
  it.each([
    ["", "", ""],
    ["error:UNSAFE", "error", "UNSAFE"],
    ["signal:urn:a:b", "signal", "urn:a:b"],
    ["error:", "error", ""],
    ["error", "error", ""],
    ["stop", null, "stop"],
    ["alarm:x", null, "alarm:x"],
  ])("%s", (onViolation, kind, name) => {
    expect(thrownBy({ ...NONE, onViolation })).toEqual({ kind, name });
  });

  it.each([
    [{ onViolation: "error:UNSAFE" }, undefined],
    [{ onViolation: "signal:s1" }, undefined],
    [{ onViolation: "signal:Abort" }, undefined],
    [{ monitor: "false" }, undefined],
    [{ ltl: null, pattern: "bound_delay" }, undefined],
    [{ onViolation: "stop" }, "neither"],
    [{ onViolation: "error:" }, "noCode"],
    [{ onViolation: "signal:" }, "noSignal"],
    [{ onViolation: "signal:Twice" }, "unknownSignal"],
    [{ onViolation: "signal:gone" }, "unknownSignal"],
    [{ onViolation: "error:UNSAFE", monitor: "false" }, "unmonitored"],
    [{ onViolation: "error:UNSAFE", ltl: null, pattern: "prompt_reaction" }, "steps"],
  ])("%o: %s", (more, fault) => {
    expect(faultOf({ ...NONE, ...(more as Partial<Requirement>) }, SIGNALS)).toBe(fault);
  });

  it("is no signal where there is none", () => {
    expect(faultOf({ ...NONE, onViolation: "signal:s1" }, [])).toBe("noSignals");
  });
});
