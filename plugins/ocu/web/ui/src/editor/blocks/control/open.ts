// Places that are still open: script tasks whose author has still to say what is done.
import { OPEN_PLACES } from "../../../strings/openPlaces";
import { behaviorOf } from "../../moddle/behavior";
import { isA, text, type ModdleElement } from "../../moddle/moddle";

export function isOpenPlace(object: ModdleElement): boolean {
  if (!isA(object, "bpmn:ScriptTask") || behaviorOf(object)) return false;
  const name = text(object, "name");
  const isOpen = Object.values(OPEN_PLACES).some((open) => name.startsWith(open));
  return isOpen && text(object, "script") === "";
}
