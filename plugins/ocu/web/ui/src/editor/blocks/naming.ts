// What an element is called until its author names it: by what it does, where, and who does it.
import { fill, strings } from "../../strings";
import { behaviorOf, serviceOf, type BehaviorUse } from "../moddle/behavior";
import { child, isA, list, text, type ModdleElement } from "../moddle/moddle";
import { promptOf } from "../moddle/prompts";
import type { Catalogue } from "../session/catalogue";
import { isIsoDuration, shownDuration } from "../session/durations";
import { isExpression } from "../session/quantities";
import { titleOf } from "./blocks";
import { isOpenPlace } from "./control/open";

const words = strings.editor.names;
const PLACES = new Set(["route", "area", "point", "position", "vehicle"]);
const LONGEST_QUESTION = 40;

/** Whether it is called what it would be called by itself: its name may change as it does. */
export function isNamedByItself(catalogue: Catalogue, element: ModdleElement): boolean {
  const name = text(element, "name");
  return isOpenPlace(element) || (name !== "" && name === nameOf(catalogue, element));
}

/** "": it has no such name. */
export function nameOf(catalogue: Catalogue, element: ModdleElement): string {
  const use = behaviorOf(element);
  if (use?.name) return behaviorName(catalogue, use);
  if (isA(element, "bpmn:UserTask")) return questionName(promptOf(element).prompt.text);
  if (isA(element, "bpmn:ServiceTask")) return serviceOf(element)?.name ?? "";
  if (isA(element, "bpmn:CallActivity")) return callName(text(element, "calledElement"));
  return timerName(element);
}

export function behaviorName(catalogue: Catalogue, use: BehaviorUse): string {
  const parameters = catalogue.meant(use)?.parameters ?? [];
  const places = new Set(parameters.filter(({ kind }) => PLACES.has(kind)).map(({ name }) => name));
  const isNamed = (value: string) => value !== "" && !isExpression(value) && !value.includes("[");
  const place = use.parameters.find(({ name, value }) => places.has(name) && isNamed(value));
  const who = use.roles.map(({ resource }) => resource).filter(Boolean);
  return [
    titleOf(use.name),
    place?.value,
    who.length ? fill(words.by, { who: who.join(", ") }) : undefined,
  ]
    .filter(Boolean)
    .join(" ");
}

function questionName(question: string): string {
  const [line = ""] = question.trim().split("\n");
  if (line === "") return strings.editor.blocks.askTitle;
  const isLong = line.length > LONGEST_QUESTION;
  return fill(words.ask, {
    question: isLong ? `${line.slice(0, LONGEST_QUESTION - 1).trimEnd()}…` : line,
  });
}

const callName = (called: string): string =>
  called ? fill(words.call, { called }) : strings.control.names.call;

function timerName(element: ModdleElement): string {
  const timer = list(element, "eventDefinitions").find((each) =>
    isA(each, "bpmn:TimerEventDefinition"),
  );
  const after = timer && child(timer, "timeDuration");
  const body = after ? text(after, "body").trim() : "";
  if (!isIsoDuration(body)) return "";
  const { names } = strings.control;
  const pattern = isA(element, "bpmn:BoundaryEvent") ? names.late : names.wait;
  return fill(pattern, { duration: shownDuration(body) });
}
