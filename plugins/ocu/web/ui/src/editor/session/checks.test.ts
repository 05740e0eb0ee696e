import { describe, expect, it, vi } from "vitest";
import type { Check, Finding } from "../../shared/types";
import { Checks } from "./checks";

const finding = (element: string): Finding => ({
  severity: "error",
  rule: "r",
  number: "", file: "",
  line: 1,
  element,
  message: "m",
  remedy: "",
});

function asking() {
  const open: ((check: Check) => void)[] = [];
  const ask = vi.fn((_: string) => new Promise<Check>((resolve) => open.push(resolve)));
  return { open, ask };
}

const settled = () => new Promise((resolve) => setTimeout(resolve, 0));

describe("checks while drawing", () => {
  it("wait for a pause in the drawing", async () => {
    vi.useFakeTimers();
    const { ask } = asking();
    const checks = new Checks(async () => "<xml/>", ask, 400);
    checks.soon();
    vi.advanceTimersByTime(300);
    checks.soon();
    await vi.advanceTimersByTimeAsync(399);
    expect(ask).not.toHaveBeenCalled();
    await vi.advanceTimersByTimeAsync(1);
    expect(ask).toHaveBeenCalledOnce();
    vi.useRealTimers();
  });

  it("show the newest answer, even when an older one comes later", async () => {
    const { open, ask } = asking();
    const checks = new Checks(async () => "<xml/>", ask);
    const first = checks.now();
    await settled();
    const second = checks.now();
    await settled();
    open[1]!({ findings: [finding("new")], outline: null });
    open[0]!({ findings: [finding("old")], outline: null });
    await Promise.all([first, second]);
    expect(checks.of("new")).toHaveLength(1);
    expect(checks.of("old")).toHaveLength(0);
    expect(checks.state.value).toBe("checked");
  });

  it("let those wait who need what is in the mission", async () => {
    const { open, ask } = asking();
    const checks = new Checks(async () => "<xml/>", ask);
    const known = checks.known();
    const outline = { processes: [], elements: [], names: [], signals: [], messages: [] };
    const first = checks.now();
    await settled();
    open[0]!({ findings: [], outline });
    await first;
    expect(await known).toBe(outline);
    expect(await checks.known()).toBe(outline);
  });

  it("say so when nobody answers, and keep what was found", async () => {
    const ask = vi.fn<(xml: string) => Promise<Check>>();
    const checks = new Checks(async () => "<xml/>", ask);
    ask.mockResolvedValueOnce({ findings: [finding("a")], outline: null });
    await checks.now();
    ask.mockRejectedValueOnce(new Error("gone"));
    await checks.now();
    expect(checks.state.value).toBe("failed");
    expect(checks.of("a")).toHaveLength(1);
  });
});
