import { describe, expect, it } from "vitest";
import { parse } from "yaml";
import { EMPTY, ENDS, yamlOf, type Script } from "./answers";
import keys from "./answersFile.json";
import { scriptOf } from "./readAnswers";

const FILES = import.meta.glob<string>("../../../../../../../../missions/answers/*.yaml", {
  query: "?raw",
  import: "default",
  eager: true,
});
const ALL = { has: () => true } as unknown as ReadonlySet<string>;
const ROWS = { asking: ALL, serving: ALL, commanding: ALL };

const read = (text: string): Script => scriptOf(text, ROWS);

/** What a file says, with durations in seconds. */
function said(text: string): unknown {
  return JSON.parse(JSON.stringify(parse(text)), (name, value: unknown) => {
    if (name !== "after" && name !== "at") return value;
    const [, number, unit] = /^([\d.]+) *(\w*)$/.exec(String(value))!;
    return Number(number) * { "": 1, s: 1, ms: 0.001, min: 60, h: 3600 }[unit!]!;
  }) as unknown;
}

it("finds the answers files of the repository", () => {
  expect(Object.keys(FILES).length).toBeGreaterThan(20);
});

it.each(Object.entries(FILES))("shows all of %s in the form", (_, text) => {
  expect(said(yamlOf(read(text)))).toEqual(said(text));
});

it("reads what the form writes", () => {
  const script: Script = {
    answers: {
      Ask: [
        { decision: "continue", after: "" },
        { decision: "no way", after: "12.345678901234567" },
        { decision: "true", after: "0.000000500" },
      ],
    },
    services: [
      { element: "Detector", after: "5", name: "detection.type", value: "gpr", error: "" },
      { element: "Detector", after: "", name: "", value: "", error: "SENSOR_BROKEN" },
      { element: "Detector", after: "0.5", name: "at", value: '[1,{"x":null}]', error: "" },
    ],
    behaviors: [
      { element: "Drive", after: "", factor: "", end: "simulated", error: "" },
      { element: "Drive", after: "", factor: "1.2345678901234567", end: "simulated", error: "" },
      { element: "Drive", after: "30", factor: "", end: "failed", error: "ROUTE_BLOCKED" },
    ],
    sends: [
      { kind: "signal", id: "dc45ff2b", at: "12.5", data: "reason = dust, depth = 2" },
      { kind: "message", id: "7c1e4a90", at: "0", data: "" },
    ],
    more: "vehicles:\n  uav1:\n    battery: 40 %",
  };
  expect(read(yamlOf(script))).toEqual(script);
  expect(read(yamlOf(EMPTY))).toEqual(EMPTY);
});

it("keeps what has no rows as it is", () => {
  const text = `incidents: {Drive: [{choice: retry_with, roles: {scout: [uav2]}}]}
vehicles: {evsg1: {battery: 0.4, link_lost: [{at: 30 s, for: 2 s}], state: "007"}}
wind: {speed: 6.123456789012345, from: 1.5 rad}
`;
  expect(parse(yamlOf(read(text)))).toEqual(parse(text));
});

it.each(keys.sections)("knows the section %s", (section) => {
  const nothing = section === "signals" || section === "messages" ? "[]" : "{}";
  expect(() => read(`${section}: ${nothing}`)).not.toThrow();
});

it("knows all ends of behaviors", () => {
  expect([...ENDS].sort()).toEqual([...keys.ends].sort());
});

it("takes durations in the units that files use", () => {
  const after = ["90", "1.5 min", "90000 ms", "0.025 h"];
  const rows = after.map((each) => `{after: ${each}, end: stalled}`).join(", ");
  expect(read(`behaviors: {Drive: [${rows}]}`).behaviors.map((each) => each.after)).toEqual(
    after.map(() => "90"),
  );
});

describe("what the form cannot show stays as YAML, with the reason", () => {
  it.each([
    ["answers: {Ask: [continue]", /at line 1, column/],
    ["answers: {Ask: [a], Ask: [b]}", /unique/],
    ["[1]", /^write names with values/],
    ["answer: {}", /^answer: write one of answers, signals, .*, incidents, vehicles, wind$/],
    ["answers: {Ask: [{after: 3}]}", /^answers\.Ask\[0\]\.decision: write a text$/],
    ["answers: {Ask: [{decision: a, at: 3}]}", /^answers\.Ask\[0\]\.at: write one of decision/],
    ["behaviors: {D: [{after: 3, end: simulated}]}", /\.after: what ends by its own motion/],
    ["behaviors: {D: [{end: simulated, factor: 0}]}", /\.factor: write a number above 0/],
    ["behaviors: {D: [{after: 3, end: lost, factor: 2}]}", /\.factor: only what ends by its own/],
    ["answers: {Ask: continue}", /^answers\.Ask: write a list/],
    ["answers: {Ask: [true]}", /^answers\.Ask\[0\]: write a text$/],
    ["services: {S: [{write: {a: 1, b: 2}}]}", /^services\.S\[0\]\.write: the form writes one/],
    ["services: {S: [{write: {a: 1}, error: E}]}", /^services\.S\[0\]: a service writes or fails/],
    ["behaviors: {D: [{end: failed}]}", /^behaviors\.D\[0\]\.after: write a duration/],
    ["behaviors: {D: [{after: 3 m, end: failed}]}", /^behaviors\.D\[0\]\.after: write a duration/],
    ["behaviors: {D: [{after: 3, end: gone}]}", /^behaviors\.D\[0\]\.end: write one of failed, /],
    ["behaviors: {D: [{after: 3, end: stalled, error: E}]}", /\.error: only what fails/],
    ["behaviors: {D: [{after: 3, end: lost, by: me}]}", /^behaviors\.D\[0\]\.by: write one of/],
    ["signals: [{at: 1, id: s, data: {a: [1, 2]}}]", /^signals\[0\]\.data: the form cannot show/],
    ["messages: [{at: 1}]", /^messages\[0\]\.id: write a text$/],
  ])("%s", (text, reason) => {
    expect(() => read(text)).toThrow(reason);
  });

  it("a task that is not there", () => {
    const none = new Set<string>();
    const rows = { asking: new Set(["Ask"]), serving: none, commanding: none };
    expect(() => scriptOf("answers: {Aks: [a]}", rows)).toThrow("answers.Aks: the form has no");
  });

  it("aliases of aliases", () => {
    const lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"];
    for (let n = 1; n < 9; n += 1) {
      const alias = `*a${n - 1}`;
      lines.push(`a${n}: &a${n} [${Array.from({ length: 9 }, () => alias).join(", ")}]`);
    }
    expect(() => read(lines.join("\n"))).toThrow(/alias/);
  });
});
