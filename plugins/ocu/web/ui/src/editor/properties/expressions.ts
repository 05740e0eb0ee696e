// Texts of BPMN's formal expressions: conditions, timers, counts.
import { adopt, child, text, type Factory, type ModdleElement } from "../moddle/moddle";

export function expressionText(owner: ModdleElement, name: string): string {
  const expression = child(owner, name);
  return expression ? text(expression, "body").trim() : "";
}

/** The language that the file gives an expression; "": none. */
export function expressionLanguage(owner: ModdleElement, name: string): string {
  const expression = child(owner, name);
  return expression ? text(expression, "language") : "";
}

/** The properties that make an owner's expression say something else; "" removes it. */
export function expressionProperties(
  factory: Factory,
  owner: ModdleElement,
  name: string,
  body: string,
): Record<string, unknown> {
  if (body.trim() === "") return { [name]: undefined };
  const before = child(owner, name);
  const language = before && text(before, "language");
  const made = factory.create("bpmn:FormalExpression", { body, ...(language ? { language } : {}) });
  adopt(owner, made);
  return { [name]: made };
}
