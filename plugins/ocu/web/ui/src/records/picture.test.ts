import { describe, expect, it } from "vitest";
import { copy, emptyPicture, fold, type Picture } from "./picture";
import { RECORDS } from "./testing";

function after(seq: number): Picture {
  const picture = emptyPicture();
  for (const record of RECORDS.slice(0, seq)) fold(picture, record);
  return picture;
}

describe("picture", () => {
  it("has an element active while a token is on it", () => {
    expect(after(2).elements.P!.Ask).toMatchObject({ active: 1, hits: 1, last: 0 });
    expect(after(5).elements.P!.Ask).toMatchObject({ active: 0, hits: 1, last: 4, failed: false });
  });

  it("tells that an element asks until its question is answered", () => {
    expect(after(3).elements.P!.Ask!.asking).toBe(true);
    expect([...after(3).prompts.keys()]).toEqual(["p1"]);
    expect(after(4).elements.P!.Ask!.asking).toBe(false);
    expect(after(4).prompts.size).toBe(0);
  });

  it("keeps what is commanded, and by which element", () => {
    expect(after(7).commands.get("r1.b1")).toEqual({
      name: "go",
      resources: ["v1"],
      process: "P",
      element: "Drive",
      since: 4,
    });
    expect(after(11).commands.size).toBe(0);
  });

  it("marks the element that its last token left as failed, until one enters again", () => {
    const picture = after(12);
    expect(picture.elements.P!.Drive!.failed).toBe(true);
    fold(picture, { ...RECORDS[5]!, seq: 99 });
    expect(picture.elements.P!.Drive!.failed).toBe(false);
  });

  it("follows pause, resume and end", () => {
    expect(after(9).status).toBe("paused");
    expect(after(10).status).toBe("running");
    expect(after(14)).toMatchObject({ status: "failed", detail: "nobody caught BLOCKED", t: 9 });
  });

  it("counts instances, not the token around them", () => {
    const picture = emptyPicture();
    const at = { run: "r1", t: 1, process: "P", element: "Each" };
    fold(picture, { ...at, seq: 1, record: "TokenEntered", token: 1 });
    fold(picture, { ...at, seq: 2, record: "ScopeOpened", scope: 2, token: 1, instances: 2 });
    expect(picture.elements.P!.Each).toMatchObject({ active: 0, hits: 0 });
    fold(picture, { ...at, seq: 3, record: "TokenEntered", token: 2, instance: 0 });
    fold(picture, { ...at, seq: 4, record: "TokenEntered", token: 3, instance: 1 });
    expect(picture.elements.P!.Each).toMatchObject({ active: 2, hits: 2 });
    for (const [seq, token] of [
      [5, 2],
      [6, 3],
      [7, 1],
    ] as const) {
      fold(picture, { ...at, seq, record: "TokenLeft", token, outcome: "completed" });
    }
    expect(picture.elements.P!.Each).toMatchObject({ active: 0, hits: 2 });
  });

  it("changes nothing for a record that it knows", () => {
    const picture = after(6);
    fold(picture, RECORDS[5]!);
    expect(picture.elements.P!.Drive).toMatchObject({ active: 1, hits: 1 });
  });

  it("is not changed through its copy", () => {
    const kept = after(6);
    const going = copy(kept);
    for (const record of RECORDS.slice(6)) fold(going, record);
    expect(kept).toEqual(after(6));
  });
});
