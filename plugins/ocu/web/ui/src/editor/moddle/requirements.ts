// What an author requires of a mission: m2pem:requirement in a process's extension elements
// (docs/requirements.md).
import { extensions, replaced, type Change } from "./extensions";
import { adopt, list, successor, text, type Factory, type ModdleElement } from "./moddle";

const TYPE = "m2pem:Requirement";

/** `ltl` null: a pattern with arguments, each with all that was said of it. */
export interface Requirement {
  id: string;
  /** What its author says that it is for. */
  text: string;
  ltl: string | null;
  pattern: string;
  args: Readonly<Record<string, readonly string[]>>;
  fair: "" | "true" | "false";
  /** What is assumed, such as "no-failures"; "": nothing. */
  assume: string;
  /** Whether runs are monitored for it; "": they are. */
  monitor: "" | "true" | "false";
  /** What a violation in a run throws: "error:CODE" or "signal:ID"; "": nothing. */
  onViolation: string;
}

export function requirementsOf(process: ModdleElement): Requirement[] {
  return extensions(process, TYPE).map(read);
}

export function setRequirements(
  factory: Factory,
  process: ModdleElement,
  requirements: readonly Requirement[],
): Change[] {
  const before = extensions(process, TYPE);
  const made = requirements.map((each) => {
    const old = before.find((other) => text(other, "id") === each.id);
    return old && same(read(old), each) ? old : write(factory, each, old);
  });
  return [replaced(factory, process, [TYPE], made)];
}

/** The parts between the commas that stand in no parentheses: a list in one argument. */
export function splitList(value: string): string[] {
  const parts = [""];
  let depth = 0;
  for (const character of value) {
    if ("([".includes(character)) depth += 1;
    if (")]".includes(character)) depth -= 1;
    if (character === "," && depth === 0) parts.push("");
    else parts[parts.length - 1] += character;
  }
  return parts.map((part) => part.trim());
}

/** An id that no other requirement has. */
export function freeId(base: string, taken: Iterable<string>): string {
  const others = new Set(taken);
  let id = base;
  for (let number = 2; others.has(id); number += 1) id = `${base}-${number}`;
  return id;
}

function read(element: ModdleElement): Requirement {
  const args: Record<string, string[]> = {};
  for (const each of list(element, "args")) {
    (args[text(each, "name")] ??= []).push(text(each, "value"));
  }
  const truth = (name: string) => {
    const value = text(element, name);
    return value === "true" || value === "false" ? value : "";
  };
  return {
    id: text(element, "id"),
    text: text(element, "text"),
    ltl: text(element, "pattern") ? null : text(element, "ltl"),
    pattern: text(element, "pattern"),
    args,
    fair: truth("fair"),
    assume: text(element, "assume"),
    monitor: truth("monitor"),
    onViolation: text(element, "onViolation"),
  };
}

function write(factory: Factory, requirement: Requirement, before?: ModdleElement): ModdleElement {
  const args = Object.entries(requirement.ltl === null ? requirement.args : {}).flatMap(
    ([name, values]) => values.map((value) => factory.create("m2pem:Arg", { name, value })),
  );
  const made = successor(
    factory,
    TYPE,
    {
      id: requirement.id,
      text: requirement.text || undefined,
      ltl: requirement.ltl ?? undefined,
      pattern: requirement.ltl === null ? requirement.pattern : undefined,
      fair: requirement.fair || undefined,
      assume: requirement.assume || undefined,
      monitor: requirement.monitor || undefined,
      onViolation: requirement.onViolation || undefined,
      args: args.length ? args : undefined,
    },
    before,
  );
  adopt(made, ...args);
  return made;
}

function same(one: Requirement, other: Requirement): boolean {
  return JSON.stringify(one) === JSON.stringify(other);
}
