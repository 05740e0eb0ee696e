import { describe, expect, it } from "vitest";
import { ServerClock } from "./serverClock";

describe("the executive's clock", () => {
  it("is known from the message that was fastest, and not from those that were held up", () => {
    let own = 10;
    const clock = new ServerClock(() => own);
    expect(clock.now()).toBeNull();
    clock.heard(1000);
    own = 110;
    clock.heard(1040); // sent a minute ago
    expect(clock.now()).toBeCloseTo(1100, 0);
    clock.heard(1100.2);
    expect(clock.now()).toBeCloseTo(1100.2, 3);
  });

  it("follows a clock that is slower", () => {
    let own = 0;
    const clock = new ServerClock(() => own);
    for (own = 0; own < 36_000; own += 1) clock.heard(own * 0.9995);
    expect(clock.now()! - own * 0.9995).toBeLessThan(0.1);
  });

  it("is forgotten with its connection", () => {
    const clock = new ServerClock(() => 5);
    clock.heard(7);
    clock.forget();
    expect(clock.now()).toBeNull();
  });
});
