import { describe, expect, it } from "vitest";
import { follow, type Activity } from "./follow";

const views = (...entries: [string, number, boolean, number][]): Map<string, Activity> =>
  new Map(entries.map(([key, active, asks, last]) => [key, { active, asks, last }]));

describe("follow", () => {
  it("stays where something goes on", () => {
    expect(follow(views(["a", 1, false, 1], ["b", 3, false, 9]), "a")).toBe("a");
  });

  it("goes where the newest activity is, when nothing goes on here", () => {
    expect(follow(views(["b", 1, false, 4], ["c", 1, false, 9]), "a")).toBe("c");
    expect(follow(views(["a", 0, false, 20], ["b", 1, false, 4]), "a")).toBe("b");
  });

  it("goes where somebody asks", () => {
    expect(follow(views(["a", 1, false, 9], ["b", 1, true, 1]), "a")).toBe("b");
    expect(follow(views(["a", 1, true, 1], ["b", 1, true, 9]), "a")).toBe("a");
  });

  it("stays when nothing goes on anywhere", () => {
    expect(follow(views(), "a")).toBe("a");
  });
});
