// What a user task asks: said by the task itself, or by a data object that it reads.
import { extensions, replaced, type Change } from "./extensions";
import { adopt, child, isA, list, text, type Factory, type ModdleElement } from "./moddle";

export interface Decision {
  value: string;
  label: string;
}

export interface PromptUse {
  text: string;
  decisions: Decision[];
  store: string;
  role: string;
  timeout: string;
}

export const DEFAULT_STORE = "user.decision";

const SETTINGS = ["store", "role", "timeout"] as const;
const TYPES = ["m2pem:UserTask", "m2pem:Prompt", "m2pem:Decision"];

/** A prompt with the element that carries it: the task, or the data object that the task reads. */
export interface Asked {
  carrier: ModdleElement;
  prompt: PromptUse;
}

export function promptOf(task: ModdleElement): Asked {
  const carriers = saysSomething(task)
    ? [task]
    : [...dataObjects(task).filter(saysSomething), task];
  const carrier = carriers[0] ?? task;
  return { carrier, prompt: readPrompt(carrier) };
}

export function readPrompt(carrier: ModdleElement): PromptUse {
  const wrappers = extensions(carrier, "m2pem:UserTask");
  const prompts = [
    ...wrappers.flatMap((each) => list(each, "prompts")),
    ...extensions(carrier, "m2pem:Prompt"),
  ];
  const decisions = [
    ...wrappers.flatMap((each) => list(each, "decisions")),
    ...extensions(carrier, "m2pem:Decision"),
  ];
  const setting = (name: string) => {
    const own = isA(carrier, "bpmn:UserTask") ? text(carrier, `m2pem:${name}`) : "";
    return own || firstOf([...wrappers, ...prompts].map((each) => text(each, name)));
  };
  return {
    text: firstOf(prompts.map((each) => dedented(text(each, "body")))),
    decisions: decisions.map(readDecision),
    store: setting("store"),
    role: setting("role"),
    timeout: setting("timeout"),
  };
}

/** Says what an element asks, in one form: a prompt, its decisions, and settings if there are any. */
export function setPrompt(factory: Factory, carrier: ModdleElement, use: PromptUse): Change[] {
  const made: ModdleElement[] = [];
  const settings = Object.fromEntries(
    SETTINGS.filter((name) => use[name] !== "").map((name) => [name, use[name]]),
  );
  const others = extensions(carrier, "m2pem:UserTask").flatMap((each) => list(each, "others"));
  if (Object.keys(settings).length || others.length) {
    const wrapper = factory.create("m2pem:UserTask", {
      ...settings,
      ...(others.length ? { others } : {}),
    });
    adopt(wrapper, ...others);
    made.push(wrapper);
  }
  if (use.text) made.push(factory.create("m2pem:Prompt", { body: use.text }));
  for (const { value, label } of use.decisions) {
    made.push(
      factory.create("m2pem:Decision", label && label !== value ? { value, label } : { value }),
    );
  }
  const changes = [replaced(factory, carrier, TYPES, made)];
  if (isA(carrier, "bpmn:UserTask")) {
    const old = SETTINGS.filter((name) => text(carrier, `m2pem:${name}`) !== "");
    const properties = Object.fromEntries(old.map((name) => [`m2pem:${name}`, undefined]));
    if (old.length) changes.push({ target: carrier, properties });
  }
  return changes;
}

function saysSomething(element: ModdleElement): boolean {
  if (TYPES.some((type) => extensions(element, type).length > 0)) return true;
  return (
    isA(element, "bpmn:UserTask") && SETTINGS.some((name) => text(element, `m2pem:${name}`) !== "")
  );
}

function dataObjects(task: ModdleElement): ModdleElement[] {
  return list(task, "dataInputAssociations")
    .flatMap((each) => list(each, "sourceRef"))
    .flatMap((each) => {
      const object = isA(each, "bpmn:DataObjectReference")
        ? child(each, "dataObjectRef")
        : undefined;
      return object ? [each, object] : [each];
    });
}

function readDecision(element: ModdleElement): Decision {
  const value = (text(element, "value") || text(element, "body")).trim();
  return { value, label: text(element, "label") || value };
}

function dedented(body: string): string {
  const lines = body.trim().split("\n");
  return lines.map((line) => line.trim()).join("\n");
}

function firstOf(values: readonly string[]): string {
  return values.find((value) => value !== "") ?? "";
}
