import { describe, expect, it } from "vitest";
import { openByElement, threadsOf, type MissionComment } from "./threads";

const comment = (id: number, element: string, parent = 0, resolved_by = ""): MissionComment => ({
  id,
  element,
  parent,
  resolved_by,
  label: element,
  text: "text",
  by: "anna",
  at_us: 0,
  version: "",
  resolved_us: 0,
});

const ALL = [
  comment(1, "Drive"),
  comment(2, "Drive", 1),
  comment(3, "", 0, "otto"),
  comment(4, "Ask"),
  comment(5, "Drive", 0, "otto"),
];

describe("threads of comments", () => {
  it("begin with the chosen element; open ones come before those that are settled", () => {
    const order = (chosen: string) => threadsOf(ALL, chosen).map(({ first }) => first.id);
    expect(order("Drive")).toEqual([1, 5, 4, 3]);
    expect(order("")).toEqual([4, 1, 5, 3]);
    expect(threadsOf(ALL, "Drive")[0]?.answers.map(({ id }) => id)).toEqual([2]);
  });

  it("are counted by element while they are open", () => {
    expect([...openByElement(ALL)]).toEqual([
      ["Drive", 1],
      ["Ask", 1],
    ]);
  });
});
