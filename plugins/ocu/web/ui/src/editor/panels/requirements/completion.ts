// What may come next in a formula: elements, resources, behaviors, data, operators.
import type { Completion, Completions, Decided } from "../../condition/completion";

export interface Vocabulary {
  /** Processes too. */
  elements: readonly { id: string; name: string; type: string }[];
  resources: readonly string[];
  behaviors: readonly string[];
  names: readonly { name: string; from: string }[];
  decided: readonly Decided[];
}

export interface FormulaCompletion extends Omit<Completion, "group"> {
  group: FormulaGroup;
}

export type FormulaGroup =
  "elements" | "resources" | "behaviors" | "names" | "values" | "atoms" | "operators";

export interface FormulaCompletions extends Omit<Completions, "options"> {
  options: FormulaCompletion[];
}

const ATOMS = ["active(", "completed(", "commanded(", "ended", "count("];
const PREFIXES = ["[] ", "<> ", "!", "once ", "historically ", "("];
const OPERATORS = ["-> ", "&& ", "|| ", "<-> ", "U ", "W ", "since "];
const COMPARISONS = ["== ", "!= ", "< ", "<= ", "> ", ">= "];
const ENDS = ["completed", "terminated", "failed"];

const OF_ELEMENT = /\b(?:active|completed)\(\s*(['"]?)([^'"()]*)$/;
const OF_RESOURCE = /\bcommanded\(\s*([^(),\s]*)$/;
const OF_BEHAVIOR = /\bcommanded\(\s*[^(),\s]+\s*,\s*(\w*)$/;
const OF_END = /\bended\(\s*(\w*)$/;
const COMPARED = /([\p{L}_][\p{L}\p{N}_.-]*)\s*(?:==|!=)\s*(['"]?)([^'"]*)$/u;
const AFTER_NAME = /[\p{L}_][\p{L}\p{N}_.-]*\s+$/u;
const AFTER_OPERAND = /(?:[\p{L}\p{N}_)]|['"])\s+$/u;
const AFTER_WORD = /\b(?:U|W|since|once|historically|and|or|not)\s+$/;
const WORD = /[\p{L}_][\p{L}\p{N}_.-]*$/u;

/** `isCondition`: an element alone means its completion. */
export function completeFormula(
  text: string,
  cursor: number,
  vocabulary: Vocabulary,
  isCondition: boolean,
): FormulaCompletions {
  const before = text.slice(0, cursor);
  return (
    element(before, vocabulary) ??
    resource(before, vocabulary) ??
    behavior(before, vocabulary) ??
    end(before) ??
    value(before, vocabulary) ??
    operator(before) ??
    word(before, vocabulary, isCondition)
  );
}

type Part = FormulaCompletions | undefined;

function part(before: string, typed: string, options: FormulaCompletion[]): FormulaCompletions {
  const isWhole = options.length === 1 && options[0]?.value === typed;
  return { from: before.length - typed.length, options: isWhole ? [] : options };
}

const has = (typed: string) => (text: string) => text.toLowerCase().includes(typed.toLowerCase());

function element(before: string, { elements }: Vocabulary): Part {
  const match = OF_ELEMENT.exec(before);
  if (!match) return undefined;
  const [, quote = "", typed = ""] = match;
  const fits = has(typed);
  const found = elements.filter(({ id, name }) => fits(id) || fits(name));
  const options = quote
    ? found
        .filter(({ name }) => name)
        .map((each) => ({ value: `${each.name}${quote})`, note: each.id }))
    : found.map((each) => ({ value: `${each.id})`, note: each.name || each.type }));
  return part(
    before,
    typed,
    options.map((each) => ({ ...each, group: "elements" })),
  );
}

function resource(before: string, { resources }: Vocabulary): Part {
  const typed = OF_RESOURCE.exec(before)?.[1];
  if (typed === undefined) return undefined;
  return part(
    before,
    typed,
    resources.filter(has(typed)).map((each) => ({ value: each, group: "resources" })),
  );
}

function behavior(before: string, { behaviors }: Vocabulary): Part {
  const typed = OF_BEHAVIOR.exec(before)?.[1];
  if (typed === undefined) return undefined;
  const options = behaviors.filter(has(typed));
  return part(
    before,
    typed,
    options.map((each) => ({ value: `${each})`, group: "behaviors" })),
  );
}

function end(before: string): Part {
  const typed = OF_END.exec(before)?.[1];
  if (typed === undefined) return undefined;
  return part(
    before,
    typed,
    ENDS.filter(has(typed)).map((each) => ({ value: `${each})`, group: "values" })),
  );
}

function value(before: string, { decided }: Vocabulary): Part {
  const match = COMPARED.exec(before);
  if (!match) return undefined;
  const [, name = "", quote = "", said = ""] = match;
  if (!quote && /\S\s/.test(said)) return undefined;
  const values = new Map<string, string>();
  for (const each of decided) {
    if (each.store === name)
      for (const { value: key, label } of each.values) values.set(key, label);
  }
  if (values.size === 0) return undefined;
  const mark = quote || "'";
  const typed = quote + said;
  const options = [...values].filter(([key]) => key.startsWith(said.trim()));
  return part(
    before,
    typed,
    options.map(([key, label]) => ({
      value: `${mark}${key}${mark}`,
      note: label === key ? "" : label,
      group: "values",
    })),
  );
}

function operator(before: string): Part {
  if (!AFTER_OPERAND.test(before) || AFTER_WORD.test(before)) return undefined;
  const compared = AFTER_NAME.test(before) ? COMPARISONS : [];
  const options = [...OPERATORS, ...compared];
  return part(
    before,
    "",
    options.map((each) => ({ value: each, group: "operators" })),
  );
}

function word(before: string, vocabulary: Vocabulary, isCondition: boolean): FormulaCompletions {
  const typed = WORD.exec(before)?.[0] ?? "";
  const fits = has(typed);
  const isFirst = before.trim() === typed;
  const elements = isCondition && isFirst ? vocabulary.elements : [];
  const found = elements.filter(({ id, name }) => fits(id) || fits(name));
  const names = new Map(vocabulary.names.map(({ name, from }) => [name, from]));
  const prefixes = typed === "" ? PREFIXES : PREFIXES.filter((each) => each.startsWith(typed));
  return part(before, typed, [
    ...found.map(({ id, name, type }) => ({
      value: id,
      note: name || type,
      group: "elements" as const,
    })),
    ...ATOMS.filter((each) => each.startsWith(typed)).map((each) => ({
      value: each,
      group: "atoms" as const,
    })),
    ...prefixes.map((each) => ({ value: each, group: "operators" as const })),
    ...[...names]
      .filter(([name]) => fits(name))
      .map(([name, note]) => ({ value: name, note, group: "names" as const })),
  ]);
}
