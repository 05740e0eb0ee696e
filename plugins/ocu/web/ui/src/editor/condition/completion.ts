// What may come next in a condition or a script: names of data, values, operators, functions.
import type { Outline } from "../../shared/types";

export interface Decided {
  /** The name that gets the decision. */
  store: string;
  values: { value: string; label: string }[];
}

export interface Completion {
  value: string;
  note?: string;
  group: Group;
}

export type Group = "names" | "values" | "operators" | "functions";

export interface Completions {
  /** What is replaced: from here to the cursor. */
  from: number;
  options: Completion[];
}

const WORD = /[\p{L}_][\p{L}\p{N}_.-]*$/u;
const COMPARED = /([\p{L}_][\p{L}\p{N}_.-]*)\s*(==|!=|=)\s*(['"]?)([^'"]*)$/u;
const AFTER_OPERAND = /(?:[\p{L}\p{N}_)\]]|['"])\s+$/u;
const AFTER_OPERATOR_WORD = /\b(?:and|or|not|in)\s+$/;
const OPERATORS = ["==", "!=", "<", "<=", ">", ">=", "and", "or", "in", "+", "-", "*", "/"];
const ENDED = /['")\]\p{N}]$/u;
const CONSTANTS = ["true", "false", "null"];
/** docs/conditions.md */
const FUNCTIONS = [
  ...["abs", "ceil", "contains", "date", "distance", "duration", "ends_with", "exists", "floor"],
  ...[
    "is_empty",
    "length",
    "lower",
    "max",
    "min",
    "mod",
    "number",
    "round",
    "sqrt",
    "starts_with",
    "sum",
  ],
  ...["text", "upper"],
];

export function complete(
  text: string,
  cursor: number,
  names: Outline["names"],
  decided: readonly Decided[],
): Completions {
  const before = text.slice(0, cursor);
  return (
    afterComparison(before, decided) ??
    insideText(before) ??
    afterOperand(before) ??
    word(before, names)
  );
}

/** After `user.decision ==`: what the prompts that write it may give. */
function afterComparison(before: string, decided: readonly Decided[]): Completions | undefined {
  const match = COMPARED.exec(before);
  if (!match) return undefined;
  const [, name = "", , quote = "", said = ""] = match;
  if (!quote && /\s\S*\s/.test(said)) return undefined;
  const values = new Map<string, string>();
  for (const { store, values: given } of decided) {
    if (store === name) for (const { value, label } of given) values.set(value, label);
  }
  if (values.size === 0) return undefined;
  const mark = quote || "'";
  const options = [...values]
    .filter(([value]) => value.startsWith(said.trim()))
    .map(([value, label]) => ({
      value: `${mark}${value}${mark}`,
      note: label === value ? "" : label,
      group: "values" as const,
    }));
  return { from: before.length - said.trimStart().length - quote.length, options };
}

/** Nothing is offered inside a text. */
function insideText(before: string): Completions | undefined {
  const quotes = before.match(/(?<!\\)['"]/g) ?? [];
  return quotes.length % 2 === 1 ? { from: before.length, options: [] } : undefined;
}

function afterOperand(before: string): Completions | undefined {
  if (!AFTER_OPERAND.test(before) || AFTER_OPERATOR_WORD.test(before)) return undefined;
  const options = OPERATORS.map((value) => ({ value: `${value} `, group: "operators" as const }));
  return { from: before.length, options };
}

function word(before: string, names: Outline["names"]): Completions {
  const typed = WORD.exec(before)?.[0] ?? "";
  if (typed === "" && ENDED.test(before)) return { from: before.length, options: [] };
  const fits = (value: string) => value.toLowerCase().includes(typed.toLowerCase());
  const starts = (value: string) => typed !== "" && value.startsWith(typed);
  const known = names.map(({ name, from }) => ({
    value: name,
    note: from,
    group: "names" as const,
  }));
  const constants = CONSTANTS.map((value) => ({ value, group: "values" as const }));
  const functions = FUNCTIONS.map((value) => ({ value: `${value}(`, group: "functions" as const }));
  const options = [
    ...known.filter(({ value }) => fits(value)),
    ...constants.filter(({ value }) => starts(value)),
    ...functions.filter(({ value }) => starts(value)),
  ];
  const isWhole = options.length === 1 && options[0]?.value === typed;
  return { from: before.length - typed.length, options: isWhole ? [] : options };
}
