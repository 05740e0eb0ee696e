import { describe, expect, it } from "vitest";
import { age, clock, clockTenths, heading_deg } from "./format";

describe("format", () => {
  it("writes mission time", () => {
    expect([clock(4), clock(64.9), clock(7209), clock(-1)]).toEqual([
      "0:04",
      "1:04",
      "2:00:09",
      "0:00",
    ]);
    expect(clockTenths(4.27)).toBe("0:04.2");
  });

  it("writes ages in the unit that fits", () => {
    expect([age(5), age(119), age(600), age(9000)]).toEqual(["5 s", "119 s", "10 min", "3 h"]);
  });

  it("turns yaw into a heading", () => {
    expect(heading_deg(0)).toBe(90);
    expect(heading_deg(Math.PI / 2)).toBe(0);
    expect(heading_deg(-Math.PI / 2)).toBe(180);
    expect(heading_deg(Math.PI)).toBe(270);
  });
});
