// Places that are still open: script tasks whose author has still to say what is done.
import { strings } from "../../../strings";
import { behaviorOf } from "../../moddle/behavior";
import { isA, text, type ModdleElement } from "../../moddle/moddle";

export function isOpenPlace(object: ModdleElement): boolean {
  if (!isA(object, "bpmn:ScriptTask") || behaviorOf(object)) return false;
  return text(object, "script") === "" && text(object, "name").startsWith(strings.control.open);
}
