import { expect, test } from "vitest";
import { Announcer, DEFAULTS, type AlertSettings } from "./announcer";
import type { OperatorAlert } from "./types";

const alert = (id: string, more: Partial<OperatorAlert> = {}): OperatorAlert => ({
  alert: id,
  severity: "error",
  code: "LINK_LOST",
  text: `${id} is lost`,
  raised_us: 0,
  last_us: 0,
  run: "",
  resources: [],
  subject: "",
  count: 1,
  details: [],
  deadline_us: null,
  cleared_us: null,
  acknowledged_by: "",
  acknowledged_us: null,
  owner: "",
  owned_us: null,
  age_s: 0,
  left_s: null,
  calls: true,
  ...more,
});

function listening(settings: Partial<AlertSettings> = {}) {
  const told: string[] = [];
  const announcer = new Announcer(
    {
      sound: (severity) => told.push(`sound ${severity}`),
      vibrate: (severity) => told.push(`vibrate ${severity}`),
      notify: (severity, text) => told.push(`notify ${severity} ${text}`),
      speak: (text) => told.push(`speak ${text}`),
    },
    () => ({ ...DEFAULTS, sound: "warning", vibrate: false, ...settings }),
    (count, first) => `${count} alerts: ${first}`,
  );
  announcer.announce([]);
  return { announcer, told };
}

test("what was there before the page is not told", () => {
  const { announcer, told } = listening();
  const late = new Announcer(
    { sound: () => told.push("x"), vibrate() {}, notify() {}, speak() {} },
    () => DEFAULTS,
    String,
  );
  late.announce([alert("a1")]);
  announcer.announce([]);
  expect(told).toEqual([]);
});

test("a new alert is told once, in each way that is wanted", () => {
  const { announcer, told } = listening({ notify: true, vibrate: true, speech: true });
  announcer.announce([alert("a1", { run: "r1" })]);
  announcer.announce([alert("a1", { run: "r1" })]);
  expect(told).toEqual([
    "sound error",
    "vibrate error",
    "notify error r1: a1 is lost",
    "speak r1: a1 is lost",
  ]);
});

test("a thousand that come together are told together, by the worst of them", () => {
  const { announcer, told } = listening({ notify: true });
  const many = Array.from({ length: 1000 }, (_, number) => alert(`a${number}`));
  announcer.announce([...many, alert("b", { severity: "critical" })]);
  expect(told).toEqual(["sound critical", "notify critical 1001 alerts: b is lost"]);
});

test("only alerts that are severe enough sound", () => {
  const { announcer, told } = listening({ sound: "error" });
  announcer.announce([alert("a1", { severity: "warning" })]);
  expect(told).toEqual([]);
  announcer.announce([alert("a1", { severity: "warning" }), alert("a2")]);
  expect(told).toEqual(["sound error"]);
});

test("until a person has chosen, only what is critical sounds", () => {
  const { announcer, told } = listening({ sound: DEFAULTS.sound });
  announcer.announce([]);
  announcer.announce([alert("a1", { severity: "error" })]);
  expect(told).toEqual([]);
  announcer.announce([alert("a1", { severity: "error" }), alert("a2", { severity: "critical" })]);
  expect(told).toEqual(["sound critical"]);
});

test("a critical one sounds again until it is acknowledged, and not if sound is off", () => {
  const { announcer, told } = listening();
  const critical = alert("a1", { severity: "critical" });
  announcer.announce([critical]);
  announcer.again();
  announcer.announce([{ ...critical, acknowledged_by: "anna", calls: false }]);
  announcer.again();
  expect(told).toEqual(["sound critical", "sound critical"]);
  const silent = listening({ sound: "off" });
  silent.announcer.announce([critical]);
  silent.announcer.again();
  expect(silent.told).toEqual([]);
});

test("what somebody has acknowledged meanwhile, and a notice, are not told", () => {
  const { announcer, told } = listening();
  announcer.announce([
    alert("a1", { calls: false, acknowledged_by: "otto" }),
    alert("a2", { severity: "notice" }),
  ]);
  expect(told).toEqual([]);
});
