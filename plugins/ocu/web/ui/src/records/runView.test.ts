import { describe, expect, it } from "vitest";
import { apply, copy, emptyView, type RunView } from "./runView";
import { RECORDS } from "./testing";

function after(seq: number): RunView {
  const view = emptyView();
  for (const record of RECORDS.slice(0, seq)) apply(view, record);
  return view;
}

describe("run view", () => {
  it("has the states of elements that came last", () => {
    expect(after(2).elements.P!.Ask).toMatchObject({ active: 1, hits: 1, last: 0 });
    expect(after(5).elements.P!.Ask).toMatchObject({ active: 0, hits: 1, last: 4, failed: false });
    expect(after(12).elements.P!.Drive!.failed).toBe(true);
  });

  it("has a prompt until it is closed", () => {
    expect([...after(3).prompts.keys()]).toEqual(["p1"]);
    expect(after(4).prompts.size).toBe(0);
  });

  it("has a behavior until it has ended", () => {
    expect(after(7).commands.get("r1.b1")).toMatchObject({ name: "go", element: "Drive", since: 4 });
    expect(after(11).commands.size).toBe(0);
  });

  it("follows pause, resume and end", () => {
    expect(after(9).status).toBe("paused");
    expect(after(10).status).toBe("running");
    expect(after(14)).toMatchObject({ status: "failed", detail: "nobody caught BLOCKED", t: 9 });
  });

  it("has the operators who have taken a resource", () => {
    const view = after(1);
    const taken = { ...RECORDS[0]!, seq: 90, record: "OperatorTookControl" };
    apply(view, { ...taken, changes: { holders: { v1: "anna" } } });
    expect(view.holders.get("v1")).toBe("anna");
    apply(view, { ...taken, seq: 91, changes: { holders: { v1: null } } });
    expect(view.holders.size).toBe(0);
  });

  it("changes nothing for a record that it knows", () => {
    const view = after(6);
    apply(view, { ...RECORDS[5]!, changes: { status: "failed" } });
    expect(view.status).toBe("running");
  });

  it("is not changed through its copy", () => {
    const kept = after(6);
    const going = copy(kept);
    for (const record of RECORDS.slice(6)) apply(going, record);
    expect(kept).toEqual(after(6));
  });
});
